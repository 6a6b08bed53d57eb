"""Rows of the arrays of contact points in a step."""

from enum import IntEnum
from typing import NamedTuple


class Law(IntEnum):
    """Number of a law, which names the function of its points.

    - CELLS: springs with sliders in parallel; elastic-plastic law, Iwan, Coulomb with a compliance of its own
    - BONDS: bonds that are summed by their moments; nonlocal law of order 1, Dahl and LuGre
    - BOUC_WEN, TANH: laws of these names
    - CUBIC, INTERLOCK: nonlinear springs
    - COULOMB: rigid friction of a port, which is solved with the motion of this port
    - LIST: bonds that are summed one by one
    """

    CELLS = 0
    BONDS = 1
    BOUC_WEN = 2
    TANH = 3
    CUBIC = 4
    INTERLOCK = 5
    COULOMB = 6
    LIST = 7


class Value(IntEnum):
    """Rows of the values of points.

    - START_LOAD, END_LOAD: normal load at the ends of the step [N]
    - SLIDE: increment of the displacement [m]
    - START_VELOCITY, VELOCITY: velocity at the ends of the step [m/s]
    - START, END: friction force at the ends of the step [N]
    - MEAN: mean of the force over the path [N]
    - END_BY_SLIDE, END_BY_VELOCITY, MEAN_BY_SLIDE, MEAN_BY_VELOCITY: derivatives by SLIDE [N/m] and VELOCITY [N s/m]
    - ENERGY, STRETCH: stored energy [J] and elastic part of the displacement [m] at the end
    - BENT: part of the increment that the pieces take by shear [m]
    - FORCE: force on the port [N], a mean of the step
    - BY_SLIDE, BY_SHEAR, BY_VELOCITY: its derivatives by the increment of the port, by BENT [N/m] and by the velocity of
      the port [N s/m]
    - TOTAL: displacement since the start [m]
    - BEND_RATE: part of the velocity that the shear of the pieces takes, from increments before the step [m/s]
    """

    START_LOAD = 0
    END_LOAD = 1
    SLIDE = 2
    START_VELOCITY = 3
    VELOCITY = 4
    START = 5
    END = 6
    MEAN = 7
    END_BY_SLIDE = 8
    END_BY_VELOCITY = 9
    MEAN_BY_SLIDE = 10
    MEAN_BY_VELOCITY = 11
    ENERGY = 12
    STRETCH = 13
    BENT = 14
    FORCE = 15
    BY_SLIDE = 16
    BY_SHEAR = 17
    BY_VELOCITY = 18
    TOTAL = 19
    BEND_RATE = 20


class Step(NamedTuple):
    """Step of contact points.

    - duration [s]; 0 for a change of load at rest
    - rate, lag [1/s]: velocity at the end by a formula of order 2 (BDF2), rate * increment - lag * last increment
    """

    duration: float
    rate: float
    lag: float


class CellRow(IntEnum):
    """Rows of `numbers` of parallel cells; the weights of all cells follow, then their lengths.

    - FRICTION: coefficient of friction
    - IS_FIXED: 1 if the stiffness does not follow the load
    - COUNT: number K of cells
    - WEIGHTS: first of the K rows of fractions of the friction limit; K rows of lengths [m] follow

    Memory: force over the coefficient of friction of each cell [N], then the load [N] whose springs it has.
    """

    FRICTION = 0
    IS_FIXED = 1
    COUNT = 2
    WEIGHTS = 3


class BondRow(IntEnum):
    """Rows of `numbers` of bonds that are summed by moments.

    - FRICTION, LENGTH: coefficient of friction and bond length eps_0 [m]; the stiffness is their ratio times the load
    - GROWTH: first of five numbers of growing bonds (eq. 2.10), the first of which is below 0 for a constant length
    - INITIAL: density m_0 of the bonds that a rising load forms
    - KINETIC, SPEED: kinetic coefficient of friction and Stribeck velocity [m/s] of the LuGre law, or 0
    - DAMPING, VISCOUS: damping of the bonds and viscous friction per unit of load [s/m]

    Memory: bond length [m], m [N], z [N m], s2 [N m2].
    """

    FRICTION = 0
    LENGTH = 1
    GROWTH = 2
    INITIAL = 7
    KINETIC = 8
    SPEED = 9
    DAMPING = 10
    VISCOUS = 11
