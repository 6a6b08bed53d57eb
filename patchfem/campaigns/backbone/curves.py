"""Backbone of a mode: curves by all methods, loss exponents and flutter amplitude."""

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from ...core import NotConverged, PatchfemError
from ...effects import law_has_trait
from ...formatting import format_length
from ...model.model import Model
from ...model.source import locate_errors
from ...response.errors import finer_errors
from ...runs.joint import find_stuck_patch_stiffness
from . import notes
from .advice import write_advice
from .balance import compute_balance_curve
from .band import make_band
from .joint import JointMode, build_joint
from .linear import compute_constant_curve
from .quasi_static import compute_static_curve
from .records import (
    AMPLITUDE_TOL,
    METHODS,
    ROUND_OFF_ERROR,
    Answer,
    Backbone,
    Curve,
    LossExponents,
    ModeFrequencies,
)

# Ratio of the smallest amplitude of gross slip to the amplitude at which the complete contact
# begins to slip.
MIN_GROSS_SLIP_RATIO = 3.0
REMOVED_METHODS = {
    "decay": 'was removed in patchfem 2.0; run a release with drive.kind = "free", whose result has frequency and damping '
    "over the amplitude",
    "all": "was removed in patchfem 2.0; leave it out: both methods are the default",
}
# Relative error of the flutter amplitude, smaller than the digits that are printed.
FLUTTER_TOL = 1e-8


def choose_methods(method: str | None) -> tuple:
    """Return the method of a given name; all methods for "" and None.

    Raises
    ------
    PatchfemError
        If no method has this name.
    """
    if not method:
        return METHODS
    if method in REMOVED_METHODS:
        raise PatchfemError(f"backbone: method {method!r} {REMOVED_METHODS[method]}")
    if method not in METHODS:
        raise PatchfemError(
            f"backbone: method {method!r} does not exist; use one of {', '.join(METHODS)}"
        )
    return (method,)


def compute_backbone(
    model: Model,
    mode: str = "",
    amplitudes=None,
    methods=METHODS,
    progress=None,
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
        Increasing, at the output [m]. By default from a hundredth of the amplitude at which the
        complete contact slips to 15 times this amplitude, or to the amplitude at which the mode
        moves nearly freely.
    methods : sequence of str
        From METHODS.
    progress : callable, optional
        Takes the name of a method that begins.
    errors : bool
        Whether the errors of the mesh, of the cells of a law and of missing modes are computed; the
        values are the same without them, in less than half the time. Without them there is no band.

    Returns
    -------
    Backbone

    Raises
    ------
    PatchfemError
        If the scene has no rig, or the rig does not have this mode.
    """
    with locate_errors(model.source):
        joint = build_joint(model, mode)._replace(has_errors=errors)
        if amplitudes is None:
            amplitudes = joint.default_amplitudes()
        amplitudes = np.unique(np.asarray(amplitudes, float))
        if amplitudes[-1] > joint.model.rig.springs.travel:
            raise PatchfemError(
                f"the largest amplitude, {format_length(amplitudes[-1], 3)}, is larger than the "
                "travel of the flexure; give smaller amplitudes with --amplitudes",
                "structure.travel",
            )
        richer = None
        if errors and model.rig.structure.richer_rig is not None:
            richer = build_joint(replace(model, rig=model.rig.structure.richer_rig), mode)
        curves = {}
        missing = {}
        for method in methods:
            if progress is not None:
                progress(method)
            try:
                curve = compute_curve(joint, amplitudes, method)
                if richer is not None:
                    richer_curve = compute_curve(richer, amplitudes, method)
                    curve = _widen_by_missing_modes(curve, richer_curve)
                curves[method] = curve
            except (NotConverged, PatchfemError) as reason:
                missing[method] = str(reason).removeprefix("backbone: ")
        answer = Answer()
        if errors:
            band = make_band(curves)
            answer = Answer(band, write_advice(joint, band, curves, missing))
    return _assemble_backbone(joint, amplitudes, curves, missing)._replace(answer=answer)


def compute_curve(joint: JointMode, amplitudes, method: str) -> Curve:
    """Compute the frequency and damping curve of a mode by a given method.

    Parameters
    ----------
    joint : JointMode
    amplitudes : (k,) array
        Increasing, at the output [m].
    method : str
        One of METHODS.

    Returns
    -------
    Curve

    Raises
    ------
    NotConverged, PatchfemError
        If there is no curve.
    """
    if joint.is_linear:
        return compute_constant_curve(joint, amplitudes)
    if method == "balance":
        return compute_balance_curve(joint, amplitudes)
    return compute_static_curve(joint, amplitudes)


def _widen_by_missing_modes(curve: Curve, richer: Curve) -> Curve:
    """Widen the errors of a curve by the effect of the modes that a reduced structure omits.

    richer: the curve of the structure with more modes.
    """
    low, high = richer.amplitude[[0, -1]] * [1 - AMPLITUDE_TOL, 1 + AMPLITUDE_TOL]
    curve = curve.at((curve.amplitude >= low) & (curve.amplitude <= high))
    if not curve.amplitude.size:
        raise NotConverged(
            "the check by a computation with more modes of the structure found no free motion at "
            "these amplitudes; raise structure.reduced.modes"
        )
    values = curve.interpolate(curve.amplitude)
    added = finer_errors(values, richer.interpolate(curve.amplitude))
    return curve._replace(
        frequency_error=curve.frequency_error + added["frequency"],
        damping_error=curve.damping_error + added["damping"],
    )


def _assemble_backbone(joint: JointMode, amplitudes, curves: dict, missing: dict) -> Backbone:
    """Assemble the backbone from its curves at the requested amplitudes (k,) [m]."""
    exponents = LossExponents()
    first = curves.get("quasi-static", curves.get("balance"))
    sentences = [
        *joint.model.describe_removed_joint(),
        *notes.note_linear_rig(joint),
        *notes.note_gaps(amplitudes, curves),
    ]
    if not joint.is_linear:
        exponents = _fit_exponents(joint, first)
        sentences += notes.note_differences(curves)
        if exponents.micro_theory is not None and exponents.micro is None:
            sentences += notes.note_micro_slip(joint, amplitudes)
    sentences += notes.note_missing_mesh(joint)
    for curve in curves.values():
        sentences += curve.notes
    sentences += notes.note_secant_stiffness(joint, amplitudes, curves)
    sentences += notes.note_wear(joint.model)
    flutter = None
    for method, curve in curves.items():
        if flutter is None:
            flutter = _flutter_amplitude(joint, method, curve)
    return Backbone(
        mode=_main_mode_name(joint),
        frequencies=_mode_frequencies(joint),
        curves=curves,
        missing=missing,
        exponents=exponents,
        flutter=flutter,
        notes=tuple(sentences),
    )


def _main_mode_name(joint: JointMode) -> str:
    """Return the name of the structural mode with the largest component in the coordinate."""
    modes = joint.modes
    if not joint.model.rig.structure.lists_modes:
        return f"{joint.mode + 1}"
    shapes = np.eye(modes.omega.size) if modes.shapes is None else np.abs(modes.shapes)
    return modes.names[int(np.argmax(shapes[:, joint.mode]))]


def _mode_frequencies(joint: JointMode) -> ModeFrequencies:
    """Return the frequencies [Hz] of a mode without its contact and with a sticking contact.

    The first includes a bonded spring, with its stiffness at rest if it is nonlinear. The second
    uses the stiffness that a run of the patch prints, extrapolated over its meshes, if the pieces
    alone are elastic.
    """
    model = joint.model
    modes = joint.modes
    spring = model.rig.springs.interlock
    free = float(modes.omega[joint.mode])
    if spring is not None:
        free = modes.compute_stuck_mode(modes.interfaces[:1], np.array([spring[0]]), joint.mode)[0]
    free = free / (2 * np.pi)
    stuck = joint.stuck_mode.omega
    if stuck is None:
        return ModeFrequencies(free, None)
    stiffness = find_stuck_patch_stiffness(model, (joint.patch, *joint.coarser))
    # Modes that were measured with the joint include the stiffness of the joint.
    has_joint = len(modes.interfaces) > 1 or model.rig.structure.bolted is not None
    if stiffness is None or has_joint:
        return ModeFrequencies(free, stuck / (2 * np.pi), free_error=_free_frequency_error(joint))
    stuck = _stuck_frequency(joint, stiffness.value)
    high = _stuck_frequency(joint, stiffness.value + stiffness.error)
    return ModeFrequencies(free, stuck, high - stuck)


def _free_frequency_error(joint: JointMode) -> float:
    """Return the error [Hz] of the frequency without the contact, due to the joint that was subtracted."""
    if joint.stiffer is None:
        return 0.0
    omega = joint.stiffer.model.rig.modes.omega[joint.mode]
    return abs(float(omega - joint.modes.omega[joint.mode])) / (2 * np.pi)


def _stuck_frequency(joint: JointMode, stiffness: float) -> float:
    """Return the frequency [Hz] of a mode with a sticking contact of a given stiffness [N/m]."""
    modes = joint.modes
    omega, _ = modes.compute_stuck_mode(modes.interfaces, np.array([stiffness]), joint.mode)
    return omega / (2 * np.pi)


def _fit_exponents(joint: JointMode, curve: Curve | None) -> LossExponents:
    """Fit the exponents of energy loss over amplitude in micro-slip and in gross slip.

    In micro-slip it is the slope from the first to the last point, in gross slip that of the last
    two points. A loss counts if it exceeds MIN_LOSS_RATIO times its error and the round-off of the
    energy.
    """
    theory = _theoretical_exponent(joint)
    if curve is None or curve.amplitude.size < 2 or not joint.friction_limit:
        return LossExponents(micro_theory=theory)
    amplitude = curve.amplitude
    loss = curve.loss
    speed = 2 * np.pi * curve.frequency * amplitude / joint.reach
    energy = joint.modes.mass * speed**2
    relative_error = notes.MIN_LOSS_RATIO * 2 * np.pi * curve.damping_error
    known = loss > np.maximum(ROUND_OFF_ERROR, relative_error) * energy
    slip = joint.slip_amplitude
    micro = np.flatnonzero(known & (amplitude < notes.MAX_MICRO_SLIP_RATIO * slip))
    gross = np.flatnonzero(known & (amplitude > MIN_GROSS_SLIP_RATIO * slip))[-2:]
    return LossExponents(_loss_slope(curve, micro), _loss_slope(curve, gross), theory)


def _loss_slope(curve: Curve, points) -> float | None:
    """Return the log-log slope of the loss between the first and the last of the given points.

    It is None for fewer than two points.
    """
    if points.size < 2:
        return None
    ends = points[[0, -1]]
    low_loss, high_loss = curve.loss[ends]
    low, high = curve.amplitude[ends]
    return float(np.log(high_loss / low_loss) / np.log(high / low))


def _theoretical_exponent(joint: JointMode) -> float | None:
    """Return the theoretical loss exponent in micro-slip; None if no theory applies.

    It is chi + 3 for sliders (Segalman 2005), and 3 for bonds and for pieces whose pressure falls
    to 0 at the edges of the contact (Cattaneo, Mindlin).
    """
    friction = joint.model.friction
    if friction is None or not joint.friction_limit:
        return None
    if law_has_trait(friction.law, "cells"):
        return friction.chi + 3
    is_elastic = joint.model.partial_slip or joint.model.rig.friction.has_partial_slip
    return 3.0 if law_has_trait(friction.law, "bonds") or is_elastic else None


def _flutter_amplitude(joint: JointMode, method: str, curve: Curve) -> float | None:
    """Find the largest amplitude [m] at which the damping changes from positive to negative.

    The curve gives the two amplitudes that enclose the root. Brent's method on damping x amplitude,
    which is a straight line under Coulomb friction, computes further points of the same curve. It
    is None if there is no such root.
    """
    falls = np.flatnonzero((curve.damping[:-1] > 0) & (curve.damping[1:] <= 0))
    if not falls.size:
        return None
    bracket = slice(falls[-1], falls[-1] + 2)
    low, high = np.log(curve.amplitude[bracket])
    loss_low, loss_high = (curve.damping * curve.amplitude)[bracket]
    known = {low: loss_low, high: loss_high}

    def net_loss(log_amplitude: float) -> float:
        """Return the product of damping ratio and amplitude [m], given the log of the amplitude."""
        if log_amplitude not in known:
            amplitude = np.array([np.exp(log_amplitude)])
            point = compute_curve(joint._replace(has_errors=False), amplitude, method)
            known[log_amplitude] = float(point.damping[0] * amplitude[0])
        return known[log_amplitude]

    try:
        return float(np.exp(brentq(net_loss, low, high, xtol=FLUTTER_TOL)))
    except (NotConverged, PatchfemError):
        # No further point is known, so the root of the chord between the two points is used.
        amplitudes = curve.amplitude[bracket]
        fraction = loss_low / (loss_low - loss_high)
        return float(amplitudes[0] + fraction * (amplitudes[1] - amplitudes[0]))
