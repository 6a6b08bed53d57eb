"""Rows of measured responses as readings: conditions, repeats, flags and scores."""

import numpy as np
import pytest

from patchfem.campaigns.held_out import group_by_column, select_held_out
from patchfem.campaigns.rows.cells import MAX_LOG_RATIO, read_response_table
from patchfem.core import G_N, PatchfemError

HEAD = "frequency [Hz],input [g],acceleration [g],displacement [mil],flag\n"
MIL = 25.4e-6


def write_table(tmp_path, *rows):
    """Write rows as a table and return its path."""
    path = tmp_path / "rows.csv"
    path.write_text(HEAD + "\n".join(rows) + "\n", "utf-8")
    return path


def select_rows(cells, text):
    """Return the mask of the readings that a text of --hold selects."""
    return select_held_out(text, cells.path, cells.columns)


def test_exact_conditions_that_differ_by_round_off_are_one(tmp_path):
    """Frequencies that differ by 1e-13 are one condition, and a selector finds both; those that differ by 1e-8 are two.

    Once two such frequencies were two conditions if their logarithms lay on both sides of a limit of rounding.
    """
    low, high, other = np.exp(4.960000005 + np.array([-5e-14, 5e-14, 1e-8])).tolist()
    rows = [f"{frequency!r},4,5.0,0.1," for frequency in (high, low, other)]
    cells = read_response_table(write_table(tmp_path, *rows))
    assert cells.conditions[:, 0].tolist() == [high, other]
    assert cells.condition.tolist() == [0, 0, 0, 0, 1, 1]
    assert select_rows(cells, f"frequency={low!r} Hz").tolist() == [True] * 4 + [False] * 2


def test_exact_repeated_conditions_are_separate_readings(tmp_path):
    """Repeated rows of a condition are separate readings, with the log ratios of computed to measured values."""
    cells = read_response_table(
        write_table(tmp_path, "143,4,5.0,0.1,", "143,4,4.0,,R*", "150,4,,,U", "143,5,6,,")
    )
    assert cells.condition.tolist() == [0, 0, 0, 1] and cells.row.tolist() == [0, 0, 1, 3]
    assert cells.conditions.tolist() == [[143.0, 4 * G_N], [143.0, 5 * G_N]]
    logs = cells.compute_logs(cells.select_computed([4.5 * G_N, np.inf], [0.2 * MIL, 1.0]))
    assert logs == pytest.approx(
        [np.log(0.9), np.log(2), np.log(4.5 / 4), MAX_LOG_RATIO], rel=1e-14
    )


def test_exact_rows_are_selected_by_frequency_input_flag_or_run(tmp_path):
    """Rows are selected by frequency, input, flag or run, and grouped by run."""
    cells = read_response_table(
        write_table(tmp_path, "143,4,5.0,0.1,", "143,4,4.0,,R*", "0150,4,5,,U")
    )
    assert select_rows(cells, "frequency=150 Hz").tolist() == [False, False, False, True]
    assert select_rows(cells, "frequency=0.143 kHz,150 Hz").all()
    assert select_rows(cells, "input=4 g").all()
    assert select_rows(cells, "flag=R").tolist() == [False, False, True, False]
    assert select_rows(cells, "run=143 Hz repeat").tolist() == [False, False, True, False]
    groups = group_by_column("run", cells.path, cells.columns, np.ones(4, bool))
    assert [int(group.sum()) for group in groups] == [2, 1, 1]


@pytest.mark.parametrize(
    "text, wanted",
    [
        ("frequency=150", "unit"),
        ("frequency=151 Hz", "its values are 143 Hz$"),
        ("frequency", "column=value,value is needed"),
        ("displacement=1 mil", "no column displacement"),
        ("input=4 Hz", "--hold input=4 Hz"),
        ("flag=U,", "column=value,value is needed"),
    ],
)
def test_refuses_selection_without_rows(tmp_path, text, wanted):
    """A selection without rows is refused."""
    with pytest.raises(PatchfemError, match=wanted):
        select_rows(read_response_table(write_table(tmp_path, "143,4,5.0,0.1,")), text)


@pytest.mark.parametrize(
    "row, wanted",
    [
        ("143,4,0,,", "acceleration is 0"),
        ("143,0,1,,", "above zero"),
        ("143,4,,,*", "nothing can be fitted"),
    ],
)
def test_refuses_rows_without_positive_values(tmp_path, row, wanted):
    """Rows with values that have no logarithm are refused."""
    with pytest.raises(PatchfemError, match=wanted):
        read_response_table(write_table(tmp_path, row))
