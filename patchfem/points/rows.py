"""Meaning of the columns of the arrays of many cases: laws, parameters and what is observed."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

# Change between two cycles relative to the range of the motion, below which it repeats, of exact steps
SAME_CASE_CYCLE = 1e-10
# The same of n steps per cycle of a smooth law, times n^3: it decreases nearly as fast as the error of the steps, which is
# of order 4 and a thousand times as large (2e-5 with 40 steps, 3e-9 here)
SAME_SMOOTH_CYCLE = 2e-2


class Law(IntEnum):
    """Number of a friction law; laws up to JENKINS are linear between events.

    - COULOMB: rigid friction
    - JENKINS: spring and slider in series
    - TANH: friction that follows the velocity, as its hyperbolic tangent
    - MASING: parallel sliders, see `Masing`
    - BOUC_WEN, LUGRE: laws of these names
    - BONDS: bonds of constant length that are summed by their moments
    """

    COULOMB = 0
    JENKINS = 1
    TANH = 2
    MASING = 3
    BOUC_WEN = 4
    LUGRE = 5
    BONDS = 6


class LawNumber(IntEnum):
    """Columns of the numbers of a law; LUGRE has those of `LuGreNumber` after the first.

    - LAW: the `Law`
    - LIMIT: friction limit [N], of COULOMB the static one
    - KINETIC: kinetic limit of COULOMB [N]
    - SPEED: reference speed of TANH [m/s]
    - LENGTH: length of JENKINS, BOUC_WEN and BONDS, and phi_max of MASING [m]
    - CHI, BETA: parameters of MASING
    - EXPONENT, SHAPE: parameters of BOUC_WEN
    """

    LAW = 0
    LIMIT = 1
    KINETIC = 2
    SPEED = 2
    LENGTH = 2
    CHI = 3
    BETA = 4
    EXPONENT = 3
    SHAPE = 4


class Memory(IntEnum):
    """First columns of the memory of smooth laws.

    - STRETCH: elastic part of the slide [m]
    - ENERGY: stored energy [J]
    - SQUARE: of bonds, mean squared stretch relative to the squared length
    """

    STRETCH = 0
    ENERGY = 1
    SQUARE = 2


class Masing(IntEnum):
    """Further columns of the memory of parallel sliders, which follow Masing's rules.

    - SLIDE, FORCE: displacement [m] and force [N]
    - DIRECTION: sign of the last motion
    - COUNT: number of reversals on the stack
    - VIRGIN: 1 until the sliders have slipped as a whole, then -1
    - STACK: first column of pairs of displacement [m] and force [N] at the reversals
    """

    SLIDE = 2
    FORCE = 3
    DIRECTION = 4
    COUNT = 5
    VIRGIN = 6
    STACK = 7


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


class Energy(IntEnum):
    """Columns of the energies (c, 6) of c cases since the start; per mass [J/kg] but for the last one.

    - WORK_IN: work of the drive
    - POWER: integral of its magnitude
    - VISCOUS: loss of the damper
    - FRICTION: friction work
    - STORED: largest kinetic and elastic energy so far
    - ELASTIC: elastic energy of the friction law at the end of the run [J]
    """

    WORK_IN = 0
    POWER = 1
    VISCOUS = 2
    FRICTION = 3
    STORED = 4
    ELASTIC = 5


class Seen(IntEnum):
    """Columns of what is observed (c, 19) in the window of c cases.

    Kernels get the row of one case.

    - MAX_ACCELERATION: largest magnitude of the acceleration of the output [m s-2]
    - MAX_FORCE: largest magnitude of the friction force [N]
    - MIN_SLIP, MAX_SLIP: smallest and largest irreversible slide [m]
    - STUCK: phase of the drive that passes during stick [rad]
    - STARTS: number of starts of slip
    - COS_START, SIN_START: sums of cosine and sine of twice the phases of the drive at these starts
    - SHARE: irreversible part of the motion at the end of the last piece
    - WORK: friction work [J]
    - SAMPLED: friction work by the trapezoidal rule over the pieces [J]
    - PASSED: sum over the pieces of the magnitude of the friction work [J]
    - START_SLIDE, START_VELOCITY: at the start of the window [m], [m/s]
    - END_SLIDE, END_VELOCITY, END_SLIP: slide, velocity and irreversible slide at the end of the run
    - SPAN: duration of the window [s]
    - REPEAT: change of the motion in a cycle, relative to its range, at which it counts as one that repeats; 0 if all
      cycles are computed
    """

    MAX_ACCELERATION = 0
    MAX_FORCE = 1
    MIN_SLIP = 2
    MAX_SLIP = 3
    STUCK = 4
    STARTS = 5
    COS_START = 6
    SIN_START = 7
    SHARE = 8
    WORK = 9
    SAMPLED = 10
    PASSED = 11
    START_SLIDE = 12
    START_VELOCITY = 13
    END_SLIDE = 14
    END_VELOCITY = 15
    END_SLIP = 16
    SPAN = 17
    REPEAT = 18


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


class PointLaw(NamedTuple):
    """Law of a point, or of c points: numbers (k,) or (c, k) by `LawNumber`, and memory (l,) or (c, l) by `Memory`."""

    numbers: np.ndarray
    memory: np.ndarray


class Record(NamedTuple):
    """Observed values of c cases, over the measured cycles and at their ends.

    - energies (c, 2, 6): see `Energy`; the second row of a case is that at the start of the last cycle
    - seen (c, 19): see `Seen`
    - harmonics (c, 2): integrals over the window of the slide times exp(-i w t) and exp(-3 i w t) [m s]
    - phasors (c, n): integral of the slide times exp(-i w t) over every cycle [m s]
    - loops (c, n, 5): all cycles, see `Loop`
    """

    energies: np.ndarray
    seen: np.ndarray
    harmonics: np.ndarray
    phasors: np.ndarray
    loops: np.ndarray


class Cases(NamedTuple):
    """Cases of one mode and one contact point under a sinusoidal drive.

    - parameters (c, 12): see `Number`
    - numbers (c, k): numbers of the friction law, see `LawNumber`
    - reference (c,): stiffness of the first mode at the contact [N/m], 0 if unknown
    """

    parameters: np.ndarray
    numbers: np.ndarray
    reference: np.ndarray
