"""Friction laws of a single point, fitted to the friction loops of a patch.

Points under a constant load that stick or slip are elastic-plastic elements in parallel
(`slip.shear_modes`): their curve of first loading is exact, and Masing's rule gives the loops. Each law
has the slip force of the patch. Its other values minimise the squares of the relative differences in
force at the reversals and, with a fifth of the weight, in loss per cycle, over amplitudes of the slide
that are evenly spaced in their logarithm.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...effects import LAWS, law_has_trait
from ...friction.laws.elastic_plastic import masing_loop
from ...friction.record import make_law, steady_loop
from ...identify.least_squares import Fit, fit
from ...model.model import Model, build
from ...model.source import locate_errors
from ...runs.joint import stuck_patch_stiffness
from ...runs.patch import ladder
from ...runs.patch.jenkins_elements import elements, strip_elements
from ...scene.scene import Scene

AMPLITUDES_PER_DECADE = 8  # This density resolves every regime of a law.
MIN_AMPLITUDES = 12  # Smallest number of amplitudes, also of a short range.
MIN_AMPLITUDE_FACTOR = 1e-2  # Smallest amplitude / (slip force / stiffness); below, nothing slips.
MAX_AMPLITUDE_FACTOR = 2.0  # Largest amplitude / the amplitude at which every element slips.
MAX_FIRST_FACTOR = 0.2  # A range begins at most at this multiple of slip force / stiffness.
MIN_LOSS = 1e-3  # Loss / (4 x force x slide), above which the patch counts as slipping.
# While fewer than 1 of this many elements slips, the loss is dominated by the mesh.
MESH_ELEMENTS = 16
# Weight of the loss compared with the force, because its relative error is larger by this factor.
LOSS_WEIGHT = 0.2
# Change of the loss by a coarser mesh (rms), above which the mesh is refined.
MAX_LOSS_CHANGE = 0.1
REFINE_FACTOR = 10.0  # Tolerance of the mesh / tolerance of its refinement.
MIN_TOLERANCE = 9e-5  # Tolerance below which a mesh is not refined, as it takes too long.
STIFFNESS_RANGE = 20.0  # A law's stiffness is searched for from 1/20 to 20 times that of the patch.


class LawKeys(NamedTuple):
    """Values of a law that are fitted in addition to its stiffness.

    The stiffness is fitted as a multiple of that of the patch.

    Attributes
    ----------
    low, high : tuple
        Bounds (n,).
    keys : callable
        (stiffness [N/m], slip force [N], *values) -> keys of [friction].
    units : dict
        Unit by key, for keys that have one.
    """

    low: tuple
    high: tuple
    keys: Callable
    units: dict


def _iwan_keys(stiffness: float, slip_force: float, chi: float, fraction: float) -> dict:
    """Return the keys of law "iwan"."""
    return {"stiffness": stiffness, "chi": chi, "beta": fraction / (1 - fraction)}


def _bouc_wen_keys(stiffness: float, slip_force: float, exponent: float, shape: float) -> dict:
    """Return the keys of law "bouc-wen"."""
    return {"stiffness": stiffness, "exponent": exponent, "shape": shape}


def _elastic_plastic_keys(stiffness: float, slip_force: float) -> dict:
    """Return the keys of law "elastic-plastic"."""
    return {"bond_length": slip_force / stiffness}


FITTED_LAWS = {
    "iwan": LawKeys((-0.999, 0.0), (0.0, 0.999), _iwan_keys, {"stiffness": "N/m"}),
    "bouc-wen": LawKeys((0.02, 0.5), (50.0, 1.0), _bouc_wen_keys, {"stiffness": "N/m"}),
    "elastic-plastic": LawKeys((), (), _elastic_plastic_keys, {"bond_length": "m"}),
}


class Curves(NamedTuple):
    """Force at the reversals [N] and loss per cycle [J], (k,) each."""

    force: np.ndarray
    loss: np.ndarray

    def relative_deviations(self, own: "Curves", slides) -> np.ndarray:
        """Return the relative differences (2, k) from the curves of the patch at slides (k,) [m]."""
        scale = np.maximum(own.loss, MIN_LOSS * 4 * slides * own.force)
        return np.array([self.force / own.force - 1, (self.loss - own.loss) / scale])


class FittedLaw(NamedTuple):
    """Friction law of a point that replaces the patch.

    Attributes
    ----------
    values : dict
        Values by key of [friction].
    curves : Curves
    deviations : (2, k) array
        Relative differences of the curves from those of the patch.
    fit : Fit
    """

    values: dict
    curves: Curves
    deviations: np.ndarray
    fit: Fit


class Elements(NamedTuple):
    """Stiffness (t,) [N/m] and yield displacement (t,) [m] of elastic-plastic elements."""

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

    def compute_curves(self, slides) -> Curves:
        """Return the curves at amplitudes (k,) [m] of the slide."""
        return Curves(*masing_loop(self.stiffness, self.yield_displacement, slides))


class PatchLoops(NamedTuple):
    """Loops of a patch.

    Attributes
    ----------
    load, slip_force : float
        Normal load and largest friction force [N].
    stiffness : float
        Stiffness while nothing slips [N/m], extrapolated over the meshes if the pieces alone are
        elastic.
    stiffness_error : float or None
        Its error [N/m]; None if it is not known.
    slides : (k,) array
        Amplitudes of the slide [m].
    curves : Curves
    mesh_change : (2, k) array or None
        Relative change of the curves by a coarser mesh; None if there is none.
    nodes : int
        Number of nodes of the interface.
    """

    load: float
    slip_force: float
    stiffness: float
    stiffness_error: float | None
    slides: np.ndarray
    curves: Curves
    mesh_change: np.ndarray | None
    nodes: int


@dataclass(frozen=True, eq=False, slots=True)
class FittedPatch:
    """Fitted laws, by name, that can replace the patch of a scene.

    best: the law with the smallest sum of squares.
    """

    scene: Scene
    patch: PatchLoops
    laws: dict
    best: str
    warnings: tuple
    seconds: float


def fit_patch(scene: Scene, slides=None) -> FittedPatch:
    """Fit FITTED_LAWS to the friction loops of a scene's patch.

    Parameters
    ----------
    scene : Scene
    slides : (k,) array, optional
        Increasing amplitudes of the slide [m]; by default from the onset of slip to twice the
        amplitude at which the whole patch slips.

    Returns
    -------
    FittedPatch

    Raises
    ------
    PatchfemError
        If the patch cannot be described by elastic-plastic elements; the message says what to
        change.
    """
    begin = perf_counter()
    model = build(scene)
    tolerance = model.accuracy.tolerance
    with locate_errors(scene):
        _check_model(model)
        while True:
            patch, *others = ladder.solve_all(model.patch, tolerance)
            if not patch.pressure.load > 0:
                raise PatchfemError("the normal load is 0 or less; raise the load", "contact.load")
            parts = _patch_elements(model, patch)
            at = _default_slides(parts) if slides is None else np.asarray(slides, float)
            own = parts.compute_curves(at)
            coarse = next((other for other in others if other is not None), None)
            mesh_change = None
            loss_change = 0.0
            if coarse is not None:
                mesh_change = (
                    _patch_elements(model, coarse).compute_curves(at).relative_deviations(own, at)
                )
                loss_change = float(np.sqrt(np.mean(mesh_change[1] ** 2)))
            can_refine = model.patch.mesh.is_automatic and tolerance >= MIN_TOLERANCE
            if loss_change <= MAX_LOSS_CHANGE or not can_refine:
                break
            tolerance /= REFINE_FACTOR
        held = stuck_patch_stiffness(model, patch, tuple(others) or (None,))
    loops = PatchLoops(
        load=patch.pressure.load,
        slip_force=parts.slip_force,
        stiffness=held.value if held else parts.total_stiffness,
        stiffness_error=held.error if held else None,
        slides=at,
        curves=own,
        mesh_change=mesh_change,
        nodes=patch.x.size,
    )
    static = model.friction.static
    laws = {
        law: fit_law(law, static, loops.load, at, own, parts.total_stiffness) for law in FITTED_LAWS
    }
    best = min(laws, key=lambda law: laws[law].fit.rms)
    warnings = _warn_of_mesh(model, patch, loss_change)
    return FittedPatch(scene, loops, laws, best, warnings, perf_counter() - begin)


def _default_slides(parts: Elements) -> np.ndarray:
    """Return amplitudes (k,) [m] from the onset of slip to slip of the whole patch."""
    stuck = parts.slip_force / parts.total_stiffness
    low = MIN_AMPLITUDE_FACTOR * stuck
    high = MAX_AMPLITUDE_FACTOR * float(parts.yield_displacement.max())
    near = np.geomspace(low, high, 1024)
    curves = parts.compute_curves(near)
    slips = near[np.argmax(curves.loss > MIN_LOSS * 4 * near * curves.force)]
    yields = np.sort(parts.yield_displacement)
    first = yields[yields.size // MESH_ELEMENTS]
    low = max(slips, min(first, MAX_FIRST_FACTOR * stuck))
    count = 1 + int(np.ceil(AMPLITUDES_PER_DECADE * np.log10(high / low)))
    return np.geomspace(low, high, max(MIN_AMPLITUDES, count))


def _warn_of_mesh(model: Model, patch, loss_change: float) -> tuple:
    """Return a warning if a coarser mesh changes the loss too much."""
    if loss_change <= MAX_LOSS_CHANGE:
        return ()
    if model.patch.mesh.is_automatic:
        cure = "begin with larger amplitudes, at which more elements of the patch slip"
    elif model.patch.mesh.file is None:
        cure = (
            "leave contact.element_size out: the mesh is then refined until the energy loss is "
            "accurate enough"
        )
    else:
        cure = "refine the mesh in the file"
    return (
        f"with this mesh ({patch.x.size} interface nodes) the energy loss has an error of "
        f"{100 * loss_change:.2g} % (rms); this error also makes `chi` of law 'iwan' uncertain, and "
        f"`chi` sets the exponent of micro-slip; {cure}",
    )


def fit_law(
    law: str, static: float, load: float, slides, own: Curves, stiffness: float
) -> FittedLaw:
    """Fit one law to the loops of a joint.

    Parameters
    ----------
    law : str
        One of FITTED_LAWS.
    static : float
        Coefficient of friction.
    load : float
        Normal load [N]; the slip force is static x load.
    slides : (k,) array
        Amplitudes of the slide [m].
    own : Curves
        Curves of the joint at these amplitudes.
    stiffness : float
        Stiffness of the joint [N/m], near which that of the law is searched.

    Returns
    -------
    FittedLaw
    """
    asked = FITTED_LAWS[law]
    weights = np.array([[1.0], [LOSS_WEIGHT]])

    def law_keys(values) -> dict:
        """Return the keys of [friction] at values (n,) of the fit."""
        return asked.keys(values[0] * stiffness, static * load, *values[1:])

    def law_curves(values) -> Curves:
        """Return the curves of the law at values (n,) of the fit."""
        return Curves(*steady_loop(_FrictionKeys(law, static, law_keys(values)), load, slides))

    def residual(values) -> np.ndarray:
        """Return the weighted relative differences at values (n,) of the fit."""
        return (weights * law_curves(values).relative_deviations(own, slides)).ravel()

    low = (1 / STIFFNESS_RANGE, *asked.low)
    high = (STIFFNESS_RANGE, *asked.high)
    middle = [(a + b) / 2 for a, b in zip(asked.low, asked.high)]
    found = fit(residual, low, high, start=(1.0, *middle), max_descents=2, interval_kind="bounds")
    curves = law_curves(found.values)
    keys = law_keys(found.values.tolist())
    return FittedLaw(keys, curves, curves.relative_deviations(own, slides), found)


class _FrictionKeys:
    """Stand-in for a table [friction] with values within the bounds of the fit.

    Its values need no check.
    """

    def __init__(self, law: str, static: float, values: dict):
        self.__dict__.update(values, law=law, static=static)


def _patch_elements(model: Model, patch) -> Elements:
    """Return the elements of a pressed patch."""
    friction = model.friction
    load = patch.pressure.load
    element = make_law(friction, load).element(load)
    if not model.partial_slip:
        return Elements(np.array([element.limit / element.length]), np.array([element.length]))
    if patch.strips is not None:
        strips = strip_elements(patch, friction.static, element.length)
        return Elements(*map(np.concatenate, zip(*strips)))
    found = elements(patch, friction.static, element.length)
    return Elements(found.stiffness, found.yield_displacement)


def _check_model(model: Model) -> None:
    """Raise PatchfemError if a patch cannot be described by elastic-plastic elements."""
    friction = model.friction
    rig = model.rig
    if model.patch is None or friction is None:
        raise PatchfemError(
            "fit --from-patch needs a patch that slides: the scene must have [contact], [friction] "
            "and either [slide] or [structure] with [drive]",
            "contact" if model.patch is None else "friction",
        )
    possible = [
        law
        for law in LAWS
        if law_has_trait(law, "timeless") and "shear" in LAWS[law].supports.split()
    ]
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


def read_slides(lengths) -> np.ndarray | None:
    """Check the requested amplitudes (k,) [m]; PatchfemError if there are fewer than three.

    None if none are given.
    """
    if lengths is None:
        return None
    if len(lengths) < 3:
        raise PatchfemError(
            "--amplitudes: give at least three amplitudes, for example 0.1 um..10 um:25"
        )
    return np.asarray(lengths, float)
