"""Band of a backbone: the range of frequency and damping that tests of a mode measure.

The recommended curve is that of `balance` where it exists: a steady vibration in phase resonance. The band around it
contains its numerical error, the curve of a ring-down (computed, or predicted by `ring_down`), the quasi-static curve,
and the effect of the other modes that a force at a single place excites.

With an elastic contact the band at an amplitude does not depend on the other given amplitudes. Between amplitudes that
are far apart beside the onset of slip, linear interpolation of the band is less accurate than the band itself.
"""

from typing import NamedTuple

import numpy as np

from .joint import JointMode
from .records import ROUND_OFF_ERROR, Curve, match_amplitudes
from .ring_down import RingDown, predict_ring_down

PREFERRED_METHODS = ("balance", "quasi-static", "decay")  # Order in which a curve is recommended.
# Fraction of the distance of the predicted ring-down from the curve by which the band is widened, because the prediction
# is of second order in the loss of a half cycle.
RING_DOWN_MARGIN = 0.4
# Ratio of the motion of other modes to the amplitude of a ring-down, per relative change of its
# shape in a cycle, which excites these modes, and after a release that should excite a single mode.
SHAPE_EXCITATION = 0.1
RELEASE_EXCITATION = 1e-3
# Factor on the effect of other modes under a force at the output, which is of first order in the damping.
FORCED_MODE_FACTOR = 1.2
# Relative decrease of the frequency of a ring-down, divided by the square of the damping ratio: 1/2
# and terms of higher order.
VISCOUS_FALL = 0.6


class Band(NamedTuple):
    """Recommended curve of a backbone, with a band that contains the results of tests.

    Attributes
    ----------
    method : str
        Method of the recommended curve.
    amplitude : (k,) array
        Amplitudes of this curve [m].
    frequency_low, frequency_high : (k,) array
        [Hz]
    damping_low, damping_high : (k,) array
        Damping ratio.
    ring_down : RingDown or None
        Predicted ring-down.
    """

    method: str
    amplitude: np.ndarray
    frequency_low: np.ndarray
    frequency_high: np.ndarray
    damping_low: np.ndarray
    damping_high: np.ndarray
    ring_down: RingDown | None


class _Limits:
    """Lower and upper limits of a quantity at the amplitudes of a curve."""

    def __init__(self, value, error):
        self.low = value - error
        self.high = value + error

    def include(self, points, value, error) -> None:
        """Widen the limits to contain values with their errors; NaN changes nothing.

        Parameters
        ----------
        points : index
            Points of the curve.
        value, error : float or ndarray
            Value and error at these points.
        """
        self.low[points] = np.fmin(self.low[points], value - error)
        self.high[points] = np.fmax(self.high[points], value + error)


def make_band(joint: JointMode, curves: dict) -> Band | None:
    """Compute the band of the recommended curve; None if there is no curve.

    Parameters
    ----------
    joint : JointMode
    curves : dict of Curve
        By method.
    """
    method = next((name for name in PREFERRED_METHODS if name in curves), None)
    if method is None:
        return None
    curve = curves[method]
    frequency = _Limits(curve.frequency, curve.frequency_error)
    damping = _Limits(curve.damping, curve.damping_error)
    for other in curves.values():
        _include_curve(frequency, damping, curve, other)
    ring_down = None
    if method == "balance":
        ring_down = predict_ring_down(joint, curve)
        _include_forced_modes(joint, frequency, damping, curve)
    if ring_down is not None:
        _include_ring_down(joint, frequency, damping, curve, ring_down)
    return Band(
        method=method,
        amplitude=curve.amplitude,
        frequency_low=frequency.low,
        frequency_high=frequency.high,
        damping_low=damping.low,
        damping_high=damping.high,
        ring_down=ring_down,
    )


def _include_curve(frequency: _Limits, damping: _Limits, curve: Curve, other: Curve) -> None:
    """Widen the limits of a curve to contain another curve with its errors."""
    here, there = match_amplitudes(curve, other)
    other = other.at(there)
    frequency.include(here, other.frequency, other.frequency_error)
    damping.include(here, other.damping, other.damping_error)


def _include_ring_down(
    joint: JointMode, frequency: _Limits, damping: _Limits, curve: Curve, ring_down: RingDown
) -> None:
    """Widen the limits of a curve to contain a predicted ring-down."""
    every = slice(None)
    margin = RING_DOWN_MARGIN * np.abs(ring_down.damping - curve.damping)
    # Other modes of the relative motion e change the ratio of successive half cycles by up to 2 e.
    others = np.zeros(curve.amplitude.size)
    if joint.modes.omega.size > 1:
        others = RELEASE_EXCITATION + SHAPE_EXCITATION * ring_down.shape_change
    margin += others / np.pi
    margin += np.abs(ring_down.damping - ring_down.slow_damping)
    damping.include(every, ring_down.damping, margin + curve.damping_error)
    margin = np.abs(ring_down.frequency - curve.frequency) + curve.frequency_error
    margin += others * np.abs(curve.damping) * curve.frequency
    # Viscous damping lowers the frequency by the fraction zeta^2/2, and constant friction does not
    # change it.
    margin += VISCOUS_FALL * ring_down.damping**2 * curve.frequency
    frequency.include(every, ring_down.frequency, margin)


def _include_forced_modes(
    joint: JointMode, frequency: _Limits, damping: _Limits, curve: Curve
) -> None:
    """Widen the limits by the motion of other modes under a harmonic force at the output.

    They move in phase with the force, by the ratio r to the resonant motion at the output. This shifts the phase
    resonance by the fraction r zeta of the frequency, and increases the loss of a cycle by r^2.
    """
    ratio = FORCED_MODE_FACTOR * forced_mode_ratio(joint, curve)
    every = slice(None)
    frequency.include(every, curve.frequency, ratio * np.abs(curve.damping) * curve.frequency)
    damping.include(every, curve.damping, ratio**2 * np.abs(curve.damping))


def forced_mode_ratio(joint: JointMode, curve: Curve) -> np.ndarray:
    """Return the ratio (k,) of the motion of other modes to that of the mode under a force at the output.

    The force acts at the output and the friction at the contact, so each of them moves the other modes.
    """
    modes = joint.modes
    square = (2 * np.pi * curve.frequency) ** 2
    own = modes.output[joint.mode]
    row = modes.interfaces[joint.face] if len(modes.interfaces) else modes.output
    ratio = np.zeros(curve.amplitude.size)
    for k, omega in enumerate(modes.omega):
        if k != joint.mode and own:
            participation = np.abs(modes.output[k] / own)
            if row[joint.mode]:
                participation += np.abs(row[k] / row[joint.mode])
            distance = np.maximum(np.abs(omega**2 - square), ROUND_OFF_ERROR * square)
            ratio += participation**2 * 2 * np.abs(curve.damping) * square / distance
    return np.minimum(ratio, 1.0)
