"""Functions of `normal_kernels` for a march without a patch whose pressure changes with heave and pitch (compiled).

`find_motion_energy` and `find_holds` see to the modes; the others are not called.
"""

from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit
from .motion_kernels import find_modal_energy, solve_holds


@njit(**NJIT_CALL)
def find_resultant(system, forces):
    """Return -1, which stands for no contact set."""
    return -1.0


@njit(**NJIT_CALL)
def add_residuals(system):
    """Return 0 N, because no port of heave or pitch has a residual."""
    return 0.0


@njit(**NJIT_CALL)
def add_slopes(system, level):
    """Leave the Jacobian as it is."""


@njit(**NJIT_CALL)
def find_holds(system, state, drive):
    """Write the forces that hold ports at rest at an instant to `Port.HOLD` [N].

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march; `ports.newton.residual` has the forces of the points of each port.
    state : (2 n,) array
        Modal coordinates and velocities.
    drive : float
        Drive at this instant [m s-2].
    """
    solve_holds(system, state, drive)


@njit(**NJIT_CALL)
def find_motion_energy(system):
    """Return the energy of the modes [J]."""
    return find_modal_energy(system)


@njit(**NJIT_CALL)
def write_sample(system, sample):
    """Leave the sample as it is."""
