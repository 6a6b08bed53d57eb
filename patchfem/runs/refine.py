"""Refinement of a run until its main measures meet the tolerance.

In: the result of a pass of a run. Out: the model of the next pass, or the time that it would need. A pass is repeated
with twice the resolution along the axis with the largest share of the error of the worst main measure: the meshes of
the patches, or the steps of a bench. The steps of a rig are refined within a pass (`rig.run_refined`). A run that would
not meet its tolerance within accuracy.max_seconds is not repeated.
"""

from dataclasses import replace
from math import ceil, log
from typing import NamedTuple

import numpy as np

from ..core import Outcome
from ..formatting import format_number
from ..model.model import Model
from ..response import rows
from ..scene.rules.accuracy import list_repeated_axes
from .results.patch_rows import TABLE as PATCH_TABLE
from .results.patch_rows import Measures

MAX_SECONDS = 60.0  # Largest CPU time [s] of all passes without accuracy.max_seconds.
COST_RATIO = 4.0  # Expected ratio of the CPU times of two successive passes.
ERROR_RATIO = 4.0  # Expected ratio of the errors of two successive passes.
# Smallest ratio of the errors of two successive passes after which a third one follows.
MIN_ERROR_GAIN = 1.5
MAX_ERROR_EXCESS = 1e9  # Upper bound of the ratio of error to allowed error, for values of zero.
MAX_BENCH_STEPS = 6400  # Largest number of automatically chosen steps per cycle of a bench.
# Outcomes of runs without measures that finer passes could improve.
FAILED_OUTCOMES = (Outcome.NOT_CONVERGED, Outcome.NO_CONTACT, Outcome.GROWS)


class Pass(NamedTuple):
    """Pass of a run, and what the next one would be.

    - excess: largest ratio of error to allowed error of the main measures.
    - model: model of the next pass, or None.
    - seconds: CPU time [s] of all passes that would meet the tolerance, if it exceeds accuracy.max_seconds; else 0.
    - reason: why another pass follows, and its resolution; "" without one.
    """

    excess: float
    model: Model | None = None
    seconds: float = 0.0
    reason: str = ""


def judge_pass(
    given: Model, result, seconds: float, total_seconds: float, before: Pass | None
) -> Pass:
    """Decide whether a run needs another pass.

    Parameters
    ----------
    given : Model
        Model of the first pass, with the settings that the scene fixes.
    result : Result
        Result of this pass, with errors.
    seconds, total_seconds : float
        CPU times [s] of this pass and of all passes.
    before : Pass or None
        Pass before this one.
    """
    model = given if before is None else before.model
    name, excess = find_worst_measure(result.measures, model.accuracy.tolerance)
    if excess <= 1 or result.outcome in FAILED_OUTCOMES:
        return Pass(excess)
    if before is not None and excess * MIN_ERROR_GAIN > before.excess:
        return Pass(excess)

    # A pass is repeated only along the axis whose error is largest, and only if the run chose it.
    axis = find_axis(result.measures[name], name)
    finer = None
    if axis in list_repeated_axes(
        model.kind,
        has_wear=model.wear is not None,
        has_automatic_mesh=not _is_on_points(result, name),
        has_fixed_steps=given.accuracy.steps_per_cycle is not None,
    ):
        finer = refine_meshes(model) if axis == "mesh" else _refine_steps(model, result)

    # Each further pass divides the error by ERROR_RATIO and multiplies the time by COST_RATIO.
    n_passes = ceil(log(excess) / log(ERROR_RATIO))
    expected = total_seconds + seconds * sum(COST_RATIO**k for k in range(1, n_passes + 1))
    if finer is None:
        return Pass(excess)
    if expected > (model.accuracy.max_seconds or MAX_SECONDS):
        return Pass(excess, None, expected)

    resolution = "half the element size" if axis == "mesh" else "twice the steps"
    reason = (
        f"{name} has {format_number(excess, 2)} times the error that the tolerance allows; the run is repeated with "
        f"{resolution}"
    )
    return Pass(excess, finer, reason=reason)


def bound_errors(measures: Measures, before: Measures) -> Measures:
    """Return measures whose errors are not smaller than those of a method of second order.

    The error of a pass follows from the difference of two resolutions, which may vanish by chance; the loop would stop
    just there. The error of the pass before, divided by its largest expected gain, is a lower bound.

    Parameters
    ----------
    measures, before : dict of str to Measure
        Measures of a pass, and of the pass before, by name.
    """
    bounded = dict(measures)
    for name, measure in measures.items():
        earlier = before.get(name)
        if measure.error is None or earlier is None or earlier.error is None:
            continue
        error = max(measure.error, earlier.error / ERROR_RATIO)
        if error > measure.error and np.isfinite(error):
            bounded[name] = replace(measure, error=error)
    return bounded


def _is_on_points(result, name: str) -> bool:
    """Return whether a static measure is computed at the points of a profile, so that the mesh has no effect on it."""
    return name in PATCH_TABLE and result.patch is not None and result.patch.points is not None


def is_main(name: str) -> bool:
    """Return whether a run is refined until this measure meets the tolerance; warnings are about all measures."""
    row = PATCH_TABLE.get(name) or rows.TABLE.get(name)
    return row is not None and row.has("main")


def find_worst_measure(measures: Measures, tolerance: float) -> tuple[str, float]:
    """Return the main measure with the largest ratio of error to allowed error, and this ratio; ("", 0) without one."""
    found = filter(is_main, measures)
    ratios = {name: min(measures[name].error_ratio(tolerance), MAX_ERROR_EXCESS) for name in found}
    worst = max(ratios, key=ratios.get, default="")
    return worst, ratios.get(worst, 0.0)


def find_axis(measure, name: str) -> str:
    """Return the axis with the largest share of the error of a measure, such as "mesh"; "own" if none is known."""
    if name in PATCH_TABLE:
        return "mesh"
    if measure.causes is None:
        return "own"
    parts = measure.causes.parts
    axis = max(parts, key=parts.get, default="own")
    return axis if parts.get(axis, 0.0) > 0 else "own"


def _refine_steps(model: Model, result) -> Model | None:
    """Return the model of a bench with twice the steps per cycle of a result; None if there are too many."""
    steps = result.extra["steps"]
    if 2 * steps > MAX_BENCH_STEPS:
        return None
    accuracy = model.accuracy.model_copy(update={"steps_per_cycle": 2 * steps})
    return replace(model, accuracy=accuracy)


def refine_meshes(model: Model) -> Model | None:
    """Return a model whose patches have meshes with half the element size; None if no mesh is automatic."""
    patch = model.patch
    if patch is not None:
        return replace(model, patch=_refine_mesh(patch)) if _can_refine(patch) else None
    if model.rig is None:
        return None
    friction = model.rig.friction
    interfaces = tuple(map(_refine_interface, friction.interfaces))
    if interfaces == friction.interfaces:
        return None
    friction = replace(friction, interfaces=interfaces)
    return replace(model, rig=replace(model.rig, friction=friction))


def _refine_interface(interface):
    """Return an interface with a finer mesh of its patch; unchanged if it has no patch with an automatic mesh."""
    if not _can_refine(interface.patch):
        return interface
    return replace(interface, patch=_refine_mesh(interface.patch))


def _refine_mesh(patch_model):
    """Return a patch whose mesh is halved once more."""
    return patch_model.with_mesh(n_finer=patch_model.mesh.n_finer + 1)


def _can_refine(patch_model) -> bool:
    """Return whether the mesh of a patch follows from the tolerance and belongs to this run alone."""
    return (
        patch_model is not None
        and patch_model.mesh.is_automatic
        and patch_model.mesh.shared is None
    )
