"""Damaged files are refused with a message; a fault in a reader is not reported as a damaged file."""

import io

import numpy as np
import pytest
from scipy import sparse
from scipy.io import mmwrite
from test_matlab import ARRAYS, RUN, matlab5_bytes
from test_matlab import matlab73_bytes as write_version_73
from torture.scenes import damage_bytes
from torture.trial import Trial

from patchfem.core import PatchfemError
from patchfem.inputs import matrices, read_variables

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


def matrix_market(matrix, **options) -> bytes:
    """Return a matrix as the content of a Matrix Market file."""
    return bytes_of(lambda file: mmwrite(file, matrix, **options))


FILES = {
    "coordinates.mtx": (read_stiffness, matrix_market(sparse.coo_array(K))),
    "full.mtx": (read_stiffness, matrix_market(K)),
    "rows.mtx": (read_stiffness, b"1 1 4.0\n1 2 -1.5\n2 2 3e-3\n"),
    "plain.npz": (read_stiffness, bytes_of(np.savez, K=K)),
    "packed.npz": (read_stiffness, bytes_of(np.savez_compressed, K=K)),
    "v5.mat": (read_stiffness, matlab5_bytes({"K": sparse.csc_array(K)})),
    "variables.mat": (read_all, matlab5_bytes(ARRAYS)),
    "structures.mat": (read_all, write_version_73({"run": RUN, "g": 9.81})),
}


@pytest.mark.parametrize("name", FILES)
@pytest.mark.filterwarnings("ignore")
def test_always_damaged_file_is_read_or_refused(tmp_path, name):
    """A damaged file of matrices or variables is read or refused with its name."""
    read, content = FILES[name]
    trial = Trial(np.random.default_rng(3), None, None, None)
    path = tmp_path / name
    path.write_bytes(content)
    read(path)
    n_refused = 0
    for _ in range(80):
        damaged = bytearray(content)
        damage_bytes(trial, damaged)
        path.write_bytes(damaged)
        try:
            read(path)
        except PatchfemError as error:
            assert str(path) in str(error) and len(str(error)) < 400 + len(str(path))
            n_refused += 1
    assert n_refused > 20


@pytest.mark.parametrize("layout", ["coordinates", "full"])
@pytest.mark.parametrize("number", ["1E-", "1E-\0\0", ""])
@pytest.mark.parametrize("end", ["", "\n"])
def test_refuses_invalid_number_in_matrix_market_file(tmp_path, layout, number, end):
    """A Matrix Market file with an invalid number is refused.

    SciPy 1.17 reads most of these files, and two of them terminate its process.
    """
    path = tmp_path / "a.mtx"
    banner = f"%%MatrixMarket matrix {'coordinate' if layout == 'coordinates' else 'array'} real general\n"
    rows = "2 2 2\n1 1 4\n2 2 " if layout == "coordinates" else "2 2\n4\n0\n0\n"
    path.write_text(banner + rows + number + end)
    with pytest.raises(PatchfemError, match=r"a\.mtx"):
        read_stiffness(path)


@pytest.mark.parametrize(
    "matrix, symmetry",
    [(K, "symmetric"), (K, "general"), (K.astype(complex), "hermitian"), (K * (1 + 0j), "general")],
)
@pytest.mark.parametrize("is_sparse", [False, True])
def test_exact_matrix_market_symmetries_and_fields(tmp_path, matrix, symmetry, is_sparse):
    """Every symmetry and field of a Matrix Market file gives the same matrix."""
    path = tmp_path / "a.mtx"
    path.write_bytes(
        matrix_market(sparse.coo_array(matrix) if is_sparse else matrix, symmetry=symmetry)
    )
    assert np.array_equal(read_stiffness(path).values.toarray(), K)
