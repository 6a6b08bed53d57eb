"""Files of an answer: `write` puts them into a folder, `read` returns the answer from them.

A folder contains summary.json (verdict, quantities, remarks, origin), the JSON file of the verb with the keys that scripts
read, the arrays as netCDF, a CSV file for each curve, and report.html, which is made from the other files.
"""

import csv
import io
import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from .. import __version__
from ..core import Missing, PatchfemError
from ..disk.atomic_write import write_text
from .answer import RUN_KINDS, Answer, Quantity, Remarks, Variable
from .charts.table import CSV_UNITS, CURVES, Entries, Rows, Stack
from .netcdf import read_netcdf, write_netcdf

SUMMARY = "summary.json"
SCENE = "scene.resolved.toml"
PAGE = "report.html"
FIELDS = "fields.vtkhdf"
# variable of CPU times; it is in summary.json, so that equal runs write equal netCDF files
CPU_TIMES = "accuracy_seconds"
# netCDF file of each kind of answer; result.nc for all others
DATA_FILES = {"sweep": "sweep.nc", "backbone": "backbone.nc"}
# JSON file with the `details` of each kind of answer; those of a run are in summary.json
DETAIL_FILES = {
    kind: f"{kind}.json"
    for kind in ("sweep", "backbone", "compare", "pairs", "profile", "fit", "cost")
}


def data_file(kind: str) -> str:
    """Return the name of the netCDF file of a kind of answer."""
    return DATA_FILES.get(kind, "result.nc")


def write(answer: Answer, folder: Path) -> None:
    """Write all files of an answer except its page into an existing folder.

    Parameters
    ----------
    answer : Answer
    folder : Path

    Raises
    ------
    OSError or WriteError
        If a file cannot be written.
    """
    if answer.origin.get("resolved"):
        write_text(folder / SCENE, answer.origin["resolved"])
    if answer.data:
        data = {name: variable for name, variable in answer.data.items() if name != CPU_TIMES}
        write_netcdf(replace(answer, data=data), folder / data_file(answer.kind))
    for name, text in format_curves(answer).items():
        write_text(folder / name, text)
    if not answer.is_run:
        write_json(answer.details, folder / DETAIL_FILES[answer.kind])
    write_json(make_summary(answer), folder / SUMMARY)


def write_json(content: dict, path: Path) -> None:
    """Write an object as strict JSON; ValueError for a number that is not finite."""
    text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False)
    write_text(path, text + "\n")


def make_summary(answer: Answer) -> dict:
    """Return the contents of summary.json, which are those of `run --json` for a run."""
    details = dict(answer.details) if answer.is_run else {}
    summary = {
        "patchfem": answer.origin.get("patchfem", __version__),
        "title": answer.title,
        "kind": answer.kind,
    }
    if CPU_TIMES in answer.data:
        details[CPU_TIMES] = answer.data[CPU_TIMES].values.tolist()
    if "outcome" in details:
        summary["outcome"] = details.pop("outcome")
    summary |= {
        "verdict": list(answer.verdict),
        "measures": {name: quantity.as_json() for name, quantity in answer.quantities.items()},
        "warnings": list(answer.remarks.warnings),
        "notes": list(answer.remarks.notes),
    }
    # the resolved scene has a file of its own
    origin = {key: value for key, value in answer.origin.items() if key != "resolved"}
    return summary | details | {"origin": origin}


def read(folder: Path) -> Answer:
    """Read an answer from the files in a folder.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    Answer

    Raises
    ------
    PatchfemError
        If the folder has no complete result, or if one of its files is damaged.
    """
    folder = Path(folder)
    summary = read_summary(folder)
    kind = summary["kind"]
    origin = summary["origin"]
    known_keys = {"patchfem", "title", "kind", "verdict", "measures", "warnings", "notes", "origin"}
    details = {key: value for key, value in summary.items() if key not in known_keys}
    try:
        if kind in DETAIL_FILES:
            details = json.loads((folder / DETAIL_FILES[kind]).read_text("utf-8"))
        if (folder / SCENE).is_file():
            origin = origin | {"resolved": (folder / SCENE).read_text("utf-8")}
        path = folder / data_file(kind)
        data = read_netcdf(path) if path.is_file() else {}
        if CPU_TIMES in details:
            times = np.array(details[CPU_TIMES], float)
            data[CPU_TIMES] = Variable(("accuracy_run",), times, "s", "CPU time of the motion")
    except (OSError, ValueError, KeyError, TypeError, RuntimeError) as error:
        raise PatchfemError(f"{folder}: a file of this folder is damaged: {error}") from None
    return Answer(
        kind=kind,
        title=summary["title"],
        verdict=tuple(summary["verdict"]),
        quantities={name: Quantity(**entry) for name, entry in summary["measures"].items()},
        data=data,
        remarks=Remarks(tuple(summary["warnings"]), tuple(summary["notes"])),
        details=details,
        origin=origin,
    )


def read_summary(folder: Path) -> dict:
    """Read and check the summary.json of a folder.

    Raises
    ------
    PatchfemError
        If there is none, if it is damaged, or if a version before 2.0 wrote it.
    Missing
        If there is no such folder.
    """
    path = Path(folder) / SUMMARY
    if not path.parent.is_dir():
        raise Missing(f"{folder}: no such results folder")
    if not path.is_file():
        raise PatchfemError(f"{folder}: this is not a results folder: it has no {SUMMARY}")
    try:
        text = path.read_text("utf-8")
        _summary_model().model_validate_json(text)
        return json.loads(text)
    except (OSError, ValueError, RecursionError) as error:
        reason = _first_mistake(error)
        if '"verdict"' not in path.read_text("utf-8", errors="replace"):
            reason = "patchfem before 2.0 wrote it; run the scene again"
        raise PatchfemError(f"{path}: this summary cannot be read: {reason}") from None


def _first_mistake(error: Exception) -> str:
    """Return the first mistake that pydantic reports, or the text of another error."""
    if not hasattr(error, "errors"):
        return str(error) or type(error).__name__
    mistake = error.errors(include_url=False)[0]
    place = ".".join(map(str, mistake["loc"]))
    return f"{place}: {mistake['msg']}" if place else mistake["msg"]


@cache
def _summary_model() -> type:
    """Return the pydantic model of the entries of summary.json that `read` needs."""
    from typing import Literal

    from pydantic import BaseModel, ConfigDict

    class Number(BaseModel):
        """Entry of a measure."""

        model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
        value: float | None
        unit: str
        error: float | None
        low: float | None
        high: float | None
        floor: float
        reason: str = ""

    class Summary(BaseModel):
        """Entries of all kinds of answers."""

        model_config = ConfigDict(strict=True)
        title: str
        kind: Literal[(*RUN_KINDS, *DETAIL_FILES)]
        verdict: list[str]
        measures: dict[str, Number]
        warnings: list[str]
        notes: list[str]
        origin: dict

    return Summary


def format_curves(answer: Answer) -> dict[str, str]:
    """Return the CSV files of the curves of an answer: name -> text.

    A column is headed by its name and its unit in brackets, in SI units if the table names no other unit. A missing number
    is an empty cell.
    """
    files = {}
    for name, columns in CURVES.get(answer.kind, {}).items():
        if isinstance(columns, Entries):
            lists = _tabulate(answer.details[columns.source], columns)
        else:
            lists = _list_columns(answer.data, columns)
        if lists:
            output = io.StringIO()
            writer = csv.writer(output, lineterminator="\n")
            writer.writerow(lists)
            writer.writerows(zip(*lists.values(), strict=True))
            files[name] = output.getvalue()
    return files


def _list_columns(data: dict[str, Variable], columns: dict | Stack | Rows) -> dict[str, list]:
    """Return the columns of a CSV file: heading with unit -> cells."""
    if isinstance(columns, Stack):
        return _stack_columns(data, columns)
    if isinstance(columns, Rows):
        return {
            _head(name, variable) if columns.has_units else name: _list_cells(variable)
            for name, variable in data.items()
            if variable.dims == (columns.dimension,)
        }
    lists = {}
    for title, source in columns.items():
        if source not in data:
            continue
        variable = data[source]
        named_unit = title.partition("[")[2].rstrip("]")
        if named_unit:
            scaled = variable.values * CSV_UNITS[named_unit]
            lists[title] = _list_cells(Variable(variable.dims, scaled))
        else:
            lists[_head(title, variable)] = _list_cells(variable)
    return lists if len(lists) > 1 else {}


def _tabulate(rows: list[dict], columns: Entries) -> dict[str, list]:
    """Return the columns of a list of objects: texts, and the value and the interval of each quantity."""
    lists = {}
    for name in columns.texts:
        if name == "labels":
            labels = dict.fromkeys(label for row in rows for label in row["labels"])
            lists |= {label: [row["labels"].get(label, "") for row in rows] for label in labels}
        else:
            lists[name] = [row.get(name) or "" for row in rows]

    cells = [row[columns.nested] if columns.nested else row for row in rows]
    units = {
        name: cell["unit"]
        for row in cells
        for name, cell in row.items()
        if isinstance(cell, dict) and "value" in cell
    }
    for name, unit in units.items():
        for key, suffix in (("value", ""), ("low", "_low"), ("high", "_high")):
            numbers = [row.get(name, {}).get(key) for row in cells]
            head = f"{name}{suffix}" if unit == "1" else f"{name}{suffix} [{unit}]"
            lists[head] = ["" if number is None else number for number in numbers]
    return lists


def _stack_columns(data: dict[str, Variable], stack: Stack) -> dict[str, list]:
    """Return columns with the values of several groups of variables below each other."""
    prefixes = {group: group.replace("-", "_") + "_" for group in stack.groups}
    prefixes = {
        group: prefix for group, prefix in prefixes.items() if prefix + stack.names[0] in data
    }
    known = {}
    for name in stack.names:
        variables = [data[prefix + name] for prefix in prefixes.values() if prefix + name in data]
        known |= {name: _head(name, variables[0])} if variables else {}

    lists: dict[str, list] = {}
    for group, prefix in prefixes.items():
        abscissa = data[prefix + stack.names[0]]
        cases = data["case"].values.size if "case" in data else 1
        count = cases * abscissa.values.size
        if "case" in data:
            repeated = np.repeat(data["case"].values, abscissa.values.size).tolist()
            lists.setdefault(data["case"].text, []).extend(repeated)
        lists.setdefault(stack.heading, []).extend(count * [group])
        for name, heading in known.items():
            cells = count * [""]
            if prefix + name in data:
                # a variable without the dimension of the cases is the same in all of them
                values = data[prefix + name].values
                values = np.broadcast_to(values, (cases, *abscissa.values.shape)).ravel()
                cells = _list_cells(Variable(("row",), values))
            lists.setdefault(heading, []).extend(cells)
    return lists


def _head(title: str, variable: Variable) -> str:
    """Return the heading of a column: its name and its unit in brackets."""
    return f"{title} [{variable.unit}]" if variable.unit not in ("", "1") else title


def _list_cells(variable: Variable) -> list:
    """Return the cells of a column; "" for a missing number."""
    cells = np.asarray(variable.values).tolist()
    if variable.meanings:
        return [variable.meanings[code] for code in cells]
    return ["" if cell != cell else cell for cell in cells]  # only NaN differs from itself
