"""Values read off a pressed patch: peak, edges, half-width, stiffnesses, and the peak beside rounded ends that the
cells are too long to show."""

from typing import NamedTuple

import numpy as np

from ...closed_forms import contact
from ...contact import edges, stiffness
from ...core import ContactState, Outcome
from ...elasticity.lapack import one_thread
from . import strips
from .press import Patch

LIKE = 2.0  # a parabola that is so many times less bent than its neighbour is still one smooth curve with it
# so many cells within the reach of the contact onto a rounding show how its peak converges
ROUNDING_CELLS = 4


def peak_pressures(x, sigma, skin=None) -> np.ndarray:
    """Return the largest pressures (q,) [Pa] of patches by their nodal pressures.

    Inside the interface it is the vertex of the parabola through the largest node and its neighbours (`vertex`). At a
    border of the interface the nodal forces of bare pieces are means over half a cell, so it is the end of the curve
    that has these means; a skin holds the pressure at the node.

    Parameters
    ----------
    x : (m,) ndarray
        Places of the nodes [m].
    sigma : (q, m) ndarray
        Nodal pressures [Pa].
    skin : (m,) ndarray or None
        Fraction [1] of the compliance of a node that the skin contributes, None without a skin.
    """
    top = np.argmax(sigma, axis=1)
    peaks = sigma.max(axis=1)
    inner = (top > 0) & (top < x.size - 1)
    peaks[inner] = vertex(x, sigma[inner], top[inner])
    for border, step in ((0, 1), (x.size - 1, -1)):
        rows = np.flatnonzero(top == border)
        bare = _border_pressures(np.abs(x[::step] - x[border]), sigma[rows, ::step])
        fraction = 0.0 if skin is None else skin[border]
        peaks[rows] = fraction * peaks[rows] + (1 - fraction) * bare
    return peaks


def vertex(x, sigma, top) -> np.ndarray:
    """Largest pressures (q,) [Pa] of nodal ones sigma (q, m) [Pa] at x (m,) [m] that are largest at the inner nodes top
    (q,).

    Each is the vertex of the parabola through a largest node and its neighbours as long as the parabolas one node on
    are bent like it. Beside a jump they are not: the less the flatter one is bent, the nearer it is to the node itself.
    """
    # at a border its own once more
    rows, at = (
        np.arange(top.size),
        np.clip(top[:, None] + [-1, 0, 1], 1, x.size - 2),
    )
    left, right = x[at] - x[at - 1], x[at + 1] - x[at]
    here = sigma[rows[:, None], at]
    before, after = (
        (here - sigma[rows[:, None], at - 1]) / left,
        (sigma[rows[:, None], at + 1] - here) / right,
    )
    bend = (after - before) / (left + right)
    slope = (before * right + after * left)[:, 1] / (left + right)[:, 1]
    loaded = (sigma[rows, top - 1] > 0) & (sigma[rows, top + 1] > 0) & (bend[:, 1] < 0)
    own = np.where(loaded, bend[:, 1], -1.0)
    alike = np.clip(LIKE * np.minimum(bend[:, 0] / own, bend[:, 2] / own), 0.0, 1.0)
    return sigma[rows, top] + np.where(loaded, alike * slope**2 / (-4 * own), 0.0)


def _border_pressures(x, sigma) -> np.ndarray:
    """Return the pressures (q,) [Pa] at the first node, where a curve begins whose means are the nodal pressures.

    The curve is a parabola through three loaded nodes, a line through two.
    """
    peaks = sigma[:, 0].copy()
    # nodes from the border to the first open one
    loaded = np.argmin(np.pad(sigma > 0, ((0, 0), (0, 1))), axis=1)
    counts = np.minimum(loaded, min(3, x.size - 1))
    for count in (2, 3):
        rows = counts == count
        if rows.any():
            cuts = np.concatenate([[0.0], (x[1 : count + 1] + x[:count]) / 2]) / x[1]
            power = np.arange(1, count + 1)
            means = np.diff(cuts[:, None] ** power, axis=0) / power / np.diff(cuts)[:, None]
            peaks[rows] = np.linalg.solve(means, sigma[rows, :count].T)[0]
    return peaks


class EdgeValues(NamedTuple):
    """Quantities of contacts that depend on where they end, numbers or (q,).

    length [m] in contact; width [m] from the first to the last end; normal, tangential [N/m] and rotational [N m/rad]
    stiffness.
    """

    length: float
    width: float
    normal: float
    tangential: float
    rotational: float


def static_values(interface, pressed: ContactState, peak, edge_values: EdgeValues) -> dict:
    """Return the values of the static measures by name, numbers or (q,) of q patches.

    Parameters
    ----------
    interface : Interface
    pressed : Pressure
        Its load, moment, rotation and approach are numbers or (q,).
    peak : float or (q,) ndarray
        Largest pressure [Pa].
    edge_values : EdgeValues
    """
    is_loaded = np.greater(pressed.load, 0)
    out, force = np.zeros(np.shape(peak)), interface.weight.sum() * peak
    return {
        "normal_load": pressed.load,
        "contact_fraction": edge_values.length / np.ptp(interface.x),
        "pressure_peak": peak,
        "moment": pressed.moment,
        "rotation": pressed.rotation,
        "approach": pressed.approach,
        "contact_half_width": edge_values.width / 2,
        "pressure_centre": np.divide(pressed.moment, pressed.load, out=out.copy(), where=is_loaded)[
            ()
        ],
        "loaded_fraction": np.divide(pressed.load, force, out=out.copy(), where=is_loaded)[()],
        "normal_stiffness": edge_values.normal,
        "tangential_stiffness": edge_values.tangential,
        "rotational_stiffness": edge_values.rotational,
    }


def values(patch: Patch) -> dict:
    """Value of every static measure of a pressed patch by name, in SI; `rows` has their meanings.

    The node at the edge of a step stands for half a cell on either side of it: the weighted mean of the patch where all
    of it bears and where none does.
    """
    parts = [(weight, _values(part)) for weight, part in patch.either or ((1.0, patch),)]
    return {
        name: float(sum(weight * found[name] for weight, found in parts)) for name in parts[0][1]
    }


def _values(patch: Patch) -> dict:
    pressure, interface = patch.pressure, patch.pieces.interface
    if patch.strips is not None:
        peak = peak_pressures(patch.x, patch.strips.pressure, patch.skin_share).max()
        found = static_values(interface, pressure, peak, EdgeValues(0.0, 0.0, 0.0, 0.0, 0.0))
        return found | strips.strip_values(patch)
    peak = peak_pressures(patch.x, pressure.sigma_n[None], patch.skin_share)[0]
    if pressure.outcome is Outcome.NO_CONTACT:
        return static_values(interface, pressure, peak, EdgeValues(0.0, 0.0, 0.0, 0.0, 0.0))
    with one_thread():
        return static_values(interface, pressure, peak, _edge_values(patch))


def _edge_values(patch: Patch) -> EdgeValues:
    """Return the quantities of a patch that depend on where its contact ends."""
    x, normal, active = patch.x, patch.pieces.normal, patch.active
    found = contact_ends(patch)
    stretches = stretches_of(patch, found)
    return EdgeValues(
        length=float(np.diff(stretches).sum()),
        width=float(stretches[-1, 1] - stretches[0, 0]),
        normal=edges.set_stiffness(normal, active, np.ones(x.size), found),
        tangential=shear_stiffness(patch, found),
        rotational=edges.set_stiffness(normal, active, x, found),
    )


def stretches_of(patch: Patch, found: list) -> np.ndarray:
    """Stretches of the interface in contact, (k, 2) [m] by rising x, from the ends `found` of `contact_ends`."""
    return edges.contact_intervals(
        patch.x, patch.pressure.sigma_n * patch.pieces.interface.weight, found
    )


def contact_ends(patch: Patch) -> list:
    """Ends of the contact set between the nodes, as a list of `contact.edges.ContactEdge`; of the means over strips none."""
    if patch.strips is not None:
        return []
    found = _between(patch)
    return edges.snap_to_steps(found, patch.x, patch.gap, patch.jumps) if patch.jumps else found


def _between(patch: Patch) -> list:
    """The ends of `contact_ends` as if the gap were smooth."""
    if patch.skin is not None:
        return edges.find_pressure_edges(
            patch.x, patch.skin.pressure[0], edges.MIN_RELATIVE_PRESSURE
        )
    own, bare = patch.pieces.normal, patch.pair.compliance.normal
    softness = None if own is bare else np.diag(own) - np.diag(bare)
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    return edges.find_edges(own, patch.x, force, patch.pressure.gap, softness, patch.pair.row)


def shear_stiffness(patch: Patch, found: list) -> float:
    """Tangential stiffness dT/d(slide) [N/m] in stick at held approach and rotation, edges at the ends `found`.

    That of unlike pieces includes the closing that shear causes.
    """
    if not patch.pair.closing.any():
        return edges.set_stiffness(
            patch.pieces.tangential, patch.active, np.ones(patch.x.size), found
        )

    def of(active) -> float:
        return stiffness.coupled_stiffness(patch.pieces, patch.pair.closing, active)

    whole = out = of(patch.active)
    for end in found if patch.active.sum() > 2 else ():
        more, less = patch.active.copy(), patch.active.copy()
        more[end.node + end.side], less[end.node] = True, False
        out += edges.parabola_change(end.fraction - 0.5, of(more) - whole, whole - of(less))
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
    # a skin evens the pressure out
    if not rounded or not loaded.size or patch.pieces is not pair.compliance:
        return 0.0
    flat, radius = (
        min(body.half_flat_length for body in rounded),
        1 / sum(1 / body.end.size for body in rounded),
    )
    modulus = 1 / sum(
        (1 - nu**2) / young
        for young, nu in (piece.layers.coating for piece in (pair.piece, pair.upper))
    )
    found = 0.0
    for at in (loaded[0], loaded[-1]):
        cell = np.diff(x)[max(at - 1, 0) : at + 1].max()
        if abs(abs(x[at]) - flat) > 2 * cell:  # the contact ends elsewhere
            continue
        reach, peak = contact.rounded_corner(
            sigma[max(at - 2, 0) : at + 3].max() * np.sqrt(cell), radius, modulus
        )
        found = max(found, peak if ROUNDING_CELLS * cell > reach else 0.0)
    return found


def open_ends(patch: Patch) -> float:
    """Length [m] of rounded face, both ends together, within which the contact may end though its last node is in
    contact."""
    rounded = _rounded(patch.pair)
    return (
        patch.active[[0, -1]].sum() * (patch.x[-1] - min(body.half_flat_length for body in rounded))
        if rounded
        else 0.0
    )


def beyond_gentle(patch: Patch) -> bool:
    """Whether the contact goes on where a rounded end is steeper than its face may touch.

    A single loaded node whose cell passes over the whole rounding does not tell.
    """
    cells = np.diff(patch.x)[[0, -1]]
    return bool((patch.active[[0, -1]] & (cells < open_ends(patch))).any())


def _rounded(pair) -> list:
    """The bodies on which a rounding ends the interface."""
    return [
        body
        for body in (pair.grid, pair.upper_grid)
        if getattr(body, "end", None) is not None
        and body.end.kind == "radius"
        and body.interface_depths[-1] > 0
    ]
