"""Run of a plan: from the pressed patch and the motion to the result with its warnings.

In: a `Plan`, or a Scene or Model that is planned first. Out: a `Result`.
"""

import hashlib
from contextlib import nullcontext
from dataclasses import replace
from importlib import import_module
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
from .patch import faces, strength
from .patch import result as patch_result
from .plan import Plan, compiled_kind, plan, refuse_size
from .results.patch_rows import unknown_measures
from .results.result import Result, shorten_file_names, with_meanings
from .rig import engines
from .self_checks.checks import with_self_checks
from .wear import evolve, measures

__all__ = ["Plan", "Result", "StateFile", "plan", "run"]
# "module function" of this folder that runs each kind of scene; imported and called only in `_run`
KINDS = {
    "patch": "patch.result static",
    "bench": "bench.result run_prescribed",
    "rig": "rig.rig run_coupled",
    "linear": "rig.rig run_coupled",
}

AT_REST = "no motion was found; the measures are those of the pressed patch at rest"


class StateFile(NamedTuple):
    """File with the state of a long run.

    - path: the file.
    - version: version of the program that the state must have.
    - resume: whether to continue from the state.
    """

    path: Path
    version: str
    resume: bool


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
        refuse_size(what)
        return _run(what, say, progress, estimate, fresh, kept)


def _run(what: Plan, say, progress, estimate: bool, fresh: bool, kept: StateFile | None) -> Result:
    """Run a plan whose size was accepted; the parameters are those of `run`."""
    begin = perf_counter()
    model = what.model
    seconds = {}
    warnings = list(model.source.remarks)
    notes = list(model.source.notes)
    patch = None
    coarse = (None, None)
    climbed = ()
    still = ()
    if model.rig is not None:
        warnings += engines.unused_settings(model, what.engine)
    if model.patch is not None:
        patch, *coarse = patch_result.solve_all(
            model.patch, model.accuracy.tolerance, estimate, fresh
        )
        if model.kind == "bench" and patch.pressure.outcome is not Outcome.NO_CONTACT:
            still = patch_result.solve_static_ladder(
                model.patch, model.accuracy.tolerance, estimate, fresh
            )
        seconds["contact"] = perf_counter() - begin
        if model.rig is not None and model.rig.structure.without_joint is not None:
            model = joint.remove_joint(model, patch)
            what = replace(what, model=model)
        warnings += patch_result.warn_of_strains(model.patch, patch)
        if estimate and coarse[0] is None:
            fewer = (
                "split the elements of contact.mesh"
                if model.patch.mesh.file
                else "leave out contact.element_size"
            )
            warnings.append(
                f"the {patch.x.size - 1} elements along the interface are too few for an estimate of the "
                f"error; {fewer}"
            )
        notes += patch_result.notes_on_neglected_effects(model, patch, coarse)
    if model.has_interface_patches:
        if fresh:
            faces.condense_again(model)
        warnings += faces.collect_warnings(model)
        notes += faces.collect_notes(model)
        seconds["contact"] = perf_counter() - begin
    if patch is not None and patch.pressure.outcome is Outcome.NO_CONTACT and model.kind != "patch":
        warnings.append("no friction acts and no motion was computed")
        result = patch_result.static(what, patch, coarse, seconds, warnings)
    elif _has_no_load(model):
        warnings += [Outcome.NO_CONTACT.sentence, "no friction acts and no motion was computed"]
        result = Result(
            what,
            Outcome.NO_CONTACT,
            {"normal_load": Measure(0.0, "N", 0.0)},
            None,
            None,
            None,
            {},
            seconds,
            warnings,
            {},
        )
    else:
        evolved = None
        here = what
        if model.wear is not None and patch is not None:
            key = kept and state_key(model, patch, kept.version)
            climbed = (patch, *coarse)
            evolved = evolve.evolved_with(kept, key, model, patch, coarse[:2], progress)
            progress = None  # the progress of the wear has covered all cycles
            patch = evolved.patch
            coarse = evolved.coarse
            if evolved.state is not None:
                here = replace(what, model=evolve.worn_model(model, patch, evolved.state.depth))
        module, function = KINDS[what.kind].split()
        solve = getattr(import_module(f"patchfem.runs.{module}"), function)
        try:
            with _saving_context(kept, what, patch):
                result = solve(here, patch, coarse, seconds, warnings, say, progress, estimate)
        except NotConverged as error:
            if patch is not None and what.kind != "patch":
                at_rest = patch_result.static(what, patch, coarse, seconds, [*warnings, AT_REST])
                error.partial_result = _complete_result(
                    replace(at_rest, outcome=Outcome.NOT_CONVERGED), notes, begin, coarse
                )
            raise
        if patch is not None and what.kind != "patch":
            found = {name: m for name, m in result.measures.items() if name != "normal_load"}
            at_rest = patch_result.static_measures(
                model, *((still[0], still[1:]) if still else (patch, coarse))
            )
            result = replace(result, measures=at_rest | found)
        if model.has_interface_patches:
            own = faces.static_measures(model)
            result = replace(
                result,
                extra=result.extra
                | {"faces": faces.faces_with_frames(model, result.extra.get("shots", ()))},
                measures=own | {name: m for name, m in result.measures.items() if name not in own},
            )
        if model.wear is not None:
            result = measures.add_wear_measures(replace(result, plan=what), evolved, estimate)
    if what.compile_seconds and estimate:
        compiled.record_run(compiled_kind(model, what.engine, what.unknowns))
    return _complete_result(with_self_checks(result), notes, begin, coarse, climbed, still)


def _complete_result(
    result: Result, notes: list, begin: float, coarse=(), climbed=(), still=()
) -> Result:
    """Return the result with its total time, notes, tolerance warnings and meanings.

    Parameters
    ----------
    result : Result
    notes : list
        Notes on the scene and the patch.
    begin : float
        Time at the start [s].
    coarse : sequence of Patch or None
        The patch on coarser meshes.
    climbed : sequence of Patch
        The patch before wear on the meshes of its ladder, fine to coarse, if the result is that of
        a worn one.
    still : sequence of Patch
        The patch on the meshes of its static measures, if these differ.
    """
    result.seconds["total"], model = perf_counter() - begin, result.plan.model
    apart = "strip" if model.patch is not None else "interface"
    wide = tolerance_warnings(
        Finding(model, result.measures, result.patch, result.extra, climbed), coarse, still
    )
    warned = result.warnings + wide
    noted = [*notes, *result.extra.get("notes", [])]
    warned, noted = (shorten_file_names(texts, model.source.path) for texts in (warned, noted))
    faces = _yielding_faces(result)
    noted += faces.values()
    outcome = result.outcome
    if outcome is Outcome.DONE and unknown_measures(result.measures):
        outcome = Outcome.NOT_CONVERGED
    return replace(
        result,
        outcome=outcome,
        measures=with_meanings(result.measures, apart),
        warnings=warned,
        extra=result.extra | {"notes": noted, "yielding_faces": faces},
    )


def _yielding_faces(result: Result) -> dict:
    """Return the notes on faces that yield even at the peak pressure minus its error."""
    peak = result.measures.get("pressure_peak")
    asked = result.plan.model.patch
    if asked is None or result.patch is None or peak is None or peak.value is None:
        return {}
    return strength.yielding_faces(asked, peak.value - (peak.error or 0.0))


def _saving_context(kept: StateFile | None, what: Plan, patch):
    """Return a context in which marches save their states, or an empty one.

    Raises
    ------
    PatchfemError
        If there is no state from which to continue.
    """
    model = what.model
    if kept is None or not marches(what):
        return nullcontext()

    def path_of_march(number: int) -> Path:
        """Return the file of the state of a march."""
        return kept.path.parent / f"march_{number}.npz"

    if kept.resume and model.wear is None and not path_of_march(1).is_file():
        raise evolve.nothing_kept(kept.path)
    return checkpoint.store_checkpoints(
        checkpoint.CheckpointFiles(
            path_of_march, state_key(model, patch, kept.version), kept.resume
        )
    )


def state_key(model, patch, version: str) -> str:
    """Return the key of what a saved state belongs to.

    It depends on the scene in SI units, the unworn gap on the nodes, a slide from a file, and the
    version.
    """
    corners = () if model.slide is None or model.slide.corners is None else model.slide.corners
    of_patch = () if patch is None else (patch.x, patch.gap)
    if model.wear is not None and model.wear.start is not None:
        of_patch = *of_patch, model.wear.start.x, model.wear.start.depth
    parts = (f"{version}\n{model.source.resolved}".encode(), *of_patch, *corners)
    return hashlib.sha256(
        b"".join(one if isinstance(one, bytes) else np.asarray(one).tobytes() for one in parts)
    ).hexdigest()


def marches(what: Plan) -> bool:
    """Return whether a run is a march in time, which saves its state."""
    if what.model.rig is None:
        return False

    return engines.ENGINES[what.engine].saves_state


def _has_no_load(model: Model) -> bool:
    """Return whether no interface of a model without a patch carries a load."""
    if model.rig is not None and len(model.rig.friction.names):
        return not any(interface.load for interface in model.rig.friction.interfaces)
    return model.point is not None and model.point.load == 0
