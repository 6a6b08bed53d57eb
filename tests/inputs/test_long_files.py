"""Files that are long, or unpack to more than they seem: read block by block, or refused by their heads."""

import io
import tracemalloc
import zipfile

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.inputs import TableFormat, cells, measured, read_columns
from patchfem.mesh import files as meshes
from patchfem.structure import arrays, universal

UNITS = {"time": {"s": 1.0, "ms": 1e-3}, "displacement": {"m": 1.0, "um": 1e-6}}


def read(path):
    columns = ("time", "displacement")
    return read_columns(path, TableFormat(UNITS, columns, "time [s],displacement [m]", "a path"))


@pytest.fixture
def table(tmp_path):
    def made(body, head="time [ms],displacement [um]", end="\n"):
        path = tmp_path / "a.csv"
        path.write_bytes(end.join([head, *body]).encode())
        return path

    return made


def peak_of(call) -> tuple:
    """What a call returns or raises, and the most memory [bytes] that it took."""
    tracemalloc.start()
    try:
        return call(), tracemalloc.get_traced_memory()[1]
    except PatchfemError as error:
        return str(error), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_exact_blocks_change_no_number(table, end):
    """A file of several blocks, which begin and end anywhere in a number or between the two characters of a line end."""
    rng = np.random.default_rng(3)
    count = 20_000
    values = rng.standard_normal(count) * 10.0 ** rng.integers(-9, 9, count)
    rows = np.column_stack([np.arange(float(count)), values])
    path = table([f" {a!r},\t{b!r} " for a, b in rows.tolist()] + ["", "  ", ""], end=end)
    assert path.stat().st_size > 4 * cells.BLOCK_BYTES
    found = read(path)
    assert found.rows == count
    assert found.values["time"].tolist() == [a * 1e-3 for a in rows[:, 0]]
    assert found.values["displacement"].tolist() == [b * 1e-6 for b in rows[:, 1]]


def test_exact_a_line_longer_than_two_blocks_is_one_line(table):
    blanks = " " * (3 * cells.BLOCK_BYTES)
    found = read(table(["0,1", f"1,{blanks}2", "2,3"]))
    assert found.values["displacement"].tolist() == [1e-6, 2e-6, 3e-6]


@pytest.mark.parametrize("count", [20, 40_000])
@pytest.mark.parametrize(
    "cell, says",
    [
        ("0,1e308", "displacement: 1e+302 in SI is outside"),
        ("nan,1", "'nan' is not a finite"),
        ("1_0,1", "'1_0' is not"),
        ("1 2,1", "'1 2' is not"),
        ("--1,1", "'--1' is not"),
        ("1,", "'' is not"),
        ("1", "two cells"),
        ("", "two cells"),
        ("1,2,3", "two cells"),
        ("1e999,1", "not a finite"),
        ("0x1,1", "'0x1' is not"),
    ],
)
def test_refuses_a_cell_at_its_line(table, count, cell, says):
    """In the first block of a file, and in a later one."""
    with pytest.raises(PatchfemError) as caught:
        read(table([*(f"{k},0" for k in range(count)), cell, f"{count + 1},0"]))
    sentence = str(caught.value)
    assert sentence.partition("a.csv:")[2].startswith(f"{count + 2}: ") and says in sentence


def test_always_a_long_table_takes_little_more_than_its_numbers(table):
    path = table([f"{k}.000,{k % 100}e-3" for k in range(30_000)])
    found, peak = peak_of(lambda: read(path))
    # numbers of 0.5 MB; 67 MB with room for the largest file and all lines
    assert found.rows == 30_000 and peak < 4e6


def bomb(path, shape):
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as whole,
        whole.open("K.npy", "w") as part,
    ):
        np.lib.format.write_array_header_1_0(
            part, {"descr": "<f8", "fortran_order": False, "shape": shape}
        )
        part.write(bytes(1000))
    return path


@pytest.mark.parametrize("shape", [(20_000, 20_000), (2_000_000, 2_000_000), (2001, 2000)])
def test_refuses_an_array_by_its_head_before_it_is_unpacked(tmp_path, shape):
    said, peak = peak_of(lambda: arrays.read_arrays(bomb(tmp_path / "a.npz", shape)))
    assert f"K of shape {shape[0]}x{shape[1]} is larger than 2000 coordinates" in said
    assert peak < 2e6


def test_refuses_a_matrix_of_matlab_by_its_head(tmp_path):
    import scipy.io

    scipy.io.savemat(
        tmp_path / "a.mat", {"K": np.ones((2001, 2000), np.uint8)}, do_compression=True
    )
    said, peak = peak_of(lambda: arrays.read_arrays(tmp_path / "a.mat"))
    assert "K of shape 2001x2000" in said and peak < 1e6


def test_refuses_matrices_of_nothing():
    nothing = np.zeros((0, 0))
    with pytest.raises(PatchfemError, match="M has no coordinate"):
        arrays.build_basis(
            {"M": nothing, "K": nothing, "slide": np.zeros(0), "output": np.zeros(0)}
        )


def test_exact_arrays_of_a_file_are_those_that_were_saved(tmp_path):
    saved = {
        "M": np.eye(3),
        "K": np.asfortranarray(np.arange(9.0).reshape(3, 3)),
        "names": np.array(["a", "b", "ü"]),
        "other": np.zeros(5),
    }
    np.savez_compressed(tmp_path / "a.npz", **saved)
    found = arrays.read_arrays(tmp_path / "a.npz")
    assert set(found) == {"M", "K", "names"} and all(
        np.array_equal(found[key], saved[key]) for key in found
    )
    with pytest.raises(PatchfemError, match="contains values of 4000 bytes"):
        np.savez(tmp_path / "b.npz", names=np.array(["a" * 1000]))
        arrays.read_arrays(tmp_path / "b.npz")


@pytest.mark.parametrize(
    "name, reader, says",
    [
        ("a.csv", measured.read_table, "more than 64 MiB of text"),
        ("a.msh", meshes.read_pieces, "more than 256 MiB"),
        ("a.uff", universal.read_universal, "more than 256 MiB"),
        ("a.mat", arrays.read_arrays, "is damaged or of version 4"),
        ("a.csv", read, "more than 64 MiB of text"),
    ],
)
def test_refuses_gigabytes_of_zeros_at_once(tmp_path, name, reader, says):
    path = tmp_path / name
    with open(path, "wb") as file:
        file.truncate(3 << 30)  # no block of the disk is taken
    said, peak = peak_of(lambda: reader(path))
    assert says in said and peak < 4.5 * cells.MAX_BYTES


def test_exact_a_text_is_its_lines(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes("\ufeffa\r\nü\rb\n\nc".encode())
    assert cells.read_text(path, "a text") == "a\nü\nb\n\nc"
    assert io.StringIO(cells.read_text(path, "a text")).readlines()[1] == "ü\n"
