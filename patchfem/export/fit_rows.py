"""A rig fitted to rows, on disk and on paper: its object, table, picture, fitted scene, and the answer as text."""

import hashlib
import json
import math
from pathlib import Path

import numpy as np

from .. import __version__
from ..campaigns.rows import cells as row_cells
from ..campaigns.rows.asked import READINGS
from ..campaigns.rows.fit import FittedRows
from ..campaigns.rows.nulls import NULLS
from ..core import G_N
from ..disk.whole import write_rows, write_text
from .drawing.pictures import BLUE, GREY, ORANGE, drawing, styled
from .fit import line_of
from .fit_folder import scene_text, value_of
from .summary import write_json

MIL = 25.4e-6
PARTS = ("fitted", "held_out", "left_out")


class Starts:
    """Ends of starts by name, kept in a file on the way; those of another question are forgotten.

    path: of the file; question: texts that the ends depend on; resume: whether those that are there count.
    """

    def __init__(self, path: Path, question, resume: bool):
        self.path = path
        self.key = hashlib.sha256("\n".join([__version__, *map(str, question)]).encode()).hexdigest()
        self.known = {}
        if resume and path.is_file():
            try:
                found = json.loads(path.read_text("utf-8"))
            except (ValueError, RecursionError):
                found = {}
            if isinstance(found, dict) and found.get("question") == self.key:
                self.known = found["ends"]

    def __call__(self, name: str, ends: list | None = None):
        """The ends kept under a name, None where there are none; or keep `ends` under it."""
        if ends is not None:
            self.known[name] = ends
            write_text(self.path, json.dumps({"question": self.key, "ends": self.known}))
        return self.known.get(name)


def answer_of(fitted: FittedRows) -> dict:
    """The object of fit.json, in SI; scores are root mean squares of ln(computed/measured)."""
    found, cells, asked = fitted.fit, fitted.cells, fitted.asked
    nulls = {name: fitted.scored(*fitted.nulls[name][:2]) | {"numbers": fitted.nulls[name][2]} for name in NULLS}
    unknown = [{one.key: x for one, x in zip(asked.wanted, row) if x} for row in found.unknown.tolist()]
    clean = [[x if math.isfinite(x) else None for x in row] for row in found.correlation.tolist()]
    return {"patchfem": __version__, "title": asked.scene.title, "measured": cells.path.name, "quantity": "rows",
            "outcome": str(fitted.outcome), "values": {one.key: value_of(one, found, k)
                                                       for k, one in enumerate(asked.wanted)},
            "scores": fitted.scored(fitted.logs, fitted.left),
            "scores_stable": fitted.scored(fitted.logs, fitted.left, stable=True), "nulls": nulls,
            "nulls_stable": {name: fitted.scored(*fitted.nulls[name][:2], stable=True) for name in NULLS},
            "unstable": fitted.how.unstable, "reading": _reading(fitted), "unknown": unknown, "correlation": clean,
            "readings": int((~fitted.held).sum()), "held": int(fitted.held.sum()), "rms": found.rms,
            "seed": fitted.how.seed, "starts": _starts(fitted.found, asked.wanted), "folds": _folds(fitted),
            "placebos": [{"set": one.text, "scores": {part: score for part, score in fitted.scored(
                one.logs, np.full(one.logs.size, np.nan)).items() if part != "left_out"}} for one in fitted.placebos],
            "rows": _rows(fitted), "evaluations": found.evaluations, "failures": found.failures, "motions": fitted.runs,
            "warnings": fitted.warnings, "seconds": round(fitted.seconds, 6)}


def _reading(fitted: FittedRows) -> dict:
    read = fitted.asked.read
    out = {"reading": "peak" if read is None else read.reading,
           "reading_cutoff": None if read is None else read.reading_cutoff}
    found = {one.key: float(value) for one, value in zip(fitted.asked.wanted, fitted.fit.values)}
    for key in READINGS:
        name = key.partition(".")[2]
        out[name] = found.get(key, 1.0 if read is None else getattr(read, name))
    return out


def _starts(found, wanted) -> list:
    """Where each start began and ended, with its training score."""
    keys, out = [one.key for one in wanted], []
    for begin, end, rms in zip(found.starts.tolist(), found.ends.tolist(), found.rms.tolist()):
        there = math.isfinite(rms)
        out.append({"from": dict(zip(keys, begin)), "to": dict(zip(keys, end)) if there else None,
                    "training": rms if there else None})
    return out


def _folds(fitted: FittedRows) -> list:
    """Every value left out: the training score of its fit, what it says of the readings left out, and its values."""
    return [{"left_out": one.name, "training": one.found.fit.rms,
             "scores": row_cells.scores(fitted.cells, fitted.left, one.readings),
             "values": dict(zip((free.key for free in fitted.asked.wanted), one.found.fit.values.tolist())),
             "starts": [rms if math.isfinite(rms) else None for rms in one.found.rms.tolist()]} for one in fitted.folds]


def _rows(fitted: FittedRows) -> list:
    """Every row as measured and computed, in SI."""
    cells, out = fitted.cells, []
    at = {(int(k), bool(felt)): n for n, (k, felt) in enumerate(zip(cells.row, cells.felt))}
    for k, row in enumerate(cells.rows):
        one = {"frequency": row.frequency, "input": row.input, "flag": row.flag}
        for name, felt in (("acceleration", True), ("displacement", False)):
            n = at.get((k, felt))
            value = None if n is None else float(fitted.computed[0 if felt else 1, cells.condition[n]])
            one[name] = {"measured": getattr(row, name), "computed": value if value is None or math.isfinite(value)
                         else None, "held": None if n is None else bool(fitted.held[n])}
        out.append(one)
    return out


def write_table(path: Path, answer: dict) -> None:
    """Write a CSV of the rows of fit.json in g and mil, with what was computed beside them."""
    head = ["frequency [Hz]", "input [g]", "acceleration [g]", "displacement [mil]", "flag"]
    rows = [[*head, "computed acceleration [g]", "computed displacement [mil]", "held"]]
    for one in answer["rows"]:
        pairs = [(one["acceleration"], G_N), (one["displacement"], MIL)]
        read, computed = ([("" if pair[which] is None else f"{pair[which] / unit:.6g}") for pair, unit in pairs]
                          for which in ("measured", "computed"))
        held = int(any(pair["held"] for pair, _ in pairs))
        rows.append([f"{one['frequency']:.9g}", f"{one['input'] / G_N:.9g}", *read, one["flag"], *computed, held])
    write_rows(path, rows)


@styled
def draw(answer: dict):
    """Draw computed against measured, accelerations and displacements, what was fitted and what was held out."""
    figure, axes = drawing(2, 3.6)
    for axis, name, unit, scale in zip(axes, ("acceleration", "displacement"), ("g", "mil"), (G_N, MIL)):
        points = [(one[name]["measured"] / scale, one[name]["computed"] / scale, one[name]["held"], "U" in one["flag"])
                  for one in answer["rows"] if one[name]["measured"] and one[name]["computed"]]
        for held, colour, text in ((False, BLUE, "fitted"), (True, ORANGE, "held out")):
            for flagged, mark in ((False, "o"), (True, "^")):
                mine = [(x, y) for x, y, out, shaky in points if out == held and shaky == flagged]
                if mine:
                    axis.plot(*zip(*mine), mark, color=colour, ms=4, mew=0, alpha=0.8,
                              label=text + ", unstable in the test" * flagged)
        if points:
            ends = [min(min(p[:2]) for p in points) * 0.9, max(max(p[:2]) for p in points) * 1.1]
            axis.plot(ends, ends, color=GREY, lw=0.8)
            axis.legend(frameon=False)
        axis.set(xlabel=f"measured [{unit}]", ylabel=f"computed [{unit}]", title=name.capitalize())
    return figure


def fit_into(fitted: FittedRows, folder, target: Path) -> dict:
    """Write the results of a fit into an open `results.Folder` and return the object of fit.json.

    Files: fit.json, fit.csv, fit.svg, scene.fitted.toml, which stands for `target`.
    """
    answer, asked = answer_of(fitted), fitted.asked
    write_json(answer, folder / "fit.json")
    text = scene_text(asked.fitted(fitted.fit.values), asked.wanted, fitted.fit, fitted.cells.path, target)
    write_text(folder / "scene.fitted.toml", text)
    write_table(folder / "fit.csv", answer)
    write_text(folder / "fit.svg", draw(answer))
    return answer


def lines_of(answer: dict) -> list:
    """The answer of a fit as lines of text: its values, then the scores of the rig and of the models without
    mechanics."""
    good = [one["training"] for one in answer["starts"] if one["training"] is not None]
    alike = sum(rms <= min(good) * 1.01 for rms in good)
    out = [f"{answer['outcome']}: {answer['readings']} readings of {answer['measured']} fitted, {answer['held']} held "
           f"out; {alike} of {len(answer['starts'])} starts led to within 1 % of the best training score"]
    for key, one in answer["values"].items():
        out.append(line_of(f"{key:<28}", one))
    out.append(f"  {'rms of ln(computed/measured)':<36} {'acceleration':>12} {'displacement':>12} {'all':>8}")
    for part in PARTS:
        if answer["scores"][part] is not None:
            out += [_line(part.replace("_", " "), answer["scores"][part]),
                    *(_line(f"  null {name}", answer["nulls"][name][part]) for name in NULLS)]
            if answer["scores_stable"][part] != answer["scores"][part]:
                out.append(_line("  without rows flagged U", answer["scores_stable"][part]))
    out += [_line(f"without {one['left_out']}: training {one['training']:.3f}", one["scores"])
            for one in answer["folds"]]
    for one in answer["placebos"]:
        out += [_line(f"{one['set']}, {part.replace('_', ' ')}", one["scores"][part])
                for part in ("fitted", "held_out") if one["scores"][part] is not None]
    return out


def _line(name: str, score: dict | None) -> str:
    cells = ["-" if score is None or score[kind] is None else f"{score[kind]:.3f}"
             for kind in ("acceleration", "displacement", "all")]
    return f"  {name:<36} {cells[0]:>12} {cells[1]:>12} {cells[2]:>8}"
