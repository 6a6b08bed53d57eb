"""Arrays for the compiled Runge-Kutta steps, and the names of their indices."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np


class Mode(IntEnum):
    """Row indices of `MotionArrays.modes`: frequency [rad/s], damping [1/s], participations."""

    OMEGA = 0
    DAMPING = 1
    SLIDE = 2
    BASE = 3
    OUTPUT = 4


class Work(IntEnum):
    """Row indices of `MotionArrays.work`; they follow the slopes at the 16 Runge-Kutta stages.

    - EXTENSION: first of 8 rows, the extension of the step
    - SIZES: sizes of the states of the law, and smallest sizes of the others
    - TRIAL: state after a step
    """

    EXTENSION = 16
    SIZES = 24
    TRIAL = 25


class Scalar(IntEnum):
    """Indices into `MotionArrays.scalars`, the scalar state of a motion.

    - TIME, STEP, FIRST_STEP: time, length of the next step and of the first one after a reversal
      [s]
    - ORIGIN, START_LOSS: relative displacement [m] and friction loss [J] at the start of the motion
      in this direction
    - MAX_COORDINATE, MAX_RATE: recent maximum of coordinates [m] and rates [m/s]
    - FASTEST_RATE: rate of the fastest mode or of the drive [1/s]
    - STAGE: 0 before the start, 1 after it, 2 if the motion was left at a reversal
    - SLOPE_SEGMENT: segment of the drive to which the first slopes belong
    - MASS, STIFFNESS: modal mass [kg], and stiffness of the law [N/m]
    - PERIOD: of the drive [s]
    - SEGMENT: of the drive
    - BASE_MOVES: 1 if the drive moves the base
    """

    TIME = 0
    STEP = 1
    FIRST_STEP = 2
    ORIGIN = 3
    START_LOSS = 4
    MAX_COORDINATE = 5
    MAX_RATE = 6
    FASTEST_RATE = 7
    STAGE = 8
    SLOPE_SEGMENT = 9
    MASS = 10
    PERIOD = 11
    SEGMENT = 12
    BASE_MOVES = 13
    STIFFNESS = 14


class Counter(IntEnum):
    """Indices into `MotionRecord.counters`: energies, counts and numbers of the next rows.

    - DRIVE_POWER: integral of the magnitude of the power of the drive [J]
    - MAX_STORED: largest stored energy [J]
    - FRICTION_LOSS: energy dissipated by friction [J]
    - ACCEPTED, REFUSED: steps
    - N_TURNS, N_PARTS: rows of turns and parts that are filled
    - NEXT_SAMPLE: number of the next sample
    - PERIOD: of the drive [s]
    - MAX_FORCE: largest force in the parts [N]
    """

    DRIVE_POWER = 0
    MAX_STORED = 1
    FRICTION_LOSS = 2
    ACCEPTED = 3
    REFUSED = 4
    N_TURNS = 5
    NEXT_SAMPLE = 6
    N_PARTS = 7
    PERIOD = 8
    MAX_FORCE = 9


class Turn(IntEnum):
    """Indices into `MotionArrays.turn`, which the integrator and the friction law share.

    - DIRECTION: of the motion, 0 in stick
    - KINK_PATH: path to the next kink of the law [m], infinite if there is none
    - IS_ABOVE_KNEE, KNEE_VELOCITY: whether the speed is above that of a kink, and that speed [m/s],
      0 if there is none
    - FREE_ACCELERATION, INVERSE_MASS, SLIDE: for a law that holds, the acceleration [m s-2] without
      its force, the acceleration per newton [1/kg] that its force takes away, and the relative
      displacement [m]
    - FORCE, NORMAL_FORCE, RELEASE_DIRECTION: results of a law that holds, [N], [N], and the
      direction of its release, 0 while it sticks
    """

    DIRECTION = 0
    KINK_PATH = 1
    IS_ABOVE_KNEE = 2
    FREE_ACCELERATION = 3
    INVERSE_MASS = 4
    SLIDE = 5
    FORCE = 6
    NORMAL_FORCE = 7
    KNEE_VELOCITY = 8
    RELEASE_DIRECTION = 9


class StepEvents(NamedTuple):
    """Codes of the events that end a Runge-Kutta step.

    - stop: the velocity vanishes
    - kink, knee: the law has a kink along its path, or at a speed
    - travel: the output reaches its travel
    - release, lift: release of a sticking law, or loss of its normal force
    """

    none: int = 0
    stop: int = 1
    kink: int = 2
    knee: int = 3
    travel: int = 4
    release: int = 5
    lift: int = 6


class CallStatus(NamedTuple):
    """Codes that state why a call of the step loop has ended.

    - finished: the time is reached
    - travel: the output has reached its travel
    - full: the rows for reversals or parts are used up; the next call goes on
    - not_finite: the state is not finite
    - no_step: no step, however short, meets the tolerance
    - paused: MAX_TRIED_STEPS steps were tried; the next call goes on
    - lifted: the normal force of a law that holds has vanished
    """

    finished: int = 0
    travel: int = 1
    full: int = 2
    not_finite: int = 3
    no_step: int = 4
    paused: int = 5
    lifted: int = 6


EVENT = StepEvents()
STATUS = CallStatus()
# Number of points of a part of a step at which its samples are taken.
N_NODES = 9
# Positions of these points as fractions of the part; they are Chebyshev points of the second kind.
NODE_FRACTIONS = (1 - np.cos(np.pi * np.arange(N_NODES) / (N_NODES - 1))) / 2


class MotionArrays(NamedTuple):
    """Modes, drive signal, friction law and state of a motion as arrays.

    The state has N = 2 n + l + 3 entries for n modes and l states of the law.

    - modes: (5, n) see `Mode`
    - damping: (n, n) damping matrix if it couples the modes, else (0, 0)
    - segments: (p, 12) segments of the drive, see `events.positions_kernels.Segment`
    - numbers, memory: numbers of the law (1, k), its memory and a copy to work with (2, m)
    - turn: (10,) see `Turn`
    - state: (N,) coordinates [m], rates [m/s], states of the law, then work of the drive, viscous
      loss and friction work [J]
    - work: (26, N) slopes of the 16 stages, then see `Work`
    - scalars: (15,) see `Scalar`
    """

    modes: np.ndarray
    damping: np.ndarray
    segments: np.ndarray
    numbers: np.ndarray
    memory: np.ndarray
    turn: np.ndarray
    state: np.ndarray
    work: np.ndarray
    scalars: np.ndarray


class MotionRecord(NamedTuple):
    """Samples, extremes, phasors and counters recorded during a motion.

    A sample (2 n + 7,) has the time, coordinates, rates, relative displacement and velocity, force,
    slip, energy in the interface and friction work [J].

    - cycles: (4, c) smallest and largest output of every cycle, and real and imaginary part of the
      output at the frequency of the cycle [m], NaN if it is not wanted
    - samples: (s, 2 n + 7) at the times in their first column
    - turns: (r, 2 n + 7) at reversals
    - parts: (k, N_NODES, 2 n + 7) at NODE_FRACTIONS of the parts of steps
    - counters: (10,) see `Counter`
    - workspace: (N,)
    """

    cycles: np.ndarray
    samples: np.ndarray
    turns: np.ndarray
    parts: np.ndarray
    counters: np.ndarray
    workspace: np.ndarray
