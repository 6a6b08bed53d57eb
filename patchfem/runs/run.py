"""Run of a plan: from the pressed patch and the motion to the result with its warnings.

In: a `Plan`, or a Scene or Model that is planned first. Out: a `Result`.
"""

import hashlib
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from .. import compiled
from ..core import Measure, NotConverged, Outcome
from ..dynamics import checkpoint
from ..model.model import Model
from ..model.source import locate_errors
from . import joint
from .accuracy_warnings import Finding, tolerance_warnings
from .bench import result as bench_result
from .patch import faces, strength
from .patch import result as patch_result
from .plan import Plan, compiled_kind, plan, refuse_large_run
from .results.patch_rows import find_unknown_measures
from .results.result import Result, RunInputs, describe_measure, shorten_file_names
from .rig import engines, rig
from .self_checks.checks import mark_failed_checks
from .wear import evolve, measures

__all__ = ["Plan", "Result", "StateFile", "plan", "run"]
NO_MOTION = "no friction acts and no motion was computed"
NO_MOTION_FOUND = "no motion was found; the measures are those of the pressed patch at rest"


class StateFile(NamedTuple):
    """File with the state of a long run, from which a later run can continue.

    - path: the file.
    - version: version of the program that the state must have.
    - resume: whether to continue from the state.
    """

    path: Path
    version: str
    resume: bool


class PatchMeshes(NamedTuple):
    """Patch of [contact], solved on several meshes.

    - patch: on the finest mesh; None without [contact].
    - coarse: on coarser meshes, fine to coarse; None for a missing one.
    - static: on the meshes of its static measures, fine to coarse; () if these are the same.
    - unworn: before wear, on the meshes of its ladder, fine to coarse; () if it is not worn.
    """

    patch: object = None
    coarse: tuple = (None, None)
    static: tuple = ()
    unworn: tuple = ()


def run(
    what,
    say=None,
    progress=None,
    estimate: bool = True,
    fresh: bool = False,
    kept: StateFile | None = None,
) -> Result:
    """Run a Plan, or plan and run a Scene or a Model.

    Parameters
    ----------
    what : Plan, Scene or Model
    say : callable, optional
        Callback for a line of text when code has to be compiled.
    progress : callable, optional
        Callback for the completed fraction: of all passes of a rig, of the main pass of a bench.
    estimate : bool
        If False, there are no coarse runs and the errors are None.
    fresh : bool
        Whether the pieces are condensed again.
    kept : StateFile, optional
        File in which the state of a run with [wear] or of a long march is saved.

    Returns
    -------
    Result

    Raises
    ------
    NotConverged
        With the pressed patch as partial result if only the motion was not found.
    Missing
        If the scene cannot be run.
    """
    what = what if isinstance(what, Plan) else plan(what)
    with locate_errors(what.model.source):
        refuse_large_run(what)
        return _run_plan(what, say, progress, kept, estimate=estimate, fresh=fresh)


def _run_plan(
    what: Plan, say, progress, kept: StateFile | None, *, estimate: bool, fresh: bool
) -> Result:
    """Run a plan whose size was accepted."""
    begin = perf_counter()
    model = what.model
    seconds = {}
    warnings = list(model.source.remarks)
    notes = list(model.source.notes)
    meshes = PatchMeshes()
    if model.rig is not None:
        warnings += engines.describe_unused_settings(model, what.engine)
    if model.patch is not None:
        meshes = _press_patch(model, estimate=estimate, fresh=fresh)
        seconds["contact"] = perf_counter() - begin
        if model.rig is not None and model.rig.structure.without_joint is not None:
            model = joint.remove_joint(model, meshes.patch)
            what = replace(what, model=model)
        warnings += _warn_of_patch(model, meshes, estimate=estimate)
        notes += patch_result.notes_on_neglected_effects(model, meshes.patch, meshes.coarse)
    if model.has_interface_patches:
        if fresh:
            faces.recondense_interface_pieces(model)
        warnings += faces.collect_warnings(model)
        notes += faces.collect_notes(model)
        seconds["contact"] = perf_counter() - begin
    inputs = RunInputs(
        what, meshes.patch, meshes.coarse, seconds, warnings, say, progress, estimate
    )
    if _is_open(meshes.patch) and model.kind != "patch":
        result = patch_result.make_static_result(replace(inputs, warnings=[*warnings, NO_MOTION]))
    elif _has_no_load(model):
        result = _result_without_load(inputs)
    else:
        evolved = None
        if model.wear is not None and meshes.patch is not None:
            evolved = _wear_patch(inputs, kept)
            unworn = (meshes.patch, *meshes.coarse)
            meshes = PatchMeshes(evolved.patch, tuple(evolved.coarse), meshes.static, unworn)
            inputs = _worn_inputs(inputs, evolved)
        try:
            with _saving_context(kept, what, meshes.patch):
                if what.kind == "patch":
                    result = patch_result.make_static_result(inputs)
                elif what.kind == "bench":
                    result = bench_result.run_prescribed(inputs)
                else:
                    result = rig.run_rig(inputs)
        except NotConverged as error:
            if meshes.patch is not None and what.kind != "patch":
                at_rest = patch_result.make_static_result(
                    replace(inputs, plan=what, warnings=[*warnings, NO_MOTION_FOUND])
                )
                at_rest = replace(at_rest, outcome=Outcome.NOT_CONVERGED)
                unworn = PatchMeshes(meshes.patch, meshes.coarse)
                error.partial_result = _complete_result(at_rest, notes, begin, unworn)
            raise
        if model.kind != "patch":
            result = _add_static_measures(result, model, meshes)
        if model.wear is not None:
            result = measures.add_wear_measures(replace(result, plan=what), evolved, estimate)
    if what.compile_seconds and estimate:
        compiled.record_run(compiled_kind(model, what.engine, what.unknowns))
    return _complete_result(mark_failed_checks(result), notes, begin, meshes)


def _press_patch(model: Model, *, estimate: bool, fresh: bool) -> PatchMeshes:
    """Solve the patch of [contact] on the meshes that the run and its error estimate need."""
    tolerance = model.accuracy.tolerance
    patch, *coarse = patch_result.solve_with_coarser(model.patch, tolerance, estimate, fresh)
    static = ()
    if model.kind == "bench" and not _is_open(patch):
        static = patch_result.solve_on_static_meshes(model.patch, tolerance, estimate, fresh)
    return PatchMeshes(patch, tuple(coarse), tuple(static))


def _is_open(patch) -> bool:
    """Return whether the two pieces of a solved patch do not touch."""
    return patch is not None and patch.pressure.outcome is Outcome.NO_CONTACT


def _warn_of_patch(model: Model, meshes: PatchMeshes, *, estimate: bool) -> list:
    """Return the warnings on large strains and on an unknown mesh error of a patch."""
    patch = meshes.patch
    warnings = list(patch_result.patch_warnings(model.patch, patch))
    if estimate and meshes.coarse[0] is None:
        remedy = "leave out contact.element_size"
        if model.patch.mesh.file:
            remedy = "split the elements of contact.mesh"
        warnings.append(
            f"the {patch.x.size - 1} elements along the interface are too few for an estimate of the "
            f"error; {remedy}"
        )
    return warnings


def _result_without_load(inputs: RunInputs) -> Result:
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
        warnings=[*inputs.warnings, Outcome.NO_CONTACT.sentence, NO_MOTION],
        extra={},
    )


def _wear_patch(inputs: RunInputs, kept: StateFile | None):
    """Compute the wear of a patch; continue from a saved state if there is one."""
    model = inputs.plan.model
    patch = inputs.patch
    key = kept and state_key(model, patch, kept.version)
    return evolve.compute_and_save_wear(kept, key, model, patch, inputs.coarse[:2], inputs.progress)


def _worn_inputs(inputs: RunInputs, evolved) -> RunInputs:
    """Return the inputs of a run with worn surfaces."""
    plan_of_run = inputs.plan
    if evolved.state is not None:
        worn = evolve.make_worn_model(plan_of_run.model, evolved.patch, evolved.state.depth)
        plan_of_run = replace(plan_of_run, model=worn)
    return replace(
        inputs, plan=plan_of_run, patch=evolved.patch, coarse=tuple(evolved.coarse), progress=None
    )


def _add_static_measures(result: Result, model: Model, meshes: PatchMeshes) -> Result:
    """Add the static measures of the patches to the result of a motion."""
    if meshes.patch is not None:
        motion = {name: m for name, m in result.measures.items() if name != "normal_load"}
        patch, *coarse = meshes.static or (meshes.patch, *meshes.coarse)
        static = patch_result.static_measures(model, patch, tuple(coarse))
        result = replace(result, measures=static | motion)
    if model.has_interface_patches:
        static = faces.static_measures(model)
        frames = faces.solve_faces_with_slip_fields(model, result.extra.get("shots", ()))
        result = replace(
            result,
            extra=result.extra | {"faces": frames},
            measures=static
            | {name: m for name, m in result.measures.items() if name not in static},
        )
    return result


def _complete_result(result: Result, notes: list, begin: float, meshes: PatchMeshes) -> Result:
    """Add CPU time, notes, accuracy warnings and meanings of measures to a result.

    Parameters
    ----------
    result : Result
    notes : list
        Notes on the scene and the patch.
    begin : float
        Time at the start [s].
    meshes : PatchMeshes
    """
    model = result.plan.model
    result.seconds["total"] = perf_counter() - begin
    finding = Finding(model, result.measures, result.patch, result.extra, meshes.unworn)
    warnings = [*result.warnings, *tolerance_warnings(finding, meshes.coarse, meshes.static)]
    notes = [*notes, *result.extra.get("notes", [])]
    yielding_faces = _yielding_faces(result)
    outcome = result.outcome
    if outcome is Outcome.DONE and find_unknown_measures(result.measures):
        outcome = Outcome.NOT_CONVERGED
    path = model.source.path
    notes = [*shorten_file_names(notes, path), *yielding_faces.values()]
    patch = result.patch
    if patch is not None:
        patch = replace(patch, frames=result.fields)
    # a number after the name of a measure counts the strips of a patch, or else the interfaces
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
        extra=result.extra | {"notes": notes, "yielding_faces": yielding_faces},
    )


def _yielding_faces(result: Result) -> dict:
    """Return the notes on surfaces that yield at the peak pressure less its error."""
    peak = result.measures.get("pressure_peak")
    patch_model = result.plan.model.patch
    if patch_model is None or result.patch is None or peak is None or peak.value is None:
        return {}
    return strength.note_on_yielding_faces(patch_model, peak.value - (peak.error or 0.0))


def _saving_context(kept: StateFile | None, what: Plan, patch):
    """Return a context in which marches save their states, or a context that does nothing.

    Raises
    ------
    PatchfemError
        If there is no state from which to continue.
    """
    model = what.model
    if kept is None or not is_march(what):
        return nullcontext()

    def path_of_march(number: int) -> Path:
        """Return the file in which the state of one march is saved."""
        return kept.path.parent / f"march_{number}.npz"

    if kept.resume and model.wear is None and not path_of_march(1).is_file():
        raise evolve.make_missing_state_error(kept.path)
    return checkpoint.store_checkpoints(
        checkpoint.CheckpointFiles(
            path_of_march, state_key(model, patch, kept.version), kept.resume
        )
    )


def state_key(model, patch, version: str) -> str:
    """Return the hash of a run, which a saved state must match to be continued.

    The key depends on the scene in SI units, the unworn gap on the nodes, a slide from a file, and the
    version of the program.

    Parameters
    ----------
    model : Model
    patch : Patch or None
    version : str
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


def is_march(what: Plan) -> bool:
    """Return whether a run is a time march, whose state can be saved."""
    if what.model.rig is None:
        return False

    return engines.ENGINES[what.engine].saves_state


def _has_no_load(model: Model) -> bool:
    """Return whether no interface of a model without a patch carries a load."""
    if model.rig is not None and len(model.rig.friction.names):
        return not any(interface.load for interface in model.rig.friction.interfaces)
    return model.point is not None and model.point.load == 0
