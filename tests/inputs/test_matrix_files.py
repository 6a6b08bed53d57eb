"""Sparse matrices from files of finite-element programs: each format is read exactly, and invalid files are refused."""

import numpy as np
import pytest
from scipy import sparse
from scipy.io import mmwrite, savemat

from patchfem.core import PatchfemError
from patchfem.inputs import matrices

K = np.array([[4.0, -1.5, 0, 0], [-1.5, 3.0, -2.0, 0], [0, -2.0, 6.5, -1e-3], [0, 0, -1e-3, 1.25]])
M = np.diag([1.0, 2.0, 3.0, 4.0])
ROW_NODES = [(7, 1), (7, 6), (12, 1), (900, 0)]  # node and direction of each row, in sorted order


def abaqus_lines(matrix, has_nodes: bool) -> str:
    """Return Abaqus lines of the lower triangle by rows, or of both triangles by node and direction."""
    lines = ["** matrix"]
    for i, j in zip(*np.nonzero(matrix)):
        if has_nodes:
            lines.append(
                f"{ROW_NODES[i][0]},{ROW_NODES[i][1]}, {ROW_NODES[j][0]},{ROW_NODES[j][1]}, {matrix[i, j]:.17e}"
            )
        elif i >= j:
            lines.append(f"{i + 1} {j + 1} {matrix[i, j]:.17e}")
    return "\n".join(lines)


def write_pair(folder, suffix: str):
    """Write K and M in one of the formats and return the two paths."""
    path_of_both = folder / f"both{suffix}"
    if suffix == ".mtx":
        mmwrite(folder / "k.mtx", sparse.coo_array(K), symmetry="symmetric")
        mmwrite(folder / "m.mtx", M)
        return folder / "k.mtx", folder / "m.mtx"
    if suffix == ".mat":
        savemat(path_of_both, {"K": sparse.csc_array(K), "M": M, "note": "beam"})
    elif suffix == ".npz":
        np.savez(path_of_both, K=K, M=M, T=np.ones(4))
    return path_of_both, path_of_both


@pytest.mark.parametrize("suffix", [".mtx", ".mat", ".npz"])
def test_exact_matrices_of_common_formats(tmp_path, suffix):
    """Stiffness and mass of Matrix Market, MATLAB and NumPy files are read exactly."""
    stiffness, mass = write_pair(tmp_path, suffix)
    read_matrices = matrices.align_rows(
        matrices.read_matrix(stiffness, "stiffness"), matrices.read_matrix(mass, "mass")
    )
    for matrix, expected in zip(read_matrices, (K, M)):
        assert np.array_equal(matrix.values.toarray(), expected)


def test_exact_matrix_of_scipy_sparse_file(tmp_path):
    """A matrix saved by SciPy's `save_npz` is read exactly."""
    sparse.save_npz(tmp_path / "k.npz", sparse.csr_array(K))
    assert np.array_equal(matrices.read_matrix(tmp_path / "k.npz", "damping").values.toarray(), K)


def test_exact_abaqus_matrix_lines(tmp_path):
    """Abaqus matrix lines by row number and by node are read exactly."""
    (tmp_path / "rows.mtx").write_text(abaqus_lines(K, False))
    (tmp_path / "nodes.mtx").write_text(abaqus_lines(K, True))
    by_rows, by_nodes = (
        matrices.read_matrix(tmp_path / f"{name}.mtx", "stiffness") for name in ("rows", "nodes")
    )
    assert np.array_equal(by_rows.values.toarray(), K) and by_rows.places is None
    assert np.array_equal(by_nodes.values.toarray(), K) and by_nodes.places.tolist() == [
        list(p) for p in ROW_NODES
    ]


def test_exact_rows_are_aligned_by_node():
    """Matrices whose files order the nodes differently are aligned by node and direction."""
    first_matrix = matrices.Matrix(
        sparse.csr_array(np.diag([1.0, 2.0])), np.array([[5, 1], [2, 3]])
    )
    second_matrix = matrices.Matrix(sparse.csr_array(np.diag([7.0])), np.array([[3, 1]]))
    first, second = matrices.align_rows(first_matrix, second_matrix)
    assert first.places.tolist() == [[2, 3], [3, 1], [5, 1]]
    assert first.values.diagonal().tolist() == [2, 0, 1] and second.values.diagonal().tolist() == [
        0,
        7,
        0,
    ]


BANNER = "%%MatrixMarket matrix coordinate real "
INVALID_FILES = {
    "a.mtx": ("hello\n", "cannot be read"),
    "b.mtx": ("1 2\n3 4\n", "is not a matrix: write a Matrix Market"),
    "c.mtx": (BANNER + "general\n9 9 99999999999\n1 1 1\n", "announces 99999999999 numbers"),
    "e.mtx": (
        BANNER + "general\n2 2 3\n1 1 1\n2 2 1\n1 2 0.5\n",
        "not symmetric: entries differ from the transpose by 0.5",
    ),
    "f.mtx": (BANNER + "general\n1 1 1\n1 1 nan\n", "not finite"),
    "g.mtx": (
        "%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n",
        "a Matrix Market pattern without",
    ),
    "i.mtx": ("0 1 2.0\n", "count from 1"),
    "a.mat": ("x" * 200, "no readable MATLAB file"),
}


@pytest.mark.parametrize("name", INVALID_FILES)
def test_refuses_invalid_matrix_file(tmp_path, name):
    """Each invalid matrix file is refused with its name and the reason."""
    content, message = INVALID_FILES[name]
    (tmp_path / name).write_text(content)
    with pytest.raises(PatchfemError) as caught:
        matrices.read_matrix(tmp_path / name, "stiffness")
    assert message in str(caught.value) and name in str(caught.value), str(caught.value)


def test_exact_mass_is_padded_to_size_of_stiffness(tmp_path):
    """A mass of lines of row, column and number is padded with zeros to the size of the stiffness.

    Such lines do not state the size of the matrix.
    """
    stiffness = tmp_path / "k.mtx"
    mass = tmp_path / "m.mtx"
    stiffness.write_text("1 1 4.0\n1 2 -1.0\n2 2 3.0\n")
    mass.write_text("1 1 2.5\n")
    pair = (matrices.read_matrix(stiffness, "stiffness"), matrices.read_matrix(mass, "mass"))
    matrix_lists = [matrix.values.toarray().tolist() for matrix in matrices.align_rows(*pair)]
    assert matrix_lists == [[[4.0, -1.0], [-1.0, 3.0]], [[2.5, 0.0], [0.0, 0.0]]]


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
        matrices.read_matrix(path, "stiffness")


@pytest.mark.parametrize(
    "matrix, symmetry",
    [(K, "symmetric"), (K, "general"), (K.astype(complex), "hermitian"), (K * (1 + 0j), "general")],
)
@pytest.mark.parametrize("is_sparse", [False, True])
def test_exact_matrix_market_symmetries_and_fields(tmp_path, matrix, symmetry, is_sparse):
    """Every symmetry and field of a Matrix Market file gives the same matrix."""
    path = tmp_path / "a.mtx"
    mmwrite(path, sparse.coo_array(matrix) if is_sparse else matrix, symmetry=symmetry)
    assert np.array_equal(matrices.read_matrix(path, "stiffness").values.toarray(), K)
