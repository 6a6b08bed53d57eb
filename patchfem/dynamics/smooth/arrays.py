"""Arrays of the compiled steps: what moves, and what is kept of the motion."""

from typing import NamedTuple

import numpy as np

# of Moving.now
(
    TIME,
    STEP,
    TURNED,
    ORIGIN,
    LEFT,
    CREST,
    CREST_SPEED,
    PACE,
    BEGUN,
    STOOD,
    MASS,
    DRIVEN,
    PIECE,
    MOVES,
    STIFF,
) = range(15)
# of Kept.counters
POWER, STORED, LOST, DONE, REFUSED, TURNS, SAMPLE, PARTS, PERIOD, FORCE = range(10)
# of Moving.turn, beyond direction, path to the next kink and knee: what a law that holds has to know, and tells
FREE, EASE, PLACE, PULL, UPRIGHT, KNEE_VELOCITY, RELEASE_DIRECTION = range(3, 10)
NODES = 9  # places of a part of a step at which it stands
ENDS = (
    1 - np.cos(np.pi * np.arange(NODES) / (NODES - 1))
) / 2  # these places, as shares of it (Chebyshev)


class Moving(NamedTuple):
    """Modes, drive, law and the state of a motion, in few arrays, as each is handed on in every call.

    rows (5, n): omega, 2 zeta omega, slide, base, output; damping: (n, n) where it couples, else (0, 0). pieces (p,
    12): of the drive, as of `events.drive_kernels`. num: numbers of the law; mem (2, l): its memory and a copy to work
    with; turn (10,) as the law takes it. y (N,): state; work (26, N): slopes of the 16 stages, extension of the step
    (8), sizes of the law's states and least ones of the others, state after a step. now (15,): time [s], length of the
    next step and of the first after a reversal [s],
    slide at the start of the motion in this direction [m], energy lost to friction till then [J], largest coordinate
    [m] and rate [m/s] of late, rate of the fastest mode [1/s], 1 once it has begun and 2 where it was left at a
    reversal, piece of the drive for which the first slopes stand, mass [kg], period of the drive [s], its piece now, 1
    where it moves the base, stiffness of the law [N/m].
    """

    rows: np.ndarray
    damping: np.ndarray
    pieces: np.ndarray
    num: np.ndarray
    mem: np.ndarray
    turn: np.ndarray
    y: np.ndarray
    work: np.ndarray
    now: np.ndarray


class Kept(NamedTuple):
    """What a motion leaves behind.

    cycles (4, c): smallest and largest output in every cycle [m], its part at the frequency of the cycle [m], NaN
    where it is not asked for; samples (s, 2 n + 7): time that is asked for, z, z', slide, its speed, force,
    irreversible slip, energy in the interface, friction work [J]; turns (r, 2 n + 7): the same at reversals; parts (k,
    NODES, 2 n + 7): the same at the places ENDS of parts of steps. counters (10,): |work| of the
    drive, largest stored energy and energy lost to friction [J], steps taken and refused, rows of turns, sample that
    comes next, rows of parts, period [s], largest force in the parts [N]. workspace (N,): to work in.
    """

    cycles: np.ndarray
    samples: np.ndarray
    turns: np.ndarray
    parts: np.ndarray
    counters: np.ndarray
    workspace: np.ndarray
