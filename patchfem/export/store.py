"""Files of an answer: `write` puts them into a folder, `read` returns the answer from them.

A folder contains summary.json (verdict, quantities, remarks, origin), the JSON file of the verb with the keys that scripts
read, the arrays as netCDF, a CSV file for each curve, and report.html, which is made from the other files.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from .. import __version__
from ..core import Missing, PatchfemError
from ..disk.atomic_write import write_text
from .answer import RUN_KINDS, Answer, JsonObject, Quantity, Remarks, Variable
from .columns import format_curves
from .netcdf import read_netcdf, write_netcdf

SUMMARY = "summary.json"
SCENE = "scene.resolved.toml"
PAGE = "report.html"
FIELDS = "fields.vtkhdf"
# variable of CPU times; it is in summary.json, so that equal runs write equal netCDF files
CPU_TIMES = "accuracy_seconds"
# types of the entries of summary.json that `read` needs, and of those of a measure
SUMMARY_TYPES = {"title": str, "kind": str, "origin": dict, "measures": dict}
SENTENCE_KEYS = ("verdict", "warnings", "notes")
SUMMARY_TYPES |= dict.fromkeys(SENTENCE_KEYS, list)
NUMBER_TYPES = dict.fromkeys(("value", "error", "low", "high"), float | int | None)
NUMBER_TYPES |= {"unit": str, "floor": float | int}
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
    """Write all files of an answer except its page into an existing folder; OSError or WriteError without success."""
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


def write_json(content: JsonObject, path: Path) -> None:
    """Write an object as strict JSON; ValueError for a number that is not finite."""
    text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False)
    write_text(path, text + "\n")


def make_summary(answer: Answer) -> JsonObject:
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
    """Read an answer from the files in a folder; PatchfemError if it has no complete result or a damaged file."""
    folder = Path(folder)
    summary = read_summary(folder)
    kind = summary["kind"]
    origin = summary["origin"]

    # the details of a run are the other keys of its summary, those of another verb are a file
    known_keys = {"patchfem", *SUMMARY_TYPES}
    details = {key: value for key, value in summary.items() if key not in known_keys}
    try:
        if kind in DETAIL_FILES:
            details = json.loads((folder / DETAIL_FILES[kind]).read_text("utf-8"))
        if (folder / SCENE).is_file():
            origin = origin | {"resolved": (folder / SCENE).read_text("utf-8")}
        path = folder / data_file(kind)
        data = read_netcdf(path)[0] if path.is_file() else {}
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


def read_summary(folder: Path) -> JsonObject:
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

    content = None
    try:
        content = path.read_bytes()
        summary = json.loads(content)
        _check_types(summary, SUMMARY_TYPES)
        if summary["kind"] not in (*RUN_KINDS, *DETAIL_FILES):
            raise ValueError(f"kind {summary['kind']} is unknown")
        for key in SENTENCE_KEYS:
            if not all(isinstance(sentence, str) for sentence in summary[key]):
                raise ValueError(f"{key} has an entry that is not a text")
        for name, entry in summary["measures"].items():
            _check_types(entry, NUMBER_TYPES, f"measures.{name}.")
            Quantity(**entry)
        return summary
    except (OSError, ValueError, TypeError, RecursionError) as error:
        reason = str(error) or type(error).__name__
        # every summary since 2.0 has a verdict
        if content is not None and b'"verdict"' not in content:
            reason = "patchfem before 2.0 wrote it; run the scene again"
        raise PatchfemError(f"{path}: this summary cannot be read: {reason}") from None


def _check_types(content: JsonObject, types: dict[str, type], place: str = "") -> None:
    """Raise ValueError if an object lacks an entry, or has one of another type than the table says.

    place: where the object is in the file, such as "measures.loop_area.", which the message names.
    """
    for key, kind in types.items():
        is_known = isinstance(content, dict) and key in content
        if not is_known or not isinstance(content[key], kind):
            raise ValueError(f"{place}{key} is missing or of a wrong type")
