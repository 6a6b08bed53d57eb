"""How much time does each integrator need for how small an error?

The error is the largest one of the slide over the last 5 of 60 (block) or 20 cycles, relative to its largest value; the
time is CPU time of one core, the least of three runs. For an error of 1e-6 the engine `event_driven`, which moves from
event to event by steps of order 8, takes 5 ms for stick-slip of a block at resonance (Coulomb friction, 240 events); CVODE
of SUNDIALS with its root finder takes 23 times as long, DOP853 of SciPy with events at most 39 times, and the engine
`march` of fixed steps at most 4 times. Siconos (theta = 1/2) takes 110 times as long for 1e-4. On the two masses of Fig 16
CVODE takes 12 times and DOP853 11 times as long for 1e-6, Siconos 67 times for 1e-4. The reference motion of both is that
of `event_driven` with a step tolerance of 1e-12; DOP853 agrees with it to 3e-12 and 7e-11, CVODE to 3e-11 and 3e-10.

A patch that slips part by part (41 parallel elements, two modes) has no closed form; the reference is a march of 204
800 steps a cycle. For 1e-4 `event_driven` takes 42 ms, the march 3.3 times, CVODE 7.7 times and DOP853 16 times as
long; for 1e-6 CVODE takes 20 times and DOP853 120 times as long. At 1e-2 the march is as fast as `event_driven`. CVODE
and DOP853 need a longest step: with 1/8 of a cycle DOP853 misses 14 of the 202 reversals of the patch and is still 3 %
wrong at a tolerance of 1e-9; without one it finds 4 of the 240 events of the block.

The methods of the report, with fixed steps: Duhamel's integral with sgn(v) and a velocity criterion keeps an error above
3 % on the two masses and above .5 % on the block. Newmark's method with a fixed stick speed keeps an error above 5 %. Euler
steps with the limit tanh(v/1e-3) end at 2 % of the block, which is the error of this law. Newmark's method that decides
about sticking by speed and force, with the stick speed limit h/m, is of second order, but of first order where the motion
reverses without sticking (free decay); there Siconos is of second order.

The rows of CVODE and Siconos are those of version 1.10, whose `sundials_child.py` and `siconos_child.py` ran them.

Run: python studies/integrators/work_precision.py            (the block once)
     python studies/integrators/work_precision.py --full     (all, three turns; writes the table and the picture)
     python studies/integrators/work_precision.py --draw     (the picture again from the saved table)
"""

import json
import sys
from pathlib import Path

from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from engine_problems import ALL
from engines import OURS
from precision_rows import EQUAL, FLOOR, curve, measure, ratios
from study_run import Option, run_study

FOLDER = Path(__file__).parent
TABLE = FOLDER / "work_precision.json"
TITLES = {
    "decay": "free decay",
    "block": "stick-slip at resonance",
    "two": "two masses of Fig 16",
    "patch": "patch of 41 elements",
}
SHOWN_PROBLEMS = ("block", "two", "patch")
STYLES = {
    "event_driven": ("*", "#8b1a1a"),
    "march": ("o", BLUE),
    "duhamel, report": ("v", "#b9c7d6"),
    "duhamel, static branch": ("^", "#7fa6cc"),
    "newmark, stick speed": ("<", "#e7c3ae"),
    "newmark, and force": (">", "#e0975f"),
    "euler, tanh": ("x", GREY),
    "DOP853 + events": ("s", "#2f2f2f"),
    "SUNDIALS CVODE": ("D", ORANGE),
    "Siconos, theta 1/2": ("P", "#5b8c3e"),
}


def picture(table: dict, path: Path = FOLDER / "work_precision.svg") -> Path:
    """Plot the error against CPU time, one panel for each problem."""
    rows = table["rows"]
    with drawing(path, (9.6, 4.6), 1, len(SHOWN_PROBLEMS), sharey=True) as (figure, axes):
        names = list(dict.fromkeys(r["engine"] for r in rows))
        for axis, where in zip(axes, SHOWN_PROBLEMS):
            for name in names:
                errors, seconds = curve(rows, where, name)
                mark, colour = STYLES.get(name, ("o", "#9467bd"))
                if len(errors):
                    axis.loglog(
                        1e3 * seconds,
                        errors,
                        mark + "-",
                        color=colour,
                        ms=9 if mark == "*" else 4,
                        lw=1,
                        label=name.replace("_", "-"),
                    )
            axis.set(title=TITLES[where], xlabel="CPU time [ms]", ylim=(FLOOR / 3, 10))
        axes[0].set_ylabel("largest error of the slide, last 5 cycles")
        handles = {
            label: handle
            for axis in axes
            for handle, label in zip(*axis.get_legend_handles_labels())
        }
        figure.legend(
            handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=9
        )
    return path


def report(table: dict) -> None:
    """Print the table, and the times relative to our fastest engine at equal error."""
    for row in table["rows"]:
        if row["error"] is None:
            print(
                f"  {row['problem']:6} {row['engine']:24} {row['knob']:8g}  {row.get('failed', 'not finite')}"
            )
        else:
            print(
                f"  {row['problem']:6} {row['engine']:24} {row['knob']:8g}  error {row['error']:.1e}  "
                f"{1e3 * row['seconds']:9.2f} ms"
            )
    for where in dict.fromkeys(r["problem"] for r in table["rows"]):
        reference = {"decay": "newmark, and force"}.get(where, "event_driven")
        print(f"{TITLES[where]}: CPU time over that of '{reference}' at an error of {EQUAL}")
        for name, found in ratios(table["rows"], where, reference).items():
            print(f"  {name:24} " + "  ".join(f"{found[error]:>9}" for error in EQUAL))


def main(names=ALL, ours=OURS, repeats: int = 3, path: Path | None = TABLE) -> dict:
    """Measure and print all engines, and write the table if `path` is given; return {rows, versions}.

    The rows of other programs are those of the saved table.
    """
    table = json.loads(TABLE.read_text())
    with threadpool_limits(1):
        rows = measure(names, ours, repeats)
    others = [row for row in table["rows"] if row["engine"] not in OURS and row["problem"] in names]
    table["rows"] = rows + others
    if path is not None:
        path.write_text(json.dumps(table, indent=0) + "\n")
    report(table)
    return table


def measure_or_draw(
    *, full: bool = False, draw: bool = False, path: Path = FOLDER / "work_precision.svg"
) -> None:
    """Measure the block once, or everything, or draw the saved table.

    Parameters
    ----------
    full : bool
        Measure all problems in three turns, and draw them.
    draw : bool
        Draw the saved table.
    path : Path
        File of the picture.
    """
    if draw:
        picture(json.loads(TABLE.read_text("utf-8")), path)
    elif full:
        picture(main(path=path.with_name(TABLE.name)), path)
    else:
        main(("block",), repeats=1, path=None)


if __name__ == "__main__":
    run_study(
        measure_or_draw,
        full=Option(False, "all problems, three turns, with table and picture"),
        draw=Option(False, "the picture of the saved table"),
    )
