"""report.html of a sweep: the table for the page, from results in memory or from files."""

from __future__ import annotations

import csv
import json
import os
import re
import shlex
import tomllib
from array import array
from pathlib import Path

import numpy as np

from ... import __version__
from ...campaigns.sweeps.case_models import SweepScene
from ...campaigns.sweeps.cases import Cases
from ...core import PatchfemError
from ...disk.atomic_write import write_text
from ...runs.batch.case_results import CaseResults
from ...runs.results.result import describe_measure
from ..pages import sweep
from ..pages.headline import SweepHeadline
from ..read_results import MAX_NUMBER, require_valid
from ..written import NUMBER_PATTERN
from .tables import FACTS, shared_facts, sort_measures

# Words of the repeat command for a table of cases whose command is unknown.
REPEAT_WORDS = "--cases", "sweep.csv"
# Files that a click on a case opens: its page or, if there is none, its summary.
FULL_PAGE = "report.html"
SHORT_SUMMARY = "summary.json"


def write_page(table: dict, lead: SweepHeadline, folder: Path) -> None:
    """Write the page of all cases into the folder of their tables.

    Parameters
    ----------
    table : dict
        As for `pages.sweep.page_html`.
    lead : SweepHeadline
    folder : Path
    """
    write_text(folder / FULL_PAGE, sweep.page_html(table, lead))


def sweep_table(
    sweep_scene: SweepScene, cases: Cases, results: CaseResults, keys: list, folder: Path
) -> dict:
    """Return the table for `pages.sweep.page_html`, from the results of the cases.

    Parameters
    ----------
    sweep_scene : SweepScene
    cases : Cases
    results : CaseResults
    keys : list of str
        Folders of the cases in cases/; [] if there are none.
    folder : Path
        Folder of the sweep.

    Returns
    -------
    dict
    """
    columns = key_columns(cases)
    measures = {
        name: {
            "unit": results.units[name],
            "means": describe_measure(name),
            "values": results.values[name],
            "errors": results.errors[name],
            "floors": results.floors[name],
        }
        for name in sort_measures(results)
        if name not in [axis.name for axis in cases.axes]
    }
    return {
        **page_titles(
            columns, tomllib.loads(sweep_scene.text).get("title") or sweep_scene.path.stem
        ),
        "version": __version__,
        **_shared_facts(shared_facts(sweep_scene, cases), columns),
        "command": sweep_command(sweep_scene, cases),
        "scene": sweep_scene.text,
        "first": sweep_scene.of,
        "grid": not cases.is_table,
        "drawn": cases.is_random,
        "keys": columns,
        "measures": measures,
        "outcome": [str(outcome) for outcome in results.outcome],
        "messages": results.messages,
        "folders": [case_link(folder, key) for key in keys] if len(keys) else None,
    }


def key_columns(cases: Cases) -> list:
    """Return the swept keys, each with its values in SI and as written in every case."""
    all_cases = np.arange(len(cases))
    indices = [all_cases] * len(cases.axes)
    if not cases.is_table:
        indices = np.unravel_index(all_cases, cases.shape)
    return [
        {
            "name": axis.key,
            "unit": axis.unit or "1",
            "texts": axis.texts if cases.is_table else [axis.texts[k] for k in index],
            "values": axis_numbers(axis.values)[index],
            "log": suits_log_axis(axis.values),
        }
        for axis, index in zip(cases.axes, indices)
    ]


def _shared_facts(facts: dict, columns: list) -> dict:
    """Return tolerance, patch size [m], and the range [Hz] of the swept frequencies of all cases.

    They are those of the scene (`facts`), or swept values (`columns`).
    """
    swept = {column["name"]: column["values"] for column in columns}
    return {
        "tolerance": facts.get("tolerance", swept.get("accuracy.tolerance", np.nan)),
        "ends": tuple(
            facts.get(f"drive_{end}", swept.get(f"drive.{end}", np.nan)) for end in ("from", "to")
        ),
        "patch": {
            name: float(facts[f"patch_{name}"])
            for name in ("length", "width")
            if f"patch_{name}" in facts
        },
    }


def page_titles(columns: list, scene_title: str) -> dict:
    """Return the title of the page, which names the swept keys, and the title of the scene.

    The title of the scene refers to the values before the keys were changed.
    """
    return {
        "title": f"Sweep of {' × '.join(column['name'] for column in columns)}",
        "of": scene_title,
    }


def case_link(folder: Path, key: str) -> str:
    """Return the file that a click on a case opens, relative to the page."""
    return f"cases/{key}/{FULL_PAGE if (folder / 'cases' / key / FULL_PAGE).is_file() else SHORT_SUMMARY}"


def axis_numbers(values) -> np.ndarray:
    """Return positions along an axis: numbers unchanged, words numbered in order of occurrence."""
    if isinstance(values, array) or all(isinstance(value, int | float) for value in values):
        return np.asarray(values, float)
    order = {word: number for number, word in enumerate(dict.fromkeys(values))}
    return np.array([order[value] for value in values], float)


def suits_log_axis(values) -> bool:
    """Return whether a logarithmic axis suits these values.

    It does if none is negative and the largest is at least ten times the smallest positive one. A
    value of 0 cannot be on such an axis; the page describes this case in words. If the second
    positive value is at most twice the first, as in 0, 1, 2, .., 10, the axis is linear.
    """
    if not isinstance(values, array) and not all(
        isinstance(value, int | float) for value in values
    ):
        return False
    all_of = np.unique(np.asarray(values, float))
    above = all_of[all_of > 0]
    if (
        not above.size
        or all_of[0] < 0
        or (all_of[0] == 0 and above.size > 1 and above[1] <= 2 * above[0])
    ):
        return False
    return bool(above[-1] >= 10 * above[0])


def sweep_command(sweep_scene: SweepScene, cases: Cases) -> str:
    """Return the command line that computes the same cases."""
    words = [
        "patchfem",
        "sweep",
        sweep_scene.path.name,
        *(word for assignment in sweep_scene.sets for word in ("--set", assignment)),
        *(("--of", sweep_scene.of) if sweep_scene.of else ()),
    ]
    if cases.is_table:
        return shlex.join([*words, *(cases.request_arguments or REPEAT_WORDS)])
    return shlex.join(
        [
            *words,
            *(
                word
                for axis in cases.axes
                for word in ("--over", f"{axis.key}={','.join(axis.texts)}")
            ),
        ]
    )


def read_table(folder: Path) -> dict:
    """Return the table of a sweep from sweep.csv (values as written) and sweep.nc (numbers).

    PatchfemError if one of the files is missing or cannot be read.
    """
    import h5netcdf

    folder = Path(folder)
    try:
        with open(folder / "sweep.csv", newline="", encoding="utf-8") as file:
            head, *rows = csv.reader(file)
        require_valid(
            rows and "outcome" in head and "message" in head, "sweep.csv contains no case"
        )
        lengths = {number for number, row in enumerate(rows, 2) if len(row) != len(head)}
        require_valid(
            not lengths,
            f"sweep.csv: a row of {len(head)} fields is needed in line {min(lengths, default=0)}",
        )
        with h5netcdf.File(folder / "sweep.nc", "r") as file:
            return _check_table(
                _read_sweep_table(
                    folder,
                    [dict(zip(head, row)) for row in rows],
                    head[: head.index("outcome")],
                    file,
                )
            )
    except FileNotFoundError as fault:
        name = Path(fault.filename).name if fault.filename else "sweep.nc"
        raise PatchfemError(f"{folder}: not the folder of a sweep: it has no {name}") from None
    except Exception as fault:  # a damaged file can raise exceptions of many classes
        reason = " ".join(str(fault).split())[:200]
        raise PatchfemError(
            f"{folder}: the sweep in this folder cannot be read: {reason or type(fault).__name__}"
        ) from None


def _check_table(table: dict) -> dict:
    """Return the table; raise ValueError if a column has a wrong length or impossible numbers."""
    count = len(table["outcome"])
    columns = [(column["name"], column["values"]) for column in table["keys"]]
    columns += [
        (name, column[part])
        for name, column in table["measures"].items()
        for part in ("values", "errors", "floors")
    ]
    for name, values in columns:
        require_valid(
            np.shape(values) == (count,), f"{name} has {np.size(values)} values for {count} cases"
        )
        require_valid(
            np.abs(values[np.isfinite(values)]).max(initial=0.0) < MAX_NUMBER,
            f"{name} contains a number beyond {MAX_NUMBER:g}",
        )
    return table


def _read_floats(file, name: str):
    """Return a variable of sweep.nc as a flat array of floats; raise ValueError for other numbers."""
    values = np.asarray(file[name][...])
    require_valid(values.dtype.kind in "biuf", f"{name} contains values of type {values.dtype}")
    return values.astype(float).ravel()


def _read_sweep_table(folder: Path, rows: list, keys: list, file) -> dict:
    """Return the table for `pages.sweep.page_html` from rows of sweep.csv and from sweep.nc."""
    columns = []
    for key in keys:
        axis_variable = file[re.sub(r"\W", "_", key)]
        texts = [row[key] for row in rows]
        axis_values = np.asarray(axis_variable[...])
        places = {text: place for place, text in enumerate(dict.fromkeys(texts))}
        values = (
            axis_values
            if axis_values.size == len(rows) and "case" in file.dimensions
            else axis_values[[places[t] for t in texts]]
        )
        values = axis_numbers(values.tolist())
        columns.append(
            {
                "name": key,
                "unit": str(axis_variable.attrs.get("units", "1")),
                "texts": texts,
                "values": values,
                "log": suits_log_axis(values.tolist()),
            }
        )
    measures = {
        name: {
            "unit": str(file[name].attrs["units"]),
            "means": str(file[name].attrs["long_name"]),
            "values": _read_floats(file, name),
            "errors": _read_floats(file, f"{name}_error"),
            "floors": _read_floats(file, f"{name}_floor")
            if f"{name}_floor" in file.variables
            else np.zeros(len(rows)),
        }
        for name in file.variables
        if f"{name}_error" in file.variables
    }
    text = str(file.attrs["scene"])
    sets = json.loads(str(file.attrs["sets"]))
    words = json.loads(str(file.attrs.get("words", "[]"))) or REPEAT_WORDS
    overs = (
        words
        if "case" in file.dimensions
        else [
            word
            for column in columns
            for word in ("--over", f"{column['name']}={','.join(dict.fromkeys(column['texts']))}")
        ]
    )
    facts = {name: float(file.attrs[name]) for name in FACTS if name in file.attrs}
    title = tomllib.loads(text).get("title") or folder.resolve().name
    require_valid(
        isinstance(title, str) and all(isinstance(entry, list | tuple) for entry in (sets, words)),
        "sweep.nc: the scene, the --set or the cases stored in this file cannot be read",
    )
    return {
        **page_titles(columns, title),
        **_shared_facts(facts, columns),
        "version": str(file.attrs["source"]).removeprefix("patchfem "),
        "scene": text,
        "command": shlex.join(
            [
                "patchfem",
                "sweep",
                str(file.attrs["scene_file"]),
                *(word for entry in sets for word in ("--set", entry)),
                *overs,
            ]
        ),
        "grid": "case" not in file.dimensions,
        "drawn": bool(file.attrs.get("drawn", 0)),
        "keys": columns,
        "measures": measures,
        "outcome": [row["outcome"] for row in rows],
        "messages": {number: row["message"] for number, row in enumerate(rows) if row["message"]},
        "folders": [case_link(folder, row["case"]) for row in rows]
        if rows and "case" in rows[0]
        else None,
    }


def join_tables(tables: list, names: list) -> dict:
    """Return one table of several sweeps, with a key `sweep` whose values are their names.

    PatchfemError if they do not have the same keys.
    """
    keys = [[one["name"] for one in table["keys"]] for table in tables]
    if any(sorted(one) != sorted(keys[0]) for one in keys):
        raise PatchfemError(
            "sweeps over different keys cannot be compared on one page: "
            + "; ".join(f"{name}: {', '.join(one)}" for name, one in zip(names, keys))
        )
    counts = [len(table["outcome"]) for table in tables]
    columns = [
        {
            "name": "sweep",
            "unit": "1",
            "log": False,
            "values": np.repeat(np.arange(len(tables)), counts) * 1.0,
            "texts": [name for name, count in zip(names, counts) for _ in range(count)],
        }
    ]
    for key in keys[0]:
        keys_of_tables = [
            next(one for one in table["keys"] if one["name"] == key) for table in tables
        ]
        texts = [text for one in keys_of_tables for text in one["texts"]]
        # The numbering of words differs between tables.
        words = not any(map(NUMBER_PATTERN.match, texts))
        columns.append(
            {
                "name": key,
                "unit": keys_of_tables[0]["unit"],
                "log": keys_of_tables[0]["log"],
                "texts": texts,
                "values": axis_numbers(texts)
                if words
                else np.concatenate([one["values"] for one in keys_of_tables]),
            }
        )
    measures = {}
    shift = np.cumsum([0, *counts])
    for name in dict.fromkeys(name for table in tables for name in table["measures"]):
        measures_of_tables = [table["measures"].get(name) for table in tables]
        first = next(one for one in measures_of_tables if one is not None)
        measures[name] = {"unit": first["unit"], "means": first["means"]} | {
            part: np.concatenate(
                [
                    np.full(count, np.nan) if one is None else one.get(part, np.zeros(count))
                    for one, count in zip(measures_of_tables, counts)
                ]
            )
            for part in ("values", "errors", "floors")
        }
    return {
        "title": " and ".join(names),
        "own": False,
        "version": tables[0]["version"],
        "command": "\n".join(table["command"] for table in tables),
        "scene": "\n".join(f"# {name}\n{table['scene']}" for name, table in zip(names, tables)),
        "tolerance": np.concatenate(
            [
                np.broadcast_to(table.get("tolerance", np.nan), count)
                for table, count in zip(tables, counts)
            ]
        ),
        "ends": tuple(
            np.concatenate(
                [
                    np.broadcast_to(table.get("ends", (np.nan, np.nan))[end], count)
                    for table, count in zip(tables, counts)
                ]
            )
            for end in (0, 1)
        ),
        "grid": all(table["grid"] for table in tables),
        "keys": columns,
        "measures": measures,
        "outcome": [one for table in tables for one in table["outcome"]],
        "messages": {
            number + start: message
            for table, start in zip(tables, shift.tolist())
            for number, message in table["messages"].items()
        },
        "folders": [one for table in tables for one in table["folders"]]
        if all(table["folders"] is not None for table in tables)
        else None,
    }


def relink_cases(table: dict, folder: Path, page: Path) -> dict:
    """Return the table with links of its cases that are relative to another page.

    Parameters
    ----------
    table : dict
        As for `pages.sweep.page_html`.
    folder : Path
        Folder of the sweep.
    page : Path
        The page.
    """
    if table["folders"] is None:
        return table
    path_to_folder = os.path.relpath(folder, page.parent)
    return table | {
        "own": path_to_folder == ".",
        "folders": [Path(path_to_folder, case_path).as_posix() for case_path in table["folders"]],
    }
