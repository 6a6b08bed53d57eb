"""Natural modes fitted to the time record of one response, without windows that widen peaks.

The model is that of `sinusoids` with the columns L f_-2 + U f + c, where L and U are the residuals of modes below
and above the band (Ewins, Modal testing, 2000). The input is assumed to be band-limited, and the response is computed by
Fourier transform, which is periodic. Free decays of the same modes represent the initial state and the jump between
the end and the start of the record. Modes are added at the spectral line where the residual depends most on the input.
"""

import numpy as np
from scipy.fft import irfft, rfft, rfftfreq

from ..core import PatchfemError
from ..measures.welch import average_segments, transform_segments
from .sinusoids import FittedModes, Limits, SinusoidFit, SinusoidProblem

# order of the time derivative of the displacement, by the quantity of the response
DERIVATIVE_ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
# Number of samples at each end that are not fitted, because of the jump of the periodic continuation.
N_EDGE_SAMPLES = 32
# Largest number of fitted samples, from the beginning of the record.
MAX_FITTED_SAMPLES = 2**16
MIN_ZETA = 1e-6  # lower bound of the damping ratios in the search
MAX_ZETA = 0.5  # upper bound of the damping ratios in the search
# Ratio of the length of the record to that of the windowed segments in which a further mode is sought.
N_RECORD_SEGMENTS = 8
MIN_RECORD_SAMPLES = 64 * N_RECORD_SEGMENTS  # smallest number of samples of a record
# Half-width of the main lobe of a Hann window, which hides the lines near 0, in spectral lines.
WINDOW_WIDTH_LINES = 1.5
# Highest frequency that is used, relative to the Nyquist frequency, because of filters and aliasing.
MAX_NYQUIST_FRACTION = 0.8


class _DrivenRecord:
    """Record of a response and its input (k,), with the samples that are fitted.

    `derivative` is the number of time derivatives between displacement and response.
    """

    def __init__(self, step: float, force, response, derivative: int):
        self.inner = slice(N_EDGE_SAMPLES, force.size - N_EDGE_SAMPLES)
        self.step = step
        self.force = force
        self.omega = 2 * np.pi * rfftfreq(force.size, step)
        self.input = (1j * self.omega) ** derivative * rfft(force)

        # modes below the band move as the double integral of the input, those above it in proportion to it
        lower = -self.input / np.maximum(self.omega, self.omega[1]) ** 2
        lower[0] = 0.0
        time = (step * np.arange(force.size))[self.inner]
        fixed = [np.ones(time.size), *self._transform(lower, self.input)]
        low = np.array([self.omega[1] / 2, MIN_ZETA * self.omega[1] / 2])
        high = np.array([1.0, MAX_ZETA]) * np.pi / step
        self.problem = SinusoidProblem(
            time, response[self.inner], fixed, self._compute_forced, (low, high)
        )

    def _transform(self, *spectra) -> np.ndarray:
        """Return the inverse Fourier transforms of n spectra at the samples that are fitted, (n, k)."""
        return irfft(spectra, self.force.size)[:, self.inner]

    def _compute_forced(self, omega: float, rate: float) -> np.ndarray:
        """Return the response of a mode to the input, and its derivatives by `omega` and by `rate`: (3, k) samples.

        `omega` [rad/s] is the damped circular frequency of the mode, and `rate` [1/s] the rate of its decay. The transfer
        function is 1/(omega^2 + (rate + i w)^2) at the circular frequency w.
        """
        pole = 1 / (omega**2 + rate**2 - self.omega**2 + 2j * rate * self.omega)
        response = self.input * pole
        by_rate = -2 * (rate + 1j * self.omega) * response * pole
        return self._transform(response, -2 * omega * response * pole, by_rate)

    def find_starts(self, fit: SinusoidFit) -> list[np.ndarray]:
        """Return initial poles, (angular frequency [rad/s], decay rate [1/s]), of a further mode.

        Their frequency is that at which the input explains most of the residual of `fit`, and several decay rates are
        tried. The explained part of the power of a spectral line is |G_xf|^2 / G_ff times the coherence, averaged over
        windowed segments: the H1 estimator of Bendat and Piersol, Random Data, ch. 6.
        """
        size = 2 * (self.force.size // (2 * N_RECORD_SEGMENTS))
        records = (self.force[self.inner], fit.residual)
        frequency, transforms = transform_segments(self.step, records, size)
        densities = average_segments(*transforms)
        power = np.abs(densities.cross) ** 2 / np.maximum(densities.input, 1e-300)
        line_width = 1 / (size * self.step)
        is_seen = frequency > WINDOW_WIDTH_LINES * line_width
        is_seen &= frequency <= MAX_NYQUIST_FRACTION / (2 * self.step)
        # Smallest input power of an excited spectral line, relative to the largest one.
        is_seen &= densities.input > 1e-6 * densities.input[is_seen].max()
        if not is_seen.any():
            raise PatchfemError(
                "the input is zero or constant after the start of the record, so there is no response to it; begin the "
                "record earlier"
            )

        explained = np.where(is_seen, power * densities.coherence(), -1.0)
        peak = frequency[int(np.argmax(explained))]
        # Initial peak widths zeta f of a further mode, in spectral lines of a segment.
        zetas = np.clip(np.multiply((0.1, 1.0, 5.0), line_width / peak), 1e-4, 0.2)
        return [2 * np.pi * peak * np.array([1.0, zeta]) for zeta in zetas]


def fit_driven_modes(
    step: float,
    force,
    response,
    quantity: str,
    band: tuple[float, float] = (0.0, np.inf),
) -> FittedModes:
    """Fit natural modes to the time records of a response and its input.

    Parameters
    ----------
    step : float
        Time step [s].
    force, response : (k,) ndarray
        Input and response.
    quantity : str
        Kind of the response, a key of `DERIVATIVE_ORDERS`.
    band : (float, float)
        Frequency band [Hz] of the returned modes; modes outside are fitted, too.

    Raises
    ------
    PatchfemError
        If the record is too short or has no input, or if no mode is visible in the band.
    """
    if force.size < MIN_RECORD_SAMPLES:
        raise PatchfemError(
            f"the record has {force.size} samples; at least {MIN_RECORD_SAMPLES} are needed; "
            "record it longer, or with a higher sampling rate"
        )
    if not np.any(force):
        raise PatchfemError(
            "the input is zero, so there is no response to it; "
            "map the channel of the input with --map"
        )
    fitted = slice(MAX_FITTED_SAMPLES)
    record = _DrivenRecord(step, force[fitted], response[fitted], DERIVATIVE_ORDERS[quantity])
    problem = record.problem

    # Smallest relative reduction of the sum of squares by a further mode, and smallest rms of the mode relative to that of
    # the response
    fit = problem.fit(record.find_starts, Limits(count=12, decrease=0.02, rms=3e-3))
    if not fit.poles.size:
        raise PatchfemError(
            "no mode is visible in the response; a record over a resonance is needed"
        )
    w = fit.omega
    zeta = fit.damping

    # The spectrum that shows the modes resolves no lower frequency; filters and aliasing distort the highest ones.
    min_frequency, max_frequency = band
    lowest = WINDOW_WIDTH_LINES * N_RECORD_SEGMENTS / (force.size * step)
    min_w = 2 * np.pi * max(min_frequency, lowest)
    max_w = 2 * np.pi * min(max_frequency, MAX_NYQUIST_FRACTION / (2 * step))

    # a mode with a damping ratio at a bound represents noise or a trend, not a resonance
    is_resonance = (zeta > 2 * MIN_ZETA) & (zeta < 0.99 * MAX_ZETA)
    is_kept = (w >= min_w) & (w <= max_w) & is_resonance
    if not is_kept.any():
        raise PatchfemError(
            f"no mode is visible in the response between {min_frequency:g} and {max_frequency:g} Hz; "
            "give another --band"
        )
    return problem.select_modes(fit, is_kept)
