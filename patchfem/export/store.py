"""Files of an answer: `write_answer` puts them into a folder, `read_answer` returns the answer from them.

A folder contains summary.json (verdict, quantities, remarks, origin), the JSON file of the verb with the keys that scripts
read, the arrays as netCDF, a CSV file for each curve, and report.html, which is made from the other files.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from .. import __version__
from ..core import Missing, PatchfemError
from ..disk.atomic_write import write_text
from .answer import RUN_KINDS, Answer, JsonObject, Quantity, Remarks
from .columns import format_curves
from .netcdf import read_netcdf, write_netcdf
from .rows import make_variables

SUMMARY_FILE = "summary.json"
SCENE_FILE = "scene.resolved.toml"
PAGE_FILE = "report.html"
FIELDS_FILE = "fields.vtkhdf"
# variable of CPU times; it is in summary.json, so that equal runs write equal netCDF files
CPU_TIMES_VARIABLE = "accuracy_seconds"
# netCDF file of each kind of answer; result.nc for all others
DATA_FILES = {"sweep": "sweep.nc", "backbone": "backbone.nc"}
# JSON file with the `details` of each kind of answer; those of a run are in summary.json
DETAIL_FILES = {
    kind: f"{kind}.json"
    for kind in ("sweep", "backbone", "compare", "pairs", "profile", "fit", "cost")
}


class Summary(BaseModel):
    """Content of summary.json, of which each entry has the stated type; the further keys of a run are in `model_extra`."""

    model_config = ConfigDict(extra="allow")

    patchfem: str
    title: str
    kind: Literal[*RUN_KINDS, *DETAIL_FILES]
    verdict: tuple[str, ...]
    measures: dict[str, Quantity]
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    origin: dict[str, Any]


def name_data_file(kind: str) -> str:
    """Return the name of the netCDF file of a kind of answer."""
    return DATA_FILES.get(kind, "result.nc")


def write_answer(answer: Answer, folder: Path) -> None:
    """Write all files of an answer except its page into an existing folder.

    The resolved scene names files relative to this folder, so that it can be run from there.

    OSError or WriteError is raised if this fails.
    """
    source = answer.origin.get("source")
    if source is not None:
        resolved = {"resolved": source.write_resolved(folder)}
        answer = replace(answer, origin=answer.origin | resolved)
    if answer.origin.get("resolved"):
        write_text(folder / SCENE_FILE, answer.origin["resolved"])
    if answer.data:
        data = {
            name: variable for name, variable in answer.data.items() if name != CPU_TIMES_VARIABLE
        }
        write_netcdf(replace(answer, data=data), folder / name_data_file(answer.kind))
    for name, text in format_curves(answer).items():
        write_text(folder / name, text)
    if not answer.is_run:
        write_json(answer.details, folder / DETAIL_FILES[answer.kind])
    write_json(make_summary(answer), folder / SUMMARY_FILE)


def write_json(content: JsonObject, path: Path) -> None:
    """Write an object as strict JSON.

    ValueError is raised for a number that is not finite.
    """
    text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False)
    write_text(path, text + "\n")


def make_summary(answer: Answer) -> JsonObject:
    """Return the contents of summary.json: title, kind, origin, outcome, verdict, measures, notes, warnings and details."""
    details = dict(answer.details) if answer.is_run else {}
    summary = {
        "patchfem": answer.origin.get("patchfem", __version__),
        "title": answer.title,
        "kind": answer.kind,
    }
    if CPU_TIMES_VARIABLE in answer.data:
        details[CPU_TIMES_VARIABLE] = answer.data[CPU_TIMES_VARIABLE].values.tolist()
    if "outcome" in details:
        summary["outcome"] = details.pop("outcome")
    summary |= {
        "verdict": list(answer.verdict),
        "measures": {name: quantity.as_json() for name, quantity in answer.quantities.items()},
        "warnings": list(answer.remarks.warnings),
        "notes": list(answer.remarks.notes),
    }
    # the resolved scene has a file of its own, which is written from the source
    own = ("resolved", "source")
    origin = {key: value for key, value in answer.origin.items() if key not in own}
    return summary | details | {"origin": origin}


def read_answer(folder: Path) -> Answer:
    """Read an answer from the files in a folder.

    PatchfemError is raised if it has no complete result or a damaged file.
    """
    folder = Path(folder)
    summary = read_summary(folder)
    # the details of a run are the other keys of its summary, those of another verb are a file
    details = summary.model_extra
    origin = summary.origin
    try:
        if summary.kind in DETAIL_FILES:
            details = json.loads((folder / DETAIL_FILES[summary.kind]).read_text("utf-8"))
        if (folder / SCENE_FILE).is_file():
            origin = origin | {"resolved": (folder / SCENE_FILE).read_text("utf-8")}
        # Arrays of the answer by name; the CPU times of a run are kept among the details.
        path = folder / name_data_file(summary.kind)
        has_arrays = path.is_file() or summary.kind == "sweep"  # the cases of a sweep are arrays
        data = read_netcdf(path)[0] if has_arrays else {}
        if CPU_TIMES_VARIABLE in details:
            times = np.array(details[CPU_TIMES_VARIABLE], float)
            data |= make_variables("run", **{CPU_TIMES_VARIABLE: times})
    except (OSError, ValueError, KeyError, TypeError, RuntimeError) as error:
        raise PatchfemError(f"{folder}: a file of this folder is damaged: {error}") from None

    return Answer(
        kind=summary.kind,
        title=summary.title,
        verdict=summary.verdict,
        quantities=summary.measures,
        data=data,
        remarks=Remarks(summary.warnings, summary.notes),
        details=details,
        origin=origin,
    )


def read_summary(folder: Path) -> Summary:
    """Read and check the summary.json of a folder.

    Raises
    ------
    PatchfemError
        If there is none, if it is damaged, or if patchfem 1.2 or later did not write it.
    Missing
        If there is no such folder.
    """
    path = Path(folder) / SUMMARY_FILE
    if not path.parent.is_dir():
        raise Missing(f"{folder}: no such results folder")
    if not path.is_file():
        raise PatchfemError(f"{folder}: this is not a results folder: it has no {SUMMARY_FILE}")

    content = b""
    try:
        content = path.read_bytes()
        return Summary.model_validate_json(content)
    except ValidationError as error:
        fault = error.errors()[0]
        reason = f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}".removeprefix(": ")
    except OSError as error:
        reason = str(error)
    # every summary since 1.2 has a verdict
    if content and b'"verdict"' not in content:
        reason = "neither patchfem 1.2 nor a later version wrote it; run the scene again"
    raise PatchfemError(f"{path}: this summary cannot be read: {reason}")
