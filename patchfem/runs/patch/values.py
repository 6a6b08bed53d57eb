"""Values of the static measures of a pressed patch, without errors.

In: a `Patch`. Out: values by name: peak pressure, edges, half-width, stiffnesses; and the peak
pressure at rounded ends that the cells do not resolve.
"""

import numpy as np

from ...closed_forms import contact
from ...contact import edges, stiffness
from ...core import Outcome
from ...elasticity.lapack import one_thread
from . import strips
from .edge_values import EdgeValues
from .press import Patch

# Largest ratio of the curvatures of neighbouring parabolas on a smooth pressure curve.
MAX_CURVATURE_RATIO = 2.0
# Smallest number of contact cells on a rounding for which its pressure peak converges.
MIN_ROUNDING_CELLS = 4


def peak_pressures(x, sigma, node_fraction=None) -> np.ndarray:
    """Estimate the largest pressures (q,) [Pa] of q patches from their nodal pressures.

    Inside the interface it is the vertex of the parabola through the largest node and its
    neighbours. At an end of the interface the nodal forces of bare pieces are means over half a
    cell, so that it is the end of the curve that has these means; with a skin it is the pressure
    of the node.

    Parameters
    ----------
    x : (m,) ndarray
        Positions of the nodes [m].
    sigma : (q, m) ndarray
        Nodal pressures [Pa].
    node_fraction : (m,) ndarray or None
        Weight [1] of the pressure of a node at an end: the fraction of the skin in its compliance.
        None for bare pieces.
    """
    peak_node = np.argmax(sigma, axis=1)
    peaks = sigma.max(axis=1)
    is_inner = (peak_node > 0) & (peak_node < x.size - 1)
    peaks[is_inner] = _parabola_vertices(x, sigma[is_inner], peak_node[is_inner])
    for border, step in ((0, 1), (x.size - 1, -1)):
        rows = np.flatnonzero(peak_node == border)
        bare = _extrapolate_to_ends(np.abs(x[::step] - x[border]), sigma[rows, ::step])
        fraction = 0.0 if node_fraction is None else node_fraction[border]
        peaks[rows] = fraction * peaks[rows] + (1 - fraction) * bare
    return peaks


def _parabola_vertices(x, sigma, peak_node) -> np.ndarray:
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
    peak_node : (q,)
        Inner nodes with the largest pressure.
    """
    # At an end of the interface, the parabola itself replaces its missing neighbour.
    rows = np.arange(peak_node.size)
    nodes = np.clip(peak_node[:, None] + [-1, 0, 1], 1, x.size - 2)
    left = x[nodes] - x[nodes - 1]
    right = x[nodes + 1] - x[nodes]
    pressure = sigma[rows[:, None], nodes]
    slope_left = (pressure - sigma[rows[:, None], nodes - 1]) / left
    slope_right = (sigma[rows[:, None], nodes + 1] - pressure) / right
    curvature = (slope_right - slope_left) / (left + right)
    slope = (slope_left * right + slope_right * left)[:, 1] / (left + right)[:, 1]
    has_vertex = (
        (sigma[rows, peak_node - 1] > 0) & (sigma[rows, peak_node + 1] > 0) & (curvature[:, 1] < 0)
    )
    middle = np.where(has_vertex, curvature[:, 1], -1.0)
    similar = np.minimum(curvature[:, 0] / middle, curvature[:, 2] / middle)
    fraction = np.clip(MAX_CURVATURE_RATIO * similar, 0.0, 1.0)
    rise = np.where(has_vertex, fraction * slope**2 / (-4 * middle), 0.0)
    return sigma[rows, peak_node] + rise


def _extrapolate_to_ends(x, sigma) -> np.ndarray:
    """Extrapolate nodal pressures, as cell averages, to the end of the interface (q,) [Pa].

    The averaged curve is a parabola through three loaded nodes, or a line through two.
    """
    peaks = sigma[:, 0].copy()
    # The result is the number of loaded nodes from the end of the interface to the first open one.
    n_loaded = np.argmin(np.pad(sigma > 0, ((0, 0), (0, 1))), axis=1)
    n_used = np.minimum(n_loaded, min(3, x.size - 1))
    for count in (2, 3):
        rows = n_used == count
        if rows.any():
            borders = np.concatenate([[0.0], (x[1 : count + 1] + x[:count]) / 2]) / x[1]
            power = np.arange(1, count + 1)
            means = np.diff(borders[:, None] ** power, axis=0) / power / np.diff(borders)[:, None]
            peaks[rows] = np.linalg.solve(means, sigma[rows, :count].T)[0]
    return peaks


def static_values(length: float, area: float, state, peak, edge_values: EdgeValues) -> dict:
    """Return the static contact measures as a dict of numbers, or of columns (q,) for q patches.

    Parameters
    ----------
    length, area : float
        Length [m] and area [m2] of the interface.
    state : object
        Its load, moment, rotation and approach are numbers or (q,), as in a ContactState.
    peak : float or (q,) ndarray
        Largest pressure [Pa].
    edge_values : EdgeValues

    Returns
    -------
    dict
    """
    is_loaded = np.greater(state.load, 0)

    def quotient(divisor, numerator):
        """Return numerator/divisor, with 0 for patches without a load."""
        zero = np.zeros(np.shape(peak))
        return np.divide(numerator, divisor, out=zero, where=is_loaded)[()]

    return {
        "normal_load": state.load,
        "contact_fraction": edge_values.length / length,
        "pressure_peak": peak,
        "moment": state.moment,
        "rotation": state.rotation,
        "approach": state.approach,
        "contact_half_width": edge_values.width / 2,
        "pressure_centre": quotient(state.load, state.moment),
        "loaded_fraction": quotient(area * peak, state.load),
        "normal_stiffness": edge_values.normal,
        "tangential_stiffness": edge_values.tangential,
        "rotational_stiffness": edge_values.rotational,
    }


def values(patch: Patch) -> dict:
    """Return the values of all static measures of a solved patch as a dict, in SI units.

    A node at the edge of a step represents half a cell on either side: the value is the weighted
    mean of the patches with and without contact of this node. `patch_rows` has the definitions.
    """
    if patch.either:
        parts = [(weight, values(part)) for weight, part in patch.either]
        names = parts[0][1]
        return {name: float(sum(weight * part[name] for weight, part in parts)) for name in names}
    state = patch.strips
    sigma = patch.pressure.sigma_n[None] if state is None else state.pressure
    edge_values = EdgeValues(0.0, 0.0, 0.0, 0.0, 0.0)
    if state is None and patch.pressure.outcome is not Outcome.NO_CONTACT:
        with one_thread():
            edge_values = _edge_values(patch)
    elif state is not None and state.load > 0:
        edge_values = strips.compute_strip_edge_values(patch)
    out = static_values(
        np.ptp(patch.x),
        patch.pieces.interface.weight.sum(),
        patch.pressure,
        peak_pressures(patch.x, sigma, patch.skin_fraction).max(),
        edge_values,
    )
    if state is not None:
        out |= {
            "pressure_centre_lateral": state.centre_y,
            "roll_moment": state.roll_moment,
            "roll": state.roll,
        }
    return {name: float(value) for name, value in out.items()}


def _edge_values(patch: Patch) -> EdgeValues:
    """Return contact length and stiffnesses of a patch without strips."""
    x = patch.x
    ends = contact_ends(patch)
    intervals = contact_intervals(patch, ends)
    return EdgeValues(
        length=float(np.diff(intervals).sum()),
        width=float(intervals[-1, 1] - intervals[0, 0]),
        normal=edges.set_stiffness(patch.pieces.normal, patch.active, np.ones(x.size), ends),
        tangential=_shear_stiffness(patch, ends),
        rotational=edges.set_stiffness(patch.pieces.normal, patch.active, x, ends),
    )


def contact_intervals(patch: Patch, ends: list) -> np.ndarray:
    """Return the contact intervals (k, 2) [m] of the interface, by increasing x.

    ends: ends of the contact from `contact_ends`.
    """
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    return edges.contact_intervals(patch.x, force, ends)


def contact_ends(patch: Patch) -> list:
    """Return the contact ends between nodes as a list of `ContactEdge`.

    The list is empty for means over strips.
    """
    if patch.strips is not None:
        return []
    x = patch.x
    if patch.skin is not None:
        minimum = edges.MIN_RELATIVE_PRESSURE
        ends = edges.find_pressure_edges(x, patch.skin.pressure[0], minimum)
    else:
        normal = patch.pieces.normal
        bare = patch.pair.compliance.normal
        softness = None if normal is bare else np.diag(normal) - np.diag(bare)
        force = patch.pressure.sigma_n * patch.pieces.interface.weight
        ends = edges.find_edges(normal, x, force, patch.gap, softness, patch.pair.row)
    jumps = patch.model.gap.jumps
    return edges.snap_to_steps(ends, x, patch.unloaded_gap, jumps) if jumps else ends


def _shear_stiffness(patch: Patch, ends: list) -> float:
    """Return the tangential contact stiffness dT/dq [N/m] in full stick.

    Approach and rotation are fixed. For unlike pieces it contains the closing that shear causes.
    ends: ends of the contact.
    """
    active = patch.active
    if not patch.pair.closing.any():
        return edges.set_stiffness(patch.pieces.tangential, active, np.ones(patch.x.size), ends)

    def coupled_stiffness(contact_set) -> float:
        """Return the tangential stiffness [N/m] for a contact set (m,) of nodes."""
        return stiffness.coupled_stiffness(patch.pieces, patch.pair.closing, contact_set)

    at_nodes = coupled_stiffness(active)
    out = at_nodes
    for end in ends if active.sum() > 2 else ():
        larger = active.copy()
        smaller = active.copy()
        larger[end.node + end.side] = True
        smaller[end.node] = False
        out += edges.parabola_change(
            end.fraction - 0.5,
            coupled_stiffness(larger) - at_nodes,
            at_nodes - coupled_stiffness(smaller),
        )
    return float(out)


def edge_cells(x, active) -> np.ndarray:
    """Return the lengths (e,) [m] of the cells in which contact edges lie; none in full contact."""
    return np.diff(x)[active[1:] != active[:-1]]


def unresolved_rounding(patch: Patch) -> float:
    """Return the largest pressure [Pa] at rounded ends that the mesh does not resolve.

    It is 0 if there is no such end.

    The cells where the contact ends carry the pressure of a sharp end, K = sigma_n sqrt(cell); a
    rounding smaller than these cells has the peak of `rounded_corner_contact`.
    """
    pair = patch.pair
    x = patch.x
    sigma = patch.pressure.sigma_n
    rounded = _rounded_bodies(pair)
    loaded = np.flatnonzero(patch.active)
    # A compliant layer of asperities (skin) bounds the pressure.
    if not rounded or not loaded.size or patch.pieces is not pair.compliance:
        return 0.0
    flat = min(body.half_flat_length for body in rounded)
    radius = 1 / sum(1 / body.end.size for body in rounded)
    coatings = [piece.layers.coating for piece in (pair.piece, pair.upper)]
    modulus = 1 / sum((1 - nu**2) / young for young, nu in coatings)
    largest = 0.0
    for node in (loaded[0], loaded[-1]):
        cell = np.diff(x)[max(node - 1, 0) : node + 1].max()
        if abs(abs(x[node]) - flat) > 2 * cell:  # The contact does not end at the rounding.
            continue
        sharp_end = sigma[max(node - 2, 0) : node + 3].max() * np.sqrt(cell)
        reach, peak = contact.rounded_corner_contact(sharp_end, radius, modulus)
        if MIN_ROUNDING_CELLS * cell > reach:
            largest = max(largest, peak)
    return largest


def open_ends(patch: Patch) -> float:
    """Return the length [m] of rounded surface on which a contact edge may lie.

    It counts an end whose last node is in contact.
    """
    rounded = _rounded_bodies(patch.pair)
    if not rounded:
        return 0.0
    rounded_length = patch.x[-1] - min(body.half_flat_length for body in rounded)
    return patch.active[[0, -1]].sum() * rounded_length


def reaches_steep_end(patch: Patch) -> bool:
    """Return whether the contact reaches a rounded end that is too steep for the model.

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
