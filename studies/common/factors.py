"""Factors of a piece's stiffness by other libraries, which check the package's own fronts.

Every kind of factors has `solve(load (n, r)) -> (n, r)` and `compliance() -> (k, k)`, the last diagonal block of the
inverse. The fronts need nothing but LAPACK.
"""

import ctypes
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpotri, dtrtri
from scipy.sparse import csc_matrix, triu
from scipy.sparse.linalg import splu
from stiffness import stiffness_of

from patchfem.core import Missing, NotConverged
from patchfem.elasticity import fronts
from patchfem.elasticity.lapack import one_thread
from patchfem.elasticity.substructure import Substructure, elimination_order


def factorise(matrix: csc_matrix, firsts, name: str):
    """Factorise a symmetric positive definite stiffness in the order it comes, the interface its last front.

    firsts: (f + 1,) first node of every front, two unknowns a node; name: one of BACKENDS. Missing where its library
    cannot be used, NotConverged where the matrix is singular.
    """
    try:
        return BACKENDS[name](matrix, np.asarray(firsts))
    except (ImportError, OSError, AttributeError) as error:
        raise Missing(f"{name} cannot be used ({error}); {REMEDY.get(name, '')}") from None


def make_piece(mesh, layers, name: str) -> Substructure:
    """The piece of any mesh as a `Substructure`, with the factors of this name."""
    order, firsts = elimination_order(mesh)
    piece = Substructure(mesh, layers, {"order": order, "rounding": 0.0})
    with one_thread():
        piece.computed["factor"] = factorise(stiffness_of(piece), firsts, name)
    return piece


@dataclass(frozen=True, eq=False, slots=True)
class SuperLU:
    """Factors L U by SciPy's SuperLU without pivoting; the Schur complement is S = L_ss U_ss."""

    factor: object
    size: int

    def solve(self, load) -> np.ndarray:
        """Solution (n, r) of the stiffness equations for the loads (n, r)."""
        return self.factor.solve(np.ascontiguousarray(load, float))

    def compliance(self) -> np.ndarray:
        """Last diagonal block (k, k) of the inverse, that of the interface.

        Where SuperLU changed the order it takes a solve for each of the k unknowns.
        """
        n = self.factor.shape[0]
        k = self.size
        order = self.factor.perm_c
        if not (
            np.array_equal(order[n - k :], np.arange(n - k, n))
            and np.array_equal(self.factor.perm_r, order)
        ):
            return self.solve(np.eye(n, k, k - n))[n - k :]
        low = self.factor.L[n - k :, n - k :].toarray()
        inverse, _ = dtrtri(low, lower=1, unitdiag=1)
        return inverse.T @ (inverse / self.factor.U.diagonal()[n - k :, None])


def _superlu(matrix, firsts) -> SuperLU:
    try:
        factor = splu(
            matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError as error:
        raise NotConverged(f"the stiffness of the piece cannot be factorised ({error})") from None
    return SuperLU(factor, 2 * int(firsts[-1] - firsts[-2]))


@dataclass(frozen=True, eq=False, slots=True)
class Cholmod:
    """Factors L L^T by CHOLMOD in the given order; the compliance is C = L_ss^-T L_ss^-1."""

    factor: object
    size: int

    def solve(self, load) -> np.ndarray:
        """Solution (n, r) of the stiffness equations for the loads (n, r)."""
        return self.factor(np.asarray(load, float))

    def compliance(self) -> np.ndarray:
        """Last diagonal block (k, k) of the inverse, that of the interface; NotConverged where it is singular."""
        low = self.factor.L()
        n = low.shape[0]
        return _inverse(low[n - self.size :, n - self.size :].toarray())


def _cholmod(matrix, firsts) -> Cholmod:
    from sksparse.cholmod import CholmodNotPositiveDefiniteError, cholesky

    try:
        factor = cholesky(matrix, mode="supernodal", ordering_method="natural")
        return Cholmod(factor, 2 * int(firsts[-1] - firsts[-2]))
    except CholmodNotPositiveDefiniteError as error:
        raise NotConverged(
            f"the stiffness of the piece is not positive definite ({error})"
        ) from None


def _inverse(low) -> np.ndarray:
    both, fault = dpotri(low, lower=1)
    if fault:
        raise NotConverged("the stiffness of the piece is not positive definite")
    return np.tril(both) + np.tril(both, -1).T


class Pardiso:
    """Factors by MKL Pardiso with the Schur complement of the last unknowns; its memory is released with the object."""

    __slots__ = ("library", "matrix", "schur", "size")

    def __init__(self, matrix: csc_matrix, size: int):
        from pypardiso import PyPardisoSolver

        n = matrix.shape[0]
        self.library = PyPardisoSolver(mtype=2)
        self.size = size
        upper = triu(matrix, format="csr")
        self.matrix = (
            upper.data,
            (upper.indptr + 1).astype(np.int32),
            (upper.indices + 1).astype(np.int32),
        )
        # no default parameters, METIS, no scaling of a positive definite matrix, Schur complement with its factors kept
        for place, value in ((1, 1), (2, 2), (36, 2)):
            self.library.iparm[place - 1] = value
        self.library.perm = (np.arange(n) >= n - size).astype(np.int32)
        self.schur = np.zeros((size, size))
        self._call(12, np.zeros(n), self.schur)

    def _call(self, phase: int, load, out) -> None:
        data, pointer, indices = self.matrix
        number = [ctypes.byref(ctypes.c_int32(k)) for k in (1, 1, 2, phase, pointer.size - 1)]
        fault = ctypes.c_int32(0)
        real = ctypes.POINTER(ctypes.c_double)
        whole = ctypes.POINTER(ctypes.c_int32)
        columns = ctypes.byref(ctypes.c_int32(1 if load.ndim == 1 else load.shape[1]))
        self.library._mkl_pardiso(
            self.library.pt.ctypes.data_as(ctypes.POINTER(ctypes.c_int64)),
            *number,
            data.ctypes.data_as(real),
            pointer.ctypes.data_as(whole),
            indices.ctypes.data_as(whole),
            self.library.perm.ctypes.data_as(whole),
            columns,
            self.library.iparm.ctypes.data_as(whole),
            ctypes.byref(ctypes.c_int32(0)),
            load.ctypes.data_as(real),
            out.ctypes.data_as(real),
            ctypes.byref(fault),
        )
        if fault.value:
            raise NotConverged(
                f"the stiffness of the piece cannot be factorised (Pardiso error {fault.value})"
            )

    def solve(self, load) -> np.ndarray:
        """Solution (n, r) of the stiffness equations for the loads (n, r); NotConverged where the library fails."""
        load = np.asfortranarray(load, float)
        out = np.zeros_like(load, order="F")
        self._call(33, load, out)
        return np.ascontiguousarray(out)

    def compliance(self) -> np.ndarray:
        """Last diagonal block (k, k) of the inverse, that of the interface; NotConverged where it is singular."""
        try:
            return _inverse(np.linalg.cholesky(self.schur))
        except np.linalg.LinAlgError:
            raise NotConverged("the stiffness of the piece is not positive definite") from None

    def __del__(self):
        if getattr(self, "schur", None) is not None:
            self._call(-1, np.zeros(1), np.zeros(1))


def _pardiso(matrix, firsts) -> Pardiso:
    return Pardiso(matrix, 2 * int(firsts[-1] - firsts[-2]))


BACKENDS = {
    "fronts": fronts.factorise,
    "superlu": _superlu,
    "cholmod": _cholmod,
    "pardiso": _pardiso,
}
REMEDY = {
    "cholmod": "install libsuitesparse-dev, then scikit-sparse<0.5",
    "pardiso": "install pypardiso",
}
