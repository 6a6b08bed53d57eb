"""Values of the static measures of a solved patch, without error estimates.

In: a `Patch`. Out: values by name, such as peak pressure, contact length and stiffnesses; and the
peak pressure at rounded ends that the mesh does not resolve.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ... import closed_forms
from ...contact import edges, stiffness
from ...contact.press import split_into_strips
from ...elasticity.lapack import use_one_blas_thread
from ...mesh.grid import TensorGrid
from ..results.patch_rows import Values
from .press import Patch

# Largest ratio of the curvatures of neighbouring parabolas at which the pressure curve counts as
# smooth.
MAX_SMOOTH_PRESSURE_CURVATURE_RATIO = 2.0
# Smallest number of contact cells on a rounded end at which its pressure peak is resolved.
MIN_CELLS_ON_ROUNDED_END = 4


class EdgeValues(NamedTuple):
    """Contact length and contact stiffnesses, which depend on the positions of the contact edges.

    - length: length in contact [m]; the mean over the strips.
    - width: distance between the outermost contact edges [m].
    - normal, tangential: stiffnesses [N/m].
    - rotational: stiffness [N m/rad].
    """

    length: float
    width: float
    normal: float
    tangential: float
    rotational: float


def estimate_peak_pressure(x, sigma, node_fraction=None) -> float:
    """Estimate the peak pressure [Pa] of a patch from its nodal pressures.

    Inside the interface, the peak is the vertex of the parabola through the largest nodal pressure
    and its neighbours. At an end of the interface, the nodal pressures of bare pieces are means
    over cells, and the peak is the end value of the curve with these means; with an asperity layer
    it is the nodal pressure.

    Parameters
    ----------
    x, sigma : (m,) ndarray
        Positions [m] and pressures [Pa] of the nodes.
    node_fraction : (m,) ndarray or None
        Weight of the nodal pressure at an end of the interface: the fraction of the asperity layer
        in the nodal compliance. None for bare pieces.
    """
    node = int(np.argmax(sigma))
    largest = float(sigma[node])
    if 0 < node < x.size - 1:
        return largest + _vertex_height(x, sigma, node)
    step = 1 if node == 0 else -1
    bare = _extrapolate_pressure_to_end(np.abs(x[::step] - x[node]), sigma[::step])
    fraction = 0.0 if node_fraction is None else float(node_fraction[node])
    return fraction * largest + (1 - fraction) * bare


def _vertex_height(x, sigma, node: int) -> float:
    """Return by how much the parabola through a node and its neighbours rises above the pressure of the node [Pa].

    If the neighbouring parabolas have a much smaller curvature, as beside a jump, the height is reduced. `x` [m] and
    `sigma` [Pa] are positions and pressures of the nodes, and `node` is the inner node with the largest pressure.
    """
    if not (sigma[node - 1] > 0 and sigma[node + 1] > 0):
        return 0.0

    # Slope and half the second derivative of the parabola at the middle of its three nodes.
    cells = np.diff(x)
    slopes = np.diff(sigma) / cells
    curvatures = np.diff(slopes) / (x[2:] - x[:-2])
    slope = np.average(slopes[node - 1 : node + 1], weights=cells[[node, node - 1]])
    curvature = curvatures[node - 1]
    if not curvature < 0:
        return 0.0

    # At an end of the interface, the parabola itself stands in for the missing neighbour.
    neighbours = curvatures[np.clip([node - 2, node], 0, curvatures.size - 1)]
    similar = (neighbours / curvature).min()
    fraction = np.clip(MAX_SMOOTH_PRESSURE_CURVATURE_RATIO * similar, 0.0, 1.0)
    return float(fraction * slope**2 / (-4 * curvature))


def _extrapolate_pressure_to_end(x, sigma) -> float:
    """Extrapolate cell-averaged nodal pressures to the end of the interface [Pa].

    The curve with these means is a parabola if three nodes are loaded, or a line if two are. `x` (m,) [m] is the
    distance from the end.
    """
    is_open = np.append(sigma[:3] <= 0, True)
    count = min(int(np.argmax(is_open)), x.size - 1)
    if count < 2:
        return float(sigma[0])
    borders = np.concatenate([[0.0], (x[1 : count + 1] + x[:count]) / 2]) / x[1]
    power = np.arange(1, count + 1)
    means = np.diff(borders[:, None] ** power, axis=0) / power / np.diff(borders)[:, None]
    return float(np.linalg.solve(means, sigma[:count])[0])


def assemble_static_values(
    length: float, area: float, state, peak, edge_values: EdgeValues
) -> Values:
    """Return the static measures by name.

    Parameters
    ----------
    length, area : float
        Length [m] and area [m2] of the interface.
    state : object
        Has load, moment, rotation and approach, as a ContactState.
    peak : float
        Largest pressure [Pa].
    edge_values : EdgeValues
        Lengths and stiffnesses, which depend on the positions of the contact edges.

    Returns
    -------
    dict of float
        In SI units.
    """
    is_loaded = state.load > 0
    return {
        "normal_load": state.load,
        "contact_fraction": edge_values.length / length,
        "pressure_peak": peak,
        "moment": state.moment,
        "rotation": state.rotation,
        "approach": state.approach,
        "contact_half_width": edge_values.width / 2,
        "pressure_centre": state.moment / state.load if is_loaded else 0.0,
        "loaded_fraction": state.load / (area * peak) if is_loaded else 0.0,
        "normal_stiffness": edge_values.normal,
        "tangential_stiffness": edge_values.tangential,
        "rotational_stiffness": edge_values.rotational,
    }


def compute_static_values(patch: Patch) -> Values:
    """Return the values of all static measures of a solved patch by name, in SI units.

    If a node lies at the edge of a step, the values are the weighted mean of the two solutions with
    this node on either side of the step. `patch_rows` defines the measures.
    """
    return _compute_static_values(patch).copy()


# Refinement, error estimates and notes need the values of a patch on its last meshes; more patches would keep their memory
@lru_cache(4)
def _compute_static_values(patch: Patch) -> Values:
    """Return the values of all static measures of a solved patch by name, in SI units."""
    # A node at the edge of a step belongs to both sides of it: the values are the weighted mean of
    # the solutions with this node on either side.
    if patch.step_variants:
        parts = [(weight, compute_static_values(part)) for weight, part in patch.step_variants]
        names = parts[0][1]
        return {name: float(sum(weight * part[name] for weight, part in parts)) for name in names}

    state = patch.state
    edge_values = EdgeValues(0.0, 0.0, 0.0, 0.0, 0.0)
    if patch.pressure.load > 0:
        with use_one_blas_thread():
            edge_values = _compute_edge_values(patch)

    out = assemble_static_values(
        np.ptp(patch.x),
        patch.pieces.interface.weight.sum(),
        patch.pressure,
        max(estimate_peak_pressure(patch.x, row, patch.skin_fraction) for row in state.pressure),
        edge_values,
    )

    return {name: float(value) for name, value in out.items()}


def _compute_edge_values(patch: Patch) -> EdgeValues:
    """Return contact length and contact stiffnesses of a patch; those of its strips are summed.

    All depend on where the contact ends between two nodes, which the nodal pressures show.
    """
    count = len(patch.state.force)
    skin = patch.model.interface.skin
    motions = np.stack([np.ones(patch.x.size), patch.x], axis=1)
    stiffnesses = np.zeros(3)
    intervals = []
    strip_pieces = split_into_strips(patch.pair.compliance, count)
    coupling = patch.pair.closing
    if count > 1:
        coupling = coupling * count

    for strip, active in enumerate(loaded_nodes(patch)):
        if not active.any():
            continue
        # The layer of each strip is in series with its fraction of the pieces.
        normal = strip_pieces.normal
        tangential = strip_pieces.tangential
        if skin is not None:
            layer = patch.layer_compliance[strip]
            normal = normal + np.diag(layer)
            if skin.tangential_ratio is not None:
                tangential = tangential + np.diag(layer / skin.tangential_ratio)

        # Stiffness of the set in contact under unit approach and rotation, with the partial cells
        # at its edges.
        pressed = edges.SetFactor(normal, active)
        ends = _find_ends(patch, strip, pressed)
        intervals.append(edges.contact_intervals(patch.x, active, ends))
        stiffnesses[:2] += edges.set_stiffness(pressed, motions, ends)
        stiffnesses[2] += _full_stick_stiffness(normal, tangential, coupling, active, ends)

    normal_stiffness, rotational_stiffness, tangential_stiffness = stiffnesses.tolist()
    return EdgeValues(
        length=float(sum(np.diff(part).sum() for part in intervals) / count),
        width=float(max(part[-1, 1] for part in intervals) - min(part[0, 0] for part in intervals)),
        normal=normal_stiffness,
        tangential=tangential_stiffness,
        rotational=rotational_stiffness,
    )


def loaded_nodes(patch: Patch) -> np.ndarray:
    """Return whether each node of each strip carries pressure (s, m), in a smooth asperity layer a fraction of the peak."""
    pressure = patch.state.pressure
    minimum = edges.MIN_CONTACT_PRESSURE_RATIO if patch.has_smooth_skin else 0.0
    return pressure > minimum * pressure.max()


def contact_intervals(patch: Patch, ends: list[edges.ContactEdge]) -> np.ndarray:
    """Return the contact intervals (k, 2) [m] of a patch in the order of increasing x.

    `ends` are the contact edges from `contact_ends`.
    """
    return edges.contact_intervals(patch.x, patch.active, ends)


def contact_ends(patch: Patch) -> list[edges.ContactEdge]:
    """Return the contact edges between nodes as a list of `ContactEdge`."""
    if not patch.active.any():
        return []
    return _find_ends(patch, 0, edges.SetFactor(patch.pieces.normal, patch.active))


def _find_ends(patch: Patch, strip: int, pressed: edges.SetFactor) -> list[edges.ContactEdge]:
    """Return the contact edges of one strip of a solved patch, with their positions between two nodes.

    `strip` is the number of the strip, 0 without strips. `pressed` is the Cholesky factor of the compliance of its nodes in
    contact, by which the pressure near an edge is corrected.
    """
    x = patch.x
    state = patch.state

    # A smooth layer has no gap, so that its edges follow from the pressure alone.
    if patch.has_smooth_skin:
        pressure = state.pressure
        threshold = edges.MIN_CONTACT_PRESSURE_RATIO * pressure.max()
        ends = edges.find_pressure_edges(x, pressure[strip], threshold)
    else:
        ends = edges.find_edges(
            pressed,
            x,
            state.force[strip],
            state.gap[strip],
            patch.layer_compliance[strip] if patch.has_skin else None,
            patch.pair.row,
            is_quadratic=patch.pair.is_quadratic,
        )

    # An edge next to a step of the gap lies on the step.
    jumps = patch.model.gap.step_edges
    if not jumps:
        return ends
    gap = np.broadcast_to(patch.unloaded_gap, state.gap.shape)[strip]
    return edges.snap_to_steps(ends, x, gap, jumps)


def _full_stick_stiffness(
    normal, tangential, coupling, active, ends: list[edges.ContactEdge]
) -> float:
    """Return the tangential contact stiffness [N/m] in full stick of the nodes in contact.

    Approach and rotation are fixed. For dissimilar pieces, the stiffness includes the coupling of shear and normal
    displacement. `normal` and `tangential` (m, m) [m/N] are the normal and shear compliance of the interface nodes,
    `coupling` (m, m) [m/N] is the normal closing under shear forces, `active` (m,) tells whether a node is in contact,
    and `ends` are the contact edges.
    """
    if not coupling.any():
        sheared = edges.SetFactor(tangential, active)
        return float(edges.set_stiffness(sheared, np.ones((active.size, 1)), ends)[0])

    def coupled_stiffness(contact_set) -> float:
        """Return the tangential stiffness [N/m] for a contact set (m,)."""
        return stiffness.coupled_stiffness(normal, tangential, coupling, contact_set)

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


def edge_cell_lengths(x, active) -> np.ndarray:
    """Return the lengths (e,) [m] of the cells in which contact edges lie."""
    return np.diff(x)[active[1:] != active[:-1]]


def unresolved_edge_rounding_pressure(patch: Patch) -> float:
    """Return the peak pressure [Pa] at rounded ends that the mesh does not resolve; 0 if it does.

    On a mesh that does not resolve the rounding, the cells at the contact edge carry the pressure
    of a sharp end, K = sigma_n sqrt(cell). The peak on the rounding then follows from
    `rounded_corner_contact`.
    """
    pair = patch.pair
    x = patch.x
    sigma = patch.pressure.sigma_n
    rounded = _rounded_bodies(pair)
    loaded = np.flatnonzero(patch.active)
    # An asperity layer (skin) bounds the pressure.
    if not rounded or not loaded.size or patch.pieces is not pair.compliance:
        return 0.0

    # The curvatures 1/R and the compliances 1/E* of the two bodies add up.
    half_flat_length = min(body.half_flat_length for body in rounded)
    radius = 1 / sum(1 / body.end.size for body in rounded)
    coatings = [piece.layers.coating for piece in (pair.piece, pair.upper)]
    modulus = 1 / sum((1 - nu**2) / young for young, nu in coatings)

    largest = 0.0
    for node in (loaded[0], loaded[-1]):
        cell = np.diff(x)[max(node - 1, 0) : node + 1].max()
        # The contact does not end at the rounded end.
        if abs(abs(x[node]) - half_flat_length) > 2 * cell:
            continue
        stress_intensity = sigma[max(node - 2, 0) : node + 3].max() * np.sqrt(cell)
        peak_width, peak = closed_forms.contact.rounded_corner_contact(
            stress_intensity, radius, modulus
        )
        if MIN_CELLS_ON_ROUNDED_END * cell > peak_width:
            largest = max(largest, peak)
    return largest


def open_rounded_length(patch: Patch) -> float:
    """Return the length [m] of rounded surface on which a contact edge may lie.

    It is the length beyond the flat part, for each end whose last node is in contact.
    """
    rounded = _rounded_bodies(patch.pair)
    if not rounded:
        return 0.0
    rounded_length = patch.x[-1] - min(body.half_flat_length for body in rounded)
    return patch.active[[0, -1]].sum() * rounded_length


def contact_reaches_steep_end(patch: Patch) -> bool:
    """Return whether the contact reaches the steep part of a rounded end, where the model ends.

    A single loaded node whose cell is longer than the whole rounded end does not count.
    """
    cells = np.diff(patch.x)[[0, -1]]
    return bool((patch.active[[0, -1]] & (cells < open_rounded_length(patch))).any())


def _rounded_bodies(pair) -> list[TensorGrid]:
    """Return the meshes of the pieces whose interface ends are rounded."""
    bodies = []
    for body in (pair.grid, pair.upper_grid):
        is_rounded = isinstance(body, TensorGrid) and body.end.kind == "radius"
        if is_rounded and body.interface_depths[-1] > 0:
            bodies.append(body)
    return bodies
