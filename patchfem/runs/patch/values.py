"""Values of the static measures of pressed cases, without error estimates.

In: `PressedCases`. Out: values (n,) by name, such as peak pressure, contact length and stiffnesses; and the
peak pressure at rounded ends that the mesh does not resolve.
"""

from typing import NamedTuple

import numpy as np

from ... import closed_forms
from ...contact import edges
from ...elasticity.lapack import use_one_blas_thread
from ...mesh.grid import TensorGrid
from ..results.patch_rows import Arrays, Values
from .press import Patch, PressedCases


class EdgeValues(NamedTuple):
    """Contact lengths and contact stiffnesses, which depend on the positions of the contact edges; numbers or (n,).

    - length: length in contact [m].
    - width: distance between the outermost contact edges [m].
    - normal, tangential: stiffnesses [N/m].
    - rotational: stiffness [N m/rad].
    """

    length: np.ndarray
    width: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray
    rotational: np.ndarray


class AcrossValues(NamedTuple):
    """Values of a face whose pressure varies across the sliding direction.

    - roll: rotation of the upper piece about x [rad].
    - moment: moment of the pressure about x [N m].
    - stiffness: derivative of the moment with respect to the roll [N m/rad].
    - yielded_fraction: fraction of the face whose pressure is the hardness; None without a hardness.
    """

    roll: float
    moment: float
    stiffness: float
    yielded_fraction: float | None


def estimate_peak_pressure(x, sigma, node_fraction=None) -> np.ndarray:
    """Estimate the peak pressures (...) [Pa] of patches from their nodal pressures.

    Inside the interface, the peak is the vertex of the parabola through the largest nodal pressure
    and its neighbours. At an end of the interface, the nodal pressures of bare pieces are means
    over cells, and the peak is the end value of the curve with these means; with an asperity layer
    it is the nodal pressure.

    Parameters
    ----------
    x : (m,) ndarray
        Positions [m].
    sigma : (..., m) ndarray
        Pressures [Pa] of the nodes.
    node_fraction : (..., m) ndarray or None
        Weight of the nodal pressure at an end of the interface: the fraction of the asperity layer
        in the nodal compliance. None for bare pieces.
    """
    node = sigma.argmax(axis=-1)[..., None]
    largest = np.take_along_axis(sigma, node, -1)
    peak = largest + _vertex_height(x, sigma, node)
    for end, step in ((0, 1), (x.size - 1, -1)):
        is_end = node[..., 0] == end
        if is_end.any():
            distances = np.abs(x[::step] - x[end])
            bare = _extrapolate_pressure_to_end(distances, sigma[is_end][..., ::step])[..., None]
            fraction = 0.0 if node_fraction is None else node_fraction[is_end][..., end, None]
            peak[is_end] = fraction * largest[is_end] + (1 - fraction) * bare
    return peak[..., 0]


def estimate_face_peak(x, y, pressure: np.ndarray) -> float:
    """Estimate the peak pressure [Pa] over cells: the vertex of parabolas along both axes through the largest pressure.

    Parameters
    ----------
    x, y : (nx,) and (ny,) ndarray
        Centres of the cells [m].
    pressure : (ny, nx) ndarray
        Pressure of the cells [Pa].
    """
    row, column = np.unravel_index(int(np.argmax(pressure)), pressure.shape)
    rise_x = _vertex_height(x, pressure[row], np.array([column]))
    rise_y = _vertex_height(y, pressure[:, column], np.array([row]))
    return float(pressure[row, column] + rise_x[0] + rise_y[0])


def _vertex_height(x, sigma, node) -> np.ndarray:
    """Return by how much (..., 1) the parabola through a node and its neighbours rises above its pressure [Pa].

    If the neighbouring parabolas have a much smaller curvature, as beside a jump, the height is reduced. `x` (m,) [m] and
    `sigma` (..., m) [Pa] are positions and pressures of the nodes, and `node` (..., 1) has the largest pressure. At an end
    of the interface the height does not count.
    """
    node = np.clip(node, 1, x.size - 2)
    left, right = (np.take_along_axis(sigma, node + side, -1) for side in (-1, 1))

    # Slope and half the second derivative of the parabola at the middle of its three nodes.
    cells = np.diff(x)
    slopes = np.diff(sigma) / cells
    curvatures = np.diff(slopes) / (x[2:] - x[:-2])
    before, after = (np.take_along_axis(slopes, node + side, -1) for side in (-1, 0))
    slope = (before * cells[node] + after * cells[node - 1]) / (cells[node] + cells[node - 1])
    curvature = np.take_along_axis(curvatures, node - 1, -1)

    # At an end of the interface, the parabola itself stands in for the missing neighbour.
    neighbours = np.clip(node - 1 + np.array([-1, 1]), 0, x.size - 3)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        similar = (np.take_along_axis(curvatures, neighbours, -1) / curvature).min(
            -1, keepdims=True
        )
        # Largest ratio of the curvatures of neighbouring parabolas at which the pressure curve
        # counts as smooth.
        fraction = np.clip(2.0 * similar, 0.0, 1.0)
        height = fraction * slope**2 / (-4 * curvature)
    return np.where((left > 0) & (right > 0) & (curvature < 0), height, 0.0)


def _extrapolate_pressure_to_end(x, sigma) -> np.ndarray:
    """Extrapolate cell-averaged nodal pressures (n, m) to the end of the interface, (n,) [Pa].

    The curve with these means is a parabola if three nodes are loaded, or a line if two are. `x` (m,) [m] is the
    distance from the end.
    """
    is_open = np.concatenate([sigma[:, :3] <= 0, np.ones((len(sigma), 1), bool)], axis=1)
    counts = np.minimum(is_open.argmax(axis=1), x.size - 1)
    peak = sigma[:, 0].copy()
    for count in (2, 3):
        borders = np.concatenate([[0.0], (x[1 : count + 1] + x[:count]) / 2]) / x[1]
        power = np.arange(1, count + 1)
        means = np.diff(borders[:, None] ** power, axis=0) / power / np.diff(borders)[:, None]
        rows = counts == count
        peak[rows] = np.linalg.solve(means, sigma[rows, :count].T)[0]
    return peak


def assemble_static_values(
    length: float,
    area: float,
    state,
    peak,
    edge_values: EdgeValues,
    across: AcrossValues | None = None,
):
    """Return the static measures by name, numbers or arrays (n,).

    Parameters
    ----------
    length, area : float
        Length [m] and area [m2] of the interface.
    state : object
        Has load, moment, rotation and approach.
    peak : float or ndarray
        Largest pressure [Pa].
    edge_values : EdgeValues
        Lengths and stiffnesses, which depend on the positions of the contact edges.
    across : AcrossValues, optional
        What only a face has.

    Returns
    -------
    dict
        In SI units.
    """
    # Ratios to the load are 0 without it.
    is_loaded = state.load > 0
    load = np.where(is_loaded, state.load, 1.0)
    total = np.where(is_loaded, area * peak, 1.0)
    fraction = edge_values.length / length

    values = {
        "normal_load": state.load,
        "contact_fraction": fraction,
        "pressure_peak": peak,
        "moment": state.moment,
        "rotation": state.rotation,
        "approach": state.approach,
        "contact_half_width": edge_values.width / 2,
        "pressure_centre": state.moment / load * is_loaded,
        "loaded_fraction": load / total * is_loaded,
        "normal_stiffness": edge_values.normal,
        "tangential_stiffness": edge_values.tangential,
        "rotational_stiffness": edge_values.rotational,
    }

    # Only a face has measures across its width.
    if across is not None:
        values |= {
            "contact_area": fraction * area,
            "pressure_centre_y": across.moment / load * is_loaded,
            "roll": across.roll,
            "roll_moment": across.moment,
            "roll_stiffness": across.stiffness,
        }
        if across.yielded_fraction is not None:
            values["yielded_fraction"] = across.yielded_fraction
    return values


def compute_static_values(patch: Patch) -> Values:
    """Return the values of all static measures of a solved patch by name, in SI units.

    `patch_rows` defines the measures.
    """
    return {name: float(values[0]) for name, values in compute_values(patch.pressed).items()}


class _CaseTotals(NamedTuple):
    """Loads [N], moments [N m] and positions of the holder [m], [rad] of n cases, as `assemble_static_values` takes them."""

    load: np.ndarray
    moment: np.ndarray
    approach: np.ndarray
    rotation: np.ndarray


def compute_values(pressed: PressedCases) -> Arrays:
    """Return the values (n,) of all static measures of pressed cases by name, in SI units.

    If a node lies at the edge of a step, the values are the weighted mean of the two solutions with
    this node on either side of the step. `patch_rows` defines the measures.
    """
    if "values" not in pressed.computed:
        with use_one_blas_thread():
            pressed.computed["values"] = _compute_values(pressed)
    return pressed.computed["values"]


def _compute_values(pressed: PressedCases) -> Arrays:
    """Return the values (n,) of all static measures of pressed cases by name, in SI units."""
    if pressed.variants:
        parts = [(weight, compute_values(part)) for weight, part in pressed.variants]
        names = parts[0][1]
        return {name: sum(weight * part[name] for weight, part in parts) for name in names}

    level = pressed.level
    holder = pressed.holder
    return assemble_static_values(
        np.ptp(pressed.x),
        level.pair.compliance.interface.weight.sum(),
        _CaseTotals(pressed.load, pressed.moment, holder.approach, holder.rotation),
        estimate_peak_pressure(pressed.x, pressed.pressure, pressed.layer_fraction),
        _compute_edge_values(pressed),
    )


def _compute_edge_values(pressed: PressedCases) -> EdgeValues:
    """Return contact lengths and contact stiffnesses of pressed cases.

    All depend on where the contact ends between two nodes, which the nodal pressures show.
    """
    contact_edges = find_contact_edges(pressed)
    low, high = np.moveaxis(edges.find_intervals(pressed.x, pressed.active, contact_edges), -1, 0)
    width = np.fmax.reduce(high, axis=1, initial=np.nan) - np.fmin.reduce(
        low, axis=1, initial=np.nan
    )
    normal, rotational, tangential = _compute_stiffnesses(pressed, contact_edges)
    return EdgeValues(
        length=np.nansum(high - low, axis=1),
        width=np.nan_to_num(width),
        normal=normal,
        tangential=tangential,
        rotational=rotational,
    )


def find_contact_edges(pressed: PressedCases) -> edges.ContactEdges:
    """Return the edges (n, e) of the contacts of pressed cases, with their positions between two nodes."""
    if "edges" in pressed.computed:
        return pressed.computed["edges"]
    level = pressed.level
    x = pressed.x

    # A smooth layer has no gap, so that its edges follow from the pressure alone.
    if level.is_smooth:
        peak = pressed.pressure.max(axis=1, keepdims=True)
        # Smallest pressure [Pa] at an edge of a smooth layer; it keeps the logarithm finite where
        # nothing touches
        threshold = np.maximum(edges.MIN_CONTACT_PRESSURE_RATIO * peak, 1e-300)
        contact_edges = edges.find_pressure_edges(x, pressed.pressure, threshold)
    else:
        active = pressed.active
        table = level.tables[0]
        layer = level.linear_layer
        cells = edges.EdgeCells(
            level.pair.row,
            edges.QUADRATIC_EDGE_OFFSET_FRACTION if level.pair.is_quadratic else None,
            None if layer is None else layer / np.diag(table.compliance),
        )
        unknown = np.where(active, pressed.force, pressed.gap)
        rate = table.unknown[table.find_slots(active), 0]
        contact_edges = edges.find_edges(x, active, unknown, rate, cells)

    # An edge next to a step of the gap lies on the step.
    steps = level.model.gap.step_edges
    if steps:
        contact_edges = edges.snap_to_steps(contact_edges, x, pressed.unloaded_gap, steps)
    pressed.computed["edges"] = contact_edges
    return contact_edges


def _compute_stiffnesses(pressed: PressedCases, contact_edges: edges.ContactEdges) -> np.ndarray:
    """Return normal [N/m], rotational [N m/rad] and tangential stiffness [N/m] of n cases, (3, n).

    The stiffness of the nodes in contact is that of edges half a cell beyond the last nodes. Every edge that lies elsewhere
    adds the change along the parabola through the sets with one node less and one more.

    Parameters
    ----------
    pressed : PressedCases
        n cases.
    contact_edges : ContactEdges
        Their edges.
    """
    level = pressed.level
    active = pressed.active
    n_edges = contact_edges.node.shape[1]
    work = np.zeros((3, len(active)))
    changes = np.zeros((2, 3, len(active), n_edges))

    # The compliance of a smooth layer is that of the linearised law at the pressure of each case
    groups = [(slice(None), level)]
    if level.is_smooth:
        rows = range(len(pressed))
        groups = [(slice(row, row + 1), level.linearise(pressed.layer[row])) for row in rows]
    for rows, part in groups:
        table, shear_table = part.tables
        slots = table.find_slots(active[rows])
        shear_slots = shear_table.find_slots(active[rows])
        for number, (one, own, column) in enumerate(
            ((table, slots, 0), (table, slots, 1), (shear_table, shear_slots, 0))
        ):
            work[number, rows] = one.work[own, column, column]
            changes[:, number, rows] = one.end_changes(own, column, n_edges)

    shift = np.where(contact_edges.exists, contact_edges.fraction - 0.5, 0.0)
    return work + edges.parabola_change(shift, *changes).sum(axis=-1)


def find_contact_intervals(patch: Patch) -> np.ndarray:
    """Return the contact intervals (k, 2) [m] of a patch in the order of increasing x."""
    pressed = patch.pressed
    return edges.find_intervals(pressed.x, pressed.active, find_contact_edges(pressed))[0]


def unresolved_edge_rounding_pressure(pressed: PressedCases) -> np.ndarray:
    """Return the peak pressures (n,) [Pa] at rounded ends that the mesh does not resolve; 0 if it does.

    On a mesh that does not resolve the rounding, the cells at the contact edge carry the pressure
    of a sharp end, K = sigma_n sqrt(cell). The peak on the rounding then follows from
    `rounded_corner_contact`.
    """
    pair = pressed.level.pair
    x = pressed.x
    largest = np.zeros(len(pressed))
    rounded = _rounded_bodies(pair)
    # An asperity layer (skin) bounds the pressure.
    if not rounded or pressed.level.has_layer:
        return largest

    # The curvatures 1/R and the compliances 1/E* of the two bodies add up.
    half_flat_length = min(body.half_flat_length for body in rounded)
    radius = 1 / sum(1 / body.end.size for body in rounded)
    coatings = [piece.layers.coating for piece in (pair.piece, pair.upper)]
    modulus = 1 / sum((1 - nu**2) / young for young, nu in coatings)

    active = pressed.active
    cells = np.diff(x)
    for row in np.flatnonzero(active.any(axis=1)):
        loaded = np.flatnonzero(active[row])
        for node in (loaded[0], loaded[-1]):
            cell = cells[max(node - 1, 0) : node + 1].max()
            # The contact does not end at the rounded end.
            if abs(abs(x[node]) - half_flat_length) > 2 * cell:
                continue
            pressure = pressed.contact_pressure[row, max(node - 2, 0) : node + 3].max()
            peak_width, peak = closed_forms.contact.rounded_corner_contact(
                pressure * np.sqrt(cell), radius, modulus
            )
            # Smallest number of contact cells on a rounded end at which its pressure peak is
            # resolved.
            if 4 * cell > peak_width:
                largest[row] = max(largest[row], peak)
    return largest


def open_rounded_length(pressed: PressedCases) -> np.ndarray:
    """Return the lengths (n,) [m] of rounded surface on which a contact edge may lie.

    It is the length beyond the flat part, for each end whose last node is in contact.
    """
    rounded = _rounded_bodies(pressed.level.pair)
    if not rounded:
        return np.zeros(len(pressed))
    rounded_length = pressed.x[-1] - min(body.half_flat_length for body in rounded)
    return pressed.active[:, [0, -1]].sum(axis=1) * rounded_length


def contact_reaches_steep_end(pressed: PressedCases) -> np.ndarray:
    """Return whether the contact reaches the steep part of a rounded end, where the model ends (n,).

    A single loaded node whose cell is longer than the whole rounded end does not count.
    """
    cells = np.diff(pressed.x)[[0, -1]]
    return (pressed.active[:, [0, -1]] & (cells < open_rounded_length(pressed)[:, None])).any(
        axis=1
    )


def _rounded_bodies(pair) -> list[TensorGrid]:
    """Return the meshes of the pieces whose interface ends are rounded."""
    bodies = []
    for body in (pair.grid, pair.upper_grid):
        is_rounded = isinstance(body, TensorGrid) and body.end.kind == "radius"
        if is_rounded and body.interface_depths[-1] > 0:
            bodies.append(body)
    return bodies
