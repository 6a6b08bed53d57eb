"""Functions of `lists_kernels` for a march without lists of bonds, which calls none of them (compiled)."""

from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit


@njit(**NJIT_CALL)
def slide_lists(lists, numbers, values, count, step):
    """Leave the values of the points, the arguments of `lists_kernels.slide_lists`, as they are."""


@njit(**NJIT_CALL)
def advance_lists(lists, numbers, values, count, duration):
    """Leave the lists and the values of the points, the arguments of `lists_kernels.advance_lists`, as they are."""
