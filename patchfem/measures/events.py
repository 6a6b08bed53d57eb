"""Events and free vibration of a rig in stick and slip, and the drive level at which slip begins.

In: event rows of an engine, the window of a run, or a `DriveLevel` for each drive level in chronological order. Out: the
stick-slip `Events`, whether interfaces stick, the `VibratingMode`s of a rig whose interfaces all stick, which are
eigenvectors of the rig with its interfaces as springs, and the two levels that bracket the onset of slip.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..core import array_dataclass
from ..formatting import format_length
from .measures import Values, estimate_slip_round_off
from .rows import AMPLITUDE, select_names

# Kinds of events, as indices of EVENT_KIND_NAMES.
STOP_KIND = 0
RELEASE_UP = 1
RELEASE_DOWN = 2
REVERSAL_UP = 3
REVERSAL_DOWN = 4
SEGMENT_BORDER = 5
EVENT_KIND_NAMES = ("stop", "release_up", "release_down", "reversal_up", "reversal_down", "border")


class Events(NamedTuple):
    """Last events of a run in chronological order, at most 100 000.

    - time (k,): time [s].
    - interface (k,): number of the interface, from 1; 0 for the border between two segments of the
      drive.
    - kind (k,): index of EVENT_KIND_NAMES; "up" means towards positive slip.
    - slide (k,): relative displacement [m].
    """

    time: np.ndarray
    interface: np.ndarray
    kind: np.ndarray
    slide: np.ndarray


def sort_events(rows) -> Events:
    """Return the last 100 000 events in the order of time.

    Each of the rows has time [s], number of the interface, index of EVENT_KIND_NAMES and relative displacement [m].
    """
    rows = np.array(rows, float).reshape(-1, 4)
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))][-100_000:]
    time, interface, kind, slide = rows.T.copy()
    return Events(time, interface.astype(np.int32), kind.astype(np.int8), slide)


def classify_changes(before, after) -> np.ndarray:
    """Return the kind of each change from one stick-slip state to another one.

    Parameters
    ----------
    before, after : (k,)
        States: +1 or -1 for slip in this direction, 0 for stick.
    """
    is_reversal = (before != 0) & (after != 0)
    upwards = np.where(is_reversal, REVERSAL_UP, RELEASE_UP)
    downwards = np.where(is_reversal, REVERSAL_DOWN, RELEASE_DOWN)
    return np.where(after == 0, STOP_KIND, np.where(after > 0, upwards, downwards))


def join_events(parts: list[Events], shifts: list[float]) -> Events:
    """Join the events of successive runs, with a border between segments of the drive at each start.

    Parameters
    ----------
    parts : list of Events
        Events of each run, in chronological order.
    shifts : list of float
        Start times of the runs relative to the first one [s].
    """
    rows = [(shift, 0, SEGMENT_BORDER, np.nan) for shift in shifts[1:]]
    for events, shift in zip(parts, shifts):
        rows += zip(events.time + shift, *events[1:])
    return sort_events(rows)


def find_segment_borders(drive) -> list[float]:
    """Return the times [s] at which a drive changes from one segment to the next."""
    return [segment.start for segment in drive.segments[1:]]


def is_all_stuck(window, max_stick_slip: float) -> bool:
    """Return whether no interface or band slips by more than a given distance [m] in a window.

    The limit applies to half the range of the slip, and is at least its round-off.
    """
    slips = np.column_stack([window.slip, window.slips])
    return bool(
        np.ptp(slips, axis=0).max() / 2 <= max(max_stick_slip, estimate_slip_round_off(window))
    )


class VibratingMode(NamedTuple):
    """Free vibration of a mode while all interfaces stick.

    - begin, end: start and end of the stick interval [s].
    - frequency: frequency of the damped motion [Hz].
    - damping: damping ratio [1].
    - displacement: amplitude at the output at the time `begin` [m].
    """

    begin: float
    end: float
    frequency: float
    damping: float
    displacement: float


def compute_stuck_vibration(modes, stiffness, motion) -> list[VibratingMode]:
    """Return the free vibration of each mode while all interfaces stick.

    The motion must not contain a response to a sinusoidal drive.

    Each stuck interface is a spring, and the modes are eigenvectors of the rig with these springs. In each
    mode, two states at a time distance h differ by c (exp(lambda h) - 1), independently of the equilibrium.
    This determines the amplitude c.

    Parameters
    ----------
    modes
        Modal basis of the rig.
    stiffness : (i,)
        Stiffness of each interface [N/m].
    motion : Response
        Samples of the stick interval.
    """
    n = modes.omega.size
    rows = modes.interfaces
    stiffness_matrix = np.diag(modes.omega**2) + rows.T * stiffness @ rows / modes.mass
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness_matrix, -modes.damping_matrix]])
    values, shapes = np.linalg.eig(matrix)
    state = np.concatenate([motion.modal[:2], motion.modal_rate[:2]], axis=1)
    growth = np.expm1(values * (motion.time[1] - motion.time[0]))
    # Smallest relative change between two samples from which the amplitude of a mode is computed.
    known = (values.imag > 0) & (np.abs(growth) > 1e-6)
    sizes = np.linalg.solve(shapes, (state[1] - state[0]).astype(complex))[known] / growth[known]
    # a pair of conjugate eigenvalues corresponds to one real sinusoid
    amplitudes = 2 * np.abs(modes.output @ shapes[:n, known] * sizes)
    return [
        VibratingMode(
            float(motion.time[0]),
            float(motion.time[-1]),
            eigenvalue.imag / (2 * np.pi),
            -eigenvalue.real / abs(eigenvalue),
            float(amplitude),
        )
        for eigenvalue, amplitude in zip(values[known], amplitudes)
    ]


def select_strongest(modes: list[VibratingMode]) -> VibratingMode:
    """Return the mode with the largest time integral of the squared displacement in the stick interval."""

    def energy(mode: VibratingMode) -> float:
        """Return the time integral of the squared displacement, up to a factor that all modes have."""
        decay = 4 * np.pi * mode.damping * mode.frequency * (mode.end - mode.begin)
        return mode.displacement**2 * (-np.expm1(-decay) / decay if decay else 1.0)

    return max(modes, key=energy)


LEVEL_MEASURES = select_names("level")
# Smallest ratio of the third to the first harmonic of the acceleration that indicates slip.
MIN_SLIP_DISTORTION = 0.03


@array_dataclass
class DriveLevel:
    """Measures and state of a run at the end of one drive level.

    - drive: acceleration amplitude [m s-2]; for a force drive, force over modal mass [m s-2] or force
      [N], depending on `unit`.
    - stuck: whether no interface slips.
    - values, errors: known measures and their errors by name.
    - unit: unit of `drive`.
    """

    drive: float
    stuck: bool
    values: Values
    errors: Values
    unit: str = "m s-2"


def make_onset_test(kind: str, length: float | None = None) -> Callable[[DriveLevel], bool]:
    """Return a function that decides whether a drive level lies above the onset of slip.

    Parameters
    ----------
    kind : str
        "slip": an interface slips; "distortion": H3/H1 of the acceleration exceeds MIN_SLIP_DISTORTION;
        "gauge": the amplitude at the output (half peak-to-peak) exceeds `length`.
    length : float, optional
        Limit of the amplitude for "gauge" [m].
    """
    return {
        "slip": lambda level: not level.stuck,
        "gauge": lambda level: level.values[AMPLITUDE] > length,
    }.get(
        kind, lambda level: level.values.get("acceleration_distortion", 0.0) > MIN_SLIP_DISTORTION
    )


def make_no_onset_reason(kind: str, length: float | None = None) -> str:
    """Return the sentence why no level of a drive reached its onset, which is of a given kind.

    The onset is the first level with slip ("slip"), with an amplitude above `length` [m] at the output ("gauge"), or with a
    third harmonic of the acceleration (other kinds).
    """
    event = f"has an acceleration whose third harmonic is more than {MIN_SLIP_DISTORTION:g} of its first harmonic"
    if kind == "slip":
        event = "slips"
    elif kind == "gauge":
        event = f"has an amplitude of more than {format_length(length)} at the output"
    return f"no level of the increasing sequence {event}"


def bracket_onset(levels, is_above_onset: Callable[[DriveLevel], bool]) -> tuple[int, int] | None:
    """Return the indices of the drive levels just below and just above the onset of slip.

    Only the levels before the first decrease are considered.

    Parameters
    ----------
    levels : sequence of DriveLevel
        Levels in chronological order.
    is_above_onset : callable
        Function that returns whether a level lies above the onset.

    Returns
    -------
    tuple or None
        Two indices; the first is -1 if the first level lies above the onset. None if no level lies above
        the onset.
    """
    for k, level in enumerate(levels):
        if is_above_onset(level):
            return k - 1, k
        if k + 1 < len(levels) and levels[k + 1].drive < level.drive:
            return None
    return None
