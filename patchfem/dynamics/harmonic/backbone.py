"""Backbone of a mode with a contact: frequency and damping of the motion that a balancing negative damping keeps up.

z'' + (D - 2 zeta omega) z' + Omega^2 z + faces^T F/m = 0 has, for every amplitude of the mode's coordinate, one
periodic motion with its own omega and zeta: zeta is the loss of a cycle over 8 pi times the mean kinetic energy, what
a slow free decay loses (extended periodic motion concept: Krack 2015). With one harmonic and one mode of slide s this
is omega^2 = omega_0^2 + s^2 K_eq/m and zeta = zeta_0 omega_0/omega + loss/(2 pi m omega^2 A^2), K_eq and the loss
those of the contact's own loop on a bench.
"""

from typing import NamedTuple

import numpy as np

from ...core import ModalBasis, NotConverged, say
from .harmonic import Balance, pack, solve_linear, unpack


class Free(NamedTuple):
    """A free motion of `amplitude` [m] of the mode's coordinate: omega [rad/s], zeta [1], slides (i, H + 1) [m], forces
    (i, H + 1) [N], modal (H + 1, n) [m]."""

    amplitude: float
    omega: float
    zeta: float
    slides: np.ndarray
    forces: np.ndarray
    modal: np.ndarray


def stuck_mode(modes: ModalBasis, rows, stiffness, mode: int) -> tuple:
    """(omega [rad/s], shape (n,)) of a mode when the rows (i, n) hold with stiffness (i,) [N/m]; shape[mode] = 1."""
    k = np.diag(modes.omega**2) + rows.T * stiffness @ rows / modes.mass
    values, vectors = np.linalg.eigh(k)
    shape = vectors[:, mode]
    if abs(shape[mode]) < 1e-6:  # modes have changed places: take the one with most of this coordinate
        shape = vectors[:, int(np.argmax(np.abs(vectors[mode])))]
        mode_value = values[int(np.argmax(np.abs(vectors[mode])))]
        return float(np.sqrt(mode_value)), shape / shape[mode]
    return float(np.sqrt(max(values[mode], 0.0))), shape / shape[mode]


class FreeBalance:
    """Equations of the free motion of one mode that a negative damping keeps up.

    balance: Balance of the rows; mode: number of the coordinate whose amplitude is given; scale [rad/s]. Unknowns:
    packed slides of `Balance`, omega/scale and zeta.
    """

    def __init__(self, balance: Balance, mode: int, harmonics: int, scale: float):
        self.balance, self.mode, self.h, self.scale = balance, mode, harmonics, scale
        n = balance.modes.omega.size
        self.others = np.array([j for j in range(n) if j != mode], int)

    def impedance(self, omega: float, zeta: float) -> tuple:
        """(P, dP/d omega, dP/d zeta), each (H + 1, n, n)."""
        m, k = self.balance.modes, np.arange(self.h + 1)[:, None, None]
        eye = np.eye(m.omega.size)
        p = np.diag(m.omega**2) - (k * omega)**2 * eye + 1j * k * omega * (m.dampers - 2 * zeta * omega * eye)
        return p, -2 * k**2 * omega * eye + 1j * k * (m.dampers - 4 * zeta * omega * eye), -2j * k * omega**2 * eye

    def system(self, x, amplitude: float) -> tuple:
        """(residual (N,), Jacobian (N, N), Free) at unknowns x and the amplitude of the mode's coordinate [m]."""
        balance, h, j, o = self.balance, self.h, self.mode, self.others
        r, faces, mass = balance.lift.shape[1], balance.faces, balance.modes.mass
        omega, zeta = x[-2] * self.scale, x[-1]
        y = unpack(x[:-2], r)
        fold = balance.contact(balance.lift @ y, omega)
        p, by_omega, by_zeta = self.impedance(omega, zeta)
        inverse = np.zeros_like(p)
        keep = np.arange(h + 1) != 1
        inverse[keep] = _inverse(p[keep])
        if o.size:
            inverse[np.ix_([1], o, o)] = np.linalg.inv(p[1][np.ix_(o, o)])[None]
        push = -(fold.force.T @ balance.rows) / mass + 0j
        given = np.zeros(p.shape[1])
        given[j] = amplitude
        push[1] -= p[1] @ given
        z = np.einsum("kab,kb->ka", inverse, push)
        z[1, j] = amplitude
        miss = y - (z @ faces.T).T
        last = p[1, j] @ z[1] + (balance.rows[:, j] @ fold.force[:, 1]) / mass
        # slopes
        linked = balance.gathered(fold.slope)
        through = inverse @ faces.T / mass  # (H + 1, n, r): -dz/d(forces on y)
        size = x.size - 2
        block = (faces @ through @ linked).reshape(h + 1, r, r, 2 * h + 1)
        block = np.concatenate([block.real, block.imag[1:]]).transpose(1, 0, 2, 3).reshape(size, size)
        jacobian = np.zeros((size + 2, size + 2))
        jacobian[:size, :size] = np.eye(size) + block
        grip = faces[:, j] / mass - p[1, j] @ through[1]
        line = (grip @ linked[1]) / self.scale**2
        jacobian[size, :size], jacobian[size + 1, :size] = line.real, line.imag
        for column, dp, unit in ((size, by_omega, self.scale), (size + 1, by_zeta, 1.0)):
            turned = np.einsum("kab,kbc,kc->ka", inverse, dp, z)
            end = dp[1, j] @ z[1] - p[1, j] @ turned[1]
            if dp is by_omega and fold.rate is not None:
                turned = turned + np.einsum("kar,rk->ka", through, balance.lift.T @ fold.rate)
                end = end + grip @ (balance.lift.T @ fold.rate)[:, 1]
            jacobian[:size, column] = pack((turned @ faces.T).T) * unit
            end = end * unit / self.scale**2
            jacobian[size:, column] = end.real, end.imag
        residual = np.concatenate([pack(miss), [last.real / self.scale**2, last.imag / self.scale**2]])
        return residual, jacobian, Free(amplitude, omega, zeta, balance.lift @ y, fold.force, z)

    def solve(self, x, amplitude: float, goal: float = 1e-10, most: int = 30):
        """(unknowns (N,), Free) by Newton's method from x (N,), at an amplitude [m] of the mode's coordinate.

        goal: of the step, motions counted per amplitude. NotConverged after `most` steps.
        """
        unit = np.append(np.full(x.size - 2, amplitude), [1.0, 1.0])
        rows = np.full(x.size, 1 / amplitude)
        for _ in range(most):
            residual, jacobian, _ = self.system(x, amplitude)
            solve = solve_linear(jacobian * unit * rows[:, None])
            step = -solve(residual * rows)
            length, share, best = float(np.linalg.norm(step)), 1.0, None
            if not np.isfinite(length):
                break
            if length <= goal and np.linalg.norm((residual + jacobian @ (unit * step)) * rows) < 1e-7:
                x = x + unit * step
                return x, self.system(x, amplitude)[2]
            while True:
                tried = x + share * unit * step
                left = np.inf
                if tried[-2] > 0:
                    left = float(np.linalg.norm(solve(self.system(tried, amplitude)[0] * rows)))
                if best is None or left < best[0]:
                    best = (left, tried)
                if left <= (1 - share / 4) * length or share < 0.02:
                    break
                share /= 2
            x = best[1]
        raise NotConverged(f"backbone: no free motion of amplitude {say(amplitude, 3)} was found; give more amplitudes")


def _inverse(p) -> np.ndarray:
    """Inverses (k, n, n); a coordinate that nothing holds at rest keeps its mean."""
    try:
        found = np.linalg.inv(p)
        if np.isfinite(found).all():
            return found
    except np.linalg.LinAlgError:
        pass
    return np.linalg.pinv(p, rcond=1e-13)


def trace(equations: FreeBalance, amplitudes, omega: float, shape) -> list:
    """Free motions along rising amplitudes (k,) [m] from a linear mode (omega, shape (n,)); steps in between where one
    is too wide."""
    balance, h = equations.balance, equations.h
    y = np.zeros((balance.lift.shape[1], h + 1), complex)
    y[:, 1] = balance.faces @ shape
    x = np.append(pack(y), [omega / equations.scale, 0.0])
    done, out = 1.0, []
    for target in amplitudes:
        stops = [float(target)]
        while stops:
            guess = x.copy()
            guess[:-2] *= stops[-1] / done
            try:
                x, free = equations.solve(guess, stops[-1])
            except NotConverged:
                if len(stops) > 12 or not out:
                    raise
                stops.append(float(np.sqrt(done * stops[-1])))
                continue
            done = stops.pop()
        out.append(free)
    return out
