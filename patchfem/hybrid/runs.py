"""Runs of cases with measures, errors and histories.

The error of a measure is ERROR_FACTOR times its change in a run whose steps have a tolerance that is larger by COARSE and
may be twice as long, plus ERROR_FLOOR times the tolerance of the step times the value.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .. import compiled
from ..core import ModalBasis, Response
from .cases import Case, make_batch
from .measures import compute_measures
from .records import (
    N_FACE_INTEGRALS,
    N_INTEGRALS,
    Clock,
    Cycle,
    Face,
    Margin,
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
N_EVENTS = 20_000  # events that a single run stores
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
    Status.TOO_STIFF: "a law stretches by less than a millionth of its slide before it slips; use law 'coulomb' instead",
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
    - values, errors: measures of the last window by name, and their errors
    - levels: values and errors of every window
    - extremes (c, 2), phasors (c,): smallest and largest output [m] and phasor of the output [m] of each cycle
    - rows (k, m): stored samples and events in the order of time, see `records.Record`
    - event_rows (e, m): the events
    - final: arrays of the engine at the end
    - n_steps: number of steps
    """

    case: Case
    status: Status
    message: str
    values: dict
    errors: dict
    levels: tuple
    extremes: np.ndarray
    phasors: np.ndarray
    rows: np.ndarray
    event_rows: np.ndarray
    final: State
    n_steps: int

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

    def make_response(self, modes: ModalBasis, drive) -> Response:
        """Return the stored samples as histories.

        Forces, slides, slips and loads of several interfaces are columns of `forces`, `slides`, `slide_rates`,
        `slips`; "ledger" has friction work, stored, dissipated and created energy [J].
        """
        rows = self.rows
        rig = self.case.rig
        n, n_faces, m = rig.modes.shape[1], rig.faces.shape[0], self.case.n_friction
        time, z, rate = rows[:, 0], rows[:, 1 : 1 + n], rows[:, 1 + n : 1 + 2 * n]
        first = 1 + self.case.y.size - N_INTEGRALS - N_FACE_INTEGRALS * n_faces
        integrals = rows[:, first : first + N_FACE_INTEGRALS * n_faces].reshape(
            -1, n_faces, N_FACE_INTEGRALS
        )
        forces = rows[:, 1 + self.case.y.size :][:, :n_faces]
        loads = rows[:, 1 + self.case.y.size + n_faces :][:, :n_faces]

        # Accelerations follow from eq. 3.4, relative to the base.
        push = drive.values(time)
        base = push if drive.moving else np.zeros_like(push)
        acceleration = (
            -np.outer(push, modes.base) - rate @ modes.damping_matrix.T - z * modes.omega**2
        )
        acceleration -= forces @ rig.rows[0] / modes.mass

        slides, slide_rates = z @ rig.rows[0, :m].T, rate @ rig.rows[0, :m].T
        work, slips, loss = integrals[:, :m, 0], integrals[:, :m, 1], integrals[:, :m, 2]
        extra = {
            "ledger": np.stack(
                [work.sum(1), (work - loss).sum(1), loss.sum(1), np.zeros(time.size)]
            )
        }
        if m and rig.faces[0, Face.SWING]:
            extra["normal_load"] = loads[:, 0]
        if m > 1:
            extra |= {
                "slides": slides,
                "slide_rates": slide_rates,
                "forces": forces[:, :m],
                "slips": slips,
            }

        still = np.zeros(time.size)
        return Response(
            time, z, rate,
            slides[:, 0] if m else z @ modes.slide, slide_rates[:, 0] if m else rate @ modes.slide,
            z @ modes.output, rate @ modes.output, acceleration @ modes.output + base, base,
            forces[:, 0] if m else still, slips[:, 0] if m else still, extra,
        )  # fmt: skip


def run_batch(cases, n_events: int = 0, states: State | None = None) -> Batch:
    """Run cases whose arrays have the same shapes in one compiled loop.

    Parameters
    ----------
    cases : sequence of Case
    n_events : int
        Number of events that a case can store.
    states : State, optional
        States at the start in place of those of the cases; they are changed.
    """
    rigs, own_states, records = make_batch(cases, n_events)
    states = own_states if states is None else states
    start = states.y.copy()
    compiled.load("hybrid.engine_kernels").run_cases(rigs, states, records)
    model = {"n_friction": cases[0].n_friction, "stiffness": cases[0].first_stiffness}
    with np.errstate(invalid="ignore", divide="ignore"):
        windows = [
            compute_measures(rigs, states, records, w, start, **model)
            for w in range(records.whole.shape[1])
        ]
    return Batch(rigs, states, records, start, windows)


def estimate_errors(values: dict, coarse: dict, rtol: float) -> dict:
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
        change = value - coarse[name]
        if name == "slip_start_phase":
            change = (change + np.pi / 2) % np.pi - np.pi / 2
        errors[name] = ERROR_FACTOR * np.abs(change) + ERROR_FLOOR * rtol * np.abs(value)
    return errors


def run_with_errors(cases) -> tuple[Batch, list[dict]]:
    """Run cases; return them with the errors of each window by name."""
    fine = run_batch(cases)
    return fine, _compare(cases, fine)


def _compare(cases, fine: Batch) -> list[dict]:
    """Return the errors of each window from a run with larger steps."""
    rtol = float(cases[0].rig.settings[Setting.RTOL])
    coarse = run_batch([case.with_tolerance(COARSE * rtol, COARSE_STEP) for case in cases])
    return [
        estimate_errors(values, rough, rtol) for values, rough in zip(fine.windows, coarse.windows)
    ]


def run_case(case: Case, *, has_errors: bool = True) -> Motion:
    """Run a single case as a batch of one; a run that ends early has the measures of its last cycles."""
    batch = run_batch([case], N_EVENTS)
    status = Status(int(batch.states.clock[0, Clock.STATUS]))
    if status in (Status.EXCEEDS_TRAVEL, Status.LEAVES_GROOVES):
        case = case.until(batch.states.clock[0, Clock.TIME])
        batch = run_batch([case], N_EVENTS)

    # Errors from a run with larger steps, for the window of every level.
    _, states, records = batch[:3]
    clock = states.clock[0]
    n_cycles = int(clock[Clock.N_CYCLES])
    errors = [{} for _ in batch.windows]
    if has_errors and clock[Clock.STATUS] == Status.DONE:
        errors = _compare([case], batch)
    values = [{name: float(value[0]) for name, value in window.items()} for window in batch.windows]
    errors = [{name: float(error[0]) for name, error in window.items()} for window in errors]
    levels = tuple(zip(values, errors))

    samples = records.samples[0]
    samples = samples[: int(clock[Clock.SAMPLE])]
    samples = samples[~np.isnan(samples[:, 0])]
    event_rows = records.events[0][: min(int(clock[Clock.N_EVENTS]), N_EVENTS)]
    rows = np.concatenate([samples, event_rows])

    cycles = records.cycles[0, :n_cycles]
    duration = np.diff(cycles[:, Cycle.END], prepend=0.0)
    message = MESSAGES.get(status, "").format(steps=case.rig.settings[Setting.MAX_STEPS])
    return Motion(
        case=case,
        status=status,
        message=message,
        values=values[-1],
        errors=errors[-1],
        levels=levels,
        extremes=cycles[:, [Cycle.MIN, Cycle.MAX]],
        phasors=2 / duration * (cycles[:, Cycle.COS] - 1j * cycles[:, Cycle.SIN]),
        rows=rows[np.argsort(rows[:, 0], kind="stable")],
        event_rows=event_rows,
        final=states,
        n_steps=int(clock[Clock.N_STEPS]),
    )
