"""Band of a backbone: the recommended curve with its numerical error and the difference of the two methods."""

from typing import NamedTuple

import numpy as np

from .records import METHODS, Curve, match_amplitudes


class Band(NamedTuple):
    """Recommended curve of a backbone with its band.

    The curve is that of `balance` where it exists: a steady vibration in phase resonance.

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
    method = next((name for name in METHODS if name in curves), None)
    if method is None:
        return None
    curve = curves[method]
    limits = []
    for name in ("frequency", "damping"):
        value = getattr(curve, name)
        error = getattr(curve, f"{name}_error")
        low, high = value - error, value + error
        for other in curves.values():
            here, there = match_amplitudes(curve, other)
            value = getattr(other, name)[there]
            error = getattr(other, f"{name}_error")[there]
            low[here] = np.fmin(low[here], value - error)
            high[here] = np.fmax(high[here], value + error)
        limits += low, high
    return Band(method, curve.amplitude, *limits)
