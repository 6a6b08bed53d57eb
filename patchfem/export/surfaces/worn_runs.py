"""Wear between two runs of one patch, from their results folders."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import Missing, PatchfemError, frozen_array
from ...formatting import format_length
from ...model.earlier_wear import GAP_DIFFERENCE_FRACTION, LOADING_KEYS
from ...surface.compare import ratios
from ...surface.compare.compare import AMPLITUDE, SLOPE
from ...surface.profile import Profile, level
from ...surface.quantity import Quantity, make_unknown
from ..pages import several_runs
from ..read_results import is_real, read_variables, reading_errors, require_valid

REQUIRED_VARIABLES = {  # possible numbers of dimensions of each required variable
    "x": (1,),
    "weight": (1,),
    "unloaded_gap": (1, 2),
    "normal_stress": (2,),
}
OPTIONAL_VARIABLES = (
    "strip_offset",
    "worn_depth",
    "time",
    "slide",
    "relative_displacement",
    "friction_force",
    "wear_cycle",
)
# Ratio of the width of the worn part to that of its floor, the deepest
# fifth, as for measured tracks.
FLOOR_PARTS = 5
# Number of points on the floor of the worn part; more points change its depth by
# less than the error of the run.
FLOOR_POINTS = 100
MIN_WORN_FRACTION = 1e-3  # smallest depth of a worn node, relative to the largest depth
# Standard deviation of the heights below which an unworn surface counts as flat [m].
MIN_ROUGHNESS = 1e-12
TEXTS = {
    "worn_volume": ("m3", "material lost over the whole patch, both pieces together"),
    "worn_depth_max": ("m", "largest worn depth"),
    "worn_depth_mean": ("m", "mean worn depth: worn volume divided by the area"),
    "worn_area": ("m2", "worn area of the section: worn volume divided by the width"),
    "worn_share": ("1", "fraction of the patch area that lost more than the error of the depth"),
    "hidden_wear": (
        "m",
        "mean of the highest straight line that nowhere exceeds the worn depth: uniform and "
        "wedge-shaped wear, which a trace of this part alone could not show",
    ),
}
HIDDEN_UNDER_PLANE = (
    "mean of the highest plane that nowhere exceeds the worn depth: uniform and wedge-shaped wear, "
    "which a scan of this part alone could not show"
)


class PatchSurface(NamedTuple):
    """Surface of a patch: nodes, gap and worn depth, (m,) or (s, m) with strips.

    Attributes
    ----------
    x : (m,) array
        [m]
    y : (s,) array or None
        Centres of the strips [m]; None if there are no strips.
    area : array
        Areas of the nodes [m2].
    gap : array
        Gap of the unloaded surfaces, wear included [m].
    depth : array
        Worn depth so far [m].
    """

    x: np.ndarray
    y: np.ndarray | None
    area: np.ndarray
    gap: np.ndarray
    depth: np.ndarray


class PatchRun(NamedTuple):
    """Run of a patch, read from its results folder.

    Attributes
    ----------
    run : FinishedRun
    path : str
        Name of the folder as the user gave it.
    surface : PatchSurface
    pressure : (m,) array
        Normal stress [Pa]; the mean over strips.
    loop : tuple or None
        Displacement [m] and friction force [N] (k,) of the last cycle; None if there is no drive.
    cycles : float
        Cycles of wear.
    """

    run: "several_runs.FinishedRun"
    path: str
    surface: PatchSurface
    pressure: np.ndarray
    loop: tuple | None
    cycles: float

    @property
    def has_wear(self) -> bool:
        """Return whether the scene of the run has a table [wear]."""
        return "wear" in self.run.resolved

    def measure(self, name: str) -> dict | None:
        """Return a measure of the run, or None if it has no value."""
        measure = self.run.summary["measures"].get(name)
        return measure if measure is not None and measure["value"] is not None else None

    def describe_position(self, number: int) -> str:
        """Describe where on the patch a node lies, given its number."""
        x = self.surface.x
        y = self.surface.y
        strip, node = divmod(int(number), x.size)
        return f"x = {format_length(float(x[node]), 3)}" + (
            "" if y is None else f", y = {format_length(float(y[strip]), 3)}"
        )


class Wear(NamedTuple):
    """Wear of a patch between two runs.

    Attributes
    ----------
    before, after : PatchRun
    gaps : tuple
        Gaps [m] before and after, (m,) or (s, m).
    depth : array
        Depth worn between them [m].
    values : dict of Quantity
    track : dict of Quantity
        Quantities of the worn part; {} with strips.
    notes : list of str
    """

    before: PatchRun
    after: PatchRun
    gaps: tuple
    depth: np.ndarray
    values: dict
    track: dict
    notes: list


def compare_runs(before: Path, after: Path) -> Wear:
    """Compute the wear of a patch between the runs in two results folders.

    The later run has [wear]; the earlier one may be new. Raises PatchfemError if a folder is no run
    of a patch, and if the two are not states of one patch in this order.
    """
    for path, other in ((before, after), (after, before)):
        if not path.exists():
            raise Missing(f"{path}: there is no such folder")
        if not path.is_dir():
            raise PatchfemError(
                f"{path}: a file, while {other} is a folder: two files of surfaces or two results "
                "folders are needed"
            )
    first = read_run(before)
    second = read_run(after)
    if not second.has_wear:
        raise PatchfemError(
            f"{after}: this run has no [wear], so nothing wore off; give the run with [wear] as "
            "the second folder"
        )
    _require_same_patch(first, second)
    return _measure_wear(first, second)


def read_run(path: Path) -> PatchRun:
    """Read the run of a patch from a results folder; raise PatchfemError if there is none."""
    run = several_runs.read_run(path)
    if "contact" not in run.resolved:
        raise PatchfemError(f"{path}: a run without [contact] has no surfaces to compare")
    file = path / "result.nc"
    if not file.is_file():
        raise PatchfemError(f"{path}: not a results folder of a run: it has no result.nc")
    fields = {
        name: variable.values
        for name, variable in read_variables(file, {*REQUIRED_VARIABLES, *OPTIONAL_VARIABLES})[
            1
        ].items()
    }
    with reading_errors(file, "results of a patch"):
        surface = _check_fields(fields)
    cycles = float(fields["wear_cycle"][-1]) if "wear_cycle" in fields else 0.0
    return PatchRun(
        run, str(path), surface, fields["normal_stress"][-1], _last_loop(run, fields), cycles
    )


def _check_fields(fields: dict) -> PatchSurface:
    """Return the surface of a patch from the checked variables of its results.

    Raises ValueError if they do not match.
    """
    for name, dimensions in REQUIRED_VARIABLES.items():
        require_valid(name in fields, f"it contains no {name}; run the scene again")
        values = fields[name]
        is_field = is_real(values) and values.ndim in dimensions and np.isfinite(values).all()
        require_valid(is_field, f"{name} is not a field along the patch")
    x = fields["x"]
    lengths = {
        fields[name].shape[-1] for name in (*REQUIRED_VARIABLES, "worn_depth") if name in fields
    }
    require_valid(x.size > 1 and lengths == {x.size}, "its fields differ in length")
    require_valid(
        (np.diff(x) > 0).all() and fields["weight"].sum() > 0, "x is not a list of positions"
    )
    y = fields.get("strip_offset")
    shape = x.shape if y is None else (y.size, x.size)
    depth = fields["worn_depth"][-1] if "worn_depth" in fields else np.zeros(x.size)
    shapes = {depth.shape, fields["unloaded_gap"].shape}
    require_valid(shapes <= {x.shape, shape}, "the fields do not match the strips")
    area, gap, depth = (
        np.broadcast_to(field, shape) for field in (fields["weight"], fields["unloaded_gap"], depth)
    )
    return PatchSurface(x, y, area if y is None else area / y.size, gap, depth)


def _last_loop(run, fields: dict) -> tuple | None:
    """Return relative displacement [m] and friction force [N] of the last cycle.

    Without a drive period they are those of the whole run; None if the run has no friction loop.
    """
    slide = fields.get("slide", fields.get("relative_displacement"))
    if slide is None or "friction_force" not in fields or fields["friction_force"].ndim != 1:
        return None
    time = fields["time"]
    period = several_runs.drive_period(run)
    start = time[-1] - period * (1 + 1e-9) if period else time[0]
    return slide[time >= start], fields["friction_force"][time >= start]


def _require_same_patch(first: PatchRun, second: PatchRun) -> None:
    """Raise PatchfemError unless the runs are two states of one patch, the less worn one first."""
    both = f"{first.path} and {second.path}: these are two different patches"
    x = second.surface.x
    tables = []
    unworn = []
    volumes = []
    for run in (first, second):
        contact = run.run.resolved["contact"]
        tables.append({key: value for key, value in contact.items() if key not in LOADING_KEYS})
        unworn.append(_interpolate_columns(x, run.surface.x, run.surface.gap - run.surface.depth))
        volume = run.measure("worn_volume")
        volumes.append(volume["value"] if volume else 0.0)
    keys = {**tables[0], **tables[1]}
    unlike = [f"contact.{key}" for key in keys if tables[0].get(key) != tables[1].get(key)]
    if unlike:
        raise PatchfemError(f"{both}: {', '.join(unlike)} differ")
    difference = float(np.abs(unworn[0] - unworn[1]).max())
    if difference > GAP_DIFFERENCE_FRACTION * float(np.ptp(unworn[1])) + MIN_ROUGHNESS:
        raise PatchfemError(
            f"{both}: their unworn surfaces differ by {format_length(difference, 3)}"
        )
    if volumes[1] < volumes[0]:
        raise PatchfemError(
            f"{first.path} is worn more than {second.path}; give the less worn run as the first "
            "folder"
        )


def _interpolate_columns(x, given_x, values) -> np.ndarray:
    """Interpolate values (k,) or (s, k) from the positions of one mesh to those of another.

    The values are given at `given_x` (k,), and returned at x (m,).
    """
    return np.apply_along_axis(lambda row: np.interp(x, given_x, row), -1, values)


def _measure_wear(first: PatchRun, second: PatchRun) -> Wear:
    """Compute the quantities of the wear between two runs."""
    surface = second.surface
    x = surface.x
    depth = surface.depth - _interpolate_columns(x, first.surface.x, first.surface.depth)
    gaps = (surface.gap - depth, surface.gap)
    area = float(surface.area.sum())
    volume, volume_error = _measure_change(first, second, "worn_volume")
    _, depth_error = _measure_change(first, second, "worn_depth_max")
    if depth_error is not None:
        depth_error += _mesh_error(first.surface, x)
    error = depth_error or 0.0
    largest = float(depth.max())
    worn = (
        float(surface.area[depth > max(error, MIN_WORN_FRACTION * largest)].sum()) / area
        if largest > 0
        else 0.0
    )
    length = float(np.ptp(x))
    relative_error = None if volume_error is None else volume_error / area
    values = {
        "worn_volume": _make_quantity("worn_volume", volume, volume_error),
        "worn_depth_max": _make_quantity("worn_depth_max", largest, depth_error),
        "worn_depth_mean": _make_quantity("worn_depth_mean", volume / area, relative_error),
        "worn_area": _make_quantity(
            "worn_area", volume / area * length, relative_error and relative_error * length
        ),
        "hidden_wear": _make_quantity(
            "hidden_wear", float(np.mean(hidden_depths(surface, depth))), depth_error
        ),
        "worn_share": Quantity(worn, worn, worn, *TEXTS["worn_share"]),
    }
    track = {}
    if surface.y is None:
        track = _measure_track(x, depth, error, volume / area * length)
    else:
        values["hidden_wear"] = values["hidden_wear"]._replace(text=HIDDEN_UNDER_PLANE)
    values |= _wave_ratios(x, gaps)
    notes = []
    for name, run in (("before", first), ("after", second)):
        notes += [f"{name}: {text}" for text in run.run.summary.get("warnings", ())]
    if float(depth.min()) < -error:
        place = second.describe_position(np.argmin(depth))
        missing_depth = format_length(-float(depth.min()), 3)
        notes.append(
            f"at {place} the later run is worn by {missing_depth} less, so it does not continue the earlier "
            "one"
        )
    return Wear(first, second, gaps, depth, values, track, notes)


def _mesh_error(surface: PatchSurface, x) -> float:
    """Estimate the error [m] of an interpolated depth.

    It is a quarter of the change if only every second node is used.
    """
    if np.array_equal(surface.x, x) or not surface.depth.any():
        return 0.0
    coarse_nodes = np.unique([*range(0, surface.x.size, 2), surface.x.size - 1])
    coarse = _interpolate_columns(
        surface.x, surface.x[coarse_nodes], surface.depth[..., coarse_nodes]
    )
    return float(np.abs(surface.depth - coarse).max()) / 4


def _measure_change(first: PatchRun, second: PatchRun, name: str) -> tuple[float, float | None]:
    """Return the change of a measure and the sum of its errors, which is None if one is unknown."""
    later_value = second.measure(name)
    earlier = first.measure(name)
    if earlier is None:
        return later_value["value"], later_value["error"]
    errors = (earlier["error"], later_value["error"])
    return later_value["value"] - earlier["value"], None if None in errors else float(sum(errors))


def _make_quantity(name: str, value: float, error: float | None) -> Quantity:
    """Return one of the quantities in TEXTS, with an interval that covers its numerical error."""
    unit, text = TEXTS[name]
    return _make_nonnegative_quantity(value, error, unit, text)


def _make_nonnegative_quantity(value: float, error: float | None, unit: str, text: str) -> Quantity:
    """Return a non-negative quantity with an interval that covers its numerical error."""
    if error is None:
        return Quantity(value, value, None, unit, text, "no error is estimated")
    return Quantity(value, max(value - error, 0.0), value + error, unit, text)


def hidden_depths(surface: PatchSurface, depth) -> tuple:
    """Return the hidden wear [m] at the ends or corners of the patch."""
    if surface.y is None:
        return hidden_line(surface.x, depth)
    return find_plane_below(surface.x, surface.y, depth)


def hidden_line(x, depth) -> tuple:
    """Find the straight line with the largest mean below depths (m,) [m] at x (m,) [m].

    Returns its depths [m] at both ends, none below zero. An unworn stretch leaves none: from there
    a trace shows all wear.
    """
    return find_plane_below(np.asarray(x, float), np.zeros(1), np.asarray(depth, float)[None])[:2]


def find_plane_below(x, y, depth) -> tuple:
    """Find the plane with the largest mean below depths (s, m) [m] by linear programming.

    Parameters
    ----------
    x, y : (m,), (s,) arrays [m]
    depth : (s, m) array [m]

    Returns
    -------
    tuple of float
        Depths [m] at the four corners, none below zero.
    """
    from scipy.optimize import linprog

    scale = float(depth.max())
    if not scale > 0:
        return 0.0, 0.0, 0.0, 0.0
    along, across = (
        np.interp(axis, (axis[0], axis[-1]), (-1, 1)) if axis.size > 1 else np.zeros(1)
        for axis in (x, y)
    )
    column, row = np.meshgrid(along, across)
    nodes = np.column_stack([np.ones(column.size), column.ravel(), row.ravel()])
    corners = np.array(
        [(1.0, -1, across[0]), (1.0, 1, across[0]), (1.0, -1, across[-1]), (1.0, 1, across[-1])]
    )
    bounds = np.concatenate([np.maximum(depth, 0.0).ravel() / scale, np.zeros(4)])
    plane = linprog(
        (-1.0, 0.0, 0.0), np.concatenate([nodes, -corners]), bounds, bounds=(None, None)
    ).x
    return tuple(np.maximum(corners @ plane * scale, 0.0).tolist())


def _wave_ratios(x, gaps: tuple) -> dict:
    """Compute the ratios of amplitude and slope of the surface after wear to those before."""
    texts = {"amplitude": AMPLITUDE, "slope": SLOPE}
    reason = ""
    if gaps[0].ndim == 2:
        reason = "the patch is in strips"
    else:
        before, after = (Profile(frozen_array(x), frozen_array(gap), "the patch") for gap in gaps)
        if level(before).z.std() < MIN_ROUGHNESS:
            reason = "the unworn surfaces are flat"
        else:
            try:
                return _profile_ratios(before, after, texts)
            except PatchfemError as error:
                reason = str(error)
    return {f"{part}_ratio": make_unknown("1", text, reason) for part, text in texts.items()}


def _profile_ratios(before: Profile, after: Profile, texts: dict) -> dict:
    """Return the ratios of amplitude and slope of two profiles with their intervals."""
    step = float(np.diff(before.x).min())
    size_before, size_after = (ratios.measure_size(profile, step) for profile in (before, after))
    first, width = ratios.resample(before, step)
    second, _ = ratios.resample(after, step)
    out = {}
    for (part, text), correlation in zip(
        texts.items(), ratios.correlate_traces(first, second, width)
    ):
        out[f"{part}_ratio"] = ratios.divide_sizes(part, text, size_after, size_before, correlation)
    return out


def _measure_track(x, depth, error: float, area: float) -> dict:
    """Measure the part of a patch whose worn depth exceeds the error [m] of this depth.

    area: lost area [m2] of the section.
    """
    deep = np.flatnonzero(depth > max(error, MIN_WORN_FRACTION * float(depth.max())))
    if not deep.size or depth.max() <= 0:
        return {}
    first = max(int(deep[0]) - 1, 0)
    last = min(int(deep[-1]) + 1, x.size - 1)
    cells = [float(x[min(k + 1, x.size - 1)] - x[max(k - 1, 0)]) / 2 for k in (first, last)]
    start = float(x[first])
    end = float(x[last])
    width = end - start
    places = np.linspace(start, end, FLOOR_PARTS * FLOOR_POINTS)
    part = np.full(FLOOR_POINTS, 1 / FLOOR_POINTS)
    floor = float(np.convolve(np.interp(places, x, depth), part, "valid").max())
    hidden = float(np.mean(hidden_line(x[first : last + 1], depth[first : last + 1])))
    mean_error = error + area / width * sum(cells) / width
    return {
        "from": Quantity(
            start, start - cells[0], start + cells[0], "m", "where the worn part begins"
        ),
        "to": Quantity(end, end - cells[1], end + cells[1], "m", "where the worn part ends"),
        "hidden_wear": _make_quantity("hidden_wear", hidden, error),
        "depth_mean": _make_nonnegative_quantity(
            area / width, mean_error, "m", "area lost divided by the width"
        ),
        "depth_floor": _make_nonnegative_quantity(
            floor, error, "m", "mean depth over the deepest fifth of the width"
        ),
        "area_net": _make_nonnegative_quantity(
            area, error * width, "m2", "lost area minus pile-up; pile-up is zero in a computed run"
        ),
        "area_gross": _make_nonnegative_quantity(area, error * width, "m2", "lost area"),
        "pile_up": Quantity(0.0, 0.0, 0.0, "m2", "computed wear makes no pile-up"),
    }
