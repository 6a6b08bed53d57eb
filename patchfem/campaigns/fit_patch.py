"""Laws of one point in place of a patch: Iwan, Bouc-Wen and elastic-plastic values from the patch's own loops.

Points under a constant load that stick or slip are elastic-plastic elements side by side (`slip.shear_modes`): their
curve of first loading is exact, and Masing's rule makes the loops of it. Each law has the slip force of the patch; its
other values are those with the least squares of the relative differences in the force at the turns and in the loss per
cycle, a fifth as much, over amplitudes of the slide that are even in their logarithm.
"""

from dataclasses import dataclass
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..effects import LAWS, has
from ..friction.laws.elastic_plastic import masing
from ..friction.record import law_from, loop_from
from ..identify.least_squares import Fit, fit
from ..model.model import Model, build
from ..model.source import placed
from ..runs.joint import held_patch
from ..runs.patch import ladder
from ..runs.patch.derived import elements, strip_elements
from ..scene.scene import Scene

DECADE, ROWS = 8, 12  # amplitudes a decade, and in all at least
LOW, HIGH = 1e-2, 2.0  # their ends over the slides mu N/K and at which all slips
LEAST = 1e-3  # of 4 x force x slide, the loss from which a patch counts as one that slips
FEW = 16  # of so many elements one, whose loss is that of the mesh
LATE = 0.2  # of mu N/K, where a range begins at the latest
WEIGHTS = np.array([[1.0], [0.2]])  # of the differences in force and loss, which are known about so well
KNOWN, FINER, FINEST = 0.1, 10.0, 9e-5  # rms change of the loss by a coarser mesh, up to which the mesh is refined by
# this tolerance over the one before, the last begun from one of at least FINEST
WIDE = 20.0  # times the patch's stiffness and its inverse, between which that of a law is searched


class Values(NamedTuple):
    """What is searched of a law beside its stiffness over the patch's: bounds low, high (n,); keys(stiffness [N/m],
    slip force [N], *values) -> {key: value}; units of the keys that have one."""

    low: tuple
    high: tuple
    keys: object
    units: dict


SEARCHED = {
    "iwan": Values((-0.999, 0.0), (0.0, 0.999), lambda k, force, chi, share: {
        "stiffness": k, "chi": chi, "beta": share / (1 - share)}, {"stiffness": "N/m"}),
    "bouc-wen": Values((0.02, 0.5), (50.0, 1.0), lambda k, force, exponent, shape: {
        "stiffness": k, "exponent": exponent, "shape": shape}, {"stiffness": "N/m"}),
    "elastic-plastic": Values((), (), lambda k, force: {"bond_length": force / k}, {"bond_length": "m"})}


class Curves(NamedTuple):
    """Force at the turns [N] and loss per cycle [J], (k,) each."""

    force: np.ndarray
    loss: np.ndarray

    def off(self, own: "Curves", slides) -> np.ndarray:
        """Relative differences (2, k) to the patch's own at slides (k,) [m]."""
        return np.array([self.force / own.force - 1,
                         (self.loss - own.loss) / np.maximum(own.loss, LEAST * 4 * slides * own.force)])


class OneLaw(NamedTuple):
    """A fitted law: values by the keys of [friction], its Curves, their differences `off` (2, k), and the Fit."""

    values: dict
    curves: Curves
    off: np.ndarray
    found: Fit


@dataclass(frozen=True, eq=False, slots=True)
class FittedPatch:
    """Laws by name for a patch under a `load` [N] with the slip force `limit` [N] and the stiffness [N/m] while nothing
    slips, extrapolated over the meshes where the pieces alone give way, stuck_error: its error, None of others; slides
    (k,) [m]; own: its Curves; mesh: (2, k) what a coarser mesh changes of them, relative, None without one; best: the
    law with the least squares; warnings: sentences on the mesh, nodes: of its interface."""

    scene: Scene
    load: float
    limit: float
    stiffness: float
    slides: np.ndarray
    own: Curves
    mesh: np.ndarray | None
    laws: dict
    best: str
    seconds: float
    stuck_error: float | None = None
    warnings: tuple = ()
    nodes: int = 0


def fit_patch(scene: Scene, slides=None) -> FittedPatch:
    """Fit the laws of SEARCHED to the loops of a scene's patch at slides (k,) [m], rising.

    slides None: from that at which one element in FEW slips and all lose LEAST of 4 x force x slide, but LOW to LATE
    times that by which the slip force stretches the held patch, to HIGH times that at which all of it slips.
    PatchfemError with what to change for a scene whose patch is no set of elastic-plastic elements.
    """
    begin, model, tolerance = perf_counter(), build(scene), build(scene).accuracy.tolerance
    with placed(scene):
        _refuse(model)
        while True:
            patch, *others = ladder.solve_all(model.patch, tolerance)
            if not patch.pressure.load > 0:
                raise PatchfemError("the normal load is 0 or less; raise the load", "contact.load")
            parts, coarse = _elements(model, patch), next((one for one in others if one is not None), None)
            at = _slides(parts) if slides is None else np.asarray(slides, float)
            own = Curves(*masing(*parts, at))
            mesh = None if coarse is None else Curves(*masing(*_elements(model, coarse), at)).off(own, at)
            open_ = 0.0 if mesh is None else float(np.sqrt(np.mean(mesh[1]**2)))
            if open_ <= KNOWN or not model.patch.chosen or tolerance < FINEST:
                break
            tolerance /= FINER
        held = held_patch(model, patch, tuple(others) or (None,))
    load, limit, stiffness = patch.pressure.load, float(parts[0] @ parts[1]), float(parts[0].sum())
    laws = {law: fit_law(law, model.friction.static, load, at, own, stiffness) for law in SEARCHED}
    best = min(laws, key=lambda law: laws[law].found.rms)
    return FittedPatch(scene, load, limit, held.value if held else stiffness, at, own, mesh, laws, best,
                       perf_counter() - begin, held.error if held else None, _coarse(model, patch, open_), patch.x.size)


def _slides(parts: tuple) -> np.ndarray:
    """Slides (k,) [m] from where elements (stiffness [N/m], yield slide [m]) begin to slip to where all do."""
    limit, stiffness = float(parts[0] @ parts[1]), float(parts[0].sum())
    low, high = LOW * limit / stiffness, HIGH * float(parts[1].max())
    near = np.geomspace(low, high, 1024)
    force, loss = masing(*parts, near)
    first = np.sort(parts[1])[parts[1].size // FEW]
    low = max(near[np.argmax(loss > LEAST * 4 * near * force)], min(first, LATE * limit / stiffness))
    return np.geomspace(low, high, max(ROWS, 1 + int(np.ceil(DECADE * np.log10(high / low)))))


def _coarse(model: Model, patch, left: float) -> tuple:
    """Sentences on a mesh that leaves a share `left` of the loss open."""
    if left <= KNOWN:
        return ()
    cure = "begin with larger amplitudes, at which more elements of the patch slip"
    if not model.patch.chosen:
        cure = "leave contact.element_size out: the mesh is then refined until the energy loss is accurate enough" \
            if model.patch.mesh is None else "refine the mesh in the file"
    return (f"with this mesh ({patch.x.size} interface nodes) the energy loss has an error of {100 * left:.2g} % "
            "(rms); this error also makes `chi` of law 'iwan' uncertain, and `chi` sets the exponent of micro-slip; "
            f"{cure}",)


def fit_law(law: str, static: float, load: float, slides, own: Curves, stiffness: float) -> OneLaw:
    """Fit one law of slip force static x load [N] to the Curves of a joint of some `stiffness` [N/m] at slides (k,)
    [m]."""
    asked = SEARCHED[law]

    def curves(x) -> Curves:
        return Curves(*loop_from(_Keys(law, static, asked.keys(x[0] * stiffness, static * load, *x[1:])), load, slides))

    found = fit(lambda x: (WEIGHTS * curves(x).off(own, slides)).ravel(), (1 / WIDE, *asked.low), (WIDE, *asked.high),
                start=(1.0, *(0.5 * (a + b) for a, b in zip(asked.low, asked.high))), starts=2, bars="bounds")
    one, values = curves(found.values), found.values.tolist()
    return OneLaw(asked.keys(values[0] * stiffness, static * load, *values[1:]), one, one.off(own, slides), found)


class _Keys:
    """A table [friction] of numbers that are within their bounds."""

    def __init__(self, law: str, static: float, values: dict):
        self.__dict__.update(values, law=law, static=static)


def _elements(model: Model, patch) -> tuple:
    """(stiffness (t,) [N/m], yield slide (t,) [m]) of the elements of a pressed patch."""
    f, load = model.friction, patch.pressure.load
    element = law_from(f, load).element(load)
    if not model.soft:
        return np.array([element.limit / element.length]), np.array([element.length])
    if patch.strips is not None:
        return tuple(map(np.concatenate, zip(*strip_elements(patch, f.static, element.length))))
    found = elements(patch, f.static, element.length)
    return found.stiffness, found.yield_slide


def _refuse(model: Model) -> None:
    """PatchfemError where a patch is no set of elastic-plastic elements of its own."""
    f, rig = model.friction, model.rig
    if model.patch is None or f is None:
        raise PatchfemError("fit --from-patch needs a patch that slides: the scene must have [contact], [friction] and "
                            "either [slide] or [structure] with [drive]",
                            "contact" if model.patch is None else "friction")
    named = [law for law in LAWS if has(law, "timeless") and "shear" in LAWS[law].carries.split()]
    for key, reason, holds in (
            ("friction.law", f"a patch with law '{f.law}' cannot be represented by elements that stick or slip; use "
                             f"law {' or '.join(named)}", f.law not in named),
            ("friction.law", f"law '{f.law}' is rigid, so the patch has no stiffness to fit; add [contact.shear] or "
                             "contact.asperities.tangential_ratio", has(f.law, "set-valued") and not model.soft),
            ("contact.grooves", "none of the laws to be fitted describes grooves; leave the grooves out for the fit, "
                                "and add [normal.grooves] to the scene with the fitted law", model.grooves is not None),
            ("wear", "the fit uses the loops of unworn pieces; leave [wear] out", model.kind != "patch" and
             model.wear is not None),
            ("structure.mode", "a mode moves the pieces normal to the contact or rotates them, so the normal load "
                               "changes with the motion, or the strips slide by different amounts; set the keys "
                               "`normal`, `pitch` and `yaw` to 0", rig is not None and
             (rig.load_varies or rig.strips_slide_apart))):
        if holds:
            raise PatchfemError(reason, key)


def slides_of(lengths) -> np.ndarray | None:
    """The slides (k,) [m] that were asked for, None for none; PatchfemError for fewer than three, which fix no law."""
    if lengths is not None and len(lengths) < 3:
        raise PatchfemError("--amplitudes: give at least three amplitudes, for example 0.1 um..10 um:25")
    return None if lengths is None else np.asarray(lengths, float)
