"""Modes of a scene from a driven record or a free decay."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..measures.decay_curve import DecayCurve, HalfCycles, fit_decay_curve, fit_slopes
from .decay import fit_decay
from .driven_modes import DERIVATIVE_ORDERS, MAX_FITTED_SAMPLES, fit_driven_modes
from .half_cycles import describe_missing_samples_at_end, find_half_cycles
from .sinusoids import FittedModes

# Largest half-width of the interval of a damping ratio, relative to the damping ratio.
MAX_ZETA_ERROR_RATIO = 2.0


@dataclass(frozen=True, eq=False, slots=True)
class ListedModes:
    """Measured modes in the form of the tables [[structure.mode]] of a scene.

    - frequency: natural frequencies (n,) [Hz].
    - damping: damping ratios (n,).
    - rows: mode-shape components (n,) by key of the table.
    - mass: modal mass [kg]; None if the record does not determine it.
    - descriptions: description of each mode.
    - notes: sentences for the user.
    """

    frequency: np.ndarray
    damping: np.ndarray
    rows: dict[str, np.ndarray]
    mass: float | None
    descriptions: list[str]
    notes: list[str] = field(default_factory=list)


class _ModeRows(NamedTuple):
    """Mode-shape components and modal mass, from residues.

    - rows: components (n,) by key of the table of a mode.
    - mass: modal mass [kg], or None.
    - notes: sentences for the user.
    """

    rows: dict[str, np.ndarray]
    mass: float | None
    notes: list[str]


def find_response_name(values: dict[str, np.ndarray]) -> str:
    """Return the name of the response in a record.

    Raises PatchfemError unless the record has exactly one.
    """
    names = [name for name in DERIVATIVE_ORDERS if name in values]
    if len(names) != 1:
        raise PatchfemError(
            f"exactly one response is needed ({' or '.join(DERIVATIVE_ORDERS)}), but the record has "
            f"{', '.join(names) or 'none'}: choose one with --map"
        )
    return names[0]


def find_time_step(time: np.ndarray) -> float:
    """Return the time step [s] of an equally sampled record.

    `time` (k,) are the sample times [s]. Raises PatchfemError if they are not equally spaced.
    """
    step = (time[-1] - time[0]) / (time.size - 1)
    deviation = np.abs(time - time[0] - step * np.arange(time.size)).max() / step
    # Largest error of a sample time in time steps; times in text files may have only six digits.
    if deviation > max(1e-3, 1e-5 * time.size):
        raise PatchfemError(
            f"the times deviate from an even step of {step:.6g} s by up to {deviation:.2g} of this step; an "
            "evenly sampled record is needed"
        )
    return float(step)


def identify_driven_modes(
    values: dict[str, np.ndarray], band: tuple[float, float] = (0.0, np.inf)
) -> ListedModes:
    """Identify modes from the response to a force at the same point or to a base acceleration.

    An acceleration must be absolute, a displacement or a velocity relative to the base. The slide of the
    contact is assumed to be the motion at the measured point.

    Parameters
    ----------
    values : dict
        Time, one input and one response (k,) in SI by name.
    band : (float, float)
        Frequency band [Hz] of the modes.

    Raises
    ------
    PatchfemError
        If the record lacks time, input or response, has several inputs or responses, or shows no mode.
    """
    response_name = find_response_name(values)
    # Possible inputs of a record
    inputs = [name for name in ("force", "base_acceleration") if name in values]
    if len(inputs) != 1 or "time" not in values:
        raise PatchfemError(
            "modes need time, a response and one input (force or base_acceleration), "
            "but the record "
            "has " + ", ".join(values) + ": choose channels with --map, or use --decay for a free "
            "decay"
        )

    input_name = inputs[0]
    step = find_time_step(values["time"])
    excitation = values[input_name]
    response = values[response_name]
    # The modes describe the motion relative to the base.
    if input_name == "base_acceleration" and response_name == "acceleration":
        response = response - excitation

    # Frequencies, damping ratios and residues of the modes. Residues give the shapes and, under a force, the modal mass.
    modes = fit_driven_modes(step, excitation, response, response_name, band)
    rows, mass, notes = (
        _convert_force_residues(modes) if input_name == "force" else _convert_base_residues(modes)
    )

    # Largest misfit of a driven response for which no note is issued.
    if modes.misfit > 0.1:
        notes.append(
            f"the modes leave {100 * modes.misfit:.0f} % of the response (root mean square) unexplained: the "
            "record is noisy, or the rig is not linear"
        )
    if excitation.size > MAX_FITTED_SAMPLES:
        notes.append(
            f"the modes are fitted to the first {MAX_FITTED_SAMPLES} of {excitation.size} samples, a duration of "
            f"{MAX_FITTED_SAMPLES * step:.4g} s"
        )

    return ListedModes(
        frequency=modes.frequency,
        damping=modes.damping,
        rows=rows,
        mass=mass,
        descriptions=[
            f"damping {zeta:.4g} +- {error:.1g} from the whole record"
            for zeta, error in zip(modes.damping, modes.damping_error)
        ],
        notes=notes,
    )


def _convert_force_residues(modes: FittedModes) -> _ModeRows:
    """Return mode-shape components at the drive point and the modal mass, from residues.

    The components are relative to that of the first mode, whose residue is the reciprocal of the modal mass.
    """
    first = modes.residue[0]
    if first <= 0:
        raise PatchfemError(
            f"the mode at {modes.frequency[0]:.5g} Hz moves against the force: force and response are "
            "not at the same point, or one of the two has the wrong sign, so the modal mass is unknown"
        )
    motion = np.sqrt(np.abs(modes.residue) / first)
    notes = []
    for frequency in modes.frequency[modes.residue < 0]:
        notes.append(
            f"the mode at {frequency:.5g} Hz moves against the force, which is impossible if force and response are "
            "at the same point; the sign of this mode is ignored"
        )
    return _ModeRows({"slide": motion, "output": motion}, 1 / float(first), notes)


def _convert_base_residues(modes: FittedModes) -> _ModeRows:
    """Split the residues of a base excitation into participation and mode-shape component.

    The residue is the negative product of both factors, which are assumed to have the same magnitude before
    they are scaled.
    """
    product = -modes.residue
    magnitude = np.sqrt(np.abs(product))
    # the sum of the squared participations must not exceed 1
    scale = max(1.0, np.sqrt(np.sum(magnitude**2)))
    motion = np.sign(product) * magnitude * scale
    rows = {"slide": motion, "output": motion, "base": magnitude / scale}
    return _ModeRows(rows, None, ["a response to base motion gives no modal mass: set moving_mass"])


def _select_decay(
    values: dict[str, np.ndarray], begin: float | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the times [s] and samples of a response from the start of its decay.

    The decay starts at the time `begin` [s]. Default: the largest deviation from the final value.
    """
    value = values[find_response_name(values)]
    if "time" not in values:
        raise PatchfemError("a free decay needs a time channel; choose this channel with --map")
    time = values["time"]
    if begin is not None:
        start = int(np.searchsorted(time, begin))
        if start >= time.size:
            raise PatchfemError(
                f"the decay cannot begin at {begin:.4g} s (--begin): the record ends at {time[-1]:.4g} s"
            )
    else:
        final = value[-value.size // 20 :].mean()
        start = int(np.argmax(np.abs(value - final)))
    return time[start:], value[start:]


def compute_decay_curve(
    values: dict[str, np.ndarray], begin: float | None = None
) -> tuple[DecayCurve, list[str]]:
    """Compute frequency and damping ratio against amplitude from a measured free decay.

    The half cycles of a velocity or an acceleration are converted to those of a displacement by their own undamped
    angular frequency, because a frequency that changes with the amplitude changes their decrement. Amplitudes with a
    too uncertain damping ratio are omitted with a note.

    Parameters
    ----------
    values : dict
        Time and one displacement, velocity or acceleration, by name.
    begin : float, optional
        Start of the decay [s]. Default: the largest deviation from the final value.

    Returns
    -------
    curve : DecayCurve
        Curve against the amplitude [m].
    notes : list of str

    Raises
    ------
    PatchfemError
        If there is no decay above the noise.
    """
    time, value = _select_decay(values, begin)
    half_cycles = find_half_cycles(time, value)
    order = DERIVATIVE_ORDERS[find_response_name(values)]
    curve = fit_decay_curve(_convert_to_displacement(half_cycles, order))

    notes = []
    is_certain = curve.damping_error <= MAX_ZETA_ERROR_RATIO * np.abs(curve.damping)
    if curve.time.size and not is_certain.all():
        if not is_certain.any():
            raise PatchfemError(
                f"the damping ratio has an interval wider than {MAX_ZETA_ERROR_RATIO:g} times its value at all "
                f"{is_certain.size} amplitudes: the record has too few half cycles or too much noise"
            )
        notes.append(
            f"{np.count_nonzero(~is_certain)} of {is_certain.size} amplitudes are left out: the interval "
            f"of the damping ratio is wider than {MAX_ZETA_ERROR_RATIO:g} times its value there; "
            "more samples per cycle or less noise make it narrower"
        )
        curve = curve.select(is_certain)

    # A decay that ends early for want of samples would look complete.
    reason = describe_missing_samples_at_end(time, half_cycles)
    if reason:
        notes.append(f"the decay is followed up to {half_cycles.middle[-1]:.4g} s only: {reason}")
    return curve, notes


def _convert_to_displacement(half_cycles: HalfCycles, order: int) -> HalfCycles:
    """Return the half cycles of the displacement from those of its derivative of an order (0, 1 or 2).

    The derivative of exp(-s t) sin(w t) is larger by the undamped angular frequency, hypot(s, w).
    """
    if order == 0 or half_cycles.size.size < 4:
        return half_cycles
    half_periods = fit_slopes(half_cycles.middle, half_cycles.middle_noise)
    log_sizes = np.log(half_cycles.size)
    decrements = fit_slopes(log_sizes, half_cycles.size_noise / half_cycles.size)
    omega = np.hypot(np.pi, decrements.slope) / half_periods.slope
    # The half-width of a 95 % interval is about two standard deviations.
    omega_noise = order * half_periods.error / half_periods.slope / 2
    # Odd reflection extrapolates linearly from the inner half cycles to the first and the last one.
    omega, omega_noise = np.pad(
        [omega, omega_noise], [(0, 0), (1, 1)], "reflect", reflect_type="odd"
    )
    size = half_cycles.size / omega**order
    relative_noise = np.hypot(half_cycles.size_noise / half_cycles.size, omega_noise)
    return half_cycles._replace(size=size, size_noise=relative_noise * size)


def identify_decay_modes(values: dict[str, np.ndarray], begin: float | None = None) -> ListedModes:
    """Identify natural modes from a measured free decay.

    The decay starts at the time `begin` [s]. Default: the largest deviation from the final value.
    """
    decay = fit_decay(*_select_decay(values, begin))
    descriptions = []
    for zeta, error in zip(decay.damping, decay.damping_error):
        decrement = 2 * np.pi * zeta / np.sqrt(1 - zeta**2)
        descriptions.append(
            f"damping {zeta:.4g} +- {error:.1g}, logarithmic decrement {decrement:.4g}"
        )
    notes = [
        "a free decay gives neither the modal mass nor the mode shapes: set moving_mass, slide, base and output"
    ]
    # Largest misfit of a free decay for which no note is issued.
    if decay.misfit > 0.05:
        notes.append(
            f"the decay leaves {100 * decay.misfit:.0f} % of the record unexplained: the decay is noisy or "
            "not exponential, as with friction damping; the damping given is a mean over the record"
        )
    motion = np.zeros(decay.frequency.size)
    motion[np.argmax(decay.amplitude)] = 1.0
    rows = {"slide": motion, "output": motion}
    return ListedModes(decay.frequency, decay.damping, rows, None, descriptions, notes)
