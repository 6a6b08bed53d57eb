"""Findings of a run: measures that miss the tolerance with the advice that reduces their errors, and balances that fail.

In: the measures of a run with their errors, and its pressed interfaces. Out: `AccuracyFinding`s with their sentences.
The error of a measure is `safety * change / (ratio**order - 1)` (`convergence`). An error that is `excess` times
the allowed one therefore needs a resolution that is finer by the factor `excess ** (1 / order)`. Read
`find_missed_measures` first, then ADVICE_BY_AXIS. `mark_unbalanced` checks the equilibrium of a pressed patch, and the
energy of a bench or a march. `compute_accuracy_curve` gives the accuracy of a motion against its computing time, from the
runs of its error estimate.
"""

from collections.abc import Callable, Iterator, Mapping
from math import ceil, floor, inf, log2, log10
from typing import NamedTuple

from .. import measures as run_measures
from ..convergence import MAX_CONVERGENCE_ORDER
from ..core import Measure, Outcome
from ..formatting import format_number
from ..model.gap import longest_loaded_cell
from ..model.model import Model
from ..scene.keys.contact import MAX_AREA_CELLS
from . import refine
from .patch import case_meshes
from .refine import is_main
from .results import notes, patch_rows
from .results.interfaces import PressedFace, merge_findings
from .results.patch_rows import Measures, Values
from .results.result import AccuracyFinding, Advice, Result
from .rig import engines

# Ratio of proposed to present tolerance; a tenth gives at least one more halving of the mesh.
PROPOSED_TOLERANCE_RATIO = 0.1
# Largest number of halvings of a time step that the scene fixes; with more of them, the key is to be left out.
MAX_FIXED_STEP_HALVINGS = 4
USE_ERROR_ADVICE = "use the value with its stated error"
ELEMENT_SIZE_KEY = "contact.element_size"
STEPS_PER_CYCLE_KEY = "accuracy.steps_per_cycle"


class Missed(NamedTuple):
    """Measures that miss the tolerance, and the run or the interface to which they belong.

    Attributes
    ----------
    result : Result
        Result of the run.
    faces : tuple of PressedFace
        Pressed interfaces of the run, or the one to which the measures belong.
    model : Model
        Model of the run or of the interface.
    measures : Mapping
        All measures of the run or of the interface by name.
    excess : Mapping
        Ratio of error to allowed error [1] of each measure that misses the tolerance.
    """

    result: Result
    faces: tuple[PressedFace, ...]
    model: Model
    measures: Mapping[str, Measure]
    excess: Mapping[str, float]

    def find_names(self) -> list[str]:
        """Return the names of the measures that a warning mentions; the others are only counted.

        These are the main measures whose error is smaller than their value; if there are none, the measure with the
        largest ratio of error to allowed error.
        """
        main = [name for name in self.excess if refine.is_main(name)]
        known = [
            name for name in main if self.measures[name].error < abs(self.measures[name].value)
        ]
        return known or [max(self.excess, key=self.excess.get)]

    @property
    def worst(self) -> str:
        """Named measure with the largest ratio of error to allowed error."""
        return max(self.find_names(), key=self.excess.get)

    def is_limited(self, axis: str) -> bool:
        """Return whether a limit of time or memory ended the refinement along an axis, such as "mesh" or "steps"."""
        shortage = self.result.shortage
        return shortage is not None and shortage.axis == axis

    def make_finding(self, advice: Advice) -> AccuracyFinding:
        """Return the finding on these measures: errors, tolerance and advice."""
        first, *others = self.find_names()
        words = f"{first} has an estimated error of {_format_error(self.measures[first])}"
        words += "".join(f", {name} of {_format_error(self.measures[name])}" for name in others)
        words += f"; the tolerance is {self.model.accuracy.tolerance:g}"
        count = len(self.excess) - 1 - len(others)
        if count:
            words += f" ({count} other measure{'s' * (count > 1)} also exceed{'s' * (count < 2)} the tolerance)"
        return AccuracyFinding(words, advice)


def find_missed_measures(result: Result, faces: tuple[PressedFace, ...]) -> list[AccuracyFinding]:
    """Return a finding on the static measures of each interface that miss the tolerance, and one on those of the motion.

    Parameters
    ----------
    result : Result
        Result of the run.
    faces : tuple of PressedFace
        Pressed interfaces of the run.
    """
    model = result.plan.model
    measures = result.measures
    excess = {}
    for name, measure in measures.items():
        # `notes.LAW_WARNINGS` has a larger work check, with its remedy.
        is_warned_of = name == "work_check" and (measure.value or 0.0) > notes.MAX_WORK_CHECK
        ratio = min(measure.error_ratio(model.accuracy.tolerance), refine.MAX_ERROR_EXCESS)
        if ratio > 1 and not is_warned_of:
            excess[name] = ratio

    def find_on_face(face: PressedFace) -> list[AccuracyFinding]:
        """Return the findings on the static measures of one interface, and remove these measures from `excess`.

        The result numbers the measures of all interfaces after the first one (`PressedFace.name_measure`), but the sentences
        on one interface do not.
        """
        numbered = {name: face.name_measure(name) for name in patch_rows.PATCH_TABLE}
        own = {name: measures[full] for name, full in numbered.items() if full in measures}
        missed = {name: excess.pop(full) for name, full in numbered.items() if full in excess}
        if not missed:
            return []
        return _find_static(Missed(result, (face,), face.model, own, missed))

    findings = merge_findings(model, faces, find_on_face)
    if excess:
        motion = Missed(result, faces, model, measures, excess)
        findings.append(motion.make_finding(_advise_on_motion(motion)))
    return findings


def _format_error(measure) -> str:
    """Format the error of a Measure relative to its value, or say that it is at least as large."""
    if abs(measure.error) < abs(measure.value):
        return f"{abs(measure.error / measure.value):.2g} of its value"
    return f"at least its value ({measure})"


def _find_static(missed: Missed) -> list[AccuracyFinding]:
    """Return the findings on the static measures of one interface: their advice, and that to split its profile.

    The waves of a profile that the mesh does not resolve can be represented by a layer of asperities instead.
    """
    from .patch import trace_split

    (face,) = missed.faces
    findings = [missed.make_finding(_advise_on_statics(missed, face))]
    if face.model.patch.gap.profile is None:
        return findings
    if face.patch.points is None or missed.model.moves:
        element = longest_loaded_cell(face.patch.x, face.patch.active)
        findings += map(AccuracyFinding, trace_split.advise_split(face.model.patch, element))
    return findings


def _advise_on_statics(missed: Missed, face: PressedFace) -> Advice:
    """Return the advice for inaccurate static measures: a finer mesh, if it helps."""
    patch_model = face.model.patch
    peak = missed.measures.get("pressure_peak")
    if missed.worst == "worn_depth_max" and peak is not None and peak.value is None:
        return Advice(f"the depth at a sharp edge grows on finer meshes; {USE_ERROR_ADVICE}")
    # On a prescribed mesh, a value of zero may only show that the mesh is too coarse.
    if max(missed.excess.values()) >= refine.MAX_ERROR_EXCESS and patch_model.mesh.is_automatic:
        return Advice(USE_ERROR_ADVICE)

    # The refinement of the meshes ends when all measures that control it meet the tolerance, or at
    # its limit.
    is_at_limit = missed.excess.keys() <= set(patch_rows.MESH_MEASURES)
    name = "mesh of the pressed pieces" if missed.model.moves else "mesh"
    solved = [(patch_model, face.unworn or face.patches)]
    advice = _advise_mesh(missed, solved, name, is_at_limit=is_at_limit)
    return advice._replace(axis="mesh")


def _advise_mesh(
    missed: Missed, solved, name: str = "mesh of the motion", *, is_at_limit: bool = False
) -> Advice:
    """Return the advice to refine the meshes of one or more interfaces.

    Parameters
    ----------
    missed : Missed
        Measures of the run that miss the tolerance.
    solved : list
        Pairs of a PatchModel and its patches, from fine to coarse.
    name : str
        Name of the mesh: static measures and motion may use different meshes.
    is_at_limit : bool
        Whether the missed measures are those on which the mesh is refined.
    """
    n_nodes = max(patches[0].x.size for _, patches in solved)
    if any(patch_model.area is not None for patch_model, _ in solved):
        return _advise_cells(solved, name)
    cause = f"the {name} ({n_nodes} interface nodes) causes this error; "
    if any(patch_model.mesh.file is not None for patch_model, _ in solved):
        return Advice(f"{cause}split the elements of contact.mesh", "contact.mesh")
    if not all(patch_model.mesh.is_automatic for patch_model, _ in solved):
        return Advice(f"{cause}leave out {ELEMENT_SIZE_KEY}", ELEMENT_SIZE_KEY)
    if missed.is_limited("mesh"):
        return _advise_limit(missed, "finer meshes", cause)
    # The main measures have decided on the mesh; another measure needs a smaller tolerance.
    tolerance = PROPOSED_TOLERANCE_RATIO * missed.model.accuracy.tolerance
    is_at_limit = is_at_limit or refine.is_main(missed.worst)
    if is_at_limit or not any(case_meshes.needs_finer_mesh(*place, tolerance) for place in solved):
        return Advice(
            f"{cause}a finer mesh does not reduce it or is too expensive; {USE_ERROR_ADVICE}"
        )
    text = f"{cause}set accuracy.tolerance = {tolerance:.3g} for a finer mesh"
    return Advice(text, "accuracy.tolerance", tolerance)


def _advise_cells(solved, name: str) -> Advice:
    """Return the advice to use more cells over a face.

    `solved` are pairs of a PatchModel and its patches, from fine to coarse, and `name` is that of the mesh.
    """
    n_cells = max(patches[0].shape for _, patches in solved)
    longer = max(n_cells)
    cause = f"the {name} ({n_cells[1]} x {n_cells[0]} cells) causes this error; "
    if 2 * longer > MAX_AREA_CELLS:
        return Advice(f"{cause}{USE_ERROR_ADVICE}")
    return Advice(f"{cause}set contact.area.cells = {2 * longer}", "contact.area.cells", 2 * longer)


def _advise_limit(missed: Missed, purpose: str, cause: str = "") -> Advice:
    """Return the advice to raise the limit that ended the refinement to what a finer run needs.

    `purpose` says what the time or memory is for, such as "smaller time steps". `cause` is a clause at the beginning of the
    advice.
    """
    # The proposed limit has two significant digits.
    shortage = missed.result.shortage
    # Ratio of a proposed limit to the expected CPU time, which varies by tens of per cent, or to
    # the expected memory.
    needed = 2.0 * shortage.needed
    unit = 10.0 ** (floor(log10(needed)) - 1)
    limit = unit * ceil(needed / unit)
    value = format_number(limit, 2)
    if shortage.key == "accuracy.max_memory":
        value = f'"{format_number(limit / 1e9, 2)} GB"'
    return Advice(f"{cause}set {shortage.key} = {value} for {purpose}", shortage.key, limit)


def _advise_on_motion(missed: Missed) -> Advice:
    """Return the advice that reduces the error of the least accurate main measure of a motion.

    The advice depends on the largest contribution to the error. A larger tolerance is never
    advised, because it would lead to coarser steps and meshes.
    """
    name = missed.worst
    axis = refine.find_axis(missed.measures[name], name)
    if axis != "mesh" and missed.is_limited(axis):
        return _advise_limit(missed, "smaller time steps")._replace(axis=axis)
    advise = ADVICE_BY_AXIS.get(axis)
    advice = None if advise is None else advise(missed)
    if advice is not None:
        return advice._replace(axis=axis)
    if name == run_measures.rows.STEADY_AMPLITUDE:  # In a longer run the transient decays further.
        text = "more drive cycles make this value more accurate; raise drive.cycles"
        return Advice(text, "drive.cycles")
    return Advice(USE_ERROR_ADVICE)


def _advise_steps(missed: Missed) -> Advice | None:
    """Return the advice that reduces the error of the time steps; None for an engine without equal steps.

    The error falls with the square of the step. If the scene fixes the engine or the steps of a rig, and they are far
    too few, or so few that the error is as large as the value, the advice is to leave out these keys; otherwise it is a
    larger number of steps per cycle.
    """
    steps = missed.result.settings.steps_per_cycle
    if steps is None:
        return None
    halvings = ceil(log2(missed.excess[missed.worst]) / MAX_CONVERGENCE_ORDER)

    # A rig doubles its steps while this reduces the errors, or needs none from event to event, unless the scene fixes them.
    model = missed.model
    fixed = ["method"] * (
        model.accuracy.method != "auto" and not engines.EVENT_DRIVEN.find_unsupported_feature(model)
    )
    if model.accuracy.steps_per_cycle is not None:
        fixed.append("steps_per_cycle")
    worst = missed.measures[missed.worst]
    is_unresolved = halvings > MAX_FIXED_STEP_HALVINGS or worst.error >= abs(worst.value)
    if model.rig is not None and model.friction is not None and fixed and is_unresolved:
        keys = " and ".join(f"accuracy.{key}" for key in fixed)
        return Advice(f"leave out {keys}; the steps then follow from the tolerance", keys)
    return Advice.set_key(
        STEPS_PER_CYCLE_KEY, steps * 2 ** min(halvings, notes.MAX_PROPOSED_HALVINGS)
    )


def _advise_motion_mesh(missed: Missed) -> Advice | None:
    """Return the advice to refine the meshes on which the motion depends; None if there are none.

    These are the meshes of the interfaces whose motion follows from the pressure at each place, or that of the only patch.
    """
    solved = [
        (face.model.patch, face.unworn or face.patches)
        for face in missed.faces
        if face.depends_on_pressure or missed.model.patch is not None
    ]
    return _advise_mesh(missed, solved) if solved else None


def _advise_reduced_modes(missed: Missed) -> Advice:
    """Return the advice to keep more modes of a reduced structure; the error falls with the square of their number."""
    ratio = min(max(2.0, missed.excess[missed.worst] ** 0.5), 16.0)
    rig = missed.model.rig
    n_modes = min(ceil(rig.modes.omega.size * ratio), rig.structure.max_modes)
    return Advice.set_key("structure.reduced.modes", n_modes)


def _advise_shear_modes(missed: Missed) -> Advice | None:
    """Return the advice to use more shear modes of the pieces; None if there are no more."""
    n_modes = missed.result.settings.shear_modes
    n_nodes = missed.faces[0].patch.x.size
    if n_modes >= n_nodes:
        return None
    return Advice.set_key("accuracy.shear_modes", min(4 * n_modes, n_nodes))


def _advise_bond_sum(missed: Missed) -> Advice:
    """Return the advice to refine the sum over bonds."""
    accuracy = missed.model.accuracy
    fixed = [f"accuracy.{key}" for key in ("tail", "merge") if getattr(accuracy, key) is not None]
    if fixed:
        return Advice(" and ".join(f"leave out {key}" for key in fixed), fixed[0])
    proposed = PROPOSED_TOLERANCE_RATIO * accuracy.tolerance
    text = f"set accuracy.tolerance = {proposed:.3g} to refine the sum over bonds"
    return Advice(text, "accuracy.tolerance", proposed)


# Advice on a measure of a motion by the axis with the largest share of its error; None: the axis is at its limit.
ADVICE_BY_AXIS: dict[str, Callable[[Missed], Advice | None]] = {
    "steps": _advise_steps,
    "mesh": _advise_motion_mesh,
    "reduced": _advise_reduced_modes,
    "modes": _advise_shear_modes,
    "bonds": _advise_bond_sum,
}


# ---- balances

# Largest difference of the integral of the pressure from the load, relative to the load; the contact solver reaches 1e-9.
LOAD_BALANCE_TOL = 1e-6
# Largest energy that is missing or was created in a bench, relative to the exchanged energy. All terms are integrated by
# the same rule, so that this residual falls with the number of steps. A hundredth is the usual tolerance of a bench.
MAX_BENCH_ENERGY_RESIDUAL = 0.01
# The same in a run with equal time steps, where the residual is round-off; a billion steps have less.
MAX_MARCH_ENERGY_RESIDUAL = 1e-8


def mark_unbalanced(result: Result) -> Result:
    """Return the Result, marked as `not_converged` with a warning for each balance that does not hold.

    Its measures then lose their errors and keep their values.
    """
    if result.outcome is Outcome.NOT_CONVERGED:
        return result
    warnings = [*_check_load(result), *_check_energy(result)]
    if not warnings:
        return result
    return result.with_changes(
        outcome=Outcome.NOT_CONVERGED,
        measures=run_measures.outcome.remove_errors(result.measures),
        warnings=[*warnings, *result.warnings],
    )


def _check_load(result: Result) -> Iterator[str]:
    """Yield a warning if the integral of the pressure over the interface differs from the load of the scene.

    Both are in [N], and LOAD_BALANCE_TOL is the largest difference relative to the load. A load that varies has no single
    integral, and is not checked.
    """
    model = result.plan.model
    patch = result.patch
    if patch is None or model.load_varies or not model.patch.loading.load:
        return
    if Outcome.NO_CONTACT in (patch.pressure.outcome, result.outcome):
        return
    load = model.patch.loading.load
    total = float(patch.pressure.sigma_n @ patch.pieces.interface.weight)
    if abs(total - load) > LOAD_BALANCE_TOL * load:
        yield (
            f"equilibrium: the integral of the normal stress is {total:.6g} N, but the load is {load:.6g} N; they differ "
            f"by {abs(total - load) / load:.2g} of the load (limit {LOAD_BALANCE_TOL:g}); do not use this result, and "
            "report it with the scene and what `patchfem doctor` prints"
        )


def _check_energy(result: Result) -> Iterator[str]:
    """Yield a warning if energy is missing or was created in a bench or in a run with equal time steps.

    The measure `energy_balance` is |work - change of the stored energy - dissipated energy|, divided by the exchanged
    and the largest stored energy [1]. In the other engines it is no check, because it enters the errors of the
    measures.
    """
    residual = result.measures.get("energy_balance")
    if residual is None or residual.value is None:
        return
    limit = MAX_BENCH_ENERGY_RESIDUAL
    if result.plan.model.rig is not None:
        limit = MAX_MARCH_ENERGY_RESIDUAL if result.settings.steps_per_cycle else inf
    if abs(residual.value) > limit:
        yield (
            f"energy balance: {abs(residual.value):.2g} of the exchanged energy is missing or was created (limit "
            f"{limit:g}); do not use this result, and report it with the scene and what `patchfem doctor` prints"
        )


# ---- accuracy against computing time


class StepSetting(NamedTuple):
    """Number of time steps with the CPU time and the accuracy of the motion.

    - steps: steps per cycle.
    - seconds: CPU seconds of the motion: the steps times the smallest time per step of all runs.
    - error: largest ratio of the error of a main measure to its size [1]. It is the smallest value of
      `accuracy.tolerance` that these steps meet.
    """

    steps: int
    seconds: float
    error: float


def compute_accuracy_curve(result) -> list[StepSetting]:
    """Compute the accuracy of a motion as a function of its CPU time, from few steps to many.

    The error of a coarser run is its difference from the run plus the error of the run.

    Parameters
    ----------
    result : Result
        Result of the motion, with `motion.step_runs`.

    Returns
    -------
    list of StepSetting
        [] if there is no run with fewer steps, if no error exceeds round-off, or if the steps do not limit the accuracy.
    """
    step_runs = result.motion.step_runs
    if len(step_runs) < 2:
        return []
    measures = _select_measures(result.measures, step_runs)
    if not measures:
        return []
    present_run, *coarser_runs = step_runs
    tolerance = result.plan.model.accuracy.tolerance

    # The first run also loads compiled code, so that the smallest time per step is used.
    step_seconds = min(run.seconds / run.steps for run in step_runs)

    def make_setting(steps: int, errors: Values) -> StepSetting:
        """Return the StepSetting with the largest of the errors of all measures by name."""
        fractions = [0.0]
        for name, measure in measures.items():
            size = abs(measure.value) + measure.floor / tolerance
            fractions.append(float(errors[name] / size) if size else 0.0)
        return StepSetting(steps, steps * step_seconds, max(fractions))

    errors = {name: measure.error for name, measure in measures.items()}
    settings = [make_setting(present_run.steps, errors)]
    present = settings[0].error
    distances = errors
    for run in coarser_runs:
        change = run_measures.errors.compute_absolute_changes(present_run.values, run.values)
        # A coarse run that is accurate by chance gets the error of the finer one.
        distances = {name: max(change[name] + errors[name], distances[name]) for name in measures}
        settings.insert(0, make_setting(run.steps, distances))
    # Smallest ratio of the errors with finer and coarser steps at which the steps do not matter
    has_effect = settings[0].error * 0.9 >= present
    # Largest relative error that counts as round-off in long sums
    return settings if has_effect and present >= 1e-9 else []


def _select_measures(measures: Measures, step_runs) -> Measures:
    """Return the main measures that have errors and occur in all runs; else all such measures."""
    common = {}
    for name, measure in measures.items():
        is_known = None not in (measure.value, measure.error)
        is_in_all_runs = all(name in run.values for run in step_runs)
        if is_known and is_in_all_runs and name not in run_measures.errors.ERROR_MEASURES:
            common[name] = measure
    main = {name: measure for name, measure in common.items() if is_main(name)}
    return main or common
