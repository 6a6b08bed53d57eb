"""Frequencies and damping ratios of a free decay: x = c + sum_r e^(-s_r t) (a_r cos w_r t + b_r sin w_r t).

No window touches the record, so its damping carries no bias of one. (w_r, s_r) are searched, all else is linear
(variable projection). Sinusoids are added at the highest line of what is left while each takes away its share of it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ..core import PatchfemError
from .variable_projection import Projection, project, standard_errors

MOST = 8  # sinusoids
GAIN = 0.8  # of the root mean square: a further sinusoid that leaves more is noise
WHOLE = 1e-9  # of the record: less is round-off
BESIDE = 3  # lines 1/T of a record of length T: nearer to a sinusoid there is no other
# of the record: modes with less energy than this share (of the amplitude) are left out
FAINT = 0.01


@dataclass(frozen=True, eq=False, slots=True)
class Decay:
    """Sinusoids of a free decay by rising frequency.

    frequency: (n,) [Hz], undamped, w/(2 pi); damping: (n,), s/w with w^2 = w_r^2 + s^2; amplitude: (n,) at the first
    row; error: (n,) 95 % half-width of the damping from what is left over; misfit: its share of the record.
    """

    frequency: np.ndarray
    damping: np.ndarray
    amplitude: np.ndarray
    error: np.ndarray
    misfit: float

    def decrement(self) -> np.ndarray:
        """Logarithmic decrements 2 pi zeta / sqrt(1 - zeta^2), (n,)."""
        return 2 * np.pi * self.damping / np.sqrt(1 - self.damping**2)


def decay(time, value) -> Decay:
    """Fit of a free decay, value (k,) at times (k,) [s] from the moment on when nothing drives.

    PatchfemError for fewer than 32 rows, and where nothing decays.
    """
    if time.size < 32:
        raise PatchfemError(f"the free decay has {time.size} samples; at least 32 are needed")
    time, size = time - time[0], np.sqrt(np.mean((value - value.mean()) ** 2))
    poles, last = np.empty(0), size
    rest = value - value.mean()
    while poles.size < 2 * MOST and last > WHOLE * size:
        tries = [
            _refined(time, value, np.append(poles, start)) for start in _starts(time, rest, poles)
        ]
        tries = [one for one in tries if _apart(time, one[0])]
        if not tries:
            break
        better, left = min(tries, key=lambda one: np.linalg.norm(one[1]))
        rms = np.sqrt(np.mean(left**2))
        if rms > GAIN * last:
            break
        poles, last, rest = better, rms, left
    if not poles.size:
        raise PatchfemError("the record contains no decaying oscillation")
    return _described(time, value, poles, last / size)


def _described(time, value, poles, misfit) -> Decay:
    own, rate = poles[0::2], poles[1::2]
    columns = _columns(time, poles)
    found = project(columns, value)
    shares = columns * found.coefficients
    amplitude = np.hypot(*found.coefficients[1:].reshape(-1, 2).T)
    energy = np.array(
        [np.sum((shares[:, 2 * k + 1] + shares[:, 2 * k + 2]) ** 2) for k in range(own.size)]
    )
    kept = (rate > 0) & (energy > FAINT**2 * energy.max())
    if not kept.any():
        raise PatchfemError(
            "the oscillation in the record grows instead of decaying; begin the record after the drive "
            "has ended"
        )
    w = np.hypot(own, rate)
    spread = standard_errors(_slopes(time, columns, found), misfit * np.std(value))
    order = np.flatnonzero(kept)[np.argsort(w[kept])]
    return Decay(
        (w / (2 * np.pi))[order],
        (rate / w)[order],
        amplitude[order],
        (1.96 * spread[1::2] / w)[order],
        float(misfit),
    )


def _apart(time, poles) -> bool:
    """Whether no two sinusoids stand beside each other and each turns faster than it decays."""
    own, rate = poles[0::2], poles[1::2]
    steps = np.diff(np.sort(own))
    return bool((steps >= BESIDE * 2 * np.pi / time[-1]).all() and (np.abs(rate) < own).all())


def _columns(time, poles) -> np.ndarray:
    parts = [np.ones(time.size)]
    for own, rate in poles.reshape(-1, 2):
        fall = np.exp(-np.clip(rate * time, -50.0, 700.0))
        parts += [fall * np.cos(own * time), fall * np.sin(own * time)]
    return np.stack(parts, axis=1)


def _slopes(time, columns, found: Projection) -> np.ndarray:
    """Return the derivatives (k, 2 n) of the residual over the poles."""
    out = []
    for k in range(1, columns.shape[1], 2):
        cosine, sine = columns[:, k : k + 2].T
        a, b = found.coefficients[k : k + 2]
        out += [time * (b * cosine - a * sine), -time * (a * cosine + b * sine)]
    return found.jacobian(np.stack(out, axis=1))


def _refined(time, value, poles) -> tuple:
    """(poles, what they leave) of the least-squares problem from a start."""

    def slopes(poles) -> np.ndarray:
        columns = _columns(time, poles)
        return _slopes(time, columns, project(columns, value))

    found = least_squares(
        lambda p: project(_columns(time, p), value).residual,
        poles,
        slopes,
        x_scale="jac",
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-15,
        max_nfev=60,
    )
    return found.x, -found.fun


def _starts(time, rest, poles) -> list:
    """Starting values (w_r, s_r) at the highest line of what is left, with three decays.

    Lines beside a sinusoid that is there are passed over: what is left of it is no other mode but a decay that is not
    exponential, which the misfit tells.
    """
    even = np.linspace(0, time[-1], time.size)
    size = 4 * even.size
    lines = np.abs(np.fft.rfft(np.interp(even, time, rest), size))
    lines[:2] = 0.0
    hertz = np.arange(lines.size) / (size * (even[1] - even[0]))
    for own, rate in poles.reshape(-1, 2) / (2 * np.pi):
        lines[np.abs(hertz - own) < max(BESIDE / time[-1], rate)] = 0.0
    own = 2 * np.pi * int(np.argmax(lines)) / (size * (even[1] - even[0]))
    return [np.array([own, share / time[-1]]) for share in (0.3, 3.0, 30.0)]
