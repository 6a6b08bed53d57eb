"""Long files are read exactly; files that are too large, or unpack to much more than their size, are refused."""

import tracemalloc

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.inputs import TableFormat, read_columns, tables
from patchfem.mesh import files as meshes
from patchfem.structure import arrays, universal

UNITS = {"time": {"s": 1.0, "ms": 1e-3}, "displacement": {"m": 1.0, "um": 1e-6}}


def read_path_table(path):
    """Read a table of time and displacement."""
    columns = ("time", "displacement")
    return read_columns(path, TableFormat(UNITS, columns, "time [s],displacement [m]", "a path"))


@pytest.fixture
def write_table(tmp_path):
    """Function that writes a table from its rows and returns its path."""

    def write(rows, header="time [ms],displacement [um]", end="\n"):
        path = tmp_path / "a.csv"
        path.write_bytes(end.join([header, *rows]).encode())
        return path

    return write


def measure_peak_memory(call) -> tuple:
    """Return what a call returns or its error message, and its peak memory [bytes]."""
    tracemalloc.start()
    try:
        return call(), tracemalloc.get_traced_memory()[1]
    except PatchfemError as error:
        return str(error), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_exact_numbers_of_long_table(write_table, end):
    """Every number of a long file is read exactly, with any line end, blanks and blank lines at the end."""
    rng = np.random.default_rng(3)
    count = 20_000
    values = rng.standard_normal(count) * 10.0 ** rng.integers(-9, 9, count)
    rows = np.column_stack([np.arange(float(count)), values])
    path = write_table([f" {a!r},\t{b!r} " for a, b in rows.tolist()] + ["", "  ", ""], end=end)
    columns = read_path_table(path)
    assert columns.values["time"].tolist() == [a * 1e-3 for a in rows[:, 0]]
    assert columns.values["displacement"].tolist() == [b * 1e-6 for b in rows[:, 1]]


@pytest.mark.parametrize(
    "cell, message",
    [
        ("0,1e308", "displacement: 1e+302 in SI is outside"),
        ("nan,1", "'nan' is not a finite"),
        ("1_0,1", "'1_0' is not"),
        ("1,", "'' is not"),
        ("1", "cells must be 2 (time, displacement), not"),
        ("", "cells must be 2 (time, displacement), not"),
        ("1,2,3", "cells must be 2 (time, displacement), not"),
    ],
)
def test_refuses_invalid_cell_with_line_number(write_table, cell, message):
    """An invalid cell is refused with its line number."""
    with pytest.raises(PatchfemError) as caught:
        read_path_table(write_table([*(f"{k},0" for k in range(20)), cell, "21,0"]))
    sentence = str(caught.value)
    assert sentence.partition("a.csv:")[2].startswith("22: ") and message in sentence


@pytest.mark.parametrize(
    "name, reader, expected",
    [
        ("a.msh", meshes.read_pieces, "more than 256 MiB"),
        ("a.uff", universal.read_universal, "more than 512 MiB"),
        ("a.mat", arrays.read_arrays, "more than 512 MiB"),
        ("a.csv", read_path_table, "more than 64 MiB of text"),
    ],
)
def test_refuses_huge_files_quickly(tmp_path, name, reader, expected):
    """A file of 3 GiB of zeros is refused without reading it into memory."""
    path = tmp_path / name
    with open(path, "wb") as file:
        file.truncate(3 << 30)  # a sparse file, which takes no disk space
    error_message, peak = measure_peak_memory(lambda: reader(path))
    assert expected in error_message and peak < 4.5 * tables.MAX_TABLE_BYTES
