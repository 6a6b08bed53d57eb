"""Run of a plan, from the contact and the motion to the result with its warnings.

In: a `Plan`, or a Scene or Model that is planned first. Out: a `Result`.
"""

import hashlib
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from time import perf_counter, process_time
from typing import NamedTuple

import numpy as np

from ..core import Measure, Missing, NotConverged, Outcome
from ..model.model import Model
from ..model.source import locate_errors
from ..points import checkpoint
from . import joint, memory, refine
from .balances import mark_unbalanced
from .bench import result as bench_result
from .findings import Missed, find_missed_measures
from .patch import faces, mesh_levels, store, strength
from .patch import result as patch_result
from .plan import Plan, plan
from .results.interfaces import Face, merge_sentences
from .results.patch_rows import Measures, find_unknown_measures
from .results.result import Result, RunInputs, describe_measure, shorten_file_names
from .rig import engines, rig
from .wear import evolve, measures

__all__ = ["Plan", "Result", "StateFile", "plan", "run"]
NO_FRICTION_MESSAGE = "no friction acts and no motion was computed"
NO_MOTION_FOUND = "no motion was found; the measures are those of the pressed patch at rest"


class StateFile(NamedTuple):
    """File with the state of a long run, from which a later run can continue.

    - path: path of the file.
    - version: program version that the state must have.
    - resume: whether to continue from the state.
    """

    path: Path
    version: str
    resume: bool


def run(
    runnable,
    say=None,
    progress=None,
    estimate: bool = True,
    fresh: bool = False,
    state_file: StateFile | None = None,
) -> Result:
    """Run a Plan, or plan and run a Scene or a Model.

    Parameters
    ----------
    runnable : Plan, Scene or Model
        What to run.
    say : callable, optional
        Callback for a line of text when code has to be compiled.
    progress : callable, optional
        Callback for the completed fraction: of all passes of a rig, or of the main pass of a bench.
    estimate : bool
        Whether to estimate the errors from coarser runs; if False, the errors are None.
    fresh : bool
        Whether to condense the pieces without using cached compliance matrices.
    state_file : StateFile, optional
        File in which the state of a run with [wear] or of a long march is saved.

    Returns
    -------
    Result

    Raises
    ------
    NotConverged
        With the static patch as partial result if the motion was not found.
    Missing
        If the scene cannot be run.
    """
    runnable = runnable if isinstance(runnable, Plan) else plan(runnable)
    with locate_errors(runnable.model.source):
        memory.refuse_insufficient_memory(runnable)
        if fresh:
            store.clear_cache()
        begin = process_time()

        # Each pass refines the model by the errors of the pass before, until it meets the tolerance
        # or cannot improve.
        earlier = passed = None
        next_plan = runnable
        for n_before in count():
            begin_pass = process_time()
            try:
                done = _run_pass(next_plan, say, progress, state_file, n_before, estimate=estimate)
            except (NotConverged, Missing):
                if earlier is None:
                    raise
                return _complete_result(earlier, passed)

            if not estimate:
                return _complete_result(done, None)
            if earlier is not None:
                if done.result.outcome is Outcome.NOT_CONVERGED:
                    return _complete_result(earlier, passed)
                bounded = refine.bound_errors(done.result.measures, earlier.result.measures)
                done = done._replace(result=replace(done.result, measures=bounded))

            end = process_time()
            passed = refine.judge_pass(
                runnable.model, done.result, end - begin_pass, end - begin, passed
            )
            if passed.model is None:
                return _complete_result(done, passed)
            if say is not None:
                say(passed.reason)
            earlier = done
            next_plan = replace(runnable, model=passed.model)


class FinishedPass(NamedTuple):
    """Result of a pass of a run, and what its warnings need.

    - result: Result.
    - notes: sentences on the scene and the patch.
    - start: start time of the pass [s].
    - pressed: pressed interfaces.
    """

    result: Result
    notes: list[str]
    start: float
    pressed: tuple[Face, ...]


def _run_pass(
    run_plan: Plan, say, progress, state_file: StateFile | None, n_before: int, *, estimate: bool
) -> FinishedPass:
    """Run a plan once, after a number of coarser passes.

    The order is: pressed interfaces, wear, then the motion or the static result, and finally static measures,
    balances and warnings. A patch without contact and a rig without load have a result at once.
    """
    start = perf_counter()
    model = run_plan.model
    seconds = {}
    warnings = list(model.source.remarks)
    notes = list(model.source.notes)
    if model.rig is not None:
        warnings += engines.describe_unused_settings(model, run_plan.engine)

    pressed = _press_interfaces(model, estimate=estimate)
    if pressed:
        seconds["contact"] = perf_counter() - start
    # The table [contact] is the only interface then.
    contact = pressed[0] if model.patch is not None else None
    stiffer = None
    if contact is not None and model.has_bolted_patch:
        model, patches, stiffer = joint.remove_joint(model, contact.patches)
        contact = contact._replace(model=model, patches=tuple(patches))
        pressed = (contact,)
        run_plan = replace(run_plan, model=model)

    # Sentences on the static contact; those of several interfaces are merged.
    warnings += merge_sentences(model, pressed, partial(_warn_of_pressed_patch, estimate=estimate))
    if pressed:
        notes += merge_sentences(model, pressed, patch_result.notes_on_neglected_effects)
    notes += model.describe_removed_joint()
    patch, *coarse = (None, None, None) if contact is None else contact.patches
    inputs = RunInputs(
        run_plan, patch, tuple(coarse), seconds, warnings, say, progress, estimate, stiffer, pressed
    )

    if _is_open(patch) and model.kind != "patch":
        result = patch_result.make_static_result(
            replace(inputs, warnings=[*warnings, NO_FRICTION_MESSAGE])
        )
    elif _has_no_load(model):
        result = _make_result_without_load(inputs)
    else:
        worn_patch = None
        if model.wear is not None and patch is not None:
            worn_patch = _wear_patch(inputs, state_file)
            worn = (worn_patch.patch, *worn_patch.coarse)
            pressed = (contact._replace(patches=worn, unworn=contact.patches),)
            inputs = _make_worn_inputs(replace(inputs, faces=pressed), worn_patch)

        # A long run saves its state, so that it can be resumed.
        try:
            with _saving_context(state_file, run_plan, inputs.patch, n_before):
                if run_plan.kind == "patch":
                    result = patch_result.make_static_result(inputs)
                elif run_plan.kind == "bench":
                    result = bench_result.run_prescribed(inputs)
                else:
                    result = rig.run_rig(inputs)
        except NotConverged as error:
            if contact is not None and run_plan.kind != "patch":
                at_rest = patch_result.make_static_result(
                    replace(inputs, plan=run_plan, warnings=[*warnings, NO_MOTION_FOUND])
                )
                at_rest = replace(at_rest, outcome=Outcome.NOT_CONVERGED)
                unmoved = (pressed[0]._replace(static=(), unworn=()),)
                error.partial_result = _complete_result(
                    FinishedPass(at_rest, notes, start, unmoved), None
                )
            raise

        # Static measures come first, and fields of the interfaces and wear follow the motion.
        if pressed and model.kind != "patch":
            static = _collect_static_measures(pressed)
            motion = {name: m for name, m in result.measures.items() if name not in static}
            result = replace(result, measures=static | motion)
        if model.has_interface_patches:
            frames = faces.add_slip_fields(model, pressed, result.extra.get("shots", ()))
            result = replace(result, faces=frames)
        if model.wear is not None:
            result = measures.add_wear_measures(
                replace(result, plan=run_plan), worn_patch, estimate
            )
    return FinishedPass(mark_unbalanced(result), notes, start, pressed)


def _press_interfaces(model: Model, *, estimate: bool) -> tuple[Face, ...]:
    """Press all interfaces of a model that have a patch, on the meshes of the run and of its error estimate."""
    if model.patch is None:
        return tuple(faces.solve_interface_patches(model)) if model.has_interface_patches else ()
    if model.has_bolted_patch:
        return (Face(0, "", model, joint.solve_patch(model)),)
    tolerance = model.accuracy.tolerance
    patches = mesh_levels.solve_with_coarser(model.patch, tolerance, estimate)
    static = ()
    # After wear the static measures are those of the worn patch.
    if model.kind == "bench" and model.wear is None and not _is_open(patches[0]):
        static = mesh_levels.solve_on_static_meshes(model.patch, tolerance, estimate)
    return (Face(0, "", model, patches, static=static),)


def _collect_static_measures(pressed: tuple[Face, ...]) -> Measures:
    """Return the static measures of interfaces by name, with error estimates."""
    measures = {}
    for face in pressed:
        patch, *coarse = face.static or face.patches
        for name, measure in patch_result.static_measures(face.model, patch, tuple(coarse)).items():
            measures[face.name_measure(name)] = measure
    return measures


def _is_open(patch) -> bool:
    """Return whether the two pieces of a solved patch do not touch."""
    return patch is not None and patch.pressure.outcome is Outcome.NO_CONTACT


def _warn_of_pressed_patch(face: Face, *, estimate: bool) -> list[str]:
    """Return warnings on large strains, and on a mesh too coarse for an error estimate."""
    has_error_mesh = not estimate or face.patches[1] is not None
    return patch_result.patch_warnings(face.model.patch, face.patch, has_error_mesh=has_error_mesh)


def _make_result_without_load(inputs: RunInputs) -> Result:
    """Return the Result of a rig whose interfaces carry no load."""
    return Result(
        plan=inputs.plan,
        outcome=Outcome.NO_CONTACT,
        measures={"normal_load": Measure(0.0, "N", 0.0)},
        response=None,
        window=None,
        patch=None,
        fields={},
        seconds=inputs.seconds,
        warnings=[*inputs.warnings, Outcome.NO_CONTACT.sentence, NO_FRICTION_MESSAGE],
        extra={},
    )


def _wear_patch(inputs: RunInputs, state_file: StateFile | None):
    """Compute the wear of a patch, continuing from a saved state if there is one."""
    model = inputs.plan.model
    patch = inputs.patch
    key = state_file and hash_run(model, patch, state_file.version)
    return evolve.compute_and_save_wear(
        state_file, key, model, patch, inputs.coarse[:2], inputs.progress
    )


def _make_worn_inputs(inputs: RunInputs, worn_patch) -> RunInputs:
    """Return the inputs of a run with worn surfaces."""

    def wear_model(model: Model) -> Model:
        """Return a model after wear; unchanged if the last state of the wear is not known."""
        if worn_patch.state is None:
            return model
        return evolve.make_worn_model(model, worn_patch.patch, worn_patch.state.depth)

    stiffer = inputs.stiffer
    if stiffer is not None:
        # The comparison run differs only in the joint that was subtracted from its modes.
        stiffer = stiffer._replace(model=wear_model(stiffer.model), patches=[worn_patch.patch])
    return replace(
        inputs,
        plan=replace(inputs.plan, model=wear_model(inputs.plan.model)),
        patch=worn_patch.patch,
        coarse=tuple(worn_patch.coarse),
        progress=None,
        stiffer=stiffer,
    )


def _complete_result(done: FinishedPass, passed: refine.Pass | None) -> Result:
    """Add CPU time, notes, accuracy warnings and definitions of the measures to a Result.

    Parameters
    ----------
    done : FinishedPass
        Result of the last pass that counts, and its notes.
    passed : refine.Pass or None
        Why no further pass follows; None for a run without errors.
    """
    result, notes, start, pressed = done
    model = result.plan.model
    result.seconds["total"] = perf_counter() - start

    # What misses the tolerance, with advice by cause.
    next_seconds = 0.0 if passed is None else passed.seconds
    missed = Missed(model, result.measures, pressed, result.extra, next_seconds)
    findings = tuple(find_missed_measures(missed))
    warnings = [*result.warnings, *(finding.sentence for finding in findings)]
    notes = [*notes, *result.extra.get("notes", [])]

    yielding_faces = _note_on_yielding_faces(result)
    outcome = result.outcome
    if outcome is Outcome.DONE and find_unknown_measures(result.measures):
        outcome = Outcome.NOT_CONVERGED
    path = model.source.path
    notes = [*shorten_file_names(notes, path), *yielding_faces.values()]

    patch = result.patch
    if patch is not None:
        patch = replace(patch, frames=result.fields)
    # A number after the name of a measure counts the strips of a patch, or else the interfaces.
    part = "interface" if model.patch is None else "strip"
    described = {}
    for name, measure in result.measures.items():
        described[name] = replace(measure, text=describe_measure(name, part))

    return replace(
        result,
        outcome=outcome,
        patch=patch,
        measures=described,
        warnings=shorten_file_names(warnings, path),
        extra=result.extra | {"notes": notes},
        findings=findings,
        yielding_faces=yielding_faces,
    )


def _note_on_yielding_faces(result: Result) -> dict:
    """Return notes on surfaces that yield at the pressure peak minus its error."""
    peak = result.measures.get("pressure_peak")
    patch_model = result.plan.model.patch
    if patch_model is None or result.patch is None or peak is None or peak.value is None:
        return {}
    return strength.note_on_yielding_faces(patch_model, peak.value - (peak.error or 0.0))


def _saving_context(state_file: StateFile | None, run_plan: Plan, patch, n_before: int):
    """Return a context in which marches save their states; one that does nothing without them.

    `n_before` is the number of earlier passes, whose states remain.

    Raises
    ------
    PatchfemError
        If the run should continue from a state that does not exist.
    """
    model = run_plan.model
    if state_file is None or not is_march(run_plan):
        return nullcontext()

    def march_state_path(number: int) -> Path:
        """Return the path of the state file of one march."""
        name = f"march_{number}.npz" if n_before == 0 else f"march_{n_before + 1}_{number}.npz"
        return state_file.path.parent / name

    is_missing = n_before == 0 and model.wear is None and not march_state_path(1).is_file()
    if state_file.resume and is_missing:
        raise evolve.make_missing_state_error(state_file.path)
    return checkpoint.store_checkpoints(
        checkpoint.CheckpointFiles(
            march_state_path, hash_run(model, patch, state_file.version), state_file.resume
        )
    )


def hash_run(model, patch, version: str) -> str:
    """Return the hash of a run, which a saved state must match.

    It depends on the scene in SI units, the unworn gap at the nodes, the worn depth of an earlier
    run, a displacement from a file, and the version of the program.

    Parameters
    ----------
    model : Model
        Model of the run.
    patch : Patch or None
        Unworn patch; None for a single point ([normal]).
    version : str
        Version of the program.
    """
    arrays = []
    if patch is not None:
        arrays += [patch.x, patch.unloaded_gap]
    if model.wear is not None and model.wear.start is not None:
        arrays += [model.wear.start.x, model.wear.start.depth]
    if model.slide is not None and model.slide.corners is not None:
        arrays += model.slide.corners
    digest = hashlib.sha256(f"{version}\n{model.source.resolved}".encode())
    for array in arrays:
        digest.update(np.asarray(array).tobytes())
    return digest.hexdigest()


def is_march(run_plan: Plan) -> bool:
    """Return whether a run is a time march, whose state can be saved."""
    if run_plan.model.rig is None:
        return False

    return engines.ENGINES[run_plan.engine].saves_state


def _has_no_load(model: Model) -> bool:
    """Return whether no interface of a model without [contact] carries a load."""
    if model.rig is not None and len(model.rig.friction.names):
        return not any(interface.load for interface in model.rig.friction.interfaces)
    return model.point is not None and model.point.load == 0
