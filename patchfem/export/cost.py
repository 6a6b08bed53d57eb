"""Error against time of one knob: a table in a file and a picture."""

import csv
from pathlib import Path

from .drawing.pictures import drawing, styled


def write(folder: Path, knob: str, runs: list, tolerance: float, names: list) -> tuple:
    """Write cost.csv and cost.svg into a folder that is made; returns both paths.

    The table has one row per run with seconds, values and errors of `names`.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    table, picture = folder / f"cost_{knob}.csv", folder / f"cost_{knob}.svg"
    with open(table, "w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow([knob, "seconds [s]", *(text for name in names for text in
                                              (f"{name} [{runs[0].units[name]}]", f"error of {name}"))])
        for one in runs:
            rows.writerow([one.label, f"{one.seconds:.6g}", *(text for name in names for text in
                           (repr(one.values.get(name)), repr(one.errors.get(name))))])
    picture.write_text(draw(knob, runs, tolerance, names), encoding="utf-8")
    return table, picture


@styled
def draw(knob: str, runs: list, tolerance: float, names: list):
    """Relative error of each measure against the seconds of a run, as SVG text.

    knob: its name; runs: Costs coarse to fine; tolerance: a broken line; names: of the measures shown.
    """
    figure, (axis,) = drawing(1, 5.0)
    chain, alone = [one for one in runs if one.value is not None], [one for one in runs if one.value is None]
    for number, name in enumerate(names):
        points = [(one.seconds, _relative(one, name)) for one in chain]
        points = [point for point in points if point[1]]
        if not points:
            continue
        colour = f"C{number % 10}"
        axis.loglog(*zip(*points), "o-", color=colour, label=name.replace("_", " "), markersize=4)
        for one in alone:
            if _relative(one, name):
                axis.loglog(one.seconds, _relative(one, name), "*", color=colour, markersize=11)
    for one in chain:
        at = max((_relative(one, name) or 0.0) for name in names)
        if at:
            axis.annotate(one.label, (one.seconds, at), textcoords="offset points", xytext=(3, 5), fontsize=8)
    axis.axhline(tolerance, color="0.4", linestyle="--", linewidth=1)
    axis.annotate(f"tolerance {tolerance:g}", (0.995, tolerance), xycoords=("axes fraction", "data"), ha="right",
                  va="bottom", fontsize=8, color="0.3")
    star = "; star: the mesh that the tolerance chooses" if alone else ""
    axis.set(xlabel="seconds of a run", ylabel="relative error", title=f"What accuracy costs: {knob}{star}")
    axis.legend(fontsize=8)
    return figure


def _relative(one, name: str):
    value, error = one.values.get(name), one.errors.get(name)
    return error / abs(value) if value and error else None
