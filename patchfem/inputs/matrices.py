"""Sparse matrices of a structure from files of finite-element programs.

.mtx: Matrix Market, or the text that Abaqus writes for *MATRIX GENERATE (row, column, number, or node,
direction, node, direction, number); .mat: MATLAB; .npz: arrays of NumPy, or one matrix of
scipy.sparse.save_npz.
"""

from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import sparse

from ..core import PatchfemError
from ..scene import advise_on_name, describe_removed
from . import matlab
from .damage import list_some, refuse_damage
from .packed import open_arrays
from .symmetric import SKEW_REFUSAL, symmetrize

# Names of each matrix in a file with several matrices.
MATRIX_NAMES = {
    "stiffness": ("k", "kaax", "kaa", "kgg", "stiffness"),
    "mass": ("m", "maax", "maa", "mgg", "mass"),
    "damping": ("c", "d", "baax", "baa", "bgg", "damping"),
}
MAX_MATRIX_ROWS = 2 * 10**6  # largest number of rows in a matrix


class Matrix(NamedTuple):
    """Sparse matrix that was read from a file.

    - values (n, n): sparse array.
    - places (n, 2): node and direction 1 to 6 of each row, or None if the file does not state them.
    - has_size: whether the file states its size. Otherwise the matrix ends with the last row that has an entry.
    """

    values: sparse.csr_array
    places: np.ndarray | None = None
    has_size: bool = True


def read_matrix(path, matrix_name: str) -> Matrix:
    """Read the "stiffness", "mass" or "damping" of the file `path`, and make it exactly symmetric.

    Raises PatchfemError if the file cannot be read, if the matrix has none of its `MATRIX_NAMES`, or if it is not
    a square, symmetric matrix of finite real numbers.
    """
    path = Path(path)
    extension = path.suffix.lower()
    if extension not in READERS_BY_EXTENSION:
        advice = advise_on_name(extension, READERS_BY_EXTENSION)
        # Files of Nastran, which have a refusal of their own because earlier versions read them.
        if extension in (".op4", ".pch", ".bdf", ".dat"):
            advice = describe_removed("reading files of Nastran")
        raise PatchfemError(f"{path}: {advice}")
    with refuse_damage(f"{path} cannot be read"):
        matrix = READERS_BY_EXTENSION[extension](path, matrix_name)
    values = symmetrize(sparse.csr_array(matrix.values), f"{path}: the {matrix_name}")
    return matrix._replace(values=values.tocsr())


def align_rows(*matrices: Matrix) -> list[Matrix]:
    """Extend matrices so that all have the same rows and degrees of freedom.

    Raises PatchfemError if the sizes differ, or if only some of the matrices state places.

    Parameters
    ----------
    *matrices : Matrix
        Matrices of one structure, from several files.

    Returns
    -------
    list of Matrix
        In the same order. A row that a matrix lacks is empty.
    """
    with_places = [matrix for matrix in matrices if matrix.places is not None]
    if with_places and len(with_places) < len(matrices):
        raise PatchfemError(
            "some of the files name nodes and directions and others do not; export all files in the "
            "same way"
        )

    # The rows of all files are those of the sorted degrees of freedom.
    if with_places:
        places, index = _rank_dofs(np.vstack([matrix.places for matrix in matrices]))
        aligned = []
        for matrix in matrices:
            rows, index = np.split(index, [len(matrix.places)])
            aligned.append(Matrix(_spread_rows(matrix.values, rows, len(places)), places))
        return aligned

    # A file without size may end before the last row, which then has no entry.
    n = max(matrix.values.shape[0] for matrix in matrices)
    sizes = {matrix.values.shape[0] if matrix.has_size else n: None for matrix in matrices}
    if len(sizes) > 1:
        raise PatchfemError(
            "the matrices differ in size: " + " and ".join(f"{size} x {size}" for size in sizes)
        )
    return [
        matrix._replace(values=_spread_rows(matrix.values, np.arange(n), n)) for matrix in matrices
    ]


def _spread_rows(values, rows: np.ndarray, n: int) -> sparse.csr_array:
    """Expand a sparse matrix (m, m) of values to (n, n) by empty rows and columns.

    The first m of `rows` are the positions of its rows and columns in the result.
    """
    matrix = values.tocoo()
    i, j = matrix.coords
    return sparse.coo_array((matrix.data, (rows[i], rows[j])), (n, n)).tocsr()


def _find_matrix_name(path, names, matrix_name: str) -> str:
    """Return the name of the requested matrix among the names in a file: a usual one, or the only one.

    `matrix_name` is "stiffness", "mass" or "damping", whose usual names are in `MATRIX_NAMES`. `path` is for the
    message.
    """
    names = list(names)
    short_names = {name.rpartition(".")[2].lower(): name for name in reversed(names)}
    for known in MATRIX_NAMES[matrix_name]:
        if known in short_names:
            return short_names[known]
    if len(names) != 1:
        contents = list_some(names) or "none"
        raise PatchfemError(
            f"{path}: contains no {matrix_name} under a known name ({', '.join(MATRIX_NAMES[matrix_name])}); its arrays: "
            f"{contents}"
        )
    for other, known_names in MATRIX_NAMES.items():
        if not short_names.keys().isdisjoint(known_names):
            raise PatchfemError(
                f"{path}: the only array of the file, {names[0]}, has the name of a {other}, but the "
                f"{matrix_name} is needed; give the file of the {matrix_name}"
            )
    return names[0]


def _read_market(path: Path, matrix_name: str) -> Matrix:
    """Read the Matrix Market file `path`.

    A file without its header is read as Abaqus text. `scipy.io.mmread` of SciPy 1.17 is not used: it reads the damaged
    number "1E-" as 1 and missing numbers of a full matrix as 0, and "1E-" at the end of a file ends its process (signal
    11).

    `matrix_name` is "stiffness", "mass" or "damping", for messages.
    """
    with open(path, encoding="latin-1") as file:
        banner = file.readline()
        if not banner.startswith("%%MatrixMarket"):
            return _read_abaqus(path)
        _, _, _, field, symmetry = banner.lower().split()
        if field == "pattern":
            raise PatchfemError(
                f"{path}: a Matrix Market pattern without numbers; write the matrix with its values"
            )
        if symmetry == "skew-symmetric":
            raise PatchfemError(f"{path}: the {matrix_name} is not symmetric; {SKEW_REFUSAL}")

        # The size is checked before memory is reserved for it.
        lines = (line for line in file if line.strip() and line[0] != "%")
        n_rows, n_columns, *count = map(int, next(lines, "").split())
        n_numbers = count[0] if count else n_rows * n_columns
        # Largest number of values in a matrix
        max_numbers = min(5 * 10**7, path.stat().st_size)
        if max(n_rows, n_columns) > MAX_MATRIX_ROWS or n_numbers > max_numbers:
            raise PatchfemError(
                f"{path}: the header announces {n_numbers} numbers in {n_rows} x {n_columns}, more than "
                "the file can hold"
            )
        width = (2 if count else 0) + (2 if field == "complex" else 1)
        table = np.zeros((0, width))
        if n_numbers:
            table = np.loadtxt(lines, comments=None, ndmin=2)

    # A full matrix is stored column by column.
    if count:
        rows, columns = _to_integers(path, table[:, :2]).T - 1
    elif symmetry == "general":
        columns, rows = np.divmod(np.arange(n_numbers), n_rows)
    else:  # a symmetric array is stored as the lower triangle, column by column
        n_numbers = n_rows * (n_rows + 1) // 2
        columns, rows = np.triu_indices(n_rows)
    if table.shape != (n_numbers, width):
        raise ValueError(
            f"{table.shape[0]} lines of {table.shape[1]} numbers instead of {n_numbers} of {width}"
        )
    numbers = table[:, -1]
    if field == "complex":
        numbers = table[:, -2] + 1j * table[:, -1]
    values = sparse.coo_array((numbers, (rows, columns)), (n_rows, n_columns)).tocsr()
    return Matrix(values if symmetry == "general" else _complete_symmetric_matrix(values))


def _read_abaqus(path: Path) -> Matrix:
    """Read lines of row, column, number, or of node, direction, node, direction, number from `path`.

    A file with one triangle stands for the symmetric matrix.
    """
    with open(path, encoding="latin-1") as file:
        lines = (line for line in file if line.strip() and line.lstrip()[0] not in "*%#")
        first = next(lines, "")
        table = np.zeros((0, 0))
        if first:
            separator = "," if "," in first else None
            table = np.loadtxt(chain([first], lines), delimiter=separator, ndmin=2)

    # The number of columns tells rows from degrees of freedom.
    if table.shape[1] not in (3, 5) or not table.size:
        raise PatchfemError(
            f"{path}: is not a matrix: write a Matrix Market file, or lines of row, column, number, or "
            "lines of node, direction, node, direction, number"
        )
    labels = _to_integers(path, table[:, :-1])
    places = None
    if table.shape[1] == 5:
        places, index = _rank_dofs(labels.reshape(-1, 2))
        rows, columns = index.reshape(-1, 2).T
        n = len(places)
    elif labels.min() < 1 or labels.max() > MAX_MATRIX_ROWS:
        raise PatchfemError(f"{path}: rows and columns count from 1 to {MAX_MATRIX_ROWS} at most")
    else:
        rows, columns = labels.T - 1
        n = labels.max()

    # A file that has one triangle only stands for both.
    values = sparse.coo_array((table[:, -1], (rows, columns)), (n, n)).tocsr()
    if (rows <= columns).all() or (rows >= columns).all():
        values = _complete_symmetric_matrix(values)
    return Matrix(values, places, has_size=False)


def _complete_symmetric_matrix(triangle: sparse.csr_array) -> sparse.csr_array:
    """Return the symmetric matrix of which one triangle is given."""
    return (triangle + (triangle - sparse.diags_array(triangle.diagonal())).T).tocsr()


def _rank_dofs(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the sorted distinct degrees of freedom (n, 2), and the index (k,) of each row of `places` (k, 2) in them.

    A degree of freedom is a row of node and direction.
    """
    degrees, index = np.unique(places, axis=0, return_inverse=True)
    return degrees, index.ravel()


def _to_integers(path, numbers: np.ndarray) -> np.ndarray:
    """Convert numbers of rows, nodes or directions in the file `path` to integers.

    Raises PatchfemError if one is not whole.
    """
    if not (numbers == np.floor(numbers)).all() or not (np.abs(numbers) < 2**31).all():
        raise PatchfemError(f"{path}: rows, nodes and directions must be whole numbers")
    return numbers.astype(int)


def _read_matlab(path: Path, matrix_name: str) -> Matrix:
    """Read the "stiffness", "mass" or "damping" (`matrix_name`) of the MATLAB file `path`."""
    arrays = matlab.read_variables(path)
    return _make_matrix(path, arrays[_find_matrix_name(path, arrays, matrix_name)])


def _read_numpy(path: Path, matrix_name: str) -> Matrix:
    """Read the "stiffness", "mass" or "damping" (`matrix_name`) of the .npz file `path`.

    The file is a sparse matrix as SciPy writes it, or contains arrays by name.
    """
    with open_arrays(path, "save the matrices as sparse ones") as file:
        if {"format", "shape", "data"} <= set(file.files):
            return _make_matrix(path, sparse.load_npz(path))
        return _make_matrix(path, file[_find_matrix_name(path, file.files, matrix_name)])


def _make_matrix(path: Path, values) -> Matrix:
    """Return the matrix of an array or sparse array of values from the file `path`.

    Raises PatchfemError if it has too many rows.
    """
    # A small file may state any number of rows, for each of which a sparse matrix needs memory.
    if max(values.shape, default=0) > MAX_MATRIX_ROWS:
        raise PatchfemError(
            f"{path}: a matrix of {MAX_MATRIX_ROWS} rows and columns at most can be read"
        )
    # SciPy checks the indices of these formats only on demand. Wrong ones end the process.
    if sparse.issparse(values) and values.format in ("csr", "csc", "bsr"):
        values.check_format(full_check=True)
    return Matrix(sparse.csr_array(values))


# Reader of each file extension.
READERS_BY_EXTENSION = {".mtx": _read_market, ".mat": _read_matlab, ".npz": _read_numpy}
