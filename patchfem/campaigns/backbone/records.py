"""Records of a backbone: curves of a mode, the recommended band, natural frequencies and loss exponents."""

from typing import NamedTuple

import numpy as np

from ...core import Measure

CURVE_METHODS = ("balance", "quasi-static")  # methods, the recommended one first
ROUND_OFF_ERROR = 1e-9  # Relative round-off error of a computed value.
EQUAL_AMPLITUDE_TOL = 1e-7  # Amplitudes with a smaller relative difference count as equal.
CURVE_QUANTITIES = ("frequency", "damping", "force")  # values of a curve that have an error
CURVE_UNITS = {"amplitude": "m", "frequency": "Hz", "damping": "1", "force": "N"}


class Curve(NamedTuple):
    """Frequency, damping and force of a mode against amplitude, computed by one method.

    Attributes
    ----------
    amplitude : (k,) array
        Amplitude at the output [m].
    frequency, frequency_error : (k,) array
        Frequency and its error [Hz].
    damping, damping_error : (k,) array
        Damping ratio and its error [1].
    force, force_error : (k,) array
        Amplitude of the force at the output that holds the phase resonance, and its error [N]; NaN if not known.
    loss : (k,) array
        Energy that the contact dissipates per cycle [J]; NaN if it is not known.
    force_frequency : (k,) array
        Frequency [Hz] at which the force is in phase with the velocity of the output; NaN if it is not known. It is that of
        the curve unless the force moves other modes, too.
    """

    amplitude: np.ndarray
    frequency: np.ndarray
    damping: np.ndarray
    force: np.ndarray
    frequency_error: np.ndarray
    damping_error: np.ndarray
    force_error: np.ndarray
    loss: np.ndarray
    force_frequency: np.ndarray

    def at(self, points) -> "Curve":
        """Return the curve at selected points, given by bools (k,), indices or a slice."""
        return Curve(*(column[points] for column in self))

    def get_measure(self, name: str, k: int) -> Measure:
        """Return the value and the error of one of CURVE_QUANTITIES at point k."""
        value = float(getattr(self, name)[k])
        return Measure(value, CURVE_UNITS[name], float(getattr(self, f"{name}_error")[k]))

    def list_measures(self) -> dict[str, Measure]:
        """Return frequency, damping ratio and force at both ends of the curve and the largest damping ratio, by name."""
        measures = {}
        for name in CURVE_QUANTITIES:
            measures[f"{name}_at_smallest_amplitude"] = self.get_measure(name, 0)
            measures[f"{name}_at_largest_amplitude"] = self.get_measure(name, -1)
        largest = int(np.argmax(self.damping))
        return measures | {"largest_damping": self.get_measure("damping", largest)}

    def interpolate(self, amplitudes) -> dict[str, np.ndarray]:
        """Interpolate the values linearly at amplitudes (k,) [m]; return a dict by name."""
        values = {}
        for name in CURVE_QUANTITIES:
            values[name] = np.interp(amplitudes, self.amplitude, getattr(self, name))
        return values


def make_curve(amplitude, values, errors) -> Curve:
    """Make a curve over amplitudes (k,) [m] from values and errors (4, k) or (5, k).

    The rows are frequency [Hz], damping ratio, loss [J], force [N] and, if it differs, the frequency of the force [Hz].
    """
    frequency, damping, loss, force, *forced = values
    frequency_error, damping_error, _, force_error, *_ = errors
    errors = (frequency_error, damping_error, force_error)
    return Curve(amplitude, frequency, damping, force, *errors, loss, *(forced or [frequency]))


def match_amplitudes(curve: Curve, other: Curve) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of the common amplitudes of a curve and another one, for each of them."""
    distance = np.abs(np.log(curve.amplitude[:, None] / other.amplitude[None]))
    return np.nonzero(distance < EQUAL_AMPLITUDE_TOL)


class Band(NamedTuple):
    """Recommended curve of a backbone with its band.

    The curve is that of `balance` where it exists: a steady vibration in phase resonance.

    - method: method of the recommended curve.
    - amplitude (k,): amplitudes of the curve [m].
    - frequency_low, frequency_high (k,): limits of the frequency [Hz].
    - damping_low, damping_high (k,): limits of the damping ratio [1].
    """

    method: str
    amplitude: np.ndarray
    frequency_low: np.ndarray
    frequency_high: np.ndarray
    damping_low: np.ndarray
    damping_high: np.ndarray


def make_band(curves: dict[str, Curve]) -> Band | None:
    """Return the recommended curve with its band; None if there is no curve.

    The band contains every curve, by method, with its numerical errors.
    """
    method = next((name for name in CURVE_METHODS if name in curves), None)
    if method is None:
        return None
    curve = curves[method]
    limits = []
    for name in ("frequency", "damping"):
        low = np.full(curve.amplitude.size, np.inf)
        high = -low
        for other in curves.values():
            indices, other_indices = match_amplitudes(curve, other)
            value = getattr(other, name)[other_indices]
            error = getattr(other, f"{name}_error")[other_indices]
            low[indices] = np.fmin(low[indices], value - error)
            high[indices] = np.fmax(high[indices], value + error)
        limits += low, high
    return Band(method, curve.amplitude, *limits)


class ModeFrequencies(NamedTuple):
    """Frequencies [Hz] of a mode without its contact and with a sticking contact.

    - free: frequency without the contact.
    - stuck: frequency with a sticking contact, or None without a motion or without friction.
    - stuck_error: error of `stuck`, or None if it is not known.
    - free_error: error of `free` due to a joint that was subtracted from the modes.
    - reason: why there is no `stuck`, or "" if there is one.
    """

    free: float
    stuck: float | None
    stuck_error: float | None = None
    free_error: float = 0.0
    reason: str = ""


class LossExponents(NamedTuple):
    """Exponents of the energy loss of a contact as a power of the amplitude.

    An exponent is None if it is not determined.

    - micro, micro_error: exponent in micro-slip, and its numerical error.
    - gross, gross_error: exponent in gross slip, and its numerical error.
    """

    micro: float | None = None
    gross: float | None = None
    micro_error: float | None = None
    gross_error: float | None = None


class Backbone(NamedTuple):
    """Backbone of a mode: its curves by all methods, frequencies and loss exponents.

    Attributes
    ----------
    mode : str
        Name of the mode.
    frequencies : ModeFrequencies
        Frequencies [Hz] without the contact, and with a sticking one.
    curves : dict of Curve
        By method.
    missing : dict of str
        By method, the reason why it has no curve.
    exponents : LossExponents
        Exponents of the energy loss in micro-slip and in gross slip.
    flutter : float or None
        Amplitude [m] above which the mode gains energy.
    notes : tuple of str
        Sentences for the user, such as on what the curves leave out.
    band : Band or None
        None without a curve, or without errors.
    advice : tuple of str
        Sentences on the curve to use and on where the methods hold.
    """

    mode: str
    frequencies: ModeFrequencies
    curves: dict[str, Curve]
    missing: dict[str, str]
    exponents: LossExponents
    flutter: float | None
    notes: tuple[str, ...]
    band: Band | None = None
    advice: tuple[str, ...] = ()

    @property
    def best(self) -> Curve | None:
        """Curve of the recommended method; None without a curve."""
        return next((self.curves[name] for name in CURVE_METHODS if name in self.curves), None)
