"""Error of a scene against computing time: lines for the screen, cost.csv and one picture."""

from pathlib import Path

import numpy as np

from ..campaigns.cost import (
    TOLERANCE,
    Cost,
    cheapest,
    sentence,
    stated_names,
    turned_by,
    worst_error,
    worst_of_run,
)
from ..disk.whole import write_rows, write_text
from ..scales import plain
from .drawing.pictures import BLUE, drawing, styled

AXES = {TOLERANCE: "tolerance", "element_size": "element size", "steps_per_cycle": "steps per cycle",
        "shear_modes": "shear modes", "jumps": "jumps over the cycles of wear"}
MAIN = ("worn_depth_max", "relative_displacement_amplitude", "absolute_acceleration_peak", "loop_area",
        "friction_force_peak", "pressure_peak", "contact_fraction", "approach", "rotation", "normal_stiffness",
        "tangential_stiffness")  # measures of the detailed table, as far as a setting changes them
EXACT = 1e-12  # of a value, below which an error is round-off
LABEL_HEIGHT = 0.06  # of the height of the axes, by which labels are apart
HEIGHT = 210.0  # points: about the height of the axes


def lines_of(knob: str, runs: list, tolerance: float) -> list[str]:
    """Format the runs of a curve for the screen: one line per tolerance, or per value of a setting.

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
        names = stated_names(runs)
        rows = [(one, worst_error(one, names, tolerance), "") for one in runs]
        last = [sentence(runs, tolerance)]
    else:
        groups = _by_tolerance(runs)
        rows = [(group[0], worst_of_run(group[0]), _outcome(group)) for group in groups]
        missed = [group[-1] for group in groups if not group[-1].meets_tolerance()][-1:]
        last = [f"tolerance {one.tolerance:g}: {remedy}" for one in missed for remedy in one.remedies]
    width = max(len(knob), *(len(one.label) for one, *_ in rows))
    out = [f"{knob:<{width}}  {'CPU s':>6}  {'error':>8}  worst measure"]
    for one, worst, comment in rows:
        share = plain(worst.share, 2) if worst.share > EXACT else "exact"
        text = f"{one.label:<{width}}  {plain(one.seconds, 2):>6}  {share:>8}  {worst.name}"
        out.append(f"{text.rstrip()}{comment}")
    return [*out, *last]


def _by_tolerance(runs: list) -> list[list]:
    """Group the runs of a curve over tolerances: each tolerance with the settings that were tried for it."""
    out: list[list] = []
    for one in runs:
        if out and out[-1][0].tolerance == one.tolerance:
            out[-1].append(one)
        else:
            out.append([one])
    return out


def _outcome(group: list) -> str:
    """Say whether a tolerance is met, by a run as it is or by the settings that were tried next."""
    first, last = group[0], group[-1]
    if first.meets_tolerance():
        return ""
    of_steps = any("accuracy.steps_per_cycle = " in remedy for remedy in first.remedies)
    missed = f"; not with {first.steps} steps per cycle" if of_steps else "; not reached"
    if last is first:
        return missed
    tried = last.label.partition(", ")[2]
    seconds = f"{tried} ({plain(last.seconds, 2)} CPU s)"
    if last.meets_tolerance():
        return f"{missed}, but with {seconds}"
    worst = worst_of_run(last)
    return f"{missed}, nor with {seconds}: {plain(worst.share, 2)} in {worst.name}"


def details_of(knob: str, runs: list, tolerance: float) -> list[str]:
    """Format a table of several measures: stated error and distance to the best run at every value of a setting."""
    names = shown(runs, tolerance)
    waited, width = any(one.waited() for one in runs), max(len(knob), *(len(one.label) for one in runs))
    head = [f"{knob:<{width}}", f"{'CPU s':>7}", *[f"{'clock s':>7}"] * waited, *(f"{one:>17}" for one in names)]
    out = ["  ".join(head)]
    out.append("  ".join([" " * len(one) for one in head[:2 + waited]] + ["stated (distance)".rjust(max(17, len(one)))
                                                                          for one in names]))
    for one in runs:
        cells = [f"{one.label:<{width}}", f"{one.seconds:7.3f}", *[f"{one.wall_seconds:7.3f}"] * waited]
        out.append("  ".join(cells + [_shares(one, name).rjust(max(17, len(name))) for name in names]))
    return [*out, sentence(runs, tolerance)]


def _shares(one: Cost, name: str) -> str:
    """Format the stated error of a measure and, in brackets, its distance to the best run, relative to the value."""
    size = abs(one.values.get(name, 0.0))
    shares = (part[name] / size if size and name in part else None for part in (one.errors, one.distances))
    stated, away = ("-" if one is None else "exact" if one < EXACT else f"{one:.1e}" for one in shares)
    return f"{stated} ({away})"


def shown(runs: list, tolerance: float) -> list:
    """Return the measures of the detailed table.

    They are those of MAIN that the setting changes and the worst measure of each run; all that it changes if there are
    none of these.
    """
    turned, names = turned_by(runs) or stated_names(runs), stated_names(runs)
    worst = {worst_error(one, names, tolerance).name for one in runs if one.errors or one.distances}
    return [name for name in (*MAIN, *sorted(worst.difference(MAIN))) if name in turned] or turned


def write(folder: Path, curves: dict) -> Path:
    """Write cost.csv into a folder that is made, and return its path; curves: knob -> Costs coarse to fine.

    One row per run: knob, setting, seconds of the processor, wall_seconds by the clock, timings, and of every measure
    its value, the error that the run states and its distance to the best run, in SI units; empty where there is none.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    names = list(dict.fromkeys(name for runs in curves.values() for one in runs for name in one.values))
    table = folder / "cost.csv"
    head = ["knob", "setting", "seconds", "wall_seconds", "timings",
            *(text for name in names for text in (name, f"error_{name}", f"distance_{name}"))]
    write_rows(table, [head, *([knob, one.label, f"{one.seconds:.6g}", f"{one.wall_seconds:.6g}", one.timings,
                                *(repr(float(part[name])) if name in part else "" for name in names
                                  for part in (one.values, one.errors, one.distances))]
                               for knob, runs in curves.items() for one in runs)])
    return table


def write_picture(folder: Path, knob: str, runs: list, tolerance: float) -> Path:
    """Write the picture of a curve, cost.svg or cost_KNOB.svg, into a folder that exists, and return its path."""
    picture = Path(folder) / ("cost.svg" if knob == TOLERANCE else f"cost_{knob}.svg")
    write_text(picture, draw(knob, runs, tolerance))
    return picture


def answer_of(knob: str, runs: list, tolerance: float) -> dict:
    """Return what the runs of a curve come to, in plain lists and dicts; SI.

    `runs` holds each with its label, value of the setting, tolerance, CPU seconds and seconds by the clock, values,
    errors and distances by measure, `worst` {`measure`, `error` as in the picture} and `meets_tolerance`; `cheapest`
    the label of the quickest run within the tolerance by measure, `sentence` what all measures cost; both None for
    TOLERANCE, whose runs have different tolerances.
    """
    parts = ("label", "value", "tolerance", "seconds", "wall_seconds", "timings", "values", "errors", "distances")
    out = []
    for one in runs:
        worst = worst_of_run(one)
        out.append({name: getattr(one, name) for name in parts}
                   | {"worst": {"measure": worst.name, "error": worst.share}, "meets_tolerance": one.meets_tolerance(),
                      "remedies": list(one.remedies)})
    alone = knob != TOLERANCE
    return {"runs": out, "cheapest": cheapest(runs, tolerance) if alone else None,
            "sentence": sentence(runs, tolerance) if alone else None}


@styled
def draw(knob: str, runs: list, tolerance: float):
    """Draw the worst error of each run against its CPU seconds, as SVG text.

    The error is that of the measure that is farthest from the tolerance. A hollow point misses its tolerance.

    Parameters
    ----------
    knob : str
        TOLERANCE or a numerical setting.
    runs : list of Cost
    tolerance : float
        That of the scene, drawn as a broken line.
    """
    figure, (axis,) = drawing(1, 4.2)
    names = stated_names(runs)
    worst = [worst_of_run(one) if knob == TOLERANCE else worst_error(one, names, tolerance) for one in runs]
    points = [(one, found.share) for one, found in zip(runs, worst, strict=True) if found.share > EXACT]
    axis.set(xscale="log", yscale="log", xlabel="CPU seconds of a run", ylabel="error of the worst measure")
    axis.set_title(f"What accuracy costs, by {AXES[knob]}")
    axis.plot([one.seconds for one, _ in points], [share for _, share in points], "-", color=BLUE, linewidth=1)
    for label, face in (("meets its tolerance", BLUE), ("misses its tolerance", "white")):
        alike = [(one.seconds, share) for one, share in points
                 if (share <= (one.tolerance or tolerance)) == (face == BLUE)]
        if alike:
            axis.plot(*zip(*alike, strict=True), "o", color=BLUE, markersize=6, markerfacecolor=face, label=label)
    axis.axhline(tolerance, color="0.4", linestyle="--", linewidth=1, label=f"tolerance of the scene, {tolerance:g}")
    if points:
        _set_limits(axis, [one.seconds for one, _ in points], [tolerance, *(share for _, share in points)])
        _label_points(axis, points)
    figure.legend(loc="outside lower center", ncols=3, fontsize=9)
    return figure


def _set_limits(axis, seconds: list, shares: list) -> None:
    """Leave room for labels around the points, and write the seconds as plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = min(seconds), max(seconds)
    room = max(high / low, 2.0)**0.15
    axis.set_xlim(low / room, high * room)
    low, high = min(shares), max(shares)
    room = max(high / low, 10.0)**0.15
    axis.set_ylim(low / room, high * room)
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 5.0, 7.0)))
    axis.xaxis.set_major_formatter(FuncFormatter(lambda seconds, _: f"{seconds:g}"))
    axis.xaxis.set_minor_formatter(NullFormatter())


def _label_points(axis, points: list) -> None:
    """Write the settings of each point above it, those of equal runs together; labels that would overlap move up.

    points: (Cost, error) of each.
    """
    groups: dict[tuple, list] = {}
    for one, share in points:
        groups.setdefault((one.seconds, share), []).append(one.label)
    decades = float(np.ptp(np.log(axis.get_ylim())))
    start, width = np.log(axis.get_xlim()[0]), float(np.ptp(np.log(axis.get_xlim())))
    height = -1.0
    for (seconds, share), labels in sorted(groups.items(), key=lambda found: found[0][1]):
        place = np.log(share / axis.get_ylim()[0]) / decades
        height = max(place, height + LABEL_HEIGHT)
        right = np.log(seconds) - start < 0.6 * width
        axis.annotate("; ".join(labels), (seconds, share), xytext=(8 if right else -2, 7 + (height - place) * HEIGHT),
                      textcoords="offset points", ha="left" if right else "center", fontsize=9, color="0.2",
                      bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5})
