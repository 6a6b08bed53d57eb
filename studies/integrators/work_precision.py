"""How much time does each engine need for how small an error?

The figures of the event engines are of 1.4: exact and in plain Python. The engine of 1.5 moves in steps of order 8.

Largest error of the slide over the last 5 of 60 (block) or 20 cycles, CPU time of one core of an EPYC, least of 3 turns
of everybody (the march later, on a machine where it took twice as long as alone). Where friction is Coulomb's and the
drive a sine, the event engines are exact: compiled for one mode in 0.41 ms (block), for any modes in plain Python in 15
ms; for 1e-6 DOP853 with events takes 330 times as long as the first, CVODE with its root finder 180 times, the march,
which halves the steps with stops and releases, less than 100 times (100 steps a cycle), and Siconos (theta = 1/2) 730
times as long for 1e-4. On the two masses of Fig 16 plain Python takes 7 ms, DOP853 and CVODE for 1e-6 4.8 and 4.7 times
as long, Siconos 25 times for 1e-4. (The event engine of any modes is the truth of both, drawn at 1e-13; that of one
mode agrees to 1e-13, DOP853 at 1e-12 to 3e-12 and 4e-11.)

On a patch that slips part by part (41 parallel elements, two modes) there is no closed form: the march needs 51 ms for
5e-3 and .3 s for 1e-4; CVODE takes 3 times as long for 1e-2 and .7 times for 1e-4, DOP853 1.8 times for 1e-4. The march
is of second order, so that CVODE overtakes it beyond 1e-3; the two agree to 2e-8. Peers must be told a longest step:
with 1/8 of a cycle DOP853 passes over 14 of the 202 reversals of the patch without a word and is 3 % wrong still at a
tolerance of 1e-9; without one it finds 4 of the 240 events of the block.

The report's methods: Duhamel with sgn(v) and a velocity criterion stays above 3 % on the two masses and above .5 % on
the block at any step tried; Newmark with a fixed stick speed never comes below 5 %; Euler with limit tanh(v/1e-3) ends
at 2 % of the block, which is the error of the law. Cured (stop by speed and force, stick speed limit h/m) Newmark is
of second order and, on few modes, the fastest for 1e-2 to 1e-4; a reversal without stick (free decay) leaves it of
first order, where Siconos stays of second.

Run: python studies/integrators/work_precision.py            (the block once, with the peers that are installed)
     python studies/integrators/work_precision.py --full     (all, three turns; writes the table and the picture)
     python studies/integrators/work_precision.py draw       (the picture again from the measured table)
"""

import json
import sys
from pathlib import Path

from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from engine_peers import PEERS
from engine_problems import ALL
from engines import OURS
from measuring import run
from precision_rows import EQUAL, FLOOR, curve, measure, ratios

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
    "hybrid": ("*", "#8b1a1a"),
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
                        label=name,
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
    for text in table["absent"].values():
        print(text)
    for where in dict.fromkeys(r["problem"] for r in table["rows"]):
        reference = {"decay": "newmark, and force"}.get(where, "hybrid")
        print(f"{TITLES[where]}: CPU time over that of '{reference}' at an error of {EQUAL}")
        for name, found in ratios(table["rows"], where, reference).items():
            print(f"  {name:24} " + "  ".join(f"{found[error]:>9}" for error in EQUAL))


def main(names=ALL, ours=OURS, peers=PEERS, repeats: int = 3, path: Path | None = TABLE) -> dict:
    """Measure and print all engines, write a picture if `path` is given, and return {rows, versions, absent}."""
    with threadpool_limits(1):
        rows, versions, absent = measure(names, ours, peers, repeats)
    table = {"rows": rows, "versions": versions, "absent": absent}
    if path is not None:
        path.write_text(json.dumps(table, indent=0) + "\n")
    report(table)
    return table


if __name__ == "__main__":
    if sys.argv[1:] == ["draw"]:
        picture(json.loads(TABLE.read_text()))
        raise SystemExit(0)
    full = "--full" in sys.argv[1:]
    raise SystemExit(
        run(lambda: picture(main()) if full else main(("block",), repeats=1, path=None))
    )
