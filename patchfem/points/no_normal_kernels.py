"""Functions of `normal_kernels` for a march without a patch whose pressure changes, which calls none of them (compiled)."""

from ..compiled.flags_kernels import NJIT_CALL
from ..compiled.jit import njit


@njit(**NJIT_CALL)
def find_set(sets, slot, approach, rotation):
    """Return no slot."""
    return -1


@njit(**NJIT_CALL)
def press_state(sets, slot, approach, rotation, forces):
    """Write nothing."""


@njit(**NJIT_CALL)
def compute_energy(sets, slot, heave, rotation):
    """Return no energy and its derivatives."""
    return 0.0, 0.0, 0.0


@njit(**NJIT_CALL)
def path_mean(sets, slot, heave, rotation, change, turn, out):
    """Write nothing."""
