"""Arrays of a march, and the meaning of their rows."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ..contact.set_arrays import SetArrays
from .step_rows_kernels import Points

# Statuses of a march
DONE = 0
EXCEEDS_TRAVEL = 1
NOT_FINITE = 2
NO_CONTACT_SET = 3
LEAVES_GROOVES = 4
TOO_MANY_PARTS = 5
RESULTANT = -1  # node of a point whose load is a fraction of the resultant
LOWER = -2  # node of a point whose load is the pressure of the lower piece at its place
RESIDUAL = 1e-12


class Port(IntEnum):
    """Rows of `Ports.values`.

    - SLIDE, VELOCITY: at the start of a step [m], [m/s]
    - FREE, FREE_VELOCITY: increment and velocity at the end without forces [m], [m/s]
    - FORCE: mean force of the step [N]
    - END_VELOCITY, INCREMENT: velocity at the end [m/s] and increment [m] under the assumed forces
    - HELD, HOLD: 1 if rigid friction holds the port at rest, and the force that does [N]
    - RETURN: displacement of a port at rest that is taken back after the step [m]
    - SUM, BY_SLIDE, BY_VELOCITY: sums over the points of the port of their forces and of the slopes
    - BASE: force from which a line search starts [N]
    - LAST, EARLIER, FIRST: mean forces of the last three steps [N], the last one first
    - DAMPING: weight of the force at the end of the step in the mean force, above 0 where the step does not resolve the
      decay of its velocity by the viscosity of its points
    - VISCOSITY: of the points at rest [N s/m]
    - MOVE: increment of the points [m]
    - RELEASED: 1 while a port begins to slip at an instant
    """

    SLIDE = 0
    VELOCITY = 1
    FREE = 2
    FREE_VELOCITY = 3
    FORCE = 4
    END_VELOCITY = 5
    HOLD = 6
    INCREMENT = 7
    SUM = 8
    BY_SLIDE = 9
    BY_VELOCITY = 10
    BASE = 11
    LAST = 12
    EARLIER = 13
    HELD = 14
    RETURN = 15
    FIRST = 16
    DAMPING = 17
    VISCOSITY = 18
    MOVE = 19
    RELEASED = 20


class Shear(IntEnum):
    """Rows of `Pieces.shear`.

    - VALUE: coordinates [m]
    - LAST, EARLIER, FIRST: their mean rates in the last three steps [m/s], the last one first
    - TRIAL, BASE: increments of a trial step, and those from which a line search starts [m]
    - SCALE: factor that makes the residuals of the coordinates comparable with forces
    """

    VALUE = 0
    LAST = 1
    EARLIER = 2
    FIRST = 3
    TRIAL = 4
    BASE = 5
    SCALE = 6


class Flank(IntEnum):
    """Entries of `System.flank`: grooves whose flanks port 0 climbs.

    - LOAD [N], WAVE_NUMBER [rad/m], AMPLITUDE [m], PHASE [rad], LIFTED_MASS [kg]: geometry and load at the start
    - RISE_SPEED [m/s], VERTICAL [N], FORCE [N], NORMAL [N]: vertical speed of the lifted mass, vertical force of the last
      step (its mean, except for a prescribed load), force along the flank and normal force at its end
    - SLOPE, RATIO: mean height and path along the flank per increment of a trial step [1]
    - TRIAL_VERTICAL, TRIAL_FORCE: mean vertical force of a trial step, and force along the flank at its end [N]
    - HAS_LIFTED: 1 after the vertical force has vanished
    - ADDED, RISE: mean change of a prescribed load since the start in a trial step, and its end value less the mean [N]
    - ADDED_WORK: its work on the height since the start [J]
    """

    LOAD = 0
    WAVE_NUMBER = 1
    AMPLITUDE = 2
    PHASE = 3
    LIFTED_MASS = 4
    RISE_SPEED = 5
    VERTICAL = 6
    FORCE = 7
    NORMAL = 8
    SLOPE = 9
    RATIO = 10
    TRIAL_VERTICAL = 11
    TRIAL_FORCE = 12
    HAS_LIFTED = 13
    ADDED = 14
    RISE = 15
    ADDED_WORK = 16


class Total(IntEnum):
    """Entries of `System.totals`.

    - WORK_IN: work of the drive since the start, without that on motions of ports at rest [J]
    - POWER: sum over the steps of the magnitude of this work [J]
    - VISCOUS: viscous loss since the start [J]
    - STORED: largest stored energy [J]
    - ITERATIONS, UNSOLVED: numbers of Newton iterations, and of steps that did not converge
    - REST: work of the drive in the last step on motions of ports at rest, which are taken back [J]
    """

    WORK_IN = 0
    POWER = 1
    VISCOUS = 2
    STORED = 3
    ITERATIONS = 4
    UNSOLVED = 5
    REST = 6


class Sample(IntEnum):
    """Columns of a sample after 2 n modal coordinates and velocities.

    - ENERGY: energy of friction laws, pieces and grooves [J]
    - WORK: friction work of the following step [J]
    - LOAD, MOMENT, CONTACT_ENERGY, HEAVE, PITCH: of the normal contact [N], [N m], [J], [m], [rad]
    - SPRINGS: energy of the springs [J]
    - PORTS: first column of FORCE, SLIP and MEAN of every port in turn
    """

    ENERGY = 0
    WORK = 1
    LOAD = 2
    MOMENT = 3
    CONTACT_ENERGY = 4
    HEAVE = 5
    PITCH = 6
    SPRINGS = 7
    PORTS = 8


N_PORT_COLUMNS = 3  # force, slip and mean force of the following step


class Newton(NamedTuple):
    """Jacobian (P + r, P + r), residuals and step (P + r,) of Newton's method for P port forces and r shear coordinates."""

    matrix: np.ndarray
    residual: np.ndarray
    step: np.ndarray


class Ports(NamedTuple):
    """P ports on n modes.

    - rows (P, n): displacement of the ports per coordinate
    - compliance (levels, 2, P, P): displacement [m/N] and velocity [m/(s N)] of a port at the end of a step of each level
      that a constant force on another port takes away; C and G in `march_kernels`
    - grip (P, P): acceleration of a port that a force on another port takes away [1/kg]
    - redundant (P,): compliance of a port at rest relative to its own, which determines the forces of more ports than modes
    - values (21, P): see `Port`
    - newton: workspace of Newton's method
    - contact (11,): numbers of the heave and pitch ports (-1 for none), then the results of `path_mean` in the order of
      `contact.set_arrays.PathMean`: slopes of the contact energy by heave [N] and pitch [N m], and their derivatives
    """

    rows: np.ndarray
    compliance: np.ndarray
    grip: np.ndarray
    redundant: np.ndarray
    values: np.ndarray
    newton: Newton
    contact: np.ndarray


class Responses(NamedTuple):
    """Motion, viscous loss and work of the drive in steps of several lengths.

    There are N = 3 n + 3 inputs: 2 n coordinates and velocities, the drive with two derivatives, and n constant modal forces
    over mass.

    - motion: (levels, 2 n, N) motion at the end of a step per input
    - loss: (levels, N, N) viscous loss [J] as a quadratic form of the inputs
    - work: (levels, 3, N) work of the drive [J] as a bilinear form of the drive and the inputs
    """

    motion: np.ndarray
    loss: np.ndarray
    work: np.ndarray


class Structure(NamedTuple):
    """Modes in steps of several lengths.

    - responses: motion and energies of steps of several lengths
    - modes (3, n): squared frequencies, participations of drive and output
    - damping (n, n): [1/s]
    - drive (s, 3): value, slope and second derivative of the drive at the start of every step
    - loads (s + 1,): prescribed load [N] at the steps, or (0,)
    - path (s + 1,): prescribed displacement [m] of port 0 at the steps, or (0,)
    - inputs (3 n + 3,): workspace, the inputs of `responses`
    """

    responses: Responses
    modes: np.ndarray
    damping: np.ndarray
    drive: np.ndarray
    loads: np.ndarray
    path: np.ndarray
    inputs: np.ndarray


class Options(NamedTuple):
    """Numbers of a march.

    - mass [kg], step [s], travel [m]: modal mass, duration of a step, largest output
    - scale: force [N] to whose 1e-11 part a step is solved
    - has_events, has_lists, has_loads: 1 if points have rigid friction, lists of bonds, or loads that change
    """

    mass: float
    step: float
    travel: float
    scale: float
    has_events: int
    has_lists: int
    has_loads: int


class System(NamedTuple):
    """All arrays of a march.

    - structure: modes in steps of several lengths
    - ports, points: places where forces act on the modes, and contact points at them
    - flank: grooves, see `Flank`, or (0,) without grooves
    - sets: contact sets of a patch
    - state (3, 2 n): modal coordinates and velocities, with row 0 at the start of a step, row 1 at its end without
      forces, row 2 at its end in the present trial
    - totals: energies and counts since the start, see `Total`
    - options: numbers of the march
    """

    structure: Structure
    ports: Ports
    points: Points
    flank: np.ndarray
    sets: SetArrays
    state: np.ndarray
    totals: np.ndarray
    options: Options
