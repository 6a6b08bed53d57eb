"""The two problems with exact answers: stick-slip at resonance and the two masses of Fig 16."""

import numpy as np

from patchfem.core import ModalBasis, SineDrive, frozen_array
from patchfem.dynamics import make_coulomb_elements
from patchfem.dynamics.events.histories import evaluate_motion


def basis(omega, zeta, slide, base) -> ModalBasis:
    """Return modes of unit mass with one interface.

    Parameters
    ----------
    omega, zeta, slide, base : sequence of float
        Of each mode; omega in rad/s.
    """
    omega = frozen_array(omega)
    slide = frozen_array(slide)
    return ModalBasis(
        tuple(f"mode {i + 1}" for i in range(omega.size)),
        omega,
        frozen_array(zeta),
        slide,
        frozen_array(base),
        slide,
        1.0,
    )


HALF = np.sqrt(0.5)
# block on a spring with m = k = 1, damping ratio 0.003 and base acceleration sin t
SDOF = basis([1.0], [0.003], [1.0], [1.0])
SDOF_DRIVE = SineDrive(1.0, 1.0)
SDOF_LIMIT = 0.8  # friction limit [N]
# block on a spring with m = k = 1 without damping
UNDAMPED_MASS = basis([1.0], [0.0], [1.0], [1.0])
# two free masses and a spring, m = k = 1, the force sin 1.14 t on the first, friction under the second; the coordinates
# are those of the motion together and of the relative motion
TWO = basis([0.0, np.sqrt(2.0)], [0.0, 0.0], [HALF, -HALF], [-HALF, -HALF])
TWO_DRIVE = SineDrive(1.0, 1.14, False)
TWO_LIMIT = 3.0  # friction limit [N]


def sample_motion(modes, drive, limit, cycles: float, times, start=None):
    """Integrate modes by the event engine and return the response at given times.

    Parameters
    ----------
    modes : ModalBasis
    drive : drive
    limit : float
        Friction limit [N].
    cycles : float
    times : (k,) array
        [s]
    start : InitialState, optional
    """
    return evaluate_motion(
        modes, drive, [make_coulomb_elements(limit, limit)], cycles, times, start
    )


def exact(name: str, times):
    """Return the exact Response of the problem "sdof" or "two", which starts from rest, at `times` (k,)."""
    modes, drive, limit = {
        "sdof": (SDOF, SDOF_DRIVE, SDOF_LIMIT),
        "two": (TWO, TWO_DRIVE, TWO_LIMIT),
    }[name]
    return sample_motion(modes, drive, limit, float(np.ceil(times[-1])) / drive.period, times)
