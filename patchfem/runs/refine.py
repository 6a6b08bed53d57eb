"""Refinement of a run until its measures meet the tolerance.

In: a function that solves a problem with a resolution, and one that judges the solution. Each pass of `refine` has twice
the resolution along the axis that causes the errors of a measure (`find_refinable_axis`): the meshes of the patches or the
steps of a bench (`judge_pass`), or the steps of a rig (`rig.run_refined`). A run that would not meet its tolerance within
accuracy.max_seconds, or whose next mesh would exceed accuracy.max_memory, is not repeated; its result names the axis and the
time or memory that would be needed. The same loop refines the meshes of patches (`patch.case_meshes`), their points
(`patch.profile_points`) or cells (`patch.area`), the steps of cases at one point (`batch.lumped`), the models of a fit
(`campaigns.fits`), and loops and amplitudes of a backbone (`campaigns.backbone`).
"""

from collections.abc import Callable, Hashable, Iterable
from dataclasses import replace
from math import ceil, inf, log, log2
from typing import NamedTuple, TypeVar

import numpy as np

from .. import measures as run_measures
from ..core import Measure, Outcome
from ..cost_model import measure_cpu_time
from ..formatting import format_number
from ..model.model import Model
from ..scene.rules.accuracy import list_repeated_axes
from .results.patch_rows import PATCH_TABLE, Measures, Values
from .results.result import Shortage

# Memory [bytes] per node of a mesh whose factors are not kept, while its pieces are condensed; measured: 1.4e3 to 1.8e3
CONDENSING_BYTES_PER_NODE = 1.8e3
# Memory [bytes] per pair of interface nodes: compliances of the patch, their factors, and those of the coarser meshes;
# measured: 110 without the motion
BYTES_PER_INTERFACE_PAIR = 200.0
PROGRAM_BYTES = 160e6  # Packages and compiled code [bytes].
DEFAULT_MAX_BYTES = 2e9  # Memory [bytes] of a run without accuracy.max_memory.
DEFAULT_MAX_SECONDS = 60.0  # Largest CPU time [s] of all passes without accuracy.max_seconds.
HALVED_MESH_COST_RATIO = 4.0  # Expected ratio of the CPU times of runs with half the element size.
# The same of runs with twice the steps, or with a hundredth of the step error.
DOUBLED_STEPS_COST_RATIO = 2.0
PASS_ERROR_RATIO = 4.0  # Expected ratio of the errors of two successive passes.
# Smallest ratio of the errors of two successive passes after which a third one follows.
MIN_PASS_ERROR_GAIN = 1.5
# Smallest share of an axis in an error that its refinement reduces noticeably.
MIN_AXIS_ERROR_FRACTION = 0.5
MAX_ERROR_EXCESS = 1e9  # Upper bound of the ratio of error to allowed error, for values of zero.
MAX_REFINED_BENCH_STEPS = 6400  # Largest number of automatically chosen steps per cycle of a bench.
# Outcomes of runs without measures that finer passes could improve.
FAILED_OUTCOMES = (Outcome.NOT_CONVERGED, Outcome.NO_CONTACT, Outcome.GROWS)
Resolution = TypeVar("Resolution")
Solution = TypeVar("Solution")


class Verdict(NamedTuple):
    """Whether a solution is refined.

    - excess: largest ratio of error to allowed error of the measures that a finer resolution improves.
    - finer: next resolution, or None.
    - axis: axis that the next resolution refines.
    - seconds: CPU time [s] of the part of the last pass that the next one repeats.
    - cost_ratio: expected ratio of the CPU times of two successive passes.
    - max_passes: number of finer passes at the end of which the axis reaches its limit.
    - reason: why another pass follows, and its resolution; "" without one.
    - bytes: memory that the next pass needs [bytes]; 0 if it hardly needs more than the last one.
    """

    excess: float
    finer: Hashable = None
    axis: str = ""
    seconds: float = 0.0
    cost_ratio: float = HALVED_MESH_COST_RATIO
    max_passes: float = inf
    reason: str = ""
    bytes: float = 0.0

    def predict_seconds(self) -> float:
        """Return the expected CPU time [s] of all further passes, each of which divides the excess by PASS_ERROR_RATIO."""
        n_passes = int(min(ceil(log(self.excess) / log(PASS_ERROR_RATIO)), self.max_passes))
        return self.seconds * sum(self.cost_ratio**k for k in range(1, n_passes + 1))


class RunLimit(NamedTuple):
    """CPU time and memory that a run may take.

    - seconds: largest CPU time of the run [s], accuracy.max_seconds.
    - begin: CPU time of this process at which the run began [s].
    - clock: function that returns the CPU time of this process [s], without that of compiling.
    - bytes: largest memory of the run [bytes], accuracy.max_memory.
    """

    seconds: float
    begin: float
    clock: Callable[[], float] = measure_cpu_time
    bytes: float = DEFAULT_MAX_BYTES


class RunControl(NamedTuple):
    """What the caller of a run has set.

    - limit: CPU time and memory that all passes together may take.
    - say, progress: callbacks for a line of text and for the completed fraction, or None.
    - estimate: whether to estimate the errors from coarser runs.
    """

    limit: RunLimit
    say: Callable[[str], None] | None = None
    progress: Callable[[float], None] | None = None
    estimate: bool = True


# of meshes, which have a largest predicted time of their own
NO_LIMIT = RunLimit(inf, 0.0, bytes=inf)


class WorstMeasure(NamedTuple):
    """Measure that misses its tolerance most, of those that a finer resolution improves.

    - excess: ratio of error to allowed error; 0 if there is no such measure.
    - name: name of the measure.
    - axis: axis to refine.
    """

    excess: float = 0.0
    name: str = ""
    axis: str = ""


def refine(
    solve: Callable[[Resolution, Solution | None], Solution | None],
    resolution: Resolution,
    judge: Callable[[Solution, list[float]], Verdict],
    limit: RunLimit,
    say: Callable[[str], None] | None = None,
) -> tuple[Solution, Shortage | None]:
    """Solve a problem with finer and finer resolutions, and return the last solution.

    The second value is a Shortage if accuracy.max_seconds or accuracy.max_memory ended the refinement, else None.

    Parameters
    ----------
    solve : callable
        Function of a resolution and of the solution before, None for the first one. It returns None if it has no better
        solution.
    resolution : object
        First resolution.
    judge : callable
        Function of a solution and of the excesses of all solutions before.
    limit : RunLimit
        No pass follows that would need more memory, or at whose end the run would have taken more CPU time.
    say : callable, optional
        Callback for the reason of another pass.
    """
    solution = None
    excesses: list[float] = []
    while resolution is not None:
        finer = solve(resolution, solution)
        if finer is None:
            break
        solution = finer
        verdict = judge(solution, excesses)
        excesses.append(verdict.excess)
        resolution = verdict.finer

        # Memory and time of the next pass alone are compared with their limits, because a pass often reduces the error by
        # more than expected. The time that is reported as needed is that of all passes.
        if resolution is not None:
            if verdict.bytes > limit.bytes:
                shortage = Shortage(verdict.axis, verdict.bytes, "accuracy.max_memory")
                return solution, shortage
            spent = limit.clock() - limit.begin
            if spent + verdict.cost_ratio * verdict.seconds > limit.seconds:
                return solution, Shortage(verdict.axis, spent + verdict.predict_seconds())
            if say is not None and verdict.reason:
                say(verdict.reason)
    return solution, None


def split_error(measure: Measure, name: str) -> Values:
    """Return the parts of the error of a measure by axis, such as "mesh" or "steps"; static measures have "mesh" alone."""
    if name in PATCH_TABLE:
        return {"mesh": measure.error or 0.0}
    return measure.parts or {}


def find_axis(measure: Measure, name: str) -> str:
    """Return the discretization that contributes most to the error of a measure, such as "mesh", "steps" or "modes".

    It is "own" if no contribution is known.
    """
    parts = split_error(measure, name)
    axis = max(parts, key=parts.get, default="own")
    return axis if parts.get(axis, 0.0) > 0 else "own"


def find_refinable_axis(measure: Measure, name: str, tolerance: float, axes: Iterable[str]) -> str:
    """Return the axis along which a finer resolution improves a measure that misses its tolerance; "" if there is none.

    It has most of the error, or the other contributions alone are within the tolerance.

    Parameters
    ----------
    measure : Measure
        Measure with an error.
    name : str
        Its name.
    tolerance : float
        Relative tolerance.
    axes : iterable of str
        Axes that can be refined.
    """
    parts = split_error(measure, name)
    allowed = measure.error / measure.error_ratio(tolerance)
    for axis in sorted(axes, key=lambda axis: -parts.get(axis, 0.0)):
        part = parts.get(axis, 0.0)
        if part > MIN_AXIS_ERROR_FRACTION * measure.error or (
            part > 0 and measure.error - part <= allowed
        ):
            return axis
    return ""


def find_worst_measure(measures: Measures, tolerance: float, axes: Iterable[str]) -> WorstMeasure:
    """Return the measure that misses its tolerance most, of those that a finer resolution along some axes improves.

    Parameters
    ----------
    measures : dict of str to Measure
        Measures by name that count.
    tolerance : float
        Relative tolerance.
    axes : iterable of str
        Axes that can be refined.
    """
    worst = WorstMeasure()
    for name, measure in measures.items():
        excess = min(measure.error_ratio(tolerance), MAX_ERROR_EXCESS)
        if excess > max(worst.excess, 1.0):
            axis = find_refinable_axis(measure, name, tolerance, axes)
            if axis:
                worst = WorstMeasure(excess, name, axis)
    return worst


def judge_pass(given: Model, done, excesses: list[float]) -> Verdict:
    """Decide whether a run needs another pass with finer meshes or more steps.

    Parameters
    ----------
    given : Model
        Model of the first pass, with the settings that the scene fixes.
    done : run.FinishedPass
        The last pass.
    excesses : list of float
        Excesses of the passes before.
    """
    model = done.model
    result = done.result
    if result.outcome in FAILED_OUTCOMES:
        return Verdict(0.0)
    # Axes along which a run of this kind may be repeated, "mesh" or "steps".
    axes = list_repeated_axes(
        model.kind,
        has_wear=model.wear is not None,
        has_automatic_mesh=refine_meshes(model) is not None,
        has_fixed_steps=given.accuracy.steps_per_cycle is not None,
    )
    main = {name: one for name, one in result.measures.items() if is_main(name)}
    if result.patch is not None and result.patch.points is not None:
        # The mesh has no effect on static measures at the points of a profile.
        main = {name: one for name, one in main.items() if name not in PATCH_TABLE}

    # Largest ratio of error to allowed error, and the axis that causes it. No pass follows one that hardly reduced it.
    excess, name, axis = find_worst_measure(main, model.accuracy.tolerance, axes)
    if not axis or (excesses and excess * MIN_PASS_ERROR_GAIN > excesses[-1]):
        return Verdict(excess)

    finer = refine_meshes(model) if axis == "mesh" else _refine_steps(model, result)
    if finer is None:
        return Verdict(excess)

    # Words, cost and largest number of further passes, for a finer mesh or for more steps.
    resolution = "half the element size"
    cost_ratio = HALVED_MESH_COST_RATIO
    max_passes = inf
    n_bytes = 0.0
    if axis == "mesh":
        pairs = [face.patch.pair for face in done.pressed]
        n_bytes = _predict_halved_mesh_bytes(pairs)
    else:
        resolution = "twice the steps"
        cost_ratio = DOUBLED_STEPS_COST_RATIO
        max_passes = int(log2(MAX_REFINED_BENCH_STEPS / result.settings.steps_per_cycle))
    reason = (
        f"{name} has {format_number(excess, 2)} times the error that the tolerance allows; the run is repeated with "
        f"{resolution}"
    )
    return Verdict(excess, finer, axis, done.seconds, cost_ratio, max_passes, reason, n_bytes)


def _predict_halved_mesh_bytes(pairs) -> float:
    """Predict the memory [bytes] of a run whose patches have meshes with half the element size.

    `pairs` are the CondensedPairs of the present meshes. The pieces are condensed one after the other.
    """
    n_nodes = [4 * body.n_nodes for pair in pairs for body in pair.meshes if body is not None]
    n_points = [2 * pair.compliance.interface.x.size for pair in pairs]
    held = BYTES_PER_INTERFACE_PAIR * sum(count**2 for count in n_points)
    return PROGRAM_BYTES + CONDENSING_BYTES_PER_NODE * max(n_nodes) + held


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
        error = earlier.error / PASS_ERROR_RATIO
        if error > measure.error and np.isfinite(error):
            parts = measure.parts
            if parts is not None and earlier.parts is not None:
                parts = {axis: one / PASS_ERROR_RATIO for axis, one in earlier.parts.items()}
            bounded[name] = replace(measure, error=error, parts=parts)
    return bounded


def is_main(name: str) -> bool:
    """Return whether a measure is one of those for whose sake a run is refined; warnings are about all measures."""
    row = PATCH_TABLE.get(name) or run_measures.rows.MOTION_TABLE.get(name)
    return row is not None and row.has("main")


def _refine_steps(model: Model, result) -> Model | None:
    """Return the model of a bench with twice the steps per cycle of a result; None if there are too many."""
    steps = result.settings.steps_per_cycle
    if 2 * steps > MAX_REFINED_BENCH_STEPS:
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
    """Return whether a run may halve the mesh of a patch: not one of the scene, or the cells of a face."""
    return patch_model is not None and patch_model.area is None and patch_model.mesh.is_automatic
