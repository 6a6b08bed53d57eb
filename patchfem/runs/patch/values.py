"""Values of the static measures of a pressed patch, without errors.

In: a `Patch`. Out: values by name: peak pressure, edges, half-width, stiffnesses; and the peak
pressure at rounded ends that the cells do not resolve.
"""

from typing import NamedTuple

import numpy as np

from ...closed_forms import contact
from ...contact import edges, stiffness
from ...core import ContactState, Outcome
from ...elasticity.lapack import one_thread
from . import strips
from .press import Patch

# a parabola may have at most this many times the curvature of its neighbour on a smooth curve
LIKE = 2.0
# cells within the contact on a rounding with which its peak converges
ROUNDING_CELLS = 4


def peak_pressures(x, sigma, skin=None) -> np.ndarray:
    """Return the largest pressures (q,) [Pa] of patches from their nodal pressures.

    Inside the interface it is the vertex of the parabola through the largest node and its
    neighbours (`vertex`). At an end of the interface the nodal forces of bare pieces are means over
    half a cell, so that it is the end of the curve that has these means; with a skin it is the
    pressure of the node.

    Parameters
    ----------
    x : (m,) ndarray
        Positions of the nodes [m].
    sigma : (q, m) ndarray
        Nodal pressures [Pa].
    skin : (m,) ndarray or None
        Fraction [1] of the skin in the compliance of a node; None without a skin.
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
    """Return the vertices (q,) [Pa] of parabolas through the largest nodal pressures.

    A parabola passes through the largest node and its neighbours, if the parabolas of the next
    nodes have a similar curvature. Next to a jump they differ: the smaller the lower curvature, the
    closer the value is to that of the node.

    Parameters
    ----------
    x : (m,)
        Positions of the nodes [m].
    sigma : (q, m)
        Nodal pressures [Pa].
    top : (q,)
        Inner nodes with the largest pressure.
    """
    # at an end of the interface, the parabola itself replaces its missing neighbour
    rows = np.arange(top.size)
    at = np.clip(top[:, None] + [-1, 0, 1], 1, x.size - 2)
    left = x[at] - x[at - 1]
    right = x[at + 1] - x[at]
    here = sigma[rows[:, None], at]
    before = (here - sigma[rows[:, None], at - 1]) / left
    after = (sigma[rows[:, None], at + 1] - here) / right
    bend = (after - before) / (left + right)
    slope = (before * right + after * left)[:, 1] / (left + right)[:, 1]
    loaded = (sigma[rows, top - 1] > 0) & (sigma[rows, top + 1] > 0) & (bend[:, 1] < 0)
    own = np.where(loaded, bend[:, 1], -1.0)
    alike = np.clip(LIKE * np.minimum(bend[:, 0] / own, bend[:, 2] / own), 0.0, 1.0)
    return sigma[rows, top] + np.where(loaded, alike * slope**2 / (-4 * own), 0.0)


def _border_pressures(x, sigma) -> np.ndarray:
    """Return the pressures (q,) [Pa] at the end of curves whose means are nodal pressures.

    The curve is a parabola through three loaded nodes, or a line through two.
    """
    peaks = sigma[:, 0].copy()
    # number of loaded nodes from the end of the interface to the first open one
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
    """Quantities that depend on where a contact ends, numbers or (q,).

    - length: length in contact [m].
    - width: distance between the first and the last end [m].
    - normal, tangential: stiffness [N/m].
    - rotational: stiffness [N m/rad].
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
    pressed : ContactState
        Its load, moment, rotation and approach are numbers or (q,).
    peak : float or (q,) ndarray
        Largest pressure [Pa].
    edge_values : EdgeValues
    """
    is_loaded = np.greater(pressed.load, 0)
    out = np.zeros(np.shape(peak))
    force = interface.weight.sum() * peak
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
    """Return the value of every static measure of a pressed patch by name, in SI units.

    A node at the edge of a step represents half a cell on either side: the value is the weighted
    mean of the patches with and without contact of this node. `patch_rows` has the definitions.
    """
    parts = [(weight, _values(part)) for weight, part in patch.either or ((1.0, patch),)]
    return {
        name: float(sum(weight * found[name] for weight, found in parts)) for name in parts[0][1]
    }


def _values(patch: Patch) -> dict:
    """Return the values of a patch without a node at a step."""
    pressure = patch.pressure
    interface = patch.pieces.interface
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
    x = patch.x
    normal = patch.pieces.normal
    active = patch.active
    found = contact_ends(patch)
    stretches = contact_intervals(patch, found)
    return EdgeValues(
        length=float(np.diff(stretches).sum()),
        width=float(stretches[-1, 1] - stretches[0, 0]),
        normal=edges.set_stiffness(normal, active, np.ones(x.size), found),
        tangential=shear_stiffness(patch, found),
        rotational=edges.set_stiffness(normal, active, x, found),
    )


def contact_intervals(patch: Patch, found: list) -> np.ndarray:
    """Return the parts of the interface in contact (k, 2) [m], by increasing x.

    found: ends of the contact from `contact_ends`.
    """
    return edges.contact_intervals(
        patch.x, patch.pressure.sigma_n * patch.pieces.interface.weight, found
    )


def contact_ends(patch: Patch) -> list:
    """Return the ends of the contact between the nodes, as a list of `ContactEdge`.

    The list is empty for means over strips.
    """
    if patch.strips is not None:
        return []
    found = _ends_without_steps(patch)
    return edges.snap_to_steps(found, patch.x, patch.gap, patch.jumps) if patch.jumps else found


def _ends_without_steps(patch: Patch) -> list:
    """Return the ends of `contact_ends` without regard to steps of the gap."""
    if patch.skin is not None:
        return edges.find_pressure_edges(
            patch.x, patch.skin.pressure[0], edges.MIN_RELATIVE_PRESSURE
        )
    own = patch.pieces.normal
    bare = patch.pair.compliance.normal
    softness = None if own is bare else np.diag(own) - np.diag(bare)
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    return edges.find_edges(own, patch.x, force, patch.pressure.gap, softness, patch.pair.row)


def shear_stiffness(patch: Patch, found: list) -> float:
    """Return the tangential stiffness dT/d(slide) [N/m] in stick.

    Approach and rotation are fixed. For unlike pieces it contains the closing that shear causes.
    found: ends of the contact.
    """
    if not patch.pair.closing.any():
        return edges.set_stiffness(
            patch.pieces.tangential, patch.active, np.ones(patch.x.size), found
        )

    def of(active) -> float:
        """Return the coupled stiffness [N/m] of a contact set (m,)."""
        return stiffness.coupled_stiffness(patch.pieces, patch.pair.closing, active)

    whole = out = of(patch.active)
    for end in found if patch.active.sum() > 2 else ():
        more = patch.active.copy()
        less = patch.active.copy()
        more[end.node + end.side] = True
        less[end.node] = False
        out += edges.parabola_change(end.fraction - 0.5, of(more) - whole, whole - of(less))
    return float(out)


def edge_cells(x, active) -> np.ndarray:
    """Return the lengths (e,) [m] of the cells in which the contact ends; empty in full contact."""
    return np.diff(x)[active[1:] != active[:-1]]


def unresolved_rounding(patch: Patch) -> float:
    """Return the largest pressure [Pa] of rounded ends that the mesh does not resolve; else 0.

    The cells where the contact ends carry the pressure of a sharp end, K = sigma_n sqrt(cell); a
    rounding smaller than these cells has the peak of `rounded_corner_contact`.
    """
    pair = patch.pair
    x = patch.x
    sigma = patch.pressure.sigma_n
    rounded = _rounded_bodies(pair)
    loaded = np.flatnonzero(patch.active)
    # a compliant layer of asperities (skin) bounds the pressure
    if not rounded or not loaded.size or patch.pieces is not pair.compliance:
        return 0.0
    flat = min(body.half_flat_length for body in rounded)
    radius = 1 / sum(1 / body.end.size for body in rounded)
    modulus = 1 / sum(
        (1 - nu**2) / young
        for young, nu in (piece.layers.coating for piece in (pair.piece, pair.upper))
    )
    found = 0.0
    for at in (loaded[0], loaded[-1]):
        cell = np.diff(x)[max(at - 1, 0) : at + 1].max()
        if abs(abs(x[at]) - flat) > 2 * cell:  # the contact does not end at the rounding
            continue
        reach, peak = contact.rounded_corner_contact(
            sigma[max(at - 2, 0) : at + 3].max() * np.sqrt(cell), radius, modulus
        )
        found = max(found, peak if ROUNDING_CELLS * cell > reach else 0.0)
    return found


def open_ends(patch: Patch) -> float:
    """Return the length [m] of rounded face, both ends together, in which the contact may end.

    It counts an end whose last node is in contact.
    """
    rounded = _rounded_bodies(patch.pair)
    return (
        patch.active[[0, -1]].sum() * (patch.x[-1] - min(body.half_flat_length for body in rounded))
        if rounded
        else 0.0
    )


def reaches_steep_end(patch: Patch) -> bool:
    """Return whether the contact continues where a rounded end is too steep for the model.

    A single loaded node whose cell is longer than the whole rounding does not count.
    """
    cells = np.diff(patch.x)[[0, -1]]
    return bool((patch.active[[0, -1]] & (cells < open_ends(patch))).any())


def _rounded_bodies(pair) -> list:
    """Return the bodies with a rounding at the end of the interface."""
    return [
        body
        for body in (pair.grid, pair.upper_grid)
        if getattr(body, "end", None) is not None
        and body.end.kind == "radius"
        and body.interface_depths[-1] > 0
    ]
