"""Sparse matrices from files of finite-element programs: each format is read exactly, and invalid files are refused."""

import struct

import numpy as np
import pytest
from scipy import sparse
from scipy.io import mmwrite, savemat

from patchfem.core import PatchfemError
from patchfem.inputs import matrices

K = np.array([[4.0, -1.5, 0, 0], [-1.5, 3.0, -2.0, 0], [0, -2.0, 6.5, -1e-3], [0, 0, -1e-3, 1.25]])
M = np.diag([1.0, 2.0, 3.0, 4.0])
ROW_NODES = [(7, 1), (7, 6), (12, 1), (900, 0)]  # node and direction of each row, in sorted order


def output4_text(name: str, matrix, sparse_rows: bool, is_big: bool) -> str:
    """Return an OUTPUT4 file in text, with columns from the first to the last number or by strings of rows."""
    n = len(matrix)
    lines = []
    lines.append(f"{n:8d}{-n if is_big else n:8d}{6:8d}{2:8d}{name:8s}1P,3E23.16")

    def numbers(column_values):
        return [
            "".join(f"{value:23.16E}" for value in column_values[k : k + 3])
            for k in range(0, len(column_values), 3)
        ]

    for j, column in enumerate(matrix.T, 1):
        rows = np.flatnonzero(column)
        if not sparse_rows:
            lines += [
                f"{j:8d}{rows[0] + 1:8d}{rows[-1] - rows[0] + 1:8d}",
                *numbers(column[rows[0] : rows[-1] + 1]),
            ]
            continue
        lines.append(f"{j:8d}{0:8d}{4 * rows.size:8d}")
        for i in rows:
            lines += [
                f"{3:8d}{i + 1:8d}" if is_big else f"{i + 1 + 3 * 65536:8d}",
                *numbers(column[[i]]),
            ]
    return "\n".join([*lines, f"{n + 1:8d}{1:8d}{1:8d}", " 1.0000000000000000E+00", ""])


def output4_binary(
    name: str, matrix, order: str, sparse_rows: bool, is_big: bool, word_bytes: int = 4
) -> bytes:
    """Return an OUTPUT4 file in Fortran records with words of 4 or 8 bytes."""
    n = len(matrix)
    int_format = "i" if word_bytes == 4 else "q"
    records = []

    def record(*ints, data=b""):
        body = struct.pack(f"{order}{len(ints)}{int_format}", *ints) + data
        records.append(
            struct.pack(order + "i", len(body)) + body + struct.pack(order + "i", len(body))
        )

    words = 8 // word_bytes
    record(n, -n if is_big else n, 6, 2, data=name.ljust(2 * word_bytes).encode())
    for j, column in enumerate(matrix.T, 1):
        rows = np.flatnonzero(column)
        if not sparse_rows:
            values = column[rows[0] : rows[-1] + 1]
            record(j, rows[0] + 1, words * values.size, data=values.astype(order + "f8").tobytes())
            continue
        parts = b"".join(
            struct.pack(
                f"{order}{2 if is_big else 1}{int_format}",
                *((words + 1, i + 1) if is_big else ((words + 1) * 65536 + i + 1,)),
            )
            + struct.pack(order + "d", column[i])
            for i in rows
        )
        record(j, 0, len(parts) // word_bytes, data=parts)
    record(n + 1, 1, words, data=struct.pack(order + "d", 1.0))
    return b"".join(records)


def dmig_cards(name: str, matrix, is_wide: bool) -> str:
    """Return DMIG cards of the lower triangle in wide or narrow fields, with numbers shortened as by Nastran."""
    lines = [f"DMIG    {name:8s}{0:8d}{6:8d}{2:8d}{0:8d}"]
    for j, (node, axis) in enumerate(ROW_NODES):
        rows = [i for i in range(j, len(matrix)) if matrix[i, j]]
        if is_wide:
            lines.append(f"DMIG*   {name:16s}{node:16d}{axis:16d}")
            lines += [
                f"*       {ROW_NODES[i][0]:16d}{ROW_NODES[i][1]:16d}{matrix[i, j]:16.9E}".replace(
                    "E", "D"
                )
                for i in rows
            ]
            continue
        for i in rows:
            short = f"{matrix[i, j]:.2E}".replace("E-0", "-").replace("E+00", "")
            lines.append(
                f"DMIG    {name:8s}{node:8d}{axis:8d}{'':8s}{ROW_NODES[i][0]:8d}{ROW_NODES[i][1]:8d}{short:>8s}"
            )
    return "$ punched\n" + "\n".join(lines) + "\nENDDATA\n"


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
    assert [
        np.array_equal(matrix.values.toarray(), expected)
        for matrix, expected in zip(read_matrices, (K, M))
    ] == [
        True,
        True,
    ]


def test_exact_matrix_of_scipy_sparse_file(tmp_path):
    """A matrix saved by SciPy's `save_npz` is read exactly."""
    sparse.save_npz(tmp_path / "k.npz", sparse.csr_array(K))
    assert np.array_equal(matrices.read_matrix(tmp_path / "k.npz", "damping").values.toarray(), K)


@pytest.mark.parametrize("sparse_rows, is_big", [(False, False), (True, False), (True, True)])
def test_exact_output4_matrices(tmp_path, sparse_rows, is_big):
    """OUTPUT4 files in text and binary, of either byte order and word size, are read exactly."""
    texts = [
        output4_text(name, matrix, sparse_rows, is_big)
        for name, matrix in (("KAAX", K), ("MAAX", M))
    ]
    (tmp_path / "text.op4").write_text("".join(texts))
    files = [tmp_path / "text.op4"]
    for order in "<>":
        for word_bytes in (4, 8):
            files.append(tmp_path / f"{'big' if order == '>' else 'little'}{word_bytes}.op4")
            files[-1].write_bytes(
                b"".join(
                    output4_binary(name, matrix, order, sparse_rows, is_big, word_bytes)
                    for name, matrix in (("KAAX", K), ("MAAX", M))
                )
            )
    for file in files:
        assert np.array_equal(matrices.read_matrix(file, "stiffness").values.toarray(), K), file
        assert np.array_equal(matrices.read_matrix(file, "mass").values.toarray(), M), file


@pytest.mark.parametrize("is_wide", [True, False])
def test_exact_dmig_cards_with_nodes(tmp_path, is_wide):
    """DMIG cards are read exactly, with the node and direction of each row."""
    (tmp_path / "a.pch").write_text(dmig_cards("KAAX", K, is_wide) + dmig_cards("MAAX", M, is_wide))
    stiffness, mass = matrices.align_rows(
        *(matrices.read_matrix(tmp_path / "a.pch", name) for name in ("stiffness", "mass"))
    )
    assert stiffness.places.tolist() == [list(place) for place in ROW_NODES]
    assert np.array_equal(stiffness.values.toarray(), K) and np.array_equal(
        mass.values.toarray(), M
    )


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


def slender_beam(seed: int, n: int = 60):
    """Return the stiffness (n, n) of a clamped beam of rigid links and its shape (n,) of lowest stiffness.

    Each coordinate has a random unit.
    """
    D = np.eye(n) - 2 * np.eye(n, k=-1) + np.eye(n, k=-2)
    unit = np.random.default_rng(seed).uniform(1, 2, n)
    stiffness = D.T @ D * np.outer(unit, unit) * 1e7
    return sparse.csr_array(stiffness), np.linalg.eigh(stiffness)[1][:, 0]


@pytest.mark.parametrize(
    "expected, round_values",
    [
        ("10 digits", lambda values: [float(f"{one:.9e}") for one in values]),
        ("4 digits", lambda values: [float(f"{one:.3e}") for one in values]),
        ("single precision", lambda values: values.astype(np.float32).astype(float)),
    ],
)
def test_exact_rounding_uncertainty_of_stiffness(expected, round_values):
    """The estimated uncertainty of a rounded stiffness agrees with the scatter over 60 rounded matrices.

    The rounding is recognised as a number of digits or as single precision.
    """
    ratios = []
    for seed in range(60):
        full, shape = slender_beam(seed)
        assert matrices.estimate_rounding(full) is None
        rounded_matrix = full.copy()
        rounded_matrix.data = np.array(round_values(full.data))
        digits, rounding = matrices.estimate_rounding(rounded_matrix)
        assert digits == expected
        ratios.append(
            shape
            @ (rounded_matrix - full)
            @ shape
            / matrices.compute_form_deviation(rounded_matrix, rounding, shape)
        )
    assert 0.85 < np.sqrt(np.mean(np.square(ratios))) < 1.15


def test_exact_unrounded_matrices_show_no_rounding():
    """A matrix of few or of full-precision numbers shows no rounding."""
    assert matrices.estimate_rounding(sparse.csr_array(K)) is None
    assert matrices.estimate_rounding(sparse.csr_array(slender_beam(1)[0] / 3)) is None


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
    "a.pch": ("$ nothing\n", "contains no DMIG card"),
    "b.pch": ("DMIG    KAAX    X\n", "b.pch:1: not a readable DMIG card"),
    "c.pch": (f"DMIG    KAAX    {0:8d}{6:8d}{4:8d}\n", "the matrix is complex"),
    "d.pch": (dmig_cards("KAAX", K, True).replace("4.0", "4.x"), "not a readable DMIG card ('4.x"),
    "a.op4": ("nothing\n", "not a readable OUTPUT4 file"),
    "c.op4": (
        output4_text("KAAX", K, False, False).replace(
            "       6       2KAAX", "       6       4KAAX"
        ),
        "a matrix is complex",
    ),
    "d.op4": (output4_text("KAAX", K, False, False)[:150], "not a readable OUTPUT4 file"),
    "a.mat": ("x" * 200, "damaged or of version 4"),
}


@pytest.mark.parametrize("name", INVALID_FILES)
def test_refuses_invalid_matrix_file(tmp_path, name):
    """Each invalid matrix file is refused with its name and the reason."""
    content, message = INVALID_FILES[name]
    (tmp_path / name).write_text(content)
    with pytest.raises(PatchfemError) as caught:
        matrices.read_matrix(tmp_path / name, "stiffness")
    assert message in str(caught.value) and name in str(caught.value), str(caught.value)


def test_always_damaged_output4_file_is_read_or_refused(tmp_path):
    """A truncated or changed binary OUTPUT4 file is read or refused with its name."""
    full = output4_binary("KAAX", K, "<", True, False)
    path = tmp_path / "k.op4"
    for damaged in [full[:cut] for cut in range(0, len(full), 7)] + [
        full[:k] + bytes([full[k] ^ 0x5A]) + full[k + 1 :] for k in range(120)
    ]:
        path.write_bytes(damaged)
        try:
            matrices.read_matrix(path, "stiffness")
        except PatchfemError as error:
            assert "k.op4" in str(error)


def test_refuses_unknown_names_and_unequal_sizes(tmp_path):
    """Arrays without a known name, matrices of different sizes and mixed row names are refused."""
    np.savez(tmp_path / "a.npz", A=K, B=M)
    with pytest.raises(
        PatchfemError, match=r"contains no stiffness under a known name .* its arrays: A, B"
    ):
        matrices.read_matrix(tmp_path / "a.npz", "stiffness")
    np.savez(tmp_path / "k.npz", K=K)
    for kind in ("mass", "damping"):
        with pytest.raises(
            PatchfemError, match=rf"of the file, K, has the name of a stiffness, but the {kind}"
        ):
            matrices.read_matrix(tmp_path / "k.npz", kind)
    large, small = (matrices.Matrix(sparse.csr_array(matrix)) for matrix in (K, M[:2, :2]))
    with pytest.raises(PatchfemError, match="differ in size: 4 x 4 and 2 x 2"):
        matrices.align_rows(large, small)
    with_nodes = matrices.Matrix(sparse.csr_array(K), np.array(ROW_NODES))
    with pytest.raises(PatchfemError, match="name nodes and directions and others do not"):
        matrices.align_rows(large, with_nodes)
