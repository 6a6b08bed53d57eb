"""Functions of `normal_kernels` for a march without a patch whose pressure changes, which calls none of them (compiled)."""

from ..compiled.flags_kernels import NJIT_CALL
from ..compiled.jit import njit


@njit(**NJIT_CALL)
def find_set(sets, slot, approach, rotation):
    """Return -1, the slot of no contact set.

    sets, slot: contact sets and the slot of the present one; approach, rotation: position [m], [rad]. All are unused.
    """
    return -1


@njit(**NJIT_CALL)
def press_state(sets, slot, approach, rotation, forces):
    """Leave the forces as they are, because the march has no contact sets.

    sets, slot, approach, rotation, forces: as `press_kernels.press_state` takes them; all unused.
    """


@njit(**NJIT_CALL)
def compute_energy(sets, slot, heave, rotation):
    """Return zeros for the energy of the contact and its derivatives by heave and rotation.

    sets, slot, heave, rotation: as `press_kernels.compute_energy` takes them; all unused.
    """
    return 0.0, 0.0, 0.0


@njit(**NJIT_CALL)
def path_mean(sets, slot, heave, rotation, change, turn, out):
    """Leave `out` as it is, because the march has no contact sets.

    sets, slot, heave, rotation, change, turn, out: as `press_path_kernels.path_mean` takes them; all unused.
    """
