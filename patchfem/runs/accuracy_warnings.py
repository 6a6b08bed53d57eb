"""Warnings about measures that miss the tolerance, with the setting to change.

In: an `AccuracyContext`, i.e. the measures of a run with their error estimates. Out: sentences. The
error of a measure is `safety * change / (ratio**order - 1)` (`response.errors`). An error that is
`excess` times the allowed one therefore needs a resolution that is finer by the factor `excess **
(1 / order)`. Read `tolerance_warnings` first, then `_advise_on_motion`.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import ceil, floor, log2, log10, pi
from types import MappingProxyType
from typing import NamedTuple

from ..effects import law_has_trait
from ..formatting import format_number
from ..model.gap import longest_loaded_cell
from ..response import rows
from . import refine
from .patch import faces, mesh_levels, press
from .results import notes, patch_rows
from .rig import costs, engines

# Upper bound of the ratio of error to allowed error; a larger ratio indicates a value of zero.
MAX_EXCESS = 1e9
# Ratio of proposed to present tolerance; a tenth gives at least one more halving of the mesh.
PROPOSED_TOLERANCE_RATIO = 0.1
# Largest number of halvings of the time step to which the observed order is extrapolated.
MAX_HALVINGS = 4
# Fraction of the allowed error that the time steps may have if the other causes alone exceed it.
MIN_STEP_ERROR_FRACTION = 0.2
# Largest number of strips that is proposed; four times as many strips take about twenty times as
# long.
MAX_STRIPS = 64
# Measures whose error is of first order in the width of the strips.
FIRST_ORDER_MEASURES = (
    "pressure_peak",
    "loaded_fraction",
)
# Measures from samples, whose error does not depend on the number of harmonics.
SAMPLED_MEASURES = (
    "stick_fraction",
    "slip_start_phase",
)
# Prefix of the measures of ringing, which engines without steps may not compute.
RINGING_PREFIX = "ring_"
STEADY_AMPLITUDE = "relative_displacement_amplitude_steady"
USE_ERROR_ADVICE = "use the value with its stated error"
NO_ADVICE = f"no known setting makes this value more accurate; {USE_ERROR_ADVICE}"
ELEMENT_SIZE = "contact.element_size"
# Ratio of the proposed accuracy.max_seconds to the expected CPU time, which varies by tens of per cent.
MAX_SECONDS_MARGIN = 2.0


class AccuracyContext(NamedTuple):
    """Measures and settings of a run from which the accuracy warnings are derived.

    Attributes
    ----------
    model : Model
    measures : dict
        Measure by name.
    patch : Patch, optional
    extra : Mapping
        As in `Result.extra`.
    unworn : tuple
        The patch before wear on its nested meshes, from fine to coarse; () if the patch is not
        worn.
    next_seconds : float
        CPU time [s] of all passes that would meet the tolerance, if it exceeds accuracy.max_seconds; else 0.
    """

    model: object
    measures: dict
    patch: object = None
    extra: Mapping = MappingProxyType({})
    unworn: tuple = ()
    next_seconds: float = 0.0


def tolerance_warnings(context: AccuracyContext, coarse=(), static_patches=()) -> list[str]:
    """Return warnings on all measures of a run whose errors exceed the tolerance.

    Parameters
    ----------
    context : AccuracyContext
    coarse : sequence of Patch
        The patch on coarser meshes, if available.
    static_patches : sequence of Patch
        The patch on the meshes of its static measures, from fine to coarse, if these are other
        meshes.
    """
    model = context.model
    tolerance = model.accuracy.tolerance
    excess = {}
    for name, measure in context.measures.items():
        if name == "work_check" and (measure.value or 0.0) > notes.MAX_WORK_CHECK:
            continue  # `notes.warn_of_work_check` warns of it, with its remedy
        ratio = min(measure.error_ratio(tolerance), MAX_EXCESS)
        if ratio > 1:
            excess[name] = ratio
    has_faces = context.patch is None and model.has_interface_patches
    static_names = ()
    if has_faces:
        static_names = faces.static_measures(model)
    elif context.patch is not None:
        static_names = patch_rows.TABLE
    static = {name: ratio for name, ratio in excess.items() if name in static_names}
    moving = {name: ratio for name, ratio in excess.items() if name not in static_names}
    warnings = []
    if has_faces:

        def warn_of_face(face) -> list:
            """Return the accuracy warnings on the patch of one interface."""
            return tolerance_warnings(_select_interface_measures(context, face), face.patches[1:])

        warnings = faces.merge_interface_sentences(model, warn_of_face)
    elif static:
        at_rest = context
        meshes = coarse
        if static_patches:
            at_rest = context._replace(
                model=replace(model, patch=model.patch.with_mesh(is_static=True, slip=None)),
                patch=static_patches[0],
            )
            meshes = static_patches[1:] or coarse
        warnings = [_format_warning(context, static, _advise_on_statics(at_rest, static, meshes))]
        if (
            isinstance(context.patch, press.Patch)
            and model.patch.gap.profile is not None
            and (context.patch.points is None or model.kind != "patch")
        ):
            from .patch import trace_split

            element = longest_loaded_cell(at_rest.patch.x, at_rest.patch.active)
            warnings += trace_split.advise_split(model.patch, element)
    if moving:
        warnings.append(
            _format_warning(context, moving, _advise_on_motion(context, moving, coarse))
        )
    return warnings


def _select_interface_measures(context: AccuracyContext, face) -> AccuracyContext:
    """Select the static measures of one interface, and remove its number from their names."""
    measures = {}
    for name in patch_rows.TABLE:
        numbered = rows.add_interface_number(name, face.number)
        if context.measures.get(numbered) is not None:
            measures[name] = context.measures[numbered]
    return AccuracyContext(face.model, measures, face.patch, next_seconds=context.next_seconds)


def _select_named_measures(context: AccuracyContext, excess: dict) -> list[str]:
    """Select the inaccurate measures that an accuracy warning names.

    These are the main measures whose error is smaller than their value; if there are none, the
    measure with the largest ratio of error to allowed error.
    """
    known = context.measures
    main = [name for name in excess if refine.is_main(name)]
    main = [name for name in main if known[name].error < abs(known[name].value)]
    others = [name for name in excess if not name.startswith(RINGING_PREFIX)] or excess
    return main or [max(others, key=excess.get)]


def _format_warning(context: AccuracyContext, excess: dict, advice: str) -> str:
    """Format an accuracy warning with errors, tolerance and advice."""
    names = _select_named_measures(context, excess)
    first, *more = (f"of {_format_error(context.measures[name])}" for name in names)
    listed = "".join(f", {name} {words}" for name, words in zip(names[1:], more, strict=True))
    count = len(excess) - len(names)
    others = ""
    if count:
        others = f" ({count} other measure{'s' * (count > 1)} also exceed{'s' * (count < 2)} the tolerance)"
    tolerance = context.model.accuracy.tolerance
    return f"{names[0]} has an estimated error {first}{listed}; the tolerance is {tolerance:g}{others}; {advice}"


def _format_error(measure) -> str:
    """Format the relative error of a measure."""
    if abs(measure.error) < abs(measure.value):
        return f"{abs(measure.error / measure.value):.2g} of its value"
    return f"at least its value ({measure})"


def _advise_on_statics(context: AccuracyContext, excess: dict, coarse) -> str:
    """Return the advice for inaccurate static measures: more strips or a finer mesh."""
    patch_model = context.model.patch
    peak = context.measures.get("pressure_peak")
    is_wear_unbounded = (
        "worn_depth_max" in _select_named_measures(context, excess)
        and peak is not None
        and peak.value is None
    )
    # On a prescribed mesh, a value of zero may only show that the mesh is too coarse.
    is_zero = max(excess.values()) >= MAX_EXCESS and patch_model.mesh.is_automatic
    if is_wear_unbounded or is_zero:
        return NO_ADVICE
    if (
        patch_model.mesh.file is None
        and patch_model.interface.strips is not None
        and patch_model.interface.strips.count > 1
    ):
        return _advise_strips(patch_model, excess)
    # The refinement of the meshes ends when all measures that control it meet the tolerance, or at
    # its limit.
    return _advise_mesh(
        context.model,
        [(context, coarse)],
        is_at_limit=excess.keys() <= set(patch_rows.MESH_MEASURES),
        mesh_name="mesh" if context.model.kind == "patch" else "mesh of the pressed pieces",
    )


def _advise_strips(patch_model, excess: dict) -> str:
    """Return the advice to use as many strips as the tolerance requires.

    The pressure peak of the outermost strip is computed at its centre, so that its error is of
    first order in the width of the strip. The errors of all other measures are of second order.
    """
    orders = [1 if name in FIRST_ORDER_MEASURES else 2 for name in excess]
    ratio = max(times ** (1 / order) for times, order in zip(excess.values(), orders))
    count = ceil(patch_model.interface.strips.count * ratio)
    if count > MAX_STRIPS:
        return NO_ADVICE
    return f"set contact.strips.count = {count}" + (
        "" if patch_model.mesh.is_automatic else f" and leave out {ELEMENT_SIZE}"
    )


def _advise_mesh(
    model, solutions: list, *, is_at_limit: bool = False, mesh_name: str = "mesh of the motion"
) -> str:
    """Return the advice to refine the meshes of one or more patches.

    Parameters
    ----------
    model : Model
    solutions : list
        Pairs of an AccuracyContext and the coarser patches.
    is_at_limit : bool
        Whether the mesh cannot be refined further.
    mesh_name : str
        Name of the mesh_name: static measures and motion may use different meshes.
    """
    patch_models = [context.model.patch for context, _ in solutions]
    n_nodes = max(context.patch.x.size for context, _ in solutions)
    cause = f"the {mesh_name} ({n_nodes} interface nodes) causes this error"
    if any(patch.mesh.file is not None for patch in patch_models):
        return faces.replace_contact_keys(model, f"{cause}; split the elements of contact.mesh")
    if not all(patch.mesh.is_automatic for patch in patch_models):
        return faces.replace_contact_keys(model, f"{cause}; leave out {ELEMENT_SIZE}")
    next_seconds = max(context.next_seconds for context, _ in solutions)
    if next_seconds:
        limit = format_number(_round_up(MAX_SECONDS_MARGIN * next_seconds), 2)
        return f"{cause}; set accuracy.max_seconds = {limit} for finer meshes"
    tolerances = [] if is_at_limit else [_tolerance_for_finer_mesh(*place) for place in solutions]
    tolerances = [tolerance for tolerance in tolerances if tolerance is not None]
    if tolerances:
        return f"{cause}; set accuracy.tolerance = {min(tolerances):.3g} for a finer mesh"
    patches = [context.patch for context, _ in solutions if isinstance(context.patch, press.Patch)]
    seconds = max(map(mesh_levels.predict_next_mesh_seconds, patches), default=0.0)
    limit = mesh_levels.max_condensing_seconds(patch_models[0])
    if seconds > limit and not patch_models[0].mesh.n_finer:
        cause += (
            f"; the next mesh would take about {format_number(seconds, 2)} CPU s, and at most {limit:g} CPU s are spent "
            "on a mesh of this scene"
        )
    return f"{cause}; no accuracy.tolerance leads to a finer mesh; {USE_ERROR_ADVICE}"


def _round_up(value: float) -> float:
    """Return a value rounded up to two significant digits."""
    unit = 10.0 ** (floor(log10(value)) - 1)
    return unit * ceil(value / unit)


def _tolerance_for_finer_mesh(context: AccuracyContext, coarse) -> float | None:
    """Return the tolerance at which a patch would get a finer mesh; None if there is none.

    If the coarser meshes are not available, it is the tolerance for one more halving.
    """
    patch_model = context.model.patch
    tolerance = context.model.accuracy.tolerance
    if patch_model.mesh.shared is not None and isinstance(context.patch, press.Patch):
        if mesh_levels.predict_next_mesh_seconds(
            context.patch
        ) > mesh_levels.max_condensing_seconds(patch_model):
            return None
    if not any(coarse) or patch_model.mesh.shared is not None:
        return PROPOSED_TOLERANCE_RATIO * tolerance
    return mesh_levels.tolerance_for_finer_mesh(
        patch_model,
        context.unworn or [context.patch, *coarse],
        patch_model.mesh.tolerance or tolerance,
    )


def _advise_on_motion(context: AccuracyContext, excess: dict, coarse) -> str:
    """Return the advice that reduces the error of the least accurate main measure of a motion.

    The advice depends on the largest contribution to the error. A larger tolerance is never
    advised, because it would lead to coarser steps and meshes.
    """
    model = context.model
    extra = context.extra
    name = max(_select_named_measures(context, excess), key=excess.get)
    steps = extra.get("steps_per_cycle") or extra.get("steps")
    cause = _find_main_error_kind(context, name)
    if cause == "steps" and steps is not None:
        return _advise_steps(context, name, excess, int(steps))
    if cause == "end":
        return _advise_end(extra["cycles"], int(steps))
    if cause == "mesh" and context.patch is not None:
        return _advise_mesh(model, [(context, coarse)])
    if cause == "mesh":
        solutions = []
        for face in faces.solve_interface_patches(model):
            if face.partial_slip:
                face_context = _select_interface_measures(context, face)
                solutions.append((face_context, face.patches[1:]))
        return _advise_mesh(model, solutions)
    # The error falls with the square of the number of modes of a reduced structure.
    if cause == "reduced":
        ratio = min(max(2.0, excess[name] ** 0.5), 16.0)
        n_modes = ceil(model.rig.modes.omega.size * ratio)
        return f"set structure.reduced.modes = {min(n_modes, model.rig.structure.max_modes)}"
    if cause == "modes" and extra["shear_modes"] < context.patch.x.size:
        return f"set accuracy.shear_modes = {min(4 * extra['shear_modes'], context.patch.x.size)}"
    if cause == "bonds":
        fixed_keys = [key for key in ("tail", "merge") if getattr(model.accuracy, key) is not None]
        if fixed_keys:
            return " and ".join(f"leave out accuracy.{key}" for key in fixed_keys)
        proposed = PROPOSED_TOLERANCE_RATIO * model.accuracy.tolerance
        return f"set accuracy.tolerance = {proposed:.3g} to refine the sum over bonds"
    if name == STEADY_AMPLITUDE:  # In a longer run the transient decays further.
        return "more drive cycles make this value more accurate; raise drive.cycles"
    if extra.get("harmonics") is None or name.startswith(SAMPLED_MEASURES):
        return NO_ADVICE
    return notes.advise_harmonics(extra["harmonics"], _count_friction_harmonics(context))


def _find_main_error_kind(context: AccuracyContext, name: str) -> str:
    """Return the kind of discretization, such as "mesh", with the largest error contribution."""
    causes = context.measures[name].causes
    if causes is not None:
        kind = max(causes.parts, key=causes.parts.get, default="own")
        return kind if causes.parts.get(kind, 0.0) > 0 else "own"
    # A batch reports neither error contributions nor settings of a patch with partial slip.
    return "mesh" if context.patch is not None and not context.extra else "own"


def _advise_steps(context: AccuracyContext, name: str, excess: dict, steps: int) -> str:
    """Return the advice to use as many steps per cycle as the order of convergence requires."""
    model = context.model
    parts, order = context.measures[name].causes
    exact = ""
    if (
        model.kind == "rig"
        and (model.accuracy.method == "march" or model.accuracy.steps_per_cycle is not None)
        and not engines.HYBRID.find_unsupported_feature(model)
    ):
        keys = [
            key for key in ("method", "steps_per_cycle") if key in model.accuracy.model_fields_set
        ]
        exact = f"leave out {' and '.join(f'accuracy.{key}' for key in keys)}; the steps then follow from the tolerance"
    if order is None:
        return f"{_describe_missing_order(name, steps)}{_advise_without_order(model, steps, exact)}"
    total = sum(parts.values())
    allowed = total / excess[name]
    target = max(allowed - (total - parts["steps"]), MIN_STEP_ERROR_FRACTION * allowed)
    halvings = max(1, ceil(log2(parts["steps"] / target) / order))
    if exact and halvings > MAX_HALVINGS and not name.startswith(RINGING_PREFIX):
        return exact
    return (
        f"set accuracy.steps_per_cycle = {steps * 2 ** min(halvings, notes.MAX_PROPOSED_HALVINGS)}"
    )


def _describe_missing_order(name: str, steps: int) -> str:
    """Return a clause saying that a measure shows no order of convergence with the steps."""
    return (
        f"the results with {steps // 4}, {steps // 2} and {steps} steps per cycle show no order of convergence of "
        f"{name}"
    )


def _advise_without_order(model, steps: int, exact: str) -> str:
    """Return the advice for a run whose measures show no order of convergence with the steps.

    If the scene does not prescribe the steps, they are doubled until the measures meet the tolerance.
    """
    if exact:
        return f"; {exact}"
    are_steps_fixed = model.kind == "rig" and model.accuracy.steps_per_cycle is not None
    if are_steps_fixed and 2 * steps <= costs.MAX_MARCH_STEPS:
        return (
            "; leave out accuracy.steps_per_cycle, so that patchfem doubles the number of steps "
            "while this reduces the errors"
        )
    if 2 * steps <= costs.MAX_MARCH_STEPS:
        return (
            f", so the effect of more steps is not known; try accuracy.steps_per_cycle = {2 * steps}, or "
            f"{USE_ERROR_ADVICE}"
        )
    return f", so more steps may not help; {USE_ERROR_ADVICE}"


def _advise_end(cycles: float, steps: int) -> str:
    """Return the advice on steps per cycle with which the run ends exactly at a sample.

    At most twice as many steps are proposed, in multiples of four, so that coarser runs with half
    and a quarter of them exist.
    """
    counts = range(4 * ceil(steps / 4), 2 * steps + 4, 4)
    best = min(counts, key=lambda count: abs(cycles * count - round(cycles * count)))
    return (
        f"the run ends between two samples; set accuracy.steps_per_cycle = {best}, so that a sample lies closer to "
        "the end of the run"
    )


def _count_friction_harmonics(context: AccuracyContext) -> float:
    """Return the number of harmonics that a velocity-dependent friction force needs.

    It is the largest slip velocity divided by the reference speed of the law; 0 for other laws.
    """
    law = context.model.friction
    slip = context.measures.get("slip_amplitude")
    if law is None or slip is None or not law_has_trait(law.law, "creeps"):
        return 0.0
    return 2 * pi / context.extra["period"] * slip.value / law.reference_speed
