"""Records of a backbone: curves of a mode, its frequencies and its loss exponents."""

from typing import NamedTuple

import numpy as np

METHODS = ("balance", "quasi-static")  # methods, the recommended one first
ROUND_OFF_ERROR = 1e-9  # Relative round-off error of a computed value.
AMPLITUDE_TOL = 1e-7  # Amplitudes with a smaller relative difference count as equal.
COLUMNS = ("amplitude", "frequency", "frequency_error", "damping", "damping_error", "loss")


class Curve(NamedTuple):
    """Frequency and damping of a mode against amplitude, computed by a given method.

    Attributes
    ----------
    amplitude : (k,) array
        Amplitude at the output [m].
    frequency, frequency_error : (k,) array
        Frequency and its error [Hz].
    damping, damping_error : (k,) array
        Damping ratio and its error [1].
    loss : (k,) array
        Energy that the contact dissipates per cycle [J]; NaN if it is not known.
    notes : tuple of str
        Sentences about the errors.
    """

    amplitude: np.ndarray
    frequency: np.ndarray
    frequency_error: np.ndarray
    damping: np.ndarray
    damping_error: np.ndarray
    loss: np.ndarray
    notes: tuple = ()

    def at(self, points) -> "Curve":
        """Return the curve at selected points, given by bools (k,), indices or a slice."""
        columns = {name: getattr(self, name)[points] for name in COLUMNS}
        return self._replace(**columns)

    def interpolate(self, amplitudes) -> dict:
        """Interpolate frequency and damping linearly at amplitudes (k,) [m]; return a dict by name."""
        names = ("frequency", "damping")
        return {name: np.interp(amplitudes, self.amplitude, getattr(self, name)) for name in names}


def match_amplitudes(curve: Curve, other: Curve) -> tuple:
    """Return the indices of the common amplitudes of two curves, for each of them."""
    distance = np.abs(np.log(curve.amplitude[:, None] / other.amplitude[None]))
    return np.nonzero(distance < AMPLITUDE_TOL)


def make_curve(amplitude, values, errors, **columns) -> Curve:
    """Make a curve from values and errors; the energy loss is optional.

    It is the last row of the values if it is known, else NaN.

    Parameters
    ----------
    amplitude : (k,) array
        [m]
    values : sequence of (k,) arrays
        Frequency [Hz], damping ratio, and the loss [J] if it is known.
    errors : sequence of (k,) arrays
        Errors of the frequency and of the damping ratio; further rows are ignored.
    **columns
        Other fields of the curve.
    """
    frequency, damping, *loss = values
    loss = loss[0] if loss else np.full(amplitude.size, np.nan)
    return Curve(amplitude, frequency, errors[0], damping, errors[1], loss, **columns)


class ModeFrequencies(NamedTuple):
    """Frequencies [Hz] of a mode without its contact and with a sticking contact.

    stuck: None if the contact does not move in the mode; stuck_error: None if it is not known; free_error: due to a
    joint that was subtracted from the modes.
    """

    free: float
    stuck: float | None
    stuck_error: float | None = None
    free_error: float = 0.0


class LossExponents(NamedTuple):
    """Exponents of the energy loss of a contact as a power of the amplitude.

    An exponent is None if it is not determined.

    micro: in micro-slip; gross: in gross slip; micro_theory: theoretical value in micro-slip.
    """

    micro: float | None = None
    gross: float | None = None
    micro_theory: float | None = None


class Answer(NamedTuple):
    """Recommended curve of a backbone with its band, and advice on its use.

    Attributes
    ----------
    band : band.Band or None
        None without a curve.
    sentences : tuple of str
        Sentences on the curve to use and on where the methods hold.
    """

    band: object = None
    sentences: tuple = ()

    @property
    def advice(self) -> str:
        """Advice as one text, joined from its sentences."""
        return " ".join(self.sentences)


class Backbone(NamedTuple):
    """Backbone of a mode: its curves by all methods, frequencies and loss exponents.

    Attributes
    ----------
    mode : str
        Name of the mode.
    frequencies : ModeFrequencies
    curves : dict of Curve
        By method.
    missing : dict of str
        By method, the reason why it has no curve.
    exponents : LossExponents
    flutter : float or None
        Amplitude [m] above which the mode gains energy.
    notes : tuple of str
    answer : Answer
    """

    mode: str
    frequencies: ModeFrequencies
    curves: dict
    missing: dict
    exponents: LossExponents
    flutter: float | None
    notes: tuple
    answer: Answer = Answer()

    def add_notes(self, notes) -> "Backbone":
        """Return the backbone with further notes placed first."""
        return self._replace(notes=(*notes, *self.notes))
