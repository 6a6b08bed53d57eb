"""Answer of a table of pairs of surfaces before and after wear."""

from collections.abc import Callable
from pathlib import Path

from ... import __version__
from ...campaigns import surface_pairs
from ...campaigns.surface_pairs import TableLine
from ...core import PatchfemError
from ...surface.compare.compare import COMPARE_DEFAULTS, Options
from ..answer import Answer, JsonObject, Variables
from ..rows import make_variables
from . import compare, worn

CHARTED_QUANTITIES = ("worn_depth_mean", "amplitude_ratio")  # quantities of the charts


def answer_pairs(
    table: Path, options: Options = COMPARE_DEFAULTS, report_progress: Callable | None = None
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


def _compare_line(line: TableLine, options: Options) -> JsonObject:
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


def make_answer(rows: list[JsonObject], name: str) -> Answer:
    """Return the answer of the compared pairs of a table with this name."""
    return Answer(
        kind="pairs",
        title=name,
        verdict=(_count_pairs(rows),),
        data=_make_data(rows),
        details={"patchfem": __version__, "pairs": rows},
        origin={"patchfem": __version__},
    )


def _count_pairs(rows: list[JsonObject]) -> str:
    """Return the headline: numbers of pairs, of pairs with wear and of failed pairs."""
    failed = sum(row["outcome"] == "failed" for row in rows)
    depths = [row.get("worn_depth_mean", {}) for row in rows]
    n_worn = sum((depth.get("low") or 0.0) > 0 for depth in depths)
    return f"{len(rows)} pairs: {n_worn} worn, {len(rows) - n_worn - failed} not, {failed} failed."


def _make_data(rows: list[JsonObject]) -> Variables:
    """Return the quantities of the charts with their intervals over the line of each pair."""
    columns = {"line": [float(row["line"]) for row in rows]}
    for name in CHARTED_QUANTITIES:
        for key, suffix in (("value", ""), ("low", "_low"), ("high", "_high")):
            columns[name + suffix] = [row.get(name, {}).get(key) for row in rows]
    return make_variables("surface", **columns)
