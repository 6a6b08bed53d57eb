"""Error of a scene against computing time, as lines for the screen, cost.csv and a picture."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..campaigns.cost import (
    TOLERANCE,
    Cost,
    describe_fastest_setting,
    find_affected_measures,
    find_fastest_settings,
    find_measures_with_error,
    find_worst_error,
    find_worst_run_error,
)
from ..disk.atomic_write import write_rows, write_text
from ..formatting import format_number
from .drawing import charts, pictures

AXES = {
    TOLERANCE: "tolerance",
    "element_size": "element size",
    "steps_per_cycle": "steps per cycle",
    "shear_modes": "shear modes",
    "jumps": "jumps over the cycles of wear",
}
# Measures that the detailed table lists first, if the setting changes them.
MAIN_MEASURES = (
    "worn_depth_max",
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "loop_area",
    "friction_force_peak",
    "pressure_peak",
    "contact_fraction",
    "approach",
    "rotation",
    "normal_stiffness",
    "tangential_stiffness",
)
ROUND_OFF = 1e-12  # relative error below which a result counts as exact
LABEL_HEIGHT = 0.06  # smallest distance of two labels, relative to the height of the axes
AXES_HEIGHT = 210.0  # height of the axes [points]
HEIGHT = 4.2  # height of the picture [inch]
# Position along the axis, relative to its width, beyond which a label
# stands to the left of its point.
LABEL_LEFT_FRACTION = 0.6
# Margin on both sides of a logarithmic axis, relative to the logarithm of the range of its values.
AXIS_MARGIN = 0.15
# Smallest ratio of the ends of the time axis, for runs with equal times.
MIN_SECONDS_RATIO = 2.0
MIN_ERROR_RATIO = 10.0  # smallest ratio of the ends of the error axis, for equal errors


def format_cost(knob: str, runs: list, tolerance: float) -> list[str]:
    """Format the runs of a curve as lines, one per tolerance or per value of a setting.

    Parameters
    ----------
    knob : str
        TOLERANCE or a numerical setting.
    runs : list of Cost
    tolerance : float
        That of the scene.

    Returns
    -------
    list of str
    """
    if knob != TOLERANCE:
        names = find_measures_with_error(runs)
        rows = [(run, find_worst_error(run, names, tolerance), "") for run in runs]
        last = [describe_fastest_setting(runs, tolerance)]
    else:
        groups = _group_by_tolerance(runs)
        rows = [
            (group[0], find_worst_run_error(group[0]), _format_outcome(group)) for group in groups
        ]
        missed = [group[-1] for group in groups if not group[-1].meets_tolerance()][-1:]
        last = [
            f"tolerance {entry.tolerance:g}: {remedy}"
            for entry in missed
            for remedy in entry.remedies
        ]
    width = max(len(knob), *(len(entry.label) for entry, *_ in rows))
    out = [f"{knob:<{width}}  {'CPU s':>6}  {'error':>8}  worst measure"]
    for entry, worst, comment in rows:
        error = format_number(worst.fraction, 2) if worst.fraction > ROUND_OFF else "exact"
        text = f"{entry.label:<{width}}  {format_number(entry.seconds, 2):>6}  {error:>8}  {worst.name}"
        out.append(f"{text.rstrip()}{comment}")
    return [*out, *last]


def _group_by_tolerance(runs: list) -> list[list]:
    """Group the runs of a cost curve by tolerance, each with the settings tried for it."""
    out: list[list] = []
    for run in runs:
        if out and out[-1][0].tolerance == run.tolerance:
            out[-1].append(run)
        else:
            out.append([run])
    return out


def _format_outcome(group: list) -> str:
    """State whether a tolerance is met by the run itself or by the settings that were tried next."""
    first = group[0]
    last = group[-1]
    if first.meets_tolerance():
        return ""
    of_steps = any("accuracy.steps_per_cycle = " in remedy for remedy in first.remedies)
    missed = f"; not with {first.steps} steps per cycle" if of_steps else "; not reached"
    if last is first:
        return missed
    settings = last.label.partition(", ")[2]
    seconds = f"{settings} ({format_number(last.seconds, 2)} CPU s)"
    if last.meets_tolerance():
        return f"{missed}, but with {seconds}"
    worst = find_worst_run_error(last)
    return f"{missed}, nor with {seconds}: {format_number(worst.fraction, 2)} in {worst.name}"


def format_details(knob: str, runs: list, tolerance: float) -> list[str]:
    """Format a table of several measures with stated errors and distances to the best run.

    Parameters
    ----------
    knob : str
        A numerical setting.
    runs : list of Cost
    tolerance : float
        That of the scene.

    Returns
    -------
    list of str
    """
    names = detailed_measures(runs, tolerance)
    has_wall_times = any(run.needs_elapsed_time() for run in runs)
    width = max(len(knob), *(len(run.label) for run in runs))
    head = [
        f"{knob:<{width}}",
        f"{'CPU s':>7}",
        *[f"{'clock s':>7}"] * has_wall_times,
        *(f"{text:>17}" for text in names),
    ]
    out = ["  ".join(head)]
    out.append(
        "  ".join(
            [" " * len(text) for text in head[: 2 + has_wall_times]]
            + ["stated (distance)".rjust(max(17, len(text))) for text in names]
        )
    )
    for run in runs:
        cells = [
            f"{run.label:<{width}}",
            f"{run.seconds:7.3f}",
            *[f"{run.wall_seconds:7.3f}"] * has_wall_times,
        ]
        out.append(
            "  ".join(
                cells + [_format_errors(run, name).rjust(max(17, len(name))) for name in names]
            )
        )
    return [*out, describe_fastest_setting(runs, tolerance)]


def _format_errors(run: Cost, name: str) -> str:
    """Format the error of a measure and its distance to the most accurate run.

    Both are relative to the value.
    """
    size = abs(run.values.get(name, 0.0))
    error = _format_relative(run.errors.get(name), size)
    distance = _format_relative(run.distances.get(name), size)
    return f"{error} ({distance})"


def _format_relative(difference: float | None, size: float) -> str:
    """Format a difference relative to a size, or return "-" if one of them is missing."""
    if difference is None or not size:
        return "-"
    ratio = difference / size
    return "exact" if ratio < ROUND_OFF else f"{ratio:.1e}"


def detailed_measures(runs: list, tolerance: float) -> list:
    """Return the measures that the detailed cost table shows.

    They are those of MAIN_MEASURES that the setting changes, and the worst measure of each run; if there are
    none of these, all measures that it changes.
    """
    changed = find_affected_measures(runs) or find_measures_with_error(runs)
    names = find_measures_with_error(runs)
    worst = {
        find_worst_error(run, names, tolerance).name for run in runs if run.errors or run.distances
    }
    ordered_names = (*MAIN_MEASURES, *sorted(worst.difference(MAIN_MEASURES)))
    return [name for name in ordered_names if name in changed] or changed


def write(folder: Path, curves: dict) -> Path:
    """Write the table of a cost curve to cost.csv in a folder, and return its path.

    There is one row per run: knob, setting, CPU seconds (`seconds`), elapsed seconds
    (`wall_seconds`), timings, and of each measure its value, the error that the run states and its
    distance to the best run, in SI units; empty if there is none.

    Parameters
    ----------
    folder : Path
    curves : dict
        Setting -> Costs from coarse to fine.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    names = list(
        dict.fromkeys(name for runs in curves.values() for run in runs for name in run.values)
    )
    table = folder / "cost.csv"
    head = [
        "knob",
        "setting",
        "seconds",
        "wall_seconds",
        "timings",
        *(text for name in names for text in (name, f"error_{name}", f"distance_{name}")),
    ]
    write_rows(
        table,
        [
            head,
            *(
                [
                    knob,
                    run.label,
                    f"{run.seconds:.6g}",
                    f"{run.wall_seconds:.6g}",
                    run.timings,
                    *(
                        repr(float(part[name])) if name in part else ""
                        for name in names
                        for part in (run.values, run.errors, run.distances)
                    ),
                ]
                for knob, runs in curves.items()
                for run in runs
            ),
        ],
    )
    return table


def write_picture(folder: Path, knob: str, runs: list, tolerance: float) -> Path:
    """Write the picture of a cost curve into a folder, and return its path.

    Its name is cost.svg, or cost_KNOB.svg.

    Parameters
    ----------
    folder : Path
    knob : str
        TOLERANCE or a numerical setting.
    runs : list of Cost
    tolerance : float
        That of the scene.
    """
    picture = Path(folder) / ("cost.svg" if knob == TOLERANCE else f"cost_{knob}.svg")
    write_text(picture, pictures.draw_charts([cost_chart(knob, runs, tolerance)], height=HEIGHT))
    return picture


def cost_data(knob: str, runs: list, tolerance: float) -> dict:
    """Return the results of the runs of a cost curve as lists and dicts, in SI units.

    `runs`: label, value of the setting, tolerance, CPU seconds, elapsed seconds, and values, errors
    and distances by measure of each run, with `worst` {`measure`, `error` as in the picture} and
    `meets_tolerance`. `cheapest`: by measure the label of the fastest run within the tolerance.
    `sentence`: the cost of all measures. The last two are None for TOLERANCE, because its runs have
    different tolerances.

    Parameters
    ----------
    knob : str
        TOLERANCE or a numerical setting.
    runs : list of Cost
    tolerance : float
        That of the scene.
    """
    parts = (
        "label",
        "value",
        "tolerance",
        "seconds",
        "wall_seconds",
        "timings",
        "values",
        "errors",
        "distances",
    )
    out = []
    for run in runs:
        worst = find_worst_run_error(run)
        out.append(
            {name: getattr(run, name) for name in parts}
            | {
                "worst": {"measure": worst.name, "error": worst.fraction},
                "meets_tolerance": run.meets_tolerance(),
                "remedies": list(run.remedies),
            }
        )
    alone = knob != TOLERANCE
    return {
        "runs": out,
        "cheapest": find_fastest_settings(runs, tolerance) if alone else None,
        "sentence": describe_fastest_setting(runs, tolerance) if alone else None,
    }


def cost_chart(knob: str, runs: list, tolerance: float) -> dict:
    """Return the chart of the largest error of each run against its CPU time.

    The error is that of the measure that is farthest from the tolerance. A hollow point misses its
    tolerance.

    Parameters
    ----------
    knob : str
        TOLERANCE or a numerical setting.
    runs : list of Cost
    tolerance : float
        That of the scene, drawn as a dashed line.
    """
    names = find_measures_with_error(runs)
    worst = [
        find_worst_run_error(run) if knob == TOLERANCE else find_worst_error(run, names, tolerance)
        for run in runs
    ]
    points = [
        Point(one, measure_error.fraction)
        for one, measure_error in zip(runs, worst, strict=True)
        if measure_error.fraction > ROUND_OFF
    ]
    marks = [
        charts.make_line(
            [one.seconds for one, _ in points], [error for _, error in points], "accent", width=1.0
        )
    ]
    scene_points = [point for point in points if point.run.tolerance == tolerance]
    if knob == TOLERANCE and scene_points:
        first = scene_points[0]
        ring = charts.make_dots(
            [first.run.seconds], [first.error], "warm", "the scene as it is", size=13, hollow=True
        )
        marks.append(ring)
    for text, is_met in (("meets its tolerance", True), ("misses its tolerance", False)):
        same_points = [
            point
            for point in points
            if (point.error <= (point.run.tolerance or tolerance)) == is_met
        ]
        if same_points:
            x = [one.run.seconds for one in same_points]
            y = [one.error for one in same_points]
            marks.append(charts.make_dots(x, y, "accent", text, size=6, hollow=not is_met))
    ends = _axis_range([run.seconds for run in runs], MIN_SECONDS_RATIO)
    limit = f"tolerance of the scene, {tolerance:g}"
    marks.append(
        charts.make_line(ends, [tolerance, tolerance], "soft", limit, dash="dashed", width=1.0)
    )
    x_axis = charts.make_axis("CPU seconds of a run", "", True) | {"range": ends}
    y_axis = charts.make_axis("error of the worst measure", "", True)
    y_axis["range"] = _axis_range([tolerance, *(point.error for point in points)], MIN_ERROR_RATIO)
    title = f"What accuracy costs, by {AXES[knob]}"
    labels = _place_labels(points, x_axis["range"], y_axis["range"])
    return charts.make_chart(title, x_axis, y_axis, marks) | {"labels": labels}


class Point(NamedTuple):
    """Point of a cost curve: a run with the relative error of its least accurate measure."""

    run: Cost
    error: float


def _axis_range(values: list, min_ratio: float) -> list:
    """Return both ends of a logarithmic axis that leaves room for labels around its values."""
    room = max(max(values) / min(values), min_ratio) ** AXIS_MARGIN
    return [min(values) / room, max(values) * room]


def _place_labels(points: list, x_range: list, y_range: list) -> list:
    """Return the labels of points, raised where they would overlap.

    A label stands above its point and lists the settings of all equal runs.
    """
    groups: dict[tuple, list] = {}
    for run, error in points:
        groups.setdefault((run.seconds, error), []).append(run.label)
    decades, width = (float(np.log(high / low)) for low, high in (y_range, x_range))
    out = []
    height = -1.0
    for (seconds, error), texts in sorted(groups.items(), key=lambda group: group[0][1]):
        position = np.log(error / y_range[0]) / decades
        height = max(position, height + LABEL_HEIGHT)
        is_right = np.log(seconds / x_range[0]) >= LABEL_LEFT_FRACTION * width
        out.append(
            {
                "text": "; ".join(texts),
                "x": seconds,
                "y": error,
                "raised": (height - position) * AXES_HEIGHT,
                "side": "left" if is_right else "right",
            }
        )
    return out
