"""Warnings about measures whose error exceeds the tolerance, with the setting that helps.

In: a `Finding`, i.e. the measures of a run with their errors. Out: sentences. The error of a
measure is `safety * change / (ratio**order - 1)` (`response.errors`). An error that is `excess`
times the allowed one therefore needs a resolution that is `excess ** (1 / order)` times as
fine. Read `tolerance_warnings` first, then `_motion_remedy`.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import ceil, log2, pi
from types import MappingProxyType
from typing import NamedTuple

from ..effects import law_has_trait
from ..formatting import format_number
from ..model.gap import longest_loaded_cell
from ..response import rows
from .patch import faces, mesh_levels, press
from .results import notes, patch_rows
from .rig import costs, engines

# Cap on the ratio of error to allowed error; a larger ratio indicates a value of zero.
MAX_EXCESS = 1e9
# ratio of proposed to present tolerance; a tenth gives at least one more halving of the mesh
PROPOSED_TOLERANCE_RATIO = 0.1
# largest number of halvings of the steps to which the order observed over two halvings is extrapolated
MAX_HALVINGS = 4
# fraction of the allowed error that the steps may have if other causes use up all of it
MIN_STEP_ERROR_FRACTION = 0.2
# largest number of strips that is proposed; four times the strips take about twenty times as long
MAX_STRIPS = 64
# measures whose error falls with the first power of the number of strips
FIRST_ORDER_MEASURES = (
    "pressure_peak",
    "loaded_fraction",
)
# measures from samples, which more harmonics do not make more accurate
SAMPLED_MEASURES = (
    "stick_fraction",
    "slip_start_phase",
)
# Prefix of the measures of ringing, which an engine without steps may lack.
RINGING_PREFIX = "ring_"
STEADY_AMPLITUDE = "relative_displacement_amplitude_steady"
USE_ERROR_ADVICE = "use the value with its stated error"
NO_REMEDY = f"no known setting makes this value more accurate; {USE_ERROR_ADVICE}"
ELEMENT_SIZE = "contact.element_size"
# main measures of a run, which an accuracy warning names first
MAIN_MEASURES = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "loop_area",
    "friction_ratio_peak",
    "pressure_peak",
    "contact_fraction",
)


class Finding(NamedTuple):
    """Measures and settings of a run on which the accuracy warnings depend.

    Attributes
    ----------
    model : Model
    measures : dict
        Measure by name.
    patch : Patch, optional
    extra : Mapping
        As in a `Result`.
    climbed : tuple
        The patch before wear on the meshes of its ladder, fine to coarse, if it chose the mesh of a
        worn patch.
    """

    model: object
    measures: dict
    patch: object = None
    extra: Mapping = MappingProxyType({})
    climbed: tuple = ()


def tolerance_warnings(finding: Finding, coarse=(), still=()) -> list[str]:
    """Return the warnings on all measures of a run whose errors exceed the tolerance.

    Parameters
    ----------
    finding : Finding
    coarse : sequence of Patch
        The patch on the coarser meshes of its ladder, if they are at hand.
    still : sequence of Patch
        The patch on the ladder of its static measures, fine to coarse, if that is another one.
    """
    model = finding.model
    tolerance = model.accuracy.tolerance
    excess = {}
    for name, measure in finding.measures.items():
        ratio = min(measure.error_ratio(tolerance), MAX_EXCESS)
        if ratio > 1:
            excess[name] = ratio
    has_faces = finding.patch is None and model.has_interface_patches
    static_names = ()
    if has_faces:
        static_names = faces.static_measures(model)
    elif finding.patch is not None:
        static_names = patch_rows.TABLE
    static = {name: ratio for name, ratio in excess.items() if name in static_names}
    moving = {name: ratio for name, ratio in excess.items() if name not in static_names}
    warnings = []
    if has_faces:

        def warn_of_face(face) -> list:
            """Return the accuracy warnings on the patch of one interface."""
            return tolerance_warnings(_select_interface_measures(finding, face), face.patches[1:])

        warnings = faces.merge_interface_sentences(model, warn_of_face)
    elif static:
        at_rest = finding
        meshes = coarse
        if still:
            at_rest = finding._replace(
                model=replace(model, patch=model.patch.with_mesh(is_static=True, slip=None)),
                patch=still[0],
            )
            meshes = still[1:] or coarse
        warnings = [_format_warning(finding, static, _static_remedy(at_rest, static, meshes))]
        if (
            isinstance(finding.patch, press.Patch)
            and model.patch.gap.profile is not None
            and (finding.patch.points is None or model.kind != "patch")
        ):
            from .patch import trace_split

            element = longest_loaded_cell(finding.patch.x, finding.patch.active)
            warnings += trace_split.advise_split(model.patch, element)
    if moving:
        warnings.append(_format_warning(finding, moving, _motion_remedy(finding, moving, coarse)))
    return warnings


def _select_interface_measures(finding: Finding, face) -> Finding:
    """Select the static measures of one interface, and drop the interface number of their names."""
    measures = {}
    for name in patch_rows.TABLE:
        numbered = rows.add_interface_number(name, face.number)
        if finding.measures.get(numbered) is not None:
            measures[name] = finding.measures[numbered]
    return Finding(face.model, measures, face.patch)


def _select_named_measures(finding: Finding, excess: dict) -> list[str]:
    """Select the measures with too large errors that an accuracy warning names.

    These are the inaccurate main measures that are not zero within their error, else the measure with
    the largest error over the allowed error.
    """
    known = finding.measures
    main = [name for name in MAIN_MEASURES if name in excess]
    main = [name for name in main if known[name].error < abs(known[name].value)]
    others = {
        name: times for name, times in excess.items() if not name.startswith(RINGING_PREFIX)
    } or excess
    return main or [max(others, key=others.get)]


def _format_warning(finding: Finding, excess: dict, remedy: str) -> str:
    """Return an accuracy warning with errors, tolerance and remedy."""
    names = _select_named_measures(finding, excess)
    first, *more = (f"of {_format_error(finding.measures[name])}" for name in names)
    listed = "".join(f", {name} {words}" for name, words in zip(names[1:], more, strict=True))
    count = len(excess) - len(names)
    others = ""
    if count:
        others = f" ({count} other measure{'s' * (count > 1)} also exceed{'s' * (count < 2)} the tolerance)"
    tolerance = finding.model.accuracy.tolerance
    return f"{names[0]} has an estimated error {first}{listed}; the tolerance is {tolerance:g}{others}; {remedy}"


def _format_error(measure) -> str:
    """Return the relative error of a measure as text."""
    if abs(measure.error) < abs(measure.value):
        return f"{abs(measure.error / measure.value):.2g} of its value"
    return f"at least its value ({measure})"


def _static_remedy(finding: Finding, excess: dict, coarse) -> str:
    """Return the remedy for inaccurate static measures: more strips, or a finer mesh."""
    patch_model = finding.model.patch
    peak = finding.measures.get("pressure_peak")
    is_wear_unbounded = (
        "worn_depth_max" in _select_named_measures(finding, excess)
        and peak is not None
        and peak.value is None
    )
    if is_wear_unbounded or max(excess.values()) >= MAX_EXCESS:
        return NO_REMEDY
    if (
        patch_model.mesh.file is None
        and patch_model.interface.strips is not None
        and patch_model.interface.strips.count > 1
    ):
        return _strip_remedy(patch_model, excess)
    # the ladder of meshes ends where all decisive measures meet the tolerance, or at its limit
    return _mesh_remedy(
        finding.model,
        [(finding, coarse)],
        is_at_limit=excess.keys() <= set(patch_rows.MESH_MEASURES),
        mesh="mesh" if finding.model.kind == "patch" else "mesh of the pressed pieces",
    )


def _strip_remedy(patch_model, excess: dict) -> str:
    """Return the advice to divide the patch into as many strips as the tolerance requires.

    The peak of the outermost strip is computed at its centre, so that its error is of first order
    in the width of a strip. The errors of all other measures are of second order, like those of the
    mesh.
    """
    ratio = max(
        times if name in FIRST_ORDER_MEASURES else times**0.5 for name, times in excess.items()
    )
    count = ceil(patch_model.interface.strips.count * ratio)
    if count > MAX_STRIPS:
        return NO_REMEDY
    return f"set contact.strips.count = {count}" + (
        "" if patch_model.mesh.is_automatic else f" and leave out {ELEMENT_SIZE}"
    )


def _mesh_remedy(
    model, places: list, *, is_at_limit: bool = False, mesh: str = "mesh of the motion"
) -> str:
    """Return the advice to refine the meshes of patches.

    Parameters
    ----------
    model : Model
    places : list
        Pairs of a Finding and its coarser patches.
    is_at_limit : bool
        Whether the ladder of meshes has ended.
    mesh : str
        Name of the mesh: pressed pieces and motion may have different ones.
    """
    patch_models = [finding.model.patch for finding, _ in places]
    n_nodes = max(finding.patch.x.size for finding, _ in places)
    cause = f"the {mesh} ({n_nodes} interface nodes) causes this error"
    if any(patch.mesh.file is not None for patch in patch_models):
        return faces.use_scene_keys(model, f"{cause}; split the elements of contact.mesh")
    if not all(patch.mesh.is_automatic for patch in patch_models):
        return faces.use_scene_keys(model, f"{cause}; leave out {ELEMENT_SIZE}")
    tolerances = [] if is_at_limit else [_refining_tolerance(*place) for place in places]
    tolerances = [tolerance for tolerance in tolerances if tolerance is not None]
    if tolerances:
        return f"{cause}; set accuracy.tolerance = {min(tolerances):.3g} for a finer mesh"
    patches = [finding.patch for finding, _ in places if isinstance(finding.patch, press.Patch)]
    seconds = max(map(mesh_levels.predict_next_mesh_seconds, patches), default=0.0)
    limit = mesh_levels.max_condensing_seconds(patch_models[0])
    if seconds > limit:
        cause += (
            f"; the next mesh would take about {format_number(seconds, 2)} CPU s, and at most {limit:g} CPU s are spent "
            "on a mesh of this scene"
        )
    return f"{cause}; no accuracy.tolerance leads to a finer mesh; {USE_ERROR_ADVICE}"


def _refining_tolerance(finding: Finding, coarse) -> float | None:
    """Return the tolerance with which a patch would be solved on a finer mesh, or None.

    The result is None if the ladder of meshes has ended. If the coarser meshes are not at hand, it is the
    tolerance for one more halving.
    """
    patch_model = finding.model.patch
    tolerance = finding.model.accuracy.tolerance
    if patch_model.mesh.shared is not None and isinstance(finding.patch, press.Patch):
        if mesh_levels.predict_next_mesh_seconds(
            finding.patch
        ) > mesh_levels.max_condensing_seconds(patch_model):
            return None
    if not any(coarse) or patch_model.mesh.shared is not None:
        return PROPOSED_TOLERANCE_RATIO * tolerance
    return mesh_levels.tolerance_for_finer_mesh(
        patch_model,
        finding.climbed or [finding.patch, *coarse],
        patch_model.mesh.tolerance or tolerance,
    )


def _motion_remedy(finding: Finding, excess: dict, coarse) -> str:
    """Return the advice that reduces the error of the least accurate main measure of a motion.

    The remedy depends on the largest part of the error. A looser tolerance is no remedy: it chooses
    coarser steps and meshes.
    """
    model = finding.model
    extra = finding.extra
    name = max(_select_named_measures(finding, excess), key=excess.get)
    steps = extra.get("steps_per_cycle") or extra.get("steps")
    cause = _find_main_error_kind(finding, name)
    if cause == "steps" and steps is not None:
        return _step_remedy(finding, name, excess, int(steps))
    if cause == "end":
        return _end_remedy(extra["cycles"], int(steps))
    if cause == "mesh" and finding.patch is not None:
        return _mesh_remedy(model, [(finding, coarse)])
    if cause == "mesh":
        soft = [face for face in faces.solve_interface_patches(model) if face.partial_slip]
        return _mesh_remedy(
            model, [(_select_interface_measures(finding, face), face.patches[1:]) for face in soft]
        )
    if (
        cause == "reduced"
    ):  # the error falls with the square of the number of modes of a reduced structure
        ratio = min(max(2.0, excess[name] ** 0.5), 16.0)
        n_modes = ceil(model.rig.modes.omega.size * ratio)
        return f"set structure.reduced.modes = {min(n_modes, model.rig.structure.max_modes)}"
    if cause == "modes" and extra["shear_modes"] < finding.patch.x.size:
        return f"set accuracy.shear_modes = {min(4 * extra['shear_modes'], finding.patch.x.size)}"
    if cause == "bonds":
        pinned = [key for key in ("tail", "merge") if getattr(model.accuracy, key) is not None]
        if pinned:
            return " and ".join(f"leave out accuracy.{key}" for key in pinned)
        proposed = PROPOSED_TOLERANCE_RATIO * model.accuracy.tolerance
        return f"set accuracy.tolerance = {proposed:.3g} to refine the sum over bonds"
    if name == STEADY_AMPLITUDE:  # in a longer run the transient decays further
        return "more drive cycles make this value more accurate; raise drive.cycles"
    if extra.get("harmonics") is None or name.startswith(SAMPLED_MEASURES):
        return NO_REMEDY
    return notes.advise_harmonics(extra["harmonics"], _count_friction_harmonics(finding))


def _find_main_error_kind(finding: Finding, name: str) -> str:
    """Return the kind of discretization (such as the mesh) with the largest error contribution."""
    causes = finding.measures[name].causes
    if causes is not None:
        kind = max(causes.parts, key=causes.parts.get, default="own")
        return kind if causes.parts.get(kind, 0.0) > 0 else "own"
    # a batch states neither the causes nor the settings of a patch that slips in part
    return "mesh" if finding.patch is not None and not finding.extra else "own"


def _step_remedy(finding: Finding, name: str, excess: dict, steps: int) -> str:
    """Return the advice to use the steps per cycle that the order of convergence requires."""
    model = finding.model
    parts, order = finding.measures[name].causes
    exact = ""
    if (
        model.kind == "rig"
        and model.accuracy.method != "exact"
        and not engines.reason_not_exact(model)
    ):
        exact = 'set accuracy.method = "exact", which has no steps'
        if model.accuracy.steps_per_cycle is not None:
            exact = f"leave out accuracy.steps_per_cycle and {exact}"
    if order is None:
        return f"{_describe_missing_order(name, steps)}{_remedy_without_order(model, steps, excess, exact)}"
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
    """Return the clause that a measure does not converge with the steps."""
    return (
        f"the results with {steps // 4}, {steps // 2} and {steps} steps per cycle show no order of convergence of "
        f"{name}"
    )


def _remedy_without_order(model, steps: int, excess: dict, exact: str) -> str:
    """Return the advice for a run whose measures do not converge when its steps are halved.

    Steps that the scene does not fix are doubled until the displacement meets the tolerance.
    """
    if exact:
        return f"; {exact}"
    is_pinned = model.kind == "rig" and model.accuracy.steps_per_cycle is not None
    may_double = is_pinned and 2 * steps <= costs.MAX_MARCH_STEPS
    if may_double and "relative_displacement_amplitude" in excess:
        return (
            "; leave out accuracy.steps_per_cycle, so that patchfem doubles the number of steps "
            "until the displacement meets the tolerance"
        )
    if 2 * steps <= costs.MAX_MARCH_STEPS:
        return (
            f", so the effect of more steps is not known; try accuracy.steps_per_cycle = {2 * steps}, or "
            f"{USE_ERROR_ADVICE}"
        )
    return f", so more steps may not help; {USE_ERROR_ADVICE}"


def _end_remedy(cycles: float, steps: int) -> str:
    """Return the advice to choose steps per cycle such that a run ends exactly at a sample.

    At most twice as many steps are proposed. They are a multiple of four, so that there are runs with
    half and a quarter of them.
    """
    counts = range(4 * ceil(steps / 4), 2 * steps + 4, 4)
    best = min(counts, key=lambda count: abs(cycles * count - round(cycles * count)))
    return (
        f"the run ends between two samples; set accuracy.steps_per_cycle = {best}, so that a sample lies closer to "
        "the end of the run"
    )


def _count_friction_harmonics(finding: Finding) -> float:
    """Return the number of harmonics that a speed-dependent friction force needs.

    The number is the largest speed over the reference speed of the law; 0 for other laws.
    """
    law = finding.model.friction
    slip = finding.measures.get("slip_amplitude")
    if law is None or slip is None or not law_has_trait(law.law, "creeps"):
        return 0.0
    return 2 * pi / finding.extra["period"] * slip.value / law.reference_speed
