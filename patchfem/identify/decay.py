"""Natural frequencies and damping ratios of a free decay.

The model is x = c + sum_r e^(-s_r t) (a_r cos w_r t + b_r sin w_r t). The record is not windowed, so that the
damping has no bias. Only w_r and s_r are nonlinear parameters (variable projection). Sinusoids are added at the
highest spectral line of the residual, as long as each reduces the residual enough.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..core import PatchfemError
from .variable_projection import Projection, compute_standard_errors, project_data

MIN_SAMPLES = 32  # smallest number of samples of a record
MAX_SINUSOIDS = 8  # largest number of sinusoids in one fit
# Largest ratio of the residuals with and without a further sinusoid; beyond it, the sinusoid fits noise.
MAX_RESIDUAL_RATIO = 0.8
MIN_MISFIT = 1e-9  # smallest residual above round-off, relative to the record
# Smallest distance of two sinusoids in spectral lines (1/T for a record of length T).
MIN_SPECTRAL_LINE_SPACING = 3
MIN_AMPLITUDE_RATIO = 0.01  # smallest amplitude of a sinusoid, relative to the largest one
# Initial decay rates of a further sinusoid, times the record length.
START_DECAY_RATES = (0.3, 3.0, 30.0)


@dataclass(frozen=True, eq=False, slots=True)
class Decay:
    """Frequencies, damping ratios and amplitudes of the sinusoids of a free decay.

    - frequency: undamped natural frequencies (n,) [Hz], w/(2 pi) with w^2 = w_r^2 + s_r^2.
    - damping: damping ratios (n,), s_r/w.
    - amplitude: amplitudes (n,) at the first sample.
    - damping_error: half-widths (n,) of the 95 % intervals of the damping ratios.
    - misfit: root mean square of the residual relative to that of the record.
    """

    frequency: np.ndarray
    damping: np.ndarray
    amplitude: np.ndarray
    damping_error: np.ndarray
    misfit: float

    def decrement(self) -> np.ndarray:
        """Return the logarithmic decrements (n,), 2 pi zeta / sqrt(1 - zeta^2)."""
        return 2 * np.pi * self.damping / np.sqrt(1 - self.damping**2)


class _RefinedPoles(NamedTuple):
    """Poles of a free decay, with the residual of the fit.

    - poles: damped frequency [rad/s] and decay rate [1/s] of each sinusoid (2n,): w_1, s_1, w_2, ...
    - residual: model minus data (k,).
    """

    poles: np.ndarray
    residual: np.ndarray

    @property
    def rms(self) -> float:
        """Root mean square of the residual."""
        return np.sqrt(np.mean(self.residual**2))


def fit_decay(time, value) -> Decay:
    """Fit exponentially decaying sinusoids to a free decay.

    Parameters
    ----------
    time : (k,) ndarray
        Times [s] after the end of the drive.
    value : (k,) ndarray
        Displacement, velocity or acceleration.

    Returns
    -------
    Decay

    Raises
    ------
    PatchfemError
        If there are too few samples, or no decaying oscillation.
    """
    if time.size < MIN_SAMPLES:
        raise PatchfemError(
            f"the free decay has {time.size} samples; at least {MIN_SAMPLES} are needed"
        )
    time = time - time[0]
    best_fit = _RefinedPoles(np.empty(0), value - value.mean())
    record_rms = best_fit.rms
    while best_fit.poles.size < 2 * MAX_SINUSOIDS and best_fit.rms > MIN_MISFIT * record_rms:
        attempts = []
        for start in _find_starts(time, best_fit):
            attempt = _refine_poles(time, value, np.append(best_fit.poles, start))
            if _are_distinct(time, attempt.poles):
                attempts.append(attempt)
        if not attempts:
            break
        attempt = min(attempts, key=lambda attempt: np.linalg.norm(attempt.residual))
        if attempt.rms > MAX_RESIDUAL_RATIO * best_fit.rms:
            break
        best_fit = attempt
    if not best_fit.poles.size:
        raise PatchfemError("the record contains no decaying oscillation")
    return _make_decay(time, value, best_fit.poles, best_fit.rms / record_rms)


def _make_decay(time, value, poles, misfit: float) -> Decay:
    """Return natural frequencies, damping ratios and errors for the fitted poles of a decay."""
    damped_omega = poles[0::2]
    rate = poles[1::2]
    columns = _compute_columns(time, poles)
    linear = project_data(columns, value)
    # column 0 is the constant, followed by a cosine and a sine per sinusoid
    cos_sin_coefficients = linear.coefficients[1:].reshape(-1, 2)
    motions = columns * linear.coefficients
    energy = np.sum((motions[:, 1::2] + motions[:, 2::2]) ** 2, axis=0)
    is_kept = (rate > 0) & (energy > MIN_AMPLITUDE_RATIO**2 * energy.max())
    if not is_kept.any():
        raise PatchfemError(
            "the oscillation in the record grows instead of decaying; begin the record after the drive "
            "has ended"
        )
    omega = np.hypot(damped_omega, rate)
    errors = compute_standard_errors(
        _compute_derivatives(time, columns, linear), misfit * np.std(value)
    )
    order = np.flatnonzero(is_kept)[np.argsort(omega[is_kept])]
    return Decay(
        frequency=(omega / (2 * np.pi))[order],
        damping=(rate / omega)[order],
        amplitude=np.hypot(*cos_sin_coefficients.T)[order],
        damping_error=(1.96 * errors[1::2] / omega)[order],
        misfit=float(misfit),
    )


def _are_distinct(time, poles) -> bool:
    """Return whether all sinusoids differ in frequency and decay slower than they oscillate."""
    damped_omega = poles[0::2]
    distances = np.diff(np.sort(damped_omega))
    are_apart = (distances >= MIN_SPECTRAL_LINE_SPACING * 2 * np.pi / time[-1]).all()
    return bool(are_apart and (np.abs(poles[1::2]) < damped_omega).all())


def _compute_columns(time, poles) -> np.ndarray:
    """Return the design matrix of a decay fit: a constant, and a decaying cosine and sine per pole.

    The columns are (k, 1 + 2n).
    """
    columns = [np.ones(time.size)]
    for omega, rate in poles.reshape(-1, 2):
        envelope = np.exp(-np.clip(rate * time, -50.0, 700.0))
        columns += [envelope * np.cos(omega * time), envelope * np.sin(omega * time)]
    return np.stack(columns, axis=1)


def _compute_derivatives(time, columns, linear: Projection) -> np.ndarray:
    """Return the derivatives (k, 2n) of the residual of a decay fit with respect to its poles."""
    derivatives = []
    for k in range(1, columns.shape[1], 2):
        cosine, sine = columns[:, k : k + 2].T
        a, b = linear.coefficients[k : k + 2]
        derivatives += [time * (b * cosine - a * sine), -time * (a * cosine + b * sine)]
    return linear.jacobian(np.stack(derivatives, axis=1))


def _refine_poles(time, value, poles) -> _RefinedPoles:
    """Minimize the residual of a decay fit over the poles (2n,) from an initial guess."""

    def compute_jacobian(poles) -> np.ndarray:
        """Return the derivatives of the residual with respect to the poles."""
        columns = _compute_columns(time, poles)
        return _compute_derivatives(time, columns, project_data(columns, value))

    result = least_squares(
        lambda p: project_data(_compute_columns(time, p), value).residual,
        poles,
        compute_jacobian,
        x_scale="jac",
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-15,
        max_nfev=60,
    )
    return _RefinedPoles(result.x, -result.fun)


def _find_starts(time, best_fit: _RefinedPoles) -> list:
    """Return initial poles of a further sinusoid at the highest spectral line of the residual.

    Several decay rates are tried. Lines near a fitted sinusoid are excluded, because a residual there is due
    to a decay that is not exponential, which increases the misfit.
    """
    even_times = np.linspace(0, time[-1], time.size)
    n_padded = 4 * even_times.size
    duration = n_padded * (even_times[1] - even_times[0])
    lines = np.abs(np.fft.rfft(np.interp(even_times, time, best_fit.residual), n_padded))
    lines[:2] = 0.0
    frequency = np.arange(lines.size) / duration
    for known_frequency, rate in best_fit.poles.reshape(-1, 2) / (2 * np.pi):
        lines[
            np.abs(frequency - known_frequency) < max(MIN_SPECTRAL_LINE_SPACING / time[-1], rate)
        ] = 0.0
    omega = 2 * np.pi * int(np.argmax(lines)) / duration
    return [np.array([omega, scaled_rate / time[-1]]) for scaled_rate in START_DECAY_RATES]
