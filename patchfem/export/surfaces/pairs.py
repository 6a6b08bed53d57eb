"""Answer of a table of pairs before and after wear: each pair, and the means over groups of pairs."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ... import __version__
from ...campaigns import surface_pairs
from ...campaigns.surface_pairs import Group, GroupMeans, TableLine
from ...core import PatchfemError
from ...surface.compare.compare import DEFAULTS, Options
from ..answer import Answer, Remarks, Variable
from . import compare, sentences, worn
from .variables import make_variables

# Basis of the answer for a pair, in words; means are taken only over pairs with the same basis.
KINDS = {
    "scans": "areal scans",
    "run": "results folders",
    "place": "registered traces",
    "flanks": "traces compared by the unworn flanks of a track",
    "nothing": "traces that cannot be registered to each other",
}
CHARTED_QUANTITIES = {
    "worn_depth_mean": "m",
    "amplitude_ratio": "1",
}  # quantities of the charts and their units
MEANS_NOTE = (
    "Means have equal weights; their 95 % interval follows by Student's t from the scatter of the pairs, or from the "
    "intervals of the pairs if it is wider. An error that all pairs share, such as calibration, is not included."
)
SHARED_NOTE = (
    "Some pairs share the surface measured before wear; the intervals of the means do not include its errors, which are "
    "common to these pairs."
)


def answer_pairs(
    table: Path, options: Options = DEFAULTS, report_progress: Callable | None = None
) -> Answer:
    """Compare the two files or results folders of each line of a table.

    Parameters
    ----------
    table : Path
        As `campaigns.surface_pairs.read_pairs` reads it.
    options : Options
        Of all pairs of files; `direction` is that of the lines that state none.
    report_progress : callable, optional
        Receives the fraction of the pairs that are done.

    Returns
    -------
    Answer
        Kind "pairs". A pair that fails has the `outcome` "failed" and a `message`; the others continue.

    Raises
    ------
    Missing
        If the table is not there.
    PatchfemError
        If it is no such table.
    """
    lines = surface_pairs.read_pairs(table)
    rows = []
    for line in lines:
        rows.append(_compare_line(line, options))
        if report_progress is not None:
            report_progress(len(rows) / len(lines))
    return make_answer(rows, Path(table).name)


def _compare_line(line: TableLine, options: Options) -> dict:
    """Return the content of compare.json for the pair of a line, with the cells of the line."""
    cells = {"line": line.line, "before": line.names[0], "after": line.names[1]}
    cells["labels"] = dict(line.labels)
    direction = line.direction or options.direction
    try:
        if any(path.is_dir() for path in line.paths):
            for option, value in (("a direction", line.direction), ("a shift", options.shift)):
                if value not in ("", None):
                    raise PatchfemError(
                        f"{option} can be given only for traces, not for results folders"
                    )
            answer = worn.answer_runs(*line.paths)
        else:
            answer = compare.answer_files(*line.paths, options._replace(direction=direction))
    except Exception as error:  # a defect of one pair must not lose the answers of the others
        reason = str(error)
        if not isinstance(error, PatchfemError):
            reason = f"internal fault, please report it: {type(error).__name__}: {error}"
        return cells | {"direction": direction or None, "outcome": "failed", "message": reason}
    return answer.details | cells | {"outcome": "done", "message": ""}


def make_answer(rows: list[dict], name: str) -> Answer:
    """Return the answer of the compared pairs of a table with this name."""
    groups = surface_pairs.average_pairs(rows)
    verdict = [_count(rows)]
    means = []
    for group, (count, averages) in groups.items():
        entry = {"group": group.label, "direction": group.direction or None, "kind": group.kind}
        for key, mean in averages.items():
            numbers = sentences.to_answer(mean.mean).as_json()
            entry[key] = numbers | {"scatter": mean.scatter, "pairs": mean.count}
        means.append(entry | {"pairs": count})
        if averages:
            verdict.append(_describe_means(group, averages))

    befores = [
        (surface_pairs.find_group(row), row["before"]) for row in rows if row["outcome"] == "done"
    ]
    notes = [SHARED_NOTE] if len(set(befores)) < len(befores) else []
    details = {"patchfem": __version__, "pairs": rows, "means": means, "notes": notes}
    return Answer(
        kind="pairs",
        title=name,
        verdict=tuple(verdict[: sentences.MAX_SENTENCES]),
        quantities=_collect_means(groups),
        data=_make_data(rows),
        remarks=Remarks(notes=(*notes, MEANS_NOTE)),
        details=details,
        origin={"patchfem": __version__},
    )


def _count(rows: list[dict]) -> str:
    """Return the headline: numbers of pairs, of pairs with wear and of failed pairs."""
    failed = sum(row["outcome"] == "failed" for row in rows)
    depths = [row.get("worn_depth_mean", {}) for row in rows]
    n_worn = sum((depth.get("low") or 0.0) > 0 for depth in depths)
    return f"{len(rows)} pairs: {n_worn} worn, {len(rows) - n_worn - failed} not, {failed} failed."


def _describe_means(group: Group, means: dict) -> str:
    """Return the sentence on the first mean of a group."""
    name, mean = next(iter(means.items()))
    along = f"along {group.direction}" if group.direction else ""
    title = ", ".join(part for part in (group.label, KINDS[group.kind], along) if part)
    scatter = sentences.format_rounded(mean.scatter, mean.mean.unit)
    return (
        f"{title[0].upper()}{title[1:]}: {name.replace('_', ' ')} {sentences.format_value(name, mean.mean)}, "
        f"the mean of {mean.count} pairs that scatter by {scatter}."
    )


def _collect_means(groups: dict[Group, GroupMeans]) -> dict:
    """Return the means of all groups; beside other groups, a name ends in the number of its group."""
    values = {}
    for number, (_, means) in enumerate(groups.values(), 1):
        suffix = f"_{number}" if len(groups) > 1 else ""
        values |= {f"{name}{suffix}": sentences.to_answer(m.mean) for name, m in means.items()}
    return values


def _make_data(rows: list[dict]) -> dict[str, Variable]:
    """Return the quantities of the charts with their intervals over the line of each pair."""
    data = make_variables("pair", "1", line=np.array([float(row["line"]) for row in rows]))
    for name, unit in CHARTED_QUANTITIES.items():
        cells = [row.get(name, {}) for row in rows]
        for key, suffix in (("value", ""), ("low", "_low"), ("high", "_high")):
            values = np.array([cell.get(key) for cell in cells], float)
            data |= make_variables("pair", unit, **{name + suffix: values})
    return data
