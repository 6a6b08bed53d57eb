"""Meaning of the columns of the arrays of many cases."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

# Change between two cycles relative to the range of the motion, below which it repeats, of exact steps
SAME_CASE_CYCLE = 1e-10
# The same of n steps per cycle of a smooth law, times n^3: it decreases nearly as fast as the error of the steps, which is
# of order 4 and a thousand times as large (2e-5 with 40 steps, 3e-9 here)
SAME_SMOOTH_CYCLE = 2e-2
MAX_STEP_PHASE = 1.0  # largest phase of the vibration of a sticking point in an exact step [rad]
MAX_STEPS = 256  # largest number of exact steps per cycle
N_FINAL_WINDOWS = 5  # last windows from whose last cycles a steady amplitude is extrapolated
WINDOW_STEPS = 4.0  # exact steps of a measured cycle per step of another one


class Number(IntEnum):
    """Columns of `Cases.parameters`.

    Kernels get the row of one case. The slide q [m] obeys q'' + DAMPING q' + STIFFNESS q = DRIVE sin(OMEGA t) - MOBILITY
    F with the friction force F [N].

    - DAMPING: [1/s]
    - STIFFNESS: squared circular frequency [1/s2]
    - DRIVE: amplitude of the drive [m s-2]
    - MOBILITY: acceleration of the slide per friction force [1/kg]
    - OMEGA: circular frequency of the drive [rad/s]
    - LOAD: normal load [N]
    - OUTPUT: displacement of the output per slide [1]
    - BASE: amplitude of the acceleration of the base [m s-2]
    - SLIDE, VELOCITY: at the start [m], [m/s]
    - CYCLES: number of cycles
    - WINDOW: number of the last cycles, which are measured
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
    """Columns of the state (c, 18) of c cases.

    Kernels get the row of one case.

    - SLIDE, VELOCITY: at the end of the last piece [m], [m/s]
    - FORCE: friction force [N] there
    - SLIP: irreversible slide [m]
    - DIRECTION: direction of slip of a point that is linear between events, 0 during stick
    - SINE, COSINE: of the phase of the drive
    - TANGENT: change of the force of a smooth law per slide in the last step [N/m]
    - MIN, MAX: smallest and largest slide in the cycle [m]
    - COS, SIN: integrals of the slide times cos(OMEGA t) and sin(OMEGA t) over the cycle [m s]
    - WORK_IN: work of the drive per mass since the start [J/kg]
    - POWER: integral of its magnitude [J/kg]
    - VISCOUS: loss of the damper per mass [J/kg]
    - FRICTION: friction work per mass [J/kg]
    - STORED: largest kinetic and elastic energy per mass so far [J/kg]
    - ELASTIC: elastic energy of the friction law at the end of the run [J]
    """

    SLIDE = 0
    VELOCITY = 1
    FORCE = 2
    SLIP = 3
    DIRECTION = 4
    SINE = 5
    COSINE = 6
    TANGENT = 7
    MIN = 8
    MAX = 9
    COS = 10
    SIN = 11
    WORK_IN = 12
    POWER = 13
    VISCOUS = 14
    FRICTION = 15
    STORED = 16
    ELASTIC = 17


class Seen(IntEnum):
    """Columns of what is observed (c, 20) in the window of c cases.

    Kernels get the row of one case.

    - MAX_ACCELERATION: largest magnitude of the acceleration of the output [m s-2]
    - MAX_FORCE: largest magnitude of the friction force [N]
    - MIN_SLIP, MAX_SLIP: smallest and largest irreversible slide [m]
    - STUCK: phase of the drive that passes during stick [rad]
    - STARTS: number of starts of slip
    - SLIP_START_PHASE_COS, SLIP_START_PHASE_SIN: sums of cosine and sine of twice the phases of the drive at these starts
    - SHARE: irreversible part of the motion at the end of the last piece
    - COS_1, SIN_1: integrals of the slide times cos(OMEGA t) and sin(OMEGA t) [m s]
    - COS_3, SIN_3: the same with 3 OMEGA
    - WORK: friction work by the mean forces of the pieces [J]
    - SAMPLED: friction work by the trapezoidal rule [J]
    - PASSED: sum over the pieces of the magnitude of the friction work [J]
    - START_SLIDE, START_VELOCITY: at the start of the window [m], [m/s]
    - SPAN: duration [s]
    - SLIDE: integral of the slide over the present cycle [m s]
    """

    MAX_ACCELERATION = 0
    MAX_FORCE = 1
    MIN_SLIP = 2
    MAX_SLIP = 3
    STUCK = 4
    STARTS = 5
    SLIP_START_PHASE_COS = 6
    SLIP_START_PHASE_SIN = 7
    SHARE = 8
    COS_1 = 9
    SIN_1 = 10
    COS_3 = 11
    SIN_3 = 12
    WORK = 13
    SAMPLED = 14
    PASSED = 15
    START_SLIDE = 16
    START_VELOCITY = 17
    SPAN = 18
    SLIDE = 19


class Loop(IntEnum):
    """Columns of the last cycles (c, w, 5) of c cases, as in `motion_measures.Observations`.

    Kernels get the row of one cycle. A cycle that is not measured has NaN.

    - SLIDE: integral of the slide over the cycle [m s]
    - MIN_SLIDE, FORCE_AT_MIN: smallest slide [m], and the friction force there [N], NaN if it is unknown
    - MAX_SLIDE, FORCE_AT_MAX: the same of the largest slide
    """

    SLIDE = 0
    MIN_SLIDE = 1
    FORCE_AT_MIN = 2
    MAX_SLIDE = 3
    FORCE_AT_MAX = 4


class Cases(NamedTuple):
    """Cases of one mode and one contact point under a sinusoidal drive.

    - parameters (c, 12): see `Number`
    - numbers (c, k): numbers of the friction law, see `law_rows.LawNumber`
    - reference (c,): stiffness of the first mode at the contact [N/m], 0 if unknown
    """

    parameters: np.ndarray
    numbers: np.ndarray
    reference: np.ndarray
