"""Sparse matrices from files of finite-element programs: each format gives the matrix that was written, each bad file
its sentence."""

import struct

import numpy as np
import pytest
from scipy import sparse
from scipy.io import mmwrite, savemat

from patchfem.core import PatchfemError
from patchfem.inputs import matrices

K = np.array([[4.0, -1.5, 0, 0], [-1.5, 3.0, -2.0, 0], [0, -2.0, 6.5, -1e-3], [0, 0, -1e-3, 1.25]])
M = np.diag([1.0, 2.0, 3.0, 4.0])
PLACES = [(7, 1), (7, 6), (12, 1), (900, 0)]  # of the rows, in the order in which they are sorted


def output4_text(name: str, matrix, sparse_rows: bool, big: bool) -> str:
    """An OUTPUT4 file in text, its columns from the first to the last number or by strings of rows."""
    n = len(matrix)
    out = []
    out.append(f"{n:8d}{-n if big else n:8d}{6:8d}{2:8d}{name:8s}1P,3E23.16")

    def numbers(values):
        return [
            "".join(f"{value:23.16E}" for value in values[k : k + 3])
            for k in range(0, len(values), 3)
        ]

    for j, column in enumerate(matrix.T, 1):
        there = np.flatnonzero(column)
        if not sparse_rows:
            out += [
                f"{j:8d}{there[0] + 1:8d}{there[-1] - there[0] + 1:8d}",
                *numbers(column[there[0] : there[-1] + 1]),
            ]
            continue
        out.append(f"{j:8d}{0:8d}{4 * there.size:8d}")
        for i in there:
            out += [
                f"{3:8d}{i + 1:8d}" if big else f"{i + 1 + 3 * 65536:8d}",
                *numbers(column[[i]]),
            ]
    return "\n".join([*out, f"{n + 1:8d}{1:8d}{1:8d}", " 1.0000000000000000E+00", ""])


def output4_binary(
    name: str, matrix, order: str, sparse_rows: bool, big: bool, wide: int = 4
) -> bytes:
    """The same in records of Fortran, with words of 4 or 8 bytes."""
    n = len(matrix)
    whole = "i" if wide == 4 else "q"
    out = []

    def record(*ints, data=b""):
        body = struct.pack(f"{order}{len(ints)}{whole}", *ints) + data
        out.append(struct.pack(order + "i", len(body)) + body + struct.pack(order + "i", len(body)))

    words = 8 // wide
    record(n, -n if big else n, 6, 2, data=name.ljust(2 * wide).encode())
    for j, column in enumerate(matrix.T, 1):
        there = np.flatnonzero(column)
        if not sparse_rows:
            values = column[there[0] : there[-1] + 1]
            record(j, there[0] + 1, words * values.size, data=values.astype(order + "f8").tobytes())
            continue
        parts = b"".join(
            struct.pack(
                f"{order}{2 if big else 1}{whole}",
                *((words + 1, i + 1) if big else ((words + 1) * 65536 + i + 1,)),
            )
            + struct.pack(order + "d", column[i])
            for i in there
        )
        record(j, 0, len(parts) // wide, data=parts)
    record(n + 1, 1, words, data=struct.pack(order + "d", 1.0))
    return b"".join(out)


def punched(name: str, matrix, wide: bool) -> str:
    """DMIG cards of the lower triangle, in wide or narrow fields, with numbers as Nastran shortens them."""
    out = [f"DMIG    {name:8s}{0:8d}{6:8d}{2:8d}{0:8d}"]
    for j, (node, axis) in enumerate(PLACES):
        rows = [i for i in range(j, len(matrix)) if matrix[i, j]]
        if wide:
            out.append(f"DMIG*   {name:16s}{node:16d}{axis:16d}")
            out += [
                f"*       {PLACES[i][0]:16d}{PLACES[i][1]:16d}{matrix[i, j]:16.9E}".replace(
                    "E", "D"
                )
                for i in rows
            ]
            continue
        for i in rows:
            short = f"{matrix[i, j]:.2E}".replace("E-0", "-").replace("E+00", "")
            out.append(
                f"DMIG    {name:8s}{node:8d}{axis:8d}{'':8s}{PLACES[i][0]:8d}{PLACES[i][1]:8d}{short:>8s}"
            )
    return "$ punched\n" + "\n".join(out) + "\nENDDATA\n"


def lower(matrix, named: bool) -> str:
    """Lines of Abaqus: one triangle by rows, or both by nodes and directions."""
    out = ["** matrix"]
    for i, j in zip(*np.nonzero(matrix)):
        if named:
            out.append(
                f"{PLACES[i][0]},{PLACES[i][1]}, {PLACES[j][0]},{PLACES[j][1]}, {matrix[i, j]:.17e}"
            )
        elif i >= j:
            out.append(f"{i + 1} {j + 1} {matrix[i, j]:.17e}")
    return "\n".join(out)


def written(path, kind: str):
    """A file or two of K and M in one of the formats: (path of K, path of M)."""
    both = path / f"both{kind}"
    if kind == ".mtx":
        mmwrite(path / "k.mtx", sparse.coo_array(K), symmetry="symmetric")
        mmwrite(path / "m.mtx", M)
        return path / "k.mtx", path / "m.mtx"
    if kind == ".mat":
        savemat(both, {"K": sparse.csc_array(K), "M": M, "note": "beam"})
    elif kind == ".npz":
        np.savez(both, K=K, M=M, T=np.ones(4))
    return both, both


@pytest.mark.parametrize("kind", [".mtx", ".mat", ".npz"])
def test_exact_matrices_of_plain_files(tmp_path, kind):
    stiffness, mass = written(tmp_path, kind)
    found = matrices.align_rows(
        matrices.read_matrix(stiffness, "stiffness"), matrices.read_matrix(mass, "mass")
    )
    assert [np.array_equal(one.values.toarray(), true) for one, true in zip(found, (K, M))] == [
        True,
        True,
    ]


def test_exact_matrix_of_save_npz(tmp_path):
    sparse.save_npz(tmp_path / "k.npz", sparse.csr_array(K))
    assert np.array_equal(matrices.read_matrix(tmp_path / "k.npz", "damping").values.toarray(), K)


@pytest.mark.parametrize("sparse_rows, big", [(False, False), (True, False), (True, True)])
def test_exact_output4(tmp_path, sparse_rows, big):
    texts = [output4_text(name, one, sparse_rows, big) for name, one in (("KAAX", K), ("MAAX", M))]
    (tmp_path / "text.op4").write_text("".join(texts))
    files = [tmp_path / "text.op4"]
    for order in "<>":
        for wide in (4, 8):
            files.append(tmp_path / f"{'big' if order == '>' else 'little'}{wide}.op4")
            files[-1].write_bytes(
                b"".join(
                    output4_binary(name, one, order, sparse_rows, big, wide)
                    for name, one in (("KAAX", K), ("MAAX", M))
                )
            )
    for file in files:
        assert np.array_equal(matrices.read_matrix(file, "stiffness").values.toarray(), K), file
        assert np.array_equal(matrices.read_matrix(file, "mass").values.toarray(), M), file


@pytest.mark.parametrize("wide", [True, False])
def test_exact_punched_cards_with_their_places(tmp_path, wide):
    (tmp_path / "a.pch").write_text(punched("KAAX", K, wide) + punched("MAAX", M, wide))
    stiffness, mass = matrices.align_rows(
        *(matrices.read_matrix(tmp_path / "a.pch", name) for name in ("stiffness", "mass"))
    )
    assert stiffness.places.tolist() == [list(place) for place in PLACES]
    assert np.array_equal(stiffness.values.toarray(), K) and np.array_equal(
        mass.values.toarray(), M
    )


def test_exact_lines_of_abaqus(tmp_path):
    (tmp_path / "rows.mtx").write_text(lower(K, False))
    (tmp_path / "nodes.mtx").write_text(lower(K, True))
    by_rows, by_nodes = (
        matrices.read_matrix(tmp_path / f"{name}.mtx", "stiffness") for name in ("rows", "nodes")
    )
    assert np.array_equal(by_rows.values.toarray(), K) and by_rows.places is None
    assert np.array_equal(by_nodes.values.toarray(), K) and by_nodes.places.tolist() == [
        list(p) for p in PLACES
    ]


def slender(seed: int, n: int = 60):
    """Stiffness (n, n) of a clamped beam of rigid links and hinges, in a random unit for each coordinate, and its shape
    (n,) of lowest stiffness."""
    D = np.eye(n) - 2 * np.eye(n, k=-1) + np.eye(n, k=-2)
    unit = np.random.default_rng(seed).uniform(1, 2, n)
    stiff = D.T @ D * np.outer(unit, unit) * 1e7
    return sparse.csr_array(stiff), np.linalg.eigh(stiff)[1][:, 0]


@pytest.mark.parametrize(
    "told, rounded",
    [
        ("10 digits", lambda values: [float(f"{one:.9e}") for one in values]),
        ("4 digits", lambda values: [float(f"{one:.3e}") for one in values]),
        ("single precision", lambda values: values.astype(np.float32).astype(float)),
    ],
)
def test_exact_what_digits_that_a_file_lacks_leave_uncertain(told, rounded):
    """Of 200 rounded matrices the stiffness of a shape scatters by what is told; K rounds alike above and below the
    diagonal."""
    shares = []
    for seed in range(200):
        whole, shape = slender(seed)
        assert matrices.estimate_rounding(whole) is None
        short = whole.copy()
        short.data = np.array(rounded(whole.data))
        words, off = matrices.estimate_rounding(short)
        assert words == told
        shares.append(
            shape @ (short - whole) @ shape / matrices.compute_form_deviation(short, off, shape)
        )
    assert 0.85 < np.sqrt(np.mean(np.square(shares))) < 1.15


def test_exact_few_or_whole_numbers_show_no_rounding():
    assert matrices.estimate_rounding(sparse.csr_array(K)) is None
    assert matrices.estimate_rounding(sparse.csr_array(slender(1)[0] / 3)) is None


def test_exact_rows_of_places_that_files_order_in_their_own_way():
    one = matrices.Matrix(sparse.csr_array(np.diag([1.0, 2.0])), np.array([[5, 1], [2, 3]]))
    other = matrices.Matrix(sparse.csr_array(np.diag([7.0])), np.array([[3, 1]]))
    first, second = matrices.align_rows(one, other)
    assert first.places.tolist() == [[2, 3], [3, 1], [5, 1]]
    assert first.values.diagonal().tolist() == [2, 0, 1] and second.values.diagonal().tolist() == [
        0,
        7,
        0,
    ]


HEAD = "%%MatrixMarket matrix coordinate real "
BAD = {
    "a.mtx": ("hello\n", "cannot be read"),
    "b.mtx": ("1 2\n3 4\n", "is not a matrix: write a Matrix Market"),
    "c.mtx": (HEAD + "general\n9 9 99999999999\n1 1 1\n", "announces 99999999999 numbers"),
    "d.mtx": (HEAD + "general\n2 3 1\n1 1 1\n", "must be square, not of shape (2, 3)"),
    "e.mtx": (
        HEAD + "general\n2 2 3\n1 1 1\n2 2 1\n1 2 0.5\n",
        "not symmetric: entries differ from the transpose by 0.5",
    ),
    "f.mtx": (HEAD + "general\n1 1 1\n1 1 nan\n", "not finite"),
    "g.mtx": (
        "%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n",
        "a Matrix Market pattern without",
    ),
    "h.mtx": (
        "%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 0.02\n",
        "is complex; motion in time",
    ),
    "i.mtx": ("0 1 2.0\n", "count from 1"),
    "j.mtx": ("1.5 1 2.0\n", "must be whole numbers"),
    "a.pch": ("$ nothing\n", "contains no DMIG card"),
    "b.pch": ("DMIG    KAAX    X\n", "b.pch:1: not a readable DMIG card"),
    "c.pch": (f"DMIG    KAAX    {0:8d}{6:8d}{4:8d}\n", "the matrix is complex"),
    "d.pch": (punched("KAAX", K, True).replace("4.0", "4.x"), "not a readable DMIG card ('4.x"),
    "a.op4": ("nothing\n", "not a readable OUTPUT4 file"),
    "b.op4": ("", "contains no matrix"),
    "c.op4": (
        output4_text("KAAX", K, False, False).replace(
            "       6       2KAAX", "       6       4KAAX"
        ),
        "a matrix is complex",
    ),
    "d.op4": (output4_text("KAAX", K, False, False)[:150], "not a readable OUTPUT4 file"),
    "a.npz": ("PK no archive", "is not an archive"),
    "a.mat": ("x" * 200, "damaged or of version 4"),
}


@pytest.mark.parametrize("name", BAD)
def test_refuses_each_bad_file_with_its_sentence(tmp_path, name):
    content, says = BAD[name]
    (tmp_path / name).write_text(content)
    with pytest.raises(PatchfemError) as caught:
        matrices.read_matrix(tmp_path / name, "stiffness")
    assert says in str(caught.value) and name in str(caught.value), str(caught.value)


def test_always_refuses_damaged_binary_matrices_by_a_sentence(tmp_path):
    """Every cut of a file, and every byte of its first records changed, is refused or read, never a traceback."""
    whole = output4_binary("KAAX", K, "<", True, False)
    path = tmp_path / "k.op4"
    for change in [whole[:cut] for cut in range(0, len(whole), 7)] + [
        whole[:k] + bytes([whole[k] ^ 0x5A]) + whole[k + 1 :] for k in range(120)
    ]:
        path.write_bytes(change)
        try:
            matrices.read_matrix(path, "stiffness")
        except PatchfemError as error:
            assert "k.op4" in str(error)


def test_refuses_names_that_are_not_known_and_sizes_that_differ(tmp_path):
    np.savez(tmp_path / "a.npz", A=K, B=M)
    with pytest.raises(
        PatchfemError, match=r"contains no stiffness under a known name .* its arrays: A, B"
    ):
        matrices.read_matrix(tmp_path / "a.npz", "stiffness")
    np.savez(tmp_path / "k.npz", K=K)
    for wanted in ("mass", "damping"):
        with pytest.raises(
            PatchfemError, match=rf"of the file, K, has the name of a stiffness, but the {wanted}"
        ):
            matrices.read_matrix(tmp_path / "k.npz", wanted)
    one, small = (matrices.Matrix(sparse.csr_array(part)) for part in (K, M[:2, :2]))
    with pytest.raises(PatchfemError, match="differ in size: 4 x 4 and 2 x 2"):
        matrices.align_rows(one, small)
    named = matrices.Matrix(sparse.csr_array(K), np.array(PLACES))
    with pytest.raises(PatchfemError, match="name nodes and directions and others do not"):
        matrices.align_rows(one, named)
