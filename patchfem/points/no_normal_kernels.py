"""Functions of `normal_kernels` for a march without a patch whose pressure changes, which calls none of them (compiled)."""

from ..compiled.flags_kernels import NJIT_CALL
from ..compiled.jit import njit


@njit(**NJIT_CALL)
def find_set(sets, slot, approach, rotation):
    """Return -1, the slot number that stands for no contact set.

    The arguments are those of `press_kernels.find_set`, and are not used.
    """
    return -1


@njit(**NJIT_CALL)
def press_state(sets, slot, approach, rotation, forces):
    """Leave the forces as they are, because the march has no contact sets.

    The arguments are those of `press_kernels.press_state`, and are not used.
    """


@njit(**NJIT_CALL)
def compute_energy(sets, slot, heave, rotation):
    """Return zeros for the energy of the contact and its derivatives by heave and rotation.

    The arguments are those of `press_kernels.compute_energy`, and are not used.
    """
    return 0.0, 0.0, 0.0


@njit(**NJIT_CALL)
def path_mean(sets, slot, heave, rotation, change, turn, out):
    """Leave `out` as it is, because the march has no contact sets.

    The arguments are those of `press_path_kernels.path_mean`, and are not used.
    """
