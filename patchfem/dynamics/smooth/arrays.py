"""Arrays of the compiled steps, and named positions in them."""

from typing import NamedTuple

import numpy as np


class ModeRows(NamedTuple):
    """Rows of `MotionArrays.modes`: omega [rad/s], 2 zeta omega [1/s], participations [1]."""

    omega: int = 0
    damping: int = 1
    slide: int = 2
    base: int = 3
    output: int = 4


class WorkRows(NamedTuple):
    """Rows of `MotionArrays.work` after the slopes of the 16 stages.

    - extension: first of 8 rows, the extension of the step
    - sizes: sizes of the states of the law, and smallest sizes of the others
    - trial: state after a step
    """

    extension: int = 16
    sizes: int = 24
    trial: int = 25


class ScalarPositions(NamedTuple):
    """Positions in `MotionArrays.scalars`.

    - time, step, first_step: time, length of the next step and of the first one after a reversal
    [s]
    - origin, start_loss: relative displacement [m] and friction loss [J] at the start of the motion
    in this direction
    - max_coordinate, max_rate: recent maximum of coordinates [m] and rates [m/s]
    - fastest_rate: rate of the fastest mode or of the drive [1/s]
    - stage: 0 before the start, 1 after it, 2 where the motion was left at a reversal
    - slope_segment: segment of the drive to which the first slopes belong
    - mass, stiffness: modal mass [kg], and stiffness of the law [N/m]
    - period: of the drive [s]
    - segment: of the drive
    - base_moves: 1 where the drive moves the base
    """

    time: int = 0
    step: int = 1
    first_step: int = 2
    origin: int = 3
    start_loss: int = 4
    max_coordinate: int = 5
    max_rate: int = 6
    fastest_rate: int = 7
    stage: int = 8
    slope_segment: int = 9
    mass: int = 10
    period: int = 11
    segment: int = 12
    base_moves: int = 13
    stiffness: int = 14


class CounterPositions(NamedTuple):
    """Positions in `MotionRecord.counters`.

    - drive_power: integral of the magnitude of the power of the drive [J]
    - max_stored: largest stored energy [J]
    - friction_loss: energy dissipated by friction [J]
    - accepted, refused: steps
    - n_turns, n_parts: rows of turns and parts that are filled
    - next_sample: number of the next sample
    - period: of the drive [s]
    - max_force: largest force in the parts [N]
    """

    drive_power: int = 0
    max_stored: int = 1
    friction_loss: int = 2
    accepted: int = 3
    refused: int = 4
    n_turns: int = 5
    next_sample: int = 6
    n_parts: int = 7
    period: int = 8
    max_force: int = 9


class TurnPositions(NamedTuple):
    """Positions in `MotionArrays.turn`, which the integrator and the law share.

    - direction: of the motion, 0 in stick
    - kink_path: path to the next kink of the law [m], infinite without one
    - is_above_knee, knee_velocity: whether the speed is above that of a kink, and that speed [m/s],
    0 without one
    - free_acceleration, inverse_mass, slide: for a law that holds, the acceleration [m s-2] without
    its force, the
      acceleration per newton [1/kg] that its force takes away, and the relative displacement [m]
    - force, normal_force, release_direction: results of a law that holds, [N], [N], and the
    direction in which it
      lets go, 0 where it holds
    """

    direction: int = 0
    kink_path: int = 1
    is_above_knee: int = 2
    free_acceleration: int = 3
    inverse_mass: int = 4
    slide: int = 5
    force: int = 6
    normal_force: int = 7
    knee_velocity: int = 8
    release_direction: int = 9


class StepEvents(NamedTuple):
    """Events that end a step.

    - stop: the velocity vanishes
    - kink, knee: the law has a kink along its path, or at a speed
    - travel: the output reaches its travel
    - release, lift: a law that holds lets go, or loses its normal force
    """

    none: int = 0
    stop: int = 1
    kink: int = 2
    knee: int = 3
    travel: int = 4
    release: int = 5
    lift: int = 6


class CallStatus(NamedTuple):
    """Reasons why a call of the loop ends.

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


MODE = ModeRows()
WORK = WorkRows()
SCALAR = ScalarPositions()
COUNT = CounterPositions()
TURN = TurnPositions()
EVENT = StepEvents()
STATUS = CallStatus()
# points of a part of a step at which its samples are taken
N_NODES = 9
# these points as fractions of the part, which are Chebyshev points of the second kind
NODE_FRACTIONS = (1 - np.cos(np.pi * np.arange(N_NODES) / (N_NODES - 1))) / 2


class MotionArrays(NamedTuple):
    """Modes, drive, law and state of a motion; N = 2 n + l + 3 for n modes and l states of the law.

    - modes: (5, n) see `ModeRows`
    - damping: (n, n) damping matrix where it couples the modes, else (0, 0)
    - segments: (p, 12) segments of the drive, see `events.positions_kernels.SegmentColumns`
    - numbers, memory: numbers of the law (1, k), its memory and a copy to work with (2, m)
    - turn: (10,) see `TurnPositions`
    - state: (N,) coordinates [m], rates [m/s], states of the law, then work of the drive, viscous
    loss and friction
      work [J]
    - work: (26, N) slopes of the 16 stages, then see `WorkRows`
    - scalars: (15,) see `ScalarPositions`
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
    """Records of a motion.

    A sample (2 n + 7,) has the time, coordinates, rates, relative displacement and velocity, force,
    slip, energy in the interface and friction work [J].

    - cycles: (4, c) smallest and largest output of every cycle, and real and imaginary part of the
    output at the
      frequency of the cycle [m], NaN where it is not wanted
    - samples: (s, 2 n + 7) at the times in their first column
    - turns: (r, 2 n + 7) at reversals
    - parts: (k, N_NODES, 2 n + 7) at NODE_FRACTIONS of the parts of steps
    - counters: (10,) see `CounterPositions`
    - workspace: (N,)
    """

    cycles: np.ndarray
    samples: np.ndarray
    turns: np.ndarray
    parts: np.ndarray
    counters: np.ndarray
    workspace: np.ndarray
