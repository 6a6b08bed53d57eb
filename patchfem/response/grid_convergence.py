"""Errors from runs on ever coarser meshes: the grid convergence index.

A mesh whose cells are twice as long changes a value by 2^p - 1 times its error, where p is the
order of the error. So the error is SAFETY times the change over 2^p - 1 (Roache, J. Fluids Eng.
116, 405, 1994). Three meshes show p where the value changes monotonically. Otherwise the first
order is taken, as for two meshes.
"""

from itertools import pairwise
from math import log2

from .errors import signed

SAFETY = 3.0  # Roache's factor; it covers that the meshes may be too coarse to show the order
MIN_ORDER, MAX_ORDER = 1.0, 2.0  # orders that are believed
MAX_FALL = 6.0  # ratio of two changes; above it, 2^2.6, the last change is small by chance


def convergence_error(last: float, before: float | None = None) -> float:
    """Return the error of a value from its changes when the cells were halved.

    Parameters
    ----------
    last : float
        Change from the second finest mesh to the finest.
    before : float or None
        Change from the third finest mesh to the second finest.
    """
    if before is None:
        return SAFETY * abs(last) / (2**MIN_ORDER - 1)
    order = MIN_ORDER
    if last and 1 < before / last <= MAX_FALL:
        order = min(max(log2(before / last), MIN_ORDER), MAX_ORDER)
    return SAFETY * max(abs(last), abs(before) / 2**MAX_ORDER) / (2**order - 1)


def convergence_errors(*values: dict) -> dict:
    """Return the error of each measure from its values on nested meshes.

    A further mesh does not widen an error whose interval holds its value, and narrows it by no
    more than the highest order does.

    Parameters
    ----------
    values : dict
        Measures by name on each mesh, fine to coarse; two meshes or more.
    """
    changes = [signed(fine, coarse) for fine, coarse in pairwise(values)]
    return {name: _ladder_error([gaps[name] for gaps in changes if name in gaps])
            for name in changes[0]}


def _ladder_error(changes: list) -> float:
    """Error on the finest mesh from the changes of a value, fine to coarse."""
    if len(changes) == 1:
        return convergence_error(changes[0])
    error = convergence_error(*changes[-2:])
    for last, before in reversed(list(pairwise(changes[:-1]))):
        found = convergence_error(last, before)
        holds = abs(last) <= error
        error = max(min(found, error) if holds else found, error / 2**MAX_ORDER)
    return error
