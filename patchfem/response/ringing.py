"""Free vibration of a rig while an interface sticks, fitted as decaying sinusoids.

In: a signal during the stick intervals of a window. Out: `ring_frequency`, `ring_damping` and their
errors. The model is a sum of decaying sinusoids, the forced sine and a constant. Frequency and
decay enter nonlinearly, all else linearly (variable projection, Golub and Pereyra, 1973). Up to
three sinusoids are fitted together, and the one with the most energy is kept. Without a sinusoid,
`compute_stuck_vibration` computes the sinusoids from the eigenvalues of the rig.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .. import compiled

# Smallest number of ringing periods in a stick interval; with fewer, frequency and decay correlate.
MIN_PERIODS = 1.5
MIN_SAMPLES = 16
MAX_SAMPLES = 600  # Largest number of samples of a fit; more take longer and change nothing.
MAX_STICKS = 20  # Largest number of stick intervals that are fitted; the longest ones are used.
MAX_SINUSOIDS = 3  # Largest number of decaying sinusoids of a fit.
SAMPLES_PER_PERIOD = 24  # Number of samples per ringing period that are sufficient for a fit.
# Ratio of the sinusoid to the largest value of the signal below which there is no ringing.
MIN_SINUSOID = 1e-6
MAX_RESIDUAL = 0.1  # Largest ratio of the rms residual to the rms ringing [1].
MAX_DAMPING_RATIO = 0.5  # Largest damping ratio that counts as ringing [1].
# Ratio of the residual to the signal without the forced sinusoid below which no other start is tried.
EXACT_RESIDUAL = 1e-9
FLOAT_EPSILON = float(np.finfo(float).eps)
# CPU time [s] of a fit evaluation in Python per sample and squared number of columns.
SECONDS_PER_TERM = 8e-7
EVALUATIONS_PER_FIT = 2.0  # Number of evaluations of a fit, for the estimate of its cost.
KERNELS_MODULE = "response.ringing_kernels"
MAX_STEPS = 60  # Largest number of iteration steps of a fit.
# Fraction of MIN_PERIODS; a shorter fit with a residual below EXACT_RESIDUAL is refused, so it is
# not refined.
MIN_REFINED_FRACTION = 0.9


@dataclass(frozen=True, eq=False, slots=True)
class Ringing:
    """Decaying sinusoid of the free vibration while the interface sticks.

    - frequency: frequency of the damped motion [Hz].
    - damping: damping ratio [1].
    - amplitude: amplitude at the start [unit of the signal].
    - errors: errors of frequency [Hz] and damping [1].
    """

    frequency: float
    damping: float
    amplitude: float
    errors: tuple


def fit_ringing(time, value, omega: float = 0.0, size: float | None = None) -> Ringing | None:
    """Fit the free vibration of a signal in a stick interval; None if there is none.

    A line at a harmonic of the drive that does not decay is forced motion and no ringing.

    Parameters
    ----------
    time, value : (k,)
        Times [s] and signal.
    omega : float
        Angular frequency of a forced sine [rad/s]; 0 for none.
    size : float, optional
        Largest value of the signal in the rest of the window.
    """
    if np.size(time) < MIN_SAMPLES:
        return None
    time, value = _resample(np.asarray(time, float), np.asarray(value, float))
    size = max(size or 0.0, float(np.abs(value).max(initial=0.0)))
    if time.size < MIN_SAMPLES or size == 0:
        return None
    columns = _make_forced_columns(time, omega)
    rest = value - columns @ np.linalg.lstsq(columns, value, rcond=1e-12)[0]
    if np.abs(rest).max() <= MIN_SINUSOID * size:
        return None
    # The first part of a long stick interval is used, because the ringing decays.
    if time.size > MAX_SAMPLES:
        # A stride keeps no more samples per period than the ringing needs.
        stride = max(
            1,
            int(
                2
                * np.pi
                / _find_largest_line(time, rest)
                / (time[1] - time[0])
                / SAMPLES_PER_PERIOD
            ),
        )
        time, value, columns, rest = (
            part[::stride][:MAX_SAMPLES].copy() for part in (time, value, columns, rest)
        )
    span = time[-1]
    found = _fit_all_sinusoids(time, value, columns, rest)
    if found is None:
        return None
    poles, sigma, _ = found
    left, shares = _subtract_sinusoids(time, value, columns, poles)
    k = int(np.argmax([np.sum(part**2) for part in shares]))
    own, rate = poles[2 * k : 2 * k + 2]
    amplitude = float(np.abs(shares[k]).max())
    damping = float(rate / np.hypot(rate, own))
    seen = span * own >= 2 * np.pi * MIN_PERIODS and own * np.diff(time).max() < np.pi / 2
    steady = (
        omega > 0
        and span * omega > 3 * np.pi
        and abs(damping) < 1e-3
        and abs(own / omega - round(own / omega)) < 1e-2
    )
    if (
        not seen
        or steady
        or amplitude <= MIN_SINUSOID * size
        or not -0.02 < damping < MAX_DAMPING_RATIO
        or np.sqrt(np.mean(left**2)) > MAX_RESIDUAL * np.sqrt(np.mean(shares[k] ** 2))
    ):
        return None
    few = poles
    if time.size >= 2 * MIN_SAMPLES:
        few = _refine_poles(time[::2].copy(), value[::2].copy(), columns[::2], poles).poles
    apart = np.abs(few - poles)[2 * k : 2 * k + 2] + 2 * sigma[2 * k : 2 * k + 2]
    return Ringing(
        float(own / (2 * np.pi)),
        damping,
        amplitude,
        (float(apart[0] / (2 * np.pi)), float(apart[1] / own)),
    )


def make_ringing_measures(
    amplitude: float, omega: float, damping: float, largest_acceleration: float
) -> dict:
    """Return the ringing measures (frequency [Hz], damping ratio [1]) of a known sinusoid.

    Parameters
    ----------
    amplitude : float
        Its largest acceleration [m s-2]; 0 if nothing rings.
    omega : float
        Angular frequency [rad/s].
    damping : float
        Damping ratio [1].
    largest_acceleration : float
        Largest acceleration of the whole signal [m s-2].

    Returns
    -------
    dict
        {} if the amplitude is below MIN_SINUSOID of the size.
    """
    if not amplitude > MIN_SINUSOID * largest_acceleration:
        return {}
    return {"ring_frequency": float(omega / (2 * np.pi)), "ring_damping": float(damping)}


class VibratingMode(NamedTuple):
    """Free vibration of a mode while every interface sticks.

    - begin, end: start and end of the stick interval [s].
    - frequency: frequency of the damped motion [Hz].
    - damping: damping ratio [1].
    - displacement, acceleration: amplitudes at the output at `begin` [m], [m s-2].
    """

    begin: float
    end: float
    frequency: float
    damping: float
    displacement: float
    acceleration: float


def compute_stuck_vibration(modes, stiffness, motion) -> list:
    """Return the free vibration of each mode while every interface sticks.

    The motion must not contain a response to a sinusoidal drive.

    Each stuck interface is a spring, and the modes are eigenvectors of the rig with these springs.
    Two states that are h apart differ by c (exp(lambda h) - 1) in every mode, whatever the
    equilibrium is, so that they determine each amplitude c.

    Parameters
    ----------
    modes
        Modal basis of the rig.
    stiffness : (i,)
        Stiffness of the interfaces [N/m].
    motion : Response
        Samples of the stick interval.
    """
    n = modes.omega.size
    rows = modes.interfaces
    whole = np.diag(modes.omega**2) + rows.T * stiffness @ rows / modes.mass
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-whole, -modes.damping_matrix]])
    values, shapes = np.linalg.eig(matrix)
    state = np.concatenate([motion.modal[:2], motion.modal_rate[:2]], axis=1)
    turned = np.expm1(values * (motion.time[1] - motion.time[0]))
    told = (values.imag > 0) & (np.abs(turned) > MIN_SINUSOID)
    sizes = np.linalg.solve(shapes, (state[1] - state[0]).astype(complex))[told] / turned[told]
    # A pair of conjugate eigenvalues gives one real sinusoid.
    out = 2 * np.abs(modes.output @ shapes[:n, told] * sizes)
    return [
        VibratingMode(
            float(motion.time[0]),
            float(motion.time[-1]),
            one.imag / (2 * np.pi),
            -one.real / abs(one),
            float(size),
            float(size * abs(one) ** 2),
        )
        for one, size in zip(values[told], out)
    ]


def select_strongest(modes: list, kind: str) -> VibratingMode:
    """Select the mode with the largest vibration energy in the stick interval.

    Energy is the time integral of the square of its "displacement" or "acceleration", as `kind`
    says.
    """

    def energy(mode: VibratingMode) -> float:
        """Return the mean square of a decaying sinusoid over the stick interval.

        Its amplitude is the field of this `kind`.
        """
        fall = 4 * np.pi * mode.damping * mode.frequency * (mode.end - mode.begin)
        return getattr(mode, kind) ** 2 * (-np.expm1(-fall) / fall if fall else 1.0)

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
        ring_frequency [Hz] and ring_damping [1] by name, and their errors by name; ({}, {}) if
        nothing rings. An error is twice the standard error of the median, plus the median error of
        the fits.
    """
    size = float(np.abs(value).max(initial=0.0))
    found = []
    for begin, end in sticks[-MAX_STICKS:]:
        part = slice(
            np.searchsorted(time, begin, side="left"), np.searchsorted(time, end, side="right")
        )
        one = fit_ringing(time[part], value[part], omega, size)
        if one is not None:
            found.append(one)
    if not found:
        return {}, {}
    values = {}
    errors = {}
    for k, name in enumerate(("frequency", "damping")):
        each = np.array([getattr(one, name) for one in found])
        own = np.array([one.errors[k] for one in found])
        middle = float(np.median(each))
        spread = 1.4826 * float(np.median(np.abs(each - middle))) / np.sqrt(each.size)
        values[f"ring_{name}"] = middle
        errors[f"ring_{name}"] = 2 * spread + float(np.median(own))
    return values, errors


def _resample(time, value) -> tuple:
    """Select equally spaced samples of a signal, with times from 0.

    Other samples, such as the second one on an event, are left out.
    """
    if time.size < 3:
        return time, value
    step = float(np.median(np.diff(time)))
    number = np.round((time - time[np.argmin(np.abs(np.diff(time) - step))]) / step)
    offset = time - number * step
    on = np.abs(offset - np.median(offset)) < 1e-6 * step
    if on.sum() < MIN_SAMPLES:
        return np.empty(0), np.empty(0)
    time = time[on]
    value = value[on]
    return time - time[0], value


def _make_forced_columns(time, omega: float) -> np.ndarray:
    """Return the columns of a fit for the constant and the forced part of a signal."""
    parts = [np.ones(time.size)]
    if omega > 0:
        parts += [np.cos(omega * time), np.sin(omega * time)]
    return np.stack(parts, axis=1)


class _Fit(NamedTuple):
    """Fit of decaying sinusoids to a signal.

    - poles (2 r,): angular frequency [rad/s] and decay rate [1/s] of each.
    - sigma (2 r,): standard errors of the poles.
    - rms: root mean square of the residual.
    """

    poles: np.ndarray
    sigma: np.ndarray
    rms: float


def _fit_poles(time, value, forced, poles, *ends) -> tuple:
    """Fit the poles (2 r,) of decaying sinusoids to a signal, or evaluate their residual.

    The poles are overwritten by the best ones. Without `ends`, the residual is evaluated at the
    given poles.

    Returns the number of evaluations, the sum of squares of the best residual, and the workspace of
    `ringing_kernels.fit_sinusoids`, which is valid until the next call.
    """
    room = _fit_workspace(forced.shape[1] + poles.size, poles.size, time.size)
    room[0][0, : forced.shape[1]] = forced.T
    fit = compiled.get_kernel_module(KERNELS_MODULE).fit_sinusoids
    fit.add_python_cost(
        EVALUATIONS_PER_FIT * SECONDS_PER_TERM * time.size * (forced.shape[1] + poles.size) ** 2
    )
    ends = np.array([*ends, MAX_STEPS] if ends else [0.0] * 4)
    return *fit(time, value, poles, np.abs(poles) + 1 / time[-1], ends, room), room


@lru_cache(maxsize=16)
def _fit_workspace(count: int, n_sinusoids: int, samples: int) -> tuple:
    """Return the cached arrays for a fit with a given number of poles."""
    return (
        np.empty((3, count, samples)),
        np.empty((count + 2, count)),
        np.empty((n_sinusoids, samples)),
        np.zeros((n_sinusoids, n_sinusoids + 1)),
        np.empty((n_sinusoids + 2, n_sinusoids)),
    )


def _subtract_sinusoids(time, value, forced, poles) -> tuple:
    """Return the residual and the fitted sinusoids (k,) for given poles."""
    n = forced.shape[1]
    columns, few, *_ = _fit_poles(time, value, forced, poles)[2]
    return columns[2, 0].copy(), [
        few[-1, at : at + 2] @ columns[0, at : at + 2] for at in range(n, n + poles.size, 2)
    ]


def _fit_all_sinusoids(time, value, forced, signal) -> _Fit | None:
    """Add decaying sinusoids to the fit of a signal while each of them halves the residual.

    Sinusoids are added one after the other while each of them at least halves the residual.
    """
    scale = last = np.sqrt(np.mean(signal**2))
    best = None
    for _ in range(MAX_SINUSOIDS):
        poles = best.poles if best is not None else np.empty(0)
        tries = []
        for start in _initial_guesses(time, value, forced, poles, signal):
            tries.append(
                _refine_poles(time, value, forced, np.append(poles, start), EXACT_RESIDUAL * scale)
            )
            if tries[-1].rms < EXACT_RESIDUAL * scale:
                break
        new = min(tries, key=lambda one: one.rms)
        # A smaller reduction of the residual is noise.
        if not np.isfinite(new.rms) or new.rms > last / 2:
            break
        best = new
        last = new.rms
        if last < 1e-6 * scale or time.size < 8 * (len(best.poles) + 2):
            break
        signal = _subtract_sinusoids(time, value, forced, best.poles)[0]
    return best


def _find_largest_line(time, residual) -> float:
    """Return the angular frequency [rad/s] of the highest spectral line of a residual (k,)."""
    window = np.hanning(time.size + 2)[1:-1]
    size = 4 * time.size
    lines = np.abs(np.fft.rfft(residual * window, size))
    lines[:2] = 0.0
    return 2 * np.pi * int(np.argmax(lines)) / (size * (time[1] - time[0]))


def _initial_guesses(time, value, forced, poles, residual) -> list:
    """Return two initial guesses of a further sinusoid, with different decay rates.

    The frequency is the best one, by projection, around the highest line of the residual.
    """
    span = time[-1]
    top = _find_largest_line(time, residual)
    near = [own for own in top + np.linspace(-1.2, 1.2, 7) * 2 * np.pi / span if own > np.pi / span]
    sizes = [
        _fit_poles(time, value, forced, np.append(poles, (own, 0.5 / span)))[1] for own in near
    ]
    own = near[int(np.argmin(sizes))] if near else top
    return [np.array([own, decay / span]) for decay in (0.1, 2.0)]


def _refine_poles(time, value, forced, poles, max_slow_rms: float = 0.0) -> _Fit:
    """Fit decaying sinusoids from given poles by Levenberg-Marquardt on the projected residual.

    It ends when the residual is round-off of the signal, when a step reduces the sum of squares by
    less than its round-off, or when the rms of the residual is below `whole` with sinusoids that
    are too slow to be ringing.
    """
    scale = np.abs(poles) + 1 / time[-1]
    poles = poles.copy()
    short = MIN_REFINED_FRACTION * 2 * np.pi * MIN_PERIODS / time[-1]
    _, size, (*_, normal, _) = _fit_poles(
        time,
        value,
        forced,
        poles,
        (4 * FLOAT_EPSILON) ** 2 * (value @ value),
        time.size * max_slow_rms**2,
        short,
    )
    rms = float(np.sqrt(size / time.size))
    return _Fit(
        poles, np.sqrt(np.maximum(np.diag(np.linalg.pinv(normal[:, :-1])), 0)) * rms * scale, rms
    )
