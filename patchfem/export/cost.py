"""Error against time of the knobs of a scene: a table in a file and a picture of each."""

from pathlib import Path

from ..campaigns.cost import cheapest, quickest, sentence, turned_by, worst_of
from ..disk.whole import write_rows, write_text
from .drawing.pictures import drawing, styled

AXES = {"element_size": "element size", "steps_per_cycle": "steps per cycle", "shear_modes": "shear modes",
        "jumps": "jumps over the cycles of wear"}
MAIN = ("worn_depth_max", "relative_displacement_amplitude", "absolute_acceleration_peak", "loop_area",
        "friction_force_peak", "pressure_peak", "contact_fraction", "approach", "rotation", "normal_stiffness",
        "tangential_stiffness")  # the measures that pictures and the screen show, of those that a knob turns
TOUCHING = 0.14  # share of the width within which two labels would touch


def shown(runs: list, tolerance: float) -> list:
    """Names of the measures that a picture and the table of a knob show: those of MAIN that it turns, and each that is
    farthest from the tolerance in a run, by which the sentence judges; where these are none, all that it turns."""
    turned, worst = turned_by(runs), worst_of(runs, tolerance)
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


def write_picture(folder: Path, knob: str, runs: list, tolerance: float, names: list) -> Path:
    """Write cost_KNOB.svg into a folder that exists, and return its path; arguments as `draw`."""
    picture = Path(folder) / f"cost_{knob}.svg"
    write_text(picture, draw(knob, runs, tolerance, names))
    return picture


def answer_of(runs: list, tolerance: float) -> dict:
    """What the runs of a knob come to, in plain lists and dicts; SI.

    runs: Costs coarse to fine; tolerance: of the scene. `runs` holds each with its label, value of the knob, seconds
    of the processor and by the clock, values, errors and distances by measure, `cheapest` the label of the quickest run
    within the tolerance by measure, `sentence` what all measures cost.
    """
    parts = ("label", "value", "seconds", "wall_seconds", "timings", "values", "errors", "distances")
    return {"runs": [{name: getattr(one, name) for name in parts} for one in runs],
            "cheapest": cheapest(runs, tolerance), "sentence": sentence(runs, tolerance)}


@styled
def draw(knob: str, runs: list, tolerance: float, names: list):
    """Relative error of each measure against the CPU seconds of a run, as SVG text.

    Left the errors that the runs state, right their distances to the best run; rings mark the quickest run that has
    all measures within the tolerance. knob: its name; runs: Costs coarse to fine; tolerance: a broken line; names: of
    the measures shown.
    """
    figure, axes = drawing(2, 4.6, sharex=True, sharey=True)
    for axis, part, title in ((axes[0], "errors", "error estimated by the run"),
                              (axes[1], "distances", "difference from the best run")):
        axis.set(xscale="log", yscale="log", xlabel="CPU seconds of a run", title=title)
        for number, name in enumerate(names):
            _line(axis, runs, part, name, f"C{number % 10}")
        _ring(axis, quickest(runs, tolerance), part, names)
        axis.axhline(tolerance, color="0.4", linestyle="--", linewidth=1, label=f"tolerance {tolerance:g}")
        axis.margins(x=0.1)
    groups, (low, high) = _groups(runs), axes[0].get_ylim()
    axes[0].set_ylim(low, high * (high / low)**(0.05 + 0.06 * max(len(group) for group in groups)))
    for axis in axes:
        _name_runs(axis, groups)
    axes[0].set_ylabel("error or difference, divided by the measure")
    stars = "; star: setting that follows from the scene's tolerance" if any(one.value is None for one in runs) else ""
    by = "tolerance of the mesh" if runs[0].words.startswith("element size set by the tolerance") else AXES[knob]
    figure.suptitle(f"What accuracy costs, by {by}{stars}", fontsize=11)
    labelled = [axis.get_legend_handles_labels() for axis in axes]
    handles = {label: handle for found in labelled for handle, label in zip(*found, strict=True)}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=9)
    return figure


def _line(axis, runs: list, part: str, name: str, colour: str) -> None:
    """The errors or distances of a measure, joined in the order of the knob, and a star for what the tolerance
    chose."""
    for alone, mark in ((False, "o-"), (True, "*")):
        points = [point for one in runs if (one.value is None) == alone and (point := _point(one, part, name))]
        if points:
            axis.plot(*zip(*points, strict=True), mark, color=colour, markersize=11 if alone else 4,
                      label=name.replace("_", " ") if not alone else None)


def _point(one, part: str, name: str) -> tuple | None:
    """(CPU seconds, relative error or distance) of a run; None where it has none above 0."""
    size = abs(one.values.get(name, 0.0))
    found = getattr(one, part).get(name, 0.0) / size if size else 0.0
    return (one.seconds, found) if found > 0 else None


def _ring(axis, one, part: str, names: list) -> None:
    """Rings around the points of the quickest run within the tolerance, where there is one."""
    points = [point for name in names if one is not None and (point := _point(one, part, name))]
    if points:
        axis.plot(*zip(*points, strict=True), "o", color="0.25", markersize=11, fillstyle="none", zorder=4,
                  label="cheapest within the tolerance")


def _groups(runs: list) -> list:
    """Runs sorted by their seconds, those together whose labels would touch."""
    ordered = sorted(runs, key=lambda one: one.seconds)
    near, out = (ordered[-1].seconds / ordered[0].seconds)**TOUCHING, [[ordered[0]]]
    for one in ordered[1:]:
        if one.seconds <= near * out[-1][0].seconds:
            out[-1].append(one)
        else:
            out.append([one])
    return out


def _name_runs(axis, groups: list) -> None:
    """The settings at the top above their runs, and ticks of the seconds that do not touch."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for group in groups:
        for one in group:
            axis.axvline(one.seconds, color="0.85", linewidth=0.8, zorder=0)
        text = "\n".join(one.label.removeprefix("tolerance ") for one in group)
        axis.annotate(text, (group[0].seconds, 0.99), xycoords=("data", "axes fraction"), ha="center", va="top",
                      fontsize=8, color="0.3")
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    axis.xaxis.set_major_formatter(FuncFormatter(lambda seconds, _: f"{seconds:g}"))
    axis.xaxis.set_minor_formatter(NullFormatter())
