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
