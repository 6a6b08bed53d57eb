"""Sparse matrices of a structure from files of finite-element programs, with the places of their rows where told.

.mtx: Matrix Market, or the text that Abaqus makes of *MATRIX GENERATE (row, column, number, or node, direction, node,
direction, number); .mat: MATLAB; .npz: NumPy arrays, or one matrix of scipy.sparse.save_npz; .op4, .pch, .bdf, .dat:
Nastran.
"""

import zipfile
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.io import mmread

from ..core import PatchfemError
from . import matlab, nastran

ENDINGS = (".mtx", ".mat", ".npz", ".op4", ".pch", ".bdf", ".dat")
# of matrices in files that hold several
NAMES = {
    "stiffness": ("k", "kaax", "kaa", "kgg", "stiffness"),
    "mass": ("m", "maax", "maa", "mgg", "mass"),
    "damping": ("c", "d", "baax", "baa", "bgg", "damping"),
}
SAMPLE = 500  # numbers by which it shows to how many digits a matrix was rounded
FEW = 10  # different numbers below which it does not show
NEED = 0.6  # least share of them that need all digits but two
SHORT = 7  # digits that single precision holds
WHOLE = 15  # digits and more that double precision does not tell from all
SKEW = 1e-8  # share of the largest entry by which a symmetric matrix may differ from its transpose


class Matrix(NamedTuple):
    """A sparse array (n, n); places (n, 2): node and direction 1 to 6 of each row, None where the file does not tell;
    sized: whether the file tells its size, which else is that of its last row."""

    values: object
    places: np.ndarray | None = None
    sized: bool = True


def read(path, wanted: str) -> Matrix:
    """The matrix "stiffness", "mass" or "damping" of a file, made exactly symmetric.

    A file of several holds it under one of `NAMES`. PatchfemError for a file that cannot be read, a matrix that is not
    there, not square, not finite, complex or not symmetric.
    """
    try:
        found = READERS[Path(path).suffix.lower()](Path(path), wanted)
    except PatchfemError:
        raise
    except Exception as error:  # a damaged file raises whatever its reader trips over
        raise PatchfemError(
            f"{path} cannot be read ({' '.join(str(error).split())[:160]})"
        ) from None
    return found._replace(values=_symmetric(path, found.values, wanted))


def estimate_rounding(values) -> tuple | None:
    """(digits in words, by how much each of the numbers (k,) of a sparse array may be off, as a standard deviation);
    None where the array has all digits of double precision, or too few different numbers to tell."""
    data = values.data
    some = np.unique(np.abs(data[:: max(1, data.size // (20 * SAMPLE))]))
    some = some[some > 0]
    some = some[:: max(1, some.size // SAMPLE)]
    digits = np.array(
        [len(repr(one).split("e")[0].replace(".", "").strip("0")) for one in some.tolist()]
    )
    if some.size < FEW:
        return None
    if digits.max() > SHORT and np.array_equal(some.astype(np.float32), some):
        return "single precision", np.where(
            data == 0, 0.0, np.spacing(np.abs(data).astype(np.float32))
        ) / np.sqrt(12)
    # a sign or an exponent may take two
    if digits.max() < WHOLE and np.mean(digits >= digits.max() - 2) >= NEED:
        count = int(np.median(digits))
        with np.errstate(divide="ignore"):
            power = np.where(data == 0, -np.inf, np.floor(np.log10(np.abs(data))))
        return f"{count} digits", 10.0 ** (power + 1 - count) / np.sqrt(12)
    return None


def quadratic_form_deviation(values, off, shape) -> float:
    """Standard deviation of shape^T A shape, of a sparse array A whose different numbers (k,) are off by `off` (k,)
    independently of one another; shape (n,)."""
    found = values.tocoo()
    i, j = found.coords
    _, which = np.unique(np.abs(found.data), return_inverse=True)
    share = np.bincount(which, shape[i] * shape[j] * np.sign(found.data))
    each = np.zeros(share.size)
    each[which] = off
    return float(np.sqrt(share**2 @ each**2))


def _symmetric(path, values, wanted: str):
    values = sparse.csr_array(values)
    if np.iscomplexobj(values.data):
        if np.abs(values.data.imag).max(initial=0.0) > 0:
            raise PatchfemError(
                f"{path}: the {wanted} is complex; motion in time needs real matrices: give hysteretic "
                "damping as a damping ratio, which is half the loss factor"
            )
        values = values.real
    if values.shape[0] != values.shape[1] or not values.shape[0]:
        raise PatchfemError(f"{path}: the {wanted} must be square, not of shape {values.shape}")
    if not np.isfinite(values.data).all():
        raise PatchfemError(f"{path}: the {wanted} contains values that are not finite")
    values = values.astype(float)
    skew, most = abs(values - values.T).max(), abs(values).max()
    if skew > SKEW * most:
        raise PatchfemError(
            f"{path}: the {wanted} is not symmetric: entries differ from the transpose by {skew:.3g}, "
            f"which is {skew / most:.2g} of the largest entry; gyroscopic and follower terms are not "
            "supported"
        )
    return ((values + values.T) / 2).tocsr()


def _named(path, names, wanted: str) -> str:
    """The name under which a file holds the wanted matrix: one of NAMES, or its only one that is no other matrix."""
    names = list(names)
    for known in NAMES[wanted]:
        for name in names:
            if name.rpartition(".")[2].lower() == known:
                return name
    other = [
        kind
        for kind, known in NAMES.items()
        if len(names) == 1 and names[0].rpartition(".")[2].lower() in known
    ]
    if other:
        raise PatchfemError(
            f"{path}: the only array of the file, {names[0]}, has the name of a {other[0]}, but the "
            f"{wanted} is needed; give the file of the {wanted}"
        )
    if len(names) == 1:
        return names[0]
    held = ", ".join(names[:12]) or "none"
    raise PatchfemError(
        f"{path}: contains no {wanted} under a known name ({', '.join(NAMES[wanted])}); its arrays: "
        f"{held}"
    )


def _market(path: Path, wanted: str) -> Matrix:
    with open(path, "rb") as file:
        head = file.read(2**16)
    if not head.startswith(b"%%MatrixMarket"):
        return _abaqus(path)
    first, *lines = head.decode("latin-1").split("\n")
    words = first.lower().split()
    if "pattern" in words:
        raise PatchfemError(
            f"{path}: a Matrix Market pattern without numbers; write the matrix with its values"
        )
    size = [
        int(word)
        for word in next(line for line in lines if line.strip() and line[0] != "%").split()
    ]
    count = size[2] if len(size) > 2 else size[0] * size[1]
    if max(size[:2]) > nastran.SIDE or count > min(nastran.MOST, path.stat().st_size):
        raise PatchfemError(
            f"{path}: the header announces {count} numbers in {size[0]} x {size[1]}, more than the "
            "file can hold"
        )
    return Matrix(sparse.coo_array(mmread(path)))


def _abaqus(path: Path) -> Matrix:
    """Lines of row, column, number or of node, direction, node, direction, number; one triangle stands for both."""
    with open(path, encoding="latin-1") as file:
        lines = (line for line in file if line.strip() and line.lstrip()[0] not in "*%#")
        first = next(lines, "")
        rows = np.loadtxt(chain([first], lines), delimiter="," if "," in first else None, ndmin=2)
    if rows.shape[1] not in (3, 5) or not rows.size:
        raise PatchfemError(
            f"{path}: is not a matrix: write a Matrix Market file, or lines of row, column, number, or "
            "lines of node, direction, node, direction, number"
        )
    ends = rows[:, :-1].astype(int)
    if (ends != rows[:, :-1]).any():
        raise PatchfemError(f"{path}: rows, nodes and directions must be whole numbers")
    places = None
    if rows.shape[1] == 5:
        places, where = nastran.ranked(ends.reshape(-1, 2))
        i, j = where.reshape(-1, 2).T
    elif ends.min() < 1 or ends.max() > nastran.SIDE:
        raise PatchfemError(f"{path}: rows and columns count from 1 to {nastran.SIDE} at most")
    else:
        i, j = ends.T - 1
    n = max(i.max(), j.max()) + 1 if places is None else len(places)
    values = sparse.coo_array((rows[:, -1], (i, j)), (n, n)).tocsr()
    if (i <= j).all() or (i >= j).all():
        values = values + (values - sparse.diags_array(values.diagonal())).T
    return Matrix(values, places, False)


def _matlab(path: Path, wanted: str) -> Matrix:
    found = {
        name: one
        for name, one in matlab.read_variables(path, matlab.read_bytes(path)).items()
        if one.kind != "text"
    }
    one = found[_named(path, found, wanted)]
    return Matrix(sparse.csr_array(one.values() if one.sparse is None else one.sparse()))


def _numpy(path: Path, wanted: str) -> Matrix:
    if not zipfile.is_zipfile(path):
        raise PatchfemError(f"{path}: is not an archive of NumPy arrays")
    with np.load(path, allow_pickle=False) as file:
        if {"format", "shape", "data"} <= set(file.files):
            return Matrix(sparse.csr_array(sparse.load_npz(path)))
        return Matrix(sparse.csr_array(file[_named(path, file.files, wanted)]))


def _nastran(reader):
    def of_file(path: Path, wanted: str) -> Matrix:
        found = reader(path)
        one = found[_named(path, found, wanted)].cards()
        return Matrix(one.values, one.places, one.places is None)

    return of_file


READERS = {
    ".mtx": _market,
    ".mat": _matlab,
    ".npz": _numpy,
    ".op4": _nastran(nastran.output4),
    **dict.fromkeys((".pch", ".bdf", ".dat"), _nastran(nastran.punched)),
}


def align_rows(stiffness: Matrix, *others: Matrix) -> list:
    """The matrices over the same rows: of places where all tell theirs, in the order of these, else as they stand.

    PatchfemError where they differ in size or one tells no places.
    """
    every = [stiffness, *others]
    if all(one.places is not None for one in every):
        places = np.unique(np.vstack([one.places for one in every]), axis=0)
        return [Matrix(_spread(one, places), places) for one in every]
    if any(one.places is not None for one in every):
        raise PatchfemError(
            "some of the files name nodes and directions and others do not; export all files in the "
            "same way"
        )
    n = max(one.values.shape[0] for one in every)
    sizes = [one.values.shape[0] if one.sized else n for one in every]
    if len(set(sizes)) > 1:
        raise PatchfemError(
            "the matrices differ in size: "
            + " and ".join(f"{k} x {k}" for k in dict.fromkeys(sizes))
        )
    return [one._replace(values=_grown(one.values, n)) for one in every]


def _spread(one: Matrix, places):
    where = {tuple(place): k for k, place in enumerate(places)}
    index = np.array([where[tuple(place)] for place in one.places], int)
    found = one.values.tocoo()
    return sparse.coo_array(
        (found.data, (index[found.coords[0]], index[found.coords[1]])), 2 * (len(places),)
    ).tocsr()


def _grown(values, n: int):
    if values.shape[0] < n:
        values = values.copy()
        values.resize((n, n))
    return values
