"""Backbones of a mode: curves by all methods, loss exponents and flutter amplitude, for one or several models."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ...core import NotConverged, PatchfemError
from ...formatting import format_length
from ...measures.errors import estimate_errors_from_finer
from ...model.model import Model
from ...model.source import locate_errors
from ...runs.joint import find_stuck_patch_stiffness
from ...scene.keys.removed import describe_removed
from . import words
from .amplitudes import default_amplitudes, find_amplitudes_of_forces
from .balance import compute_balance_curve
from .joint import JointMode, build_joint
from .quasi_static import compute_static_curve
from .records import (
    CURVE_METHODS,
    CURVE_QUANTITIES,
    EQUAL_AMPLITUDE_TOL,
    ROUND_OFF_ERROR,
    Backbone,
    Curve,
    LossExponents,
    ModeFrequencies,
    make_band,
)

CURVE_FUNCTIONS = {"balance": compute_balance_curve, "quasi-static": compute_static_curve}
# Smallest ratio of a loss to its error at which the loss is used to determine an exponent.
MIN_LOSS_TO_ERROR_RATIO = 4.0


class AmplitudesOrForces(NamedTuple):
    """Amplitudes of a backbone, or the forces that hold the phase resonance; () for a range around the onset of slip.

    - amplitudes: amplitudes at the output [m].
    - forces: forces at the output [N].
    """

    amplitudes: Sequence[float] = ()
    forces: Sequence[float] = ()


# For a backbone of which the user gives neither amplitudes nor forces
RANGE_AROUND_SLIP = AmplitudesOrForces()


def choose_methods(method: str | None) -> tuple[str, ...]:
    """Return the method of a given name; all methods for "" and None.

    Raises
    ------
    PatchfemError
        If no method has this name.
    """
    if not method:
        return CURVE_METHODS
    if method not in CURVE_METHODS:
        shown = f"backbone: method {method!r}"
        removed = describe_removed(f"backbone --method {method}", shown)
        raise PatchfemError(
            removed or f"{shown} does not exist; use one of {', '.join(CURVE_METHODS)}"
        )
    return (method,)


def compute_backbone(
    model: Model,
    mode: str = "",
    amplitudes=None,
    methods=CURVE_METHODS,
    progress: Callable | None = None,
    *,
    errors: bool = True,
) -> Backbone:
    """Compute frequency and damping of a mode of a rig against amplitude.

    Parameters
    ----------
    model : Model
        Model of a rig.
    mode : str
        Name of the mode; "" for the first.
    amplitudes : (k,) array, optional
        At the output [m]. By default a range around the onset of slip.
    methods : sequence of str
        From CURVE_METHODS.
    progress : callable, optional
        Takes the name of a method that begins.
    errors : bool
        Whether the force and the errors of the mesh, of the cells of a law and of missing modes are computed; the other
        values are the same without them, in less than half the time. Without them there is no band.

    Returns
    -------
    Backbone

    Raises
    ------
    PatchfemError
        If the scene has no rig, or the rig does not have this mode.
    """
    given = AmplitudesOrForces(() if amplitudes is None else amplitudes)
    return compute_backbones([model], mode, given, methods, progress, errors=errors)[0]


def compute_backbones(
    models: Sequence[Model],
    mode: str = "",
    given: AmplitudesOrForces = RANGE_AROUND_SLIP,
    methods=CURVE_METHODS,
    progress: Callable | None = None,
    *,
    errors: bool = True,
) -> list[Backbone]:
    """Compute frequency and damping of a mode of several rigs at the same amplitudes.

    The default amplitudes reach from a hundredth of the amplitude at which the complete contact slips to 15 times this
    amplitude, or to the amplitude at which the mode moves nearly freely; further ones lie where the curve changes fast.

    Parameters
    ----------
    models : sequence of Model
        Models of rigs, such as those of one scene with several values of a key.
    mode : str
        Name of the mode; "" for the first.
    given : AmplitudesOrForces
        Amplitudes [m] of the points, or forces [N] at the output, each of which gives an amplitude for each model.
    methods : sequence of str
        From CURVE_METHODS.
    progress : callable, optional
        Takes the name of a method that begins.
    errors : bool
        Whether the force and the errors are computed.

    Returns
    -------
    list of Backbone
        One for each model, in their order.

    Raises
    ------
    PatchfemError
        If a scene has no rig, a rig does not have this mode, or no amplitude has one of the forces.
    """
    # All models have the same amplitudes: those that hold a given force in any of them, so that curves can be compared.
    joints = []
    wanted = [np.asarray(given.amplitudes, float)]
    for model in models:
        with locate_errors(model.source):
            joint = build_joint(model, mode)._replace(has_errors=errors, has_force=errors)
            joints.append(joint)
            if len(given.forces):
                forced = joint._replace(has_force=True)
                wanted.append(find_amplitudes_of_forces(forced, given.forces))
    if not len(given.forces) and not len(given.amplitudes):
        wanted.append(default_amplitudes(joints))
    amplitudes = _merge(np.concatenate(wanted))

    backbones = []
    for joint in joints:
        with locate_errors(joint.model.source):
            backbones.append(_compute(joint, mode, amplitudes, methods, progress))
    return backbones


def _merge(amplitudes) -> np.ndarray:
    """Return amplitudes in rising order, with one of each group that differs only by round-off."""
    ordered = np.unique(amplitudes)
    return ordered[np.append(True, np.diff(ordered) > EQUAL_AMPLITUDE_TOL * ordered[1:])]


def _compute(joint: JointMode, mode: str, amplitudes, methods, progress) -> Backbone:
    """Compute the backbone of a joint at amplitudes (k,) [m] by given methods.

    Parameters
    ----------
    joint : JointMode
        Mode with its contact.
    mode : str
        Name of the mode.
    amplitudes : (k,) array
        Amplitudes at the output [m].
    methods : iterable of str
        Keys of CURVE_FUNCTIONS.
    progress : callable or None
        Called with the name of each method before it begins.

    Returns
    -------
    Backbone
        A method that fails has its reason in `missing`.
    """
    model = joint.model
    if amplitudes[-1] > model.rig.springs.travel:
        raise PatchfemError(
            f"the largest amplitude, {format_length(amplitudes[-1], 3)}, is larger than the "
            "travel of the flexure; give smaller amplitudes with --amplitudes",
            "structure.travel",
        )

    # A rig with more modes shows the error of the modes that this one neglects.
    richer = None
    if joint.has_errors and model.rig.structure.richer_rig is not None:
        richer = build_joint(replace(model, rig=model.rig.structure.richer_rig), mode)

    # A method that fails leaves its reason in place of a curve
    curves = {}
    missing = {}
    for method in methods:
        if progress is not None:
            progress(method)
        try:
            curve = CURVE_FUNCTIONS[method](joint, amplitudes)
            if richer is not None:
                curve = _widen_by_missing_modes(curve, CURVE_FUNCTIONS[method](richer, amplitudes))
            curves[method] = curve
        except (NotConverged, PatchfemError) as reason:
            missing[method] = str(reason).removeprefix("backbone: ")

    # What follows from the curves: exponents of the loss, the amplitude of flutter, the band of both methods
    exponents = LossExponents()
    if not joint.is_linear:
        exponents = _fit_exponents(joint, curves.get("quasi-static", curves.get("balance")))
    backbone = Backbone(
        mode=_main_mode_name(joint),
        frequencies=_mode_frequencies(joint),
        curves=curves,
        missing=missing,
        exponents=exponents,
        flutter=_find_flutter_amplitude(joint, curves),
        notes=(),
        band=make_band(curves) if joint.has_errors else None,
    )

    backbone = backbone._replace(notes=words.write_notes(joint, amplitudes, backbone))
    if joint.has_errors:
        backbone = backbone._replace(advice=words.write_advice(joint, backbone))
    return backbone


def _widen_by_missing_modes(curve: Curve, richer: Curve) -> Curve:
    """Widen the errors of a curve by the effect of the modes that a reduced structure omits.

    `richer` is the curve of the same structure with more modes.
    """
    low, high = richer.amplitude[[0, -1]] * [1 - EQUAL_AMPLITUDE_TOL, 1 + EQUAL_AMPLITUDE_TOL]
    curve = curve.at((curve.amplitude >= low) & (curve.amplitude <= high))
    if not curve.amplitude.size:
        raise NotConverged(
            "the check by a computation with more modes of the structure found no free motion at "
            "these amplitudes; raise structure.reduced.modes"
        )
    values = curve.interpolate(curve.amplitude)
    added = estimate_errors_from_finer(values, richer.interpolate(curve.amplitude))
    errors = {}
    for name in CURVE_QUANTITIES:
        errors[f"{name}_error"] = getattr(curve, f"{name}_error") + added[name]
    return curve._replace(**errors)


def _main_mode_name(joint: JointMode) -> str:
    """Return the name of the structural mode with the largest component in the mode of a joint."""
    modes = joint.modes
    if not joint.model.rig.structure.lists_modes:
        return f"{joint.mode + 1}"
    shapes = np.eye(modes.omega.size) if modes.shapes is None else np.abs(modes.shapes)
    return modes.names[int(np.argmax(shapes[:, joint.mode]))]


def _mode_frequencies(joint: JointMode) -> ModeFrequencies:
    """Return the frequencies [Hz] of the mode of a joint without its contact, and with the contact stuck.

    The first includes a bonded spring, with its stiffness at rest if it is nonlinear. If the pieces alone are elastic,
    the second has the tangential stiffness of the patch that a run states, extrapolated over its meshes.
    """
    model = joint.model
    modes = joint.modes

    def find(rows, stiffness: float) -> float:
        """Return the frequency [Hz] of the mode if springs of a stiffness [N/m] hold given interfaces.

        `rows` (i, n) are their relative displacements per unit of each modal coordinate.
        """
        return modes.compute_stuck_mode(rows, np.array([stiffness]), joint.mode)[0] / (2 * np.pi)

    # Without the contact, the bonded spring at rest alone holds the interface.
    free = modes.omega[joint.mode] / (2 * np.pi)
    if model.rig.springs.interlock is not None:
        free = find(modes.interfaces[:1], model.rig.springs.interlock[0])
    if joint.stuck_mode.omega is None:
        reason = "no friction acts" if joint.is_linear else "a rigid contact leaves no motion"
        return ModeFrequencies(free, None, reason=reason)

    # Stuck: the stiffness of the patch in full stick holds the interface, if the mode does not contain it yet. Modes
    # that were measured with the joint include it.
    stiffness = find_stuck_patch_stiffness(model, (joint.patch, *joint.coarser))
    has_joint = len(modes.interfaces) > 1 or model.rig.structure.bolted is not None
    if stiffness is not None and not has_joint:
        stuck = find(modes.interfaces, stiffness.value)
        high = find(modes.interfaces, stiffness.value + stiffness.error)
        return ModeFrequencies(free, stuck, high - stuck)

    # Otherwise the mode of the joint is that with all elastic parts of the contact, and the error is that of the joint
    # which was subtracted from the modes.
    free_error = 0.0
    if joint.stiffer is not None:
        shift = joint.stiffer.model.rig.modes.omega[joint.mode] - modes.omega[joint.mode]
        free_error = abs(shift) / (2 * np.pi)
    return ModeFrequencies(free, joint.stuck_mode.omega / (2 * np.pi), free_error=free_error)


def _fit_exponents(joint: JointMode, curve: Curve | None) -> LossExponents:
    """Fit the exponents of the energy loss per cycle as a power of the amplitude, in micro-slip and in gross slip.

    In micro-slip it is the slope from the first to the last point, in gross slip that of the last two points. A loss
    counts if it exceeds MIN_LOSS_TO_ERROR_RATIO times its error and the round-off of the energy. `joint` gives the
    amplitude at which the whole contact slips, above which slip is gross.
    """
    if curve is None or curve.amplitude.size < 2 or not joint.friction_limit:
        return LossExponents()
    amplitude = curve.amplitude
    loss = curve.loss

    # Energy m v^2 of the mode with its largest speed v; a loss below the errors has no slope.
    speed = 2 * np.pi * curve.frequency * amplitude / joint.reach
    energy = joint.modes.mass * speed**2
    relative_error = MIN_LOSS_TO_ERROR_RATIO * 2 * np.pi * curve.damping_error
    known = loss > np.maximum(ROUND_OFF_ERROR, relative_error) * energy
    slip = joint.slip_amplitude
    # Largest ratio of an amplitude of micro-slip to the amplitude at the onset of gross slip.
    micro_slip = np.flatnonzero(known & (amplitude < 0.3 * slip))
    # Ratio of the smallest amplitude of gross slip to the amplitude at which the complete contact
    # begins to slip.
    gross_slip = np.flatnonzero(known & (amplitude > 3.0 * slip))

    # The error of a slope is the sum of the relative errors of the losses at its ends over the width.
    loss_error = (2 * np.pi * curve.damping_error + ROUND_OFF_ERROR) * energy
    slopes = []
    errors = []
    for points, first in ((micro_slip, 0), (gross_slip, -2)):
        slope = None
        error = None
        if points.size > 1:
            ends = points[[first, -1]]
            width = np.diff(np.log(amplitude[ends]))[0]
            slope = np.diff(np.log(loss[ends]))[0] / width
            error = (loss_error[ends] / loss[ends]).sum() / width
        slopes.append(slope)
        errors.append(error)
    return LossExponents(*slopes, *errors)


def _find_flutter_amplitude(joint: JointMode, curves: dict[str, Curve]) -> float | None:
    """Find the largest amplitude [m] at which the damping of a mode changes from positive to negative.

    Two points of a curve enclose it. Brent's method finds the root of damping times amplitude, which is a straight line
    under Coulomb friction, from further points of the same curve. The result is None if the damping never changes so.
    """
    falls = {}
    for method, curve in curves.items():
        falls[method] = np.flatnonzero((curve.damping[:-1] > 0) & (curve.damping[1:] <= 0))
    method = next((name for name, places in falls.items() if places.size), None)
    if method is None:
        return None
    curve = curves[method]
    ends = falls[method][-1] + [0, 1]
    amplitudes = curve.amplitude[ends]
    losses = amplitudes * curve.damping[ends]
    joint = joint._replace(has_errors=False, has_force=False)

    def net_loss(log_amplitude: float) -> float:
        """Return the product of damping ratio and amplitude [m], given the log of the amplitude."""
        point = CURVE_FUNCTIONS[method](joint, np.exp([log_amplitude]))
        return point.damping[0] * point.amplitude[0]

    try:
        # Relative error of the flutter amplitude, smaller than the digits that are printed.
        return np.exp(brentq(net_loss, *np.log(amplitudes), xtol=1e-8))
    except (NotConverged, PatchfemError, ValueError):
        # No further point is known, so the root of the chord between the two points is used.
        fraction = losses[0] / (losses[0] - losses[1])
        return amplitudes[0] + fraction * (amplitudes[1] - amplitudes[0])
