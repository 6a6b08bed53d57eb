"""Backbone curve of a mode with friction: frequency and damping ratio as functions of amplitude.

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
from .harmonic import (
    BalanceEquations,
    HarmonicBalance,
    LinearPart,
    pack_harmonics,
    solve_damped,
    unpack_harmonics,
)

# Largest number of times that the step between two amplitudes is halved if no solution is found.
MAX_HALVINGS = 6
# Largest number of Newton iterations at each amplitude of a continuation. If they do not converge, an amplitude between
# the last solution and this one is solved first, which takes fewer evaluations than more iterations.
MAX_CONTINUATION_ITERATIONS = 10


class FreeMotion(NamedTuple):
    """Periodic free motion of one mode at a given amplitude, sustained by negative damping.

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
    """Harmonic balance for the free motion of one mode that is sustained by negative damping.

    - balance: HarmonicBalance of the interface rows
    - mode: index of the modal coordinate whose amplitude is prescribed
    - h: number of harmonics

    - scale: scale of the frequency [rad/s]
    - excitation: (n, n) matrix E of a force 2 zeta omega m E z' in the first harmonic alone, such as that of a shaker;
      None for the negative damping 2 zeta omega m z' of all coordinates in all harmonics

    The unknowns are the packed slides of `HarmonicBalance` divided by the amplitude, omega/scale and zeta. The
    prescribed coordinate has no receptance; its two equations determine omega and zeta.
    """

    def __init__(
        self,
        balance: HarmonicBalance,
        mode: int,
        harmonics: int,
        scale: float,
        excitation: np.ndarray | None = None,
    ):
        self.balance = balance
        self.mode = mode
        self.h = harmonics
        self.scale = scale
        n = balance.modes.omega.size
        # matrix of the exciting force for each harmonic
        self.excitation = np.broadcast_to(np.eye(n), (harmonics + 1, n, n))
        if excitation is not None:
            is_first = np.arange(harmonics + 1) == 1
            self.excitation = is_first[:, None, None] * excitation

    def make_linear_part(self, omega: float, zeta: float) -> LinearPart:
        """Return the receptances of the modes, to which the damping -2 zeta omega E is added.

        The coordinate of prescribed amplitude has no receptance. omega: frequency [rad/s].
        """
        modes = self.balance.modes
        k = np.arange(self.h + 1)[:, None, None]
        eye = np.eye(modes.omega.size)
        is_other = np.arange(modes.omega.size) != self.mode
        dynamic_stiffness = (
            np.diag(modes.omega**2)
            - (k * omega) ** 2 * eye
            + 1j * k * omega * (modes.damping_matrix - 2 * zeta * omega * self.excitation)
        )
        inverse = np.zeros_like(dynamic_stiffness)
        right_vector = eye[self.mode] + 0j
        left_vector = eye[self.mode] + 0j
        inverse[np.arange(self.h + 1) != 1] = _invert_matrices(
            dynamic_stiffness[np.arange(self.h + 1) != 1]
        )
        inverse[np.ix_([1], is_other, is_other)] = np.linalg.inv(
            dynamic_stiffness[1][np.ix_(is_other, is_other)]
        )
        right_vector -= inverse[1] @ dynamic_stiffness[1][:, self.mode]
        left_vector -= dynamic_stiffness[1][self.mode] @ inverse[1]
        damping_slope = modes.damping_matrix - 4 * zeta * omega * self.excitation
        slope = -2 * k**2 * omega * eye + 1j * k * damping_slope
        return LinearPart(
            inverse,
            slope,
            ((1, right_vector, left_vector, left_vector @ dynamic_stiffness[1][:, self.mode]),),
        )

    def evaluate(self, x, amplitude: float) -> BalanceEquations:
        """Evaluate the balance equations for a free motion at given unknowns and amplitude.

        x: unknowns (N,); amplitude [m], by which all lengths of the equations are divided.

        """
        omega = x[-2] * self.scale
        zeta = x[-1]
        balance = self.balance
        if not omega > 0:
            return BalanceEquations(np.full(x.size, np.inf), np.eye(x.size), None, None, None)
        linear_part = self.make_linear_part(omega, zeta)
        equations = balance.evaluate(
            np.append(x[:-2] * amplitude, [amplitude, 0.0]), omega, 0.0, self.h, linear_part
        )
        # This is the derivative of the dynamic stiffness with respect to zeta, times the motion.
        excited = np.einsum("kab,kb->ka", self.excitation, equations.modal)
        by_zeta = -2j * np.arange(self.h + 1)[:, None] * omega**2 * excited
        slides_by_zeta = balance.faces @ np.einsum("kab,kb->ak", linear_part.inverse, by_zeta)
        residual_by_zeta = linear_part.free[0][2] @ by_zeta[1] / omega**2
        jacobian = equations.jacobian.copy()
        jacobian[:, -2] = equations.by_omega * self.scale / amplitude
        jacobian[:, -1] = (
            np.append(
                pack_harmonics(slides_by_zeta), [residual_by_zeta.real, residual_by_zeta.imag]
            )
            / amplitude
        )
        return equations._replace(residual=equations.residual / amplitude, jacobian=jacobian)

    def solve(self, x, amplitude: float, max_steps: int = 40) -> tuple:
        """Solve for the free motion at an amplitude by Newton's method.

        x: unknowns (N,) of the initial guess; amplitude [m]; max_steps: number of Newton iterations.

        Returns
        -------
        unknowns : ndarray
        motion : FreeMotion

        Raises
        ------
        NotConverged
            If there is no motion near x.
        """
        solution = solve_damped(
            lambda v: self.evaluate(v, amplitude),
            x,
            lambda _, left, size: np.linalg.norm(left) < 1e-7,
            max_steps=max_steps,
        )
        if solution is None:
            raise NotConverged(
                f"backbone: no free motion with the amplitude {format_length(amplitude, 3)} was found by "
                "following the motion from smaller amplitudes"
            )
        x = solution[0]
        equations = self.evaluate(solution[0], amplitude)
        slides = self.balance.lift @ unpack_harmonics(
            x[:-2] * amplitude, self.balance.lift.shape[1]
        )
        return x, FreeMotion(
            amplitude, x[-2] * self.scale, x[-1], slides, equations.fold.force, equations.modal
        )

    def follow_to_amplitude(self, x, start: float, target: float) -> np.ndarray:
        """Follow a free motion from one amplitude to another by natural continuation.

        Parameters
        ----------
        x : (N,) ndarray
            Unknowns at the amplitude `start`.
        start, target : float
            First and last amplitude [m].

        Raises
        ------
        NotConverged
            If a step fails after MAX_HALVINGS halvings.
        """
        targets = [float(target)]
        while targets:
            try:
                x = self.solve(x, targets[-1], MAX_CONTINUATION_ITERATIONS)[0]
                start = targets.pop()
            except NotConverged:
                if len(targets) > MAX_HALVINGS:
                    raise
                targets.append(float(np.sqrt(start * targets[-1])))
        return x


def _invert_matrices(matrices) -> np.ndarray:
    """Return the inverses of matrices (k, n, n), or their pseudoinverses if one of them is singular.

    A matrix is singular if nothing determines the mean of a coordinate.

    """
    try:
        inverses = np.linalg.inv(matrices)
        if np.isfinite(inverses).all():
            return inverses
    except np.linalg.LinAlgError:
        pass
    return np.linalg.pinv(matrices, rcond=1e-13)


def trace_free_motions(equations: FreeBalance, amplitudes, omega: float, shape) -> list:
    """Compute the free motions of a mode at increasing amplitudes, starting from its linear mode shape.

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
    last_amplitude = None
    motions = []
    for target in amplitudes:
        x = equations.follow_to_amplitude(x, last_amplitude, target) if motions else x
        x, motion = equations.solve(x, float(target))
        last_amplitude = float(target)
        motions.append(motion)
    return motions
