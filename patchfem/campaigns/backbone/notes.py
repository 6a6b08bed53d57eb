"""Notes on the curves of a backbone: gaps, and differences between the methods."""

import numpy as np

from ...formatting import format_length
from ...model.model import Model
from ...runs.patch import faces
from .joint import MIN_AMPLITUDE_FACTOR, JointMode
from .records import Curve, match_amplitudes

# Largest ratio of an amplitude of micro-slip to the amplitude at the onset of gross slip.
MAX_MICRO_SLIP_RATIO = 0.3
# Smallest ratio of a loss to its error at which the loss is used to determine an exponent.
MIN_LOSS_RATIO = 4.0
MAX_LISTED_AMPLITUDES = 6  # Largest number of amplitudes that a sentence lists individually.
# Smallest ratio of two values that is reported as a ratio and not as a percentage.
MIN_REPORTED_RATIO = 2.0
MISSING_ERRORS = (
    "the errors of the curves do not account for the mesh, because no coarser mesh was computed: "
)
REASONS_OF_GAPS = {
    "balance": "harmonic balance did not converge at these amplitudes; the curve may turn back to "
    "smaller amplitudes, or the mode may stop oscillating",
    "quasi-static": "the static curve does not reach these amplitudes",
}
REASON_OF_DIFFERENCE = (
    "the static curve uses the secant stiffness between the turning points; harmonic balance uses the first harmonic of "
    "the force"
)


def note_linear_rig(joint: JointMode) -> list:
    """Return a list of notes if the scene has friction but no friction acts."""
    has_friction = joint.model.friction is not None or joint.model.rig.friction.interfaces
    if joint.is_linear and has_friction:
        return ["no friction acts, so frequency and damping are the same at all amplitudes"]
    return []


def note_wear(model: Model) -> list:
    """Return a list of notes on wear, which a backbone neglects."""
    return [] if model.wear is None else ["these curves are for unworn pieces: [wear] is ignored"]


def note_missing_mesh(joint: JointMode) -> list:
    """Return a list of notes on a contact with partial slip and without a coarser mesh."""
    model = joint.model
    if joint.is_linear:
        return []
    if not model.partial_slip or joint.coarse is not None:
        has_errors = not model.rig.friction.has_partial_slip or faces.has_error_meshes(model)
        return [] if has_errors else [MISSING_ERRORS + faces.NO_ERROR_ESTIMATE]
    advice = "leave out contact.element_size"
    if model.patch.mesh.file is not None:
        advice = "split the elements of contact.mesh"
    return [f"{MISSING_ERRORS}the interface has too few elements for a coarser mesh; {advice}"]


def note_micro_slip(joint: JointMode, amplitudes) -> list:
    """Return a list of notes on why the exponent of micro-slip is not determined."""
    edge = MAX_MICRO_SLIP_RATIO * joint.slip_amplitude
    if amplitudes[0] > edge:
        begin = format_length(MIN_AMPLITUDE_FACTOR / MAX_MICRO_SLIP_RATIO * edge, 2)
        return [
            f"the smallest amplitude, {format_length(amplitudes[0], 3)}, lies above the range of "
            f"micro-slip, which ends at about {format_length(edge, 2)}; to get the exponent of "
            f"micro-slip, begin --amplitudes at {begin}"
        ]
    return [
        "the exponent of micro-slip cannot be determined: fewer than two amplitudes below "
        f"{format_length(edge, 2)} have an energy loss of at least {MIN_LOSS_RATIO:g} times the "
        f"error of the loss; give amplitudes up to {format_length(edge, 2)}, or a smaller "
        "accuracy.tolerance"
    ]


def note_gaps(amplitudes, curves: dict) -> list:
    """Return a list of notes on the amplitudes (k,) [m] at which a curve has no value."""
    out = []
    for method, curve in curves.items():
        missing = amplitudes[~np.isin(amplitudes, curve.amplitude)]
        count = curve.amplitude.size
        if not missing.size or count == amplitudes.size:
            continue
        if missing.size > MAX_LISTED_AMPLITUDES:
            ends = [format_length(missing[k], 3) for k in (0, -1)]
            places = f"lie from {ends[0]} to {ends[1]}"
        else:
            places = f"are {', '.join(format_length(amplitude, 3) for amplitude in missing)}"
        out.append(
            f"method {method}: {count} of {amplitudes.size} amplitudes have a result; the amplitudes "
            f"without a result {places}: {REASONS_OF_GAPS[method]}"
        )
    return out


def note_secant_stiffness(joint: JointMode, amplitudes, curves: dict) -> list:
    """Return a list of notes on the secant stiffness of a quasi-static curve with slip.

    It is given if no curve by harmonic balance exists.

    Parameters
    ----------
    joint : JointMode
    amplitudes : (k,) array
        Requested amplitudes [m].
    curves : dict of Curve
        By method.
    """
    if joint.is_linear or not joint.friction_limit:
        return []
    slips = amplitudes[-1] > MAX_MICRO_SLIP_RATIO * joint.slip_amplitude
    if not slips or "quasi-static" not in curves or "balance" in curves:
        return []
    return [
        "--method quasi-static takes the stiffness from the two turning points of the motion; "
        "--method balance takes the stiffness from the first harmonic of "
        "the force, and this stiffness is lower once the contact slips. The frequencies by "
        "quasi-static are therefore higher than the frequencies by balance"
    ]


def note_differences(curves: dict) -> list:
    """Return a list of notes on curves that differ from harmonic balance by more than the errors of both."""
    if not {"balance", "quasi-static"} <= curves.keys():
        return []
    here, there = match_amplitudes(curves["quasi-static"], curves["balance"])
    static = curves["quasi-static"].at(here)
    balance = curves["balance"].at(there)
    return [
        sentence
        for name in ("frequency", "damping")
        for sentence in _note_largest_difference(name, static, balance)
    ]


def _note_largest_difference(name: str, static: Curve, balance: Curve) -> list:
    """Return a list of notes on the largest difference of "frequency" or "damping" between curves at equal amplitudes."""
    value = getattr(static, name)
    balance_value = getattr(balance, name)
    errors = getattr(static, f"{name}_error") + getattr(balance, f"{name}_error")
    difference = np.abs(value - balance_value)
    relative = np.where(difference > errors, difference / np.abs(balance_value), 0.0)
    if not relative.size or not relative.max() > 0:
        return []
    k = int(np.argmax(relative))
    ratio = value[k] / balance_value[k]
    size = f"by {100 * relative[k]:.2g} %"
    if ratio >= MIN_REPORTED_RATIO:
        size = f"where the value by quasi-static is {ratio:.2g} times the value by balance"
    return [
        f"the values of {name} by quasi-static and by balance differ most at the amplitude "
        f"{format_length(static.amplitude[k], 3)}, {size}: {REASON_OF_DIFFERENCE}"
    ]
