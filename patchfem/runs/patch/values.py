"""Values of the static measures of a solved patch, without error estimates.

In: a `Patch`. Out: values by name, such as peak pressure, contact length and stiffnesses; and the
peak pressure at rounded ends that the mesh does not resolve.
"""

from weakref import WeakKeyDictionary

import numpy as np

from ...closed_forms import contact
from ...contact import edges, stiffness
from ...core import Outcome
from ...elasticity.lapack import use_one_blas_thread
from ...mesh.grid import TensorGrid
from . import strips
from .edge_values import EdgeValues
from .press import Patch

# Largest ratio of the curvatures of neighbouring parabolas at which the pressure curve counts as
# smooth.
MAX_CURVATURE_RATIO = 2.0
# Smallest number of contact cells on a rounded end at which its pressure peak is resolved.
MIN_ROUNDING_CELLS = 4

# Values of the patches in use: refinement, error estimates and notes need the same ones
_VALUES_BY_PATCH: WeakKeyDictionary = WeakKeyDictionary()


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

    If the neighbouring parabolas have a much smaller curvature, as beside a jump, the height is reduced.
    """
    if not (sigma[node - 1] > 0 and sigma[node + 1] > 0):
        return 0.0

    def fit_parabola(middle: int) -> tuple[float, float]:
        """Return the slope at the middle of three nodes, and half the second derivative."""
        left = x[middle] - x[middle - 1]
        right = x[middle + 1] - x[middle]
        slope_left = (sigma[middle] - sigma[middle - 1]) / left
        slope_right = (sigma[middle + 1] - sigma[middle]) / right
        slope = (slope_left * right + slope_right * left) / (left + right)
        return slope, (slope_right - slope_left) / (left + right)

    slope, curvature = fit_parabola(node)
    if not curvature < 0:
        return 0.0
    # At an end of the interface, the parabola itself stands in for the missing neighbour.
    neighbours = [min(max(k, 1), x.size - 2) for k in (node - 1, node + 1)]
    similar = min(1.0, *(fit_parabola(k)[1] / curvature for k in neighbours))
    fraction = min(max(MAX_CURVATURE_RATIO * similar, 0.0), 1.0)
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
) -> dict:
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

    Returns
    -------
    dict of float
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


def compute_static_values(patch: Patch) -> dict:
    """Return the values of all static measures of a solved patch by name, in SI units.

    If a node lies at the edge of a step, the values are the weighted mean of the two solutions with
    this node on either side of the step. `patch_rows` defines the measures.
    """
    if patch not in _VALUES_BY_PATCH:
        _VALUES_BY_PATCH[patch] = _compute_static_values(patch)
    return _VALUES_BY_PATCH[patch].copy()


def _compute_static_values(patch: Patch) -> dict:
    """Return the values of all static measures of a solved patch by name, in SI units."""
    if patch.step_variants:
        parts = [(weight, compute_static_values(part)) for weight, part in patch.step_variants]
        names = parts[0][1]
        return {name: float(sum(weight * part[name] for weight, part in parts)) for name in names}
    state = patch.strips
    sigma = patch.pressure.sigma_n[None] if state is None else state.pressure
    edge_values = EdgeValues(0.0, 0.0, 0.0, 0.0, 0.0)
    if state is None and patch.pressure.outcome is not Outcome.NO_CONTACT:
        with use_one_blas_thread():
            edge_values = _compute_edge_values(patch)
    elif state is not None and state.load > 0:
        edge_values = strips.compute_strip_edge_values(patch)
    out = assemble_static_values(
        np.ptp(patch.x),
        patch.pieces.interface.weight.sum(),
        patch.pressure,
        max(estimate_peak_pressure(patch.x, row, patch.skin_fraction) for row in sigma),
        edge_values,
    )
    if state is not None:
        out |= {
            "pressure_centre_lateral": state.centre_y,
            "roll_moment": state.roll_moment,
            "roll": state.roll,
        }
    return {name: float(value) for name, value in out.items()}


def _compute_edge_values(patch: Patch) -> EdgeValues:
    """Return contact length and contact stiffnesses of a patch without strips."""
    pressed = edges.SetFactor(patch.pieces.normal, patch.active)
    ends = contact_ends(patch, pressed)
    intervals = contact_intervals(patch, ends)
    motions = np.stack([np.ones(patch.x.size), patch.x], axis=1)
    normal, rotational = edges.set_stiffness(pressed, motions, ends)
    return EdgeValues(
        length=float(np.diff(intervals).sum()),
        width=float(intervals[-1, 1] - intervals[0, 0]),
        normal=float(normal),
        tangential=_full_stick_stiffness(patch, ends),
        rotational=float(rotational),
    )


def contact_intervals(patch: Patch, ends: list) -> np.ndarray:
    """Return the contact intervals (k, 2) [m] of a patch in the order of increasing x.

    ends: contact edges from `contact_ends`.
    """
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    return edges.contact_intervals(patch.x, force, ends)


def contact_ends(patch: Patch, pressed: edges.SetFactor | None = None) -> list:
    """Return the contact edges between nodes as a list of `ContactEdge`.

    The list is empty for a patch in strips. `pressed` is the factor of the nodes in contact, if it is known.
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
        pressed = pressed or edges.SetFactor(normal, patch.active)
        ends = edges.find_edges(
            pressed,
            x,
            force,
            patch.gap,
            softness,
            patch.pair.row,
            is_quadratic=patch.pair.is_quadratic,
        )
    jumps = patch.model.gap.jumps
    return edges.snap_to_steps(ends, x, patch.unloaded_gap, jumps) if jumps else ends


def _full_stick_stiffness(patch: Patch, ends: list) -> float:
    """Return the tangential contact stiffness [N/m] in full stick.

    Approach and rotation are fixed. For dissimilar pieces, the stiffness includes the coupling of shear
    and normal displacement. ends: contact edges.
    """
    active = patch.active
    if not patch.pair.closing.any():
        sheared = edges.SetFactor(patch.pieces.tangential, active)
        return float(edges.set_stiffness(sheared, np.ones((patch.x.size, 1)), ends)[0])

    def coupled_stiffness(contact_set) -> float:
        """Return the tangential stiffness [N/m] for a contact set (m,)."""
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
    half_flat_length = min(body.half_flat_length for body in rounded)
    radius = 1 / sum(1 / body.end.size for body in rounded)
    coatings = [piece.layers.coating for piece in (pair.piece, pair.upper)]
    modulus = 1 / sum((1 - nu**2) / young for young, nu in coatings)
    largest = 0.0
    for node in (loaded[0], loaded[-1]):
        cell = np.diff(x)[max(node - 1, 0) : node + 1].max()
        if (
            abs(abs(x[node]) - half_flat_length) > 2 * cell
        ):  # The contact does not end at the rounded end.
            continue
        stress_intensity = sigma[max(node - 2, 0) : node + 3].max() * np.sqrt(cell)
        peak_width, peak = contact.rounded_corner_contact(stress_intensity, radius, modulus)
        if MIN_ROUNDING_CELLS * cell > peak_width:
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


def _rounded_bodies(pair) -> list:
    """Return the meshes of the pieces whose interface ends are rounded."""
    bodies = []
    for body in (pair.grid, pair.upper_grid):
        is_rounded = isinstance(body, TensorGrid) and body.end.kind == "radius"
        if is_rounded and body.interface_depths[-1] > 0:
            bodies.append(body)
    return bodies
