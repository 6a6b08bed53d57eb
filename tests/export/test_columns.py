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
    """Record with a point and a measured size."""

    point: Point
    size: answer.Quantity


def test_exact_csv_of_fit_has_units_of_its_headings():
    """A column whose heading names a unit has its values in this unit, others in SI; missing numbers are empty."""
    arrays = {
        "frequency": ([140.0, 150.0], "Hz"),
        "input": ([2 * G_N, G_N], "m s-2"),
        "computed_displacement": ([25.4e-6, None], "m"),
    }
    data = answer.make_columns("row", arrays) | {"flag": answer.encode_texts("row", ["U", ""])}
    text = columns.format_curves(answer.Answer("fit", "", (), data=data))["fit.csv"]
    lines = list(csv.reader(text.splitlines()))
    assert lines[0] == ["frequency [Hz]", "input [g]", "flag", "computed displacement [mil]"]
    assert [line[2:] for line in lines[1:]] == [["U", "1.0"], ["", ""]]
    assert [float(line[1]) for line in lines[1:]] == pytest.approx([2.0, 1.0], rel=1e-15)


def test_exact_details_are_plain_json():
    """Records, quantities, arrays and numbers that are not finite become objects, lists and null at every depth."""
    size = answer.Quantity(np.float64(2.0), "m", np.nan)
    content = {
        "records": (Record(Point(np.float64(1.0), np.nan), size),),
        "array": np.array([[1.0, np.inf], [2.0, 3.0]]),
        "count": np.int64(3),
        "flags": (np.bool_(True), np.array([True, False])),
        "objects": np.array([None, True], object),
    }
    numbers = {"value": 2.0, "unit": "m", "error": None, "low": None, "high": None, "floor": 0.0}
    plain = {
        "records": [{"point": {"x": 1.0, "y": None}, "size": numbers}],
        "array": [[1.0, None], [2.0, 3.0]],
        "count": 3,
        "flags": [True, [True, False]],
        "objects": [None, True],
    }
    details = answer.Answer("fit", "", (), details=content).details
    assert details == plain
    assert json.loads(json.dumps(details, allow_nan=False)) == plain
