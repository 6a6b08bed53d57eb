"""Runs of a case with measures, errors and histories.

The error of a measure is ERROR_FACTOR times its change in a run whose steps have a tolerance that is larger by COARSE and
may be twice as long, plus ERROR_FLOOR times the tolerance of the step times the value.
"""

from dataclasses import dataclass, replace

import numpy as np

from .. import kernel_cache
from ..core import ModalBasis, Response
from ..structure.histories import make_response
from . import stored_energy
from .cases import Case, make_arrays
from .measures import compute_measures, split_integrals
from .records import (
    N_INTEGRALS,
    Clock,
    Cycle,
    Face,
    Margin,
    Memory,
    Record,
    Setting,
    State,
    Status,
)

COARSE = 30.0  # ratio of the step tolerances of the comparison run and of the run
COARSE_STEP = 2.0  # ratio of their longest steps
ERROR_FACTOR = 3.0  # safety; on 150 random rigs 97 % of the errors of each measure hold, with 1 instead of 3 94 %
ERROR_FLOOR = 10.0  # smallest error of a value, relative to the step tolerance
N_EVENTS = 200_000  # events that a single run stores at most
MIN_EVENTS = 1000  # events for which it has room in any case, with EVENTS_PER_PART for each cycle and piece of the drive
EVENTS_PER_PART = 100
MESSAGES = {
    Status.EXCEEDS_TRAVEL: "the output reaches the largest travel",
    Status.LEAVES_GROOVES: "the lifted mass takes all of the load, so that the contact leaves the grooves",
    Status.TOO_MANY_STEPS: "the motion needs more than {steps:.1g} steps, because a law or a mode is much faster "
    "than the drive; use a law of lower stiffness or larger reference speed",
    Status.STEP_TOO_SMALL: "the steps become smaller than round-off, so that the motion cannot be continued",
    Status.TOO_STIFF: "a law stretches by less than 1e-8 of its slide before it slips; use law 'coulomb' instead",
    Status.NO_PROGRESS: "the laws change their regime again and again without progress in time",
}


@dataclass(frozen=True, eq=False, slots=True)
class Motion:
    """Motion of a case.

    - case: the case
    - first_memory (M, l): memory of the interfaces at the start, see `records.State`
    - status, message: how the run ended, and in words if it ended early
    - values: measures of the window and of the whole run by name
    - extremes (c, 2), phasors (c,): smallest and largest output [m] and phasor of the output [m] of each cycle
    - rows (k, m): stored samples and events in the order of time, see `records.Record`; an event follows a sample at
      its time
    - event_rows (e, m): the first events, see N_EVENTS
    - time: end of the motion [s]
    - repeats: whether the motion repeats after each cycle before the last ones
    - final, record: arrays of the engine at the end
    - n_steps: number of steps
    """

    case: Case
    first_memory: np.ndarray
    status: Status
    message: str
    values: dict[str, float]
    extremes: np.ndarray
    phasors: np.ndarray
    rows: np.ndarray
    event_rows: np.ndarray
    final: State
    record: Record
    n_steps: int
    time: float
    repeats: bool

    def _columns(self, rows, number: int) -> np.ndarray:
        """Return forces (0), loads (1) or directions (2) of the friction interfaces (k, i) at rows."""
        first = 1 + self.case.y.size + number * self.case.rig.faces.shape[0]
        return rows[:, first : first + self.case.n_friction]

    def find_directions(self) -> np.ndarray:
        """Return the directions (e + 1, i) of slip of the friction interfaces at the start and after each event.

        They are 0 while a rigid interface rests, and while all elements of an interface stick.
        """
        return self._columns(np.concatenate([self.rows[:1], self.event_rows]), 2)

    def make_response(self, modes: ModalBasis, drive) -> Response:
        """Return the stored samples as histories.

        Forces, slides, slips and loads of several interfaces are columns of `forces`, `slides`, `slide_rates`,
        `slips`; "ledger" has friction work, stored, dissipated and created energy [J]. A slip starts from the slide at the
        start of the motion.
        """
        rows = self.rows
        rig = self.case.rig
        n = rig.modes.shape[1]
        n_faces = rig.faces.shape[0]
        m = self.case.n_friction
        # Columns of a row: time, state y (coordinates, rates, states of laws, integrals), forces, loads, directions.
        time = rows[:, 0]
        z = rows[:, 1 : 1 + n]
        rate = rows[:, 1 + n : 1 + 2 * n]
        integrals = split_integrals(self.case, rows[:, 1 : 1 + self.case.y.size])
        forces = rows[:, 1 + self.case.y.size :][:, :n_faces]

        # Relative displacement and velocity of each friction interface.
        slides = z @ rig.rows[0, :m].T
        slide_rates = rate @ rig.rows[0, :m].T
        # The velocity of a rigid interface at rest is round-off.
        rests = (self._columns(rows, 2) == 0) & (rig.faces[:m, Face.RIGID] > 0)
        slide_rates[rests] = 0.0

        # The integrals are friction work, irreversible slide and loss. Work that is not lost is stored; none is created.
        work = integrals[:, :m, 0].sum(1)
        loss = integrals[:, :m, 2].sum(1)
        supplied = work
        if m:
            supplied = work + stored_energy.compute_stored_energy(self.case, self.first_memory)
        slips = integrals[:, :m, 1] + self.case.y[:n] @ rig.rows[0, :m].T
        ledger = [work, np.maximum(supplied - loss, 0.0), loss, np.zeros(time.size)]
        extra = {"ledger": np.stack(ledger)}

        if m and rig.faces[0, Face.SWING]:
            extra["normal_load"] = self._columns(rows, 1)[:, 0]
        interfaces = (slides, slide_rates, forces[:, :m], slips)
        pull = forces @ rig.rows[0]
        return make_response(
            modes, drive, drive.values(time), (time, z, rate), pull, interfaces, extra
        )


def estimate_error(change, value, rtol: float):
    """Return the error of a value, or of several, from its change in a run with larger steps.

    Parameters
    ----------
    change, value : float or (..., k) array
        Difference of the values of both runs, and the value of the run.
    rtol : float
        Step tolerance of the run.
    """
    return ERROR_FACTOR * np.abs(change) + ERROR_FLOOR * rtol * np.abs(value)


def run_case(case: Case, *, start: State | None = None) -> Motion:
    """Run a case.

    Parameters
    ----------
    case : Case
        Rig and state at the start.
    start : State, optional
        End of another motion of the same rig, from which the case goes on at t = 0; default: the start of the case.
    """
    n_parts = case.ends.size + len(case.rig.pieces)
    n_needed = min(N_EVENTS, MIN_EVENTS + EVENTS_PER_PART * n_parts)
    n_events = 0
    # Without room for all events the histories would lack those of the last cycles, so that the motion is repeated.
    while n_events < n_needed:
        n_events = n_needed
        state, record = make_arrays(case, n_events)
        if start is not None:
            state = _restart(case, start)
            case = replace(case, y=state.y.copy())
        first_memory = state.memory.copy()
        if start is None:
            # Without a motion before, no law has a stretch.
            slides = case.rig.rows[0] @ case.y[: case.rig.modes.shape[1]]
            first_memory[:, Memory.ORIGIN] = slides
        kernel_cache.load_compiled_module("event_driven.engine_kernels").run_case(
            case.rig, state, record
        )
        clock = state.clock
        n_needed = min(N_EVENTS, int(clock[Clock.N_EVENTS]))
    status = Status(int(clock[Clock.STATUS]))
    with np.errstate(invalid="ignore", divide="ignore"):
        values = compute_measures(case, state, record)

    # A curve keeps the records of all of its motions, so that the room for further events is released.
    event_rows = record.events[: int(clock[Clock.N_EVENTS])].copy()
    record = record._replace(events=event_rows)

    # Where a force jumps, a second row follows at the next instant.
    cycles = record.cycles[: int(clock[Clock.N_CYCLES])]
    is_after = event_rows[:, -1] == Margin.AFTER
    after_rows = event_rows[is_after]
    after_rows[:, 0] = np.nextafter(after_rows[:, 0], np.inf)
    event_rows = event_rows[~is_after]
    rows = np.concatenate([record.samples[: int(clock[Clock.SAMPLE])], event_rows, after_rows])

    duration = np.diff(cycles[:, Cycle.END], prepend=0.0)
    return Motion(
        case=case,
        first_memory=first_memory,
        status=status,
        message=describe_end(case, status),
        values={name: float(value) for name, value in values.items()},
        extremes=cycles[:, [Cycle.MIN, Cycle.MAX]],
        phasors=2 / duration * (cycles[:, Cycle.COS] - 1j * cycles[:, Cycle.SIN]),
        rows=rows[np.argsort(rows[:, 0], kind="stable")],
        event_rows=event_rows,
        final=state,
        record=record,
        n_steps=int(clock[Clock.N_STEPS]),
        time=float(clock[Clock.TIME]),
        repeats=bool(cycles[:, Cycle.REPEATS].any()),
    )


def describe_end(case: Case, status: Status) -> str:
    """Return why a run of a case ended early, or "" for the end of its last cycle."""
    return MESSAGES.get(status, "").format(steps=case.rig.settings[Setting.MAX_STEPS])


def _restart(case: Case, end: State) -> State:
    """Return the state at the end of a motion as the start of another one, with integrals and clock at 0."""
    state = State(*(array.copy() for array in end))
    split_integrals(case, state.y)[:] = 0.0
    state.y[-N_INTEGRALS:] = 0.0
    kept = [Clock.STEP, Clock.OUTPUT_SIZE, Clock.OUTPUT_SPEED]
    values = state.clock[kept]
    state.clock[:] = 0.0
    state.clock[kept] = values
    return state
