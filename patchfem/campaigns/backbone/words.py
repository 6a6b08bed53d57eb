"""Sentences on a backbone: notes on its curves, and advice on which curve to use and where the methods hold."""

import numpy as np

from ...formatting import format_length, format_number, format_quantity
from ...runs.patch import faces
from .joint import JointMode
from .records import ROUND_OFF_ERROR, Backbone, Curve

MIN_REPORTED_AMPLITUDE_LOSS = 0.05  # Smallest decrease of the amplitude per cycle that is reported.
# Smallest shift of the phase resonance by other modes that is reported, in half-widths of the resonance.
MIN_REPORTED_RESONANCE_SHIFT = 0.05
# Beginning of a note on a curve without error of the mesh
MISSING_MESH_ERROR_NOTE = (
    "the errors of the curves do not account for the mesh, because no coarser mesh was computed: "
)
# Reason why a curve has no value at some amplitudes, by method
REASONS_OF_GAPS = {
    "balance": "no periodic motion was found at these amplitudes; the curve may turn back to smaller amplitudes, or the "
    "mode may stop oscillating; give other --amplitudes",
    "quasi-static": "the static curve does not reach these amplitudes",
}
# Why rigid friction may have no such force
RIGID_FORCE_REASON = (
    ", where the friction may stop the motion under a force for a part of the cycle"
)
# What the curve of each method is for
METHOD_PURPOSES = {
    "balance": "it is the steady vibration in resonance, such as a test in phase resonance or a response near its peak",
    "quasi-static": "no curve of the steady vibration is known here, and in micro-slip both agree",
}
# Advice if no method has a curve
NO_CURVE_ADVICE = (
    "No method gives a curve at these amplitudes; give others with --amplitudes, or run a release with "
    'drive.kind = "free".'
)


def write_notes(joint: JointMode, amplitudes, backbone: Backbone) -> tuple[str, ...]:
    """Write notes on a backbone: gaps of the curves, what the errors leave out.

    `amplitudes` (k,) [m] are the requested ones.
    """
    model = joint.model
    curves = backbone.curves
    notes = []
    has_friction = model.friction is not None or model.rig.friction.interfaces
    if joint.is_linear and has_friction:
        notes.append("no friction acts, so frequency and damping are the same at all amplitudes")
    for method, curve in curves.items():
        notes += _note_gaps(amplitudes, method, curve)
        notes += _note_missing_forces(joint, method, curve)
    if not joint.is_linear:
        notes += _note_missing_mesh(joint)
    if model.wear is not None:
        notes.append("these curves are for unworn pieces: [wear] is ignored")
    return tuple(notes)


def _note_missing_mesh(joint: JointMode) -> list[str]:
    """Return a list of notes on a joint with partial slip and without a coarser mesh."""
    model = joint.model
    if not model.partial_slip or joint.coarse is not None:
        if not model.rig.friction.has_partial_slip or faces.has_error_meshes(model):
            return []
    advice = "leave out contact.element_size"
    if model.patch is not None and model.patch.mesh.file is not None:
        advice = "split the elements of contact.mesh"
    return [
        f"{MISSING_MESH_ERROR_NOTE}the interface has too few elements for a coarser mesh; {advice}"
    ]


def _note_missing_forces(joint: JointMode, method: str, curve: Curve) -> list[str]:
    """Return a list of notes on amplitudes of a curve whose force in phase resonance is not known.

    `joint` is the mode, and `method` the name of the method of the curve.
    """
    missing = curve.amplitude[np.isnan(curve.force)]
    if not missing.size:
        return []
    return [
        f"method {method}: no force in phase resonance was found at {missing.size} of {curve.amplitude.size} amplitudes, "
        f"{describe_span(missing)}{RIGID_FORCE_REASON * joint.is_rigid}"
    ]


def _note_gaps(amplitudes, method: str, curve: Curve) -> list[str]:
    """Return a list of notes on amplitudes (k,) [m] at which the curve of a method has no value."""
    missing = amplitudes[~np.isin(amplitudes, curve.amplitude)]
    count = curve.amplitude.size
    if not missing.size or count == amplitudes.size:
        return []
    return [
        f"method {method}: {count} of {amplitudes.size} amplitudes have a result; those without lie "
        f"{describe_span(missing)}: {REASONS_OF_GAPS[method]}"
    ]


def describe_span(amplitudes) -> str:
    """Return where amplitudes (k,) [m] in increasing order lie: from the first to the last, or at one place."""
    first, last = (format_length(amplitudes[k], 3) for k in (0, -1))
    return f"at {first}" if first == last else f"from {first} to {last}"


def write_advice(joint: JointMode, backbone: Backbone) -> tuple[str, ...]:
    """Write the advice on which curve of a backbone to use, its band, and where methods are valid.

    `joint` is the mode with its contact.
    """
    band = backbone.band
    reasons = []
    for method, reason in backbone.missing.items():
        reasons.append(f"Method {method} has no curve here: {reason}.")
    if band is None:
        return (NO_CURVE_ADVICE, *reasons)
    if joint.is_linear:
        return ("All methods agree: no friction acts, so frequency and damping are constant.",)
    curve = backbone.best
    sentences = [
        f"Use the curve of method {band.method}: {METHOD_PURPOSES[band.method]}.",
        *_describe_slip(joint, curve),
        describe_band_width(backbone),
        *_describe_coupling(joint, curve),
    ]

    # A ring-down reads means over unequal cycles.
    lost_fraction = -np.expm1(-2 * np.pi * curve.damping)
    k = int(np.argmax(lost_fraction))
    if lost_fraction[k] > MIN_REPORTED_AMPLITUDE_LOSS:
        sentences.append(
            f"A ring-down reads other values where it decays fast: at {format_length(curve.amplitude[k], 3)} a cycle "
            f"takes {100 * lost_fraction[k]:.0f} % of the amplitude."
        )
    return (*sentences, *reasons)


def _describe_slip(joint: JointMode, curve: Curve) -> list[str]:
    """Describe at which amplitudes of a curve the friction of a joint reaches its limit.

    That amplitude follows from the stiffness of the sticking contact. Another sentence says up to which amplitude
    friction dissipates nothing.
    """
    if not joint.friction_limit or joint.is_rigid:
        return []
    edge = format_length(joint.slip_amplitude, 3)
    sentences = [
        f"At the stiffness of the sticking contact, friction would reach its limit at {edge}."
    ]
    # Micro-slip has no onset: the smallest slider of a mesh or of a density sets where its loss begins.
    if joint.has_cells or joint.has_partial_slip:
        return sentences
    slips = curve.loss > ROUND_OFF_ERROR * joint.spring * (curve.amplitude / joint.reach) ** 2
    count = int(np.argmax(slips)) if slips.any() else curve.amplitude.size
    if count and not np.isnan(curve.loss).any():
        edge = format_length(curve.amplitude[count - 1], 3)
        sentences.append(
            f"Up to {edge} friction dissipates nothing, and the damping ratio is that of the structure."
        )
    return sentences


def describe_band_width(backbone: Backbone) -> str:
    """Describe where the band of the damping ratio of a backbone is widest.

    A second clause has the largest deviation of the frequency. A band that four digits do not show has no such place.
    """
    band = backbone.band
    curve = backbone.best
    deviations = {}
    for name in ("frequency", "damping"):
        value = getattr(curve, name)
        ends = np.array([getattr(band, f"{name}_low"), getattr(band, f"{name}_high")])
        deviations[name] = np.abs(ends - value).max(axis=0) / np.maximum(np.abs(value), 1e-300)
    k = int(np.argmax(deviations["damping"]))
    numbers = np.array([band.damping_low, band.damping_high, curve.damping])[:, k]
    low, high, best = (format_number(number, 4) for number in numbers.tolist())
    if low == high:
        largest = max(np.nanmax(one) for one in deviations.values())
        return (
            "The band of this curve holds the numerical error and, where both methods have a value, their difference: "
            f"at most {100 * largest:.1g} % of frequency and damping ratio."
        )
    return (
        "The band of this curve holds the numerical error and, where both methods have a value, their difference; it is "
        f"widest at {format_length(curve.amplitude[k], 3)}, where the damping ratio is {low} to {high} beside {best}, and "
        f"the frequency is within {100 * deviations['frequency'].max():.2g} % everywhere."
    )


def _describe_coupling(joint: JointMode, curve: Curve) -> list[str]:
    """Describe how far the phase resonance of a joint under a force lies beside its curve.

    The force acts at the output and moves other modes, too. A shift counts in relation to the half-width of the
    resonance, the damping ratio.
    """
    shift = np.abs(curve.force_frequency / curve.frequency - 1)
    if joint.modes.omega.size == 1 or not np.nanmax(shift, initial=0.0) > 0:
        return []
    ratio = shift / np.maximum(np.abs(curve.damping), ROUND_OFF_ERROR)
    k = int(np.nanargmax(ratio))
    if ratio[k] < MIN_REPORTED_RESONANCE_SHIFT:
        return ["The coupling with the other modes is weak."]
    frequency = format_quantity(curve.force_frequency[k], "Hz", 5)
    return [
        f"A force at the output moves the other modes, too: at {format_length(curve.amplitude[k], 3)} its phase resonance "
        f"has {frequency}, {100 * shift[k]:.2g} % beside the curve; a test reads the curve only if it isolates the mode."
    ]
