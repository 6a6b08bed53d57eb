"""Values read off a pressed patch: peak, edges, half-width, stiffnesses, and the peak beside rounded ends that the
cells are too long to show."""

from functools import partial

import numpy as np

from ...closed_forms import contact
from ...contact import edges
from ...core import Outcome
from ...elasticity.lapack import one_thread
from ...slip import shear_modes
from . import strips
from .press import Patch

LIKE = 2.0  # times less bent than its neighbour is still one smooth curve with it
FINE = 4  # cells within the reach of the contact onto the rounding from which meshes show how its peak converges


def peak_pressure(x, sigma, skin=None) -> float:
    """Largest pressure [Pa] of the nodal pressures sigma (m,) [Pa] at x (m,) [m].

    Inside it is the vertex of the parabola through the largest node and its neighbours (`vertex`). At a border of the
    interface the nodal forces of bare pieces are means over half a cell, so it is the end of the curve that has these
    means; a skin holds the pressure at the node. skin: (m,) [1] share of the skin in the compliance of a node, None
    without one.
    """
    top = int(np.argmax(sigma))
    if top in (0, x.size - 1):
        bare = _at_border(x, sigma) if top == 0 else _at_border(-x[::-1], sigma[::-1])
        share = 0.0 if skin is None else float(skin[top])
        return share * float(sigma[top]) + (1 - share) * bare
    return float(vertex(x, sigma[None], np.array([top]))[0])


def vertex(x, sigma, top) -> np.ndarray:
    """Largest pressures (q,) [Pa] of nodal ones sigma (q, m) [Pa] at x (m,) [m] that are largest at the inner nodes top
    (q,).

    Each is the vertex of the parabola through a largest node and its neighbours as long as the parabolas one node on
    are bent like it. Beside a jump they are not: the less the flatter one is bent, the nearer it is to the node itself.
    """
    rows, at = np.arange(top.size), np.clip(top[:, None] + [-1, 0, 1], 1, x.size - 2)  # at a border its own once more
    left, right = x[at] - x[at - 1], x[at + 1] - x[at]
    here = sigma[rows[:, None], at]
    before, after = (here - sigma[rows[:, None], at - 1]) / left, (sigma[rows[:, None], at + 1] - here) / right
    bend = (after - before) / (left + right)
    slope = (before * right + after * left)[:, 1] / (left + right)[:, 1]
    loaded = (sigma[rows, top - 1] > 0) & (sigma[rows, top + 1] > 0) & (bend[:, 1] < 0)
    own = np.where(loaded, bend[:, 1], -1.0)
    alike = np.clip(LIKE * np.minimum(bend[:, 0] / own, bend[:, 2] / own), 0.0, 1.0)
    return sigma[rows, top] + np.where(loaded, alike * slope**2 / (-4 * own), 0.0)


def _at_border(x, sigma) -> float:
    """Pressure [Pa] at the first node: a parabola, of fewer loaded nodes a line, by its means over their cells."""
    count = min(3, int(np.argmin(np.append(sigma, 0.0) > 0)), x.size - 1)
    if count < 2:
        return float(sigma[0])
    cuts = np.concatenate([[0.0], (x[1:count + 1] + x[:count]) / 2 - x[0]]) / (x[1] - x[0])
    power = np.arange(1, count + 1)
    means = np.diff(cuts[:, None]**power, axis=0) / power / np.diff(cuts)[:, None]
    return float(np.linalg.solve(means, sigma[:count])[0])


def values(patch: Patch) -> dict:
    """Value of every static measure of a pressed patch by name, in SI; `rows` has their meanings.

    The node at the edge of a step stands for half a cell on either side of it: the weighted mean of the patch where all
    of it bears and where none does.
    """
    if not patch.either:
        return _values(patch)
    parts = [(weight, _values(one)) for weight, one in patch.either]
    return {name: sum(weight * found[name] for weight, found in parts) for name in parts[0][1]}


def _values(patch: Patch) -> dict:
    p, interface = patch.pressure, patch.pieces.interface
    area, peak = interface.weight.sum(), peak_pressure(patch.x, p.sigma_n, patch.skin_share)
    out = {"normal_load": p.load, "contact_fraction": 0.0, "pressure_peak": peak, "moment": p.moment,
           "rotation": p.rotation, "approach": p.approach, "contact_half_width": 0.0,
           "pressure_centre": p.moment / p.load if p.load > 0 else 0.0, "loaded_fraction": 0.0, "normal_stiffness": 0.0,
           "tangential_stiffness": 0.0, "rotational_stiffness": 0.0}
    if p.outcome is not Outcome.NO_CONTACT:
        out["loaded_fraction"] = p.load / (area * peak)
        if patch.strips is None:
            with one_thread():
                out |= _on_edges(patch)
    if patch.strips is not None:
        out |= strips.strip_values(patch, partial(peak_pressure, skin=patch.skin_share))
    return out


def _on_edges(patch: Patch) -> dict:
    """The values that hang on where the contact ends."""
    x, normal, found, active = patch.x, patch.pieces.normal, contact_ends(patch), patch.active
    stretches = stretches_of(patch, found)
    return {"contact_fraction": float(np.diff(stretches).sum() / np.ptp(x)),
            "contact_half_width": float(stretches[-1, 1] - stretches[0, 0]) / 2,
            "normal_stiffness": edges.stiffness(normal, active, np.ones(x.size), found),
            "tangential_stiffness": shear_stiffness(patch, found),
            "rotational_stiffness": edges.stiffness(normal, active, x, found)}


def stretches_of(patch: Patch, found: list) -> np.ndarray:
    """Stretches of the interface in contact, (k, 2) [m] by rising x, from the ends `found` of `contact_ends`."""
    return edges.intervals(patch.x, patch.pressure.sigma_n * patch.pieces.interface.weight, found)


def contact_ends(patch: Patch) -> list:
    """Ends of the contact set between the nodes, as a list of `contact.edges.End`; of the means over strips none."""
    if patch.strips is not None:
        return []
    found = _between(patch)
    return edges.at_steps(found, patch.x, patch.gap, patch.jumps) if patch.jumps else found


def _between(patch: Patch) -> list:
    """The ends of `contact_ends` as if the gap were smooth."""
    if patch.skin is not None:
        return edges.faded(patch.x, patch.skin.pressure[0], edges.BEARING)
    own, bare = patch.pieces.normal, patch.pair.compliance.normal
    softness = None if own is bare else np.diag(own) - np.diag(bare)
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    return edges.ends(own, patch.x, force, patch.pressure.gap, softness, patch.pair.row)


def shear_stiffness(patch: Patch, found: list) -> float:
    """Tangential stiffness dT/d(slide) [N/m] in stick at held approach and rotation, edges at the ends `found`.

    That of unlike pieces includes the closing that shear causes.
    """
    if not patch.pair.closing.any():
        return edges.stiffness(patch.pieces.tangential, patch.active, np.ones(patch.x.size), found)

    def of(active) -> float:
        return shear_modes.coupled_stiffness(patch.pieces, patch.pair.closing, active)

    whole = out = of(patch.active)
    for end in found if patch.active.sum() > 2 else ():
        more, less = patch.active.copy(), patch.active.copy()
        more[end.node + end.side], less[end.node] = True, False
        out += edges.parabola(end.share - 0.5, of(more) - whole, whole - of(less))
    return float(out)


def edge_cells(x, active) -> np.ndarray:
    """Lengths (e,) [m] of the cells in which the contact set ends; empty for full contact."""
    return np.diff(x)[active[1:] != active[:-1]]


def unresolved_rounding(patch: Patch) -> float:
    """Largest pressure [Pa] that rounded ends may carry between the nodes; 0 where the mesh resolves them.

    The cells where the contact ends carry what a sharp end would, K = sigma_n sqrt(cell); a rounding that these cells
    pass over has its peak by `rounded_corner`.
    """
    pair, x, sigma = patch.pair, patch.x, patch.pressure.sigma_n
    rounded = _rounded(pair)
    loaded = np.flatnonzero(patch.active)
    if not rounded or not loaded.size or patch.pieces is not pair.compliance:  # a skin evens the pressure out
        return 0.0
    flat, radius = min(body.flat for body in rounded), 1 / sum(1 / body.end.size for body in rounded)
    modulus = 1 / sum((1 - nu**2) / young for young, nu in (piece.layers.coating for piece in (pair.piece, pair.upper)))
    found = 0.0
    for at in (loaded[0], loaded[-1]):
        cell = np.diff(x)[max(at - 1, 0):at + 1].max()
        if abs(abs(x[at]) - flat) > 2 * cell:  # the contact ends elsewhere
            continue
        reach, peak = contact.rounded_corner(sigma[max(at - 2, 0):at + 3].max() * np.sqrt(cell), radius, modulus)
        found = max(found, peak if FINE * cell > reach else 0.0)
    return found


def open_ends(patch: Patch) -> float:
    """Length [m] of rounded face, both ends together, within which the contact may end though its last node is in
    contact."""
    rounded = _rounded(patch.pair)
    return patch.active[[0, -1]].sum() * (patch.x[-1] - min(body.flat for body in rounded)) if rounded else 0.0


def beyond_gentle(patch: Patch) -> bool:
    """Whether the contact goes on where a rounded end is steeper than its face may touch.

    A single loaded node whose cell passes over the whole rounding does not tell.
    """
    cells = np.diff(patch.x)[[0, -1]]
    return bool((patch.active[[0, -1]] & (cells < open_ends(patch))).any())


def _rounded(pair) -> list:
    """The bodies on which a rounding ends the interface."""
    return [body for body in (pair.grid, pair.upper_grid)
            if getattr(body, "end", None) is not None and body.end.kind == "radius" and body.rise[-1] > 0]
