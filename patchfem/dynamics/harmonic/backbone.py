"""Backbone of a mode with friction: natural frequency and damping ratio over amplitude.

A negative damping that balances friction sustains the motion.

z'' + (D - 2 zeta omega) z' + Omega^2 z + faces^T F/m = 0 has, for every amplitude of the mode's
coordinate, one periodic motion with its own omega and zeta: zeta is the loss of a cycle over 8 pi
times the mean kinetic energy, as in a slow free decay (extended periodic motion concept: Krack
2015). With one harmonic and one mode of slide s this is omega^2 = omega_0^2 + s^2 K_eq/m and zeta =
zeta_0 omega_0/omega + loss/(2 pi m omega^2 A^2), where K_eq and the loss are those of the friction loop
of the contact alone.
"""

from typing import NamedTuple

import numpy as np

from ...core import NotConverged
from ...formatting import format_length
from .harmonic import Balance, LinearPart, System, pack_harmonics, solve_damped, unpack_harmonics

# largest number of times that the step between two amplitudes is halved where no motion is found
MAX_HALVINGS = 6


class FreeMotion(NamedTuple):
    """Periodic free motion of one mode at an amplitude, sustained by negative damping.

    - amplitude: amplitude of the coordinate of the mode [m]
    - omega, zeta: frequency [rad/s] and damping ratio
    - slides, forces: (i, H + 1) harmonics of the slides [m] and friction forces [N]
    - modal: (H + 1, n) harmonics of the modal coordinates [m]
    """

    amplitude: float
    omega: float
    zeta: float
    slides: np.ndarray
    forces: np.ndarray
    modal: np.ndarray


class FreeBalance:
    """Harmonic balance of the free motion of one mode that negative damping sustains.

    - balance: HarmonicBalance of the interface rows
    - mode: index of the modal coordinate whose amplitude is prescribed
    - h: number of harmonics

    - scale: scale of the frequency [rad/s]

    The unknowns are the packed slides of `HarmonicBalance` over the amplitude, omega/scale and zeta. The
    prescribed coordinate has no receptance; its two equations determine omega and zeta.
    """

    def __init__(self, balance: Balance, mode: int, harmonics: int, scale: float):
        self.balance = balance
        self.mode = mode
        self.h = harmonics
        self.scale = scale

    def linear(self, omega: float, zeta: float) -> LinearPart:
        """Return the receptances of the modes with the damping -2 zeta omega added.

        The coordinate of prescribed amplitude has no receptance. omega: frequency [rad/s].
        """
        m = self.balance.modes
        k = np.arange(self.h + 1)[:, None, None]
        eye = np.eye(m.omega.size)
        keep = np.arange(m.omega.size) != self.mode
        p = (
            np.diag(m.omega**2)
            - (k * omega) ** 2 * eye
            + 1j * k * omega * (m.damping_matrix - 2 * zeta * omega * eye)
        )
        inverse = np.zeros_like(p)
        right = eye[self.mode] + 0j
        left = eye[self.mode] + 0j
        inverse[np.arange(self.h + 1) != 1] = _invert(p[np.arange(self.h + 1) != 1])
        inverse[np.ix_([1], keep, keep)] = np.linalg.inv(p[1][np.ix_(keep, keep)])
        right -= inverse[1] @ p[1][:, self.mode]
        left -= p[1][self.mode] @ inverse[1]
        slope = -2 * k**2 * omega * eye + 1j * k * (m.damping_matrix - 4 * zeta * omega * eye)
        return LinearPart(inverse, slope, ((1, right, left, left @ p[1][:, self.mode]),))

    def system(self, x, amplitude: float) -> System:
        """Evaluate the balance equations of a free motion at given unknowns and amplitude.

        x: unknowns (N,); amplitude [m], by which all lengths of the equations are divided.

        """
        omega = x[-2] * self.scale
        zeta = x[-1]
        balance = self.balance
        if not omega > 0:
            return System(np.full(x.size, np.inf), np.eye(x.size), None, None, None)
        here = self.linear(omega, zeta)
        one = balance.system(
            np.append(x[:-2] * amplitude, [amplitude, 0.0]), omega, 0.0, self.h, here
        )
        # derivative of the dynamic stiffness with respect to zeta, times the motion
        by_zeta = -2j * np.arange(self.h + 1)[:, None] * omega**2 * one.modal
        turned = balance.faces @ np.einsum("kab,kb->ak", here.inverse, by_zeta)
        last = here.free[0][2] @ by_zeta[1] / omega**2
        jacobian = one.jacobian.copy()
        jacobian[:, -2] = one.by_omega * self.scale / amplitude
        jacobian[:, -1] = np.append(pack_harmonics(turned), [last.real, last.imag]) / amplitude
        return one._replace(residual=one.residual / amplitude, jacobian=jacobian)

    def solve(self, x, amplitude: float) -> tuple:
        """Solve for the free motion at an amplitude by Newton's method.

        x: unknowns (N,) of the initial guess; amplitude [m].

        Returns
        -------
        unknowns : ndarray
        motion : FreeMotion

        Raises
        ------
        NotConverged
            If there is no motion near x.
        """
        found = solve_damped(
            lambda v: self.system(v, amplitude),
            x,
            lambda _, left, size: np.linalg.norm(left) < 1e-7,
        )
        if found is None:
            raise NotConverged(
                f"backbone: no free motion with the amplitude {format_length(amplitude, 3)} was found by "
                "following the motion from smaller amplitudes"
            )
        x = found[0]
        one = self.system(found[0], amplitude)
        slides = self.balance.lift @ unpack_harmonics(
            x[:-2] * amplitude, self.balance.lift.shape[1]
        )
        return x, FreeMotion(
            amplitude, x[-2] * self.scale, x[-1], slides, one.fold.force, one.modal
        )

    def towards(self, x, done: float, target: float) -> np.ndarray:
        """Follow a free motion from one amplitude to another by natural continuation.

        x: unknowns (N,) at the amplitude `start` [m]; target: the other amplitude [m].

        Raises
        ------
        NotConverged
            If a step fails after MAX_HALVINGS halvings.
        """
        stops = [float(target)]
        while stops:
            try:
                x = self.solve(x, stops[-1])[0]
                done = stops.pop()
            except NotConverged:
                if len(stops) > MAX_HALVINGS:
                    raise
                stops.append(float(np.sqrt(done * stops[-1])))
        return x


def _invert(p) -> np.ndarray:
    """Return the inverses of matrices (k, n, n), or pseudoinverses if one is singular.

    A matrix is singular where nothing determines the mean of a coordinate.

    """
    try:
        found = np.linalg.inv(p)
        if np.isfinite(found).all():
            return found
    except np.linalg.LinAlgError:
        pass
    return np.linalg.pinv(p, rcond=1e-13)


def trace_free_motions(equations: FreeBalance, amplitudes, omega: float, shape) -> list:
    """Compute the free motions of a mode at increasing amplitudes from its linear mode.

    Parameters
    ----------
    equations : FreeBalance
    amplitudes : array_like
    omega : float
        Natural frequency of the linear mode [rad/s].
    shape : ndarray
        (n,) shape of the linear mode.

    Returns
    -------
    list of FreeMotion
    """
    balance = equations.balance
    h = equations.h
    y = np.zeros((balance.lift.shape[1], h + 1), complex)
    y[:, 1] = balance.faces @ shape
    x = np.append(pack_harmonics(y), [omega / equations.scale, 0.0])
    done = None
    out = []
    for target in amplitudes:
        x = equations.towards(x, done, target) if out else x
        x, free = equations.solve(x, float(target))
        done = float(target)
        out.append(free)
    return out
