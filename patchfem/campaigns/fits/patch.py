"""Single-point friction laws fitted to the friction loops of a contact patch.

A patch under a constant load, whose points stick or slip, is equivalent to elastic-plastic elements in
parallel (`slip.shear_modes`). Their initial loading curve is exact, and Masing's rule gives the loops.
`patch_laws` fits each law to these loops at logarithmically spaced displacement amplitudes.
"""

from dataclasses import dataclass
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...effects import LAWS, law_has_trait
from ...friction.laws.elastic_plastic import masing_loop
from ...friction.record import make_law
from ...model.model import Model, build
from ...model.source import locate_errors
from ...runs.joint import find_stuck_patch_stiffness
from ...runs.patch import jenkins_elements, mesh_levels
from ...scene.scene import Scene
from .patch_laws import FITTED_LAWS, MIN_LOSS, LawProblem, LoopCurves

# Number of amplitudes per decade, which resolves every regime of a law.
AMPLITUDES_PER_DECADE = 8
MIN_AMPLITUDES = 12  # Smallest number of amplitudes of any range.
# Smallest ratio of the amplitude to slip force/stiffness; smaller ones cause no slip.
MIN_AMPLITUDE_FACTOR = 1e-2
# Largest ratio of the amplitude to the yield displacement of the last element.
MAX_AMPLITUDE_FACTOR = 2.0
MAX_FIRST_FACTOR = 0.2  # Upper limit of the ratio of the first amplitude to slip force/stiffness.
# Inverse of the smallest fraction of slipping elements at which the mesh resolves the loss.
N_RESOLVED_ELEMENTS = 16
# Largest root mean square difference of the loss between two meshes without refinement.
MAX_LOSS_CHANGE = 0.1
REFINE_FACTOR = 10.0  # Ratio of the mesh tolerances before and after a refinement.
MIN_TOLERANCE = 9e-5  # Smallest tolerance of a mesh that is refined; finer meshes take too long.


class Elements(NamedTuple):
    """Elastic-plastic elements in parallel: stiffness (t,) [N/m] and yield displacement (t,) [m]."""

    stiffness: np.ndarray
    yield_displacement: np.ndarray

    @property
    def slip_force(self) -> float:
        """Force at which all elements slip [N]."""
        return float(self.stiffness @ self.yield_displacement)

    @property
    def total_stiffness(self) -> float:
        """Stiffness while no element slips [N/m]."""
        return float(self.stiffness.sum())

    def compute_curves(self, amplitudes) -> LoopCurves:
        """Compute peak force and energy loss per cycle at displacement amplitudes (k,) [m]."""
        return LoopCurves(*masing_loop(self.stiffness, self.yield_displacement, amplitudes))


class PatchLoops(NamedTuple):
    """Friction loops of a patch at several displacement amplitudes.

    Attributes
    ----------
    load, slip_force : float
        Normal load and largest friction force [N].
    stiffness : float
        Stiffness without slip [N/m], extrapolated over the meshes if only the pieces are elastic.
    stiffness_error : float or None
        Error of the stiffness [N/m]; None if it is unknown.
    amplitudes : (k,) array
        Displacement amplitudes [m].
    curves : LoopCurves
    mesh_change : (2, k) array or None
        Relative difference of the curves to those of a coarser mesh; None if there is none.
    nodes : int
        Number of interface nodes.
    """

    load: float
    slip_force: float
    stiffness: float
    stiffness_error: float | None
    amplitudes: np.ndarray
    curves: LoopCurves
    mesh_change: np.ndarray | None
    nodes: int


@dataclass(frozen=True, eq=False, slots=True)
class FittedPatch:
    """Single-point friction laws that are fitted to the patch of a scene and can replace it.

    best: the law with the smallest sum of squares.
    """

    scene: Scene
    patch: PatchLoops
    laws: dict
    best: str
    warnings: tuple
    seconds: float


def fit_patch(scene: Scene, amplitudes=None) -> FittedPatch:
    """Fit single-point friction laws (FITTED_LAWS) to the friction loops of a patch.

    Parameters
    ----------
    scene : Scene
    amplitudes : (k,) array, optional
        Increasing displacement amplitudes [m]; by default from the onset of slip to twice the
        amplitude at which the complete patch slips.

    Returns
    -------
    FittedPatch

    Raises
    ------
    PatchfemError
        If elastic-plastic elements cannot represent the patch.
    """
    begin = perf_counter()
    model = build(scene)
    with locate_errors(scene):
        _check_model(model)
        meshed = _solve_with_refined_mesh(model, amplitudes)
        stuck = find_stuck_patch_stiffness(model, (meshed.patch, *meshed.coarser_patches, None))
    elements = meshed.elements
    loops = PatchLoops(
        load=meshed.patch.pressure.load,
        slip_force=elements.slip_force,
        stiffness=stuck.value if stuck else elements.total_stiffness,
        stiffness_error=stuck.error if stuck else None,
        amplitudes=meshed.amplitudes,
        curves=meshed.curves,
        mesh_change=meshed.mesh_change,
        nodes=meshed.patch.x.size,
    )
    friction = {"static": model.friction.static, "load": loops.load}
    laws = {}
    for law in FITTED_LAWS:
        problem = LawProblem(
            law,
            **friction,
            amplitudes=loops.amplitudes,
            target=loops.curves,
            stiffness=elements.total_stiffness,
        )
        laws[law] = problem.solve()
    best = min(laws, key=lambda law: laws[law].fit.rms)
    warnings = _warn_of_coarse_mesh(model, meshed)
    return FittedPatch(scene, loops, laws, best, warnings, perf_counter() - begin)


class _LoopsOnMesh(NamedTuple):
    """Friction loops of a patch on a given mesh, and their difference to a coarser mesh.

    Attributes
    ----------
    patch : Patch
    coarser_patches : tuple
        Patches on coarser meshes; None for a mesh that was not solved.
    elements : Elements
    amplitudes : (k,) array
        Displacement amplitudes [m].
    curves : LoopCurves
    mesh_change : (2, k) array or None
        Relative difference of the curves to those of a coarser mesh; None if there is none.
    """

    patch: object
    coarser_patches: tuple
    elements: Elements
    amplitudes: np.ndarray
    curves: LoopCurves
    mesh_change: np.ndarray | None

    @property
    def loss_change(self) -> float:
        """Root mean square relative difference of the loss to a coarser mesh; 0 if there is none."""
        return (
            0.0 if self.mesh_change is None else float(np.sqrt(np.mean(self.mesh_change[1] ** 2)))
        )


def _solve_with_refined_mesh(model: Model, requested_amplitudes) -> _LoopsOnMesh:
    """Solve the contact on a sequence of refined meshes until the energy loss converges."""
    tolerance = model.accuracy.tolerance
    while True:
        patch, *coarser = mesh_levels.solve_with_coarser(model.patch, tolerance)
        if not patch.pressure.load > 0:
            raise PatchfemError("the normal load is 0 or less; raise the load", "contact.load")
        elements = _make_elements(model, patch)
        if requested_amplitudes is None:
            amplitudes = _default_amplitudes(elements)
        else:
            amplitudes = np.asarray(requested_amplitudes, float)
        curves = elements.compute_curves(amplitudes)
        coarse = next((other for other in coarser if other is not None), None)
        change = None
        if coarse is not None:
            coarse_curves = _make_elements(model, coarse).compute_curves(amplitudes)
            change = coarse_curves.relative_deviations(curves, amplitudes)
        meshed = _LoopsOnMesh(patch, tuple(coarser), elements, amplitudes, curves, change)
        can_refine = model.patch.mesh.is_automatic and tolerance >= MIN_TOLERANCE
        if meshed.loss_change <= MAX_LOSS_CHANGE or not can_refine:
            return meshed
        tolerance /= REFINE_FACTOR


def _default_amplitudes(elements: Elements) -> np.ndarray:
    """Return amplitudes (k,) [m] from the onset of slip to slip of the complete patch."""
    stuck_limit = elements.slip_force / elements.total_stiffness
    max_amplitude = MAX_AMPLITUDE_FACTOR * float(elements.yield_displacement.max())
    trials = np.geomspace(MIN_AMPLITUDE_FACTOR * stuck_limit, max_amplitude, 1024)
    curves = elements.compute_curves(trials)
    slip_onset = trials[np.argmax(curves.loss > MIN_LOSS * 4 * trials * curves.force)]
    yields = np.sort(elements.yield_displacement)
    resolved = yields[yields.size // N_RESOLVED_ELEMENTS]
    min_amplitude = max(slip_onset, min(resolved, MAX_FIRST_FACTOR * stuck_limit))
    count = 1 + int(np.ceil(AMPLITUDES_PER_DECADE * np.log10(max_amplitude / min_amplitude)))
    return np.geomspace(min_amplitude, max_amplitude, max(MIN_AMPLITUDES, count))


def _warn_of_coarse_mesh(model: Model, meshed: _LoopsOnMesh) -> tuple:
    """Return a warning if the mesh is too coarse for an accurate energy loss."""
    if meshed.loss_change <= MAX_LOSS_CHANGE:
        return ()
    if model.patch.mesh.is_automatic:
        advice = "begin with larger amplitudes, at which more elements of the patch slip"
    elif model.patch.mesh.file is None:
        advice = (
            "leave contact.element_size out: the mesh is then refined until the energy loss is "
            "accurate enough"
        )
    else:
        advice = "refine the mesh in the file"
    return (
        f"with this mesh ({meshed.patch.x.size} interface nodes) the energy loss has an error of "
        f"{100 * meshed.loss_change:.2g} % (rms); this error also makes `chi` of law 'iwan' uncertain, and "
        f"`chi` sets the exponent of micro-slip; {advice}",
    )


def _make_elements(model: Model, patch) -> Elements:
    """Return the elastic-plastic elements that represent a solved patch."""
    friction = model.friction
    load = patch.pressure.load
    element = make_law(friction, load).element(load)
    if not model.partial_slip:
        return Elements(np.array([element.limit / element.length]), np.array([element.length]))
    if patch.strips is not None:
        strips = jenkins_elements.strip_elements(patch, friction.static, element.length)
        return Elements(*map(np.concatenate, zip(*strips)))
    exact = jenkins_elements.elements(patch, friction.static, element.length)
    return Elements(exact.stiffness, exact.yield_displacement)


def _check_model(model: Model) -> None:
    """Raise PatchfemError if elastic-plastic elements cannot represent the patch of a model."""
    friction = model.friction
    rig = model.rig
    if model.patch is None or friction is None:
        raise PatchfemError(
            "fit --from-patch needs a patch that slides: the scene must have [contact], [friction] "
            "and either [slide] or [structure] with [drive]",
            "contact" if model.patch is None else "friction",
        )
    sheared = [law for law, record in LAWS.items() if "shear" in record.supports.split()]
    possible = [law for law in sheared if law_has_trait(law, "timeless")]
    if friction.law not in possible:
        raise PatchfemError(
            f"a patch with law '{friction.law}' cannot be represented by elements that stick or "
            f"slip; use law {' or '.join(possible)}",
            "friction.law",
        )
    if law_has_trait(friction.law, "set-valued") and not model.partial_slip:
        raise PatchfemError(
            f"law '{friction.law}' is rigid, so the patch has no stiffness to fit; add "
            "[contact.shear] or contact.asperities.tangential_ratio",
            "friction.law",
        )
    if model.grooves is not None:
        raise PatchfemError(
            "none of the laws to be fitted describes grooves; leave the grooves out for the fit, "
            "and add [normal.grooves] to the scene with the fitted law",
            "contact.grooves",
        )
    if model.kind != "patch" and model.wear is not None:
        raise PatchfemError("the fit uses the loops of unworn pieces; leave [wear] out", "wear")
    if rig is not None and (rig.friction.load_varies or rig.friction.strips_slide_apart):
        raise PatchfemError(
            "a mode moves the pieces normal to the contact or rotates them, so the normal load "
            "changes with the motion, or the strips slide by different amounts; set the keys "
            "`normal`, `pitch` and `yaw` to 0",
            "structure.mode",
        )


def check_amplitudes(lengths) -> np.ndarray | None:
    """Return displacement amplitudes as an array (k,) [m]; None if none are given.

    Raises PatchfemError if there are fewer than three amplitudes.
    """
    if lengths is None:
        return None
    if len(lengths) < 3:
        raise PatchfemError(
            "--amplitudes: give at least three amplitudes, for example 0.1 um..10 um:25"
        )
    return np.asarray(lengths, float)
