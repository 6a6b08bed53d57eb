"""Meaning of the columns of the arrays of many cases."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

# Change between two cycles relative to the range of the motion, below which it repeats
SAME_CASE_CYCLE = 1e-8


class Number(IntEnum):
    """Columns of `Cases.parameters`.

    Of q'' + DAMPING q' + STIFFNESS q = DRIVE sin(OMEGA t) - MOBILITY F with the slide q [m] and the friction F [N];
    normal load [N]; output per slide, amplitude of the acceleration of the base [m s-2]; slide [m] and velocity [m/s]
    at the start; number of cycles, and of the last of them that are measured.
    """

    DAMPING = 0
    STIFFNESS = 1
    DRIVE = 2
    MOBILITY = 3
    OMEGA = 4
    LOAD = 5
    OUTPUT = 6
    BASE = 7
    SLIDE = 8
    VELOCITY = 9
    CYCLES = 10
    WINDOW = 11


class Now(IntEnum):
    """Columns of the state of a case.

    Slide, velocity, mean force of the last step, force, irreversible slide; extremes, cosine and sine integrals of the
    slide in the cycle; work of the drive, its magnitude, loss of the damper, friction work per mass, largest energy;
    fraction of the last step at which a rigid point stops, turns or is released, -1 without such an event; elastic energy
    of the law at the end; time mean of the force over the last step.
    """

    SLIDE = 0
    VELOCITY = 1
    MEAN = 2
    FORCE = 3
    SLIP = 4
    MIN = 5
    MAX = 6
    COS = 7
    SIN = 8
    WORK_IN = 9
    POWER = 10
    VISCOUS = 11
    FRICTION = 12
    STORED = 13
    EVENT = 14
    ELASTIC = 15
    TIME_MEAN = 16


class Seen(IntEnum):
    """Columns of what is observed in the window, per unit of the slide and of the force.

    Extremes of acceleration, force and slip; time stuck; number of slip starts with the sums of cosine and sine of
    twice their phases; middle of the last step and its excess of slip over half of the slide; integrals of slide and
    force times harmonic 1; friction work by mean forces, by the trapezoidal rule, and its magnitude; integral of the
    slide in the first and in the last cycle; sums of range and secant, number of secants; forces at the extremes of the
    cycle; slide and velocity at the start; duration; number of cycles; integrals of the force times harmonic 3.
    """

    MAX_ACCELERATION = 0
    MAX_FORCE = 1
    MIN_SLIP = 2
    MAX_SLIP = 3
    STUCK = 4
    STARTS = 5
    START_COS = 6
    START_SIN = 7
    MIDDLE = 8
    EXCESS = 9
    COS_1 = 10
    SIN_1 = 11
    FORCE_COS_1 = 12
    FORCE_SIN_1 = 13
    WORK = 14
    SAMPLED = 15
    PASSED = 16
    FIRST_MEAN = 17
    LAST_MEAN = 18
    RANGE = 19
    SECANT = 20
    N_SECANTS = 21
    FORCE_AT_MIN = 22
    FORCE_AT_MAX = 23
    START_SLIDE = 24
    START_VELOCITY = 25
    SPAN = 26
    N_CYCLES = 27
    FORCE_COS_3 = 28
    FORCE_SIN_3 = 29


class Cases(NamedTuple):
    """Cases of one mode and one contact point under a sinusoidal drive.

    - parameters (c, 12): see `Number`
    - numbers (k, c), memory (m, c): law and its state at the start, see `return_maps_kernels`
    - reference (c,): stiffness of the first mode at the contact [N/m], 0 if unknown
    """

    parameters: np.ndarray
    numbers: np.ndarray
    memory: np.ndarray
    reference: np.ndarray

    def select(self, cases) -> "Cases":
        """Return some of the cases, by a mask or by indices."""
        return Cases(
            self.parameters[cases],
            np.ascontiguousarray(self.numbers[:, cases]),
            np.ascontiguousarray(self.memory[:, cases]),
            self.reference[cases],
        )
