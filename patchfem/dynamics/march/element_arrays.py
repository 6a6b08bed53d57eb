"""Arrays of the friction elements and springs in a march, and the names of their rows."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np


class LinkRow(IntEnum):
    """Row indices of `PortElements.links`: port and type of each element.

    - PORT: port on which the element acts
    - IS_FRICTION: 1 for friction, 0 for a spring
    """

    PORT = 0
    IS_FRICTION = 1


class ElementRow(IntEnum):
    """Row indices of `PortElements.state`: force, relative displacement and residual of each element.

    - FORCE: mean force of the step [N]
    - SLIDE, SPEED: slide [m] and its speed [m/s] at the start
    - BOND_LENGTH: bond length of the step [m]
    - INCREMENT: increment of the slide [m]
    - RESIDUAL: residual of the force [N]
    - MAX_FORCE: largest force [N]; for a set-valued element in a step with mean forces alone
    - FORCE_TOL: tolerance of the force [N]
    - LAST_INCREMENT, INCREMENT_BEFORE: increments of the last two steps [m]
    """

    FORCE = 0
    SLIDE = 1
    SPEED = 2
    BOND_LENGTH = 3
    INCREMENT = 4
    RESIDUAL = 5
    MAX_FORCE = 6
    FORCE_TOL = 7
    LAST_INCREMENT = 8
    INCREMENT_BEFORE = 9


class ContactIndex(IntEnum):
    """Indices into `PortElements.contact`: state of the contact on port 0 during a step.

    - FORCE: mean force [N]
    - INCREMENT: increment of the slide [m]
    - SAMPLE_FORCE: force at the sample [N]
    - FORCE_TOL: tolerance of the force [N]
    - STOPS_KNOWN: 1 if the stops of the step are known
    """

    FORCE = 0
    INCREMENT = 1
    SAMPLE_FORCE = 2
    FORCE_TOL = 3
    STOPS_KNOWN = 4


class PortRow(IntEnum):
    """Row indices of `PortElements.port`: increment [m] and final speed [m/s] if no force acted."""

    FREE_SLIDE = 0
    FREE_SPEED = 1


class ModalRow(IntEnum):
    """Row indices of `PortElements.modal`: compliances, accelerations and workspace of the modes.

    - COMPLIANCE: compliance of the coordinates in a step [m/N]
    - OTHER_ACCELERATION: accelerations due to forces other than those of contact and elements [m s-2]
    - SCRATCH: first of three rows of scratch space
    """

    COMPLIANCE = 0
    OTHER_ACCELERATION = 1
    SCRATCH = 2


class ComplianceRow(IntEnum):
    """First index of `compliances`: how much a constant force reduces a port's motion in a step.

    - SLIDE: reduction of the slide [m/N]
    - SPEED: reduction of the speed [m/(s N)]
    - ACCELERATION: reduction of the acceleration [1/kg]; for set-valued elements only
    """

    SLIDE = 0
    SPEED = 1
    ACCELERATION = 2


class LimitRow(IntEnum):
    """Row indices of `SetValuedElements.limit`: friction limits [N] of set-valued elements.

    The limits at the end of the step are AT_END rows further on.

    """

    STATIC = 0
    KINETIC = 1
    AT_END = 2


class FaceRow(IntEnum):
    """Row indices of `SetValuedElements.field`: state of each set-valued element (face) in a step.

    - FREE_SLIDE, FREE_SPEED: increment of the slide [m] and speed at the end [m/s] in the absence of face forces
    - START_SPEED: speed at the start [m/s]
    - WAS_RESTING: 1 if the face rests at the start of the step
    - HOLDING_START, HOLDING_END: force that would hold the face, at the start and at the end of the step [N]
    - SLIDE: slide since the start [m]
    - SPEED: present speed [m/s]
    - MEAN_FORCE: mean force so far [N]
    - FORCE, FORCE_SLOPE: present force and its slope over the step [N]
    - SLIP_STATE: 0 for a resting face, +-1 for a sliding face, +-2 for a face that carries its static friction while
      other faces hold it
    - SLIDES_ON: 1 if the face slides in one direction through the entire step
    - RIGHT_SIDE, SOLUTION, RESIDUAL: vectors of the equations that are solved; RESIDUAL is also scratch space
    - INCREMENT: increment of the slide in the step [m]
    - IMPULSE: impulse at the end of the step [N s]
    """

    FREE_SLIDE = 0
    FREE_SPEED = 1
    START_SPEED = 2
    WAS_RESTING = 3
    HOLDING_START = 4
    HOLDING_END = 5
    SLIDE = 6
    SPEED = 7
    MEAN_FORCE = 8
    FORCE = 9
    FORCE_SLOPE = 10
    SLIP_STATE = 11
    SLIDES_ON = 12
    RIGHT_SIDE = 13
    SOLUTION = 14
    RESIDUAL = 15
    INCREMENT = 16
    IMPULSE = 17


class LoadColumn(IntEnum):
    """Last columns of a march sample if the load varies.

    - LOAD, MOMENT: normal force [N] and its moment [N m]
    - ENERGY: energy of the preloaded contact [J]
    - HEAVE, PITCH: normal displacement [m] and rotation [rad] of the upper holder
    """

    LOAD = 0
    MOMENT = 1
    ENERGY = 2
    HEAVE = 3
    PITCH = 4


# Number of sample columns of an element: those of
# `dynamics.ledger.SampleColumn` up to the mean force.
N_ELEMENT_COLUMNS = 5
N_LOAD_COLUMNS = len(LoadColumn)


class SingleContact(NamedTuple):
    """Arrays of a march with a single contact and no elements.

    - goal: (1,) tolerance of the residual of the contact [N]

    """

    goal: np.ndarray


class SetValuedElements(NamedTuple):
    """Arrays of the m set-valued friction elements in a march, called faces in `stops_kernels`.

    - element, names: (m,) numbers of the elements, and workspace for numbers of faces
    - limit: (4, m) friction limits, see `LimitRow`
    - compliances: (3, m, m), see `ComplianceRow`
    - rows: (m, n) relative displacement per coordinate
    - system, field: (m, m) and (18, m) workspace, see `FaceRow`
    """

    element: np.ndarray
    names: np.ndarray
    limit: np.ndarray
    compliances: np.ndarray
    rows: np.ndarray
    system: np.ndarray
    field: np.ndarray


class PortElements(NamedTuple):
    """Arrays of the e friction elements and springs on the p ports of a march.

    They supplement or replace a contact on port 0.

    - rows: (p, n) displacement of every port per coordinate
    - compliances: (2, p, p), see `ComplianceRow`
    - links: (3, e), see `LinkRow`
    - num, mem: (e, ...) numbers and memory of the laws; num[e, 0] is the number of the law
    - state: (10, e), see `ElementRow`
    - contact: (5,), see `ContactIndex`
    - port: (2, p), see `PortRow`
    - modal: (5, n), see `ModalRow`
    - system, hess: (e, e) and (n, n) workspace
    - stops: the set-valued elements
    """

    rows: np.ndarray
    compliances: np.ndarray
    links: np.ndarray
    num: np.ndarray
    mem: np.ndarray
    state: np.ndarray
    contact: np.ndarray
    port: np.ndarray
    modal: np.ndarray
    system: np.ndarray
    hess: np.ndarray
    stops: SetValuedElements


class MarchArrays(NamedTuple):
    """Arguments of the compiled loop of a march: modes, interface, load and ledger.

    - motion: (2, n) coordinates and rates of the modes
    - modal_system: `interfaces.arrays.ModalArrays`
    - table: (s, k) table of `propagator.Propagator`
    - interface: arrays of the contact on port 0, in `interfaces.arrays`
    - elements: `PortElements` or `SingleContact`
    - press: `interfaces.arrays.VaryingLoad` or `ConstantLoad`
    - ledger: (9,) energy sums, see `dynamics.ledger.Ledger`
    - travel: largest displacement of the output [m], beyond which the march ends
    """

    motion: np.ndarray
    modal_system: tuple
    table: np.ndarray
    interface: tuple
    elements: tuple
    press: tuple
    ledger: np.ndarray
    travel: float
