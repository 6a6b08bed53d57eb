"""Functions of BLAS and LAPACK from SciPy, loaded without the import of scipy.linalg.

Importing scipy.linalg loads much of NumPy and SciPy that no run needs and takes 0.15 to 0.2 s, 15
times as long as its two compiled modules. These need NumPy alone, so they are loaded from their
files. Where that fails, scipy.linalg is imported.
"""

from functools import cache
from importlib import import_module
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from pathlib import Path

import numpy as np

__all__ = [
    "cho_factor",
    "cho_inverse",
    "cho_solve",
    "dgemm",
    "dpotrf",
    "dpotrs",
    "dtrsm",
    "dtrtri",
    "use_one_blas_thread",
]


def _load_compiled(name: str):
    """Load the compiled module `name` of scipy.linalg, if possible without its package.

    The import of the package itself takes longer than a small run.
    """
    try:
        scipy_folder = find_spec("scipy").submodule_search_locations[0]
        spec = PathFinder.find_spec(name, [str(Path(scipy_folder) / "linalg")])
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        return module
    # The file may be missing, or the package may have to find its shared libraries first.
    except (ImportError, AttributeError, OSError):
        return import_module(f"scipy.linalg.{name}")


_LAPACK = _load_compiled("_flapack")
_BLAS = _load_compiled("_fblas")
dpotrf = _LAPACK.dpotrf
dpotrs = _LAPACK.dpotrs
dtrtri = _LAPACK.dtrtri
dgemm = _BLAS.dgemm
dtrsm = _BLAS.dtrsm


def cho_factor(matrix) -> np.ndarray:
    """Return the lower Cholesky factor (n, n) of a symmetric matrix; its upper half is undefined.

    Raises
    ------
    LinAlgError
        If the matrix is not positive definite.
    """
    lower_factor, info = dpotrf(np.asarray(matrix, float), lower=1, clean=0)
    if info != 0 or not np.isfinite(lower_factor[-1, -1]):
        raise np.linalg.LinAlgError("not positive definite")
    return lower_factor


def cho_solve(lower_factor, right_sides) -> np.ndarray:
    """Solve a symmetric system for right-hand sides (n,) or (n, k), with the result of `cho_factor`."""
    return dpotrs(lower_factor, right_sides, lower=1)[0]


def cho_inverse(lower_factor) -> np.ndarray:
    """Return the inverse (n, n) of a symmetric matrix from its Cholesky factor, the result of `cho_factor`."""
    lower_half, _ = _LAPACK.dpotri(np.asfortranarray(lower_factor), lower=1)
    return np.tril(lower_half) + np.tril(lower_half, -1).T


@cache
def _thread_pools():
    """Return the controller of the thread pools of the BLAS libraries, found on first use."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def use_one_blas_thread():
    """Return a context in which BLAS uses a single thread."""
    return _thread_pools().limit(limits=1, user_api="blas")
