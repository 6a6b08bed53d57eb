"""Records of a backbone: the curves of a mode, its frequencies and exponents of the loss."""

from typing import NamedTuple

import numpy as np

METHODS = ("balance", "decay", "quasi-static")


class Curve(NamedTuple):
    """Frequency and damping of a mode against amplitude, by one method.

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
    other_modes : (k,) array or None
        For a decay, the motion of other modes / amplitude; NaN if it is not known.
    """

    amplitude: np.ndarray
    frequency: np.ndarray
    frequency_error: np.ndarray
    damping: np.ndarray
    damping_error: np.ndarray
    loss: np.ndarray
    notes: tuple = ()
    other_modes: np.ndarray | None = None

    def at(self, pick) -> "Curve":
        """Return the curve at some of its points, selected by bools (k,) or by a slice."""
        others = None if self.other_modes is None else self.other_modes[pick]
        return Curve(
            amplitude=self.amplitude[pick],
            frequency=self.frequency[pick],
            frequency_error=self.frequency_error[pick],
            damping=self.damping[pick],
            damping_error=self.damping_error[pick],
            loss=self.loss[pick],
            notes=self.notes,
            other_modes=others,
        )

    def interpolate(self, amplitudes) -> dict:
        """Return frequency and damping at other amplitudes (k,) [m] by name."""
        return {
            name: np.interp(amplitudes, self.amplitude, getattr(self, name))
            for name in ("frequency", "damping")
        }


class ModeFrequencies(NamedTuple):
    """Frequencies [Hz] of a mode without its contact and with a contact that sticks.

    stuck: None if the contact does not move in the mode; stuck_error: None if it is not known.
    """

    free: float
    stuck: float | None
    stuck_error: float | None = None


class LossExponents(NamedTuple):
    """Exponents of the loss of the contact as a power of the amplitude; None if not determined.

    micro: in micro-slip; gross: in gross slip; micro_theory: theoretical value in micro-slip.
    """

    micro: float | None = None
    gross: float | None = None
    micro_theory: float | None = None


class Backbone(NamedTuple):
    """Curves of a mode.

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
    """

    mode: str
    frequencies: ModeFrequencies
    curves: dict
    missing: dict
    exponents: LossExponents
    flutter: float | None
    notes: tuple
