"""Modes of one response to a recorded input, fitted to the record itself, where no window widens a peak.

x = sum_r A_r h_r * f + L f_-2 + U f + (what still rings from before the record) + c, with h_r the response of
q'' + 2 z w q' + w^2 q = f, and L and U for what lies below and above the band as in `structure.modal_fit`. The input is
taken as limited to half the sampling rate, so that the response follows by Fourier transform; what rings from before,
and the end of the record that the transform joins to its start, are free decays of the same modes. Only (w_r, z_r) are
searched, all else is linear (variable projection, Golub and Pereyra 1973). A mode is added at the line where what is
left follows the input most, while each takes its share of it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, rfft, rfftfreq
from scipy.optimize import least_squares

from ..core import PatchfemError
from ..structure.modal_fit import ModalFit
from .frequency_response import TOP, Estimate, h1
from .variable_projection import Projection, project, standard_errors

POWER = {"displacement": 0, "velocity": 1, "acceleration": 2}  # derivatives of displacement
MOST = 12  # modes
PART = 0.02  # least share of the power left that a further mode takes away
FAINT = 3e-3  # least share of the response (of its root mean square) that a mode makes up
WHOLE = 1e-8  # of the response: less is round-off
ROUGH = 12  # looks at a start, before the best goes on
EDGE = 32  # samples at both ends that are not fitted: there the transform joins end and start by a jump
SAMPLES = 2**16  # of the record that are fitted, from its start
LOWEST, WIDEST = 1e-6, 0.5  # damping ratios


@dataclass(frozen=True, eq=False, slots=True)
class Modes:
    """Modes of one response by rising frequency.

    frequency (n,) [Hz]; damping (n,); residue (n,): A of sum A / (w_r^2 - w^2 + 2i z w_r w); error (n,): 95 %
    half-width of the damping by what is left over; read (n,): the damping that a fit to the windowed estimate reads,
    nan where it finds none; coherence (n,) at the peaks or None; misfit: share of the response left over.
    """

    frequency: np.ndarray
    damping: np.ndarray
    residue: np.ndarray
    error: np.ndarray
    read: np.ndarray
    coherence: np.ndarray | None
    misfit: float


class _Record:
    """An input and its response; the linear problem for given (ln w_r, ln z_r)."""

    def __init__(self, step: float, force, response, power: int):
        self.inner, self.step, self.samples = slice(EDGE, force.size - EDGE), step, force.size
        self.time, self.value = (step * np.arange(force.size))[self.inner], response[self.inner]
        self.omega = 2 * np.pi * rfftfreq(force.size, step)
        self.lift = (1j * self.omega) ** power * rfft(force)
        self.force = force
        self.size = np.sqrt(np.mean((self.value - self.value.mean()) ** 2))
        below = -self.lift / np.maximum(self.omega, self.omega[1]) ** 2
        below[0] = 0.0
        self.fixed = [np.ones(self.time.size), self._back(below), self._back(self.lift)]

    def _back(self, lines) -> np.ndarray:
        return irfft(lines, self.samples)[self.inner]

    def columns(self, theta) -> tuple:
        """(design (k, 3 + 3 n): fixed columns, then per mode driven, cosine, sine; its derivatives over ln w_r and ln
        z_r, two lists of (k, 3))."""
        parts, over_w, over_z = list(self.fixed), [], []
        for w, z in np.exp(theta).reshape(2, -1).T:
            pole = 1 / (w * w - self.omega**2 + 2j * z * w * self.omega)
            damped = 2j * z * w * self.omega
            own, rate = w * np.sqrt(1 - z * z), z * w
            fall = np.exp(-np.minimum(rate * self.time, 700.0))
            cosine, sine = fall * np.cos(own * self.time), fall * np.sin(own * self.time)
            parts += [self._back(self.lift * pole), cosine, sine]
            for out, driven, turn in (
                (over_w, 2 * w * w + damped, own),
                (over_z, damped, -w * z * z * w / own),
            ):
                out.append(
                    (
                        self._back(-self.lift * pole**2 * driven),
                        -self.time * (rate * cosine + turn * sine),
                        -self.time * (rate * sine - turn * cosine),
                    )
                )
        return np.stack(parts, axis=1), over_w, over_z

    def solved(self, theta) -> Projection:
        """Return the linear problem with 3 + 3 n coefficients."""
        return project(self.columns(theta)[0], self.value)

    def slopes(self, theta) -> np.ndarray:
        """Return the derivatives (k, 2 n) of the residual."""
        design, *both = self.columns(theta)
        found = project(design, self.value)
        modes = found.coefficients[3:].reshape(-1, 3)
        out = [
            sum(c * column for c, column in zip(mode, columns))
            for slopes in both
            for mode, columns in zip(modes, slopes)
        ]
        return found.jacobian(np.stack(out, axis=1))

    def refined(self, theta, looks: int = 100, close: float = 1e-13) -> tuple:
        """(theta, what it leaves) of the least-squares problem from a start, after so many looks or a change of
        `close`."""
        n, top = theta.size // 2, np.pi / self.step
        low = np.repeat([np.log(self.omega[1] / 2), np.log(LOWEST)], n)
        high = np.repeat([np.log(top), np.log(WIDEST)], n)
        found = least_squares(
            lambda p: self.solved(p).residual / self.size,
            np.clip(theta, low + 1e-9, high - 1e-9),
            lambda p: self.slopes(p) / self.size,
            bounds=(low, high),
            x_scale="jac",
            xtol=close,
            ftol=close,
            gtol=1e-14,
            max_nfev=looks,
        )
        return found.x, found.fun * self.size


def driven_modes(
    step: float, force, response, quantity: str, estimate: Estimate, band: tuple = (0.0, np.inf)
) -> Modes:
    """Modes in a band [Hz] of response (k,) to force (k,), sampled every `step` [s]; quantity: a key of POWER.

    estimate: `frequency_response.h1` of the same record, for the damping that it reads. Modes outside the band are
    fitted beside those in it. PatchfemError where no mode stands out.
    """
    power = POWER[quantity]
    record = _Record(step, force[:SAMPLES], response[:SAMPLES], power)
    theta, rest = _grown(record, estimate)
    n = theta.size // 2
    w, zeta = np.exp(theta).reshape(2, -1)
    residue = record.solved(theta).coefficients[3::3]
    rms = float(np.sqrt(np.mean(rest**2)))
    spread = standard_errors(record.slopes(theta), rms)[n:] * zeta
    kept = (w >= 2 * np.pi * max(band[0], estimate.frequency[0])) & (
        w <= 2 * np.pi * min(band[1], TOP / (2 * step))
    )
    kept &= (zeta > 2 * LOWEST) & (zeta < 0.99 * WIDEST)
    if not kept.any():
        raise PatchfemError(
            f"no mode is visible in the response between {band[0]:g} and {band[1]:g} Hz"
        )
    order = np.flatnonzero(kept)[np.argsort(w[kept])]
    read = _read(estimate, w, zeta, power)
    coherence = (
        None
        if estimate.coherence is None
        else np.interp(w[order] / (2 * np.pi), estimate.frequency, estimate.coherence)
    )
    return Modes(
        w[order] / (2 * np.pi),
        zeta[order],
        residue[order],
        1.96 * spread[order],
        read[order],
        coherence,
        rms / record.size,
    )


def _grown(record: _Record, estimate: Estimate) -> tuple:
    """(theta, what is left) of as many modes as take their share."""
    theta, rest = np.empty(0), record.solved(np.empty(0)).residual
    while theta.size < 2 * MOST and np.sqrt(np.mean(rest**2)) > WHOLE * record.size:
        tries = [
            record.refined(_with(theta, *start), ROUGH, 1e-3)
            for start in _starts(record, estimate, rest)
        ]
        better, left = min(tries, key=lambda one: one[1] @ one[1])
        if rest @ rest - left @ left < max(
            PART * (rest @ rest), FAINT**2 * rest.size * record.size**2
        ):
            break
        theta, rest = record.refined(better)
    if not theta.size:
        raise PatchfemError(
            "no mode is visible in the response; a record over a resonance is needed"
        )
    return theta, rest


def _with(theta, w: float, zeta: float) -> np.ndarray:
    old = theta.reshape(2, -1)
    return np.concatenate([old[0], [np.log(w)], old[1], [np.log(zeta)]])


def _starts(record: _Record, estimate: Estimate, rest) -> list:
    """Starting values (w, zeta) at the line where the power of what is left follows the input most."""
    found = h1(
        record.step,
        record.force[record.inner],
        rest,
        min(estimate.segment, rest.size),
        estimate.window,
    )
    power = (
        np.abs(found.value) ** 2
        * found.input
        * (1.0 if found.coherence is None else found.coherence)
    )
    at = int(np.argmax(power))
    w, blur = 2 * np.pi * found.frequency[at], 1 / (estimate.segment * record.step)
    return [
        (w, float(np.clip(share * blur / found.frequency[at], 1e-4, 0.2)))
        for share in (0.1, 1.0, 5.0)
    ]


def _read(estimate: Estimate, w, zeta, power: int) -> np.ndarray:
    """Damping (n,) that a fit of the same modes to the estimate reads, nan where it does not come to an end there."""
    fit = ModalFit(2 * np.pi * estimate.frequency, estimate.value[:, None], np.array([power]))
    found = fit.refine(np.log(np.concatenate([w, zeta])))[0]
    moved, out = np.exp(found).reshape(2, -1)
    return np.where(np.abs(moved / w - 1) < 0.1, out, np.nan)
