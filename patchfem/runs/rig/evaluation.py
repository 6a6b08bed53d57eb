"""Evaluation of a run of any engine: measures, stick, outcome and drive levels.

In: a run of an engine. Out: its `Solution`. Subclasses of `RunEvaluator` return the quantities that their engine computes
more accurately than from samples. If the amplitude of the drive changes in levels, the state is continued from level to
level: there is a `Level` with errors for each of them, the onset level found by bisection, and the joined run.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ... import friction, structure
from ...convergence import MAX_CONVERGENCE_ORDER, convergence_error
from ...core import Measure, Outcome, Response, SineDrive
from ...cost_model import measure_cpu_time
from ...effects import law_has_trait
from ...formatting import format_length
from ...motion_measures import find_extremes
from ...response.decay_curve import measure_last_cycle_amplitude
from ...response.errors import ComparisonRuns, estimate_errors, split_errors
from ...response.events import (
    LEVEL_MEASURES,
    Events,
    Level,
    VibratingMode,
    bracket_onset,
    is_all_stuck,
    join_events,
    make_no_onset_reason,
    make_onset_test,
)
from ...response.loops import CycleLoop, choose_reversal_force_rule, sample_loop
from ...response.measures import Measures, Values, compare_friction_works
from ...response.reasons import MAX_OTHER_MODES_FRACTION
from ...response.rows import AMPLITUDE, MOTION_TABLE, STEADY_AMPLITUDE, LastCycles, compute_measures
from ..results.result import Settings, SteadyData

Fields = dict[str, Any]  # fields of a record by name
# Displacement at which a motion has left the range of a softening spring, relative to that without restoring force.
ESCAPE_DISPLACEMENT_RATIO = 2.0
NO_PEAK_REASON = "the output does not move at any of the swept frequencies, so there is no peak"


@dataclass(frozen=True, eq=False, slots=True)
class Solution:
    """Result of an engine for one run, without error estimates from coarse runs.

    - values: measures by name.
    - response, window: stored histories, and those of the last cycles.
    - outcome: Outcome, or None if it is determined from the cycles.
    - snapshots: states of the interface in the last cycle.
    - book: energies [J] and counters by name.
    - seconds: CPU time of the run [s].
    - contact: contact model of the run.
    - prepare: CPU time of each part of the preparation [s].
    - message: reason of an early end.
    - levels, run_level: Level of each drive level, and a function that runs another level (`find_onset`).
    - log: events of an event-driven engine.
    - notes: warnings of the engine.
    - stick_tolerance: largest slip per cycle [m] at which the interface counts as stuck.
    - run_errors: error estimates by measure from the run itself, without coarse runs.
    - errors: error estimates by measure of an engine that needs no coarse runs, or None.
    - bond_summation: EngineChoice of the bond summation, or None without bonds.
    - coarser: pairs of a coarse run and its reference run (None for this run).
    - extremes (c, 2), phasors (c,): minimum and maximum output, and phasor of the output, of every cycle [m], from which
      the outcome is determined, or None if the engine sets the outcome.
    - drive: drive of the largest motion of a response curve or of drive levels, or None for a single motion.
    - peak_error: error of the frequency of this drive [Hz], or inf for a curve without a peak, NaN without a curve.
    - tail: `events.VibratingMode` that remains after the last slip of a release, or None.
    - settings: Settings of an engine that only it knows.
    - periodic: SteadyData of a periodic motion, or None.
    """

    values: Values
    response: Response
    window: Response
    outcome: Outcome | None
    snapshots: Sequence
    book: Values
    seconds: float
    contact: object = None
    prepare: Values | None = None
    message: str = ""
    levels: tuple[Level, ...] = ()
    run_level: Callable[[int, float], Level] | None = None
    log: Events | None = None
    notes: tuple[str, ...] = ()
    stick_tolerance: float = 0.0
    run_errors: Values = field(default_factory=dict)
    errors: Values | None = None
    bond_summation: "friction.bonds.engines.EngineChoice | None" = None
    coarser: "tuple[tuple[Solution, Solution | None], ...]" = ()
    extremes: np.ndarray | None = None
    phasors: np.ndarray | None = None
    drive: SineDrive | None = None
    peak_error: float = np.nan
    tail: VibratingMode | None = None
    settings: Settings = field(default_factory=Settings)
    periodic: SteadyData | None = None


def find_travel(rig) -> float:
    """Return the output displacement [m] at which a run ends.

    It is the travel that the scene allows, or less for a softening spring, whose force decreases beyond a displacement.
    """
    cubic = rig.springs.cubic
    if cubic is None or cubic >= 0:
        return rig.springs.travel
    stiffness = rig.modes.mass * rig.modes.omega[0] ** 2 / max(rig.modes.output[0] ** 2, 1e-300)
    return min(rig.springs.travel, ESCAPE_DISPLACEMENT_RATIO * float(np.sqrt(stiffness / -cubic)))


def describe_escape(rig, travel: float) -> str:
    """Return why a run ended at the displacement `travel` [m]; "" if it is the travel that the scene allows."""
    if travel >= rig.springs.travel:
        return ""
    return (
        f"beyond a displacement of {format_length(travel, 3)} the motion grows without limit, because the force of the "
        "softening spring no longer pulls the block back; the run ended there"
    )


def replace_output_by_gauge(model, solution: Solution) -> Solution:
    """Return a Solution whose output is the motion at the gauge instead of the accelerometer.

    Whether the motion has become steady is still judged at the accelerometer. The steady amplitude
    at the gauge is unknown.
    """
    gauge = model.rig.modes.gauge
    if gauge is None:
        return solution
    window = _compute_gauge_histories(solution.window, gauge)
    low, high = find_extremes(window.time, window.output, window.output_rate)
    amplitude = (high - low) / 2
    ratio = max(1.0, amplitude / max(solution.values[AMPLITUDE], 1e-300))
    errors = solution.errors and solution.errors | {
        AMPLITUDE: ratio * solution.errors.get(AMPLITUDE, 0.0)
    }
    values = {key: value for key, value in solution.values.items() if key != STEADY_AMPLITUDE}
    return replace(
        solution,
        values=values | {AMPLITUDE: amplitude},
        response=_compute_gauge_histories(solution.response, gauge),
        window=window,
        errors=errors,
    )


def _compute_gauge_histories(histories: Response, gauge) -> Response:
    """Return histories whose output is the motion at the gauge.

    `gauge` (n,) is the participation of the modes in this motion.
    """
    sensor = {"sensor": histories.output, "sensor_rate": histories.output_rate}
    return replace(
        histories,
        output=histories.modal @ gauge,
        output_rate=histories.modal_rate @ gauge,
        extra=histories.extra | sensor,
    )


def first_interface_load(model, patch) -> float | None:
    """Return the normal load [N] on the first interface; None without friction."""
    if model.friction is None:
        return None
    return model.point.load if patch is None else patch.pressure.load


def first_mode_stiffness(model, window) -> float:
    """Return the stiffness [N/m] of the first mode, referred to the displacement at the contact.

    It is 0 if other modes contribute more than MAX_OTHER_MODES_FRACTION of this displacement.

    Parameters
    ----------
    model : Model
        Model of a rig.
    window : Response
        Samples of the last cycles.
    """
    first_mode = model.rig.first_mode
    if first_mode.fraction_of_other_modes(window.modal) > MAX_OTHER_MODES_FRACTION:
        return 0.0
    return first_mode.stiffness


def compute_sampled_loop(window, drive, work: float, force=None) -> CycleLoop | None:
    """Compute the friction loop of the last cycles from samples; None if they contain no complete cycle.

    Parameters
    ----------
    window : Response
        Samples of the last cycles.
    drive
        Drive, whose frequency is that of the harmonics.
    work : float
        Friction work per cycle [J].
    force : complex, optional
        First harmonic of the force [N], if it is known more accurately.
    """
    if not structure.drive_sizes.has_full_cycle(window.time[-1] - window.time[0], drive):
        return None
    force = window.force if force is None else force
    return sample_loop(
        window.time, window.slide, force, structure.drive_sizes.find_drive_omega(drive), work
    )


def compute_peak_frequency(solution: Solution, coarser=()) -> Measures:
    """Return a dict with the frequency [Hz] and the half-power width [Hz] of the peak of a response curve.

    The measures have no value if the amplitude is 0. The dict is empty without a curve, and has no width if only the peak
    of the curve was computed.

    Parameters
    ----------
    solution : Solution
        Solution at the peak, with its drive and the error of its frequency.
    coarser : sequence of Solution
        Coarse runs; the shift of their peaks is part of the error.

    Returns
    -------
    dict
        `peak_frequency` and `peak_width`, or {}.
    """
    if np.isnan(solution.peak_error):
        return {}
    if np.isinf(solution.peak_error):
        return {"peak_frequency": Measure(None, "Hz", None, 0.0, reason=NO_PEAK_REASON)}
    peak_frequency = float(solution.drive.omega / (2 * np.pi))
    peaks = [run.drive.omega / (2 * np.pi) for run in coarser if run.drive is not None]
    shift = float(np.abs(np.array(peaks) - peak_frequency).max(initial=0.0))
    error = solution.peak_error + convergence_error(shift)
    peak = {"peak_frequency": Measure(peak_frequency, "Hz", error, 0.0)}
    width = solution.periodic and solution.periodic.width
    return peak if width is None else peak | {"peak_width": width}


# Relative error of the measures of an event-driven run, which has round-off only.
EXACT_RELATIVE_ERROR = 1e-9
# Largest number of bisections of an onset; 40 of them reduce the bracket to 1e-12.
MAX_ONSET_BISECTIONS = 40


def add_level_errors(
    drive_levels: Sequence[Level], coarser_runs: ComparisonRuns, solutions
) -> tuple[Level, ...]:
    """Add the differences from coarse runs to the errors of each drive level.

    A measure that a coarse run does not have gets its absolute value as error.

    Parameters
    ----------
    drive_levels : sequence of Level
        Levels of the run, in chronological order.
    coarser_runs : list of CoarserRuns
        Settings of the coarse runs by source of error.
    solutions : dict
        Solution of each coarse run by its Numerics.
    """
    levels_with_errors = []
    for number, level in enumerate(drive_levels):
        # A run that ended earlier has no measures at this level.
        missing = replace(level, values={})
        solved = {
            key: (*run.levels, *[missing] * len(drive_levels))[number]
            for key, run in solutions.items()
        }
        sources = estimate_errors(None, level.values, coarser_runs, solved)
        errors = dict(level.errors)
        for name, parts in split_errors(level.values, sources).items():
            errors[name] = errors.get(name, 0.0) + sum(parts.values())
        levels_with_errors.append(replace(level, errors=errors))
    return tuple(levels_with_errors)


def find_onset(
    drive_levels, run_level, tolerance: float, is_past_onset
) -> tuple[float, float] | None:
    """Find the drive level of the onset by bisection, with its uncertainty, both [m s-2]; None if no level reaches it.

    The bisection starts between the last level before the onset and the first level after it, and
    ends when the bracket is smaller than `tolerance` times the level. If there is no level before
    the onset, the lower limit is 0 and the tolerance refers to the first level after the onset.

    Parameters
    ----------
    drive_levels : sequence of Level
        Levels of the run, in chronological order.
    run_level : callable
        Function (index, level) -> Level that runs a level [m s-2] from the final state of the level
        with this index, or from rest for the index -1.
    tolerance : float
        Largest width of the bracket relative to the level.
    is_past_onset : callable
        Function of a Level that returns whether the onset is reached.
    """
    bracket = bracket_onset(drive_levels, is_past_onset)
    if bracket is None:
        return None
    before, reached = bracket
    first = drive_levels[reached]
    low = drive_levels[before].drive if before >= 0 else 0.0
    high = first.drive
    for _ in range(MAX_ONSET_BISECTIONS):
        if high - low <= tolerance * (high if low else first.drive):
            break
        middle = (low + high) / 2
        if is_past_onset(run_level(before, middle)):
            high = middle
        else:
            low = middle
    return (low + high) / 2, (high - low) / 2


def measure_onset_level(rig, solution, tolerance: float) -> Measure:
    """Return the drive level of the onset; without a value and with the reason if no level reaches it.

    Parameters
    ----------
    rig : Rig
        Defines the kind of onset.
    solution : Solution
        The difference of the onset levels of its coarse runs is added to the error.
    tolerance : float
        Largest width of the bracket relative to the level.
    """
    unit, factor = _find_level_unit(rig)
    is_past_onset = make_onset_test(*rig.drive.levels.onset)

    def find(run) -> tuple[float, float] | None:
        """Return the onset of slip in a run with drive levels, or None if no level reaches it."""
        return find_onset(run.levels, run.run_level, tolerance, is_past_onset)

    onset = find(solution)
    if onset is None:
        reason = make_no_onset_reason(*rig.drive.levels.onset)
        return Measure(None, unit, None, MOTION_TABLE["onset_level"].floor, reason=reason)
    level, error = onset
    for run, beside in solution.coarser:
        coarse_onset = find(run)
        reference = onset if beside is None else find(beside)
        is_missing = coarse_onset is None or reference is None
        change = level if is_missing else coarse_onset[0] - reference[0]
        error += convergence_error(change, order=MAX_CONVERGENCE_ORDER)
    return Measure(factor * level, unit, factor * error, 1e-9)


def convert_to_scene_units(rig, drive_levels) -> tuple[Level, ...]:
    """Return the drive levels of a run with their amplitudes in the unit of the scene: [m s-2], or [N] for a force."""
    unit, factor = _find_level_unit(rig)
    return tuple(replace(level, drive=factor * level.drive, unit=unit) for level in drive_levels)


def _find_level_unit(rig) -> tuple[str, float]:
    """Return the unit of the drive levels in the scene, and the factor that converts a level [m s-2] to it."""
    return ("N", rig.modes.mass) if rig.drive.kind == "force" else ("m s-2", 1.0)


def run_levels(evaluator, n_frames: int = 0, progress=None) -> tuple[Any, Fields]:
    """Run the levels of a drive in order, each from the final state of the previous one.

    Parameters
    ----------
    evaluator : RunEvaluator
        Integrates and evaluates each level. Its model has the levels of the drive.
    n_frames : int
        Number of snapshots of the interface in the last cycle of the last level.
    progress : callable, optional
        Callback for the completed fraction of all levels.

    Returns
    -------
    tuple
        Joined run, and the fields `levels` and `run_level` of its Solution.
    """
    drive = evaluator.model.rig.drive
    amplitudes = drive.levels.amplitudes
    omega = structure.drive_sizes.find_drive_omega(drive.signal)
    runs = []
    level_results = []

    def solve(level: float, before, n_frames: int = 0, report=None) -> tuple[Any, Level]:
        """Run a level, and return the run and its Level.

        Parameters
        ----------
        level : float
            Drive level [m s-2].
        before
            Run from whose end the level goes on, or None for rest.
        n_frames : int
            Number of snapshots of the interface in the last cycle.
        report : callable, optional
            Callback for the completed fraction.
        """
        sine = SineDrive(level, omega, drive.signal.moving)
        run = evaluator.integrate(sine, drive.levels.cycles, before, n_frames, report)
        values = evaluator.evaluate_measures(run, sine)
        values = {name: values[name] for name in LEVEL_MEASURES if name in values}
        errors = {name: EXACT_RELATIVE_ERROR * abs(value) for name, value in values.items()}
        return run, Level(level, evaluator.is_stuck(run), values, errors)

    def run_level(number: int, level: float) -> Level:
        """Run the drive at an amplitude `level` [m s-2] from the final state of level `number`, or from rest if it is -1."""
        return solve(level, runs[number] if number >= 0 else None)[1]

    # Each level goes on from the end of the one before; a run that ends early is the last one.
    n_levels = len(amplitudes)
    report = None if progress is None else partial(_report_fraction, progress, runs, n_levels)
    for amplitude in amplitudes:
        is_last = len(runs) + 1 == n_levels
        run, result = solve(amplitude, runs[-1] if runs else None, n_frames * is_last, report)
        runs.append(run)
        level_results.append(result)
        if run.outcome is not None:
            break

    # One run has the histories of all levels; `run_level` computes further levels in the search for the onset of slip.
    joined = join_runs(runs, drive.levels.cycles * drive.signal.period)
    return joined, {"levels": tuple(level_results), "run_level": run_level}


def _report_fraction(progress, runs, n_levels: int, fraction: float) -> None:
    """Report the completed fraction of all levels: `runs` are complete, and `fraction` of the next level."""
    progress((len(runs) + fraction) / n_levels)


def join_runs(runs, duration: float):
    """Join the runs of successive drive levels, each of `duration` [s], to a single run with histories over all of them.

    The window and the friction loop are those of the last level.
    """
    shifts = [k * duration for k in range(len(runs))]
    last = runs[-1]
    window = replace(last.window, time=_shift_times(last.window.time, shifts[-1]))
    ledger = {name: sum(run.ledger[name] for run in runs) for name in last.ledger}
    ledger["peak_stored"] = max(run.ledger["peak_stored"] for run in runs)
    return replace(
        last,
        response=_join_histories([run.response for run in runs], shifts),
        window=window,
        ledger=ledger,
        log=None if last.log is None else join_events([run.log for run in runs], shifts),
        extremes=np.concatenate([run.extremes for run in runs]),
        phasors=np.concatenate([run.phasors for run in runs]),
    )


def _join_histories(histories, shifts: list[float]) -> Response:
    """Join the histories of successive runs, and shift them by their start times [s]."""
    parts = []
    start = np.zeros((4, 1))
    for part, shift in zip(histories, shifts):
        # Work, dissipated and created energy go on from run to run. The stored energy does not add up.
        ledger = part.extra["ledger"] + start
        start = ledger[:, -1:].copy()
        start[1] = 0.0
        extra = part.extra | {"ledger": ledger}
        parts.append(replace(part, time=_shift_times(part.time, shift), extra=extra))

    # The last sample of a run equals the first sample of the next run.
    parts[:-1] = [part.select(slice(None, -1)) for part in parts[:-1]]
    extra = {}
    for name in parts[-1].extra:
        axis = int(name == "ledger")
        extra[name] = np.concatenate([part.extra[name] for part in parts], axis=axis)
    columns = {}
    for name in Response.__dataclass_fields__:
        if name != "extra":
            columns[name] = np.concatenate([getattr(part, name) for part in parts])
    return Response(**columns, extra=extra)


def _shift_times(time, shift: float) -> np.ndarray:
    """Shift times by `shift` [s] so that both samples of each event remain distinct."""
    moved = time + shift
    before = np.flatnonzero(moved[1:] <= moved[:-1])
    moved[before] = np.nextafter(moved[before], -np.inf)
    return moved


@dataclass(frozen=True, eq=False, slots=True)
class EngineRun:
    """Run of an engine that sums the measures over its steps, with its histories.

    - values: measures of the last cycles by name.
    - response, window: histories of the run and of its last cycles.
    - extremes (c, 2), phasors (c,): minimum and maximum, and complex amplitude at the drive frequency, of the output [m]
      in each of c cycles.
    - ledger: energies [J] and counters by name.
    - outcome, message: how the run ended, if it ended early.
    - end: state at the end, from which another run can go on.
    - cycles_done: number of cycles.
    - log: events of the interfaces, or None.
    - snapshots: states of the elements of a patch in the last cycle.
    """

    values: Values
    response: Response
    window: Response
    extremes: np.ndarray
    phasors: np.ndarray
    ledger: Values
    outcome: Outcome | None
    message: str
    end: Any
    cycles_done: float
    log: Events | None = None
    snapshots: Sequence = ()


class RunEvaluator:
    """Evaluation of the runs of a model that one engine has computed.

    The subclass of an engine integrates the motion under a drive from the end of another run (`integrate`). It returns the
    fields of `LastCycles` that it computes more accurately than from samples (`describe_cycles`), further fields of the
    Solution (`collect_solution_fields`), and the errors that the run itself shows (`estimate_run_errors`).

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
    contact : optional
        Contact model of the engine.
    stick_tolerance : float
        Largest slip per cycle [m] at which the interface counts as stuck.
    """

    def __init__(self, model, numerics, patch, contact=None, stick_tolerance: float = 0.0):
        self.model = model
        self.numerics = numerics
        self.patch = patch
        self.contact = contact
        self.has_friction = model.friction is not None
        # With a law that creeps, the interface slips under every force, however small.
        self.creeps = self.has_friction and law_has_trait(model.friction.law, "creeps")
        self.stick_tolerance = 0.0 if self.creeps else stick_tolerance

    def solve(self, n_frames: int, progress, prepare: Values) -> Solution:
        """Compute the motion of the rig, for one drive level after another, and its Solution.

        Parameters
        ----------
        n_frames : int
            Number of snapshots of the interface in the last cycle.
        progress : callable or None
            Callback for the completed fraction.
        prepare : dict
            CPU time of each part of the preparation [s].
        """
        begin = measure_cpu_time()
        drive = self.model.rig.drive
        fields = {}
        if drive.levels.amplitudes:
            run, fields = run_levels(self, n_frames, progress)
        else:
            run = self.integrate(drive.signal, self.numerics.cycles, None, n_frames, progress)
        return self.make_solution(run, measure_cpu_time() - begin, prepare=prepare, **fields)

    def evaluate_measures(self, run, drive=None, ledger=None, *, stuck: bool = False) -> Values:
        """Compute the measures of a run from its last cycles.

        Parameters
        ----------
        run
            Run of the engine, with all cycles or with those of a drive level.
        drive : optional
            Drive of the run; default: that of the model.
        ledger : (4, k), optional
            Friction work, and stored, dissipated and created energy [J] at the samples of the whole run.
        stuck : bool
            Whether the interface is stuck during the last cycles.
        """
        model = self.model
        drive = drive or model.rig.drive.signal
        fields = {"window": run.window, "run_energies": run.ledger}
        if self.has_friction:
            fields |= {"reversal_rule": choose_reversal_force_rule(model), "ledger": ledger}

        if model.rig.drive.kind == "free":
            # The last whole cycle of a release may begin before the window.
            motion = (run.response.time, run.response.output, run.response.output_rate)
            fields["release"] = measure_last_cycle_amplitude(*motion, drive.period)

        # What the engine knows better replaces what follows from samples.
        fields |= self.describe_cycles(run, drive, stuck=stuck)
        window = fields["window"]
        n_cycles = min(self.numerics.window, len(run.extremes))
        last_cycles = LastCycles(
            drive=drive,
            extremes=run.extremes[-n_cycles:],
            load=first_interface_load(model, self.patch),
            stiffness=first_mode_stiffness(model, window),
            is_sine=structure.drive_sizes.is_sinusoidal(drive),
            **fields,
        )
        return compute_measures(last_cycles)

    def is_stuck(self, run) -> bool:
        """Return whether no interface or band slips in the last cycles by more than `stick_tolerance` [m].

        A law that creeps never sticks.
        """
        if not self.has_friction or self.creeps:
            return False
        return is_all_stuck(run.window, self.stick_tolerance)

    def make_solution(self, run, seconds: float, drive=None, **other_fields) -> Solution:
        """Evaluate a run and return its Solution.

        Measures follow from the last `numerics.window` cycles (`response.rows`). `run_errors` are the errors that the run
        itself shows: of sampling, and those of its engine. Errors due to steps and mesh need coarse runs and are not part
        of it.

        Parameters
        ----------
        run
            Run of the engine.
        seconds : float
            CPU time of the run [s].
        drive : optional
            Drive of the run; default: that of the model.
        **other_fields
            Further fields of the Solution.
        """
        drive = drive or self.model.rig.drive.signal
        stuck = self.is_stuck(run)
        values = self.evaluate_measures(run, drive, run.response.extra.get("ledger"), stuck=stuck)
        fields = {"message": run.message, "log": run.log, "snapshots": run.snapshots}
        fields |= self.collect_solution_fields(run)

        # Without an early end, the outcome stays open until the errors are known.
        return Solution(
            values=values,
            response=run.response,
            window=run.window,
            outcome=run.outcome or (Outcome.STUCK if stuck else None),
            book=run.ledger,
            seconds=seconds,
            contact=self.contact,
            stick_tolerance=self.stick_tolerance,
            run_errors=self.estimate_run_errors(run, drive, values),
            extremes=run.extremes,
            phasors=run.phasors,
            **(fields | other_fields),
        )


def compute_sampled_work(response) -> Values:
    """Return {"sampled": friction work of a Response, "passed": integral of its absolute value} [J].

    Both follow from the samples of all interfaces by the trapezoidal rule.
    """
    pairs = zip(response.slides.T, response.forces.T)
    parts = [friction.path_work.sampled_work(slide, force) for slide, force in pairs]
    sampled = sum(float(part.sum()) for part in parts)
    return {"sampled": sampled, "passed": sum(float(abs(part).sum()) for part in parts)}


def compute_work_check(energies: Values) -> float:
    """Return the relative difference of the friction work from samples and from the energy balance.

    Parameters
    ----------
    energies : dict
        Energies of a run [J]. "sampled" is the friction work from samples, "booked" that of the
        energy balance, and "passed" the integral of its absolute value.
    """
    scale = energies["power"] + energies["peak_stored"]
    return compare_friction_works(
        energies["sampled"], energies["booked"], energies["passed"], scale
    )
