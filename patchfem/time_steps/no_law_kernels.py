"""Function of a law with a module of its own, for a march without one (compiled)."""

from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit


@njit(**NJIT_CALL)
def slide(numbers, memory, trial, values, count, step):
    """Leave a block of points as it is.

    Parameters
    ----------
    numbers, memory, trial, values : (k,) array
        Rows of the block.
    count : int
        Number of points.
    step : Step
        Duration and formula of the velocity.
    """
