"""Run of a rig or a bench: solution with refined numerical settings, and completion of its result.

In: the inputs of a run, i.e. its plan and its pressed interfaces. Out: a Result. `run_refined` solves the run with finer and
finer settings until its measures meet the tolerance; each coarse run is solved only once (`Runner`). `run_motion` completes
the result.
"""

from dataclasses import dataclass, replace
from math import ceil, floor, log, log2

import numpy as np

from ... import kernel_cache, structure
from ...convergence import convergence_error
from ...core import Measure, NotConverged, Outcome, PatchfemError, max_abs
from ...measures import reasons, stationary
from ...measures.decay_curve import DecayCurve
from ...measures.errors import (
    ComparisonRuns,
    SourceErrors,
    StepRun,
    add_errors,
    add_run_error_estimates,
    estimate_errors,
    list_step_runs,
)
from ...measures.measures import Measures
from ...measures.outcome import judge_outcome, remove_errors
from ...measures.rows import set_final_floors
from ...measures.settling import find_slip_period
from ...model import rig as model_rig
from .. import refine
from ..bench import bench
from ..bench import engine as bench_engine
from ..bench.engine import MIN_RELATIVE_STEP_ERROR, Numerics
from ..interfaces import bond_lists
from ..results.interfaces import check_pieces_overlap
from ..results.result import (
    N_INTERFACE_FRAMES,
    ContactData,
    MotionData,
    Result,
    RunInputs,
    Settings,
    Shortage,
    Statements,
    StoredHistories,
)
from . import comparisons, decays, event_to_event, flutter, levels, march, slides
from . import fields as interface_fields
from .engines import ENGINES, EVENT_DRIVEN, MARCH, MAX_MARCH_STEPS_PER_CYCLE, choose_numerics
from .evaluation import Solution, first_interface_load, replace_output_by_gauge
from .motion_warnings import collect_remarks
from .steady import shooting

# Outcomes of runs that ended early; more steps do not change them.
EARLY_OUTCOMES = (Outcome.EXCEEDS_TRAVEL, Outcome.LEAVES_GROOVES)
MAX_REFINED_RUN_STEPS = 1e7  # Largest number of time steps of a run after its steps were doubled.
# Relative error of every measure, such as round-off, which is added to the errors from comparison runs.
MIN_MOTION_RELATIVE_ERROR = 1e-9
# Largest number of steps times nodes of a run that is repeated with smaller steps for measures that are not main ones. It
# takes some 0.1 s of CPU time. The entries of a list of bonds count as nodes.
MAX_NODE_STEPS_FOR_OTHER_MEASURES = 1e6
# Work of a step in which the pressure of a patch is solved, relative to that of another step.
PRESSING_STEP_WORK_RATIO = 40.0
NO_PEAK_REASON = "the output does not move at any of the swept frequencies, so there is no peak"


def solve_rig(model, numerics, patch, n_frames: int = 0, say=None, progress=None) -> Solution:
    """Compute the motion of a rig with the engine of its settings; the output is that of the gauge.

    Parameters
    ----------
    model : Model
        Rig, drive and friction laws.
    numerics : Numerics
        Numerical settings, including the name of the engine.
    patch : Patch or None
        None under [normal] and between masses.
    n_frames : int
        Number of snapshots of the interface in the last cycle.
    say, progress : callable, optional
        Callbacks for a line of text and for the completed fraction.
    """
    # Only the module of this engine is loaded.
    if numerics.engine == "bench":
        run = bench.follow_slide(model, numerics, patch, n_frames, say=say, progress=progress)
        return slides.make_slide_solution(run)
    if numerics.engine == "harmonic":
        solution = shooting.solve_steady_motion(model, numerics, patch, n_frames, say)
        return replace_output_by_gauge(model, solution)
    if numerics.engine == "event_driven":
        kernel_cache.report_compilation_to(say)
        evaluator = event_to_event.LumpedEvaluator(model, numerics, patch)
    else:
        evaluator = march.MarchEvaluator(model, numerics, patch, say)
    return replace_output_by_gauge(model, evaluator.solve(n_frames, progress))


class Runner:
    """Solver of a rig with several numerical settings, which stores the solutions of coarse runs.

    Parameters
    ----------
    model : Model
        Model of the motion.
    patches : sequence of Patch or None
        Patch of [contact] on its meshes, from fine to coarse.
    stiffer : joint.FreeRig, optional
        Rig and patch with a stiffer joint, if a joint was subtracted from the modes.
    progress : callable, optional
        Callback for the completed fraction of all runs.
    is_single : bool
        Whether a single run takes all the time.

    Attributes
    ----------
    solutions : dict
        Solution of each coarse run by its Numerics.
    is_release : bool
        Whether a rig is released, whose decay curve needs the histories from the start.
    """

    def __init__(self, model, patches, stiffer=None, progress=None, *, is_single: bool = False):
        self.model = model
        self.patches = patches
        self.stiffer = stiffer
        self.progress = progress
        self.is_single = is_single
        self.is_release = model.rig is not None and model.rig.drive.is_release
        self.solutions: dict[Numerics, Solution] = {}
        self._done = 0.0  # reported fraction of all runs

    def solve(self, numerics: Numerics, say=None, n_frames: int = 0) -> Solution:
        """Solve the rig, and report the completed fraction of all runs.

        Parameters
        ----------
        numerics : Numerics
            Settings, which also say what is coarser: the mesh, the modes of a reduced structure, or a joint whose
            stiffness differs.
        say : callable, optional
            Function that takes a line of text on the progress.
        n_frames : int
            Number of frames of the interface in the last cycle.
        """
        model = self.model
        space = numerics.space
        patch = self.patches[space.coarse_patch]
        if space.other_rig is not None:
            model = replace(model, rig=model.rig.structure.other_rigs[space.other_rig])
        if space.stiffer_joint:
            stiffer, (patch, *_) = self.stiffer[:2]
            model = replace(stiffer, rig=replace(stiffer.rig, drive=model.rig.drive))

        # Each run is a half of what is left, because the number of coarse runs is not known.
        left = 1 - self._done
        share = left if self.is_single else left / 2

        def report(fraction: float) -> None:
            """Report the completed fraction of all runs, given that of the present run."""
            if self.progress is not None:
                self.progress(1 - left + share * fraction)

        solution = solve_rig(model, numerics, patch, n_frames, say, report)
        self._done += share
        return solution

    def estimate_errors(self, runs: ComparisonRuns, solution: Solution) -> list[SourceErrors]:
        """Estimate the errors of a run from coarse runs (`measures.errors.estimate_errors`)."""

        def solve(numerics: Numerics) -> Solution:
            """Solve a coarse run; the decay curve needs histories from its start."""
            return self.solve(replace(numerics, whole=self.is_release))

        return estimate_errors(solve, solution.values, runs, self.solutions)


@dataclass(frozen=True, eq=False, slots=True)
class CoupledRun:
    """Run of a rig whose Result is completed step by step.

    - inputs: plan and pressed interfaces of the run.
    - numerics, solution: settings and Solution of the engine.
    - measures: measures by name.
    - step_runs: `StepRun` of the run and of its runs with fewer steps, from fine to coarse.
    - outcome: Outcome, or None before `complete_measures`.
    - decay: decay curve of a release, or None.
    - notes: sentences on the decay and on limit cycles.
    - coarser: pairs of a coarse run and its reference run, None for this run, for decay curves and onsets.
    """

    inputs: RunInputs
    numerics: Numerics
    solution: Solution
    measures: Measures
    step_runs: tuple[StepRun, ...] = ()
    outcome: Outcome | None = None
    decay: DecayCurve | None = None
    notes: tuple[str, ...] = ()
    coarser: tuple[tuple[Solution, Solution | None], ...] = ()

    @property
    def model(self):
        """Model of the plan, which names rig, friction and accuracy."""
        return self.inputs.plan.model

    @property
    def patch(self):
        """Patch of the table [contact] with its static solution; None without that table."""
        return self.inputs.patch

    @property
    def drive(self):
        """Drive at which the measures are evaluated."""
        steady = self.solution.steady
        return (steady and steady.drive) or self.model.rig.drive.signal

    @property
    def has_friction(self) -> bool:
        """Whether the rig has friction."""
        return self.model.friction is not None

    @property
    def settings(self) -> Settings:
        """Numerical settings that the run used, which its result states."""
        numerics = self.numerics
        engine = ENGINES[numerics.engine]
        choice = comparisons.find_bond_summation(self.model, numerics)
        settings = Settings(numerics.engine, window_cycles=numerics.window)
        if self.model.rig is None:
            settings = Settings(bench_engine.name_engine(self.model, choice))
        elif choice is not None:
            settings = settings._replace(quadrature=choice.engine)
        if engine.has_steps:
            settings = settings._replace(steps_per_cycle=numerics.steps)
        if engine.finds_periodic_motion and self.solution.run.outcome is not Outcome.LEAVES_GROOVES:
            settings = settings._replace(map="shooting")

        # A patch that slips part by part is a set of elements, or of shear modes if its load varies.
        reduced = getattr(self.solution.contact, "reduction", None)
        if reduced is None:
            return settings
        size = int(np.size(reduced.stiffness))
        if hasattr(reduced, "yield_displacement"):
            return settings._replace(elements=size)
        return settings._replace(shear_modes=size)

    def find_force_ratio(self) -> float:
        """Return the largest friction force, divided by the static limit mu_s N [1]; 0 if the load varies."""
        rig = self.model.rig
        varies = self.model.load_varies if rig is None else rig.friction.load_varies
        limit = 0.0
        if self.has_friction and not varies:
            limit = self.model.friction.static * first_interface_load(self.model, self.patch)
        return max_abs(self.solution.run.response.force) / limit if limit > 0 else 0.0

    @property
    def has_errors(self) -> bool:
        """Whether errors are estimated: the caller wants them, the motion was found, and all meshes for them exist."""
        is_solved = self.solution.run.outcome is not Outcome.NOT_CONVERGED
        return self.inputs.control.estimate and is_solved and self.inputs.has_error_meshes


def run_motion(inputs: RunInputs) -> Result:
    """Compute the motion of a rig, or the friction of a bench along its prescribed slide, and return its Result.

    Parameters
    ----------
    inputs : RunInputs
        Plan, pressed interfaces and callbacks of the run.

    Raises
    ------
    Missing
        If the time steps do not resolve the vibration of the block on its bonds.
    PatchfemError
        If the drive excites no mode.
    """
    model = inputs.plan.model
    rig = model.rig
    numerics = choose_numerics(model)
    if rig is None:
        run, _ = run_refined(inputs, numerics)
        measures = run.measures if run.has_errors else remove_errors(run.measures)
        return _make_result(replace(run, outcome=Outcome.DONE, measures=measures))

    is_free = rig.drive.is_release
    if rig.start is None and not is_free and not np.any(rig.modes.base):
        raise PatchfemError(
            "the drive excites no mode, so nothing moves; give a mode the key `base` or `output`",
            "drive.kind",
        )
    if not inputs.plan.draws_curve and ENGINES[numerics.engine].finds_periodic_motion:
        numerics = replace(numerics, whole=False)
    if numerics.engine == "march":
        bond_lists.refuse_unresolved_bond_vibration(model, numerics)
    try:
        run, shortage = run_refined(inputs, numerics)
    except NotConverged as error:
        # A law or a mode may be too fast to be followed from event to event.
        is_chosen = model.accuracy.method == "auto" and numerics.engine == EVENT_DRIVEN.name
        if not is_chosen or MARCH.find_unsupported_feature(model):
            raise
        obstacle = str(error).partition(";")[0]
        note = f"the motion was computed in time steps: from event to event {obstacle}"
        inputs = replace(inputs, notes=[*inputs.notes, note])
        run, shortage = run_refined(inputs, choose_numerics(model, MARCH))

    # The reasons of missing values depend on the outcome, so that they come after it.
    found = run.solution.levels
    if found is not None and run.has_friction:
        onset = levels.measure_onset_level(rig, found, run.coarser, model.accuracy.tolerance)
        run = replace(run, measures=run.measures | {"onset_level": onset})
    run = complete_measures(run)
    if is_free and run.has_errors:
        run = _add_decay_curve(run)
    if run.has_friction and structure.drive_sizes.find_decay_rate(rig.modes) < 0:
        measures, notes = flutter.compute_flutter_amplitude(run)
        run = replace(run, measures=run.measures | measures, notes=(*run.notes, *notes))
    return _make_result(run).with_changes(shortage=shortage)


def _add_decay_curve(run: CoupledRun) -> CoupledRun:
    """Return the run of a release with its decay curve, and a note if the error by the mesh is unknown."""
    decay = decays.compute_decay_curve(run.solution, run.coarser)
    if decay is None:
        return run
    inputs = run.inputs
    space_runs = comparisons.list_space_runs(
        run.model, run.numerics, run.patch, inputs.n_coarse, run.solution
    )
    has_mesh_run = any(one.source == "mesh" for one in space_runs)
    decay, notes = decays.add_mesh_errors(
        decay, run.model, inputs.patches, inputs.stiffer, has_mesh_run=has_mesh_run
    )
    return replace(run, decay=decay, notes=notes)


def _make_result(run: CoupledRun) -> Result:
    """Return the Result of a run whose measures are complete."""
    inputs = run.inputs
    model = run.model
    motion = run.solution.run
    engine = ENGINES[run.numerics.engine]

    # Warnings and notes see the measures before their floors are raised to the tolerance.
    warnings, notes = collect_remarks(run)
    notes = [*inputs.notes, *notes, *run.notes]
    measures = set_final_floors(run.measures, model.accuracy.tolerance)
    if engine.finds_periodic_motion and run.outcome is Outcome.GROWS:
        measures = reasons.find_missing_unbounded(measures)

    if model.rig is not None and model.rig.drive.waveform.is_random:
        notes += stationary.warn_if_short(measures, motion.window)

    # The fields of [contact], and those of the patches of [[structure.interface]].
    fields = {}
    if inputs.patch is not None and model.rig is None:
        fields = slides.collect_slide_frames(model, inputs.patch, motion.response)
    elif inputs.patch is not None:
        fields = interface_fields.collect_interface_fields(
            model, run.numerics, inputs.patch, run.solution
        )
    faces = ()
    if model.has_interface_patches:
        snapshots = () if engine.has_steps else motion.snapshots
        faces = interface_fields.add_slip_fields(model, inputs.faces, snapshots)

    # The slide at an interface may exceed the overlap of its pieces.
    outcome = run.outcome
    histories = StoredHistories(motion.response, motion.response)
    if model.rig is not None:
        histories = StoredHistories(motion.response, motion.window, run.drive.period)
    for face in inputs.faces:
        slide = face.slide(motion.response)
        outcome = check_pieces_overlap(outcome, face.model.patch, face.patch, slide)
    return Result(
        plan=inputs.plan,
        outcome=outcome,
        measures=measures,
        seconds=inputs.seconds,
        statements=Statements([*inputs.warnings, *warnings], notes),
        contact=ContactData(inputs.patch, fields, faces),
        histories=histories,
        motion=_collect_motion_data(run),
    )


def _collect_motion_data(run: CoupledRun) -> MotionData:
    """Return what a motion has beside its measures, histories and fields."""
    data = MotionData(run.settings, step_runs=run.step_runs)
    rig = run.model.rig
    if rig is None:
        return data
    solution = run.solution
    motion = solution.run
    spectra = None
    if rig.drive.waveform.is_random:
        spectra = stationary.compute_spectra(motion.window, rig.drive.signal)
    found = solution.levels.levels if solution.levels is not None else ()
    return data._replace(
        energies=motion.ledger,
        levels=levels.convert_to_scene_units(rig, found),
        events=motion.log,
        decay=run.decay,
        spectra=spectra,
        steady=solution.steady and solution.steady.data,
    )


def estimate_slide_errors(model, patches, run: "bench.BenchRun", steps: int) -> list[SourceErrors]:
    """Estimate the errors of a run along a prescribed slide from coarser runs.

    Parameters
    ----------
    model : Model
        Model of the run.
    patches : list of Patch
        Patches on nested meshes, from fine to coarse; [None] without a patch.
    run : BenchRun
        Run whose errors are estimated.
    steps : int
        Number of steps per cycle of this run.

    Returns
    -------
    list of (str, dict)
        Source of the error, and errors by measure.
    """
    solution = slides.make_slide_solution(run)
    numerics = replace(run.numerics, steps=steps)
    runs = comparisons.list_time_runs(numerics)
    runs += comparisons.list_space_runs(model, numerics, patches[0], len(patches) - 1, solution)
    return Runner(model, patches).estimate_errors(runs, solution)


def run_refined(inputs: RunInputs, numerics: Numerics) -> tuple[CoupledRun, Shortage | None]:
    """Repeat a run with finer settings until the errors of its measures meet the tolerance.

    Only settings that the scene does not fix are refined. All coarse runs are stored in
    `Runner.solutions` by their settings. Runs that are coarser in space are compared with a run
    that is coarse in time, so that they need not be repeated: their errors are estimated once. A run with
    automatic steps is repeated with twice the steps (`_judge`).

    The error of a measure is the sum of the errors by source (steps, mesh, modes, bonds), each from
    `convergence.convergence_error`, plus MIN_MOTION_RELATIVE_ERROR of the value (`add_errors`).
    Afterwards `complete_measures` adds the errors that the run itself shows.

    Parameters
    ----------
    inputs : RunInputs
        Plan, pressed interfaces and callbacks of the run.
    numerics : Numerics
        Numerical settings of the first run.
    """
    model = inputs.plan.model
    rig = model.rig
    size = np.inf if rig is None else rig.displacement_scale
    stage = "bench" if rig is None else "march"
    limit, say, progress, estimate = inputs.control
    runner = Runner(model, inputs.patches, inputs.stiffer, progress, is_single=not estimate)
    n_frames = N_INTERFACE_FRAMES * (inputs.patch is not None or model.has_interface_patches)
    first = runner.solve(numerics, say, n_frames)
    inputs.seconds.update({stage: first.seconds} | first.prepare)

    # The window must contain a complete period of the motion, and the run two of them.
    n_cycles = _count_slip_cycles(model, first)
    if numerics.window < n_cycles <= numerics.cycles / 2:
        numerics = replace(numerics, window=n_cycles)
        first = runner.solve(numerics, say, n_frames)
    if not estimate or first.run.outcome is Outcome.NOT_CONVERGED:
        measures = add_errors(first.values, size=size) | _find_peak_frequency(first)
        return CoupledRun(inputs, numerics, first, measures), None

    # Comparison runs on coarser meshes, with other modes and with other joints; more steps do not repeat them.
    space_runs = comparisons.list_space_runs(model, numerics, inputs.patch, inputs.n_coarse, first)
    space_runs += comparisons.list_joint_runs(inputs, space_runs)
    space_errors = runner.estimate_errors(space_runs, first)

    def solve(numerics: Numerics, coarser: CoupledRun | None) -> CoupledRun:
        """Solve the rig with `numerics`, and estimate the errors of its measures from runs with fewer steps.

        `coarser` is the run with half as many steps, which is one of them; None in the first pass.
        """
        solution = first
        if coarser is not None:
            # This run has twice the steps of the one before, with which it is compared.
            runner.solutions[coarser.numerics] = coarser.solution
            solution = runner.solve(numerics, say, n_frames)
            inputs.seconds[stage] = solution.seconds
        time_runs = comparisons.list_time_runs(numerics)
        errors = [*runner.estimate_errors(time_runs, solution), *space_errors]
        step_runs = list_step_runs(numerics.steps, solution, time_runs, runner.solutions)
        measures = add_errors(
            solution.values, errors, min_relative_error=MIN_MOTION_RELATIVE_ERROR, size=size
        )
        run = CoupledRun(inputs, numerics, solution, measures, tuple(step_runs))
        if solution.levels is None and not runner.is_release:
            return run
        return _add_coarser_runs(run, [*time_runs, *space_runs], runner.solutions)

    run, shortage = refine.refine(solve, numerics, _judge, limit)
    inputs.seconds["error"] = sum(solution.seconds for solution in runner.solutions.values())
    peak = _find_peak_frequency(run.solution, runner.solutions.values())
    return replace(run, measures=run.measures | peak), shortage


def _count_slip_cycles(model, solution: Solution) -> int:
    """Return the number of cycles of the drive in a period of stick-slip motion on a belt; 0 for other drives.

    A belt moves on at constant speed, so that the drive has no period, but the motion has one, which a run shows.
    """
    if model.rig is None or model.friction is None:
        return 0
    drive = model.rig.drive.signal
    if not drive.segments or structure.drive_sizes.is_periodic(drive):
        return 0
    response = solution.run.response
    return ceil(find_slip_period(response.time, response.slide_rate) / drive.period)


def _add_coarser_runs(run: CoupledRun, runs: ComparisonRuns, solved) -> CoupledRun:
    """Return a run with the coarser runs from which the errors of its levels, decay curve and onset follow.

    Parameters
    ----------
    run : CoupledRun
        Run of a release or of a drive in levels.
    runs : list of CoarserRuns
        Its comparison runs.
    solved : dict
        Solution of each of them by its Numerics.
    """
    # An entry without coarse runs is skipped if the errors of the levels already include it. Runs with another bond
    # summation are not used for the errors of decay curves and onsets.
    solution = run.solution
    used_runs = [one for one in runs if one.runs or not solution.steady]
    pairs = []
    for one in used_runs:
        if one.runs and one.runs[0].space.choice is None:
            pairs.append((solved[one.runs[0]], one.reference and solved[one.reference]))
    if solution.levels is not None:
        found = levels.add_level_errors(solution.levels, used_runs, solved)
        solution = replace(solution, levels=found)
    return replace(run, solution=solution, coarser=tuple(pairs))


def _judge(run: CoupledRun, excesses: list[float]) -> refine.Verdict:
    """Decide whether a run is repeated with smaller steps, and return the next steps as a Verdict.

    `excesses` are the largest ratios of error to allowed error [1] in the passes before. No pass follows if two of them
    have not reduced the ratio, as with some lists of bonds, whose error depends on the steps. Only main measures count,
    except in a run that takes little time (MAX_NODE_STEPS_FOR_OTHER_MEASURES).
    """
    numerics = run.numerics
    accuracy = run.model.accuracy
    rig = run.model.rig
    if rig is None:
        # The steps of a prescribed slide are refined together with the meshes (`refine.judge_pass`).
        return refine.Verdict(0.0)

    # How many times the run can be repeated with smaller steps than before
    ledger = run.solution.run.ledger
    if numerics.local:
        max_passes = ceil(log(numerics.local / MIN_RELATIVE_STEP_ERROR, 100) - 1e-9)
    else:
        has_automatic_steps = ENGINES[numerics.engine].has_steps and not accuracy.steps_per_cycle
        max_steps = min(MAX_MARCH_STEPS_PER_CYCLE, MAX_REFINED_RUN_STEPS / numerics.cycles)
        if not has_automatic_steps or run.solution.run.outcome in EARLY_OUTCOMES:
            max_steps = numerics.steps
        max_passes = floor(log2(max_steps / numerics.steps))
    if max_passes <= 0:
        return refine.Verdict(0.0)

    # Work of the run: steps times nodes, and more if each step presses the patch.
    counts = [face.patches[0].x.size for face in run.inputs.faces]
    counts += [ledger.get("points", 0.0), ledger.get("strips", 0.0), 1.0]
    work = numerics.steps * numerics.cycles * max(counts)
    if rig.friction.load_varies and run.patch is not None:
        work *= PRESSING_STEP_WORK_RATIO

    # All measures count in a run that takes little time, else the main ones.
    measures = set_final_floors(complete_measures(run).measures, accuracy.tolerance)
    if work > MAX_NODE_STEPS_FOR_OTHER_MEASURES:
        measures = {name: one for name, one in measures.items() if refine.is_main(name)}
    # The engine `event_driven` estimates the error of its steps itself.
    axis = "own" if numerics.local else "steps"
    excess = refine.find_worst_measure(measures, accuracy.tolerance, [axis]).excess
    has_stalled = len(excesses) > 1 and excess >= excesses[-2]
    if not excess or has_stalled:
        return refine.Verdict(excess)
    return refine.Verdict(
        excess,
        numerics.finer(),
        axis,
        seconds=run.solution.seconds,
        cost_ratio=refine.DOUBLED_STEPS_COST_RATIO,
        max_passes=max_passes,
    )


def _find_peak_frequency(solution: Solution, coarser=()) -> Measures:
    """Return a dict with the frequency and the half-power width [Hz] of the peak of a response curve; {} without a curve.

    The frequency has no value if the amplitude is 0, and a curve that is not drawn has no width. The shift of the peaks of
    `coarser` runs is part of the error.
    """
    steady = solution.steady
    if steady is None or np.isnan(steady.peak_error):
        return {}
    if np.isinf(steady.peak_error):
        return {"peak_frequency": Measure(None, "Hz", None, 0.0, reason=NO_PEAK_REASON)}
    drives = [one.steady.drive for one in (solution, *coarser)]
    peak, *others = [float(one.omega / (2 * np.pi)) for one in drives if one is not None]
    shift = max_abs(np.array(others) - peak)
    error = steady.peak_error + convergence_error(shift)
    measures = {"peak_frequency": Measure(peak, "Hz", error, 0.0)}
    width = steady.data.width
    return measures if width is None else measures | {"peak_width": width}


# ---- completion


def complete_measures(run: CoupledRun) -> CoupledRun:
    """Return the run with its outcome, all error estimates of its measures, and the reasons of missing values.

    The errors that the run itself shows (`Solution.run_errors`) are added to the errors from coarse
    runs. A motion that grows has no errors.
    """
    solution = run.solution
    model = run.model
    rig = model.rig
    measures = add_run_error_estimates(run.measures, solution.run_errors)
    if not run.has_errors:
        measures = remove_errors(measures)
    repeat = rig.count_repeat_cycles(model.point)
    outcome, steady = judge_outcome(
        solution.run,
        measures,
        (model.accuracy.tolerance, structure.drive_sizes.find_decay_rate(rig.modes)),
        run.drive,
        rig.drive.levels.cycles,
        repeat,
    )

    # Without a stop in the scene, the motion has not hit anything: it exceeded the limit of the
    # program.
    if (
        outcome is Outcome.EXCEEDS_TRAVEL
        and rig.springs.travel == model_rig.MAX_COMPUTED_DISPLACEMENT
    ):
        outcome = Outcome.GROWS
    # A growing motion has no final values, so the errors of its measures are unknown.
    if outcome is Outcome.GROWS and solution.run.outcome is not Outcome.GROWS:
        measures = remove_errors(measures)
    # The motion is judged at the accelerometer, so that its steady amplitude is not that of a gauge.
    if rig.modes.gauge is None:
        measures |= steady

    window = solution.run.window
    is_rigid = run.has_friction and model.sticks_rigidly
    motion = (window, run.drive, repeat)
    measures |= reasons.find_invalid(measures, motion, outcome, is_rigid=is_rigid)
    other_modes = rig.first_mode.fraction_of_other_modes(window.modal)
    measures |= reasons.find_missing(
        measures, window.span, run.drive, run.has_friction, other_modes
    )
    return replace(run, outcome=outcome, measures=measures)
