"""BLAS and LAPACK of SciPy as functions alone: importing scipy.linalg takes fifteen times as long as loading these.

scipy.linalg brings up much of numpy and scipy that no run needs, 0.15-0.2 s of every command with a patch. The two
modules of compiled functions behind it stand beside it and need numpy alone, so they are loaded from their files; where
they cannot be, scipy.linalg is imported. `one_thread` holds both BLAS libraries to one thread.
"""

from functools import cache
from importlib import import_module
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from pathlib import Path

import numpy as np

__all__ = [
    "cho_factor",
    "cho_solve",
    "dgemm",
    "dpotrf",
    "dpotri",
    "dpotrs",
    "dtrsm",
    "dtrtri",
    "one_thread",
]


def _module(name: str):
    """The module scipy.linalg.`name` of compiled functions, loaded without its package where that is possible."""
    try:
        home = find_spec("scipy").submodule_search_locations[0]
        spec = PathFinder.find_spec(name, [str(Path(home) / "linalg")])
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        return module
    except (
        ImportError,
        AttributeError,
        OSError,
    ):  # no such file, or libraries that the package makes known first
        return import_module(f"scipy.linalg.{name}")


_LAPACK, _BLAS = _module("_flapack"), _module("_fblas")
dpotrf, dpotri, dpotrs, dtrtri = _LAPACK.dpotrf, _LAPACK.dpotri, _LAPACK.dpotrs, _LAPACK.dtrtri
dgemm, dtrsm = _BLAS.dgemm, _BLAS.dtrsm


def cho_factor(matrix) -> np.ndarray:
    """Lower Cholesky factor (n, n) of a symmetric matrix (n, n) for `cho_solve`; what is above it means nothing.

    LinAlgError unless it is positive definite.
    """
    low, info = dpotrf(np.asarray(matrix, float), lower=1, clean=0)
    if info != 0 or not np.isfinite(low[-1, -1]):
        raise np.linalg.LinAlgError("not positive definite")
    return low


def cho_solve(low, right) -> np.ndarray:
    """Solution of the symmetric system whose `cho_factor` is given, for right sides (n,) or (n, k)."""
    return dpotrs(low, right, lower=1)[0]


@cache
def _libraries():
    from threadpoolctl import ThreadpoolController

    # they are looked up once, so that an entry of `one_thread` costs 10 us
    return ThreadpoolController()


def one_thread():
    """Context in which numpy and scipy use a single BLAS thread; it may be entered again inside, at 10 us an entry."""
    return _libraries().limit(limits=1, user_api="blas")
