"""Run of a plan, from the contact and the motion to the result with its warnings.

In: a `Plan`, or a Scene or Model that is planned first. Out: a `Result`.
"""

import hashlib
import tomllib
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import process_time
from typing import NamedTuple

from .. import time_steps
from ..core import Measure, Missing, NotConverged, Outcome
from ..cost_model import measure_cpu_time
from ..disk.file_hashes import hash_named_files, iterate_texts
from ..model.model import Model
from ..model.source import Source, locate_errors
from . import joint, refine
from .findings import find_missed_measures, mark_unbalanced
from .patch import area_motion, case_meshes, faces, strength
from .patch import result as patch_result
from .plan import Plan, plan, refuse_first_case, refuse_insufficient_memory
from .results.interfaces import PressedFace, merge_sentences
from .results.patch_rows import Measures, find_unknown_measures
from .results.result import Result, RunInputs, Statements, describe_measure, shorten_file_names
from .rig import engines, rig
from .wear import evolve, measures

__all__ = ["Plan", "Result", "StateFile", "plan", "run"]
NO_FRICTION_NO_MOTION_MESSAGE = "no friction acts and no motion was computed"
NO_MOTION_FOUND_MESSAGE = "no motion was found; the measures are those of the pressed patch at rest"


class StateFile(NamedTuple):
    """File with the state of a long run, from which a later run can continue.

    - path: path of the file.
    - version: program version that the state must have.
    - resume: whether to continue from the state.
    """

    path: Path
    version: str
    resume: bool


class FinishedPass(NamedTuple):
    """Result of a pass of a run with one resolution, and what its warnings and the next pass need.

    - model: Model whose meshes and steps are those of the pass.
    - result: Result.
    - pressed: pressed interfaces.
    - seconds: CPU time of the pass [s].
    """

    model: Model
    result: Result
    pressed: tuple[PressedFace, ...]
    seconds: float


def run(
    runnable,
    say=None,
    progress=None,
    estimate: bool = True,
    state_file: StateFile | None = None,
    *,
    tells_passes: bool = True,
) -> Result:
    """Run a Plan, or plan and run a Scene or a Model.

    Parameters
    ----------
    runnable : Plan, Scene or Model
        What to run.
    say : callable, optional
        Callback for a line of text when code has to be compiled, or when the run is repeated with a finer resolution.
    progress : callable, optional
        Callback for the completed fraction of all runs.
    estimate : bool
        Whether to estimate the errors from coarser runs; if False, the errors are None.
    state_file : StateFile, optional
        File in which the state of a run with [wear] or of a long march is saved.
    tells_passes : bool
        Whether `say` is called when the run is repeated. A sweep does not tell this of its cases.

    Returns
    -------
    Result

    Raises
    ------
    NotConverged
        With the static patch as partial result if the motion was not found.
    Missing
        If the scene cannot be run.
    PatchfemError
        If the Plan is that of the first case of a table [sweep].
    """
    runnable = runnable if isinstance(runnable, Plan) else plan(runnable)
    with locate_errors(runnable.model.source):
        refuse_first_case(runnable)
        refuse_insufficient_memory(runnable, say)

        start = process_time()
        max_seconds = runnable.model.accuracy.max_seconds or refine.DEFAULT_MAX_SECONDS
        max_bytes = runnable.model.accuracy.max_memory or refine.DEFAULT_MAX_BYTES
        limit = refine.RunLimit(max_seconds, measure_cpu_time(), bytes=max_bytes)
        passes = _Passes(runnable, refine.RunControl(limit, say, progress, estimate), state_file)
        tell = say if tells_passes else None
        done, shortage = refine.refine(passes.solve, runnable.model, passes.judge, limit, tell)
        if shortage is not None:
            done = done._replace(result=done.result.with_changes(shortage=shortage))
        done.result.seconds["total"] = process_time() - start
        return _complete_result(done)


class _Passes:
    """Passes of a run, each with finer meshes or more steps than the one before.

    Parameters
    ----------
    run_plan : Plan
        Plan of the first pass.
    control : RunControl
        Limits of all passes together, callbacks, and whether to estimate the errors of the measures.
    state_file : StateFile or None
        File to which a long run saves its state; None to save nothing.
    """

    def __init__(self, run_plan: Plan, control: refine.RunControl, state_file: StateFile | None):
        self.plan = run_plan
        self.control = control
        self.state_file = state_file
        self._count = 0
        self._pressed: tuple[PressedFace, ...] = ()

    def solve(self, model: Model, earlier: FinishedPass | None) -> FinishedPass | None:
        """Run a model after an earlier pass, None for the first one; return None if it cannot improve the earlier pass."""
        clock = self.control.limit.clock
        begin = clock()
        seconds = {}
        try:
            result, pressed = self._run_model(model, seconds)
            self._pressed = pressed
        except (NotConverged, Missing):
            if earlier is None:
                raise
            return None

        if earlier is not None:
            if result.outcome is Outcome.NOT_CONVERGED:
                return None
            bounded = refine.bound_errors(result.measures, earlier.result.measures)
            result = replace(result, measures=bounded)
        self._count += 1
        return FinishedPass(model, result, pressed, clock() - begin)

    def judge(self, done: FinishedPass, excesses: list[float]) -> refine.Verdict:
        """Decide whether a pass is followed by another one.

        Parameters
        ----------
        done : FinishedPass
            The last pass.
        excesses : list of float
            Ratios of error to allowed error of the passes before.
        """
        if not self.control.estimate:
            return refine.Verdict(0.0)
        return refine.judge_pass(self.plan.model, done, excesses)

    def _run_model(self, model: Model, seconds) -> tuple[Result, tuple[PressedFace, ...]]:
        """Press the interfaces of a model, wear them, and compute its motion; return the result and the interfaces.

        A patch without contact and a rig without load have a result at once. `seconds` gets the CPU times by step. The
        meshes of the pass before are not solved again.
        """
        start = process_time()
        estimate = self.control.estimate
        if model.has_interface_patches:
            model = joint.press_interfaces(model)
        warnings = list(model.source.remarks)
        notes = list(model.source.notes)
        if model.rig is not None:
            warnings += engines.describe_unused_settings(model, self.plan.engine)

        pressed = _press_interfaces(model, self._pressed, estimate=estimate)
        if pressed:
            seconds["contact"] = process_time() - start
        stiffer = None
        if model.has_bolted_patch:
            # The table [contact] is the only interface then.
            model, patches, stiffer = joint.remove_joint(model, pressed[0].patches)
            pressed = (pressed[0]._replace(model=model, patches=tuple(patches)),)

        # Sentences on the static contact; those of several interfaces are merged.
        if pressed:
            warn = partial(_warn_of_pressed_patch, estimate=estimate)
            warnings += merge_sentences(model, pressed, warn)
            notes += merge_sentences(model, pressed, patch_result.notes_on_neglected_effects)
        notes += model.describe_removed_joint()
        inputs = RunInputs(
            plan=replace(self.plan, model=model),
            faces=pressed,
            seconds=seconds,
            warnings=warnings,
            notes=notes,
            control=self.control,
            stiffer=stiffer,
        )

        patch = inputs.patch
        is_open = patch is not None and patch.pressure.outcome is Outcome.NO_CONTACT
        if is_open and model.moves:
            warnings.append(NO_FRICTION_NO_MOTION_MESSAGE)
            result = patch_result.make_static_result(inputs)
        elif _has_no_load(model):
            result = _make_result_without_load(inputs)
        elif not model.moves:
            result = patch_result.make_static_result(inputs)
        else:
            result, pressed = self._move(inputs)
        return mark_unbalanced(result), pressed

    def _move(self, inputs: RunInputs) -> tuple[Result, tuple[PressedFace, ...]]:
        """Compute the wear of the patch, if the scene has [wear], and then the motion on the worn patch.

        Returns the result, and the pressed interfaces with their worn surfaces.
        """
        run_plan = inputs.plan
        model = run_plan.model
        worn_patch = None
        moved = inputs
        if model.wear is not None and inputs.patch is not None:
            worn_patch = self._wear_patch(inputs)
            moved = _make_worn_inputs(inputs, worn_patch)

        # A long run saves its state, so that it can be resumed.
        try:
            with self._saving_context(run_plan, moved.patch):
                result = rig.run_motion(moved)
        except NotConverged as error:
            if moved.patch is not None:
                error.partial_result = _make_result_at_rest(moved, run_plan)
            raise

        # Static measures come first, and those of wear last.
        result = _add_static_measures(result, moved.faces)
        if model.area is not None:
            result = area_motion.add_reversal_measure(result, moved.coarse)
        if model.wear is not None:
            result = replace(result, plan=run_plan)
            result = measures.add_wear_measures(result, worn_patch, self.control.estimate)
        return result, moved.faces

    def _wear_patch(self, inputs: RunInputs) -> "evolve.WornPatch":
        """Compute the wear of a patch, continuing from a saved state if there is one; without a file no state is saved."""
        model = inputs.plan.model
        patch, *coarse = inputs.patches[:3]
        file = self.state_file
        progress = inputs.control.progress
        if file is None:
            return evolve.compute_wear(model, patch, coarse, progress)
        key = hash_run(model, patch, file.version)
        initial = evolve.load_wear_state(file.path, key) if file.resume else None
        store = partial(evolve.save_wear_state, file.path, key)
        return evolve.compute_wear(model, patch, coarse, progress, initial, store)

    def _saving_context(self, run_plan: Plan, patch):
        """Return a context in which marches save their states; one that does nothing without them.

        Raises
        ------
        PatchfemError
            If the run should continue from a state that does not exist.
        """
        file = self.state_file
        model = run_plan.model
        if file is None or not is_march(run_plan):
            return nullcontext()

        # The states of earlier passes remain.
        stem = f"march_{self._count + 1}" if self._count else "march"

        def march_state_path(number: int) -> Path:
            """Return the path of the state file of one march."""
            return file.path.parent / f"{stem}_{number}.npz"

        is_missing = not self._count and model.wear is None and not march_state_path(1).is_file()
        if file.resume and is_missing:
            raise evolve.make_missing_state_error(file.path)
        return time_steps.checkpoint.store_checkpoints(
            time_steps.checkpoint.CheckpointFiles(
                march_state_path, hash_run(model, patch, file.version), file.resume
            )
        )


def _press_interfaces(
    model: Model, before: tuple[PressedFace, ...], *, estimate: bool
) -> tuple[PressedFace, ...]:
    """Press all interfaces of a model that have a patch, on the meshes of the run and of its error estimate.

    `before` are the interfaces of the pass before, () in the first one.
    """
    if model.patch is None:
        return tuple(faces.solve_interface_patches(model)) if model.has_interface_patches else ()
    if model.has_bolted_patch:
        # The patches of the pass before, whose stiffness was then matched to that of the joint, are stored as they were.
        solved = joint.solve_patch(before[0].model) if before else ()
        return (PressedFace(0, "", model, joint.solve_patch(model, solved)),)
    tolerance = model.accuracy.tolerance
    solved = (before[0].unworn or before[0].patches) if before else ()
    patches = case_meshes.solve_with_coarser(model.patch, tolerance, estimate, tuple(solved))
    return (PressedFace(0, "", model, patches),)


def _add_static_measures(result: Result, pressed: tuple[PressedFace, ...]) -> Result:
    """Return a Result that begins with the static measures of all pressed interfaces, such as their peak pressures."""
    static: Measures = {}
    for face in pressed:
        for name, measure in face.patch.measures.items():
            static[face.name_measure(name)] = measure
    motion = {name: m for name, m in result.measures.items() if name not in static}
    return replace(result, measures=static | motion)


def _warn_of_pressed_patch(face: PressedFace, *, estimate: bool) -> list[str]:
    """Return warnings on large strains, and on a mesh too coarse for an error estimate."""
    has_error_mesh = not estimate or face.patches[1] is not None
    return patch_result.patch_warnings(face.model.patch, face.patch, has_error_mesh=has_error_mesh)


def _make_result_without_load(inputs: RunInputs) -> Result:
    """Return the Result of a rig whose interfaces carry no load."""
    return Result(
        plan=inputs.plan,
        outcome=Outcome.NO_CONTACT,
        measures={"normal_load": Measure(0.0, "N", 0.0)},
        seconds=inputs.seconds,
        statements=Statements(
            [*inputs.warnings, Outcome.NO_CONTACT.sentence, NO_FRICTION_NO_MOTION_MESSAGE],
            inputs.notes,
        ),
    )


def _make_result_at_rest(inputs: RunInputs, run_plan: Plan) -> Result:
    """Return the Result of a pressed patch at rest, marked as not converged, because its motion was not found.

    `run_plan` is the plan before any wear, and `inputs` are those of the motion.
    """
    warnings = [*inputs.warnings, NO_MOTION_FOUND_MESSAGE]
    result = patch_result.make_static_result(replace(inputs, plan=run_plan, warnings=warnings))
    result = replace(result, outcome=Outcome.NOT_CONVERGED)
    inputs.seconds["total"] = sum(inputs.seconds.values())
    unmoved = (inputs.faces[0]._replace(unworn=()),)
    return _complete_result(FinishedPass(run_plan.model, result, unmoved, 0.0))


def _make_worn_inputs(inputs: RunInputs, worn_patch: "evolve.WornPatch") -> RunInputs:
    """Return the inputs of a run with the worn patch, and with the law and the grooves at its worn depth.

    If no wear could be computed, the law and the grooves are those of the unworn patch.
    """

    def wear_model(model: Model) -> Model:
        """Return a model after wear; unchanged if the last state of the wear is not known."""
        if worn_patch.state is None:
            return model
        return evolve.make_worn_model(model, worn_patch.patch, worn_patch.state.depth)

    stiffer = inputs.stiffer
    if stiffer is not None:
        # The comparison run differs only in the joint that was subtracted from its modes.
        stiffer = stiffer._replace(model=wear_model(stiffer.model), patches=[worn_patch.patch])
    (face,) = inputs.faces
    worn = (worn_patch.patch, *worn_patch.coarse)
    # The time of the wear, which has passes of its own, is not that of the motion.
    limit = inputs.control.limit
    limit = limit._replace(begin=limit.clock())
    return replace(
        inputs,
        plan=replace(inputs.plan, model=wear_model(inputs.plan.model)),
        faces=(face._replace(patches=worn, unworn=face.patches),),
        control=inputs.control._replace(limit=limit, progress=None),
        stiffer=stiffer,
    )


def _complete_result(done: FinishedPass) -> Result:
    """Add accuracy warnings, notes on yielding, and definitions of the measures to the Result of the last pass."""
    result = done.result
    model = result.plan.model

    # What misses the tolerance, with advice by cause.
    findings = tuple(find_missed_measures(result, done.pressed))
    warnings = [*result.warnings, *(finding.sentence for finding in findings)]

    outcome = result.outcome
    if outcome is Outcome.DONE and find_unknown_measures(result.measures):
        outcome = Outcome.NOT_CONVERGED
    path = model.source.path
    yielding_faces = _note_on_yielding_faces(result)
    notes = [*shorten_file_names(result.notes, path), *yielding_faces.values()]

    patch = result.patch
    if patch is not None:
        patch = replace(patch, frames=result.fields)
    # A number after the name of a measure counts the bands of a face, or else the interfaces.
    part = "interface" if model.patch is None else "band"
    described = {}
    for name, measure in result.measures.items():
        described[name] = replace(measure, text=describe_measure(name, part))

    return result.with_changes(
        outcome=outcome,
        patch=patch,
        measures=described,
        warnings=shorten_file_names(warnings, path),
        notes=notes,
        findings=findings,
        yielding_faces=yielding_faces,
    )


def _note_on_yielding_faces(result: Result) -> "dict[strength.Strength, str]":
    """Return the notes on surfaces that yield under the peak pressure minus its error, by the Strength that is exceeded."""
    peak = result.measures.get("pressure_peak")
    patch_model = result.plan.model.patch
    if patch_model is None or result.patch is None or peak is None or peak.value is None:
        return {}
    return strength.note_on_yielding_faces(patch_model, peak.value - (peak.error or 0.0))


def hash_run(model, patch, version: str) -> str:
    """Return the hash of a run, which a saved state must match.

    It depends on the scene in SI units, the contents of all files that it names, the unworn gap at the
    nodes, and the version of the program.

    Parameters
    ----------
    model : Model
        Model of the run.
    patch : Patch or None
        Unworn patch; None for a single point ([normal]).
    version : str
        Version of the program.
    """
    scene = model.source.resolved
    digest = hashlib.sha256(f"{version}\n{scene}\n{hash_scene_files(model.source)}".encode())
    for array in () if patch is None else (patch.x, patch.unloaded_gap):
        digest.update(array.tobytes())
    return digest.hexdigest()


def hash_scene_files(source: Source) -> list[list[str]]:
    """Return [name, SHA-256] of every file that the scene of a model names, whose `source` is given."""
    return hash_named_files(iterate_texts(tomllib.loads(source.resolved)), source.path.parent)


def is_march(run_plan: Plan) -> bool:
    """Return whether a run is a time march, whose state can be saved."""
    return run_plan.model.rig is not None and engines.ENGINES[run_plan.engine].has_steps


def _has_no_load(model: Model) -> bool:
    """Return whether no interface of a model without [contact] carries a load."""
    if model.rig is not None and model.rig.friction.names:
        return not any(interface.load for interface in model.rig.friction.interfaces)
    return model.point is not None and model.point.load == 0
