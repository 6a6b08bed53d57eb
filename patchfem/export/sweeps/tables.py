"""All cases of a sweep in one table: sweep.csv for people, sweep.nc for programs."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import __version__
from ...campaigns.sweeps.case_models import SweepScene
from ...campaigns.sweeps.cases import Cases
from ...core import PatchfemError
from ...disk.atomic_write import write_rows
from ...response import rows
from ...runs.batch.case_results import CaseResults
from ...runs.results.patch_rows import TABLE as STATIC
from ...runs.results.result import describe_measure
from ...scene.keys import types
from ...scene.keys.lookup import find_key
from .. import netcdf
from ..summary import package_versions

CASES_PER_BLOCK = 4000  # number of cases whose strings are in memory at the same time
# Largest number of cases that are tried until one is valid; it provides
# the facts that all cases share.
MAX_CASES_TRIED = 3
MEASURE_ORDER = {name: place for place, name in enumerate((*STATIC, *rows.TABLE))}
FACTS = {
    "tolerance": ("accuracy", "tolerance"),
    "patch_length": ("contact", "length"),
    "patch_width": ("contact", "width"),
    "drive_from": ("drive", "from"),
    "drive_to": ("drive", "to"),
}


class Column(NamedTuple):
    """Column of n numbers of a sweep with its unit, which is "1" for dimensionless numbers."""

    name: str
    values: np.ndarray
    unit: str
    long_name: str


def sort_measures(results: CaseResults) -> list[str]:
    """Return the measures of the cases in the order in which the reference lists them."""
    return sorted(
        results.values,
        key=lambda name: (
            MEASURE_ORDER.get(rows.remove_interface_number(name), len(MEASURE_ORDER)),
            name,
        ),
    )


def measure_columns(results: CaseResults, name: str) -> list[Column]:
    """Return the columns of a measure: its values and their errors."""
    unit = results.units[name]
    return [
        Column(name, results.values[name], unit, describe_measure(name)),
        Column(
            f"{name}_error", results.errors[name], unit, f"estimated numerical half-width of {name}"
        ),
    ]


def column_names(cases: Cases, results: CaseResults, keys: Sequence[str] = ()) -> list[str]:
    """Return the column names of `csv_lines`.

    Parameters
    ----------
    cases : Cases
    results : CaseResults
    keys : sequence of str
        Folders of the cases, if they have any.
    """
    measures = [
        column.name for name in sort_measures(results) for column in measure_columns(results, name)
    ]
    return [
        *(axis.key for axis in cases.axes),
        "outcome",
        *measures,
        "message",
        *(["case"] if keys else []),
    ]


def csv_lines(cases: Cases, results: CaseResults, keys: Sequence[str] = ()) -> Iterator[list[str]]:
    """Yield a line of sweep.csv for each case; a missing value becomes "".

    A line contains the swept keys as written, the outcome, every measure with its error in SI, the
    message of a failed case, and the name of its folder if `keys` are given.

    Parameters
    ----------
    cases : Cases
    results : CaseResults
    keys : sequence of str
        Folders of the cases, if they have any.
    """
    columns = [
        column for name in sort_measures(results) for column in measure_columns(results, name)
    ]
    # The strings of all cases together would fill the memory.
    for first in range(0, len(cases), CASES_PER_BLOCK):
        numbers = range(first, min(first + CASES_PER_BLOCK, len(cases)))
        block = [
            [
                "" if value != value else repr(value)
                for value in column.values[first : numbers.stop].tolist()
            ]
            for column in columns
        ]
        for number, *cells in zip(numbers, *block):
            folder = [keys[number]] if keys else []
            yield [
                *cases.texts(number),
                str(results.outcome[number]),
                *cells,
                results.messages.get(number, ""),
                *folder,
            ]


def write_csv(cases: Cases, results: CaseResults, keys: Sequence[str], path: Path) -> Path:
    """Write sweep.csv.

    Parameters
    ----------
    cases : Cases
    results : CaseResults
    keys : sequence of str
        Folders of the cases, if they have any.
    path : Path
        The file.
    """
    write_rows(path, chain([column_names(cases, results, keys)], csv_lines(cases, results, keys)))
    return path


def table_contents(
    sweep_scene: SweepScene,
    cases: Cases,
    results: CaseResults,
    keys: Sequence[str] = (),
    answer: str = "",
) -> netcdf.Contents:
    """Return the content of sweep.nc in SI.

    There is one dimension per swept key, with dots replaced by underscores, or the single dimension
    `case` if the cases are rows. The variables are measures and their errors, outcome, the messages
    of failed cases and the names of their folders.

    Parameters
    ----------
    sweep_scene : SweepScene
    cases : Cases
    results : CaseResults
    keys : sequence of str
        Folders of the cases.
    answer : str
        Summary of the sweep in a sentence.

    Returns
    -------
    netcdf.Contents
    """
    dims = ("case",) if cases.is_table else tuple(axis.name for axis in cases.axes)
    coordinates = {
        axis.name: (
            "case" if cases.is_table else axis.name,
            _to_array(axis.values),
            _key_attributes(axis),
        )
        for axis in cases.axes
    }
    if cases.is_table:
        coordinates["case"] = (
            "case",
            np.arange(len(cases)),
            {"units": "1", "long_name": "number of the case"},
        )
    columns = []
    for name in sort_measures(results):
        if name in coordinates:  # normal.load is also the name of a measure
            continue
        columns += measure_columns(results, name)
        if np.nan_to_num(results.floors[name]).any():
            text = f"error of {name} that is allowed in addition to the tolerance"
            columns.append(Column(f"{name}_floor", results.floors[name], results.units[name], text))
    data = {
        column.name: (
            dims,
            column.values.reshape(cases.shape),
            {"units": column.unit, "long_name": column.long_name},
        )
        for column in columns
    }
    texts = {"outcome": (results.outcome, "how the case ended")}
    if results.messages:
        messages = [results.messages.get(number, "") for number in range(len(cases))]
        texts["message"] = (messages, "why the case failed")
    if keys:
        texts["folder"] = (keys, "folder of the case inside cases/")
    for name, (values, text) in texts.items():
        data[name] = (dims, np.array(values, object).reshape(cases.shape), {"long_name": text})
    return netcdf.Contents(data, coordinates, _file_attributes(sweep_scene, cases, answer))


def _file_attributes(sweep_scene: SweepScene, cases: Cases, answer: str) -> dict:
    """Return the attributes of sweep.nc: its scene, its command and the versions."""
    return {
        "Conventions": "CF-1.11",
        "title": f"sweep over {', '.join(axis.key for axis in cases.axes)}",
        "source": f"patchfem {__version__}",
        "scene": sweep_scene.text,
        "scene_file": sweep_scene.path.name,
        "sets": json.dumps(list(sweep_scene.sets)),
        "answer": answer,
        "drawn": int(cases.is_random),
        "words": json.dumps(list(cases.request_arguments)),
        **shared_facts(sweep_scene, cases),
        "scene_sha256": hashlib.sha256(sweep_scene.text.encode()).hexdigest(),
        "versions": json.dumps(package_versions()),
    }


def shared_facts(sweep_scene: SweepScene, cases: Cases) -> dict:
    """Return the FACTS that all cases share and that are not swept.

    These are the tolerance, the size of the patch [m] and the ends of the swept frequencies [Hz].
    """
    for number in range(min(len(cases), MAX_CASES_TRIED)):
        try:
            tables = tomllib.loads(sweep_scene.read_scene(cases.assignments(number)).resolved())
            break
        except PatchfemError:  # the case is invalid
            continue
    else:
        return {}
    swept = {axis.key for axis in cases.axes}
    return {
        name: float(str(tables[table][key]).partition(" ")[0])
        for name, (table, key) in FACTS.items()
        if key in tables.get(table, {}) and f"{table}.{key}" not in swept
    }


def _to_array(values: Sequence) -> np.ndarray:
    """Return values as an array of numbers or of strings."""
    return np.asarray(values, float if isinstance(values[0], float) else str)


def _key_attributes(axis) -> dict:
    """Return the netCDF attributes of a key."""
    model, name = find_key(axis.key)
    try:
        text = types.find_meaning(model, name)
    except KeyError:
        text = axis.key
    return {"long_name": text, "key": axis.key} | (
        {"units": cf_unit(axis.unit)} if axis.unit else {}
    )


def cf_unit(unit: str) -> str:
    """Convert a unit of a scene to the notation of result files: "m/s^2" becomes "m s-2"."""
    above, *below = unit.split("/")
    parts = [factor.replace("^", "") for factor in above.split() if factor != "1" or not below]
    for factor in " ".join(below).replace("(", "").replace(")", "").split():
        name, _, power = factor.partition("^")
        parts.append(f"{name}-{power or 1}")
    return " ".join(parts)
