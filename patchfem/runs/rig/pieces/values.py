"""Measures of runs from yield to yield, off what their last cycles show: of one run or of many at once."""

import numpy as np

from ....dynamics.events import names_kernels as at
from ....dynamics.events.reading import Reading
from ....dynamics.work_check import gap
from ....response.loops import interface_loops
from ....response.measures import REST
from ....response.rows import stuck_share
from ....response.spectrum import distorted


def read_off(reading: Reading, book: dict, sine: bool, whole: bool, stiffness, size) -> dict:
    """Measures of the first interface and of the motion by name, numbers or (n,) of n runs, NaN where a run has none.

    book: energies of the run [J]; sine: the drive ends as one; whole: the cycles that were read are whole ones;
    stiffness [N/m]: of the first mode as the contact meets it, 0 where no damping ratio refers to it; size [m s-2]: of
    the drive.
    """
    none, (first, third) = np.full(np.shape(reading.swing), np.nan)[()], reading.waves
    out = {"relative_displacement_amplitude": reading.swing, "absolute_acceleration_peak": reading.acceleration,
           "absolute_acceleration_fundamental": first if sine and whole else none,
           "acceleration_distortion": distorted(first, third, size) if sine and whole else none,
           "drift_per_cycle": reading.drift, "slip_start_phase": reading.start if sine else none,
           "work_check": _work_check(reading, book)}
    one = reading.loop()
    out |= {"slip_amplitude": one.slip / 2, "friction_force_peak": one.force,
            "stick_fraction": stuck_share(one.stuck, reading.span)}
    return out | (_loop(reading, sine, stiffness) if whole else {})


def _loop(reading: Reading, sine: bool, stiffness) -> dict:
    """Measures of the loop of the first interface."""
    one = reading.loop()
    moves = (reading.of(at.HIGH) - reading.of(at.LOW) > REST) & sine
    half = np.where(moves, reading.of(at.RANGE) / 2, 0.0)[()]
    work = one.work * reading.period / reading.span
    secant = np.where(moves, reading.of(at.SECANT), np.nan)[()]
    return interface_loops(half, one.first, one.pull, work, stiffness) | {"secant_stiffness": secant}


def _work_check(reading: Reading, book: dict):
    """Gap [1] of the friction work of the cycles that were read: by the trapezoidal rule on the ends of the pieces
    against the ledger's."""
    turned, booked, passed = (reading.faces[..., place].sum(axis=-1) for place in (at.TURNED, at.WORK, at.PASSED))
    return gap(turned, booked, passed, book["power"] + book["peak_stored"])
