"""Rows of a block of contact points in a step."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ..friction.bonds.strip_rows_kernels import BondLists

# Points of a block, the entries of a row; of 16, 32 and 48, the fastest for sets of 47 and of 107 points
WIDTH = 48
VECTOR = 4  # numbers that a processor handles at once; loops over whole vectors need no remainder
N_VALUES = 24  # rows of `Value`


class Law(IntEnum):
    """Number of a law, which names the function of its points.

    - CELLS: a spring and a slider in series; elastic-plastic law, Coulomb with a compliance of its own
    - SLIDERS: many of them in parallel; Iwan
    - BONDS: bonds that are summed by their moments; nonlocal law of order 1, Dahl and LuGre
    - BOUC_WEN, TANH: laws of these names
    - CUBIC, INTERLOCK: nonlinear springs
    - COULOMB: rigid friction of a port, which is solved with the motion of this port
    - LIST: bonds that are summed one by one
    - OWN: a law with a module of its own, of which a march has at most one
    """

    CELLS = 0
    BONDS = 1
    BOUC_WEN = 2
    TANH = 3
    CUBIC = 4
    INTERLOCK = 5
    COULOMB = 6
    LIST = 7
    SLIDERS = 8
    OWN = 9


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
    - LAST_SLIDE: SLIDE of the last step [m]
    - WEIGHTED: workspace of the Jacobian
    - START_BACK, END_BACK: load that limits a slide to -x at the ends of the step [N]; START_LOAD and END_LOAD unless the
      law averages the pressure behind a point
    """

    START_LOAD = 0
    END_LOAD = WIDTH
    SLIDE = 2 * WIDTH
    START_VELOCITY = 3 * WIDTH
    VELOCITY = 4 * WIDTH
    START = 5 * WIDTH
    END = 6 * WIDTH
    MEAN = 7 * WIDTH
    END_BY_SLIDE = 8 * WIDTH
    END_BY_VELOCITY = 9 * WIDTH
    MEAN_BY_SLIDE = 10 * WIDTH
    MEAN_BY_VELOCITY = 11 * WIDTH
    ENERGY = 12 * WIDTH
    STRETCH = 13 * WIDTH
    BENT = 14 * WIDTH
    FORCE = 15 * WIDTH
    BY_SLIDE = 16 * WIDTH
    BY_SHEAR = 17 * WIDTH
    BY_VELOCITY = 18 * WIDTH
    TOTAL = 19 * WIDTH
    LAST_SLIDE = 20 * WIDTH
    WEIGHTED = 21 * WIDTH
    START_BACK = 22 * WIDTH
    END_BACK = 23 * WIDTH


class Step(NamedTuple):
    """Step of contact points.

    - duration [s]; 0 for a change of load at rest
    - rate, lag [1/s]: velocity at the end by a formula of order 2 (BDF2), rate * increment - lag * last increment
    """

    duration: float
    rate: float
    lag: float


class CellRow(IntEnum):
    """Rows of `numbers` of points with a spring and a slider in series.

    - FRICTION, LENGTH: coefficient of friction, and slide [m] at which an unstretched point slips
    - IS_FIXED: 1 if the stiffness does not follow the load

    Memory: force over the coefficient of friction [N], load [N] whose springs the point has.
    """

    FRICTION = 0
    LENGTH = WIDTH
    IS_FIXED = 2 * WIDTH


class SliderRow(IntEnum):
    """Entries of `numbers` of points with K parallel springs and sliders, which all points of a block share.

    - FRICTION: coefficients of friction of the points
    - COUNT: number K, a multiple of VECTOR; the last ones may have no weight
    - CELLS: first of K weights, the fractions of the friction limit, and of K inverse lengths [1/m] that follow

    Memory: for each point in turn, K forces over the coefficient of friction [N] and K loads of the springs [N].
    """

    FRICTION = 0
    COUNT = WIDTH
    CELLS = 2 * WIDTH


class BondRow(IntEnum):
    """Rows of `numbers` of bonds that are summed by moments.

    - FRICTION, LENGTH: coefficient of friction and bond length eps_0 [m]; the stiffness is their ratio times the load
    - GROWTH: first of five numbers of growing bonds (eq. 2.10), the first of which is below 0 for a constant length
    - INITIAL: density m_0 of the bonds that a rising load forms
    - KINETIC, SPEED: kinetic coefficient of friction and Stribeck velocity [m/s] of the LuGre law, or 0
    - DAMPING, VISCOUS: damping of the bonds and viscous friction per unit of load [s/m]
    - IS_KEPT: 1 if bonds keep the load under which they formed until the point has none, as on the pressure of the lower
      piece
    - IS_CONSTANT: 1 if the load of the point never changes

    Memory: bond length [m], m [N], z [N m], s2 [N m2].
    """

    FRICTION = 0
    LENGTH = WIDTH
    GROWTH = 2 * WIDTH
    INITIAL = 7 * WIDTH
    KINETIC = 8 * WIDTH
    SPEED = 9 * WIDTH
    DAMPING = 10 * WIDTH
    VISCOUS = 11 * WIDTH
    IS_KEPT = 12 * WIDTH
    IS_CONSTANT = 13 * WIDTH


class ListRow(IntEnum):
    """Rows of `numbers` of bonds that are summed one by one.

    - FRICTION: coefficient of friction
    - INDEX: number of the list of the point
    """

    FRICTION = 0
    INDEX = WIDTH


class Layout(NamedTuple):
    """Laws and ports of b blocks of points.

    - law, port, count, n_memory (b,): law, port, number of points and used entries of the memory of each block
    - first (p + 1,): first block of each port
    - is_spring (p,): whether the points of a port are springs, whose work is not friction
    """

    law: np.ndarray
    port: np.ndarray
    count: np.ndarray
    n_memory: np.ndarray
    first: np.ndarray
    is_spring: np.ndarray


class Loads(NamedTuple):
    """Where the loads of the points in b blocks come from.

    - node (b, s): node whose force is the load of a point; -1 for a fraction `share` of the resultant, -2 for `share`
      times the pressure of the lower piece at the place of the point. s = WIDTH; 2 WIDTH with the loads of slides to -x
    - share, place (b, s): fraction of the resultant or factor of the pressure [N]; position at rest [m]
    - pressure (2, k): positions [m] and relative pressures of the lower piece, or (2, 0)
    - nodal (n,): forces of the nodes of a patch [N]
    - averages (2, n, n - 1, 2): weights of these forces at both ends of a segment in averages for slides to +x and to -x
    - averaged (2 n + 2,): these averages [N], and their sums; their numbers as nodes begin with n
    """

    node: np.ndarray
    share: np.ndarray
    place: np.ndarray
    pressure: np.ndarray
    nodal: np.ndarray
    averages: np.ndarray
    averaged: np.ndarray


class Pieces(NamedTuple):
    """Shear of the elastic pieces behind points of p ports in b blocks, by r coordinates.

    - shears (p, 2): first shear coordinate of each port, and the one after its last; several ports may have the same
    - bent (r, 2): first block of the points that follow a shear coordinate, and the one after their last
    - shapes (r, b WIDTH), stiffness (r,): slide of the points per coordinate, and stiffness [N/m] of the coordinates
    - shear (8, r): see `march_rows_kernels.Shear`
    - clock (1,): duration of the last step [s], 0 at the start
    - products (r, 2): workspace
    """

    shears: np.ndarray
    bent: np.ndarray
    shapes: np.ndarray
    stiffness: np.ndarray
    shear: np.ndarray
    clock: np.ndarray
    products: np.ndarray


class Points(NamedTuple):
    """Points of all ports in b blocks.

    - blocks: laws and ports
    - numbers (b, k), memory, trial (b, l), values (b, v): arrays of the laws (`time_steps`)
    - loads, pieces: loads of the points, and shear of the pieces behind them
    - lists: lists of bonds
    """

    blocks: Layout
    numbers: np.ndarray
    memory: np.ndarray
    trial: np.ndarray
    values: np.ndarray
    loads: Loads
    pieces: Pieces
    lists: BondLists
