"""Wear between two states of one patch: worn volume, depths, worn part, and the part that a trace cannot show.

In: the surface of a patch and the errors of its measures before and after. Out: `Wear`. Read `measure_wear` first.
"""

from typing import NamedTuple

import numpy as np

from ..core import PatchfemError, max_abs
from ..formatting import format_length
from ..model.wear import GAP_DIFFERENCE_FRACTION, LOADING_KEYS
from ..surface.quantity import Quantity

# Number of points on the floor; more change its depth by less than the error of a run
N_FLOOR_POINTS = 100


class PatchState(NamedTuple):
    """Surface of a patch at the end of a run; fields are (m,), or (s, m) over a face.

    Attributes
    ----------
    source : str
        Results folder.
    contact : dict
        Table [contact] of the scene.
    x : (m,) array
        Nodes [m].
    y : (s,) array or None
        Middles of the rows of cells [m].
    area, gap, depth : array
        Areas of the nodes [m2]; gap of the unloaded surfaces with wear, and worn depth so far [m].
    measures : dict
        {name: (value, error)} of worn_volume and worn_depth_max, without wear {}; an error may be None.
    """

    source: str
    contact: dict[str, object]
    x: np.ndarray
    y: np.ndarray | None
    area: np.ndarray
    gap: np.ndarray
    depth: np.ndarray
    measures: dict[str, tuple[float, float | None]]


class Wear(NamedTuple):
    """Wear of a patch between two states.

    Attributes
    ----------
    gaps : tuple of array
        Gaps [m] before and after.
    depth : array
        Depth [m] worn between them.
    values, track : dict of str to Quantity
        Quantities of the patch, and of its worn part ({} over a face).
    hidden : tuple of float
        Hidden wear [m] at the ends or corners of the patch.
    error : float
        Numerical error of the depth [m].
    """

    gaps: tuple[np.ndarray, np.ndarray]
    depth: np.ndarray
    values: dict[str, Quantity]
    track: dict[str, Quantity]
    hidden: tuple[float, ...]
    error: float


def measure_wear(first: PatchState, second: PatchState) -> Wear:
    """Measure the wear between two states of one patch.

    Parameters
    ----------
    first, second : PatchState
        The less worn state first.

    Returns
    -------
    Wear

    Raises
    ------
    PatchfemError
        If the states are those of different patches, or in the wrong order.
    """
    _require_same_patch(first, second)
    x = second.x
    depth = second.depth - _move_to(second, first, first.depth)
    area = float(second.area.sum())
    length = float(np.ptp(x))
    volume, volume_error = _measure_change(first, second, "worn_volume")
    _, depth_error = _measure_change(first, second, "worn_depth_max")
    if depth_error is not None:
        depth_error += _interpolation_error(first, x)
    error = depth_error or 0.0

    # a node is worn if its depth is larger than the error
    # Smallest depth of a worn node relative to the largest depth
    is_worn = depth > max(error, 1e-3 * float(depth.max()), 0.0)
    hidden = find_plane_below(x, second.y, depth)
    worn_fraction = float(second.area[is_worn].sum()) / area
    mean_error = None if volume_error is None else volume_error / area
    values = {
        "worn_volume": _enclose(volume, volume_error, "m3"),
        "worn_depth_max": _enclose(float(depth.max()), depth_error, "m"),
        "worn_depth_mean": _enclose(volume / area, mean_error, "m"),
        "worn_area": _enclose(volume / area * length, mean_error and mean_error * length, "m2"),
        "hidden_wear": _enclose(float(np.mean(hidden)), depth_error, "m"),
        "worn_share": Quantity(worn_fraction, worn_fraction, worn_fraction, "1", ""),
    }
    track = {}
    if second.y is None and is_worn.any():
        track = _measure_track(x, depth, is_worn, error, volume / area * length)
    gaps = (second.gap - depth, second.gap)
    return Wear(gaps, depth, values, track, hidden, error)


def _require_same_patch(first: PatchState, second: PatchState) -> None:
    """Raise PatchfemError unless the states are those of one patch, the less worn one first."""
    unlike = []
    for key in {**first.contact, **second.contact}:
        if key not in LOADING_KEYS and first.contact.get(key) != second.contact.get(key):
            unlike.append(f"contact.{key}")
    both = f"{first.source} and {second.source}: these are two different patches"
    if unlike:
        raise PatchfemError(f"{both}: {', '.join(unlike)} differ")

    # tables may name files that changed, so the unworn gaps are compared too
    unworn = [_move_to(second, state, state.gap - state.depth) for state in (first, second)]
    difference = max_abs(unworn[0] - unworn[1])
    # Range of heights [m] below which an unworn surface is flat
    if difference > GAP_DIFFERENCE_FRACTION * float(np.ptp(unworn[1])) + 1e-12:
        raise PatchfemError(
            f"{both}: their unworn surfaces differ by {format_length(difference, 3)}; "
            "compare runs of the same pieces"
        )
    volumes = [state.measures.get("worn_volume", (0.0, None))[0] for state in (first, second)]
    if volumes[1] < volumes[0]:
        raise PatchfemError(
            f"{first.source} is worn more than {second.source}; give the less worn run as the first folder"
        )


def _move_to(target: PatchState, state: PatchState, values) -> np.ndarray:
    """Interpolate values of a state, (m,) or (s, m), to the positions of another state of the same patch."""
    moved = _interpolate(target.x, state.x, values)
    if target.y is None or np.array_equal(target.y, state.y):
        return moved
    return _interpolate(target.y, state.y, moved.T).T


def _interpolate(x, given_x, values) -> np.ndarray:
    """Interpolate values (k,) or (s, k) from the nodes of one mesh to those of another.

    `x` [m] are the positions of the new nodes, and `given_x` (k,) [m] the increasing positions of the values.
    """
    return np.apply_along_axis(lambda row: np.interp(x, given_x, row), -1, values)


def _measure_change(first: PatchState, second: PatchState, name: str) -> tuple[float, float | None]:
    """Return the change of a measure from the first to the second state, and its error.

    The error is the sum of the errors of both values, or None if one of them is unknown. `first` is the less worn state,
    and the measure `name` is 0 where this state has none.
    """
    value, error = second.measures[name]
    earlier, earlier_error = first.measures.get(name, (0.0, 0.0))
    return value - earlier, None if None in (error, earlier_error) else error + earlier_error


def _interpolation_error(state: PatchState, x) -> float:
    """Return the error [m] of a depth on another mesh: a quarter of the change if every second node is used."""
    if np.array_equal(state.x, x) or not state.depth.any():
        return 0.0
    nodes = np.unique([*range(0, state.x.size, 2), state.x.size - 1])
    coarse = _interpolate(state.x, state.x[nodes], state.depth[..., nodes])
    return max_abs(state.depth - coarse) / 4


def _enclose(value: float, error: float | None, unit: str) -> Quantity:
    """Return a quantity that is not negative, with the interval of its numerical error.

    `value` and `error` are in the unit `unit`. The interval is unknown if the error is None.
    """
    if error is None:
        return Quantity(value, None, None, unit, "", "no error is estimated")
    return Quantity(value, max(value - error, 0.0), value + error, unit, "")


def find_plane_below(x, y, depth) -> tuple[float, ...]:
    """Find the plane with the largest mean below worn depths, by linear programming.

    A measured trace or scan cannot show such an even or wedge-shaped part, for it is a shift of the datum.

    Parameters
    ----------
    x, y : (m,), (s,) arrays
        Positions [m]; y is None for a single line.
    depth : (m,) or (s, m) array
        Worn depths [m].

    Returns
    -------
    tuple of float
        Depths [m] at both ends, or at the four corners; none is negative.
    """
    from scipy.optimize import linprog

    scale = float(depth.max())
    weights = np.kron(_weigh_ends(y), _weigh_ends(x))
    n_corners = weights.shape[1]
    if not scale > 0:
        return (0.0,) * n_corners

    # The unknowns are the depths at the corners. Four of them lie on a plane if the sums over the diagonals are equal.
    plane = linprog(
        np.full(n_corners, -1 / n_corners),
        weights,
        np.maximum(depth, 0.0).ravel() / scale,
        np.array([[1.0, -1.0, -1.0, 1.0]]) if n_corners == 4 else None,
        [0.0] if n_corners == 4 else None,
    )
    return tuple((plane.x * scale).tolist())


def _weigh_ends(positions) -> np.ndarray:
    """Return the weights (k, 2) of both ends in a linear interpolation to positions (k,); (1, 1) for a single position."""
    if positions is None or len(positions) == 1:
        return np.ones((1, 1))
    fraction = (positions - positions[0]) / (positions[-1] - positions[0])
    return np.column_stack([1 - fraction, fraction])


def _measure_track(x, depth, is_worn, error: float, area: float) -> dict[str, Quantity]:
    """Measure the worn part of a line.

    Parameters
    ----------
    x : (m,) array
        Positions of the nodes [m].
    depth : (m,) array
        Worn depths [m].
    is_worn : (m,) array of bool
        Nodes that are worn.
    error : float
        Error of the depths [m].
    area : float
        Lost area [m2].
    """
    worn = np.flatnonzero(is_worn)
    first = max(int(worn[0]) - 1, 0)
    last = min(int(worn[-1]) + 1, x.size - 1)
    start = float(x[first])
    end = float(x[last])
    width = end - start

    # an end is known to the half of both neighbouring elements
    cells = [float(x[min(k + 1, x.size - 1)] - x[max(k - 1, 0)]) / 2 for k in (first, last)]
    # Width of the worn part divided by that of its floor, the deepest fifth
    places = np.linspace(start, end, 5 * N_FLOOR_POINTS)
    means = np.convolve(
        np.interp(places, x, depth), np.full(N_FLOOR_POINTS, 1 / N_FLOOR_POINTS), "valid"
    )
    hidden = find_plane_below(x[first : last + 1], None, depth[first : last + 1])
    mean_error = error + area / width * sum(cells) / width
    return {
        "from": Quantity(start, start - cells[0], start + cells[0], "m", ""),
        "to": Quantity(end, end - cells[1], end + cells[1], "m", ""),
        "hidden_wear": _enclose(float(np.mean(hidden)), error, "m"),
        "depth_mean": _enclose(area / width, mean_error, "m"),
        "depth_floor": _enclose(float(means.max()), error, "m"),
        "area_net": _enclose(area, error * width, "m2"),
        "area_gross": _enclose(area, error * width, "m2"),
        "pile_up": Quantity(0.0, 0.0, 0.0, "m2", ""),
    }
