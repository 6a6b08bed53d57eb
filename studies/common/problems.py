"""The two problems with exact answers: stick-slip at resonance and the two masses of Fig 16."""

import numpy as np

from patchfem.core import ModalBasis, SineDrive, frozen_array
from patchfem.event_driven import cases, drives, runs
from patchfem.event_driven.records import LawNumbers


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


def run_motion(
    modes, drive, laws, cycles: float, times=(), start=None, window: int = 1, rtol=cases.EXACT_RTOL
):
    """Integrate modes from event to event, by default with the smallest step tolerance.

    Parameters
    ----------
    modes : ModalBasis
    drive : drive
    laws : sequence of LawNumbers
        Law of each interface under a load of 1 N.
    cycles : float
    times : (k,) array_like
        Times [s] at which the motion is stored.
    start : InitialState, optional
    window : int
        Cycles at the end whose measures are recorded.
    rtol : float
        Tolerance of a step.

    Returns
    -------
    event_driven.runs.Motion
    """
    signal = drives.make_signal(drive)
    interfaces = [
        cases.Interface(law, cases.Load(1.0), row) for law, row in zip(laws, modes.interfaces)
    ]
    sizes = cases.find_sizes(modes, signal, drive, start)
    options = cases.Options(drive.moving, rtol=rtol)
    rig = cases.make_rig(modes, signal, interfaces, sizes, options)
    case = cases.Case(
        rig,
        cases.make_start(rig, interfaces, start),
        *cases.make_schedule(cycles, signal.period, window),
        np.asarray(times, float),
        len(interfaces),
    )
    return runs.run_case(case)


def make_coulomb(static: float, kinetic: float | None = None) -> LawNumbers:
    """Return Coulomb's law of an interface under a load of 1 N, from its friction limits [N]."""
    return LawNumbers("coulomb", (float(static), float(static if kinetic is None else kinetic)))


def sample_motion(modes, drive, law, cycles: float, times, start=None, **options):
    """Integrate modes with one interface and return the response at given times.

    Parameters
    ----------
    modes : ModalBasis
    drive : drive
    law : LawNumbers
        Law of the interface under a load of 1 N.
    cycles : float
    times : (k,) array
        [s]
    start : InitialState, optional
    **options
        Those of `run_motion`.
    """
    motion = run_motion(modes, drive, [law], cycles, np.unique(times), start, **options)
    response = motion.make_response(modes, drive)
    return response.select(np.searchsorted(response.time, np.asarray(times, float)))


def exact(name: str, times):
    """Return the exact Response of the problem "sdof" or "two", which starts from rest, at `times` (k,)."""
    modes, drive, limit = {
        "sdof": (SDOF, SDOF_DRIVE, SDOF_LIMIT),
        "two": (TWO, TWO_DRIVE, TWO_LIMIT),
    }[name]
    return sample_motion(
        modes, drive, make_coulomb(limit), float(np.ceil(times[-1])) / drive.period, times
    )
