"""Simulation of modes under a smooth friction law, from the initial state to the result."""

from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache
from math import ceil
from typing import NamedTuple

import numpy as np

from ... import compiled
from ...core import IntegratedMeasures, ModalBasis, Outcome, Response
from ...friction.laws.stretch import unpack_bonds
from ...friction.path_work import sampled_work
from ...structure.drive_sizes import choose_samples_per_cycle
from ..cycles import choose_sample_times
from ..events.modal_system import drive_segments
from ..events.positions_kernels import SEGMENT_KIND, Segment
from ..integrated import make_histories
from ..march.march import MarchResult
from ..periodicity import FIRST_CHECK, bound_remaining_change
from .arrays import N_NODES, STATUS, Counter, MotionArrays, MotionRecord, Scalar, Work
from .reader import measure_parts

# Number of reversal rows that one call of the loop can fill.
REVERSALS_PER_CALL = 4096
# Number of rows for parts of steps that one call of the loop can fill.
PARTS_PER_CALL = 1024
# Largest number of stored reversals from before the window.
MAX_KEPT_REVERSALS = 400_000
# Tolerance of the last cycles relative to that of the run; these are interpolated within the
# steps, where the error is larger.
LAST_TOLERANCE_RATIO = 0.01
# Number of windows whose phasors are kept; a steady amplitude needs five
# (`response.settling.extrapolate_steady_amplitudes`).
N_PHASOR_WINDOWS = 8
# Length of the first step, relative to the shortest time scale of modes and drive.
FIRST_STEP_RATIO = 1e-3
# Largest remaining change of a periodic motion, relative to the tolerance of a step.
MAX_REPEAT_CHANGE = 10.0
# Largest change of the extremes between two cycles, relative to MAX_REPEAT_CHANGE;
# their steps lie at other times.
MAX_CYCLE_RATIO = 10.0
PACKAGE = "dynamics.smooth"


@cache
def load_loop(law: str, say=None):
    """Load the compiled step loop for the friction law in a kernel module.

    say: is called before it is compiled.
    """
    law = compiled.load(law, say)
    steps = compiled.instantiate(f"{PACKAGE}.step_kernels", {"law": law})
    watch = compiled.instantiate(f"{PACKAGE}.watch_kernels", {"law": law, "steps": steps})
    return compiled.instantiate(
        f"{PACKAGE}.loop_kernels", {"law": law, "steps": steps, "watch": watch}
    )


@dataclass(frozen=True, eq=False, slots=True)
class SmoothResult(MarchResult):
    """Result of a simulation with a smooth friction law, with statistics of the integrator.

    - integrated: measures of the last cycles, integrated over their steps
    - peak_errors: errors of peaks [unit of the measure] by measure
    - with_reversals: histories of the last cycles with samples at reversals
    - repeat_change: remaining change of the motion, relative to its size, if cycles were
      skipped
    - tolerance: relative tolerance of its steps
    """

    integrated: IntegratedMeasures | None = None
    peak_errors: dict = field(default_factory=dict)
    with_reversals: Response | None = None
    repeat_change: float = 0.0
    tolerance: float = 0.0


def start_arrays(modes: ModalBasis, drive, element, cycles: float, start=None) -> tuple:
    """Return the arrays of a motion at its initial state.

    The first step is FIRST_STEP_RATIO divided by the fastest rate of modes and drive.

    Parameters
    ----------
    modes : ModalBasis
    drive
    element : Element
        The law with its numbers and the sizes of its memory.
    cycles : float
        Cycles of the run.
    start : InitialState, optional
        At rest by default.

    Returns
    -------
    MotionArrays, MotionRecord
    """
    n = modes.omega.size
    n_law_states = len(element.state_scales)
    size = 2 * n + n_law_states + 3
    damping = np.zeros((0, 0)) if modes.damping is None else modes.damping
    state = np.zeros(size)
    if start is not None:
        state[:n] = start.z
        state[n : 2 * n] = start.v
    fastest_rate = max(
        float(np.max(modes.omega * np.maximum(1.0, 2 * modes.zeta), initial=0.0)),
        2 * np.pi / drive.period,
    )
    scalars = np.zeros(len(Scalar))
    counters = np.zeros(len(Counter))
    work = np.zeros((26, size))
    scalars[[Scalar.STEP, Scalar.FIRST_STEP, Scalar.FASTEST_RATE, Scalar.MASS]] = (
        FIRST_STEP_RATIO / fastest_rate,
        FIRST_STEP_RATIO / fastest_rate,
        fastest_rate,
        modes.mass,
    )
    scalars[Scalar.STIFFNESS] = element.limit / element.length if element.length else 0.0
    scalars[[Scalar.PERIOD, Scalar.BASE_MOVES]] = (drive.period, drive.moving)
    counters[Counter.PERIOD] = drive.period
    work[Work.SIZES, 2 * n : -3] = element.state_scales
    rows = np.stack(
        [modes.omega, 2 * modes.zeta * modes.omega, modes.slide, modes.base, modes.output]
    )
    law = element.numbers[None], [element.memory] * 2, [1.0, np.inf, 1.0, *np.zeros(7)]
    arrays = (rows, damping, drive_segments(drive), *law, state, work, scalars)
    motion = MotionArrays(*(np.array(array, float, order="C") for array in arrays))
    cycles = np.zeros((4, max(1, ceil(cycles - 1e-9))))
    cycles[0] = np.inf
    cycles[1] = -np.inf
    width = 2 * n + 7
    return motion, MotionRecord(
        cycles,
        np.zeros((0, width)),
        np.zeros((REVERSALS_PER_CALL, width)),
        np.zeros((0, N_NODES, width)),
        counters,
        np.zeros(size),
    )


def make_response(modes, drive, rows, stored: float) -> Response:
    """Compute histories from the sample rows of a motion.

    Parameters
    ----------
    modes, drive
    rows : ndarray
        (k, 2 n + 7) see `MotionRecord`.
    stored : float
        Largest stored energy [J].

    Returns
    -------
    Response
    """
    n = modes.omega.size
    time = rows[:, 0]
    z = rows[:, 1 : 1 + n]
    rate = rows[:, 1 + n : 1 + 2 * n]
    stored_in_interface, work = rows[:, 5 + 2 * n :].T
    losses = np.diff(work - stored_in_interface, prepend=0.0)
    noise = 1e-8 * max(stored, float(np.abs(work).max(initial=0.0)))
    ledger = np.stack(
        [
            work,
            stored_in_interface,
            np.cumsum(np.maximum(losses, 0.0)),
            np.cumsum(np.where(losses < -noise, -losses, 0.0)),
        ]
    )
    return make_histories(
        modes, drive, time, (z, rate), rows[:, 1 + 2 * n : 5 + 2 * n].T, {"ledger": ledger}
    )


def select_phasor_cycles(count: int, window: int) -> np.ndarray:
    """Return a mask (count,) of the last cycle of each of the last N_PHASOR_WINDOWS windows.

    Only the phasors of these cycles are computed. `window` is the number of cycles of a window.
    """
    cycles_to_end = np.arange(count)[::-1]
    return (cycles_to_end % window == 0) & (cycles_to_end < N_PHASOR_WINDOWS * window)


class MotionState(NamedTuple):
    """Present state of a motion: sample, counters, memory of the law and stored energy.

    - sample: (2 n + 7,) see `MotionRecord`
    - counters: see `Counter`
    - memory: of the law
    - stored: energy of modes and interface [J]
    """

    sample: np.ndarray
    counters: np.ndarray
    memory: np.ndarray
    stored: float


class Motion:
    """Motion in progress: its arrays, its record and the results collected so far.

    repeat_change: remaining change, relative to its size, if cycles were skipped because it
    repeats.
    """

    def __init__(
        self,
        modes: ModalBasis,
        drive,
        element,
        cycles: float,
        tolerance: float,
        travel: float = np.inf,
        start=None,
    ):
        self.modes = modes
        self.drive = drive
        self.element = element
        self.tolerance = tolerance
        self.travel = travel
        self.cycles = cycles
        self.loops = load_loop(element.kernels)
        self.arrays, self.record = start_arrays(modes, drive, element, cycles, start)
        self.turns = []
        self.parts = []
        self.begun = 0.0
        self.repeat_change = 0.0
        self.outcome = None
        self.message = ""
        self.progress = None
        self.run_to(0.0)
        self.first = self.read_state().sample
        self.begun = float(self.record.counters[Counter.MAX_STORED])

    def fork(self, drive):
        """Return an independent copy of the motion that continues with another drive signal."""
        twin = copy(self)
        twin.progress = None
        twin.arrays = type(self.arrays)(*(array.copy() for array in self.arrays))
        twin.record = type(self.record)(*(array.copy() for array in self.record))
        twin.turns = list(self.turns)
        if drive is not self.drive:
            twin.arrays = twin.arrays._replace(segments=drive_segments(drive))
            twin.drive = drive
            twin._enter_segment(
                int(np.searchsorted(twin._segment_starts(), twin.time, side="right")) - 1
            )
        return twin

    def request_last_phasors(self, window: int) -> None:
        """Request phasors only for the final cycles of the last window and of the windows before it."""
        self.record.cycles[2:, ~select_phasor_cycles(self.record.cycles.shape[1], window)] = np.nan

    def extremes(self, count: int) -> np.ndarray:
        """Return the smallest and largest output (count, 2) [m] in each of the first `count` cycles."""
        return self.record.cycles[:2, :count].T.copy()

    @property
    def time(self) -> float:
        """Present time of the motion [s]."""
        return float(self.arrays.scalars[Scalar.TIME])

    def _segment_starts(self) -> np.ndarray:
        """Return the times (p,) [s] at which the segments of the drive signal begin."""
        return self.arrays.segments[:, [Segment.CYCLE, Segment.OFFSET]] @ [self.drive.period, 1.0]

    def _enter_segment(self, piece: int) -> None:
        self.arrays.scalars[Scalar.SEGMENT] = piece

    def run_to(self, time: float, times=(), records_parts: bool = False) -> np.ndarray:
        """March the motion to a given time, with samples at given times.

        Parameters
        ----------
        time : float
            Time at which the run stops [s].
        times : array_like, optional
            (s,) times of samples [s].
        records_parts : bool, optional
            Whether all steps are kept in `parts`.

        Returns
        -------
        ndarray
            (s, 2 n + 7) samples; fewer if the run ends before.
        """
        times = np.asarray(times, float)
        width = self.record.turns.shape[1]
        samples = np.zeros((times.size, width))
        parts = np.zeros((PARTS_PER_CALL if records_parts else 0, N_NODES, width))
        samples[:, 0] = times
        self.record = self.record._replace(samples=samples, parts=parts)
        self.record.counters[Counter.NEXT_SAMPLE] = 0
        ends = np.append(self._segment_starts()[1:], np.inf)
        while self.outcome is None:
            end = float(ends[int(self.arrays.scalars[Scalar.SEGMENT])])
            if self.time >= end:
                self._enter_segment(int(self.arrays.scalars[Scalar.SEGMENT]) + 1)
                continue
            status = self.loops.advance_motion(
                self.arrays, self.record, float(time), end, self.tolerance, float(self.travel)
            )
            self._collect(status)
            # Progress is reported only here, because shortening a step for a
            # sample would change the motion.
            if self.progress is not None:
                self.progress(min(self.time / (self.cycles * self.drive.period), 1.0))
            if status == STATUS.finished and self.time >= time:
                break
        return self.record.samples[: int(self.record.counters[Counter.NEXT_SAMPLE])]

    def run_ahead_to(self, time: float) -> None:
        """March the motion to a time [s]; skip cycles once the motion repeats.

        `periodicity` determines when the motion is checked, and bounds its remaining change. The
        energies are continued as in the last quarter of the cycles between two checks, so their
        change must be as small. The last cycle must equal the previous one.
        """
        period = self.drive.period
        n_cycles = 2 * FIRST_CHECK
        change_before = None
        first = ceil(max(self.time, self._segment_starts()[-1]) / period - 1e-9)
        if not self._has_final_sine() or (first + n_cycles) * period >= time:
            self.run_to(time)
            return
        self.run_to((first + FIRST_CHECK) * period)
        last_state = self.arrays.state.copy()
        while self.outcome is None and (first + n_cycles) * period < time:
            # The value 0 marks a cycle whose phasor is requested.
            self.record.cycles[2:, first + n_cycles - 1] = 0.0
            self.run_to((first + n_cycles - n_cycles // 4) * period)
            sums_before = self._read_sums()
            self.run_to((first + n_cycles) * period)
            change = self._measure_change(last_state)
            n_skipped = int(time / period + 1e-9) - first - n_cycles
            if change_before is not None and self.outcome is None and n_skipped > 0:
                remaining_change = bound_remaining_change(
                    change, change_before, n_skipped, n_cycles
                )
                if (
                    remaining_change <= MAX_REPEAT_CHANGE * self.tolerance
                    and self._has_equal_cycles(first + n_cycles)
                ):
                    self._skip_cycles(
                        n_skipped, (self._read_sums() - sums_before) / (n_cycles // 4)
                    )
                    self.repeat_change = remaining_change
                    break
            last_state = self.arrays.state.copy()
            change_before = change
            n_cycles = 2 * n_cycles
        self.run_to(time)

    def _has_final_sine(self) -> bool:
        """Return whether the drive signal ends in a sine whose period is that of the signal."""
        last = self.arrays.segments[-1]
        has_period = abs(last[Segment.OMEGA] * self.drive.period / (2 * np.pi) - 1) < 1e-12
        return (
            last[Segment.KIND] == SEGMENT_KIND.sine and last[Segment.AMPLITUDE] != 0 and has_period
        )

    def _measure_change(self, last) -> float:
        """Return the largest relative change since an earlier state, or the tolerance if that is larger.

        Coordinates and rates count relative to their recent maximum, states of the law relative to
        their sizes.
        """
        scalars = self.arrays.scalars
        n = self.modes.omega.size
        sizes = self.arrays.work[Work.SIZES]
        scale = np.concatenate(
            [np.repeat(scalars[[Scalar.MAX_COORDINATE, Scalar.MAX_RATE]], n), sizes[2 * n : -3]]
        )
        return max(
            float(np.max(np.abs(self.arrays.state - last)[:-3] / np.maximum(scale, 1e-300))),
            self.tolerance,
        )

    def _has_equal_cycles(self, count: int) -> bool:
        """Return whether the extremes of the last two cycles are equal within the error of their steps.

        The error of the steps bounds the difference.
        """
        before, last = self.record.cycles[:2, count - 2 : count].T
        return np.abs(
            last - before
        ).max() <= MAX_CYCLE_RATIO * MAX_REPEAT_CHANGE * self.tolerance * np.ptp(last)

    def _read_sums(self) -> np.ndarray:
        """Return the energies (5,) [J] that accumulate from cycle to cycle.

        They are the work of the drive minus the stored energy, viscous loss, friction work, the
        magnitude of the work of the drive, and friction loss.
        """
        return np.append(
            self.arrays.state[-3:] - [self.read_state().stored, 0.0, 0.0],
            self.record.counters[[Counter.DRIVE_POWER, Counter.FRICTION_LOSS]],
        )

    def _skip_cycles(self, count: int, sums) -> None:
        """Skip a number of cycles, each of which equals the last cycle.

        sums: (5,) growth of `_read_sums` per cycle [J].
        """
        period = self.drive.period
        at = round(self.time / period)
        turns = np.concatenate([self.record.turns[:0], *self.turns[-2:]])
        self.arrays.state[-3:] += count * sums[:3]
        self.arrays.scalars[Scalar.START_LOSS] += count * sums[2]
        self.record.counters[[Counter.DRIVE_POWER, Counter.FRICTION_LOSS]] += count * sums[3:]
        self.record.cycles[:, at : at + count] = self.record.cycles[:, at - 1 : at]
        turns = turns[turns[:, 0] > self.time - period * (1 - 1e-9)]
        shown = min(
            count, max(0, MAX_KEPT_REVERSALS - sum(map(len, self.turns))) // max(1, len(turns))
        )
        later = np.zeros((shown, 1, turns.shape[1]))
        later[:, 0, 0] = period * np.arange(1, shown + 1)
        later[:, 0, -1] = sums[2] * np.arange(1, shown + 1)
        self.turns.append((turns + later).reshape(-1, turns.shape[1]))
        self.arrays.scalars[Scalar.TIME] = (at + count) * period

    def _collect(self, status: int) -> None:
        """Collect the records from a call of the step loop, and set the outcome according to its status."""
        count = int(self.record.counters[Counter.N_TURNS])
        if count and sum(map(len, self.turns)) < MAX_KEPT_REVERSALS:
            self.turns.append(self.record.turns[:count].copy())
        if self.record.counters[Counter.N_PARTS]:
            self.parts.append(
                self.record.parts[: int(self.record.counters[Counter.N_PARTS])].copy()
            )
        self.record.counters[[Counter.N_TURNS, Counter.N_PARTS]] = 0
        if status == STATUS.travel:
            self.outcome = Outcome.EXCEEDS_TRAVEL
        elif status == STATUS.lifted:
            self.outcome = Outcome.LEAVES_GROOVES
        elif status in (STATUS.not_finite, STATUS.no_step):
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"at {self.time:.6g} s no time step, however small, meets the tolerance; use "
                'accuracy.method = "march"'
            )

    def energy_ledger(self) -> dict:
        """Return the energies [J] up to the present time, and the number of steps taken."""
        state = self.read_state()
        counters = state.counters
        energies = self.arrays.state[-3:]
        return {
            "work_in": float(energies[0]) + self.begun,
            "viscous": float(energies[1]),
            "power": float(counters[Counter.DRIVE_POWER]) + self.begun,
            "friction": float(counters[Counter.FRICTION_LOSS]),
            "peak_stored": float(counters[Counter.MAX_STORED]),
            "stored": state.stored,
            "iterations": float(counters[Counter.ACCEPTED] + counters[Counter.REFUSED]),
            "worst_iterations": 1.0,
            "steps": float(counters[Counter.ACCEPTED]),
        }

    def read_state(self) -> "MotionState":
        """Return the present state of the motion."""
        record = self.record._replace(counters=self.record.counters.copy())
        twin = self.arrays._replace(
            memory=self.arrays.memory.copy(), scalars=self.arrays.scalars.copy()
        )
        sample = np.zeros(record.turns.shape[1])
        stored = float(self.loops.read_state(twin, record, sample))
        return MotionState(sample, record.counters, twin.memory[0], stored)

    def response(self, rows) -> Response:
        """Compute histories from sample rows (k, 2 n + 7), with forces clipped to the friction limit.

        The dense output of a step may exceed that limit.
        """
        if self.element.is_bounded:
            rows = rows.copy()
            force = 2 * self.modes.omega.size + 3
            np.clip(rows[:, force], -self.element.limit, self.element.limit, out=rows[:, force])
        return make_response(
            self.modes, self.drive, rows, float(self.record.counters[Counter.MAX_STORED])
        )

    def end_state(self) -> np.ndarray:
        """Return the present time [s], output [m], output rate [m/s] and friction work [J]."""
        n = self.modes.omega.size
        y = self.arrays.state
        output = self.modes.output
        return np.array([self.time, y[:n] @ output, y[n : 2 * n] @ output, y[-1]])

    def run_last_cycles(
        self, end: float, window: float, shots=(), snapshots: list | None = None
    ) -> tuple:
        """March to the end of the run, and keep the samples of the last window.

        Parameters
        ----------
        end, window : float
            [s].
        shots : sequence of float, optional
            Times [s] of snapshots of the interface, which are appended to `snapshots`.
        snapshots : list, optional

        Returns
        -------
        rows : ndarray
            (k, 2 n + 7) samples.
        measures : tuple
            See `reader.measure_parts`.
        """
        begin = max(end - window, self.time)
        self.run_ahead_to(begin)
        start_state = self.end_state()
        tolerance = self.tolerance
        self.parts = []
        # The interpolation within a step has a larger error than the step itself.
        self.tolerance *= LAST_TOLERANCE_RATIO
        self.arrays.scalars[Scalar.STEP] *= LAST_TOLERANCE_RATIO**0.125
        times = choose_sample_times(begin, end, self.drive.period)
        rows = []
        last_shot = -np.inf
        for shot in [*[t for t in shots if begin <= t < end], end]:
            rows.append(self.run_to(shot, times[(times > last_shot) & (times <= shot)], True))
            last_shot = shot
            if snapshots is not None and shot in shots:
                snapshots.append(self._snapshot())
            if self.outcome is not None:
                break
        self.tolerance = tolerance
        rows = np.concatenate(rows)
        if not self.parts:
            return rows, (None, {})
        part_rows = np.concatenate(self.parts)
        return rows, measure_parts(
            self.response(part_rows.reshape(-1, part_rows.shape[2])),
            self.drive,
            np.array([start_state, self.end_state()]),
        )

    def _snapshot(self) -> dict:
        state = self.read_state()
        slide, rate, force, slip = state.sample[-6:-2]
        out = {"time": self.time, "slide": slide, "rate": rate, "force": force, "slip": slip}
        points = self.element.form == "points"
        return out | ({"bonds": unpack_bonds(self.element, state.memory).copy()} if points else {})


def simulate(
    modes: ModalBasis,
    drive,
    element,
    cycles: float,
    tolerance: float,
    window: int = 10,
    travel: float = np.inf,
    frames: int = 0,
    start=None,
    progress=None,
    *,
    even: bool = False,
) -> SmoothResult:
    """Simulate the motion from rest or from a given state with a relative error tolerance.

    Parameters
    ----------
    modes : ModalBasis
    drive
    element : friction.protocol.Element
        Law with its rates, on the one interface of the modes.
    cycles : float
        Cycles of the drive.
    tolerance : float
        Relative tolerance of a step.
    window : int, optional
        Cycles at the end whose samples are kept.
    travel : float, optional
        Displacement of the output [m] at which the run ends.
    frames : int, optional
        Snapshots of the interface in the last cycle.
    start : InitialState, optional
        At rest by default.
    progress : callable, optional
        Is called with the fraction of the run that is done, whenever the loop returns.
    even : bool, optional
        Whether equidistant samples of all cycles are kept, as `needs_history` of
        `choose_samples_per_cycle`.

    Returns
    -------
    SmoothResult
        Its outcome is set if the output passed the travel, and if no step meets the
        tolerance.
    """
    run = Motion(modes, drive, element, cycles, tolerance, travel, start)
    period = drive.period
    run.request_last_phasors(window)
    run.progress = progress
    n_equidistant = choose_samples_per_cycle(drive, cycles, needs_history=even)
    early_rows = _run_to_window(run, window * period, n_equidistant)
    snapshots = []
    shots = []
    if frames:
        times = cycles * period - np.linspace(min(1.0, cycles), 0.0, frames + 1)[1:] * period
        shots = [float(min(time, cycles * period)) for time in times]
    rows, (integrated, peak_errors) = run.run_last_cycles(
        cycles * period, window * period, shots, snapshots
    )
    # The last cycles were not known in advance, so the run is repeated up to its end.
    if run.outcome is not None and run.time > 0:
        result = simulate(
            modes,
            drive,
            element,
            run.time / period,
            tolerance,
            window,
            np.inf,
            frames,
            start,
            even=bool(n_equidistant),
        )
        return replace(result, outcome=run.outcome, message=run.message)
    with_reversals = run.response(_merge_reversals(rows, run, rows[0, 0]))
    begin = early_rows[0][0, 0] if early_rows and not n_equidistant else rows[0, 0]
    all_rows = np.concatenate([*_select_reversal_rows(run, begin), *early_rows, rows])
    if n_equidistant:
        all_rows = all_rows[np.unique(all_rows[:, 0], return_index=True)[1]]
    n_cycles = max(1, ceil(run.time / period - 1e-9))
    return SmoothResult(
        response=run.response(all_rows),
        window=run.response(rows),
        step_force=np.zeros(0),
        extremes=run.extremes(n_cycles),
        phasors=np.array([1, 1j]) @ run.record.cycles[2:, :n_cycles],
        ledger=run.energy_ledger() | _compute_work_check(with_reversals),
        outcome=run.outcome,
        snapshots=snapshots,
        window_work=integrated.loops[0].work,
        cycles_done=run.time / period,
        message=run.message,
        integrated=integrated,
        peak_errors=peak_errors,
        with_reversals=with_reversals,
        repeat_change=run.repeat_change,
        tolerance=tolerance,
    )


def _run_to_window(run: Motion, window: float, n_equidistant: int) -> list:
    """March to the start of the last window; return the sample rows of the time before it.

    They are `n_equidistant` samples of every cycle unless that is 0, and those of the last two
    cycles before the window.
    """
    period = run.drive.period
    end = run.cycles * period
    last_cycles = min(2.0, run.cycles) * period
    rows = []
    if n_equidistant:
        begin = end - max(last_cycles, window)
        rows.append(run.run_to(begin, np.arange(0, begin, period / n_equidistant)))
    if window < last_cycles:
        run.run_ahead_to(end - last_cycles)
        times = choose_sample_times(end - last_cycles, end - window, period, 2)
        rows.append(run.run_to(end - window, times)[:-1])
    return rows


def _compute_work_check(response) -> dict:
    """Return the friction work [J] from the samples and from the energy ledger, and its magnitude."""
    parts = np.diff(response.extra["ledger"][0])
    return {
        "sampled": float(sampled_work(response.slide, response.force).sum()),
        "booked": float(parts.sum()),
        "passed": float(np.abs(parts).sum()),
    }


def _merge_reversals(rows, run, begin: float) -> np.ndarray:
    """Merge the sample rows with those at reversals after a given time, in order of time."""
    turns = np.concatenate(run.turns) if run.turns else rows[:0]
    every = np.concatenate([rows, turns[(turns[:, 0] > begin) & (turns[:, 0] < rows[-1, 0])]])
    every = every[np.argsort(every[:, 0], kind="stable")]
    return every[np.append(True, np.diff(every[:, 0]) > 1e-9 * run.drive.period)]


def _select_reversal_rows(run, begin: float) -> list:
    """Return the sample rows at the start, and at the reversals before a given time [s]."""
    if run.first[0] >= begin:
        return []
    turns = np.concatenate(run.turns) if run.turns else np.zeros((0, run.first.size))
    return [run.first[None], turns[(turns[:, 0] > run.first[0]) & (turns[:, 0] < begin)]]
