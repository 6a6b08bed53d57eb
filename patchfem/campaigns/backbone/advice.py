"""Advice on a backbone: where each method is valid, and which curve a designer should use."""

import numpy as np

from ...effects import law_has_trait
from ...formatting import format_length, format_quantity
from .band import Band, forced_mode_ratio
from .joint import JointMode
from .notes import REPORT_OTHER_MODES
from .records import ROUND_OFF_ERROR, match_amplitudes

AGREEMENT = 0.02  # Largest relative difference of the damping at which two methods agree.
MIN_REPORTED_LOSS = 0.05  # Smallest decrease of the amplitude per cycle that is reported.
MIN_REPORTED_RATIO = 0.05  # Smallest relative motion of other modes that is reported.
PURPOSES = {
    "balance": "it is the steady vibration in resonance, such as a test in phase resonance or a response near its peak",
    "quasi-static": "no curve of the steady vibration is known here, and in micro-slip both agree",
    "decay": "no curve of the steady vibration is known here; the damping of a ring-down may differ from it",
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
        if "decay" in missing:
            return ("No method gives a curve at these amplitudes; give others with --amplitudes.",)
        return ("No method gives a curve here; try --method decay, which neglects nothing.",)
    if joint.is_linear:
        return ("All methods agree: no friction acts, so frequency and damping are constant.",)
    curve = curves[band.method]
    sentences = [
        f"Use the curve of method {band.method}: {PURPOSES[band.method]}.",
        *_describe_slip(joint, curve),
        _describe_band_width(band, curve),
        *_describe_agreement(band, curves),
        *_describe_ring_down(joint, band, curves, has_failed="decay" in missing),
        *_describe_static_curve(band, curves),
        *_describe_coupling(joint, band, curve),
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


def _describe_band_width(band: Band, curve) -> str:
    """Describe where the band of the damping ratio is widest, and the largest deviation of the frequency."""
    frequency = _largest_distance(curve.frequency, band.frequency_low, band.frequency_high)
    damping = _largest_distance(curve.damping, band.damping_low, band.damping_high)
    k = int(np.argmax(damping))
    content = "the numerical error"
    if band.ring_down is not None:
        content += " and what the other kinds of test read"
    return (
        f"Its band contains {content}; it is widest at "
        f"{format_length(curve.amplitude[k], 3)}, where the damping ratio is {band.damping_low[k]:.3g} to "
        f"{band.damping_high[k]:.3g} beside {curve.damping[k]:.3g}, and the frequency is within "
        f"{100 * frequency.max():.2g} % everywhere."
    )


def _largest_distance(value, low, high) -> np.ndarray:
    """Return the largest relative deviation (k,) of a value from the limits of its band."""
    return np.maximum(high - value, value - low) / np.maximum(np.abs(value), 1e-300)


def _describe_agreement(band: Band, curves: dict) -> list:
    """State the largest amplitude up to which the methods agree within the numerical error."""
    if band.ring_down is None:
        return []
    curve = curves[band.method]
    distance = np.maximum(band.damping_high - curve.damping, curve.damping - band.damping_low)
    beyond = np.flatnonzero(distance > AGREEMENT * np.abs(curve.damping) + curve.damping_error)
    within = f"within {100 * AGREEMENT:g} % of the damping, apart from the numerical error"
    if not beyond.size:
        return [
            f"The computed methods and the predicted ring-down agree {within}, at all amplitudes."
        ]
    if not beyond[0]:
        return []
    edge = format_length(curve.amplitude[beyond[0] - 1], 3)
    return [f"Up to {edge} the computed methods and the predicted ring-down agree {within}."]


def _describe_ring_down(joint: JointMode, band: Band, curves: dict, *, has_failed: bool) -> list:
    """Describe how the damping of a ring-down differs from that of the curve, and why.

    has_failed: whether method decay was tried and has no curve.
    """
    curve = curves[band.method]
    if band.ring_down is None:
        return []
    damping = band.ring_down.damping
    errors = np.zeros(curve.amplitude.size)
    is_computed = "decay" in curves
    if is_computed:
        here, there = match_amplitudes(curve, curves["decay"])
        damping = np.full(curve.amplitude.size, np.nan)
        damping[here] = curves["decay"].damping[there]
        errors[here] = curves["decay"].damping_error[there] + curve.damping_error[here]
    is_known = (damping > 0) & (curve.damping > curve.damping_error + ROUND_OFF_ERROR)
    if not is_known.any():
        return ["How the damping of a ring-down differs is not known at these amplitudes."]
    is_known &= np.abs(damping - curve.damping) > errors
    ratio = np.where(is_known, damping / curve.damping, 1.0)
    k = int(np.argmax(np.abs(ratio - 1)))
    if abs(ratio[k] - 1) <= AGREEMENT:
        verb = "has" if is_computed else "is predicted to have"
        return [
            f"A ring-down (method decay) {verb} the same damping within {100 * AGREEMENT:g} % and the numerical error."
        ]
    reasons = []
    if ratio[k] > 1 and not joint.is_rigid:
        reasons.append(
            "the joint stiffens as the amplitude falls, so the amplitude loses more than the energy"
        )
    lost_fraction = -np.expm1(-2 * np.pi * damping[k])
    if lost_fraction > MIN_REPORTED_LOSS:
        reasons.append(
            f"a cycle takes {100 * lost_fraction:.2g} % of the amplitude, so the decay gives means over unequal motions"
        )
    size = f"{100 * abs(ratio[k] - 1):.2g} % {'more' if ratio[k] > 1 else 'less'}"
    because = f": {'; '.join(reasons)}" if reasons else ""
    place = format_length(curve.amplitude[k], 3)
    if is_computed:
        return [
            f"The ring-down (method decay) reads {size} damping at {place}, where it differs most{because}."
        ]
    coupled = ""
    if joint.modes.omega.size > 1:
        coupled = ", and neglects the exchange of energy between the modes"
    return [
        f"A ring-down (method decay) is predicted to read {size} damping at {place}, where it differs most{because}. "
        f"This is an estimate without a run of the decay{coupled}; the band allows for its error."
        + ("" if has_failed else " For the curve of a ring-down, run --method decay.")
    ]


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


def _describe_coupling(joint: JointMode, band: Band, curve) -> list:
    """Describe the coupling of the mode with the other modes."""
    modes = joint.modes
    if modes.omega.size == 1:
        return []
    ratio = forced_mode_ratio(joint, curve)
    change = 0.0
    if band.ring_down is not None:
        change = float(np.nan_to_num(band.ring_down.shape_change).max())
    omega = 2 * np.pi * curve.frequency[-1]
    others = np.delete(modes.omega, joint.mode)
    nearest = others[np.argmin(np.abs(others - omega))] / (2 * np.pi)
    name = format_quantity(float(nearest), "Hz", 4)
    if max(ratio.max(), change) < MIN_REPORTED_RATIO:
        return [f"The coupling with the other modes (nearest: {name} without the contact) is weak."]
    size = f"by up to {100 * ratio.max():.2g} % of its motion"
    if ratio.max() >= 1:
        size = "as much as the mode itself"
    shape = ""
    if change > REPORT_OTHER_MODES and not joint.is_rigid:
        shape = (
            f", and a cycle of a ring-down changes its shape by up to {100 * change:.2g} %, so that the modes "
            "exchange energy"
        )
    return [
        f"The mode is coupled with the one of {name} (without the contact): a force at the output moves other modes "
        f"{size}{shape}; a test reads the curve only if it isolates the mode."
    ]
