"""Units and rows of CSV files, and the JSON form of details."""

import csv
import json
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest

from patchfem.export import answer, columns

G_N = 9.80665


class Point(NamedTuple):
    """Point with a number that may be missing."""

    x: float
    y: float


@dataclass
class Record:
    """Record with a point."""

    name: str
    point: Point


def test_exact_csv_of_fit_has_units_of_its_headings():
    """A column whose heading names a unit has its values in this unit, others in SI; missing numbers are empty."""
    arrays = {
        "frequency": ([140.0, 150.0], "Hz"),
        "input": ([2 * G_N, G_N], "m s-2"),
        "computed_displacement": ([25.4e-6, None], "m"),
    }
    data = answer.make_columns("row", arrays) | {"flag": answer.encode("row", ["U", ""])}
    text = columns.format_curves(answer.Answer("fit", "", (), data=data))["fit.csv"]
    lines = list(csv.reader(text.splitlines()))
    assert lines[0] == ["frequency [Hz]", "input [g]", "flag", "computed displacement [mil]"]
    assert [line[2:] for line in lines[1:]] == [["U", "1.0"], ["", ""]]
    assert [float(line[1]) for line in lines[1:]] == pytest.approx([2.0, 1.0], rel=1e-15)


def test_exact_csv_of_methods_repeats_rows_for_each_case():
    """A CSV of backbones for values of a key has a column with this key; what all cases share is repeated."""
    data = {"case": answer.Variable(("case",), np.array(["1 N", "2 N"]), "", "normal.load")}
    data |= answer.make_columns("balance_amplitude", {"balance_amplitude": ([1e-6, 2e-6], "m")})
    forces = np.array([[3.0, np.nan], [5.0, 6.0]])
    data |= answer.make_columns("case balance_amplitude", {"balance_force": (forces, "N")})
    text = columns.format_curves(answer.Answer("backbone", "", (), data=data))["backbone.csv"]
    assert text.splitlines() == [
        "normal.load,method,amplitude [m],force [N]",
        "1 N,balance,1e-06,3.0",
        "1 N,balance,2e-06,",
        "2 N,balance,1e-06,5.0",
        "2 N,balance,2e-06,6.0",
    ]


def test_exact_details_are_plain_json():
    """Records, arrays and numbers that are not finite in the details become objects, lists and null."""
    content = {
        "records": (Record("a", Point(1.0, np.nan)),),
        "array": np.array([[1.0, np.inf], [2.0, 3.0]]),
        "count": np.int64(3),
        "flag": np.array([True, False]),
        "objects": np.array([None, True], object),
    }
    plain = {
        "records": [{"name": "a", "point": {"x": 1.0, "y": None}}],
        "array": [[1.0, None], [2.0, 3.0]],
        "count": 3,
        "flag": [True, False],
        "objects": [None, True],
    }
    assert answer.to_plain(content) == plain
    assert json.loads(json.dumps(answer.Answer("fit", "", (), details=content).details)) == plain
