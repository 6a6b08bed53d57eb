"""Arrays of a rig, of its motion and of what is recorded, and the meaning of their columns.

Few arrays make short calls and short compile times.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

N_FACE_INTEGRALS = 3  # work, slip and loss of every interface, near the end of a state
N_INTEGRALS = 2  # number of integrals at the end of a state, see `Tail`
N_NODES = 7  # points of a step at which the quantities of a window are evaluated
WINDOW_START = 28  # row of `State.rows` with the state at the start of the window


class Tail(IntEnum):
    """Integrals of a motion over time, by their places from the end of a state (`State.y`)."""

    WORK = -2  # work of the drive [J]
    LOSS = -1  # energy that the dampers dissipate [J]


class Mode(IntEnum):
    """Rows of `Rig.modes`.

    - STIFFNESS: squared circular frequencies [1/s2]
    - PUSH: accelerations of the modal coordinates per drive
    - OUTPUT: participations in the displacement of the point whose acceleration is measured
    - GAUGE: participations in the displacement of the point whose displacement is measured
    """

    STIFFNESS = 0
    PUSH = 1
    OUTPUT = 2
    GAUGE = 3


class Face(IntEnum):
    """Columns of `Rig.faces`, a row for each interface.

    The normal load is max(0, MEAN + SWING cos(RATE t + PHASE) - STIFFNESS heave).

    - LAW: number of the law
    - FIRST_STATE, N_STATES: first state of the law among the states of all laws, and number of its states
    - RIGID: whether the law is rigid, that is, rests without displacement below its static friction
    - MEAN, SWING: mean and amplitude of the load [N]
    - RATE, PHASE: circular frequency [rad/s] and phase [rad] of the load
    - STIFFNESS: decrease of the load per heave [N/m]
    - LOAD, LOAD_RATE: typical magnitudes of the load [N] and of its rate [N/s]
    - LENGTH: stretch before slip [m] of a law whose force follows from the slide alone, else infinite
    - NUMBERS: first of the numbers of the law
    """

    LAW = 0
    FIRST_STATE = 1
    N_STATES = 2
    RIGID = 3
    MEAN = 4
    SWING = 5
    RATE = 6
    PHASE = 7
    STIFFNESS = 8
    LOAD = 9
    LOAD_RATE = 10
    LENGTH = 11
    NUMBERS = 12


class Piece(IntEnum):
    """Columns of `Rig.pieces`, a row for each piece of the drive.

    With the time tau = t - START [s] the drive is CONSTANT + SLOPE tau + AMPLITUDE sin(phase), where the phase starts at
    PHASE [rad] and phase' = OMEGA exp(GROWTH tau) + CHIRP tau [rad/s]. SQUARED is 1 if AMPLITUDE is that of a displacement
    [m], which is multiplied by phase'^2 to become an acceleration.
    """

    START = 0
    CONSTANT = 1
    SLOPE = 2
    AMPLITUDE = 3
    OMEGA = 4
    PHASE = 5
    CHIRP = 6
    GROWTH = 7
    SQUARED = 8


class Setting(IntEnum):
    """Entries of `Rig.settings`.

    - MASS: modal mass [kg]
    - LONGEST_STEP: longest step [s]
    - TRAVEL: largest magnitude of the output [m], at which a run ends
    - OMEGA, PERIOD: circular frequency [rad/s] and period [s] of a cycle
    - BASE_MOVES: whether the drive is the acceleration of the base
    - IS_BENCH: whether the drive is a prescribed slide (bench)
    - RTOL: relative tolerance of a step
    - REPEAT: number of cycles after which the drive repeats, or 0 if it never does
    - MAX_STEPS: largest number of steps
    - HAS_RIGID: whether an interface has a rigid law
    """

    MASS = 0
    LONGEST_STEP = 1
    TRAVEL = 2
    OMEGA = 3
    PERIOD = 4
    BASE_MOVES = 5
    IS_BENCH = 6
    RTOL = 7
    REPEAT = 8
    MAX_STEPS = 9
    HAS_RIGID = 10


class Rig(NamedTuple):
    """N modes and M interfaces: z'' + damping z' + stiffness z = push a(t) - slides^T F/mass.

    - modes (4, N): see `Mode`
    - damping (N, N): [1/s]
    - rows (2, M, N): slide and heave of every interface per unit of the modal coordinates
    - faces (M, k): see `Face`
    - pieces (P, 9): successive pieces of the drive, see `Piece`
    - tones (Q, 3): amplitude, circular frequency and phase of sines that last for the whole run
    - scales (n,): smallest magnitudes of slides and output (for the modes), of their velocities, and of the other states,
      to which the errors of a step are relative
    - settings (11,): see `Setting`
    """

    modes: np.ndarray
    damping: np.ndarray
    rows: np.ndarray
    faces: np.ndarray
    pieces: np.ndarray
    tones: np.ndarray
    scales: np.ndarray
    settings: np.ndarray


class Memory(IntEnum):
    """Columns of `State.memory`.

    - DIRECTION: sign of the motion of an interface, 0 if a rigid law rests
    - CONTACT: 1, or -1 after lift-off
    - FORCE, SLIP_RATE: friction force [N] and irreversible velocity [m/s] at the last evaluation
    - PULL: relative acceleration [m/s2] without the force of the interface
    - FLAG, COUNT: regime of the law, number of its reversal points
    - VIRGIN: 1 until an interface has slipped as a whole, then -1
    - ORIGIN: slide at the start [m]
    - SIZE, SPEED: largest magnitudes of slide [m] and velocity [m/s] so far
    - BEFORE, RELEASED: friction force [N] before the last event, and whether this event released the interface
    - RESTED: 1 if a rigid law was at rest before the last event
    - STACK: first column of pairs of displacement [m] and force [N] at the reversal points
    """

    DIRECTION = 0
    CONTACT = 1
    FORCE = 2
    SLIP_RATE = 3
    PULL = 4
    FLAG = 5
    COUNT = 6
    VIRGIN = 7
    ORIGIN = 8
    SIZE = 9
    SPEED = 10
    BEFORE = 11
    RELEASED = 12
    RESTED = 13
    STACK = 14


class Margin(IntEnum):
    """Margins of the present regime of a law.

    The regime ends when one of them becomes negative.

    - MOTION: direction of the motion, or rest of a rigid law
    - BRANCH: branch of the law between two limits of its own
    - CONTACT: contact or lift-off
    - LIMIT: a further limit of the law
    - SPEED: speed beside which the force changes steeply. Steps below it are short
    - AFTER: no margin. It marks the row after an event at which the force of a rigid law may jump
    """

    MOTION = 0
    BRANCH = 1
    CONTACT = 2
    LIMIT = 3
    SPEED = 4
    AFTER = 5


class Clock(IntEnum):
    """Entries of `State.clock`.

    - TIME: time [s]
    - STEP: proposed length of the next step [s]
    - N_STEPS: number of steps so far
    - PIECE: index of the present piece of the drive
    - SAMPLE: index of the next sample
    - N_EVENTS: number of events so far
    - EXCHANGED: sum over the steps of the magnitude of the work of the drive [J]
    - STORED: largest energy of the modes so far [J]
    - STATUS: how the run ended (`Status`)
    - N_CYCLES: number of cycles so far
    - IS_SMOOTH: 1 if the last step ended without an event, so that its last stage is the first of the next step
    - OUTPUT_SIZE, OUTPUT_SPEED: largest magnitudes of the output [m] and of its velocity [m/s] so far
    - LENGTH: length of the present step [s]
    - EXCHANGED_BEFORE: value of EXCHANGED at the start of the cycle [J]
    - SPAN: duration of the window so far [s]
    """

    TIME = 0
    STEP = 1
    N_STEPS = 2
    PIECE = 3
    SAMPLE = 4
    N_EVENTS = 5
    EXCHANGED = 6
    STORED = 7
    STATUS = 8
    N_CYCLES = 9
    IS_SMOOTH = 10
    OUTPUT_SIZE = 11
    OUTPUT_SPEED = 12
    LENGTH = 13
    EXCHANGED_BEFORE = 14
    SPAN = 15


class Status(IntEnum):
    """How a run ended.

    - DONE: at the end of its last cycle
    - EXCEEDS_TRAVEL: the output reached `Setting.TRAVEL`
    - LEAVES_GROOVES: the contact left its grooves
    - TOO_MANY_STEPS: the run needs more than `Setting.MAX_STEPS` steps
    - STEP_TOO_SMALL: the steps became smaller than round-off
    - NO_PROGRESS: the laws changed their regime again and again at the same time
    - TOO_STIFF: a law stretches too little before it slips
    """

    DONE = 0
    EXCEEDS_TRAVEL = 1
    LEAVES_GROOVES = 2
    TOO_MANY_STEPS = 3
    STEP_TOO_SMALL = 4
    NO_PROGRESS = 5
    TOO_STIFF = 6


class State(NamedTuple):
    """A motion, which the engine updates in place.

    - y (n,): N modal coordinates, N velocities, states of the laws, then for every interface friction work [J], path of
      slip [m] and dissipated energy [J], then work of the drive and loss of the dampers
    - memory (M, k): see `Memory`
    - clock (16,): see `Clock`
    - rows (30, n): stages of a step, its dense output, workspace (see `step_kernels`)
    - margins (5, M, 5): margins at the points of a step, and those at the last evaluation
    - probes (8, 5 + 5 M): see `Probe`; at the points of a step, and those at the last evaluation
    - grip (M, M): force that holds an interface per unit of relative acceleration [kg]
    """

    y: np.ndarray
    memory: np.ndarray
    clock: np.ndarray
    rows: np.ndarray
    margins: np.ndarray
    probes: np.ndarray
    grip: np.ndarray


class Probe(IntEnum):
    """Columns of `State.probes`, and rows of `Record.extremes` and `Record.integrals` up to the last interface.

    - GAUGE: displacement of the point whose displacement is measured [m]
    - ACCELERATION: acceleration of the output [m/s2]

    Column FACES + COUNT i + k has quantity k of interface i. As these k begin at 0 again, FORCE, SLIP, SLIDE and LOAD
    have the same values as other names.

    - FACES: first column of the interfaces
    - FORCE: friction force [N]
    - SLIP: irreversible slide [m], with its sign
    - SLIDE: relative displacement [m]
    - LOAD: normal load, 0 after lift-off [N]
    - COUNT: number of columns of an interface

    The columns from the end on serve to find instants alone.

    - SPEED: velocity of the output [m/s]
    - TRAVEL: largest displacement of the output, less its present magnitude [m]
    - VELOCITY: relative velocity of the first interface [m/s]
    - SLIPPING: |slip rate| - |velocity|/2 [m/s] of the first interface, negative in stick. Others precede it
    """

    GAUGE = 0
    ACCELERATION = 1
    FACES = 2
    # per interface
    FORCE = 0
    SLIP = 1
    SLIDE = 2
    LOAD = 3
    COUNT = 4
    # from the end
    SPEED = -1
    TRAVEL = -2
    VELOCITY = -3
    SLIPPING = -4


class Cycle(IntEnum):
    """Columns of `Record.cycles`. The first two are given, the others are measured in each cycle.

    - END: time at the end [s]
    - WINDOW: 0 in the window, below 0 outside of it (`cases.make_schedule`)
    - MIN, MAX: smallest and largest output [m]
    - COS, SIN: integrals of the output times the cosine and the sine of the cycle [m s]
    - SLIDE: integral of the slide of the first interface over time [m s]
    - MIN_SLIDE, FORCE_AT_MIN: smallest slide of the first interface [m], and its friction force there [N]
    - MAX_SLIDE, FORCE_AT_MAX: largest slide of the first interface [m], and its friction force there [N]
    - REPEATS: 1 for a cycle that was not computed, because it repeats the one before
    """

    END = 0
    WINDOW = 1
    MIN = 2
    MAX = 3
    COS = 4
    SIN = 5
    SLIDE = 6
    MIN_SLIDE = 7
    FORCE_AT_MIN = 8
    MAX_SLIDE = 9
    FORCE_AT_MAX = 10
    REPEATS = 11


class Extreme(IntEnum):
    """Columns of `Record.extremes`: smallest and largest value in the window."""

    MIN = 0
    MAX = 1


class Integral(IntEnum):
    """Columns of `Record.integrals`: integrals over the window times the cosine or sine of the first or third harmonic."""

    COS_1 = 0
    SIN_1 = 1
    COS_3 = 2
    SIN_3 = 3


class Window(IntEnum):
    """Columns of `Record.faces`, a row for each interface, over the window.

    - STUCK, OPEN: time of stick and time without contact [s]
    - STARTS: number of starts of slip
    - COS_START, SIN_START: sums of the cosine and the sine of twice the phases of the cycle at these starts
    - STICKS: duration of the stick at the end [s], or -1 if the interface slips there
    """

    STUCK = 0
    OPEN = 1
    STARTS = 2
    COS_START = 3
    SIN_START = 4
    STICKS = 5


class Record(NamedTuple):
    """What a run records.

    - cycles (C, 12): see `Cycle`
    - extremes (2 + 4 M, 2), integrals (2 + 4 M, 4): of the quantities of `Probe` over the window, the last cycles, see
      `Extreme` and `Integral`
    - faces (M, 6): further measures of the window, see `Window`
    - samples (S, m), events (E, m): time, state y, forces, loads and directions of the interfaces, interface and margin
      of an event. The first column of the samples is given. Force and load of an event are those before it, the
      directions of slip those after it. A rigid law has a second row, `Margin.AFTER`, with the force after it
    """

    cycles: np.ndarray
    extremes: np.ndarray
    integrals: np.ndarray
    faces: np.ndarray
    samples: np.ndarray
    events: np.ndarray

    def get_face_extremes(self, quantity: int) -> np.ndarray:
        """Return the smallest and the largest value (M, 2) of a quantity of all interfaces, such as `Probe.FORCE`."""
        return self.extremes[Probe.FACES + quantity :: Probe.COUNT]


class Point(NamedTuple):
    """What a law may know of its interface at an instant.

    - load, load_rate: normal load [N], negative as if the surfaces pulled, and its rate [N/s]
    - slide, velocity: relative displacement [m] and velocity [m/s]
    - held: force [N] that holds the interface at rest
    - free: relative acceleration [m/s2] without the force of this interface
    - compliance: relative acceleration per force [1/kg]; 0 if the slide is prescribed
    - speed_scale, load_scale, load_rate_scale: magnitudes for the margins
    """

    load: float
    load_rate: float
    slide: float
    velocity: float
    held: float
    free: float
    compliance: float
    speed_scale: float
    load_scale: float
    load_rate_scale: float


class Friction(NamedTuple):
    """Friction force of a law, and what it dissipates.

    - force: [N]
    - slip_rate: irreversible part of the velocity [m/s]
    - loss: dissipated power [W]
    """

    force: float
    slip_rate: float
    loss: float


class LawNumbers(NamedTuple):
    """A law of one interface.

    - law: name of the law in `laws.LAWS`
    - numbers: numbers of the law
    - states: its states at the start
    - scales: smallest magnitudes of the states, to which the errors of a step are relative
    - length: stretch before slip [m] of a law whose force follows from the slide alone, else infinite
    - stiffness: tangent stiffness at rest [N/m], inf for a rigid law and 0 for one that creeps
    """

    law: str
    numbers: tuple[float, ...]
    states: tuple[float, ...] = ()
    scales: tuple[float, ...] = ()
    length: float = np.inf
    stiffness: float = 0.0


class BalancedLaws(NamedTuple):
    """Elements of all interfaces in a row, and the waves in which their slides and forces are expressed.

    - waves: (s, w) the w sines and cosines at the samples of half a period
    - first: (i + 1,) first element of each interface, and their number
    - lengths, stiffness: (e,) largest stretch [m] and stiffness [N/m] of the elements
    """

    waves: np.ndarray
    first: np.ndarray
    lengths: np.ndarray
    stiffness: np.ndarray


class BalanceWork(NamedTuple):
    """Arrays of the search for a balance.

    - path, friction: (s,) slide [m] and friction [N] of an interface at the samples
    - follows: (s, w) derivatives of the friction by the waves of the slide [N/m]
    - slopes: (w, n) derivatives of the waves of the friction of each interface by those of its own slide [N/m]
    - matrix: (n, n + 1) equations of a Newton step
    - motions: (3, n) trial, best motion and step [m]
    """

    path: np.ndarray
    friction: np.ndarray
    follows: np.ndarray
    slopes: np.ndarray
    matrix: np.ndarray
    motions: np.ndarray


class Balance(NamedTuple):
    """Balance of odd harmonics at k frequencies.

    The n unknowns are, for each interface, the factors of the sines of its slide and those of its cosines.

    - receptance: (k, n, n) slides per friction force, with the factors of sines and cosines
    - driven: (k, n) slides without friction [m]
    - slides: (k, n) motions at which the search begins, then those that are balanced [m]
    - forces: (k, n) friction of the motions [N]
    - is_balanced: (k,) 1.0 where a motion is balanced, else 0.0
    - laws, work: elements of the interfaces, and arrays of the search
    """

    receptance: np.ndarray
    driven: np.ndarray
    slides: np.ndarray
    forces: np.ndarray
    is_balanced: np.ndarray
    laws: BalancedLaws
    work: BalanceWork
