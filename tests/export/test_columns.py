"""Units and rows of CSV files, and the JSON form of details."""

import csv

import pytest

from patchfem.export import answer, columns

G_N = 9.80665


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


BALANCE = {"amplitude": [1e-6, 2e-6], "force": [3.0, None]}
QUASI_STATIC = {"amplitude": [5e-6]}


def read_curves(**details) -> list[list[str]]:
    """Return key or method, method or amplitude, and the force and the band of each row of backbone.csv."""
    text = columns.format_curves(answer.Answer("backbone", "", (), details=details))["backbone.csv"]
    places = [0, 1, 2] if "key" in details else [0, 1]
    rows = list(csv.reader(text.splitlines()))
    places += [rows[0].index(name) for name in ("force [N]", "damping_low")]
    return [[row[place] for place in places] for row in rows]


def test_exact_csv_of_curves_stands_below_each_other():
    """A CSV of a backbone has the rows of all methods; a column that one of them lacks is empty there."""
    curves = {"balance": BALANCE, "quasi-static": QUASI_STATIC}
    band = {"damping_low": [0.1, 0.2]}
    assert read_curves(curves=curves, method="balance", band=band) == [
        ["method", "amplitude [m]", "force [N]", "damping_low"],
        ["balance", "1e-06", "3.0", "0.1"],
        ["balance", "2e-06", "", "0.2"],
        ["quasi-static", "5e-06", "", ""],
    ]


def test_exact_csv_of_curves_names_the_value_of_a_key():
    """A CSV of backbones for values of a key has a column with this key."""
    cases = [
        {"curves": {"balance": BALANCE}, "method": "balance", "band": {"damping_low": [0.1, 0.2]}},
        {"curves": {"quasi-static": QUASI_STATIC}, "method": "balance", "band": {}},
    ]
    assert read_curves(key="normal.load", values=["1 N", "2 N"], cases=cases) == [
        ["normal.load", "method", "amplitude [m]", "force [N]", "damping_low"],
        ["1 N", "balance", "1e-06", "3.0", "0.1"],
        ["1 N", "balance", "2e-06", "", "0.2"],
        ["2 N", "quasi-static", "5e-06", "", ""],
    ]
