"""Advice on a backbone: where each method is valid, and which curve a designer should use."""

import numpy as np

from ...effects import law_has_trait
from ...formatting import format_length, format_quantity
from .band import Band
from .joint import JointMode
from .records import ROUND_OFF_ERROR, match_amplitudes

AGREEMENT = 0.02  # Largest relative difference of the damping at which two methods agree.
MIN_REPORTED_LOSS = 0.05  # Smallest decrease of the amplitude per cycle that is reported.
MIN_REPORTED_RATIO = 0.05  # Smallest relative motion of other modes that is reported.
PURPOSES = {
    "balance": "it is the steady vibration in resonance, such as a test in phase resonance or a response near its peak",
    "quasi-static": "no curve of the steady vibration is known here, and in micro-slip both agree",
}


def write_advice(joint: JointMode, band: Band | None, curves: dict, missing: dict) -> tuple:
    """Write the advice on which curve to use, its band, and the ranges of validity of the methods.

    Parameters
    ----------
    joint : JointMode
    band : Band or None
    curves : dict of Curve
        By method.
    missing : dict of str
        By method, the reason why it has no curve.
    """
    if band is None:
        return (
            "No method gives a curve at these amplitudes; give others with --amplitudes, or run a release with "
            'drive.kind = "free".',
        )
    if joint.is_linear:
        return ("All methods agree: no friction acts, so frequency and damping are constant.",)
    curve = curves[band.method]
    sentences = [
        f"Use the curve of method {band.method}: {PURPOSES[band.method]}.",
        *_describe_slip(joint, curve),
        _describe_band_width(band, curve, len(curves)),
        *_describe_static_curve(band, curves),
        *_describe_coupling(joint, curve),
        *_describe_fast_decay(curve),
    ]
    for method, reason in missing.items():
        sentences.append(f"Method {method} has no curve here: {reason}.")
    return tuple(sentences)


def _describe_slip(joint: JointMode, curve) -> list:
    """Describe at which amplitude friction reaches its limit, and below which it dissipates nothing.

    The first amplitude follows from the stiffness of the sticking contact.
    """
    if not joint.friction_limit or joint.is_rigid:
        return []
    edge = format_length(joint.slip_amplitude, 3)
    sentences = [
        f"At the stiffness of the sticking contact, friction would reach its limit at {edge}."
    ]
    # Micro-slip has no onset: the smallest slider of a mesh or of a density sets where its loss begins.
    model = joint.model
    has_partial_slip = model.partial_slip or model.rig.friction.has_partial_slip
    laws = [interface.numbers.law for interface in model.rig.friction.interfaces]
    if has_partial_slip or any(law_has_trait(law, "cells") for law in laws):
        return sentences
    slips = curve.loss > ROUND_OFF_ERROR * joint.spring * (curve.amplitude / joint.reach) ** 2
    count = int(np.argmax(slips)) if slips.any() else curve.amplitude.size
    if count and not np.isnan(curve.loss).any():
        edge = format_length(curve.amplitude[count - 1], 3)
        sentences.append(
            f"Up to {edge} friction dissipates nothing, and the damping ratio is that of the structure."
        )
    return sentences


def _describe_band_width(band: Band, curve, n_curves: int) -> str:
    """Describe where the band of the damping ratio is widest, and the largest deviation of the frequency."""
    frequency = _largest_distance(curve.frequency, band.frequency_low, band.frequency_high)
    damping = _largest_distance(curve.damping, band.damping_low, band.damping_high)
    k = int(np.argmax(damping))
    content = "the numerical error"
    if n_curves > 1:
        content += " and the difference of the two methods"
    return (
        f"Its band is {content}; it is widest at {format_length(curve.amplitude[k], 3)}, where the damping ratio is "
        f"{band.damping_low[k]:.3g} to {band.damping_high[k]:.3g} beside {curve.damping[k]:.3g}, and the frequency is "
        f"within {100 * frequency.max():.2g} % everywhere."
    )


def _largest_distance(value, low, high) -> np.ndarray:
    """Return the largest relative deviation (k,) of a value from the limits of its band."""
    return np.maximum(high - value, value - low) / np.maximum(np.abs(value), 1e-300)


def _describe_static_curve(band: Band, curves: dict) -> list:
    """Describe where the quasi-static curve holds."""
    if band.method != "balance" or "quasi-static" not in curves:
        return []
    balance = curves["balance"]
    here, there = match_amplitudes(balance, curves["quasi-static"])
    if not here.size:
        return []
    static = curves["quasi-static"].at(there)
    balance = balance.at(here)
    is_beyond = np.zeros(here.size, bool)
    for name in ("frequency", "damping"):
        value = getattr(balance, name)
        errors = getattr(balance, f"{name}_error") + getattr(static, f"{name}_error")
        limit = AGREEMENT * np.abs(value) + errors + ROUND_OFF_ERROR
        is_beyond |= np.abs(getattr(static, name) - value) > limit
    tolerance = f"{100 * AGREEMENT:g} %"
    if not is_beyond.any():
        return [f"The quasi-static curve holds within {tolerance} at all its amplitudes."]
    first = int(np.argmax(is_beyond))
    if not first:
        return [
            f"The quasi-static curve differs by more than {tolerance} from its smallest amplitude on."
        ]
    edge = format_length(balance.amplitude[first - 1], 3)
    return [
        f"The quasi-static curve holds up to {edge} within {tolerance}; the notes give the largest difference."
    ]


def _describe_fast_decay(curve) -> list:
    """Say where a ring-down loses so much in a cycle that it reads means over unequal motions."""
    lost_fraction = -np.expm1(-2 * np.pi * curve.damping)
    k = int(np.argmax(lost_fraction))
    if lost_fraction[k] <= MIN_REPORTED_LOSS:
        return []
    return [
        f"A ring-down reads other values where it decays fast: at {format_length(curve.amplitude[k], 3)} a cycle takes "
        f"{100 * lost_fraction[k]:.2g} % of the amplitude."
    ]


def _describe_coupling(joint: JointMode, curve) -> list:
    """Describe the coupling of the mode with the other modes."""
    modes = joint.modes
    if modes.omega.size == 1:
        return []
    ratio = _forced_mode_ratio(joint, curve).max()
    omega = 2 * np.pi * curve.frequency[-1]
    others = np.delete(modes.omega, joint.mode)
    nearest = others[np.argmin(np.abs(others - omega))] / (2 * np.pi)
    name = format_quantity(float(nearest), "Hz", 4)
    if ratio < MIN_REPORTED_RATIO:
        return [f"The coupling with the other modes (nearest: {name} without the contact) is weak."]
    size = "as much as the mode itself"
    if ratio < 1:
        size = f"by up to {100 * ratio:.2g} % of its motion"
    return [
        f"The mode is coupled with the one of {name} (without the contact): a force at the output moves other modes "
        f"{size}; a test reads the curve only if it isolates the mode."
    ]


def _forced_mode_ratio(joint: JointMode, curve) -> np.ndarray:
    """Return the ratio (k,) of the motion of other modes to that of the mode under a force at the output.

    The force acts at the output and the friction at the contact, so each of them moves the other modes.
    """
    modes = joint.modes
    square = (2 * np.pi * curve.frequency) ** 2
    own = modes.output[joint.mode]
    row = modes.interfaces[joint.face] if len(modes.interfaces) else modes.output
    ratio = np.zeros(curve.amplitude.size)
    for k, omega in enumerate(modes.omega):
        if k == joint.mode or not own:
            continue
        participation = np.abs(modes.output[k] / own)
        if row[joint.mode]:
            participation += np.abs(row[k] / row[joint.mode])
        distance = np.maximum(np.abs(omega**2 - square), ROUND_OFF_ERROR * square)
        ratio += participation**2 * 2 * np.abs(curve.damping) * square / distance
    return np.minimum(ratio, 1.0)
