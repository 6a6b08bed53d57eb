"""Natural frequencies and damping ratios of a free decay, from a fit of decaying sinusoids."""

from dataclasses import dataclass

import numpy as np

from ..core import PatchfemError
from .sinusoids import SinusoidFit, SinusoidProblem

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
    problem = SinusoidProblem(time, value, [np.ones(time.size)])

    def is_better(before: SinusoidFit, after: SinusoidFit) -> bool:
        """Return whether a further sinusoid is distinct and fits more than noise."""
        return _are_distinct(time, after.poles) and after.rms <= MAX_RESIDUAL_RATIO * before.rms

    fit = problem.fit(lambda one: _find_starts(time, one), is_better, MAX_SINUSOIDS, MIN_MISFIT)
    if not fit.poles.size:
        raise PatchfemError("the record contains no decaying oscillation")

    # sinusoids that decay, and whose energy counts
    design, _ = problem.tabulate(fit.poles)
    linear = problem.project(design)
    motions = design * linear.coefficients
    energy = np.sum((motions[:, 1::2] + motions[:, 2::2]) ** 2, axis=0)
    is_kept = (fit.damping > 0) & (energy > MIN_AMPLITUDE_RATIO**2 * energy.max())
    if not is_kept.any():
        raise PatchfemError(
            "the oscillation in the record grows instead of decaying; begin the record after the drive "
            "has ended"
        )
    order = np.flatnonzero(is_kept)[np.argsort(fit.omega[is_kept])]
    return Decay(
        frequency=(fit.omega / (2 * np.pi))[order],
        damping=fit.damping[order],
        amplitude=np.hypot(*problem.split_coefficients(linear).T)[order],
        damping_error=(problem.estimate_rate_errors(fit) / fit.omega)[order],
        misfit=fit.rms / problem.scale,
    )


def _are_distinct(time, poles) -> bool:
    """Return whether all sinusoids differ in frequency and decay slower than they oscillate."""
    omega, rate = poles.T
    distances = np.diff(np.sort(omega))
    are_apart = (distances >= MIN_SPECTRAL_LINE_SPACING * 2 * np.pi / time[-1]).all()
    return bool(are_apart and (np.abs(rate) < omega).all())


def _find_starts(time, fit: SinusoidFit) -> list[np.ndarray]:
    """Return initial poles (2,) of a further sinusoid at the highest spectral line of the residual.

    Several decay rates are tried. Lines near a fitted sinusoid are excluded, because a residual there is due
    to a decay that is not exponential, which increases the misfit.
    """
    even_times = np.linspace(0, time[-1], time.size)
    n_padded = 4 * even_times.size
    duration = n_padded * (even_times[1] - even_times[0])
    lines = np.abs(np.fft.rfft(np.interp(even_times, time, fit.residual), n_padded))
    lines[:2] = 0.0
    frequency = np.arange(lines.size) / duration
    for known_frequency, rate in fit.poles / (2 * np.pi):
        distance = max(MIN_SPECTRAL_LINE_SPACING / time[-1], rate)
        lines[np.abs(frequency - known_frequency) < distance] = 0.0
    omega = 2 * np.pi * int(np.argmax(lines)) / duration
    return [np.array([omega, scaled_rate / time[-1]]) for scaled_rate in START_DECAY_RATES]
