"""Damaged files are refused with a message; a fault in a reader is not reported as a damaged file."""

import io
import warnings
from pathlib import Path
from time import process_time

import numpy as np
import pytest
import surfaces as write
from matlab_files import matlab5_bytes, matlab73_bytes
from scipy import sparse
from scipy.io import mmwrite
from torture.scenes import damage_bytes
from torture.trial import Trial

from patchfem.core import PatchfemError
from patchfem.inputs import matrices, read_loop, read_signal, read_slide, read_table, read_variables
from patchfem.surface import read_surface
from patchfem.surface.areal import Areal

K = np.array([[4.0, -1.5, 0.0], [-1.5, 3.0, -2.0], [0.0, -2.0, 6.5e-3]])


def read_stiffness(path):
    """Read the stiffness matrix of a file."""
    return matrices.read_matrix(path, "stiffness")


def read_all(path):
    """Read all variables of a MATLAB file."""
    return read_variables(str(path), path.read_bytes())


def bytes_of(write, **options) -> bytes:
    """Return what a function writes into a binary file."""
    file = io.BytesIO()
    write(file, **options)
    return file.getvalue()


Z = np.where(np.arange(24).reshape(4, 6) == 9, np.nan, write.draw_scan())
POINTS = np.array([(x * 0.5, y * 0.75, Z[y, x] * 1e6) for y in range(4) for x in range(6)])

ROWS = "".join(f"{k}.5,0.{k * 37 % 500:03d}\n" for k in range(40))

# file name, content that is damaged, and function that makes the file of it
SURFACES = {
    "text": ("a.csv", f"# tip 2 um\nx [um],z [um]\n{ROWS}".encode(), bytes),
    "matrix": ("a.txt", ("# Width: 3.0 µm\n# Height: 3.0 µm\n# Value units: um\n" + "\n".join("\t".join(
        f"{float(z) * 1e6!r}".replace(".", ",") for z in row) for row in Z)).encode(), bytes),
    "dektak": ("a.csv", write.make_dektak(np.sin(np.arange(60.0)), 9.375), bytes),
    "npy": ("a.npy", write.make_npy(POINTS), bytes),
    "mat": ("a.mat", write.make_mat(False, points=POINTS), bytes),
}  # fmt: skip


PAIRS = "".join(f"{k},{k * 37 % 500}\n" for k in range(40))
TABLES = {
    "slide.csv": (read_slide, "time [s],displacement [um]"),
    "loop.csv": (read_loop, "displacement [um],force [N]"),
    "signal.csv": (lambda path: read_signal(path, "force"), "time [s],force [N]"),
    "rows.csv": (read_table, "frequency [Hz],input [g]"),
}


def read_heights(path: Path) -> None:
    """Read a surface, whose places and heights must be finite and whose places rise."""
    with warnings.catch_warnings(action="error"):
        found = read_surface(path, ("um", "um") if path.suffix in (".npy", ".mat") else None)
    heights = found.z[np.isfinite(found.z)]
    assert heights.size >= 2 and not np.isinf(found.z).any() and np.abs(heights).max() <= 10.0
    axes = (found.x, found.y) if isinstance(found, Areal) else (found.x,)
    assert all(np.isfinite(axis).all() and (np.diff(axis) > 0).all() for axis in axes)
    assert found.z.shape == tuple(axis.size for axis in reversed(axes))


FILES = {
    "coordinates.mtx": (
        read_stiffness,
        "coordinates.mtx",
        bytes_of(mmwrite, a=sparse.coo_array(K)),
        bytes,
    ),
    "rows.mtx": (read_stiffness, "rows.mtx", b"1 1 4.0\n1 2 -1.5\n2 2 3e-3\n", bytes),
    "packed.npz": (read_stiffness, "packed.npz", bytes_of(np.savez_compressed, K=K), bytes),
    "v5.mat": (read_stiffness, "v5.mat", matlab5_bytes({"K": sparse.csc_array(K)}), bytes),
    "variables.mat": (
        read_all,
        "variables.mat",
        matlab5_bytes({"K": K, "n": np.arange(6, dtype="u1")}),
        bytes,
    ),
    # not compressed: SciPy ends the process where a wrong type, length or flag is not refused before
    "plain.mat": (
        read_all,
        "plain.mat",
        matlab5_bytes(
            {
                "run": {"F": K, "by": "bench 3"},
                "z": np.array([1 + 2j]),
                "n": np.arange(5),
                "K": sparse.csc_array(K),
            },
            packed=False,
        ),
        bytes,
    ),
    "structures.mat": (
        read_all,
        "structures.mat",
        matlab73_bytes({"run": {"F": K}, "by": "bench 3"}),
        bytes,
    ),
    **{name: (read_heights, *seed) for name, seed in SURFACES.items()},
    **{
        name: (read, name, f"{head}\n{PAIRS}".encode(), bytes)
        for name, (read, head) in TABLES.items()
    },
}


@pytest.mark.parametrize("count", [40, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", FILES)
@pytest.mark.filterwarnings("ignore")
def test_always_damaged_file_is_read_or_refused(tmp_path, name, count):
    """Damaged copies of a file are read or refused with the file name, and at least about 5 % are refused."""
    read, file_name, content, make_file = FILES[name]
    trial = Trial(np.random.default_rng([81, len(content)]))
    path = tmp_path / file_name
    path.write_bytes(make_file(content))
    read(path)
    n_refused = 0
    for _ in range(count):
        damaged = bytearray(content)
        for _ in range(trial.draw(1, 2, 3, 4)):
            damage_bytes(trial, damaged)
        path.write_bytes(make_file(bytes(damaged)))
        start = process_time()
        try:
            read(path)
        except PatchfemError as error:
            assert str(path) in str(error) and len(str(error)) < 500 + len(str(path))
            n_refused += 1
        assert process_time() - start < 10.0
    assert n_refused > count // 20 - 2
