"""Modes from measured frequency responses: poles by variable projection, residues by least squares.

H(w) = sum_r A_r / (w_r^2 - w^2 + 2i zeta_r w_r w) + L / (-w^2) + U with real A, L, U per response: normal modes inside
the band, what lies below it (L) and above it (U). For given poles all A, L, U come from one linear solve, so only
(w_r, zeta_r) are searched (Golub and Pereyra 1973, Jacobian as by Kaufman 1975). Modes are added one at a time at a
peak of what is left whose neighbours are alike (noise is not), and one is kept only if it explains far more than noise
could. At the end the weights follow the noise that was found, constant and in proportion to the response.
"""

import numpy as np
from scipy.optimize import least_squares, nnls
from scipy.signal import find_peaks

from ..core import NotConverged, PatchfemError
from .places import AXES, Shapes

MOST = 30  # modes
STARTS = 2  # peaks of each kind tried for every further mode
ALIKE = 0.5  # mean cosine between neighbouring frequencies of what is left: 1 for a missing mode, 0 for noise
ASIDE = 8  # frequencies on each side over which it is taken
GAIN = 15.0  # times what a mode would explain of white noise, for it to be kept
PART = 0.02  # least share of what is left that a further mode explains
FAINT = 1e-3  # least share of the responses, somewhere, that a mode makes up
FLAT = 1e-9  # relative residual at which nothing is left


class ModalFit:
    """A separable least-squares problem: modes from frequency responses, linear in all but (w_r, zeta_r).

    omega: (q,) [rad/s]; data: (q, p) complex; power: (p,) derivatives that were measured. Every response is scaled by
    its root mean square. PatchfemError where the derivatives are mixed.
    """

    def __init__(self, omega, data, power):
        self.omega, self.top = omega, omega.max()
        size = np.sqrt(np.mean(np.abs(data) ** 2, axis=0))
        self.size, shared = size, int(np.unique(power).size == 1)
        if not shared:
            raise PatchfemError(
                "structure.file: responses of displacement, velocity and acceleration are mixed; use "
                "responses of one kind"
            )
        self.lift = (1j * omega) ** power[0]
        self.data = data / size
        self.level = np.sqrt(np.mean(np.abs(self.data) ** 2, axis=1))
        # first guess of the noise: in proportion to the response, at least 1e-3 of its largest
        self.weigh(self.level + 1e-3 * self.level.max())

    def weigh(self, noise):
        """Give every frequency the weight 1/noise (q,)."""
        self.weight = noise.min() / noise
        self.target = self._real(self.weight[:, None] * self.data)
        self.norm = np.linalg.norm(self.target)

    @staticmethod
    def _real(values):
        return np.vstack([values.real, values.imag])

    def columns(self, theta):
        """Real design (2q, n + 2) for theta = (ln w_r ..., ln zeta_r ...), its derivatives, and the column scales.

        Columns: one per mode, then what lies below and above the band; their norms are 1 after division by the scales.
        The derivatives over ln w_r and ln zeta_r are (2q, n) each.
        """
        w, z = np.exp(np.split(theta, 2))
        s = self.omega[:, None]
        base = (self.weight * self.lift)[:, None]
        pole = base / (w**2 - s**2 + 2j * z * w * s)
        d_w = -(pole**2) / base * (2 * w**2 + 2j * z * w * s)
        d_z = -(pole**2) / base * (2j * z * w * s)
        rest = np.hstack([base / -((s / self.top) ** 2), base])
        design = self._real(np.hstack([pole, rest]))
        scale = np.linalg.norm(design, axis=0)
        return (
            design / scale,
            self._real(d_w) / scale[: w.size],
            self._real(d_z) / scale[: w.size],
            scale,
        )

    def solve(self, theta):
        """Linear solve at theta: (residual (2q, p), coefficients (n + 2, p), Q, derivatives of the columns, column
        scales)."""
        design, d_w, d_z, scale = self.columns(theta)
        q, r = np.linalg.qr(design)
        coefficients = np.linalg.lstsq(r, q.T @ self.target, rcond=1e-13)[0]
        return design @ coefficients - self.target, coefficients, q, (d_w, d_z), scale

    def residual(self, theta):
        """Residual (2q p,) of the weighted responses at theta (2n,), real parts before imaginary ones."""
        return self.solve(theta)[0].ravel()

    def jacobian(self, theta):
        """Derivatives (2q p, 2n) of the residual over theta, as by Kaufman (1975).

        Each is the change of one column outside the span of all, times the coefficients of that column.
        """
        _, coefficients, q, slopes, _ = self.solve(theta)
        out = []
        for slope in slopes:
            for k in range(slope.shape[1]):
                column = np.outer(slope[:, k] - q @ (q.T @ slope[:, k]), coefficients[k])
                out.append(column.ravel())
        return np.stack(out, axis=1)

    def refine(self, theta, close=1e-6):
        """The least-squares theta (2n,) from a start, to the relative change `close`, and its residual sum of squares.

        w stays within half the lowest and twice the highest frequency, zeta within 1e-7 and 0.9.
        """
        n = theta.size // 2
        low = np.concatenate([np.full(n, np.log(self.omega.min() / 2)), np.full(n, np.log(1e-7))])
        high = np.concatenate([np.full(n, np.log(self.top * 2)), np.full(n, np.log(0.9))])
        start = np.clip(theta, low + 1e-9, high - 1e-9)
        found = least_squares(
            self.residual,
            start,
            self.jacobian,
            bounds=(low, high),
            x_scale="jac",
            ftol=close,
            xtol=close,
            gtol=1e-15,
            max_nfev=100,
        )
        return found.x, 2 * found.cost

    def left(self, theta):
        """What the modes of theta leave of the responses, (q, p) complex, weighted."""
        rest = self.solve(theta)[0]
        half = len(self.omega)
        return rest[:half] + 1j * rest[half:]

    def parts(self, theta):
        """Contribution of every mode of theta to the responses, (q, n, p) complex, weighted."""
        _, coefficients, _, _, _ = self.solve(theta)
        n, half = theta.size // 2, len(self.omega)
        design = self.columns(theta)[0][:, :n]
        return (design[:half] + 1j * design[half:])[:, :, None] * coefficients[None, :n]

    def residues(self, theta):
        """Residues A (n, p), L (p,) and U (p,) of theta, in the units of the receptance (head of the file)."""
        _, coefficients, _, _, scale = self.solve(theta)
        found = coefficients / scale[:, None] * self.size
        return found[:-2], found[-2] * self.top**2, found[-1]


def fit_poles(omega, data, power) -> tuple:
    """Modes of responses data (q, p) at omega (q,) [rad/s], ascending: (w (n,) [rad/s], zeta (n,), Fit, theta).

    power: (p,) derivatives of displacement that were measured (0, 1, 2). PatchfemError where there is no mode.
    """
    fit = ModalFit(omega, data, power)
    theta, cost = np.zeros(0), np.sum(fit.residual(np.zeros(0)) ** 2)
    count, p = fit.target.size, data.shape[1]
    while theta.size < 2 * MOST and np.sqrt(cost) > FLAT * fit.norm:
        tries = [fit.refine(_with(theta, *start)) for start in _starts(fit, theta)]
        if not tries:
            break
        better, less = min(tries, key=lambda one: one[1])
        free = max(count - (better.size + (better.size // 2 + 2) * p), 1)
        if cost - less < max(GAIN * (2 + p) * less / free, PART * cost):
            break
        theta, cost = better, less
    theta = _pruned(fit, _polished(fit, theta, cost))
    if not theta.size:
        raise PatchfemError(
            "structure.file: no mode is visible in the frequency responses; responses that include a "
            "resonance are needed"
        )
    w, zeta = np.exp(np.split(theta, 2))
    order = np.argsort(w)
    return w[order], zeta[order], fit, np.concatenate([np.log(w[order]), np.log(zeta[order])])


def _with(theta, w, zeta):
    old = np.split(theta, 2)
    return np.concatenate([old[0], [np.log(w)], old[1], [np.log(zeta)]])


def _polished(fit, theta, cost):
    """Theta to the last digits, with weights after the noise: variance a^2 + b^2 level^2 fitted to what is left."""
    if not theta.size:
        return theta
    if np.sqrt(cost) > FLAT * fit.norm:
        left = np.mean(np.abs(fit.left(theta) / fit.weight[:, None]) ** 2, axis=1)
        rows = np.stack([np.ones_like(fit.level), fit.level**2], axis=1)
        variance = np.full(left.size, left.mean())
        for _ in range(4):  # a variance is known in proportion to itself
            found = rows @ nnls(rows / variance[:, None], left / variance)[0]
            variance = np.maximum(found, 1e-6 * left.mean())
        fit.weigh(np.sqrt(variance))
    return fit.refine(theta, 1e-15)[0]


def _pruned(fit, theta):
    """Theta without the modes that make up less of the responses around their own frequency than 5 times what is
    left."""
    while theta.size > 2:
        w, weight = np.exp(np.split(theta, 2)[0]), fit.weight[:, None]
        rest = np.sqrt(np.mean(np.abs(fit.left(theta) / weight) ** 2, axis=1))
        share = np.sqrt(np.mean(np.abs(fit.parts(theta) / weight[:, :, None]) ** 2, axis=2))
        near = [slice(max(0, k - ASIDE), k + ASIDE) for k in np.searchsorted(fit.omega, w)]
        excess = np.array(
            [
                share[at, r].max(initial=0.0)
                / max(
                    FAINT * fit.level[at].max(initial=1e-300),
                    5 * np.sqrt(np.mean(rest[at] ** 2)) if rest[at].size else 0.0,
                )
                for r, at in enumerate(near)
            ]
        )
        if excess.min() >= 1:
            return theta
        kept = np.arange(w.size) != excess.argmin()
        theta = fit.refine(np.concatenate([half[kept] for half in np.split(theta, 2)]), 1e-15)[0]
    return theta


def _starts(fit, theta):
    """Starting values (w, zeta) at the largest peaks of what is left, as it is and in proportion to the responses.

    The damping comes from their width at half the height.
    """
    rest, omega = fit.left(theta), fit.omega
    size = np.maximum(np.sqrt(np.sum(np.abs(rest) ** 2, axis=1)), 1e-300)
    alike = np.real(np.sum(rest[:-1] * rest[1:].conj(), axis=1)) / (size[:-1] * size[1:])
    tried = set()
    for spectrum in ((size / fit.weight) ** 2, size**2):
        peaks = find_peaks(np.concatenate([[0], spectrum, [0]]))[0] - 1
        peaks = [k for k in peaks if alike[max(0, k - ASIDE) : k + ASIDE].mean() > ALIKE]
        for k in sorted(peaks, key=lambda k: -spectrum[k])[:STARTS]:
            below, above = k, k
            while below > 0 and spectrum[below] > spectrum[k] / 2:
                below -= 1
            while above < omega.size - 1 and spectrum[above] > spectrum[k] / 2:
                above += 1
            if k not in tried:
                yield omega[k], np.clip((omega[above] - omega[below]) / (2 * omega[k]), 1e-5, 0.3)
            tried.add(k)


def modes_from_responses(frequency, measured: dict, notes: list) -> Shapes:
    """Shapes of frequency (q,) [Hz] and measured: (place, reference) -> (values (q,), derivatives).

    One reference must have its own response, which gives the scale. A mode that does not move the reference cannot be
    scaled and is left out, with a note; so is what lies outside the band.
    """
    ref = _reference(measured)
    places = [place for place, at in measured if at == ref]
    if len(places) < len(measured):
        notes.append(
            f"of {len(measured)} frequency responses, only the {len(places)} to a force at {_named(ref)} are "
            "used"
        )
    keep = frequency > 0
    omega = 2 * np.pi * frequency[keep]
    if omega.size < 8 or (np.diff(omega) <= 0).any():
        raise PatchfemError("structure.file: at least 8 frequencies in rising order are needed")
    data = np.stack([measured[place, ref][0][keep] for place in places], axis=1)
    alive = np.abs(data).max(axis=0) > 0
    if not alive[places.index(ref)]:
        raise PatchfemError(
            f"structure.file: the response at the driven point itself, {_named(ref)}, is zero"
        )
    power = np.array([measured[place, ref][1] for place in places])
    w, zeta, fit, theta = fit_poles(omega, data[:, alive], power[alive])
    A = np.zeros((w.size, len(places)))
    A[:, alive] = fit.residues(theta)[0]
    inside = (w >= omega[0]) & (w <= omega[-1])
    w, zeta, A = w[inside], zeta[inside], A[inside]
    own = A[:, places.index(ref)]
    good = own > 1e-6 * np.abs(A).max(axis=1)  # the shape is A over the root of it
    notes += [
        f"the mode at {f / (2 * np.pi):.5g} Hz does not move the driven point {_named(ref)} and is left "
        "out"
        for f in w[~good]
    ]
    if not good.any():
        raise PatchfemError(
            f"structure.file: no mode moves the driven point {_named(ref)} in the direction of the "
            "force; check the sign of the response"
        )
    notes += _below(fit, theta, data[:, alive], omega)
    misfit = np.linalg.norm(fit.residual(theta)) / fit.norm
    if not np.isfinite(misfit) or misfit > 0.5:
        raise NotConverged(
            f"structure.file: the modes found leave {100 * misfit:.0f} % of the responses unexplained"
        )
    if misfit > 0.05:  # of the responses: worth a sentence
        notes.append(
            f"the {good.sum()} modes of structure.file leave {100 * misfit:.2g} % of the responses "
            "unexplained"
        )
    shape = A[good] / np.sqrt(own[good])[:, None]
    return Shapes(
        w[good] / (2 * np.pi),
        zeta[good],
        {place: shape[:, k] for k, place in enumerate(places)},
        notes,
    )


def _below(fit, theta, data, omega) -> list:
    """A sentence where modes below the band, rigid ones among them, make up much of the lowest frequency."""
    first = fit.residues(theta)[1] / omega[0] ** 2 * np.abs(fit.lift[0])
    share = np.linalg.norm(first) / np.linalg.norm(data[0])
    if share < 0.2:
        return []
    return [
        f"modes below the measured band make up {100 * min(share, 1):.0f} % of the responses at "
        f"{omega[0] / 2 / np.pi:.4g} Hz and are left out; for a rig without supports, whose rigid-body modes are "
        "needed, use masses or matrices"
    ]


def _named(place) -> str:
    return f"{place[0]}:{AXES[place[1]]}"


def _reference(measured):
    """The reference with its own response and most others."""
    driven = [ref for place, ref in measured if place == ref]
    if not driven:
        refs = ", ".join(_named(ref) for ref in sorted({ref for _, ref in measured}))
        raise PatchfemError(
            f"structure.file: a response at the driven point itself ({refs}) is missing, and without "
            "this response the mode shapes have no scale; measure the response at the driven point"
        )
    return max(driven, key=lambda ref: sum(at == ref for _, at in measured))
