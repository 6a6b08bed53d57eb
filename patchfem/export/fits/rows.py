"""Files of a fit to rows of measured responses, and the checkpoint of an interrupted fit."""

import hashlib
import json
import math
from pathlib import Path

import numpy as np

from ... import __version__
from ...campaigns.rows.cells import compute_rms_scores
from ...campaigns.rows.condition_models import GAIN_KEYS
from ...campaigns.rows.fit import SAME_SCORE, FittedRows
from ...campaigns.rows.null_models import NULL_MODELS
from ...core import G_N
from ...disk.atomic_write import write_text
from ..drawing import charts
from .files import (
    FITTED_SCENE,
    FitFiles,
    describe_correlation,
    describe_measurement,
    describe_unknown,
    describe_values,
    fitted_scene_text,
)
from .text import format_values

MIL = 25.4e-6  # thousandth of an inch, the unit of displacement readings [m]
SCORED_GROUPS = ("fitted", "held_out", "left_out")
# Number of characters of the longest key of a rig, to which the printed values are aligned.
KEY_WIDTH = 28
# Factor by which the line of equal values extends beyond the smallest and the largest value.
AXIS_MARGIN = 1.1


class SearchCheckpoint:
    """Results of finished searches, stored in a file so that a fit can be resumed.

    Results that were stored for other inputs are ignored.

    Parameters
    ----------
    path : Path
    question : iterable
        Inputs of the fit on which the results depend.
    resume : bool
        Whether results in the file are used.
    """

    def __init__(self, path: Path, question, resume: bool):
        self.path = path
        text = "\n".join([__version__, *map(str, question)])
        self.key = hashlib.sha256(text.encode()).hexdigest()
        self.known = {}
        if resume and path.is_file():
            try:
                content = json.loads(path.read_text("utf-8"))
            except (ValueError, RecursionError):
                content = {}
            if isinstance(content, dict) and content.get("question") == self.key:
                self.known = content["ends"]

    def __call__(self, name: str, ends: list | None = None):
        """Return the stored result of a search, after storing a new one if it is given."""
        if ends is not None:
            self.known[name] = ends
            write_text(self.path, json.dumps({"question": self.key, "ends": self.known}))
        return self.known.get(name)


def describe_rows_fit(fit: FittedRows, folder: Path) -> FitFiles:
    """Return the output files of a fit to a table of measured responses.

    The paths in the fitted scene are relative to `folder`.
    """
    fit_data = rows_fit_data(fit)
    lines = _format_fit_data(fit_data)
    scene = fitted_scene_text(fit.keys, fit.cells.path.name, folder)
    return FitFiles(
        answer=fit_data,
        lines=lines,
        summary=lines[:1],
        scenes={FITTED_SCENE: scene},
        rows=_csv_rows(fit_data),
        charts=_draw_charts(fit_data),
        caption="Computed against measured readings; the line is where both are equal",
    )


def rows_fit_data(fit: FittedRows) -> dict:
    """Return the contents of fit.json for a fit to a table of measured responses.

    Scores are root mean squares of ln(computed/measured).
    """
    keys = fit.keys
    cells = fit.cells
    best_fit = keys.fit
    nulls = {}
    nulls_stable = {}
    for name in NULL_MODELS:
        null = fit.nulls[name]
        nulls[name] = fit.compute_scores(null.logs, null.left_out_logs) | {"numbers": null.numbers}
        nulls_stable[name] = fit.compute_scores(null.logs, null.left_out_logs, only_stable=True)
    return describe_measurement(keys.scene.title, cells.path.name, "rows", keys.outcome) | {
        "values": describe_values(keys),
        "scores": fit.compute_scores(fit.logs, fit.left_out_logs),
        "scores_stable": fit.compute_scores(fit.logs, fit.left_out_logs, only_stable=True),
        "nulls": nulls,
        "nulls_stable": nulls_stable,
        "unstable": fit.settings.unstable,
        "reading": _instrument_settings(fit),
        "unknown": describe_unknown(keys.ranges, best_fit),
        "correlation": describe_correlation(best_fit),
        "readings": int((~fit.held_out).sum()),
        "held": int(fit.held_out.sum()),
        "rms": best_fit.rms,
        "seed": fit.settings.seed,
        "starts": _search_starts(fit),
        "folds": _fold_scores(fit),
        "placebos": _placebo_scores(fit),
        "rows": _row_entries(fit),
        "evaluations": best_fit.counts.evaluations,
        "failures": best_fit.counts.failures,
        "motions": fit.n_motions,
        "warnings": keys.warnings,
        "seconds": round(keys.seconds, 6),
    }


def _instrument_settings(fit: FittedRows) -> dict:
    """Return the settings and gains of the sensors that measure the motion of a rig."""
    read = fit.models.instrument
    out = {
        "reading": "peak" if read is None else read.reading,
        "reading_cutoff": None if read is None else read.reading_cutoff,
    }
    keys = fit.keys
    values = {bound.key: float(value) for bound, value in zip(keys.ranges, keys.fit.values)}
    for key in GAIN_KEYS:
        name = key.partition(".")[2]
        out[name] = values.get(key, 1.0 if read is None else getattr(read, name))
    return out


def _search_starts(fit: FittedRows) -> list:
    """Return for each search its initial values, its final values and its score on the training data."""
    names = [bound.key for bound in fit.keys.ranges]
    search = fit.search
    out = []
    for first_values, end, rms in zip(
        search.starts.tolist(), search.ends.tolist(), search.rms.tolist()
    ):
        settled = math.isfinite(rms)
        out.append(
            {
                "from": dict(zip(names, first_values)),
                "to": dict(zip(names, end)) if settled else None,
                "training": rms if settled else None,
            }
        )
    return out


def _fold_scores(fit: FittedRows) -> list:
    """Return the cross-validation fits with their scores on the left-out readings."""
    names = [bound.key for bound in fit.keys.ranges]
    return [
        {
            "left_out": fold.name,
            "training": fold.search.fit.rms,
            "scores": compute_rms_scores(fit.cells, fit.left_out_logs, fold.readings),
            "values": dict(zip(names, fold.search.fit.values.tolist())),
            "starts": [rms if math.isfinite(rms) else None for rms in fold.search.rms.tolist()],
        }
        for fold in fit.folds
    ]


def _placebo_scores(fit: FittedRows) -> list:
    """Return the scores of fits that are repeated with another value of a fixed key.

    Placebos leave out no readings, so they have no score "left_out".
    """
    out = []
    for placebo in fit.placebos:
        score = fit.compute_scores(placebo.logs, np.full(placebo.logs.size, np.nan))
        score.pop("left_out")
        out.append({"set": placebo.text, "scores": score})
    return out


def _row_entries(fit: FittedRows) -> list:
    """Return measured and computed readings of each condition in SI units."""
    cells = fit.cells
    keys = zip(cells.row.tolist(), map(bool, cells.is_acceleration))
    number = {key: n for n, key in enumerate(keys)}
    out = []
    for k, row in enumerate(cells.rows):
        entry = {"frequency": row.frequency, "input": row.input, "flag": row.flag}
        for part, (name, is_felt) in enumerate((("acceleration", True), ("displacement", False))):
            n = number.get((k, is_felt))
            value = None
            if n is not None:
                value = float(fit.computed[part, cells.condition[n]])
            entry[name] = {
                "measured": getattr(row, name),
                "computed": value if value is None or math.isfinite(value) else None,
                "held": None if n is None else bool(fit.held_out[n]),
            }
        out.append(entry)
    return out


def _csv_rows(fit_data: dict) -> list:
    """Return the rows of fit.csv: measured and computed readings in g and mil."""
    rows: list = [
        [
            "frequency [Hz]",
            "input [g]",
            "acceleration [g]",
            "displacement [mil]",
            "flag",
            "computed acceleration [g]",
            "computed displacement [mil]",
            "held",
        ]
    ]
    for row in fit_data["rows"]:
        pairs = ((row["acceleration"], G_N), (row["displacement"], MIL))
        measured = [_format_cell(reading["measured"], unit) for reading, unit in pairs]
        computed = [_format_cell(reading["computed"], unit) for reading, unit in pairs]
        is_held_out = int(any(reading["held"] for reading, _ in pairs))
        drive = [f"{row['frequency']:.9g}", f"{row['input'] / G_N:.9g}"]
        rows.append([*drive, *measured, row["flag"], *computed, is_held_out])
    return rows


def _format_cell(value: float | None, unit: float) -> str:
    """Format a reading [SI] in the unit of its column, or return "" if the reading is missing."""
    return "" if value is None else f"{value / unit:.6g}"


def _draw_charts(fit_data: dict) -> list:
    """Draw computed against measured accelerations and displacements."""
    return [
        _draw_chart(fit_data, "acceleration", "g", G_N),
        _draw_chart(fit_data, "displacement", "mil", MIL),
    ]


def _draw_chart(fit_data: dict, name: str, unit: str, scale: float) -> dict:
    """Draw computed against measured readings of one quantity, for fitted and for left-out readings."""
    groups: dict = {}
    for row in fit_data["rows"]:
        reading = row[name]
        if reading["measured"] and reading["computed"]:
            group = groups.setdefault((bool(reading["held"]), "U" in row["flag"]), [])
            group.append((reading["measured"] / scale, reading["computed"] / scale))
    marks = []
    for is_held_out, unstable in sorted(groups):
        x, y = zip(*groups[is_held_out, unstable])
        text = "held out" if is_held_out else "fitted"
        if unstable:
            text += ", unstable in the test"
        shape = "triangle" if unstable else "circle"
        marks.append(
            charts.make_dots(x, y, "warm" if is_held_out else "accent", text, size=4, shape=shape)
        )
    if groups:
        numbers = np.concatenate([np.ravel(points) for points in groups.values()])
        ends = [numbers.min() / AXIS_MARGIN, numbers.max() * AXIS_MARGIN]
        marks.append(charts.make_line(ends, ends, "soft", width=0.8))
    return charts.make_chart(
        name.capitalize(),
        charts.make_axis("measured", unit),
        charts.make_axis("computed", unit),
        marks,
    )


def _format_fit_data(fit_data: dict) -> list:
    """Return fitted values and scores of all model variants as lines of text."""
    finished_scores = [one["training"] for one in fit_data["starts"] if one["training"] is not None]
    n_best = sum(rms <= min(finished_scores) * SAME_SCORE for rms in finished_scores)
    out = [
        f"{fit_data['outcome']}: {fit_data['readings']} readings of {fit_data['measured']} fitted, "
        f"{fit_data['held']} held out; {n_best} of {len(fit_data['starts'])} starts led to within 1 % of "
        "the best training score"
    ]
    out += format_values(fit_data, KEY_WIDTH)
    heading = "rms of ln(computed/measured)"
    out.append(f"  {heading:<36} {'acceleration':>12} {'displacement':>12} {'all':>8}")
    for part in SCORED_GROUPS:
        score = fit_data["scores"][part]
        if score is not None:
            out.append(_score_line(part.replace("_", " "), score))
            out += [
                _score_line(f"  null {name}", fit_data["nulls"][name][part]) for name in NULL_MODELS
            ]
            stable = fit_data["scores_stable"][part]
            if stable != score:
                out.append(_score_line("  without rows flagged U", stable))
    for fold in fit_data["folds"]:
        name = f"without {fold['left_out']}: training {fold['training']:.3f}"
        out.append(_score_line(name, fold["scores"]))
    for placebo in fit_data["placebos"]:
        for part, score in placebo["scores"].items():
            if score is not None:
                out.append(_score_line(f"{placebo['set']}, {part.replace('_', ' ')}", score))
    return out


def _score_line(name: str, score: dict | None) -> str:
    """Format the scores of a model variant as a table row."""
    cells = []
    for kind in ("acceleration", "displacement", "all"):
        value = None if score is None else score[kind]
        cells.append("-" if value is None else f"{value:.3f}")
    return f"  {name:<36} {cells[0]:>12} {cells[1]:>12} {cells[2]:>8}"
