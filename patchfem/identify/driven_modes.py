"""Natural modes fitted to the time record of one response, without windows that widen peaks.

The model is x = sum_r A_r h_r * f + L f_-2 + U f + (free decays) + c, where h_r is the impulse response of
q'' + 2 zeta w q' + w^2 q = f, and L and U are the residuals of modes below and above the band as in
`structure.modal_fit`. The input is assumed to be band-limited, and the response is computed by Fourier
transform, which is periodic. Free decays of the same modes represent the initial state and the jump between
the end and the start of the record. Only w_r and zeta_r are nonlinear parameters (variable projection, Golub
and Pereyra 1973). Modes are added at the spectral line where the residual depends most on the input, as long
as each reduces the residual enough.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from scipy.fft import irfft, rfft, rfftfreq
from scipy.optimize import least_squares

from ..core import PatchfemError
from ..structure.modal_fit import ModalFit, add_mode
from .frequency_response import MAX_NYQUIST_FRACTION, FrequencyResponse, estimate_response
from .variable_projection import Projection, compute_standard_errors, project_data

# order of the time derivative of the displacement, by the quantity of the response
DERIVATIVE_ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
MAX_MODES = 12  # largest number of modes in one fit
# Smallest relative reduction of the sum of squares by a further mode.
MIN_RESIDUAL_DECREASE = 0.02
# Smallest rms of a further mode, relative to the rms of the response.
MIN_RMS_RATIO = 3e-3
MIN_MISFIT = 1e-8  # smallest residual above round-off, relative to the response
MAX_START_EVALUATIONS = 12  # evaluations from each initial guess; only the best is refined further
# Number of samples at each end that are not fitted, because of the jump of the periodic continuation.
N_EDGE_SAMPLES = 32
# Largest number of fitted samples, from the beginning of the record.
MAX_FITTED_SAMPLES = 2**16
MIN_ZETA = 1e-6  # lower bound of the damping ratios in the search
MAX_ZETA = 0.5  # upper bound of the damping ratios in the search
# Initial peak widths zeta f of a further mode, in spectral lines of a segment.
START_PEAK_WIDTHS = (0.1, 1.0, 5.0)


@dataclass(frozen=True, eq=False, slots=True)
class DrivenModes:
    """Natural modes fitted to one response and its input, in order of increasing frequency.

    - frequency: natural frequencies (n,) [Hz].
    - damping: damping ratios (n,).
    - residue: residues A (n,) of sum A / (w_r^2 - w^2 + 2i zeta w_r w).
    - damping_error: half-widths (n,) of the 95 % intervals of the damping ratios.
    - estimate_damping: damping ratios (n,) of a fit to the windowed H1 estimate; nan without a mode there.
    - coherence: coherence (n,) at the peaks, or None.
    - misfit: root mean square of the residual relative to that of the response.
    """

    frequency: np.ndarray
    damping: np.ndarray
    residue: np.ndarray
    damping_error: np.ndarray
    estimate_damping: np.ndarray
    coherence: np.ndarray | None
    misfit: float


class _ModeColumn(IntEnum):
    """Indices of the three columns of a mode in the design matrix.

    - RESPONSE: response of the mode to the input; its coefficient is the residue.
    - COSINE, SINE: free decay of the mode.
    """

    RESPONSE = 0
    COSINE = 1
    SINE = 2


class _Columns(NamedTuple):
    """Design matrix of the linear least-squares fit for given modes, with its derivatives.

    - design: design matrix (k, 3 + 3n). The first three columns are a constant, and the residuals of modes
      below and above the band. The three columns of each mode follow (`_ModeColumn`).
    - by_frequency, by_damping: derivatives of the columns of each mode with respect to ln w_r and ln zeta_r.
    """

    design: np.ndarray
    by_frequency: list
    by_damping: list


class _ModeFit(NamedTuple):
    """Modes fitted to a record, with the residual of the fit.

    - theta: ln w_r of all modes, then ln zeta_r of all modes (2n,).
    - residual: model minus data (k,).
    """

    theta: np.ndarray
    residual: np.ndarray

    @property
    def sum_of_squares(self) -> float:
        """Sum of squares of the residual."""
        return self.residual @ self.residual


class _ModeProblem:
    """Separable least-squares problem for the modes of a response to a known input."""

    def __init__(self, step: float, force, response, derivative: int):
        self.inner = slice(N_EDGE_SAMPLES, force.size - N_EDGE_SAMPLES)
        self.step = step
        self.samples = force.size
        self.force = force
        self.time = (step * np.arange(force.size))[self.inner]
        self.value = response[self.inner]
        self.response_rms = np.sqrt(np.mean((self.value - self.value.mean()) ** 2))
        self.omega = 2 * np.pi * rfftfreq(force.size, step)
        self.input = (1j * self.omega) ** derivative * rfft(force)
        lower = -self.input / np.maximum(self.omega, self.omega[1]) ** 2
        lower[0] = 0.0
        self.fixed = [
            np.ones(self.time.size),
            self._inverse_transform(lower),
            self._inverse_transform(self.input),
        ]

    def _inverse_transform(self, spectrum) -> np.ndarray:
        """Return the inverse Fourier transform of a spectrum at the fitted samples."""
        return irfft(spectrum, self.samples)[self.inner]

    def columns(self, theta) -> _Columns:
        """Return the design matrix of the linear fit for given modes, with its derivatives."""
        columns = list(self.fixed)
        by_frequency = []
        by_damping = []
        for w, z in np.exp(theta).reshape(2, -1).T:
            damping = 2j * z * w * self.omega
            pole = 1 / (w * w - self.omega**2 + damping)
            damped_omega = w * np.sqrt(1 - z * z)
            rate = z * w
            envelope = np.exp(-np.minimum(rate * self.time, 700.0))
            cosine = envelope * np.cos(damped_omega * self.time)
            sine = envelope * np.sin(damped_omega * self.time)
            columns += [self._inverse_transform(self.input * pole), cosine, sine]
            motion = (pole, rate, cosine, sine)
            by_frequency.append(
                self._differentiate_columns(motion, 2 * w * w + damping, damped_omega)
            )
            by_damping.append(
                self._differentiate_columns(motion, damping, -w * z * z * w / damped_omega)
            )
        return _Columns(np.stack(columns, axis=1), by_frequency, by_damping)

    def _differentiate_columns(self, motion: tuple, by_pole, by_omega) -> list:
        """Return the derivatives of the three columns of a mode with respect to one parameter.

        `motion` contains pole, decay rate, cosine and sine of the mode. `by_pole` and `by_omega` are the
        derivatives of 1/pole and of the damped frequency.
        """
        pole, rate, cosine, sine = motion
        return [
            self._inverse_transform(-self.input * pole**2 * by_pole),
            -self.time * (rate * cosine + by_omega * sine),
            -self.time * (rate * sine - by_omega * cosine),
        ]

    def solve(self, theta) -> Projection:
        """Return the linear fit of given modes to the response."""
        return project_data(self.columns(theta).design, self.value)

    def mode_coefficients(self, linear: Projection) -> np.ndarray:
        """Return the coefficients (n, 3) of the columns of each mode (`_ModeColumn`)."""
        return linear.coefficients[len(self.fixed) :].reshape(-1, len(_ModeColumn))

    def slopes(self, theta) -> np.ndarray:
        """Return the derivatives (k, 2n) of the residual with respect to ln w_r and ln zeta_r."""
        columns = self.columns(theta)
        linear = project_data(columns.design, self.value)
        coefficients = self.mode_coefficients(linear)
        slopes = []
        for derivatives in (columns.by_frequency, columns.by_damping):
            for mode_coefficients, mode_columns in zip(coefficients, derivatives):
                parts = [c * column for c, column in zip(mode_coefficients, mode_columns)]
                slopes.append(sum(parts))
        return linear.jacobian(np.stack(slopes, axis=1))

    def refine(self, theta, max_evaluations: int = 100, tolerance: float = 1e-13) -> _ModeFit:
        """Minimize the residual over frequencies and damping ratios from an initial guess.

        Parameters
        ----------
        theta : (2n,) ndarray
            Initial values of ln w_r of all modes, followed by ln zeta_r.
        max_evaluations : int
        tolerance : float
            Relative change at convergence.
        """
        n = theta.size // 2
        low = np.repeat(np.log([self.omega[1] / 2, MIN_ZETA]), n)
        high = np.repeat(np.log([np.pi / self.step, MAX_ZETA]), n)
        result = least_squares(
            lambda p: self.solve(p).residual / self.response_rms,
            np.clip(theta, low + 1e-9, high - 1e-9),
            lambda p: self.slopes(p) / self.response_rms,
            bounds=(low, high),
            x_scale="jac",
            xtol=tolerance,
            ftol=tolerance,
            gtol=1e-14,
            max_nfev=max_evaluations,
        )
        return _ModeFit(result.x, result.fun * self.response_rms)


def fit_driven_modes(
    step: float,
    force,
    response,
    quantity: str,
    estimate: FrequencyResponse,
    band: tuple = (0.0, np.inf),
) -> DrivenModes:
    """Fit natural modes to the time records of a response and its input.

    Parameters
    ----------
    step : float
        Time step [s].
    force, response : (k,) ndarray
        Input and response.
    quantity : str
        Kind of the response, a key of `DERIVATIVE_ORDERS`.
    estimate : FrequencyResponse
        Frequency response of the same record, for `estimate_damping`.
    band : (float, float)
        Frequency band [Hz] of the returned modes; modes outside are fitted, too.

    Returns
    -------
    DrivenModes

    Raises
    ------
    PatchfemError
        If no mode is visible in the band.
    """
    derivative = DERIVATIVE_ORDERS[quantity]
    problem = _ModeProblem(
        step, force[:MAX_FITTED_SAMPLES], response[:MAX_FITTED_SAMPLES], derivative
    )
    fit = _add_modes(problem, estimate)
    n = fit.theta.size // 2
    w, zeta = np.exp(fit.theta).reshape(2, -1)
    residue = problem.mode_coefficients(problem.solve(fit.theta))[:, _ModeColumn.RESPONSE]
    rms = float(np.sqrt(np.mean(fit.residual**2)))
    # the standard errors of ln zeta are stored after those of ln w
    zeta_error = compute_standard_errors(problem.slopes(fit.theta), rms)[n:] * zeta
    min_frequency, max_frequency = band
    min_w = 2 * np.pi * max(min_frequency, estimate.frequency[0])
    max_w = 2 * np.pi * min(max_frequency, MAX_NYQUIST_FRACTION / (2 * step))
    # a mode with a damping ratio at a bound represents noise or a trend, not a resonance
    is_resonance = (zeta > 2 * MIN_ZETA) & (zeta < 0.99 * MAX_ZETA)
    is_kept = (w >= min_w) & (w <= max_w) & is_resonance
    if not is_kept.any():
        raise PatchfemError(
            f"no mode is visible in the response between {min_frequency:g} and {max_frequency:g} Hz"
        )
    order = np.flatnonzero(is_kept)[np.argsort(w[is_kept])]
    frequency = w[order] / (2 * np.pi)
    coherence = None
    if estimate.coherence is not None:
        coherence = np.interp(frequency, estimate.frequency, estimate.coherence)
    return DrivenModes(
        frequency=frequency,
        damping=zeta[order],
        residue=residue[order],
        damping_error=1.96 * zeta_error[order],
        estimate_damping=_fit_estimate(estimate, w, zeta, derivative)[order],
        coherence=coherence,
        misfit=rms / problem.response_rms,
    )


def _add_modes(record: _ModeProblem, estimate: FrequencyResponse) -> _ModeFit:
    """Add modes to a fit one at a time, as long as each reduces the residual enough."""
    fit = _ModeFit(np.empty(0), record.solve(np.empty(0)).residual)
    min_reduction = MIN_RMS_RATIO**2 * fit.residual.size * record.response_rms**2
    min_square = (MIN_MISFIT * record.response_rms) ** 2 * fit.residual.size
    while fit.theta.size < 2 * MAX_MODES and fit.sum_of_squares > min_square:
        attempts = []
        for start in _find_starts(record, estimate, fit.residual):
            theta = add_mode(fit.theta, *start)
            attempts.append(record.refine(theta, MAX_START_EVALUATIONS, 1e-3))
        best = min(attempts, key=lambda attempt: attempt.sum_of_squares)
        reduction = fit.sum_of_squares - best.sum_of_squares
        if reduction < max(MIN_RESIDUAL_DECREASE * fit.sum_of_squares, min_reduction):
            break
        fit = record.refine(best.theta)
    if not fit.theta.size:
        raise PatchfemError(
            "no mode is visible in the response; a record over a resonance is needed"
        )
    return fit


def _find_starts(record: _ModeProblem, estimate: FrequencyResponse, residual) -> list:
    """Return initial modes (w, zeta) at the frequency where the input explains most of the residual."""
    response = estimate_response(
        record.step,
        record.force[record.inner],
        residual,
        min(estimate.segment, residual.size),
        estimate.window,
    )
    power = np.abs(response.value) ** 2 * response.input
    if response.coherence is not None:
        power = power * response.coherence
    frequency = response.frequency[int(np.argmax(power))]
    line_width = 1 / (estimate.segment * record.step)
    starts = []
    for width in START_PEAK_WIDTHS:
        zeta = float(np.clip(width * line_width / frequency, 1e-4, 0.2))
        starts.append((2 * np.pi * frequency, zeta))
    return starts


def _fit_estimate(estimate: FrequencyResponse, w, zeta, derivative: int) -> np.ndarray:
    """Return the damping ratios (n,) of a fit to the windowed frequency response `estimate`.

    The fit starts from the natural frequencies `w` (n,) [rad/s] and the damping ratios `zeta` (n,); `derivative` is
    the number of time derivatives between displacement and response. The ratio is nan for a mode whose frequency
    changes by 10 % or more.
    """
    fit = ModalFit(2 * np.pi * estimate.frequency, estimate.value[:, None], np.array([derivative]))
    theta, _ = fit.refine(np.log(np.concatenate([w, zeta])))
    estimate_w, estimate_zeta = np.exp(theta).reshape(2, -1)
    return np.where(np.abs(estimate_w / w - 1) < 0.1, estimate_zeta, np.nan)
