"""Arrays of a case from modes, interfaces and a drive, and a whole case from the records of a rig or bench."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..core import MIN_LOAD, ModalBasis
from ..structure.drive_sizes import find_max_acceleration
from .drives import Signal, make_signal
from .laws import LAWS, is_rigid, masing, springs
from .records import (
    N_INTEGRALS,
    N_NODES,
    Clock,
    Cycle,
    Face,
    Integral,
    LawNumbers,
    Margin,
    Memory,
    Mode,
    Probe,
    Record,
    Rig,
    Setting,
    State,
    Window,
)

MIN_STEPS = 12  # steps per shortest period of drive and load, so that no short slip is missed
MIN_SCALE = 1e-3  # smallest magnitudes of a motion relative to those expected
REVERSALS = 512  # nested reversals that a law remembers, as in `points.laws`
MAX_STEPS = 3e6  # steps of a run; with the comparison run they take up to 50 CPU seconds
DEFAULT_RTOL = 1e-7  # tolerance of a step
EXACT_RTOL = 1e-12  # the same for accuracy.method = "exact"
N_STATE_ROWS = 30  # rows of `State.rows`


class Load(NamedTuple):
    """Normal load max(0, mean + amplitude cos(omega t + phase) - stiffness heave) of an interface.

    - mean, amplitude: [N]
    - omega, phase: [rad/s], [rad]
    - stiffness: of the contact in normal direction [N/m]; 0 if the load does not follow the motion
    - heave (n,): motion that opens the contact per unit of the modes, () without it
    """

    mean: float
    amplitude: float = 0.0
    omega: float = 0.0
    phase: float = 0.0
    stiffness: float = 0.0
    heave: tuple[float, ...] = ()

    @property
    def varies(self) -> bool:
        """Whether the load changes with time or motion."""
        return self.amplitude != 0 or self.stiffness != 0


class Interface(NamedTuple):
    """Law and load of an interface.

    - law: friction law with its numbers and initial states
    - load: normal load, constant or varying
    - slide: (n,) relative displacement per unit of the modes
    """

    law: LawNumbers
    load: Load
    slide: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class Case:
    """A rig or bench with its start and schedule.

    - rig: arrays of the engine
    - y (n,): state at the start
    - ends (C,): ends of the cycles [s]
    - windows (C,): 0 for a cycle of the window, -1 for others, -2 for those that are computed even if the motion repeats
    - samples (S,): rising times [s] at which the motion is stored
    - n_friction: number of friction interfaces; the others are springs
    - first_stiffness: stiffness [N/m] of the first mode at the contact, 0 if unknown
    """

    rig: Rig
    y: np.ndarray
    ends: np.ndarray
    windows: np.ndarray
    samples: np.ndarray
    n_friction: int
    first_stiffness: float = 0.0


@dataclass(frozen=True, eq=False, slots=True)
class UndrivenRig:
    """Rig without its drive.

    - modes: modes of the structure without the contact
    - interfaces: friction interfaces, then nonlinear springs
    - n_friction: number of friction interfaces
    """

    modes: ModalBasis
    interfaces: tuple[Interface, ...]
    n_friction: int

    @property
    def rows(self) -> np.ndarray:
        """Slides (i, n) of interfaces and springs per unit of the modes."""
        return np.array([one.slide for one in self.interfaces])

    @property
    def stiffness(self) -> np.ndarray:
        """Tangent stiffness at rest (i,) [N/m] of interfaces and springs; 0 for a law that creeps, inf for a rigid one."""
        return np.array([one.law.stiffness for one in self.interfaces])

    def with_elements(self, transform) -> "UndrivenRig":
        """Return a rig in which a function has changed the elastic-plastic elements of every interface.

        `transform` takes stiffness [N/m] and yield displacement [m] (t,) of the elements and returns both.
        """
        interfaces = []
        for one in self.interfaces:
            if masing.has_stick(one.law):
                elements = transform(*masing.list_elements(one.law))
                one = one._replace(law=masing.from_elements(*elements))
            interfaces.append(one)
        return replace(self, interfaces=tuple(interfaces))


class Options(NamedTuple):
    """What a rig has besides modes, drive and interfaces.

    - moves_base: whether the drive is the acceleration of the base
    - travel: largest output [m]
    - rtol, max_steps: tolerance of a step, largest number of steps
    - n_steps: smallest number of steps per shortest period of drive and load
    """

    moves_base: bool = False
    travel: float = np.inf
    rtol: float = DEFAULT_RTOL
    max_steps: float = MAX_STEPS
    n_steps: float = MIN_STEPS


def make_rig(
    modes: ModalBasis | None,
    signal: Signal,
    interfaces,
    sizes: tuple[float, float],
    options: Options,
) -> Rig:
    """Return the arrays of a rig, or of a bench.

    Parameters
    ----------
    modes : ModalBasis or None
        None for a bench, whose slide is the signal.
    signal : Signal
        Drive of the rig, or slide of the bench.
    interfaces : sequence of Interface
        Law, load and slide per modal coordinate of each interface.
    sizes : (float, float)
        Expected slide [m] and its speed [m/s].
    options : Options
        Tolerance, steps and limits of the run.
    """
    # A bench has one mode without stiffness, which its slide replaces.
    n = 1 if modes is None else modes.omega.size
    rows = np.zeros((2, len(interfaces), n))
    n_numbers = max([1, *(len(one.law.numbers) for one in interfaces)])
    faces = np.zeros((len(interfaces), Face.NUMBERS + n_numbers))
    scales = [MIN_SCALE * (sizes[0] or 1.0)] * n + [MIN_SCALE * (sizes[1] or 1.0)] * n
    shortest = signal.shortest_period
    repeat = signal.repeat
    n_states = 0

    for i, (law, load, slide) in enumerate(interfaces):
        rows[0, i] = slide
        face = faces[i]
        face[Face.LAW] = LAWS.index(law.law)
        face[Face.FIRST_STATE] = n_states
        face[Face.N_STATES] = len(law.states)
        face[Face.RIGID] = is_rigid(law.law)
        face[Face.LENGTH] = law.length

        # Loads, and magnitudes of loads and their rates for the margins.
        face[Face.MEAN : Face.STIFFNESS + 1] = load[:5]
        face[Face.LOAD] = max(abs(load.mean), load.amplitude, MIN_LOAD)
        face[Face.LOAD_RATE] = load.amplitude * load.omega
        if load.stiffness:
            rows[1, i] = load.heave
            face[Face.LOAD_RATE] += load.stiffness * sizes[1] * np.abs(load.heave).max()
        face[Face.LOAD_RATE] = face[Face.LOAD_RATE] or 1.0

        face[Face.NUMBERS : Face.NUMBERS + len(law.numbers)] = law.numbers
        n_states += len(law.states)
        scales += law.scales
        if load.amplitude and load.omega:
            shortest = min(shortest, 2 * np.pi / load.omega)
            ratio = load.omega * signal.period / (2 * np.pi)
            # A cycle can repeat only if the load has a whole number of periods in it.
            repeat = repeat if abs(ratio - round(ratio)) < 1e-12 * ratio else 0

    settings = np.zeros(len(Setting))
    settings[Setting.MASS] = 1.0 if modes is None else modes.mass
    settings[Setting.LONGEST_STEP] = shortest / options.n_steps
    settings[Setting.TRAVEL] = options.travel
    settings[Setting.OMEGA] = 2 * np.pi / signal.period
    settings[Setting.PERIOD] = signal.period
    settings[Setting.BASE_MOVES] = options.moves_base
    settings[Setting.IS_BENCH] = modes is None
    settings[Setting.RTOL] = options.rtol
    settings[Setting.REPEAT] = repeat
    settings[Setting.MAX_STEPS] = options.max_steps
    settings[Setting.HAS_RIGID] = faces[:, Face.RIGID].any()

    table = np.zeros((len(Mode), n))
    damping = np.zeros((n, n))
    if modes is not None:
        table = np.array(
            [modes.omega**2, -modes.base, modes.output, modes.displacement_point], float
        )
        damping = np.array(modes.damping_matrix, float, order="C")

    # Friction work, slip and loss of each interface.
    for load in faces[:, Face.LOAD]:
        work = load * scales[0]
        scales += [work, scales[0], work]
    scales = np.append(scales, np.ones(N_INTEGRALS))
    return Rig(table, damping, rows, faces, signal.pieces, signal.tones, scales, settings)


def make_start(rig: Rig, interfaces, start=None) -> np.ndarray:
    """Return the state (n,) at the start; `start` has modal coordinates z and velocities v.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    interfaces : sequence of Interface
        Law, load and slide per modal coordinate of each interface.
    start : InitialState, optional
        Modal coordinates [m] and velocities [m/s].
    """
    n = rig.modes.shape[1]
    y = np.zeros(rig.scales.size)
    if start is not None:
        y[:n] = start.z
        y[n : 2 * n] = start.v
    states = [state for one in interfaces for state in one.law.states]
    y[2 * n : 2 * n + len(states)] = states
    for i, (law, load, _) in enumerate(interfaces):
        if law.law == "pressed_springs":
            first = 2 * n + int(rig.faces[i, Face.FIRST_STATE])
            now = load.mean + load.amplitude * np.cos(load.phase)
            if load.stiffness:
                now -= load.stiffness * float(np.dot(load.heave, y[:n]))
            y[first + 1] = max(now, 0.0)
    return y


def make_schedule(cycles: float, period: float, window: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of the cycles [s], and a code for each of them, its window.

    The code is 0 for the last cycles, in which measures are recorded (the window), and -1 for cycles before, which may
    be skipped if the motion repeats. It is -2 for cycles just before the window that are computed in any case.

    Parameters
    ----------
    cycles : float
        Cycles of the run.
    period : float
        Duration of a cycle [s].
    window : int
        Cycles of the window.
    """
    count = max(1, int(np.ceil(cycles - 1e-9)))
    number = np.arange(count)
    # Whole cycles are counted from the end of the run, so that the first one may be a part.
    ends = period * (cycles - (count - 1 - number))
    # Cycles at the end of which each is computed
    windows = np.where(number >= count - 3, -2.0, -1.0)
    windows[max(0, count - window) :] = 0.0
    return ends, windows


def list_interfaces(rig, joints) -> list[Interface]:
    """Return the friction interfaces of the records of a rig, then its nonlinear springs.

    Parameters
    ----------
    rig : model.rig.Rig
        Structure and springs.
    joints : sequence of (LawNumbers, Load)
        Law and load of each interface.
    """
    rows = rig.modes.interfaces
    interfaces = [Interface(*joint, row) for joint, row in zip(joints, rows)]
    # Springs act before rigid friction on grooves, which needs the acceleration without it.
    given = rig.springs
    if given.cubic is not None:
        spring = springs.make_cubic(given.cubic)
        interfaces.append(Interface(spring, Load(1.0), rig.modes.output))
    if given.interlock is not None:
        spring = springs.make_interlocking(*given.interlock)
        interfaces.append(Interface(spring, Load(1.0), rows[0]))
    return interfaces


class Schedule(NamedTuple):
    """Cycles of a run.

    - cycles: number of drive cycles, which may be fractional
    - window: cycles at the end whose measures are recorded
    - samples (S,): rising times [s] at which the motion is stored
    - travel: largest output [m]
    """

    cycles: float
    window: int
    samples: np.ndarray
    travel: float = np.inf


def make_rig_case(
    rig, joints, schedule: Schedule, *, signal=None, rtol: float = DEFAULT_RTOL, n_steps=MIN_STEPS
) -> Case:
    """Return the case of the records of a rig.

    Parameters
    ----------
    rig : model.rig.Rig
        Structure and drive.
    joints : sequence of (LawNumbers, Load)
        Law and load of each interface.
    schedule : Schedule
        Cycles, window and samples.
    signal : optional
        Drive in place of that of the rig.
    rtol : float
        Tolerance of a step.
    n_steps : float
        Smallest number of steps per shortest period of drive and load.
    """
    modes = rig.modes
    drive = rig.drive.signal if signal is None else signal
    signal = make_signal(drive)
    interfaces = list_interfaces(rig, joints)

    # Further steps per cycle that a run may take
    max_steps = MAX_STEPS + 100 * schedule.cycles
    options = Options(drive.moving, schedule.travel, rtol, max_steps, n_steps)
    arrays = make_rig(
        modes, signal, interfaces, find_sizes(modes, signal, drive, rig.start), options
    )
    ends = make_schedule(schedule.cycles, signal.period, schedule.window)
    return Case(
        arrays, make_start(arrays, interfaces, rig.start), *ends, np.asarray(schedule.samples, float),
        len(joints), rig.first_mode.stiffness,
    )  # fmt: skip


def find_sizes(modes: ModalBasis, signal: Signal, drive, start=None) -> tuple[float, float]:
    """Estimate displacement [m] and speed [m/s] of the slides and the output, as if there were no friction.

    A mode above the frequency of the drive follows it by its stiffness, one below by its inertia.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    signal : Signal
        Drive in the form of the engine, which has the period.
    drive
        Drive of the signal, which has the largest acceleration.
    start : InitialState, optional
        Modal coordinates [m] and velocities [m/s]; at rest by default.
    """
    rows = np.vstack([modes.interfaces, modes.output])
    omega = 2 * np.pi / signal.period
    response = np.abs(modes.base) / np.maximum(omega, modes.omega) ** 2
    size = find_max_acceleration(drive) * (np.abs(rows) @ response).max(initial=0.0)
    speed = omega * size
    if start is not None:
        speeds = np.append(rows @ np.asarray(start.v), omega * (rows @ np.asarray(start.z)))
        speed = max(speed, np.abs(speeds).max())
    return speed / omega, speed


def make_arrays(case: Case, n_events: int = 0) -> tuple[State, Record]:
    """Return the State at the start of a case, and its empty Record with rows for `n_events` events."""
    rig = case.rig
    n_faces = rig.faces.shape[0]
    n = case.y.size
    n_observed = Probe.FACES + Probe.COUNT * n_faces
    clock = np.zeros(len(Clock))
    clock[Clock.STEP] = 0.1 * rig.settings[Setting.LONGEST_STEP]

    # Memories of laws that have not moved.
    memory = np.zeros((n_faces, Memory.STACK + 2 * REVERSALS))
    memory[:, [Memory.CONTACT, Memory.COUNT, Memory.VIRGIN]] = 1.0
    for i in range(n_faces):
        law = LAWS[int(rig.faces[i, Face.LAW])]
        memory[i, Memory.FLAG] = law == "bouc_wen"
        memory[i, Memory.COUNT] = law == "pressed_springs"
        if law in ("bonds", "lugre"):
            memory[i, Memory.FLAG] = -1.0

    state = State(
        case.y.copy(),
        memory,
        clock,
        np.zeros((N_STATE_ROWS, n)),
        np.full((5, n_faces, Margin.AFTER), np.inf),
        np.zeros((N_NODES + 1, n_observed + 3 + n_faces)),
        np.zeros((n_faces, n_faces)),
    )

    # Schedule and samples hold their times already; extremes begin without a value.
    cycles = np.zeros((case.ends.size, len(Cycle)))
    cycles[:, Cycle.END] = case.ends
    cycles[:, Cycle.WINDOW] = case.windows
    cycles[:, [Cycle.MIN, Cycle.MIN_SLIDE]] = np.inf
    cycles[:, [Cycle.MAX, Cycle.MAX_SLIDE]] = -np.inf
    extremes = np.tile([np.inf, -np.inf], (n_observed, 1))
    integrals = np.zeros((n_observed, len(Integral)))
    faces = np.zeros((n_faces, len(Window)))
    width = 1 + n + 3 * n_faces + 2
    samples = np.zeros((case.samples.size, width))
    samples[:, 0] = case.samples
    events = np.zeros((n_events, width))
    return state, Record(cycles, extremes, integrals, faces, samples, events)
