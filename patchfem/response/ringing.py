"""Free vibration (ringing) of a rig during stick, fitted by decaying sinusoids.

In: a signal during the stick intervals of a window. Out: `ring_frequency`, `ring_damping` and their
errors. The model is a sum of decaying sinusoids, a forced sine and a constant. It is nonlinear only in
the frequencies and decay rates (variable projection, Golub and Pereyra, 1973). Up to three sinusoids
are fitted, and the one with the largest energy is the ringing. Without a sinusoidal drive,
`compute_stuck_vibration` computes the sinusoids from the eigenvalues of the rig.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

# Smallest number of ringing periods in a stick interval; with fewer, frequency and decay are correlated.
MIN_PERIODS = 1.5
MIN_SAMPLES = 16
MAX_SAMPLES = 600  # Largest number of samples of a fit; more do not change the result.
MAX_STICKS = 20  # Largest number of fitted stick intervals; the last ones are used.
MAX_SINUSOIDS = 3  # Largest number of decaying sinusoids of a fit.
SAMPLES_PER_PERIOD = 24  # Sufficient number of samples per ringing period for a fit.
# Smallest amplitude that counts as ringing, relative to the largest value of the signal.
MIN_SINUSOID = 1e-6
# Largest ratio of the rms residual to the rms ringing at which a fit is accepted [1].
MAX_RESIDUAL = 0.1
MAX_DAMPING_RATIO = 0.5  # Largest damping ratio that counts as ringing [1].
# A fit with a relative residual below this value is accepted without further initial guesses.
EXACT_RESIDUAL = 1e-9
MAX_EVALUATIONS = 60  # Largest number of evaluations of the residual in a fit.
POLE_TOL = 1e-13  # Relative change of the poles at which a fit ends.
MAX_EXPONENT = 50.0  # Largest exponent of a sinusoid that grows during a fit.
# Columns whose part that is independent of the others is smaller than this fraction have no coefficient.
MIN_INDEPENDENT = 1e-12


@dataclass(frozen=True, eq=False, slots=True)
class Ringing:
    """Decaying sinusoid of the free vibration during stick.

    - frequency: frequency of the damped motion [Hz].
    - damping: damping ratio [1].
    - amplitude: amplitude at the start [unit of the signal].
    - errors: errors of frequency [Hz] and damping ratio [1].
    """

    frequency: float
    damping: float
    amplitude: float
    errors: tuple


def fit_ringing(time, value, omega: float = 0.0, size: float | None = None) -> Ringing | None:
    """Fit the free vibration of a signal in a stick interval; None without ringing.

    An undamped line at a harmonic of the drive is forced motion and does not count as ringing.

    Parameters
    ----------
    time, value : (k,)
        Times [s] and signal.
    omega : float
        Angular frequency of a forced sine [rad/s]; 0 for none.
    size : float, optional
        Largest absolute value of the signal in the whole window.
    """
    if np.size(time) < MIN_SAMPLES:
        return None
    time, value = _resample(np.asarray(time, float), np.asarray(value, float))
    size = max(size or 0.0, float(np.abs(value).max(initial=0.0)))
    if time.size < MIN_SAMPLES or size == 0:
        return None
    columns = _make_forced_columns(time, omega)
    unforced = value - columns @ np.linalg.lstsq(columns, value, rcond=1e-12)[0]
    if np.abs(unforced).max() <= MIN_SINUSOID * size:
        return None
    # Only the beginning of a long stick interval is used, because the ringing decays.
    if time.size > MAX_SAMPLES:
        # the stride reduces the samples to SAMPLES_PER_PERIOD per ringing period
        stride = max(
            1,
            int(
                2
                * np.pi
                / _find_largest_line(time, unforced)
                / (time[1] - time[0])
                / SAMPLES_PER_PERIOD
            ),
        )
        time, value, columns, unforced = (
            part[::stride][:MAX_SAMPLES] for part in (time, value, columns, unforced)
        )
    span = time[-1]
    fit = _fit_all_sinusoids(time, value, columns, unforced)
    if fit is None:
        return None
    poles, sigma, _ = fit
    residual, sinusoids, _ = _project(time, value, columns, poles)
    k = int(np.argmax([np.sum(part**2) for part in sinusoids]))
    ring_omega, rate = poles[2 * k : 2 * k + 2]
    amplitude = float(np.abs(sinusoids[k]).max())
    damping = float(rate / np.hypot(rate, ring_omega))
    is_resolved = (
        span * ring_omega >= 2 * np.pi * MIN_PERIODS
        and ring_omega * np.diff(time).max() < np.pi / 2
    )
    is_forced = (
        omega > 0
        and span * omega > 3 * np.pi
        and abs(damping) < 1e-3
        and abs(ring_omega / omega - round(ring_omega / omega)) < 1e-2
    )
    if (
        not is_resolved
        or is_forced
        or amplitude <= MIN_SINUSOID * size
        or not -0.02 < damping < MAX_DAMPING_RATIO
        or np.sqrt(np.mean(residual**2)) > MAX_RESIDUAL * np.sqrt(np.mean(sinusoids[k] ** 2))
    ):
        return None
    thinned_poles = poles
    if time.size >= 2 * MIN_SAMPLES:
        thinned_poles = _refine_poles(time[::2], value[::2], columns[::2], poles).poles
    pole_errors = np.abs(thinned_poles - poles)[2 * k : 2 * k + 2] + 2 * sigma[2 * k : 2 * k + 2]
    return Ringing(
        float(ring_omega / (2 * np.pi)),
        damping,
        amplitude,
        (float(pole_errors[0] / (2 * np.pi)), float(pole_errors[1] / ring_omega)),
    )


def make_ringing_measures(
    amplitude: float, omega: float, damping: float, largest_acceleration: float
) -> dict:
    """Return the ringing measures of a known decaying sinusoid, by name.

    Parameters
    ----------
    amplitude : float
        Acceleration amplitude of the sinusoid [m s-2]; 0 without ringing.
    omega : float
        Angular frequency [rad/s].
    damping : float
        Damping ratio [1].
    largest_acceleration : float
        Largest acceleration of the whole signal [m s-2].

    Returns
    -------
    dict
        Measures by name; {} if the amplitude is below MIN_SINUSOID times the largest acceleration.
    """
    if not amplitude > MIN_SINUSOID * largest_acceleration:
        return {}
    return {"ring_frequency": float(omega / (2 * np.pi)), "ring_damping": float(damping)}


class VibratingMode(NamedTuple):
    """Free vibration of a mode while all interfaces stick.

    - begin, end: start and end of the stick interval [s].
    - frequency: frequency of the damped motion [Hz].
    - damping: damping ratio [1].
    - displacement, acceleration: amplitudes at the output at the time `begin` [m], [m s-2].
    """

    begin: float
    end: float
    frequency: float
    damping: float
    displacement: float
    acceleration: float


def compute_stuck_vibration(modes, stiffness, motion) -> list:
    """Return the free vibration of each mode while all interfaces stick.

    The motion must not contain a response to a sinusoidal drive.

    Each stuck interface is a spring, and the modes are eigenvectors of the rig with these springs. In each
    mode, two states at a time distance h differ by c (exp(lambda h) - 1), independently of the equilibrium.
    This determines the amplitude c.

    Parameters
    ----------
    modes
        Modal basis of the rig.
    stiffness : (i,)
        Stiffness of each interface [N/m].
    motion : Response
        Samples of the stick interval.
    """
    n = modes.omega.size
    rows = modes.interfaces
    stiffness_matrix = np.diag(modes.omega**2) + rows.T * stiffness @ rows / modes.mass
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness_matrix, -modes.damping_matrix]])
    values, shapes = np.linalg.eig(matrix)
    state = np.concatenate([motion.modal[:2], motion.modal_rate[:2]], axis=1)
    growth = np.expm1(values * (motion.time[1] - motion.time[0]))
    known = (values.imag > 0) & (np.abs(growth) > MIN_SINUSOID)
    sizes = np.linalg.solve(shapes, (state[1] - state[0]).astype(complex))[known] / growth[known]
    # a pair of conjugate eigenvalues corresponds to one real sinusoid
    amplitudes = 2 * np.abs(modes.output @ shapes[:n, known] * sizes)
    return [
        VibratingMode(
            float(motion.time[0]),
            float(motion.time[-1]),
            eigenvalue.imag / (2 * np.pi),
            -eigenvalue.real / abs(eigenvalue),
            float(amplitude),
            float(amplitude * abs(eigenvalue) ** 2),
        )
        for eigenvalue, amplitude in zip(values[known], amplitudes)
    ]


def select_strongest(modes: list, kind: str) -> VibratingMode:
    """Return the mode with the largest vibration energy in the stick interval.

    The energy is the time integral of the squared "displacement" or "acceleration", given by `kind`.
    """

    def energy(mode: VibratingMode) -> float:
        """Return the energy of a decaying sinusoid whose amplitude is the field `kind`."""
        decay = 4 * np.pi * mode.damping * mode.frequency * (mode.end - mode.begin)
        return getattr(mode, kind) ** 2 * (-np.expm1(-decay) / decay if decay else 1.0)

    return max(modes, key=energy)


def measure_ringing(time, value, sticks, omega: float = 0.0) -> tuple:
    """Return frequency and damping of the free vibration as medians over stick intervals.

    Parameters
    ----------
    time, value : (k,)
        Times [s] and signal.
    sticks : sequence
        Time spans (start, end) [s].
    omega : float
        Angular frequency of a forced sine [rad/s]; 0 for none.

    Returns
    -------
    tuple
        ring_frequency [Hz] and ring_damping [1] by name, and their errors by name; ({}, {}) without
        ringing. An error is twice the standard error of the median plus the median error of the fits.
    """
    size = float(np.abs(value).max(initial=0.0))
    fits = []
    for begin, end in sticks[-MAX_STICKS:]:
        interval = slice(
            np.searchsorted(time, begin, side="left"), np.searchsorted(time, end, side="right")
        )
        fit = fit_ringing(time[interval], value[interval], omega, size)
        if fit is not None:
            fits.append(fit)
    if not fits:
        return {}, {}
    values = {}
    errors = {}
    for k, name in enumerate(("frequency", "damping")):
        fitted_values = np.array([getattr(fit, name) for fit in fits])
        fit_errors = np.array([fit.errors[k] for fit in fits])
        median = float(np.median(fitted_values))
        standard_error = (
            1.4826 * float(np.median(np.abs(fitted_values - median))) / np.sqrt(fitted_values.size)
        )
        values[f"ring_{name}"] = median
        errors[f"ring_{name}"] = 2 * standard_error + float(np.median(fit_errors))
    return values, errors


def _resample(time, value) -> tuple:
    """Return the equally spaced samples of a signal, with times from 0.

    Other samples, such as the second sample at an event, are omitted.
    """
    if time.size < 3:
        return time, value
    step = float(np.median(np.diff(time)))
    number = np.round((time - time[np.argmin(np.abs(np.diff(time) - step))]) / step)
    offset = time - number * step
    is_on_grid = np.abs(offset - np.median(offset)) < 1e-6 * step
    if is_on_grid.sum() < MIN_SAMPLES:
        return np.empty(0), np.empty(0)
    time = time[is_on_grid]
    value = value[is_on_grid]
    return time - time[0], value


def _make_forced_columns(time, omega: float) -> np.ndarray:
    """Return the design-matrix columns of the constant and the forced part of a signal."""
    columns = [np.ones(time.size)]
    if omega > 0:
        columns += [np.cos(omega * time), np.sin(omega * time)]
    return np.stack(columns, axis=1)


class _Fit(NamedTuple):
    """Fit of decaying sinusoids to a signal.

    - poles (2 r,): angular frequency [rad/s] and decay rate [1/s] of each sinusoid.
    - sigma (2 r,): standard errors of the poles.
    - rms: root mean square of the residual.
    """

    poles: np.ndarray
    sigma: np.ndarray
    rms: float


class _Projection(NamedTuple):
    """Projection of a signal on a forced part and decaying sinusoids.

    - residual (k,): part of the signal that they do not contain.
    - sinusoids: fitted sinusoid (k,) of each pair of poles.
    - jacobian (k, 2 r): derivatives of the residual with respect to the poles.
    """

    residual: np.ndarray
    sinusoids: list
    jacobian: np.ndarray


def _project(time, value, forced, poles) -> _Projection:
    """Project a signal on the columns of given poles (2 r,).

    The Jacobian is that of Kaufman (1975): the derivative of the columns times their coefficients, without its part in
    the space of the columns.
    """
    omegas, rates = poles.reshape(-1, 2).T
    decay = np.exp(np.clip(-np.outer(time, rates), -MAX_EXPONENT, MAX_EXPONENT))
    cosine = decay * np.cos(np.outer(time, omegas))
    sine = decay * np.sin(np.outer(time, omegas))
    columns = np.hstack([forced, cosine, sine])

    # Least squares from the singular values, without columns that nearly depend on others.
    basis, sizes, rows = np.linalg.svd(columns, full_matrices=False)
    is_known = sizes > MIN_INDEPENDENT * sizes[0]
    basis = basis[:, is_known]
    parts = basis.T @ value
    coefficients = rows[is_known].T @ (parts / sizes[is_known])
    residual = value - basis @ parts

    # d/d omega and d/d rate of a exp(-rate t) cos(omega t) + b exp(-rate t) sin(omega t).
    a, b = coefficients[forced.shape[1] :].reshape(2, -1)
    sinusoids = a * cosine + b * sine
    slopes = np.stack([b * cosine - a * sine, -sinusoids], axis=2) * time[:, None, None]
    slopes = slopes.reshape(time.size, poles.size)
    return _Projection(residual, list(sinusoids.T), basis @ (basis.T @ slopes) - slopes)


def _fit_all_sinusoids(time, value, forced, signal) -> _Fit | None:
    """Fit sinusoids to a signal, whose number is increased while the residual is halved.

    Each sinusoid is fitted from several initial guesses, together with the previous ones.
    """
    scale = last_rms = np.sqrt(np.mean(signal**2))
    best = None
    for _ in range(MAX_SINUSOIDS):
        poles = best.poles if best is not None else np.empty(0)
        fits = []
        for start in _initial_guesses(time, value, forced, poles, signal):
            fits.append(_refine_poles(time, value, forced, np.append(poles, start)))
            if fits[-1].rms < EXACT_RESIDUAL * scale:
                break
        best_fit = min(fits, key=lambda fit: fit.rms)
        # a smaller reduction of the residual is attributed to noise
        if not np.isfinite(best_fit.rms) or best_fit.rms > last_rms / 2:
            break
        best = best_fit
        last_rms = best_fit.rms
        if last_rms < 1e-6 * scale or time.size < 8 * (len(best.poles) + 2):
            break
        signal = _project(time, value, forced, best.poles).residual
    return best


def _find_largest_line(time, residual) -> float:
    """Return the angular frequency [rad/s] of the highest spectral line of a residual (k,)."""
    window = np.hanning(time.size + 2)[1:-1]
    size = 4 * time.size
    lines = np.abs(np.fft.rfft(residual * window, size))
    lines[:2] = 0.0
    return 2 * np.pi * int(np.argmax(lines)) / (size * (time[1] - time[0]))


def _initial_guesses(time, value, forced, poles, residual) -> list:
    """Return two initial guesses for the poles of a further sinusoid.

    The frequency is the one with the smallest projected residual near the highest spectral line.
    """
    span = time[-1]
    line = _find_largest_line(time, residual)
    near = [w for w in line + np.linspace(-1.2, 1.2, 7) * 2 * np.pi / span if w > np.pi / span]
    residuals = []
    for omega in near:
        candidate = np.append(poles, (omega, 0.5 / span))
        residuals.append(np.linalg.norm(_project(time, value, forced, candidate).residual))
    omega = near[int(np.argmin(residuals))] if near else line
    return [np.array([omega, decay / span]) for decay in (0.1, 2.0)]


def _refine_poles(time, value, forced, poles) -> _Fit:
    """Fit decaying sinusoids from given poles (2 r,) by the Levenberg-Marquardt method."""
    from scipy.optimize import least_squares  # only runs that ring need it

    scale = np.abs(poles) + 1 / time[-1]
    fit = least_squares(
        lambda x: _project(time, value, forced, x * scale).residual,
        poles / scale,
        lambda x: _project(time, value, forced, x * scale).jacobian * scale,
        method="lm",
        ftol=POLE_TOL,
        xtol=POLE_TOL,
        gtol=POLE_TOL,
        max_nfev=MAX_EVALUATIONS,
    )
    rms = float(np.sqrt(np.mean(fit.fun**2)))
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac)
    return _Fit(fit.x * scale, np.sqrt(np.maximum(np.diag(covariance), 0)) * rms * scale, rms)
