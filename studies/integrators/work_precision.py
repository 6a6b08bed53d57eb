"""How much time does each engine need for how small an error?

Largest error of the slide over the last 5 of 60 (block) or 20 cycles, CPU time of one core of an EPYC, least of 3 turns
of everybody. Where friction is Coulomb's and the drive a sine, the event engines are exact: compiled for one mode in
0.41 ms (block), for any modes in plain Python in 15 ms; for 1e-6 DOP853 with events takes 330 times as long as the
first, CVODE with its root finder 180 times, the march 370 times, and Siconos (theta = 1/2) 730 times as long for 1e-4.
On the two masses of Fig 16 plain Python takes 7 ms, DOP853 and CVODE for 1e-6 4.8 and 4.7 times as long, Siconos 25
times for 1e-4. (The event engine of any modes is the truth of both, drawn at 1e-13; that of one mode agrees to 1e-13,
DOP853 at 1e-12 to 3e-12 and 4e-11.)

On a patch that slips part by part (41 parallel elements, two modes) there is no closed form: the march needs 8 ms for
5e-3 and 27 ms for 1e-4; CVODE takes 18 times as long for 1e-2 and 8 times for 1e-4, DOP853 20 times for 1e-4. The march
is of second order, so that CVODE overtakes it beyond 1e-7; the two agree to 2e-8. Peers must be told a longest step:
with 1/8 of a cycle DOP853 passes over 14 of the 202 reversals of the patch without a word and is 3 % wrong still at a
tolerance of 1e-9; without one it finds 4 of the 240 events of the block.

The report's methods: Duhamel with sgn(v) and a velocity criterion stays above 3 % on the two masses and above .5 % on
the block at any step tried; Newmark with a fixed stick speed never comes below 5 %; Euler with limit tanh(v/1e-3) ends
at 2 % of the block, which is the error of the law. Cured (stop by speed and force, stick speed limit h/m) Newmark is
of second order and, on few modes, the fastest for 1e-2 to 1e-4; a reversal without stick (free decay) leaves it of
first order, where Siconos stays of second.

Run: python studies/integrators/work_precision.py            (measures, with the peers that are installed)
     python studies/integrators/work_precision.py draw       (the picture again from the measured table)
"""

import json
import sys
from importlib.metadata import version
from pathlib import Path
from time import process_time

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
sys.path.insert(0, str(Path(__file__).parent))
from engines import ALL, OURS, PEERS, problem
from peer import Peer, ratio_text, run, seconds_at

from patchfem.core import Missing, PatchfemError
from patchfem.export.pictures import BLUE, GREY, ORANGE, STYLE

HERE = Path(__file__).parent
TABLE = HERE / "work_precision.json"
TITLES = {"decay": "free decay", "block": "stick-slip at resonance", "two": "two masses of Fig 16",
          "patch": "patch of 41 elements"}
SHOWN = ("block", "two", "patch")
STYLES = {"exact": ("*", BLUE), "exact, one mode": ("*", "#8b1a1a"), "march": ("o", BLUE),
          "duhamel, report": ("v", "#b9c7d6"),
          "duhamel, static branch": ("^", "#7fa6cc"), "newmark, stick speed": ("<", "#e7c3ae"),
          "newmark, and force": (">", "#e0975f"), "euler, tanh": ("x", GREY), "DOP853 + events": ("s", "#2f2f2f"),
          "SUNDIALS CVODE": ("D", ORANGE), "Siconos, theta 1/2": ("P", "#5b8c3e")}
EQUAL = (1e-2, 1e-3, 1e-4, 1e-6)  # errors at which times are compared
FLOOR = 1e-13  # an error of zero is drawn and compared here


def once(work, one, knob) -> tuple:
    """(slide, CPU seconds) of an engine of ours."""
    start = process_time()
    slide = work(one, knob)
    return slide, process_time() - start


def measure(names=ALL, ours=OURS, peers=PEERS, repeats: int = 3) -> tuple:
    """(rows, versions, absent): the least CPU seconds of `repeats` turns of everybody, the error of each."""
    children, versions, absent, found = {}, {"scipy": version("scipy")}, {}, {}
    try:
        for name, (_, _, _, script, variable, remedy) in peers.items():
            try:
                children[name] = Peer(name, script, variable, sys.executable, remedy)
                versions[name] = children[name].version
            except Missing as missing:
                absent[name] = f"skipped: {name} is not installed ({variable}: {remedy})"
                print(missing, file=sys.stderr)
        tasks = [(p, name, knob, work, None) for name, (work, knobs, where) in ours.items() for p in names if p in where
                 for knob in knobs]
        tasks += [(p, name, knob, peers[name][0], child) for name, child in children.items() for p in names
                  if p in peers[name][2] for knob in peers[name][1]]
        for _ in range(repeats):
            for where, name, knob, work, child in tasks:
                _turn(found, where, name, knob, work, child)
    finally:
        for child in children.values():
            child.__exit__()
    return list(found.values()), versions, absent


def _turn(found: dict, where: str, name: str, knob, work, child) -> None:
    one = problem(where)
    try:
        slide, seconds = once(work, one, knob) if child is None else work(child, one, knob)
    except (PatchfemError, RuntimeError) as error:
        found[where, name, knob] = {"problem": where, "engine": name, "knob": knob, "error": None, "seconds": None,
                                    "failed": str(error)}
        return
    error = max(one.error(slide), FLOOR) if np.all(np.isfinite(slide)) else None
    row = found.setdefault((where, name, knob), {"problem": where, "engine": name, "knob": knob, "error": error,
                                                 "seconds": seconds})
    row["seconds"] = min(row["seconds"], seconds) if row["seconds"] is not None else seconds


def curve(rows: list, where: str, name: str) -> tuple:
    """(errors, seconds) of an engine on a problem, in the order of its knob."""
    mine = [r for r in rows if r["problem"] == where and r["engine"] == name and r["error"] is not None]
    return np.array([r["error"] for r in mine]), np.array([r["seconds"] for r in mine])


def front(errors, seconds) -> tuple:
    """The points that no other beats in both, errors falling."""
    keep = [i for i in range(len(errors)) if not np.any((errors < errors[i]) & (seconds <= seconds[i]))]
    keep.sort(key=lambda i: -errors[i])
    return errors[keep], seconds[keep]


def ratios(rows: list, where: str, reference: str) -> dict:
    """{engine: {error: text}}: time over that of `reference` at equal error; "-" where an engine never gets there."""
    base, out = front(*curve(rows, where, reference)), {}
    if not len(base[0]):
        return out
    for name in dict.fromkeys(r["engine"] for r in rows if r["problem"] == where):
        errors, seconds = front(*curve(rows, where, name))
        if name == reference or not len(errors):
            continue
        out[name] = {}
        for error in EQUAL:
            mine, sign = seconds_at(error, *base) if len(base[0]) > 1 else (float(base[1][0]), "")
            if error < errors.min() or (len(base[0]) > 1 and error < base[0].min()):
                out[name][error] = "-"
                continue
            theirs, other = seconds_at(error, errors, seconds)
            out[name][error] = ("< " if other == "<" else "") + ratio_text(theirs, mine, sign if other != "<" else "")
    return out


def picture(table: dict, path: Path = HERE / "work_precision.svg") -> Path:
    """Error against CPU time, one panel per problem."""
    rows = table["rows"]
    with rc_context(STYLE):
        figure = Figure(figsize=(11.5, 4.4))
        FigureCanvasSVG(figure)
        axes = figure.subplots(1, len(SHOWN), sharey=True)
        names = list(dict.fromkeys(r["engine"] for r in rows))
        for axis, where in zip(axes, SHOWN):
            for name in names:
                errors, seconds = curve(rows, where, name)
                mark, colour = STYLES.get(name, ("o", "#9467bd"))
                if len(errors):
                    axis.loglog(1e3 * seconds, errors, mark + "-", color=colour, ms=9 if mark == "*" else 4, lw=1,
                                label=name)
            axis.set(title=TITLES[where], xlabel="CPU time [ms]", ylim=(FLOOR / 3, 10))
        axes[0].set_ylabel("largest error of the slide, last 5 cycles")
        handles = {label: handle for axis in axes for handle, label in zip(*axis.get_legend_handles_labels())}
        figure.legend(handles.values(), handles.keys(), loc="outside right center", fontsize=8)
        figure.savefig(path, metadata={"Date": None})
    return path


def report(table: dict) -> None:
    """Print the table and the times over the fastest engine of ours at equal error."""
    for row in table["rows"]:
        if row["error"] is None:
            print(f"  {row['problem']:6} {row['engine']:24} {row['knob']:8g}  {row.get('failed', 'not finite')}")
        else:
            print(f"  {row['problem']:6} {row['engine']:24} {row['knob']:8g}  error {row['error']:.1e}  "
                  f"{1e3 * row['seconds']:9.2f} ms")
    for text in table["absent"].values():
        print(text)
    for where in dict.fromkeys(r["problem"] for r in table["rows"]):
        reference = {"patch": "march", "decay": "newmark, and force"}.get(where, "exact")
        print(f"{TITLES[where]}: CPU time over that of '{reference}' at an error of {EQUAL}")
        for name, found in ratios(table["rows"], where, reference).items():
            print(f"  {name:24} " + "  ".join(f"{found[error]:>9}" for error in EQUAL))


def main(names=ALL, ours=OURS, peers=PEERS, repeats: int = 3, path: Path = TABLE) -> dict:
    """Measure, save, print; the table {rows, versions, absent}."""
    with threadpool_limits(1):
        rows, versions, absent = measure(names, ours, peers, repeats)
    table = {"rows": rows, "versions": versions, "absent": absent}
    path.write_text(json.dumps(table, indent=0) + "\n")
    report(table)
    return table


if __name__ == "__main__":
    if sys.argv[1:] == ["draw"]:
        picture(json.loads(TABLE.read_text()))
        raise SystemExit(0)
    raise SystemExit(run(lambda: picture(main())))
