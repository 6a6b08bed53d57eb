"""Modes from frequency responses: poles by variable projection, residues by least squares.

H(w) = sum_r A_r / (w_r^2 - w^2 + 2i zeta_r w_r w) + L / (-w^2) + U, with real residues A, lower residuals
L and upper residuals U for each response (Ewins, Modal testing, 2000): normal modes inside the band, and
the modes below (L) and above it (U). For given poles all A, L and U follow from one linear problem, so
that only (w_r, zeta_r) are varied (Golub and Pereyra 1973, with the Jacobian of Kaufman 1975).

Modes are added one at a time at a peak of the residual where neighbouring frequencies are correlated,
which those of noise are not. A mode is kept only if it explains far more than it would of noise. At the
end the weights follow the noise of the responses, which has a constant and a proportional part.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares, nnls
from scipy.signal import find_peaks

from ..core import NotConverged, PatchfemError
from .places import DIRECTION_NAMES, MeasuredModes

MAX_MODES = 30  # largest number of modes of one fit
# Number of largest peaks of each residual spectrum at which a further mode is tried
N_PEAKS_PER_SPECTRUM = 2
# Smallest mean cosine of neighbouring residuals at a peak of a mode; it is 1 for a mode and 0 for
# noise
MIN_RESIDUAL_CORRELATION = 0.5
N_NEIGHBOURS = 8  # number of frequencies on each side of a peak or mode over which means are taken
# Smallest decrease of the sum of squares by a further mode, relative to the decrease expected in
# white noise
MIN_NOISE_RATIO = 15.0
# Smallest decrease of the residual sum of squares by a further mode, relative to that sum
MIN_RESIDUAL_DECREASE = 0.02
# Smallest contribution of a mode near its frequency, relative to the responses there
MIN_CONTRIBUTION = 1e-3
# Smallest contribution of a mode near its frequency, relative to the residual there
MIN_RESIDUAL_RATIO = 5.0
MIN_MISFIT = 1e-9  # smallest relative residual that is not round-off
# Smallest residue of a mode at the driven point, relative to its largest residue, for which the
# mode is kept
MIN_DRIVEN_RESIDUE = 1e-6
MAX_MISFIT = 0.5  # largest relative residual; a fit with a larger one is rejected


class LinearFit(NamedTuple):
    """Solution of the linear fit of residues for given poles.

    Its columns are those of the n modes, of the lower residual and of the upper residual; real parts stand before
    imaginary ones.

    - residual: weighted residual (2q, p).
    - coefficients: coefficients (n + 2, p) of the columns.
    - basis: orthonormal basis (2q, n + 2) of the columns.
    - design: columns (2q, n + 2) of norm 1.
    - slopes: derivatives (2q, 2n) of the columns of the modes over ln w_r, then over ln zeta_r.
    - scale: norms (n + 2,) of the columns before they were divided by them.
    """

    residual: np.ndarray
    coefficients: np.ndarray
    basis: np.ndarray
    design: np.ndarray
    slopes: np.ndarray
    scale: np.ndarray


class FittedPoles(NamedTuple):
    """Poles that have been fitted to frequency responses.

    - w: natural frequencies (n,) [rad/s], ascending.
    - zeta: damping ratios (n,).
    - fit: least-squares problem that they solve.
    """

    w: np.ndarray
    zeta: np.ndarray
    fit: "ModalFit"

    @property
    def theta(self) -> np.ndarray:
        """Parameters (2n,) of the fit: ln w_r, then ln zeta_r."""
        return np.log(np.concatenate([self.w, self.zeta]))


class Residues(NamedTuple):
    """Residues of the modes, and residual terms of modes outside the measured range.

    - modes: residues A (n, p) of the modes.
    - lower: residues L (p,) of the modes below the range.
    - upper: residues U (p,) of the modes above the range.
    """

    modes: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


class ModalFit:
    """Separable least-squares problem that fits modes to frequency responses.

    The nonlinear parameters are theta = (ln w_1 ..., ln zeta_1 ...). Each response is divided by its root
    mean square.

    Parameters
    ----------
    omega : (q,) ndarray
        Circular frequencies [rad/s].
    data : (q, p) ndarray of complex
        Responses per force.
    power : (p,) ndarray of int
        Time derivative of the displacement that was measured: 0, 1 or 2.

    Raises
    ------
    PatchfemError
        If the responses are of different time derivatives.
    """

    def __init__(self, omega, data, power):
        if np.unique(power).size != 1:
            raise PatchfemError(
                "responses of displacement, velocity and acceleration are mixed; use "
                "responses of one kind"
            )
        self.omega = omega
        self.max_omega = omega.max()
        self.size = np.sqrt(np.mean(np.abs(data) ** 2, axis=0))
        self.derivative = (1j * omega) ** power[0]
        self.data = data / self.size
        self.level = np.sqrt(np.mean(np.abs(self.data) ** 2, axis=1))
        # The first guess of the noise is proportional to the response, and never 0.
        self.set_noise(self.level + 1e-3 * self.level.max())

    def set_noise(self, noise):
        """Set the weights to the inverse of the noise (q,) at each frequency."""
        self.weight = noise.min() / noise
        self.target = _stack_real(self.weight[:, None] * self.data)
        self.norm = np.linalg.norm(self.target)

    def solve(self, theta) -> LinearFit:
        """Solve the linear fit of residues for given poles."""
        # The column of a mode is b/(w^2 - s^2 + 2i z w s) at the frequencies s, with the weights b.
        w, z = np.exp(np.split(theta, 2))
        s = self.omega[:, None]
        base = (self.weight * self.derivative)[:, None]
        damping = 2j * z * w * s
        pole = base / (w**2 - s**2 + damping)
        columns = _stack_real(np.hstack([pole, base / -((s / self.max_omega) ** 2), base]))
        by_denominator = -(pole**2) / base
        slopes = np.hstack([by_denominator * (2 * w**2 + damping), by_denominator * damping])

        # The least-squares solution by QR factors of columns of norm 1.
        scale = np.linalg.norm(columns, axis=0)
        design = columns / scale
        basis, triangle = np.linalg.qr(design)
        coefficients = np.linalg.lstsq(triangle, basis.T @ self.target, rcond=1e-13)[0]
        return LinearFit(
            residual=design @ coefficients - self.target,
            coefficients=coefficients,
            basis=basis,
            design=design,
            slopes=_stack_real(slopes) / np.tile(scale[: w.size], 2),
            scale=scale,
        )

    def residual(self, theta):
        """Compute the weighted residual (2q p,), flattened."""
        return self.solve(theta).residual.ravel()

    def jacobian(self, theta):
        """Compute the derivatives (2q p, 2n) of the residual with respect to the pole parameters.

        Each is the change of one column outside the span of all columns, times its coefficients.
        """
        linear = self.solve(theta)
        outside = linear.slopes - linear.basis @ (linear.basis.T @ linear.slopes)
        coefficients = np.tile(linear.coefficients[:-2], (2, 1))
        return (outside[:, None, :] * coefficients.T).reshape(-1, theta.size)

    def refine(self, theta, tolerance=1e-6) -> tuple:
        """Minimize the residual from starting values of the poles.

        w stays between half the lowest and twice the highest frequency, zeta between 1e-7 and 0.9.

        Parameters
        ----------
        theta : (2n,) ndarray
            Starting values.
        tolerance : float
            Relative change at which the iteration ends.

        Returns
        -------
        theta : (2n,) ndarray
        sum_of_squares : float
            Of the residual.
        """
        n = theta.size // 2
        low = np.repeat(np.log([self.omega.min() / 2, 1e-7]), n)
        high = np.repeat(np.log([self.max_omega * 2, 0.9]), n)
        result = least_squares(
            self.residual,
            np.clip(theta, low + 1e-9, high - 1e-9),
            self.jacobian,
            bounds=(low, high),
            x_scale="jac",
            ftol=tolerance,
            xtol=tolerance,
            gtol=1e-15,
            max_nfev=100,
        )
        return result.x, 2 * result.cost

    def complex_residual(self, theta):
        """Compute the unweighted complex residual (q, p) of the fit to the responses."""
        return _join_complex(self.solve(theta).residual) / self.weight[:, None]

    def contributions(self, theta):
        """Compute the unweighted contribution (q, n, p) of each mode to the responses."""
        linear = self.solve(theta)
        n = theta.size // 2
        modes = _join_complex(linear.design[:, :n]) / self.weight[:, None]
        return modes[:, :, None] * linear.coefficients[None, :n]

    def compute_residues(self, theta) -> Residues:
        """Compute the residues in units of the receptance."""
        linear = self.solve(theta)
        unscaled = linear.coefficients / linear.scale[:, None] * self.size
        return Residues(unscaled[:-2], unscaled[-2] * self.max_omega**2, unscaled[-1])


def _stack_real(values):
    """Stack the real parts of an array on its imaginary parts."""
    return np.vstack([values.real, values.imag])


def _join_complex(stacked):
    """Combine the real and imaginary parts that `_stack_real` has stacked into complex numbers."""
    half = len(stacked) // 2
    return stacked[:half] + 1j * stacked[half:]


def fit_poles(omega, data, power) -> FittedPoles:
    """Fit the poles of frequency responses.

    Parameters
    ----------
    omega, data, power
        As for `ModalFit`.

    Returns
    -------
    FittedPoles

    Raises
    ------
    PatchfemError
        If the responses show no mode.
    """
    fit = ModalFit(omega, data, power)
    theta = np.zeros(0)
    cost = np.sum(fit.residual(theta) ** 2)
    n_responses = data.shape[1]
    while theta.size < 2 * MAX_MODES and np.sqrt(cost) > MIN_MISFIT * fit.norm:
        ends = [theta.size // 2, theta.size]
        starts = [np.insert(theta, ends, np.log(start)) for start in _find_starts(fit, theta)]
        attempts = list(map(fit.refine, starts))
        if not attempts:
            break
        new_theta, new_cost = min(attempts, key=lambda attempt: attempt[1])
        n_parameters = new_theta.size + (new_theta.size // 2 + 2) * n_responses
        n_free = max(fit.target.size - n_parameters, 1)
        noise_gain = (2 + n_responses) * new_cost / n_free
        if cost - new_cost < max(MIN_NOISE_RATIO * noise_gain, MIN_RESIDUAL_DECREASE * cost):
            break
        theta = new_theta
        cost = new_cost
    theta = _remove_weak_modes(fit, _refine_with_noise(fit, theta, cost))
    if not theta.size:
        raise PatchfemError(
            "no mode is visible in the frequency responses; responses that include a "
            "resonance are needed"
        )
    w, zeta = np.exp(np.split(theta, 2))
    order = np.argsort(w)
    return FittedPoles(w[order], zeta[order], fit)


def _refine_with_noise(fit: ModalFit, theta, cost):
    """Refine the parameters to round-off, with weights that follow from the noise of the responses.

    The variance a^2 + b^2 level^2 of the noise is fitted to the residual.
    """
    if not theta.size:
        return theta
    if np.sqrt(cost) > MIN_MISFIT * fit.norm:
        square = np.mean(np.abs(fit.complex_residual(theta)) ** 2, axis=1)
        columns = np.stack([np.ones_like(fit.level), fit.level**2], axis=1)
        variance = np.full(square.size, square.mean())
        # The uncertainty of a squared residual is proportional to the variance that is estimated,
        # so the weights are iterated.
        for _ in range(4):
            parts = nnls(columns / variance[:, None], square / variance)[0]
            variance = np.maximum(columns @ parts, 1e-6 * square.mean())
        fit.set_noise(np.sqrt(variance))
    return fit.refine(theta, 1e-15)[0]


def _remove_weak_modes(fit: ModalFit, theta):
    """Remove modes that contribute little to the responses near their natural frequency."""
    while theta.size > 2:
        w = np.exp(np.split(theta, 2)[0])
        residual = np.sqrt(np.mean(np.abs(fit.complex_residual(theta)) ** 2, axis=1))
        contribution = np.sqrt(np.mean(np.abs(fit.contributions(theta)) ** 2, axis=2))
        strength = np.zeros(w.size)
        for r, index in enumerate(np.searchsorted(fit.omega, w)):
            neighbours = slice(max(0, index - N_NEIGHBOURS), index + N_NEIGHBOURS)
            min_contribution = MIN_CONTRIBUTION * fit.level[neighbours].max(initial=1e-300)
            if residual[neighbours].size:
                noise = np.sqrt(np.mean(residual[neighbours] ** 2))
                min_contribution = max(min_contribution, MIN_RESIDUAL_RATIO * noise)
            strength[r] = contribution[neighbours, r].max(initial=0.0) / min_contribution
        if strength.min() >= 1:
            return theta
        is_kept = np.arange(w.size) != strength.argmin()
        theta = fit.refine(theta[np.tile(is_kept, 2)], 1e-15)[0]
    return theta


def _find_starts(fit: ModalFit, theta):
    """Yield initial poles of an additional mode at the largest peaks of the residual.

    The peaks are those of the residual, and those of the residual in proportion to the responses. The
    damping ratio follows from the half-power width of a peak.
    """
    residual = _join_complex(fit.solve(theta).residual)
    size = np.maximum(np.sqrt(np.sum(np.abs(residual) ** 2, axis=1)), 1e-300)
    products = np.real(np.sum(residual[:-1] * residual[1:].conj(), axis=1))
    correlation = products / (size[:-1] * size[1:])
    tried_peaks = set()
    for spectrum in ((size / fit.weight) ** 2, size**2):
        peaks = find_peaks(np.concatenate([[0], spectrum, [0]]))[0] - 1
        modal_peaks = [
            k
            for k in peaks
            if correlation[max(0, k - N_NEIGHBOURS) : k + N_NEIGHBOURS].mean()
            > MIN_RESIDUAL_CORRELATION
        ]
        for k in sorted(modal_peaks, key=lambda k: -spectrum[k])[:N_PEAKS_PER_SPECTRUM]:
            if k not in tried_peaks:
                width = _find_half_power_width(fit.omega, spectrum, k)
                yield fit.omega[k], np.clip(width / (2 * fit.omega[k]), 1e-5, 0.3)
            tried_peaks.add(k)


def _find_half_power_width(omega, spectrum, peak: int) -> float:
    """Return the width [rad/s] of a peak in a power spectrum at half its maximum."""
    below = above = peak
    while below > 0 and spectrum[below] > spectrum[peak] / 2:
        below -= 1
    while above < omega.size - 1 and spectrum[above] > spectrum[peak] / 2:
        above += 1
    return omega[above] - omega[below]


def identify_modes(frequency, measured: dict, notes: list) -> MeasuredModes:
    """Identify modes from frequency responses.

    One reference must have a response at itself, which gives the scale of the shapes. Modes outside the
    band, and modes that do not move the reference, are left out with a note.

    Parameters
    ----------
    frequency : (q,) ndarray
        Frequencies [Hz].
    measured : dict
        Values (q,) and time derivative (0, 1 or 2) of each pair (response, reference) of degrees of freedom.
    notes : list
        Sentences for the user; it is extended.

    Returns
    -------
    MeasuredModes

    Raises
    ------
    PatchfemError
        If the responses show no mode, or give the shapes no scale.
    NotConverged
        If the modes explain too little of the responses.
    """
    reference = _choose_reference(measured)
    places = [direction for direction, driven in measured if driven == reference]
    driven = places.index(reference)
    if len(places) < len(measured):
        notes.append(
            f"of {len(measured)} frequency responses, only the {len(places)} to a force at "
            f"{_format_direction(reference)} are used"
        )
    is_positive = frequency > 0
    omega = 2 * np.pi * frequency[is_positive]
    if omega.size < 8 or (np.diff(omega) <= 0).any():
        raise PatchfemError("at least 8 frequencies in rising order are needed")
    data = np.stack(
        [measured[direction, reference][0][is_positive] for direction in places], axis=1
    )
    is_moving = np.abs(data).max(axis=0) > 0
    if not is_moving[driven]:
        raise PatchfemError(
            f"the response at the driven point itself, {_format_direction(reference)}, is zero"
        )
    power = np.array([measured[direction, reference][1] for direction in places])
    poles = fit_poles(omega, data[:, is_moving], power[is_moving])
    residues = np.zeros((poles.w.size, len(places)))
    residues[:, is_moving] = poles.fit.compute_residues(poles.theta).modes
    is_inside = (poles.w >= omega[0]) & (poles.w <= omega[-1])
    w = poles.w[is_inside]
    zeta = poles.zeta[is_inside]
    residues = residues[is_inside]
    driven_residues = residues[:, driven]
    # The shape is the residue divided by the square root of the residue at the driven point.
    is_scaled = driven_residues > MIN_DRIVEN_RESIDUE * np.abs(residues).max(axis=1)
    notes += [
        f"the mode at {w_r / (2 * np.pi):.5g} Hz does not move the driven point "
        f"{_format_direction(reference)} and is left out"
        for w_r in w[~is_scaled]
    ]
    if not is_scaled.any():
        raise PatchfemError(
            f"no mode moves the driven point {_format_direction(reference)} in the direction of the "
            "force; check the sign of the response"
        )
    notes += _note_modes_below(poles, data[0, is_moving])
    notes += _check_misfit(poles, int(is_scaled.sum()))
    shapes = residues[is_scaled] / np.sqrt(driven_residues[is_scaled])[:, None]
    motion = {direction: shapes[:, k] for k, direction in enumerate(places)}
    return MeasuredModes(w[is_scaled] / (2 * np.pi), zeta[is_scaled], motion, notes)


def _check_misfit(poles: FittedPoles, n_modes: int) -> list:
    """Return a note if the modes leave more than 5 % of the responses unexplained."""
    fit = poles.fit
    misfit = np.linalg.norm(fit.residual(poles.theta)) / fit.norm
    if not np.isfinite(misfit) or misfit > MAX_MISFIT:
        raise NotConverged(
            f"the modes found leave {100 * misfit:.0f} % of the responses unexplained"
        )
    if misfit <= 0.05:
        return []
    return [
        f"the {n_modes} modes of structure.file leave {100 * misfit:.2g} % of the responses "
        "unexplained"
    ]


def _note_modes_below(poles: FittedPoles, first_response) -> list:
    """Return a note if modes below the measured band make up a large part of the responses."""
    fit = poles.fit
    lowest = fit.omega[0]
    lower_residual = fit.compute_residues(poles.theta).lower / lowest**2 * np.abs(fit.derivative[0])
    fraction = np.linalg.norm(lower_residual) / np.linalg.norm(first_response)
    if fraction < 0.2:
        return []
    return [
        f"modes below the measured band make up {100 * min(fraction, 1):.0f} % of the responses at "
        f"{lowest / 2 / np.pi:.4g} Hz and are left out; for a rig without supports, whose rigid-body modes are "
        "needed, use masses or matrices"
    ]


def _format_direction(direction) -> str:
    """Return the name of a measured degree of freedom for messages, such as "12:x"."""
    node, axis = direction
    return f"{node}:{DIRECTION_NAMES[axis]}"


def _choose_reference(measured: dict):
    """Return the reference that has a driving-point response and the most responses."""
    candidates = [reference for direction, reference in measured if direction == reference]
    if not candidates:
        references = sorted({reference for _, reference in measured})
        names = ", ".join(_format_direction(reference) for reference in references)
        raise PatchfemError(
            f"a response at the driven point itself ({names}) is missing, and without "
            "this response the mode shapes have no scale; measure the response at the driven point"
        )
    return max(candidates, key=lambda ref: sum(reference == ref for _, reference in measured))
