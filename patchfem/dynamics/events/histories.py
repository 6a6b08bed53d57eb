"""Run of the event-driven solver, with samples, extremes, energies and events."""

from dataclasses import dataclass, field, replace
from math import ceil

import numpy as np

from ...compiled import load, set_compile_callback
from ...core import (
    InitialState,
    ModalBasis,
    NotConverged,
    Outcome,
    PatchfemError,
    Response,
    frozen_array,
)
from ...cost_model import PYTHON_READ_TIME_RATIO
from ...structure.drive_sizes import choose_samples_per_cycle
from ..cycles import SAMPLES_PER_CYCLE, choose_sample_times
from ..event_list import DRIVE_CHANGE, MAX_EVENTS, RELEASE, REVERSAL, STOP, EventLog
from .cost import estimate_cycle_time, estimate_sample_time
from .elements import (
    element_stretches,
    make_element_table,
    make_unstretched_memory,
)
from .modal_system import (
    RunArrays,
    clear_workspace,
    copy_into,
    make_initial_time_state,
    make_modal_system,
    make_previous_cycle,
    make_run_sums,
    make_workspace,
    split_time,
)
from .positions_kernels import (
    MARCH_STATUS,
    N_COLUMNS,
    ROW_BEGIN,
    Column,
    InterfaceMeasure,
    Ledger,
    PreviousStatus,
    Row,
    RunMeasure,
    Segment,
    Time,
)
from .reading import Reading, find_stick_vibration

PACKAGE = "dynamics.events"
# Number of time intervals recorded per call of the march.
ROWS_PER_CALL = 4096
# Maximum number of stored rows of reversals and slip events from before the window.
MAX_REVERSAL_ROWS = 400_000
# Maximum number of repeating cycles for which the reversals are stored.
MAX_REPEATED_CYCLES = 1000
# Largest velocity that is treated as round-off, relative to the sum of the magnitudes of its terms.
REST_TOL = 64 * np.finfo(float).eps
# Smallest slipping fraction of the friction limit at which an interface counts as slipping.
SLIP_FRACTION = 0.5
# Minimum number of cycles over which a repeating motion is measured; three contain
# every stick of a cycle completely.
MIN_MEASURED_CYCLES = 3
# Largest distance between the end of a run and the end of a cycle, in
# cycles, at which they count as equal.
CYCLE_END_TOL = 1e-9
# Largest time between two simultaneous events, in cycles.
SAME_TIME_TOL = 1e-12


@dataclass(frozen=True, eq=False, slots=True)
class EventRunResult:
    """Result of an event-driven run with rigid and elastic-plastic friction elements.

    - extremes: (c, 2) smallest and largest output of every cycle [m]
    - phasors: (c,) output at the frequency of the drive in the last cycle of every window [m], 0 in
      the other cycles
    - ledger: energies [J] by name
    - outcome: None if the run reached its end
    - reading: measures of the window
    - events: number of pieces
    - cycles_done: cycles that were computed
    - end: state and memory at the end, from which a run goes on
    - slips: whether an interface slipped as a whole at some time
    - ring: see `reading.find_stick_vibration`, None also for other rigs
    - repeats: whether all cycles of the window are the same to the last bit
    - response, window: histories of the run and of its last cycles, None in a run without them;
      their `extra` has "ledger" (4, k) [J] of all interfaces, and of several interfaces slides,
      slide_rates, forces and slips (k, i)
    - log: events
    - snapshots: of the elements in the last cycle
    """

    extremes: np.ndarray
    phasors: np.ndarray
    ledger: dict
    outcome: Outcome | None
    reading: Reading
    events: int
    cycles_done: float
    end: tuple
    slips: bool
    ring: tuple | None
    repeats: bool
    response: Response | None = None
    window: Response | None = None
    log: EventLog | None = None
    snapshots: list = field(default_factory=list)

    @property
    def loops(self) -> tuple:
        """Friction loop of each interface in the window (the last cycles)."""
        return self.reading.loops

    @property
    def output_amplitude(self) -> float:
        """Output amplitude [m] in the window: half of the peak-to-peak range."""
        return float(self.reading.output_amplitude)

    @property
    def acceleration(self) -> float:
        """Peak magnitude of the output acceleration in the window [m s-2]."""
        return float(self.reading.acceleration)


def load_event_kernels(say=None) -> tuple:
    """Load the compiled functions that integrate the motion, evaluate samples and measure cycles.

    say: is called before they are compiled.
    """
    set_compile_callback(say)
    return tuple(load(f"{PACKAGE}.{name}_kernels") for name in ("march", "dense", "read"))


def announce_runs(
    modes: ModalBasis, drive, groups, cycles: float, window: int, runs: int = 1
) -> None:
    """Report the expected cost of runs to the kernels, which decide from it whether to compile.

    Parameters
    ----------
    modes : ModalBasis
    drive
    groups : sequence of Elements
        One for every interface.
    cycles : float
        Cycles of a run.
    window : int
        Cycles at the end whose samples are kept.
    runs : int, optional
        Number of runs.
    """
    march, dense, read = load_event_kernels()
    max_stiffness = max((float(group.stiffness.sum()) for group in groups), default=0.0)
    cycles_read = min(cycles, window)
    seconds_per_cycle = estimate_cycle_time(
        modes, drive, max_stiffness, sum(group.stiffness.size for group in groups)
    )
    march.march.add_python_cost(runs * cycles * seconds_per_cycle)
    march.stored_energy.add_python_cost(runs * seconds_per_cycle)
    dense.evaluate_rows.add_python_cost(
        runs * cycles_read * SAMPLES_PER_CYCLE * estimate_sample_time(modes)
    )
    read.read_rows.add_python_cost(PYTHON_READ_TIME_RATIO * runs * cycles_read * seconds_per_cycle)


def start_event_run(
    modes: ModalBasis,
    drive,
    groups,
    cycles: float,
    window: int = 1,
    travel: float = np.inf,
    start: InitialState | None = None,
    memory=None,
) -> "_EventRun":
    """Set up an event-driven run in its initial state; no motion is computed.

    The parameters are those of `simulate`.

    Its `run` computes it to the end, its `run_to` for some cycles at a time.

    Returns
    -------
    _EventRun
    """
    announce_runs(modes, drive, groups, cycles, window)
    return _EventRun(modes, drive, groups, cycles, window, travel, start, memory)


def simulate(
    modes: ModalBasis,
    drive,
    groups,
    cycles: float,
    window: int = 10,
    travel: float = np.inf,
    frames: int = 0,
    progress=None,
    start: InitialState | None = None,
    memory=None,
    *,
    even: bool = False,
) -> EventRunResult:
    """Simulate the motion from rest or from a given state; keep all samples of the last cycles.

    Parameters
    ----------
    modes : ModalBasis
    drive
    groups : sequence of Elements
        One for every interface.
    cycles : float
        Cycles of the drive.
    window : int, optional
        Cycles at the end whose samples are kept.
    travel : float, optional
        Displacement of the output [m] at which the run ends.
    frames : int, optional
        Snapshots of the elements in the last cycle.
    progress : callable, optional
        Is called with the fraction of the run that is done.
    start : InitialState, optional
        At rest by default.
    memory : Memory, optional
        Memory of the elements at the start, unstretched by default.
    even : bool, optional
        Whether equally spaced samples of all cycles are kept, as `wanted` of
        `choose_samples_per_cycle`.

    Returns
    -------
    EventRunResult
        Its outcome is set only if the output passed the travel.

    Raises
    ------
    NotConverged
        If events follow each other without progress in time, or no choice of sticking interfaces
        obeys the law.
    """
    if start is not None and abs(float(modes.output @ start.z)) > travel:
        raise PatchfemError(
            "structure.travel: the displacement at the start is larger than this travel; raise the "
            "travel, or start nearer to the middle"
        )
    run = start_event_run(modes, drive, groups, cycles, window, travel, start, memory)
    result = run.run(frames, progress, even=even)
    # The output exceeded the travel. The run is repeated up to that time, because only a run with a
    # known end keeps the samples of its last cycles.
    if result is None:
        shortened_run = start_event_run(
            modes, drive, groups, run.now / drive.period, window, np.inf, start, memory
        )
        shortened_run.outcome = Outcome.EXCEEDS_TRAVEL
        result = shortened_run.run(frames, None, even=even)
    return result


def simulate_batch(cases, cycles: int, window: int) -> list:
    """Simulate many cases without histories and events, in a tenth of the time of `simulate`.

    Parameters
    ----------
    cases : sequence of tuple
        (modes, drive, groups, start) of every case.
    cycles, window : int
        See `simulate`.

    Returns
    -------
    list of EventRunResult

    Raises
    ------
    NotConverged
        As `simulate`, for any case.
    """
    out = []
    run = None
    for modes, drive, groups, start in cases:
        run = _EventRun(modes, drive, groups, cycles, window, np.inf, start, None, run)
        out.append(run.run_without_histories())
    return out


def evaluate_motion(
    modes: ModalBasis, drive, groups, cycles: float, times, start: InitialState | None = None
) -> Response:
    """Evaluate the motion at given times.

    Parameters
    ----------
    modes, drive, groups, cycles, start
        See `simulate`.
    times : array_like
        (k,) [s].

    Returns
    -------
    Response
    """
    times = np.asarray(times, float)
    rows = []
    run = start_event_run(modes, drive, groups, cycles, start=start)
    run.run_to(cycles, run._make_row_collector(rows))
    rows = np.concatenate(rows)
    owner = np.clip(np.searchsorted(rows[:, Row.TIME], times, side="right") - 1, 0, len(rows) - 1)
    return run._make_response(
        rows, owner, np.clip(times - rows[owner, Row.TIME], 0.0, rows[owner, Row.DURATION]), times
    )


class _EventRun:
    """Event-driven run in progress.

    It keeps only reversals and slip events from before the window.

    template_run: a run that has ended, whose arrays may be reused.
    """

    def __init__(
        self, modes, drive, groups, cycles, window, travel, start, memory, template_run=None
    ):
        self.modes = modes
        self.drive = drive
        self.groups = tuple(groups)
        self.n_window = window
        self.kernels, self.dense, self.reader = load_event_kernels()
        self.modal_system = make_modal_system(modes)
        old = (None,) * 5 if template_run is None else template_run.reusable_arrays
        n = modes.omega.size
        count = max(1, ceil(cycles - CYCLE_END_TOL))
        table = make_element_table(self.groups)
        if np.any(~self.modal_system.interfaces.any(axis=1) & (table.static_limit > 0)):
            raise PatchfemError(
                "structure.mode.slide: no mode moves the interface, so friction cannot act"
            )
        motion = np.zeros((2, n)) if start is None else np.array([start.z, start.v], float)
        unstretched_state = make_unstretched_memory(table, self.modal_system.interfaces @ motion[0])
        memory = (
            unstretched_state
            if memory is None
            else type(unstretched_state)(*(part.copy() for part in memory))
        )
        is_phasor_wanted = np.zeros(count)
        # A phasor is computed in the last complete cycle of every window.
        is_phasor_wanted[max(0, int(cycles + CYCLE_END_TOL)) - 1 :: -window] = 1.0
        new = (
            table,
            memory,
            make_previous_cycle(self.modal_system, table),
            make_initial_time_state(drive, len(self.groups)),
            make_run_sums(count, is_phasor_wanted, travel),
        )
        self.reusable_arrays = tuple(map(copy_into, old, new))
        self.table, self.memory, self.previous, self.time_state, self.run_sums = (
            self.reusable_arrays
        )
        if (
            template_run is not None
            and template_run.modal_system.interfaces.shape == self.modal_system.interfaces.shape
        ):
            self.workspace = clear_workspace(template_run.workspace)
            self.scratch = template_run.scratch
        else:
            self.workspace = make_workspace(self.modal_system)
            self.scratch = make_workspace(self.modal_system)
        self.motion = motion
        self.arrays = RunArrays(
            self.modal_system,
            self.table,
            motion,
            self.memory,
            self.previous,
            self.time_state,
            self.run_sums,
            self.workspace,
        )
        self.evaluation_arrays = self.arrays._replace(workspace=self.scratch)
        self.cycles = cycles
        self.period = drive.period
        self.n_columns = Row.MOTION + 2 * n + N_COLUMNS * len(self.groups)
        self.early_rows = []
        self.equal_samples = []
        self.n_kept = 0
        self.events = []
        self.n_events = 0
        self.has_rigid = bool(self.table.static_limit.any())
        self.outcome = None
        self.snapshots = []
        self.slip_signs = self._slip_signs(
            self.modal_system.interfaces @ self.motion[1],
            np.abs(self.modal_system.interfaces) @ np.abs(self.motion[1]),
        )
        self.has_passed_travel = False
        self.is_repeating = False
        self.is_marked = np.zeros(0, bool)
        self.start_energy = self.kernels.stored_energy(
            self.motion, self.modal_system, self.table, self.memory
        )
        energy_at_rest = self.kernels.stored_energy(
            np.zeros_like(self.motion), self.modal_system, self.table, self.memory
        )
        # This is the energy [J] of the stretched elements minus their work and loss so far, with
        # which the energy balance of the run begins.
        self.start_stretch_energy = energy_at_rest - float(
            np.sum(self.memory.work - self.memory.loss)
        )
        if template_run is not None and template_run.n_columns == self.n_columns:
            self.rows = template_run.rows
        else:
            self.rows = np.empty((ROWS_PER_CALL, self.n_columns))

    def run_to(self, cycles: float, keep=None, progress=None) -> None:
        """March the run to a time that is given in cycles.

        If the motion repeats and not every row is needed, the last cycle stands for the
        remaining cycles.

        Parameters
        ----------
        cycles : float
            Time in cycles at which the run stops.
        keep : callable or None
            keep(rows) is called with rows as they are computed.
        progress : callable or None
            progress(fraction) is called with the fraction of the run that is done.
        """
        stop = split_time(cycles * self.period, self.period)
        rows = self.rows[:0] if keep is None else self.rows
        while not self.has_passed_travel:
            code, done = self._march(stop, rows)
            if keep is not None:
                keep(done)
            if progress is not None:
                progress(min(self.now / (self.cycles * self.period), 1.0))
            if code == MARCH_STATUS.repeats and keep in (None, self._keep_reversal_rows):
                self._skip_repeating_cycles(int(stop[0]), rows)
            elif code == MARCH_STATUS.done:
                break

    def _slip_signs(self, speeds, sizes) -> np.ndarray:
        """Return the slip signs (i,) of the rigid elements at given velocities (i,) [m/s].

        sizes: (i,) magnitudes that the speeds are added from [m/s].
        """
        return np.where(
            (self.table.static_limit > 0) & (np.abs(speeds) > REST_TOL * sizes),
            np.sign(speeds),
            0.0,
        )

    def _march(self, stop, rows) -> tuple:
        """Call the compiled march; return its status and the rows (k, w) that it has filled.

        Its sums are added to those of the run as a whole: added piece by piece, the energies of a
        million cycles of four pieces were wrong by 6e-11.
        """
        sums = self.run_sums.ledger[: Ledger.MAX_STORED]
        before = sums.copy()
        sums[:] = 0.0
        code, used = self.kernels.march(stop, self.arrays, rows)
        sums += before
        if code == MARCH_STATUS.idle:
            raise NotConverged(
                f"dynamics: at t = {rows[max(used - 1, 0), Row.TIME]:.9g} s the contact changes between stick "
                "and slip again and again without time passing"
            )
        if code == MARCH_STATUS.undetermined:
            advice = ""
            if np.any(self.table.kinetic_limit < self.table.static_limit):
                advice = "bring friction.kinetic nearer to friction.static, or "
            raise NotConverged(
                "dynamics: after a change between stick and slip no state was found that satisfies the "
                f'friction law; {advice}use accuracy.method = "march"'
            )
        self.has_passed_travel = code == MARCH_STATUS.travel
        return code, rows[: 0 if self.has_passed_travel else used]

    def _make_row_collector(self, out: list):
        """Return a callback that logs the events in rows and appends the rows to a list."""

        def keep(rows) -> None:
            self._log_events(rows)
            out.append(rows.copy())

        return keep

    def _keep_reversal_rows(self, rows) -> None:
        """Keep the rows before the window that begin with a reversal or a slip event."""
        self.is_marked = self._log_events(rows) | (rows[:, Row.BEGIN] == ROW_BEGIN.reversal)
        if not self.n_kept and len(rows):
            self.is_marked[0] = True  # the first row is the start of the run
        if self.n_kept < MAX_REVERSAL_ROWS:
            self.early_rows.append(rows[self.is_marked])
            self.n_kept += int(self.is_marked.sum())

    def _make_equidistant_sampler(self, step: float):
        """Return a callback that keeps a sample at each multiple of a time step [s].

        It also keeps those of `sample_rows`.
        """
        last_row = np.empty((0, self.n_columns))

        def keep(rows) -> None:
            nonlocal last_row
            self._log_events(rows)
            if len(rows):
                rows = np.concatenate([last_row, rows])
                last_row = rows[-1:].copy()
                grid = step * np.arange(
                    ceil(rows[0, Row.TIME] / step),
                    ceil((rows[-1, Row.TIME] + rows[-1, Row.DURATION]) / step),
                )
                self.equal_samples.append(
                    self.sample_rows(rows, grid if grid.size else rows[:1, 0])
                )

        return keep

    def _skip_repeating_cycles(self, end: int, rows) -> None:
        """Compute one cycle of a repeating motion and copy its result to the following cycles.

        The last cycle before number `end`, or before the next segment of the drive signal, is not
        skipped. The cycles are computed one by one if the first cycle needs more than `rows`.
        """
        run_sums = self.run_sums
        begin = int(self.time_state.now[Time.CYCLE])
        k = int(self.time_state.now[Time.SEGMENT]) + 1
        if k < len(self.time_state.segments):
            end = min(end, int(self.time_state.segments[k, Segment.CYCLE]))
        end -= 1  # the last cycle is marched, because the run or the segment ends in it
        n_skipped = end - begin - 1
        if n_skipped < 1:
            return
        growing = run_sums.ledger, self.memory.work, self.memory.loss
        values_before = [total.copy() for total in growing]
        events_before = (len(self.events), self.n_events)
        is_phasor_wanted = run_sums.is_phasor_wanted[begin]
        run_sums.is_phasor_wanted[begin] = 1.0
        status, cycle_rows = self._march((begin + 1.0, 0.0), rows)
        run_sums.is_phasor_wanted[begin] = is_phasor_wanted
        if len(rows):
            self._keep_reversal_rows(cycle_rows)
        if status != MARCH_STATUS.done:
            return
        values_before[0][[Ledger.MAX_STORED, Ledger.HAS_SLIPPED]] = run_sums.ledger[
            [Ledger.MAX_STORED, Ledger.HAS_SLIPPED]
        ]
        for total, value_before in zip(growing, values_before):
            total += n_skipped * (total - value_before)
        for total in (run_sums.extremes, run_sums.phasors):
            total[begin + 1 : end] = total[begin]
        run_sums.phasors[begin:end] *= run_sums.is_phasor_wanted[begin:end, None]
        self.time_state.now[Time.CYCLE] = end
        if len(rows):
            gains = self.memory.work - values_before[1], self.memory.loss - values_before[2]
            self._repeat_rows(
                cycle_rows, n_skipped, *events_before, [total / (n_skipped + 1) for total in gains]
            )

    def _repeat_rows(
        self, rows, n_cycles: int, first_event: int, n_earlier_events: int, gains
    ) -> None:
        """Append shifted copies of the rows (k, w) and events of a cycle for `n_cycles` further cycles.

        first_event: index of its first event array; n_earlier_events: events before it; gains: work and loss (i,) [J]
        of the elements in a cycle. Rows are kept for at most MAX_REPEATED_CYCLES cycles.
        """
        reversal_rows = rows[self.is_marked]
        cycles = np.unique(np.linspace(1, n_cycles, min(n_cycles, MAX_REPEATED_CYCLES)).round())
        repeated_rows = _shift_rows(reversal_rows, self.period * cycles)
        for column, gain in zip((Column.WORK, Column.LOSS), gains):
            for f, interface_gain in enumerate(gain):
                repeated_rows[:, self._column_index(f, column)] += np.repeat(
                    cycles * interface_gain, len(reversal_rows)
                )
        self.early_rows.append(repeated_rows)
        self.n_kept += len(repeated_rows)
        cycle_events = np.concatenate([np.empty((0, 5)), *self.events[first_event:]])
        n_logged = min(n_cycles, -(-MAX_EVENTS // max(len(cycle_events), 1)))
        self.events.append(
            _shift_rows(
                cycle_events, self.period * np.arange(n_cycles - n_logged + 1, n_cycles + 1)
            )
        )
        self.n_events += n_cycles * (self.n_events - n_earlier_events)

    def _log_events(self, rows) -> np.ndarray:
        """Append the stops, releases, reversals and drive changes in rows to the event log.

        Return which rows (k,) begin with one of them.

        Returns which rows (k,) begin with one.
        """
        is_event = np.zeros(len(rows), bool)
        if not len(rows):
            return is_event
        for f, interface in enumerate(self.modal_system.interfaces):
            is_slipping = rows[:, self._column_index(f, Column.SLIPPING)] >= SLIP_FRACTION
            direction = np.where(is_slipping, rows[:, self._column_index(f, Column.DIRECTION)], 0.0)
            before = np.concatenate([self.slip_signs[f : f + 1], direction[:-1]])
            self.slip_signs[f] = direction[-1]
            changed = np.flatnonzero(before != direction)
            start = np.where(before[changed] == 0, RELEASE, REVERSAL)
            kind = np.where(direction[changed] == 0, STOP, start * direction[changed])
            if self.has_rigid:
                slide = rows[changed, self._column_index(f, Column.SLIDE)]
            else:
                z = rows[changed, Row.MOTION : Row.MOTION + self.modes.omega.size]
                slide = z @ interface
            self._add_events(rows[changed], f, kind, slide)
            is_event[changed] = True
        if self.has_rigid:
            borders = np.flatnonzero(rows[:, Row.BEGIN] == ROW_BEGIN.drive_change)
            self._add_events(rows[borders], -1, DRIVE_CHANGE, 0.0)
            is_event[borders] = True
        return is_event

    def _add_events(self, rows, interface: int, kind, slide) -> None:
        """Append the events at the beginning of rows (k, w) to the log."""
        if not len(rows):
            return
        events = np.empty((len(rows), 5))
        events[:, 0] = rows[:, Row.TIME]
        events[:, 1] = rows[:, Row.PHASE] % (2 * np.pi)
        events[:, 2] = interface
        events[:, 3] = kind
        events[:, 4] = slide
        self.events.append(events)
        self.n_events += len(events)

    def _column_index(self, interface: int, column: int) -> int:
        """Return the index, within a row, of a quantity that belongs to an interface.

        `column` is a member of `Column`.
        """
        return Row.MOTION + 2 * self.modes.omega.size + N_COLUMNS * interface + column

    def run(self, frames: int, progress, *, even: bool = False) -> EventRunResult | None:
        """March the run to its end and return the result with histories.

        Returns None if the output passed the travel. The parameters are those of `simulate`.
        """
        end = self.cycles
        early_rows = []
        window_rows = []
        even = choose_samples_per_cycle(self.drive, self.cycles, needs_history=even)
        window_start = max(0.0, end - self.n_window)
        last_cycle_start = max(0.0, end - 1)
        sampled_start = max(0.0, min(window_start, end - 2))
        if sampled_start > 0:
            self.run_to(
                sampled_start,
                self._make_equidistant_sampler(self.period / even)
                if even
                else self._keep_reversal_rows,
                progress,
            )
        if window_start > sampled_start:
            self.run_to(window_start, self._make_row_collector(early_rows), progress)
        self.is_repeating = bool(self.previous.status[PreviousStatus.REPEATS])
        for stop in self._cycle_ends(window_start, last_cycle_start):
            self.run_to(stop, self._make_row_collector(window_rows), progress)
        for k in range(frames):
            self.run_to(
                last_cycle_start + (end - last_cycle_start) * (k + 1) / frames,
                self._make_row_collector(window_rows),
            )
            self.snapshots.append(self._snapshot())
        self.run_to(end, self._make_row_collector(window_rows), progress)
        if self.has_passed_travel:
            return None
        return self._make_result(early_rows, self._append_end_row(window_rows))

    def run_without_histories(self) -> EventRunResult:
        """March the run to its end and return only its measures, without histories and events.

        If the motion repeats, only a few cycles are measured.
        """
        end = self.cycles
        window_rows = []
        self.run_to(end - self.n_window)
        self.is_repeating = bool(self.previous.status[PreviousStatus.REPEATS])
        if self.is_repeating:
            self.run_to(end - min(MIN_MEASURED_CYCLES, self.n_window))
        self.run_to(end, lambda rows: window_rows.append(rows.copy()))
        return self._summarise(self._append_end_row(window_rows))

    def _cycle_ends(self, first: float, last: float) -> list:
        """Return the ends of the cycles in the window, or [] if the run ends with a whole drive cycle."""
        if abs(self.cycles - round(self.cycles)) < CYCLE_END_TOL:
            return []
        ends = self.cycles - np.arange(self.n_window, 0, -1)
        return [end for end in ends if first < end <= last]

    def _append_end_row(self, window_rows) -> np.ndarray:
        """Return the rows (k + 1, w) of the window with one more row for the end of the run."""
        n = self.modes.omega.size
        memory = self.memory
        row = np.zeros(self.n_columns)
        row[Row.TIME] = self.now
        row[Row.SEGMENT] = self.time_state.now[Time.SEGMENT]
        row[Row.CYCLE] = self.time_state.now[Time.CYCLE]
        row[Row.OFFSET] = self.time_state.now[Time.OFFSET]
        row[Row.MOTION : Row.MOTION + 2 * n] = self.motion.ravel()
        for column, values in (
            (Column.FORCE, memory.force),
            (Column.SLIP, memory.slip),
            (Column.WORK, memory.work),
            (Column.LOSS, memory.loss),
            (Column.SLIDE, memory.slide),
        ):
            row[self._column_index(0, column) :: N_COLUMNS] = values
        rows = np.concatenate([*window_rows, row[None]])
        if self.has_rigid:
            # An event within round-off of the start of the window belongs to the time before it.
            is_long = rows[:, Row.DURATION] > SAME_TIME_TOL * self.period
            rows = rows[min(int(np.argmax(is_long)), len(rows) - 2) :]
        return rows

    @property
    def now(self) -> float:
        """Present time of the run [s]."""
        return float(
            self.time_state.now[Time.CYCLE] * self.period + self.time_state.now[Time.OFFSET]
        )

    def _snapshot(self) -> dict:
        """Return time, motion and stretches of the friction elements at the present time."""
        faces = []
        for k, group in enumerate(self.groups):
            faces.append((float(self.memory.slide[k]), element_stretches(group, self.memory, k)))
        return {
            "time": self.now,
            "slide": float(self.memory.slide[0]),
            "force": float(self.memory.force[0]),
            "rate": float(self.modal_system.interfaces[0] @ self.motion[1]),
            "slip": float(self.memory.slip[0]),
            "stretch": faces[0][1],
            "faces": faces,
        }

    def _summarise(self, rows) -> EventRunResult:
        """Compute the measures of the run from the rows of the window, without histories."""
        start_time = rows[0, Row.TIME]
        end_time = rows[-1, Row.TIME]
        n_interfaces = len(self.groups)
        span = end_time - start_time
        measures = np.zeros(len(RunMeasure)), np.zeros((n_interfaces, len(InterfaceMeasure)))
        cycles = max(1, round(span / self.period))
        self.reader.read_rows(
            rows, cycles, float(self.drive.moving), self.evaluation_arrays, *measures
        )
        reading = Reading(*measures, float(span), self.period)
        cycles_done = slice(0, max(1, ceil(end_time / self.period - CYCLE_END_TOL)))
        names = ("work_in", "viscous", "power")
        energies = dict(zip(names, map(float, self.run_sums.ledger[:3]))) | {
            "friction": float(self.run_sums.ledger[Ledger.FRICTION_LOSS])
        }
        energy = self.kernels.stored_energy(self.motion, self.modal_system, self.table, self.memory)
        energies |= {
            "stored": energy - self.start_energy,
            "peak_stored": max(float(self.run_sums.ledger[Ledger.MAX_STORED]), self.start_energy),
        }
        has_closed_form = (
            len(self.drive.segments) == 1
            and self.modal_system.interfaces.shape == (1, 1)
            and self.modal_system.interfaces[0, 0] != 0
            and not self.has_rigid
        )
        ring = None
        if has_closed_form:
            ring = find_stick_vibration(self.modal_system, self.table, reading)
        end = (
            InitialState(*self.motion.copy()),
            type(self.memory)(*(part.copy() for part in self.memory)),
        )
        ledger = self.run_sums.ledger
        phasors = self.run_sums.phasors[cycles_done] @ [1, 1j]
        return EventRunResult(
            self.run_sums.extremes[cycles_done].copy(),
            phasors,
            energies,
            self.outcome,
            reading,
            int(ledger[Ledger.N_PIECES]),
            end_time / self.period,
            end,
            bool(ledger[Ledger.HAS_SLIPPED]),
            ring,
            self.is_repeating,
        )

    def _make_result(self, early_rows, rows) -> EventRunResult:
        """Return the result of the run with histories.

        early_rows, rows: rows before the window, as a list of arrays, and rows of the window.
        """
        no_rows = np.empty((0, self.n_columns))
        window_rows = rows[:-1]
        start_time = rows[0, Row.TIME]
        end_time = rows[-1, Row.TIME]
        reversal_rows = np.concatenate([no_rows, *self.early_rows])
        early_rows = np.concatenate([no_rows, *early_rows])
        window = self.sample_rows(
            window_rows, choose_sample_times(start_time, end_time, self.period)
        )
        if len(reversal_rows):
            at_start = np.zeros(len(reversal_rows))
            time = reversal_rows[:, Row.TIME]
            parts = [
                self._make_response(reversal_rows, np.arange(len(reversal_rows)), at_start, time)
            ]
        else:
            end = (early_rows if len(early_rows) else rows)[0, Row.TIME]
            parts = [_select_samples(part, part.time < end) for part in self.equal_samples]
        if len(early_rows):
            first = early_rows[0, Row.TIME]
            early_samples = self.sample_rows(
                early_rows, choose_sample_times(first, start_time, self.period, 2)
            )
            parts.append(_select_samples(early_samples, early_samples.time < start_time))
        return replace(
            self._summarise(rows),
            response=_join_responses([*parts, window]),
            window=window,
            log=self.event_log(),
            snapshots=self.snapshots,
        )

    def event_log(self) -> EventLog:
        """Return the log of the last events in the run."""
        rows = np.concatenate([np.empty((0, 5)), *self.events])
        rows = rows[np.argsort(rows[:, Row.TIME], kind="stable")][-MAX_EVENTS:]
        time, phase, interface, kind, slide = rows.T
        return EventLog(
            frozen_array(time),
            frozen_array(phase),
            frozen_array(interface, np.int64),
            frozen_array(kind, np.int64),
            frozen_array(slide),
            self.n_events,
        )

    def sample_rows(self, rows, grid) -> Response:
        """Return histories on a time grid (k,) [s] and at reversals, stops and releases.

        The force of rigid elements jumps at their events, so there are samples on both sides.
        """
        slipping = rows[:, self._column_index(0, Column.SLIPPING) :: N_COLUMNS] >= SLIP_FRACTION
        is_jump = (rows[:, Row.BEGIN] > ROW_BEGIN.reversal) & self.has_rigid
        is_reversal = rows[:, Row.BEGIN] == ROW_BEGIN.reversal
        is_sampled = (
            is_jump | is_reversal | np.any(np.diff(slipping, axis=0, prepend=slipping[:1]), axis=1)
        )
        if np.count_nonzero(rows[:, Row.BEGIN]) <= 2 * grid.size:
            # The force has a kink at a yield, so a sample there closes the
            # energy balance of the samples.
            is_sampled |= rows[:, Row.BEGIN] == ROW_BEGIN.yielding
        is_jump = rows[is_jump & (rows[:, Row.TIME] > grid[0]), Row.TIME]
        time = np.unique(
            np.concatenate([grid, rows[is_sampled, Row.TIME], np.nextafter(is_jump, -np.inf)])
        )
        owner = np.clip(
            np.searchsorted(rows[:, Row.TIME], time, side="right") - 1, 0, len(rows) - 1
        )
        return self._make_response(
            rows, owner, np.clip(time - rows[owner, Row.TIME], 0.0, rows[owner, Row.DURATION]), time
        )

    def evaluate_rows(self, rows, owner, tau) -> np.ndarray:
        """Evaluate the recorded motion of the run at given times.

        Parameters
        ----------
        rows : ndarray
            (r, w) rows of pieces.
        owner : ndarray
            (k,) row of each time.
        tau : ndarray
            (k,) time since the start of that row [s].

        Returns
        -------
        ndarray
            (k, c) columns, see `dense_kernels.evaluate_rows`.
        """
        out = np.empty((owner.size, 2 * self.modes.omega.size + 1 + 6 * len(self.groups)))
        self.dense.evaluate_rows(rows, owner, tau, self.evaluation_arrays, out)
        return out

    def _make_response(self, rows, owner, tau, time) -> Response:
        """Return histories at times (k,) [s], given the row of each time and the time since its start."""
        return self._response_from_columns(self.evaluate_rows(rows, owner, tau), time)

    def _response_from_columns(self, columns, time) -> Response:
        """Return histories at times (k,) [s] from the columns of `evaluate_rows`."""
        modes = self.modes
        n = self.modes.omega.size
        z = columns[:, :n].copy()
        v = columns[:, n : 2 * n].copy()
        drive = columns[:, 2 * n]
        first = 2 * n + 1
        slides = columns[:, first::6]
        rates = columns[:, first + 1 :: 6]
        forces = columns[:, first + 2 :: 6]
        slips = columns[:, first + 3 :: 6]
        base = drive if self.drive.moving else np.zeros_like(drive)
        accel = (
            -np.outer(drive, modes.base)
            - v @ self.modal_system.damping.T
            - z * self.modal_system.omega_squared
            - forces @ self.modal_system.interfaces / modes.mass
        )
        work = columns[:, first + 4 :: 6].sum(axis=1)
        losses_sum = columns[:, first + 5 :: 6].sum(axis=1)
        extra = {
            "ledger": np.stack(
                [work, self.start_stretch_energy + work - losses_sum, losses_sum, 0 * losses_sum]
            )
        }
        if len(self.groups) > 1:
            extra |= {"slides": slides, "slide_rates": rates, "forces": forces, "slips": slips}
        return Response(
            time,
            modal=z,
            modal_rate=v,
            slide=slides[:, 0].copy(),
            slide_rate=rates[:, 0].copy(),
            output=z @ modes.output,
            output_rate=v @ modes.output,
            acceleration=accel @ modes.output + base,
            base_acceleration=base,
            force=forces[:, 0].copy(),
            slip=slips[:, 0].copy(),
            extra=extra,
        )


def _shift_rows(rows, delays) -> np.ndarray:
    """Return copies of rows (k, w), shifted in time by each of several delays (m,) [s]."""
    out = np.tile(rows, (len(delays), 1))
    out[:, 0] += np.repeat(delays, len(rows))
    return out


# Fields of a Response that are histories, in the order of its constructor.
_HISTORY_FIELDS = (
    "time",
    "modal",
    "modal_rate",
    "slide",
    "slide_rate",
    "output",
    "output_rate",
    "acceleration",
    "base_acceleration",
    "force",
    "slip",
)


def _select_samples(response: Response, selection) -> Response:
    """Return the history samples that an index or a mask selects."""
    columns = [getattr(response, name)[selection] for name in _HISTORY_FIELDS]
    extra = {}
    for name, values in response.extra.items():
        extra[name] = values[:, selection] if name == "ledger" else values[selection]
    return Response(*columns, extra)


def _join_responses(responses) -> Response:
    """Join histories in order of time into one whose times strictly increase."""
    if len(responses) == 1:
        return responses[0]
    columns = []
    for name in _HISTORY_FIELDS:
        columns.append(np.concatenate([getattr(response, name) for response in responses]))
    extra = {}
    for name in responses[0].extra:
        axis = 1 if name == "ledger" else 0
        extra[name] = np.concatenate([response.extra[name] for response in responses], axis)
    joined = Response(*columns, extra)
    is_later = np.diff(np.maximum.accumulate(joined.time), prepend=-np.inf) > 0
    return joined if is_later.all() else _select_samples(joined, is_later)
