"""Natural frequencies and damping ratios of a free decay, from a fit of decaying sinusoids."""

import numpy as np

from ..core import PatchfemError
from .sinusoids import FittedModes, Limits, SinusoidFit, SinusoidProblem

MIN_DECAY_SAMPLES = 32  # smallest number of samples of a record
# Smallest distance of two sinusoids in spectral lines (1/T for a record of length T).
MIN_SPECTRAL_LINE_SPACING = 3
DAMPING_ROUND_OFF = 1e-10  # error of a damping ratio of a record without noise


def fit_decay(time, value) -> FittedModes:
    """Fit exponentially decaying sinusoids to a free decay.

    Parameters
    ----------
    time : (k,) ndarray
        Times [s] after the end of the drive.
    value : (k,) ndarray
        Displacement, velocity or acceleration.

    Raises
    ------
    PatchfemError
        If there are too few samples, or no decaying oscillation.
    """
    if time.size < MIN_DECAY_SAMPLES:
        raise PatchfemError(
            f"the free decay has {time.size} samples; at least {MIN_DECAY_SAMPLES} are needed: record it longer, or with "
            "a higher sampling rate"
        )
    time = time - time[0]
    problem = SinusoidProblem(time, value, [np.ones(time.size)])
    spacing = 2 * np.pi * MIN_SPECTRAL_LINE_SPACING / time[-1]
    # A further sinusoid that reduces the sum of squares by less fits noise
    limits = Limits(count=8, decrease=0.36, spacing=spacing)
    fit = problem.fit(lambda fit: _find_starts(time, fit), limits)
    if not fit.poles.size:
        raise PatchfemError(
            "the record contains no decaying oscillation; give the record of a free decay"
        )

    # sinusoids that decay, and whose energy counts
    motions = np.einsum("nkc,nc->nk", problem.tabulate(fit.poles)[:, 0], fit.coefficients)
    energy = np.sum(motions**2, axis=1)
    is_kept = fit.damping > DAMPING_ROUND_OFF
    # Smallest amplitude of a sinusoid, relative to the largest one
    is_kept &= energy > 0.01**2 * energy.max()
    if not is_kept.any():
        largest = int(np.argmax(energy))
        error = max(problem.estimate_damping_errors(fit)[largest], DAMPING_ROUND_OFF)
        behaviour = (
            f"neither decays nor grows beyond its error of {error:.1g}; give a longer record"
        )
        if fit.damping[largest] < -error:
            behaviour = "grows instead of decaying; begin the record after the drive has ended"
        raise PatchfemError(f"the oscillation in the record {behaviour}")
    return problem.select_modes(fit, is_kept)


def _find_starts(time, fit: SinusoidFit) -> list[np.ndarray]:
    """Return initial poles (angular frequency [rad/s], decay rate [1/s]) of a further sinusoid.

    It is at the highest spectral line of the residual of `fit` at the times `time` (n,) [s]. Several decay rates
    are tried. Lines near a fitted sinusoid are excluded, because a residual there is due to a decay that is not
    exponential, which increases the misfit.
    """
    even_times, step = np.linspace(0, time[-1], time.size, retstep=True)
    n_padded = 4 * time.size
    lines = np.abs(np.fft.rfft(np.interp(even_times, time, fit.residual), n_padded))
    omega = 2 * np.pi * np.fft.rfftfreq(n_padded, step)
    lines[:2] = 0.0
    for known_omega, rate in fit.poles:
        distance = max(2 * np.pi * MIN_SPECTRAL_LINE_SPACING / time[-1], rate)
        lines[np.abs(omega - known_omega) < distance] = 0.0
    start = omega[np.argmax(lines)]
    # Initial decay rates of a further sinusoid, times the record length.
    return [np.array([start, scaled_rate / time[-1]]) for scaled_rate in (0.3, 3.0, 30.0)]
