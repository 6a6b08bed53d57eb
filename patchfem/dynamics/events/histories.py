"""A run of the event engine: samples, extremes, energies and events."""

from dataclasses import dataclass, field, replace
from math import ceil

import numpy as np

from ...compiled import get_kernel_module, load, set_compile_callback
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
from .cost import python_seconds, sample_seconds
from .elements import (
    element_stretches,
    make_coulomb_elements,
    make_element_table,
    unstretched_memory,
)
from .event_list import BORDER, MAX_EVENTS, RELEASE, REVERSAL, STOP, EventLog
from .modal_system import (
    clear_workspace,
    copy_into,
    make_modal_system,
    make_workspace,
    split_time,
    start_previous_cycle,
    start_sums,
    start_time_state,
)
from .positions_kernels import (
    BEGIN,
    COLUMN,
    INTERFACE,
    LEDGER,
    N_COLUMNS,
    PREVIOUS,
    ROW,
    RUN,
    SEGMENT,
    STATUS,
    TIME,
)
from .reading import Reading, find_sticking_ring

FOLDER = "dynamics.events"
# samples of a cycle in the window
SAMPLES_PER_CYCLE = 400
# samples of the window of a run that is shorter than a cycle
MIN_SAMPLES = 101
# rows that one call of the march fills
ROWS_PER_CALL = 4096
# turning points that are kept from before the window
MAX_TURNING_ROWS = 400_000
# cycles of a motion that repeats whose turning points are kept
MAX_REPEATED_CYCLES = 1000
# fraction of the sum of magnitudes of a velocity, below which it is round-off
REST_TOL = 64 * 2.0**-52
# fraction of the friction limit; where more of it slips, the interface slips
SLIP_FRACTION = 0.5
# cycles of a motion that repeats, which contain each stick of one of them as a whole
MIN_CYCLES_READ = 3
# fraction of a cycle within which a run ends at the end of the cycle
WHOLE_CYCLES_TOL = 1e-9
# fraction of a cycle within which two events are at the same time
SAME_TIME_TOL = 1e-12


@dataclass(frozen=True, eq=False, slots=True)
class PieceRun:
    """Result of a run of rigid and elastic-plastic elements.

    - amplitudes: (c, 2) smallest and largest output of every cycle [m]
    - phasors: (c,) output at the frequency of the drive in the last cycle of every window [m], 0
      in the other cycles
    - ledger: energies [J] by name
    - outcome: None where the run reached its end
    - reading: measures of the window
    - events: number of pieces
    - cycles_done: cycles that were computed
    - end: state and memory at the end, from which a run goes on
    - slips: whether an interface slipped as a whole at some time
    - ring: see `reading.find_sticking_ring`, None also for other rigs
    - repeats: whether all cycles of the window are the same to the last bit
    - response, window: histories of the run and of its last cycles, None in a run without them;
      their `extra` has "ledger" (4, k) [J] of all interfaces, and of several interfaces slides,
      slide_rates, forces and slips (k, i)
    - log: events
    - snapshots: of the elements in the last cycle
    """

    amplitudes: np.ndarray
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
        """InterfaceLoop of every interface in the window."""
        return self.reading.loops

    @property
    def swing(self) -> float:
        """Half the range of the output in the window [m]."""
        return float(self.reading.swing)

    @property
    def acceleration(self) -> float:
        """Largest absolute acceleration of the output in the window [m s-2]."""
        return float(self.reading.acceleration)


def load_event_kernels(say=None) -> tuple:
    """Return the kernels that march, evaluate rows and read measures.

    say: is called before they are compiled.
    """
    set_compile_callback(say)
    return tuple(load(f"{FOLDER}.{name}_kernels") for name in ("march", "dense", "read"))


def announce_runs(
    modes: ModalBasis, drive, groups, cycles: float, window: int, runs: int = 1
) -> None:
    """Announce runs to the kernels, which are compiled only if that pays.

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
    stiff = max((float(group.stiffness.sum()) for group in groups), default=0.0)
    shown = min(cycles, window)
    each = python_seconds(modes, drive, stiff, sum(group.stiffness.size for group in groups))
    march.march.add_python_cost(runs * cycles * each)
    march.stored_energy.add_python_cost(runs * each)
    dense.evaluate_rows.add_python_cost(runs * shown * SAMPLES_PER_CYCLE * sample_seconds(modes))
    read.read_rows.add_python_cost(PYTHON_READ_TIME_RATIO * runs * shown * each)


def is_loop_kept(modes: ModalBasis, drive) -> bool:
    """Return whether machine code of the loop from event to event is cached for these modes.

    The loop for one mode, whose squared frequency is a tuple, and that for several are compiled
    separately.
    """
    modal_system = make_modal_system(modes)
    table = make_element_table([make_coulomb_elements(1.0)] * len(modal_system.interfaces))
    motion = np.zeros((2, modes.omega.size))
    rows = np.zeros((1, 1))
    memory = unstretched_memory(table, np.zeros(len(modal_system.interfaces)))
    march = get_kernel_module(f"{FOLDER}.march_kernels").march
    return march.is_stored(
        (0.0, 0.0),
        motion,
        modal_system,
        table,
        memory,
        start_previous_cycle(modal_system, table),
        start_time_state(drive, len(modal_system.interfaces)),
        start_sums(1, np.zeros(1)),
        make_workspace(modal_system),
        rows,
    )


def start_event_run(
    modes: ModalBasis,
    drive,
    groups,
    cycles: float,
    window: int = 1,
    travel: float = np.inf,
    start: InitialState | None = None,
    memory=None,
) -> "_Run":
    """Return a run at its start, before any motion is computed.

    The parameters are those of `simulate`.

    Its `run` computes it to the end, its `run_to` for some cycles at a time.

    Returns
    -------
    _Run
    """
    announce_runs(modes, drive, groups, cycles, window)
    return _Run(modes, drive, groups, cycles, window, travel, start, memory)


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
) -> PieceRun:
    """Run the drive from rest or from a given state; keep the last cycles with all samples.

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
    PieceRun
        Its outcome is set only where the output passed the travel.

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
    done = run.run(frames, progress, even=even)
    # the output exceeded the travel: the run is repeated up to that time, because only a run whose end is known
    # keeps the samples of its last cycles
    if done is None:
        again = start_event_run(
            modes, drive, groups, run.now / drive.period, window, np.inf, start, memory
        )
        again.outcome = Outcome.EXCEEDS_TRAVEL
        done = again.run(frames, None, even=even)
    return done


def simulate_batch(cases, cycles: int, window: int) -> list:
    """Run many cases without histories and events, in a tenth of the time of `simulate`.

    Parameters
    ----------
    cases : sequence of tuple
        (modes, drive, groups, start) of every case.
    cycles, window : int
        See `simulate`.

    Returns
    -------
    list of PieceRun

    Raises
    ------
    NotConverged
        As `simulate`, for any case.
    """
    out = []
    run = None
    for modes, drive, groups, start in cases:
        run = _Run(modes, drive, groups, cycles, window, np.inf, start, None, run)
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
    run.run_to(cycles, run._collect_into(rows))
    rows = np.concatenate(rows)
    owner = np.clip(np.searchsorted(rows[:, ROW.time], times, side="right") - 1, 0, len(rows) - 1)
    return run._make_response(
        rows, owner, np.clip(times - rows[owner, ROW.time], 0.0, rows[owner, ROW.duration]), times
    )


class _Run:
    """A run in progress. It keeps only turning points and slips from before the window.

    like: a run that has ended, whose arrays may be reused.
    """

    def __init__(self, modes, drive, groups, cycles, window, travel, start, memory, like=None):
        self.modes = modes
        self.drive = drive
        self.groups = tuple(groups)
        self.n_window = window
        self.kernels, self.dense, self.reader = load_event_kernels()
        self.modal_system = make_modal_system(modes)
        old = like.arrays if like is not None else (None,) * 5
        n = modes.omega.size
        count = max(1, ceil(cycles - WHOLE_CYCLES_TOL))
        table = make_element_table(self.groups)
        if np.any(~self.modal_system.interfaces.any(axis=1) & (table.static_limit > 0)):
            raise PatchfemError(
                "structure.mode.slide: no mode moves the interface, so friction cannot act"
            )
        motion = np.zeros((2, n)) if start is None else np.array([start.z, start.v], float)
        fresh = unstretched_memory(table, self.modal_system.interfaces @ motion[0])
        memory = fresh if memory is None else type(fresh)(*(part.copy() for part in memory))
        wanted = np.zeros(count)
        # the last whole cycle of every window
        wanted[max(0, int(cycles + WHOLE_CYCLES_TOL)) - 1 :: -window] = 1.0
        new = (
            table,
            memory,
            start_previous_cycle(self.modal_system, table),
            start_time_state(drive, len(self.groups)),
            start_sums(count, wanted, travel),
        )
        self.arrays = tuple(map(copy_into, old, new))
        self.table, self.memory, self.previous, self.time_state, self.run_sums = self.arrays
        if (
            like is not None
            and like.modal_system.interfaces.shape == self.modal_system.interfaces.shape
        ):
            self.workspace = clear_workspace(like.workspace)
            self.scratch = like.scratch
        else:
            self.workspace = make_workspace(self.modal_system)
            self.scratch = make_workspace(self.modal_system)
        self.motion = motion
        self.cycles = cycles
        self.period = drive.period
        self.n_columns = ROW.motion + 2 * n + N_COLUMNS * len(self.groups)
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
        still = self.kernels.stored_energy(
            np.zeros_like(self.motion), self.modal_system, self.table, self.memory
        )
        # energy [J] of the stretched elements minus their work and loss so far, before the energy balance of the run begins
        self.start_stretch_energy = still - float(np.sum(self.memory.work - self.memory.loss))
        self.rows = (
            np.empty((ROWS_PER_CALL, self.n_columns))
            if like is None or like.n_columns != self.n_columns
            else like.rows
        )

    def run_to(self, cycles: float, keep=None, progress=None) -> None:
        """Run up to a time in cycles.

        Where the motion repeats and the rows are not needed one by one, the last cycle is counted
        for the cycles that remain.

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
            if code == STATUS.repeats and keep in (None, self._keep_turning_rows):
                self._skip_repeating_cycles(int(stop[0]), rows)
            elif code == STATUS.done:
                break

    def _slip_signs(self, speeds, sizes) -> np.ndarray:
        """Return the signs (i,) of the slip of rigid elements at speeds (i,) [m/s].

        sizes: (i,) magnitudes that the speeds are added from [m/s].
        """
        return np.where(
            (self.table.static_limit > 0) & (np.abs(speeds) > REST_TOL * sizes),
            np.sign(speeds),
            0.0,
        )

    def _march(self, stop, rows) -> tuple:
        """Call the march; returns its status and the rows (k, w) that it filled.

        Its sums are added to those of the run as a whole: added piece by piece, the energies of a
        million cycles of four pieces were wrong by 6e-11.
        """
        sums = self.run_sums.ledger[: LEDGER.max_stored]
        before = sums.copy()
        sums[:] = 0.0
        code, used = self.kernels.march(
            stop,
            self.motion,
            self.modal_system,
            self.table,
            self.memory,
            self.previous,
            self.time_state,
            self.run_sums,
            self.workspace,
            rows,
        )
        sums += before
        if code == STATUS.idle:
            raise NotConverged(
                f"dynamics: at t = {rows[max(used - 1, 0), ROW.time]:.9g} s the contact changes between stick "
                "and slip again and again without time passing"
            )
        if code == STATUS.undetermined:
            nearer = (
                "bring friction.kinetic nearer to friction.static, or "
                if np.any(self.table.kinetic_limit < self.table.static_limit)
                else ""
            )
            raise NotConverged(
                "dynamics: after a change between stick and slip no state was found that satisfies the "
                f'friction law; {nearer}use accuracy.method = "march"'
            )
        self.has_passed_travel = code == STATUS.travel
        return code, rows[: 0 if self.has_passed_travel else used]

    def _collect_into(self, out: list):
        """Return a function that logs the events of rows and appends the rows to a list."""

        def keep(rows) -> None:
            self._log_events(rows)
            out.append(rows.copy())

        return keep

    def _keep_turning_rows(self, rows) -> None:
        """Keep the turning points and slips among rows from before the window."""
        self.is_marked = self._log_events(rows) | (rows[:, ROW.begin] == BEGIN.reversal)
        if not self.n_kept and len(rows):
            self.is_marked[0] = True  # the first row is the start of the run
        if self.n_kept < MAX_TURNING_ROWS:
            self.early_rows.append(rows[self.is_marked])
            self.n_kept += int(self.is_marked.sum())

    def _keep_equal_steps(self, step: float):
        """Return a function that keeps samples at all multiples of a step [s].

        It also keeps those of `sample_rows`.
        """
        last = np.empty((0, self.n_columns))

        def keep(rows) -> None:
            nonlocal last
            self._log_events(rows)
            if len(rows):
                rows = np.concatenate([last, rows])
                last = rows[-1:].copy()
                grid = step * np.arange(
                    ceil(rows[0, ROW.time] / step),
                    ceil((rows[-1, ROW.time] + rows[-1, ROW.duration]) / step),
                )
                self.equal_samples.append(
                    self.sample_rows(rows, grid if grid.size else rows[:1, 0])
                )

        return keep

    def _skip_repeating_cycles(self, end: int, rows) -> None:
        """Compute one cycle of a motion that repeats, and count it for the cycles that follow.

        The border is the cycle number `end`, or the next segment of the drive. The cycles are
        computed one by one where that cycle needs more than `rows`.
        """
        run_sums = self.run_sums
        begin = int(self.time_state.now[TIME.cycle])
        k = int(self.time_state.now[TIME.segment]) + 1
        if k < len(self.time_state.segments):
            end = min(end, int(self.time_state.segments[k, SEGMENT.cycle]))
        end -= 1  # the last cycle is marched, because it crosses the border
        many = end - begin - 1
        if many < 1:
            return
        sums = run_sums.ledger, self.memory.work, self.memory.loss
        before = [part.copy() for part in sums]
        noted = (len(self.events), self.n_events)
        asked = run_sums.is_phasor_wanted[begin]
        run_sums.is_phasor_wanted[begin] = 1.0
        code, done = self._march((begin + 1.0, 0.0), rows)
        run_sums.is_phasor_wanted[begin] = asked
        if len(rows):
            self._keep_turning_rows(done)
        if code != STATUS.done:
            return
        before[0][[LEDGER.max_stored, LEDGER.has_slipped]] = run_sums.ledger[
            [LEDGER.max_stored, LEDGER.has_slipped]
        ]
        for part, was in zip(sums, before):
            part += many * (part - was)
        for part in (run_sums.extremes, run_sums.phasors):
            part[begin + 1 : end] = part[begin]
        run_sums.phasors[begin:end] *= run_sums.is_phasor_wanted[begin:end, None]
        self.time_state.now[TIME.cycle] = end
        if len(rows):
            gained = self.memory.work - before[1], self.memory.loss - before[2]
            self._repeat_rows(done, many, *noted, [part / (many + 1) for part in gained])

    def _repeat_rows(self, rows, many: int, first: int, count: int, gained) -> None:
        """Keep the rows (k, w) of a cycle and its events for `many` more cycles.

        first: number of its first event; count: events before it; gained: work and loss (i,) [J]
        of the elements in a cycle. Rows are kept for at most MAX_REPEATED_CYCLES cycles.
        """
        turned = rows[self.is_marked]
        cycles = np.unique(np.linspace(1, many, min(many, MAX_REPEATED_CYCLES)).round())
        again = _shift_rows(turned, self.period * cycles)
        for column, each in zip((COLUMN.work, COLUMN.loss), gained):
            for f, part in enumerate(each):
                again[:, self._column(f, column)] += np.repeat(cycles * part, len(turned))
        self.early_rows.append(again)
        self.n_kept += len(again)
        found = np.concatenate([np.empty((0, 5)), *self.events[first:]])
        few = min(many, -(-MAX_EVENTS // max(len(found), 1)))
        self.events.append(_shift_rows(found, self.period * np.arange(many - few + 1, many + 1)))
        self.n_events += many * (self.n_events - count)

    def _log_events(self, rows) -> np.ndarray:
        """Log stops, releases, reversals and borders of the drive.

        Returns which rows (k,) begin with one.
        """
        is_event = np.zeros(len(rows), bool)
        if not len(rows):
            return is_event
        for f, interface in enumerate(self.modal_system.interfaces):
            slips = rows[:, self._column(f, COLUMN.slipping)] >= SLIP_FRACTION
            direction = np.where(slips, rows[:, self._column(f, COLUMN.direction)], 0.0)
            before = np.concatenate([self.slip_signs[f : f + 1], direction[:-1]])
            self.slip_signs[f] = direction[-1]
            changed = np.flatnonzero(before != direction)
            start = np.where(before[changed] == 0, RELEASE, REVERSAL)
            kind = np.where(direction[changed] == 0, STOP, start * direction[changed])
            if self.has_rigid:
                slide = rows[changed, self._column(f, COLUMN.slide)]
            else:
                z = rows[changed, ROW.motion : ROW.motion + self.modes.omega.size]
                slide = z @ interface
            self._add_events(rows[changed], f, kind, slide)
            is_event[changed] = True
        if self.has_rigid:
            borders = np.flatnonzero(rows[:, ROW.begin] == BEGIN.drive_border)
            self._add_events(rows[borders], -1, BORDER, 0.0)
            is_event[borders] = True
        return is_event

    def _add_events(self, rows, interface: int, kind, slide) -> None:
        """Add events that begin rows (k, w) to the log."""
        if not len(rows):
            return
        events = np.empty((len(rows), 5))
        events[:, 0] = rows[:, ROW.time]
        events[:, 1] = rows[:, ROW.phase] % (2 * np.pi)
        events[:, 2] = interface
        events[:, 3] = kind
        events[:, 4] = slide
        self.events.append(events)
        self.n_events += len(events)

    def _column(self, interface: int, column: int) -> int:
        """Return the position in a row of a column of an interface, see `InterfaceColumns`."""
        return ROW.motion + 2 * self.modes.omega.size + N_COLUMNS * interface + column

    def run(self, frames: int, progress, *, even: bool = False) -> PieceRun | None:
        """Run to the end.

        Returns None where the output passed the travel. The parameters are those of `simulate`.
        """
        end = self.cycles
        wide = []
        late = []
        even = choose_samples_per_cycle(self.drive, self.cycles, needs_history=even)
        first = max(0.0, end - self.n_window)
        last = max(0.0, end - 1)
        begin = max(0.0, min(first, end - 2))
        if begin > 0:
            self.run_to(
                begin,
                self._keep_equal_steps(self.period / even) if even else self._keep_turning_rows,
                progress,
            )
        if first > begin:
            self.run_to(first, self._collect_into(wide), progress)
        self.is_repeating = bool(self.previous.status[PREVIOUS.repeats])
        for stop in self._cycle_ends(first, last):
            self.run_to(stop, self._collect_into(late), progress)
        for k in range(frames):
            self.run_to(last + (end - last) * (k + 1) / frames, self._collect_into(late))
            self.snapshots.append(self._snapshot())
        self.run_to(end, self._collect_into(late), progress)
        return None if self.has_passed_travel else self._make_result(wide, self._close_rows(late))

    def run_without_histories(self) -> PieceRun:
        """Run to the end without histories and events.

        Few cycles are read where the motion repeats.
        """
        end = self.cycles
        late = []
        self.run_to(end - self.n_window)
        self.is_repeating = bool(self.previous.status[PREVIOUS.repeats])
        if self.is_repeating:
            self.run_to(end - min(MIN_CYCLES_READ, self.n_window))
        self.run_to(end, lambda rows: late.append(rows.copy()))
        return self._summarise(self._close_rows(late))

    def _cycle_ends(self, first: float, last: float) -> list:
        """Return the ends of the cycles of the window, for a run that ends within a cycle."""
        if abs(self.cycles - round(self.cycles)) < WHOLE_CYCLES_TOL:
            return []
        ends = self.cycles - np.arange(self.n_window, 0, -1)
        return [end for end in ends if first < end <= last]

    def _close_rows(self, late) -> np.ndarray:
        """Return the rows (k + 1, w) of the window and one without duration for its end."""
        n = self.modes.omega.size
        memory = self.memory
        row = np.zeros(self.n_columns)
        row[ROW.time] = self.now
        row[ROW.segment] = self.time_state.now[TIME.segment]
        row[ROW.cycle] = self.time_state.now[TIME.cycle]
        row[ROW.offset] = self.time_state.now[TIME.offset]
        row[ROW.motion : ROW.motion + 2 * n] = self.motion.ravel()
        for column, values in (
            (COLUMN.force, memory.force),
            (COLUMN.slip, memory.slip),
            (COLUMN.work, memory.work),
            (COLUMN.loss, memory.loss),
            (COLUMN.slide, memory.slide),
        ):
            row[self._column(0, column) :: N_COLUMNS] = values
        rows = np.concatenate([*late, row[None]])
        if self.has_rigid:
            # an event within round-off of the start of the window counts as before it
            is_long = rows[:, ROW.duration] > SAME_TIME_TOL * self.period
            rows = rows[min(int(np.argmax(is_long)), len(rows) - 2) :]
        return rows

    @property
    def now(self) -> float:
        """Time [s] of the run."""
        return float(
            self.time_state.now[TIME.cycle] * self.period + self.time_state.now[TIME.offset]
        )

    def _snapshot(self) -> dict:
        """Return time, motion and stretches of the elements at the present time."""
        return {
            "time": self.now,
            "slide": float(self.memory.slide[0]),
            "force": float(self.memory.force[0]),
            "rate": float(self.modal_system.interfaces[0] @ self.motion[1]),
            "slip": float(self.memory.slip[0]),
            "stretch": element_stretches(self.groups[0], self.memory, 0),
            "faces": [
                (float(self.memory.slide[k]), element_stretches(group, self.memory, k))
                for k, group in enumerate(self.groups)
            ],
        }

    def _summarise(self, rows) -> PieceRun:
        """Return the result without histories, from the rows of the window."""
        begun = rows[0, ROW.time]
        stop = rows[-1, ROW.time]
        faces = len(self.groups)
        span = stop - begun
        numbers = np.zeros(len(RUN)), np.zeros((faces, len(INTERFACE)))
        cycles = max(1, round(span / self.period))
        self.reader.read_rows(
            rows,
            cycles,
            self.modal_system,
            self.time_state,
            float(self.drive.moving),
            self.scratch,
            *numbers,
        )
        reading = Reading(*numbers, float(span), self.period)
        done = slice(0, max(1, ceil(stop / self.period - WHOLE_CYCLES_TOL)))
        names = ("work_in", "viscous", "power")
        book = dict(zip(names, map(float, self.run_sums.ledger[:3]))) | {
            "friction": float(self.run_sums.ledger[LEDGER.friction_loss])
        }
        now = self.kernels.stored_energy(self.motion, self.modal_system, self.table, self.memory)
        book |= {
            "stored": now - self.start_energy,
            "peak_stored": max(float(self.run_sums.ledger[LEDGER.max_stored]), self.start_energy),
        }
        alone = (
            len(self.drive.segments) == 1
            and self.modal_system.interfaces.shape == (1, 1)
            and self.modal_system.interfaces[0, 0] != 0
            and not self.has_rigid
        )
        ring = find_sticking_ring(self.modal_system, self.table, reading) if alone else None
        end = (
            InitialState(*self.motion.copy()),
            type(self.memory)(*(part.copy() for part in self.memory)),
        )
        ledger = self.run_sums.ledger
        phasors = self.run_sums.phasors[done] @ [1, 1j]
        return PieceRun(
            self.run_sums.extremes[done].copy(),
            phasors,
            book,
            self.outcome,
            reading,
            int(ledger[LEDGER.n_pieces]),
            stop / self.period,
            end,
            bool(ledger[LEDGER.has_slipped]),
            ring,
            self.is_repeating,
        )

    def _make_result(self, wide, rows) -> PieceRun:
        """Return the result with histories.

        wide, rows: rows before the window and of the window.
        """
        none = np.empty((0, self.n_columns))
        late = rows[:-1]
        begun = rows[0, ROW.time]
        stop = rows[-1, ROW.time]
        early = np.concatenate([none, *self.early_rows])
        wide = np.concatenate([none, *wide])
        number = max(MIN_SAMPLES, round((stop - begun) / self.period * SAMPLES_PER_CYCLE) + 1)
        window = self.sample_rows(late, np.linspace(begun, stop, number))
        if len(early):
            at_start = np.zeros(len(early))
            time = early[:, ROW.time]
            parts = [self._make_response(early, np.arange(len(early)), at_start, time)]
        else:
            end = (wide if len(wide) else rows)[0, ROW.time]
            parts = [_select_samples(part, part.time < end) for part in self.equal_samples]
        if len(wide):
            first = wide[0, ROW.time]
            n_samples = round((begun - first) / self.period * SAMPLES_PER_CYCLE) + 1
            more = self.sample_rows(wide, np.linspace(first, begun, n_samples))
            parts.append(_select_samples(more, more.time < begun))
        return replace(
            self._summarise(rows),
            response=_join_responses([*parts, window]),
            window=window,
            log=self.event_log(),
            snapshots=self.snapshots,
        )

    def event_log(self) -> EventLog:
        """Return the last events."""
        rows = np.concatenate([np.empty((0, 5)), *self.events])
        rows = rows[np.argsort(rows[:, ROW.time], kind="stable")][-MAX_EVENTS:]
        time, phase, interface, what, slide = rows.T
        return EventLog(
            frozen_array(time),
            frozen_array(phase),
            frozen_array(interface, np.int64),
            frozen_array(what, np.int64),
            frozen_array(slide),
            self.n_events,
        )

    def sample_rows(self, rows, grid) -> Response:
        """Return histories on a grid (k,) [s] and at turning points, stops and releases.

        The force of rigid elements jumps, so there are samples on both sides of their events.
        """
        shares = rows[:, self._column(0, COLUMN.slipping) :: N_COLUMNS] >= SLIP_FRACTION
        jumps = (rows[:, ROW.begin] > BEGIN.reversal) & self.has_rigid
        turns = rows[:, ROW.begin] == BEGIN.reversal
        events = jumps | turns | np.any(np.diff(shares, axis=0, prepend=shares[:1]), axis=1)
        if np.count_nonzero(rows[:, ROW.begin]) <= 2 * grid.size:
            # the force has a kink at a yield, so a sample there closes the energy balance of the samples
            events |= rows[:, ROW.begin] == BEGIN.yielding
        jumps = rows[jumps & (rows[:, ROW.time] > grid[0]), ROW.time]
        time = np.unique(
            np.concatenate([grid, rows[events, ROW.time], np.nextafter(jumps, -np.inf)])
        )
        owner = np.clip(
            np.searchsorted(rows[:, ROW.time], time, side="right") - 1, 0, len(rows) - 1
        )
        return self._make_response(
            rows, owner, np.clip(time - rows[owner, ROW.time], 0.0, rows[owner, ROW.duration]), time
        )

    def evaluate_rows(self, rows, owner, tau) -> np.ndarray:
        """Evaluate the motion at times after the starts of rows.

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
        self.dense.evaluate_rows(
            rows, owner, tau, self.modal_system, self.time_state, self.scratch, out
        )
        return out

    def _make_response(self, rows, owner, tau, time) -> Response:
        """Return histories at times (k,) [s], tau (k,) [s] after the starts of rows (k,)."""
        return self._response_from_columns(self.evaluate_rows(rows, owner, tau), time)

    def _response_from_columns(self, out, time) -> Response:
        """Return histories at times (k,) [s] from the columns of `evaluate_rows`."""
        modes = self.modes
        n = self.modes.omega.size
        z = out[:, :n].copy()
        v = out[:, n : 2 * n].copy()
        push = out[:, 2 * n]
        slides, rates, forces, slips, works, losses = (out[:, 2 * n + 1 + k :: 6] for k in range(6))
        base = push if self.drive.moving else np.zeros_like(push)
        accel = (
            -np.outer(push, modes.base)
            - v @ self.modal_system.damping.T
            - z * self.modal_system.omega_squared
            - forces @ self.modal_system.interfaces / modes.mass
        )
        work = works.sum(axis=1)
        lost = losses.sum(axis=1)
        extra = {
            "ledger": np.stack([work, self.start_stretch_energy + work - lost, lost, 0 * lost])
        }
        if len(self.groups) > 1:
            extra |= {"slides": slides, "slide_rates": rates, "forces": forces, "slips": slips}
        return Response(
            time,
            z,
            v,
            *(part[:, 0].copy() for part in (slides, rates)),
            z @ modes.output,
            v @ modes.output,
            accel @ modes.output + base,
            base,
            forces[:, 0].copy(),
            slips[:, 0].copy(),
            extra,
        )


def _shift_rows(rows, times) -> np.ndarray:
    """Return rows (k, w), which begin with a time [s], for each of some delays (m,) [s]."""
    out = np.tile(rows, (len(times), 1))
    out[:, 0] += np.repeat(times, len(rows))
    return out


_COLUMNS = (
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


def _select_samples(response: Response, which) -> Response:
    extra = {
        name: part[:, which] if name == "ledger" else part[which]
        for name, part in response.extra.items()
    }
    return Response(*(getattr(response, name)[which] for name in _COLUMNS), extra)


def _join_responses(parts) -> Response:
    if len(parts) == 1:
        return parts[0]
    extra = {
        name: np.concatenate([r.extra[name] for r in parts], axis=1 if name == "ledger" else 0)
        for name in parts[0].extra
    }
    whole = Response(
        *(np.concatenate([getattr(r, name) for r in parts]) for name in _COLUMNS), extra
    )
    later = np.diff(np.maximum.accumulate(whole.time), prepend=-np.inf) > 0
    return whole if later.all() else _select_samples(whole, later)
