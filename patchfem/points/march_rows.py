"""Arrays of a march, and the meaning of their rows."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ..contact.set_arrays import SetArrays


class Point(IntEnum):
    """Rows of `Points.values`.

    Load at start, middle and end of a step [N], slide, mean force and its slopes, forces of the nodes.
    """

    START_LOAD = 0
    LOAD = 1
    END_LOAD = 2
    SLIDE = 3
    FORCE = 4
    BY_SLIDE = 5
    BY_VELOCITY = 6
    NODE_FORCE = 7


class Port(IntEnum):
    """Rows of `Ports.values`.

    Slide and velocity at the start, increment and velocity at the end without forces, mean force, velocity at the end,
    force that holds the port at rest, increment, sums of the slopes of the points.
    """

    SLIDE = 0
    VELOCITY = 1
    FREE = 2
    FREE_VELOCITY = 3
    FORCE = 4
    END_VELOCITY = 5
    HOLD = 6
    INCREMENT = 7
    BY_SLIDE = 8
    BY_VELOCITY = 9


class Total(IntEnum):
    """Entries of `System.totals`.

    Work of the drive, its magnitude, viscous loss, friction work and energy created since the start [J]; largest stored
    energy [J], numbers of Newton iterations and of steps that did not converge, slot of the contact set, normal load
    [N], moment [N m] and energy [J] of the preloaded contact relative to its reference.
    """

    WORK_IN = 0
    POWER = 1
    VISCOUS = 2
    FRICTION = 3
    STORED = 4
    ITERATIONS = 5
    WORST = 6
    UNSOLVED = 7
    SLOT = 8
    LOAD = 9
    MOMENT = 10
    CONTACT_ENERGY = 11


class Sample(IntEnum):
    """Columns of a sample after 2 n modal coordinates and velocities.

    Energy of laws and pieces [J], friction work of the following step [J], load, moment and energy of the contact, heave
    [m], pitch [rad], then FORCE, SLIP and MEAN of every port in turn.
    """

    ENERGY = 0
    WORK = 1
    LOAD = 2
    MOMENT = 3
    CONTACT_ENERGY = 4
    HEAVE = 5
    PITCH = 6
    PORTS = 7


N_PORT_COLUMNS = 3  # force, slip and mean force of the following step


class Points(NamedTuple):
    """Points with laws; m points, r shear coordinates of the pieces.

    - port (m,): port on which the point acts
    - node (m,): node whose force is the load of the point; -1 for a fraction `share` of the resultant
    - share (m,): fraction of the resultant, or the load [N] where it is constant
    - numbers (k, m), memory, trial (l, m): see `return_maps_kernels`
    - values (8, m or number of nodes): see `Point`
    - shapes (r, m), stiffness (r,): slide of the points per coordinate, and stiffness [N/m] of the coordinates
    - shear (3, r): coordinates, their last increment per time, and trial increment
    - is_spring (m,): whether the point is a spring, whose work is not friction
    """

    port: np.ndarray
    node: np.ndarray
    share: np.ndarray
    numbers: np.ndarray
    memory: np.ndarray
    trial: np.ndarray
    values: np.ndarray
    shapes: np.ndarray
    stiffness: np.ndarray
    shear: np.ndarray
    is_spring: np.ndarray


class Ports(NamedTuple):
    """P ports on n modes.

    - rows (P, n): displacement of the ports per coordinate
    - compliance (levels, 2, P, P): decrease of displacement and velocity per constant force in a step
    - grip (P, P): decrease of the acceleration per force [1/kg]
    - values (10, P): see `Port`
    - matrix (P + r, P + r), vector (P + r,): Newton system
    - contact (11,): press workspace: numbers of the heave and pitch ports (-1 for none) and the results of `path_mean`
    """

    rows: np.ndarray
    compliance: np.ndarray
    grip: np.ndarray
    values: np.ndarray
    matrix: np.ndarray
    vector: np.ndarray
    contact: np.ndarray


class Structure(NamedTuple):
    """Modes in steps of several lengths.

    - responses (levels, 2 n, 3 n + 3): motion at the end of a step per state, parabola of the drive and constant modal force
    - modes (3, n): squared frequencies, participations of drive and output
    - damping (n, n): [1/s]
    - drive (s, 3): value, slope and second derivative of the drive at the start of every step
    - loads (s + 1,): prescribed load [N] at the steps, or (0,)
    - numbers (3,): mass [kg], step [s], largest output [m]
    """

    responses: np.ndarray
    modes: np.ndarray
    damping: np.ndarray
    drive: np.ndarray
    loads: np.ndarray
    numbers: np.ndarray


class System(NamedTuple):
    """All arrays of a march; `state` (3, 2 n) is the motion, its free motion in a step, and its trial."""

    structure: Structure
    ports: Ports
    points: Points
    sets: SetArrays
    state: np.ndarray
    totals: np.ndarray
