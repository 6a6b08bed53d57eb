"""Runs of cases with measures, errors and histories.

The error of a measure is ERROR_FACTOR times its change in a run whose steps have a tolerance that is larger by COARSE and
may be twice as long, plus ERROR_FLOOR times the tolerance of the step times the value.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from .. import compiled
from ..core import ModalBasis, Response
from ..structure.histories import make_response
from .cases import Case, make_batch
from .measures import compute_measures
from .records import (
    N_FACE_INTEGRALS,
    N_INTEGRALS,
    Clock,
    Cycle,
    Face,
    Margin,
    Mode,
    Record,
    Rig,
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
MAX_REPEATED = 1000  # cycles whose events are repeated where the motion repeats
SAME_PHASE_TOL = 1e-6  # difference of two phases that count as equal [cycles]
EVENT_NAMES = {
    Margin.MOTION: "stop or reversal",
    Margin.BRANCH: "change of branch",
    Margin.CONTACT: "contact lost or made",
    Margin.LIMIT: "limit of the law",
}
MESSAGES = {
    Status.EXCEEDS_TRAVEL: "the output reaches the largest travel",
    Status.LEAVES_GROOVES: "the lifted mass takes all of the load, so that the contact leaves the grooves",
    Status.TOO_MANY_STEPS: "the motion needs more than {steps:.1g} steps, because a law or a mode is much faster "
    "than the drive; use a law of lower stiffness or larger reference speed",
    Status.STEP_TOO_SMALL: "the steps become smaller than round-off, so that the motion cannot be continued",
    Status.TOO_STIFF: "a law stretches by less than 1e-8 of its slide before it slips; use law 'coulomb' instead",
    Status.NO_PROGRESS: "the laws change their regime again and again without progress in time",
}


class Batch(NamedTuple):
    """Cases after a run: arrays of the engine, states at the start, and values of each window by name (c,)."""

    rigs: Rig
    states: State
    records: Record
    start: np.ndarray
    windows: list[dict]


class Event(NamedTuple):
    """Change of regime: time [s], number of the interface, what changed (`EVENT_NAMES`), slide [m] and force [N]."""

    time: float
    interface: int
    kind: str
    slide: float
    force: float


@dataclass(frozen=True, eq=False, slots=True)
class Motion:
    """Motion of a single case.

    - case: the case
    - status, message: how the run ended, and in words if it ended early
    - values: measures of the last window by name
    - extremes (c, 2), phasors (c,): smallest and largest output [m] and phasor of the output [m] of each cycle
    - rows (k, m): stored samples and events in the order of time, see `records.Record`; an event follows a sample at
      its time
    - event_rows (e, m): the first events, see N_EVENTS
    - time: end of the motion [s]
    - repeats: whether the motion repeats after each cycle before the last ones
    - final: arrays of the engine at the end
    - n_steps: number of steps
    """

    case: Case
    status: Status
    message: str
    values: dict[str, float]
    extremes: np.ndarray
    phasors: np.ndarray
    rows: np.ndarray
    event_rows: np.ndarray
    final: State
    n_steps: int
    time: float
    repeats: bool

    @property
    def events(self) -> list[Event]:
        """Events of the friction interfaces."""
        y_size = self.case.y.size
        slides = self._slides(self.event_rows)
        return [
            Event(
                row[0],
                int(row[-2]),
                EVENT_NAMES[int(row[-1])],
                slide[int(row[-2])],
                row[1 + y_size + int(row[-2])],
            )
            for row, slide in zip(self.event_rows, slides)
        ]

    def _slides(self, rows) -> np.ndarray:
        """Return the slides (k, i) [m] of the interfaces at rows."""
        n = self.case.rig.modes.shape[1]
        return rows[:, 1 : 1 + n] @ self.case.rig.rows[0].T

    def _columns(self, rows, number: int) -> np.ndarray:
        """Return forces (0), loads (1) or directions (2) of the friction interfaces (k, i) at rows."""
        first = 1 + self.case.y.size + number * self.case.rig.faces.shape[0]
        return rows[:, first : first + self.case.n_friction]

    def find_directions(self) -> np.ndarray:
        """Return the directions (e + 1, i) of slip of the friction interfaces at the start and after each event.

        They are 0 while a rigid interface rests, and while all elements of an interface stick.
        """
        return self._columns(np.concatenate([self.rows[:1], self.event_rows]), 2)

    def list_reversals(self, interface: int) -> np.ndarray:
        """Return times [s] and slides [m] (k, 2) at which the motion of an interface starts and reverses."""
        is_own = (self.event_rows[:, -2] == interface) & (self.event_rows[:, -1] == Margin.MOTION)
        rows = np.concatenate([self.rows[:1], self.event_rows[is_own]])
        return np.stack([rows[:, 0], self._slides(rows)[:, interface]], axis=1)

    def find_energies(self) -> dict[str, float]:
        """Return the energies [J] of the whole motion.

        - "work_in", "power": work of the drive and the sum of its magnitudes over the steps
        - "viscous", "friction": energies that dampers and friction dissipate
        - "stored", "peak_stored": change of the stored energy, and the largest energy of the modes
        """
        n_faces = self.case.rig.faces.shape[0]
        y = self.final.y[0]
        first = y.size - N_INTEGRALS - N_FACE_INTEGRALS * n_faces
        work, _, loss = y[first : y.size - N_INTEGRALS].reshape(n_faces, N_FACE_INTEGRALS).T
        clock = self.final.clock[0]
        change = self._find_modal_energy(y) - self._find_modal_energy(self.case.y)
        return {
            "work_in": float(y[-4]),
            "viscous": float(y[-3]),
            "power": float(clock[Clock.EXCHANGED]),
            "friction": float(loss.sum()),
            "stored": float(change + (work - loss).sum()),
            "peak_stored": float(clock[Clock.STORED]),
        }

    def _find_modal_energy(self, y) -> float:
        """Return the energy of the modes [J] in a state."""
        n = self.case.rig.modes.shape[1]
        squares = y[n : 2 * n] ** 2 + self.case.rig.modes[Mode.STIFFNESS] * y[:n] ** 2
        return 0.5 * self.case.rig.settings[Setting.MASS] * float(squares.sum())

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
        time = rows[:, 0]
        z = rows[:, 1 : 1 + n]
        rate = rows[:, 1 + n : 1 + 2 * n]
        first = 1 + self.case.y.size - N_INTEGRALS - N_FACE_INTEGRALS * n_faces
        integrals = rows[:, first : first + N_FACE_INTEGRALS * n_faces].reshape(
            len(rows), n_faces, N_FACE_INTEGRALS
        )
        forces = rows[:, 1 + self.case.y.size :][:, :n_faces]

        slides = z @ rig.rows[0, :m].T
        slide_rates = rate @ rig.rows[0, :m].T
        # The velocity of a rigid interface at rest is round-off.
        rests = (self._columns(rows, 2) == 0) & (rig.faces[:m, Face.RIGID] > 0)
        slide_rates[rests] = 0.0

        work = integrals[:, :m, 0]
        loss = integrals[:, :m, 2]
        slips = integrals[:, :m, 1] + self.case.y[:n] @ rig.rows[0, :m].T
        extra = {
            "ledger": np.stack(
                [work.sum(1), (work - loss).sum(1), loss.sum(1), np.zeros(time.size)]
            )
        }

        if m and rig.faces[0, Face.SWING]:
            extra["normal_load"] = self._columns(rows, 1)[:, 0]
        if m > 1:
            extra |= {
                "slides": slides,
                "slide_rates": slide_rates,
                "forces": forces[:, :m],
                "slips": slips,
            }

        still = np.zeros(time.size)
        interface = (z @ modes.slide, rate @ modes.slide, still, still)
        if m:
            interface = (slides[:, 0], slide_rates[:, 0], forces[:, 0], slips[:, 0])
        pull = forces @ rig.rows[0]
        return make_response(
            modes, drive, drive.values(time), (time, z, rate), pull, interface, extra
        )


def run_batch(
    cases, n_events: int = 0, states: State | None = None, *, has_windows: bool = True
) -> Batch:
    """Run cases whose arrays have the same shapes in one compiled loop.

    Parameters
    ----------
    cases : sequence of Case
        Rigs of equal shape, with their states at the start.
    n_events : int
        Number of events that a case can store.
    states : State, optional
        States at the start in place of those of the cases; they are changed.
    has_windows : bool
        Whether the measures of the windows are computed.
    """
    rigs, own_states, records = make_batch(cases, n_events)
    states = own_states if states is None else states
    start = states.y.copy()
    compiled.load("hybrid.engine_kernels").run_cases(rigs, states, records)
    if not has_windows:
        return Batch(rigs, states, records, start, [])
    stiffness = np.array([case.first_stiffness for case in cases])
    model = {"n_friction": cases[0].n_friction, "stiffness": stiffness}
    with np.errstate(invalid="ignore", divide="ignore"):
        windows = [
            compute_measures(rigs, states, records, w, start, **model)
            for w in range(records.whole.shape[1])
        ]
    return Batch(rigs, states, records, start, windows)


def estimate_errors(
    values: dict[str, np.ndarray], coarse: dict[str, np.ndarray], rtol: float
) -> dict[str, np.ndarray]:
    """Return the errors of measures from those of a run with larger steps.

    Parameters
    ----------
    values, coarse : dict
        Arrays (c,) of a run and of the comparison run by name.
    rtol : float
        Step tolerance of the run.
    """
    errors = {}
    for name, value in values.items():
        with np.errstate(invalid="ignore"):
            # The extremes of a window without steps are infinite in both runs.
            change = value - coarse[name]
        if name == "slip_start_phase":
            change = (change + np.pi / 2) % np.pi - np.pi / 2
        errors[name] = ERROR_FACTOR * np.abs(change) + ERROR_FLOOR * rtol * np.abs(value)
    return errors


def run_case(
    case: Case,
    *,
    start: State | None = None,
    fills_histories: bool = True,
) -> Motion:
    """Run a single case as a batch of one.

    Parameters
    ----------
    case : Case
        Rig and state at the start.
    start : State, optional
        End of another motion of the same rig, from which the case goes on at t = 0; default: the start of the case.
    fills_histories : bool
        Whether samples and events of cycles are added that repeat an earlier one and are not computed.
    """
    n_parts = case.ends.size + len(case.rig.pieces)
    n_events = min(N_EVENTS, MIN_EVENTS + EVENTS_PER_PART * n_parts)
    batch = run_batch([case], n_events, None if start is None else _restart(case, start))
    _, states, records = batch[:3]
    clock = states.clock[0]
    status = Status(int(clock[Clock.STATUS]))
    n_cycles = int(clock[Clock.N_CYCLES])

    cycles = records.cycles[0, :n_cycles]
    samples = records.samples[0][: int(clock[Clock.SAMPLE])]
    event_rows = records.events[0][: int(clock[Clock.N_EVENTS])]
    repeats = bool(cycles[:, Cycle.REPEATS].any())
    if repeats and fills_histories and len(samples):
        samples, event_rows = _fill_repeated_cycles(case, cycles, samples, event_rows)
    samples = samples[~np.isnan(samples[:, 0])]

    # Where a force jumps, a second row follows at the next instant.
    is_after = event_rows[:, -1] == Margin.AFTER
    after_rows = event_rows[is_after]
    after_rows[:, 0] = np.nextafter(after_rows[:, 0], np.inf)
    event_rows = event_rows[~is_after]
    rows = np.concatenate([samples, event_rows, after_rows])

    duration = np.diff(cycles[:, Cycle.END], prepend=0.0)
    return Motion(
        case=case if start is None else replace(case, y=batch.start[0]),
        status=status,
        message=MESSAGES.get(status, "").format(steps=case.rig.settings[Setting.MAX_STEPS]),
        values={name: float(value[0]) for name, value in batch.windows[0].items()},
        extremes=cycles[:, [Cycle.MIN, Cycle.MAX]],
        phasors=2 / duration * (cycles[:, Cycle.COS] - 1j * cycles[:, Cycle.SIN]),
        rows=rows[np.argsort(rows[:, 0], kind="stable")],
        event_rows=event_rows,
        final=states,
        n_steps=int(clock[Clock.N_STEPS]),
        time=float(clock[Clock.TIME]),
        repeats=repeats,
    )


def _fill_repeated_cycles(case: Case, cycles, samples, event_rows) -> tuple[np.ndarray, np.ndarray]:
    """Return samples and events with those of the cycles that repeat an earlier one and were not computed.

    Parameters
    ----------
    case : Case
        Case that was run.
    cycles : (C, 12) array
        Rows of the cycles.
    samples : (S, m) array
        NaN at times of these cycles.
    event_rows : (e, m) array
        Rows of the events.
    """
    skipped = np.flatnonzero(cycles[:, Cycle.REPEATS])
    last = skipped[0] - 1
    end = cycles[last, Cycle.END]
    period = float(case.rig.settings[Setting.PERIOD])

    # Integrals grow by the same amount in each of these cycles and in the last one.
    n_faces = case.rig.faces.shape[0]
    integrals = slice(1 + case.y.size - N_INTEGRALS - N_FACE_INTEGRALS * n_faces, 1 + case.y.size)
    known = samples[~np.isnan(samples[:, 0])]
    before = np.argmin(np.abs(known[:, 0] - (known[-1, 0] - period)))
    gain = known[-1, integrals] - known[before, integrals]

    def repeat(rows, sources, counts) -> np.ndarray:
        """Return rows that are repeated after a number of periods."""
        repeated = rows[sources]
        repeated[:, 0] += counts * period
        repeated[:, integrals] += counts[:, None] * gain
        return repeated

    # Samples have the same phases in all cycles; the last computed cycle has all of them from its start on, but perhaps
    # not the one at its end.
    missing = case.samples[: len(samples)][np.isnan(samples[:, 0])]
    counts = np.floor((missing - end) / period + SAME_PHASE_TOL) + 1
    sources = np.searchsorted(known[:, 0], missing - counts * period - SAME_PHASE_TOL * period)
    filled = np.concatenate([known, repeat(known, sources, counts)])

    in_last = np.flatnonzero((event_rows[:, 0] > end - period) & (event_rows[:, 0] <= end))
    kept = np.unique(np.linspace(1, skipped.size, min(skipped.size, MAX_REPEATED)).round())
    events = repeat(event_rows, np.tile(in_last, kept.size), np.repeat(kept, in_last.size))
    events = np.concatenate([event_rows, events])
    return filled[np.argsort(filled[:, 0])], events[np.argsort(events[:, 0], kind="stable")]


def _restart(case: Case, end: State) -> State:
    """Return the state at the end of a motion as the start of another one, with integrals and clock at 0."""
    state = State(*(array.copy() for array in end))
    n_faces = case.rig.faces.shape[0]
    state.y[:, case.y.size - N_INTEGRALS - N_FACE_INTEGRALS * n_faces :] = 0.0
    step = state.clock[:, Clock.STEP].copy()
    sizes = state.clock[:, [Clock.OUTPUT_SIZE, Clock.OUTPUT_SPEED]].copy()
    state.clock[:] = 0.0
    state.clock[:, Clock.STEP] = step
    state.clock[:, [Clock.OUTPUT_SIZE, Clock.OUTPUT_SPEED]] = sizes
    return state
