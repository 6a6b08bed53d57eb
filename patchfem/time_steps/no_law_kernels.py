"""Function of a law with a module of its own, for a march without one (compiled)."""

from ..compiled.flags_kernels import NJIT_CALL
from ..compiled.jit import njit


@njit(**NJIT_CALL)
def slide(numbers, memory, trial, values, count, step):
    """Leave the points as they are; the package describes the arguments (`time_steps`)."""
