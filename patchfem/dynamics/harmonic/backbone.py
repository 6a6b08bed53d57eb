"""Free motions of a mode with friction that a negative damping sustains: frequency and damping over amplitude.

z'' + (D - 2 zeta omega E) z' + Omega^2 z + rows^T F/m = 0 has, for every amplitude of the mode's coordinate, one periodic
motion with its own omega and zeta. With E = 1, zeta is the loss of a cycle over 8 pi times the mean kinetic energy, as
in a slow free decay (extended periodic motion concept: Krack, Comput. Struct. 154, 59, 2015). With one harmonic and one
mode of slide s this is omega^2 = omega_0^2 + s^2 K_eq/m and zeta = zeta_0 omega_0/omega + loss/(2 pi m omega^2 A^2), where
K_eq and the loss are those of the friction loop of the contact alone.

The unknowns are the slides, omega, zeta and the amplitude a of the coordinate z_j in the first harmonic. A spring and
damper of any size holds z_j at a, and its force must vanish: z_j = a. A further condition selects the motion.
"""

from typing import NamedTuple

import numpy as np

from ...core import NotConverged
from ...formatting import format_length
from .equations import HarmonicBalance, solve_damped, split_equations
from .laws import MAX_SAMPLES_PER_CYCLE
from .series import N_SAMPLES, evaluate_series, find_loss, half_range, pack_harmonics

# Largest number of times that the step between two amplitudes is halved if no solution is found.
MAX_STEP_HALVINGS = 6
# Largest number of Newton steps at each amplitude of a continuation. If they do not converge, an amplitude between the
# last solution and this one is solved first, which takes fewer evaluations than more steps.
MAX_CONTINUATION_STEPS = 10
MAX_RESIDUAL = (
    1e-7  # residual after the last Newton step, relative to the amplitude, that is round-off
)


class FreeMotion(NamedTuple):
    """Periodic free motion of one mode, sustained by negative damping.

    - amplitude: that of the coordinate of the mode in the first harmonic [m]
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

    @property
    def loss(self) -> float:
        """Friction loss per cycle [J]."""
        return find_loss(self.slides, self.forces)


class FreeEquations(NamedTuple):
    """Equations of a free motion.

    - residual: (N,) [m]
    - jacobian: (N, N) derivatives by the unknowns
    - motion: the motion that the unknowns describe, or None if omega is not positive
    """

    residual: np.ndarray
    jacobian: np.ndarray
    motion: FreeMotion | None


class FreeBalance:
    """Harmonic balance for free motions of a coordinate.

    The unknowns are the packed slides [m], omega relative to that of the mode with sticking contacts, zeta, and the
    amplitude a of the coordinate [m].

    Parameters
    ----------
    balance : HarmonicBalance
        Modes and laws, with a number of samples per cycle.
    mode : int
        Index of the coordinate.
    harmonics : int
        Number of harmonics H.
    excitation : (n, n) array, optional
        Matrix E of a force 2 zeta omega m E z' in the first harmonic alone, such as that of a shaker; default: the
        negative damping of all coordinates in all harmonics.
    output : (n,) array, optional
        Row of the displacement to which amplitudes belong, as half its range; default: the coordinate in the first
        harmonic.
    """

    def __init__(
        self, balance: HarmonicBalance, mode: int, harmonics: int, excitation=None, output=None
    ):
        modes = balance.modes
        group = balance.group
        self.balance = balance
        self.mode = mode
        self.output = output
        self.stuck_mode = modes.compute_stuck_mode(group.rows, group.stiffness(), mode)
        self.omega = self.stuck_mode.omega

        # Matrices of each harmonic: E, and the spring and damper of the coordinate, which are as stiff as the mode.
        eye = np.eye(modes.omega.size)
        is_first = (np.arange(harmonics + 1) == 1)[:, None, None]
        self.excitation = np.repeat(eye[None], harmonics + 1, axis=0)
        if excitation is not None:
            self.excitation = is_first * excitation
        self.holding = is_first * self.omega**2 * (1 + 1j) * np.outer(eye[mode], eye[mode])

    def start(self, omega: float, shape, amplitude: float) -> np.ndarray:
        """Return the unknowns of a linear mode.

        Parameters
        ----------
        omega : float
            Frequency of the mode [rad/s].
        shape : (n,) array
            Shape of the mode by its coordinates.
        amplitude : float
            At the output [m].
        """
        rows = self.balance.rows
        reach = 1.0 if self.output is None else abs(float(self.output @ shape))
        y = np.zeros((len(rows), len(self.excitation)), complex)
        y[:, 1] = rows @ shape * amplitude / reach
        return np.append(pack_harmonics(y), [omega / self.omega, 0.0, amplitude / reach])

    def evaluate(self, x, amplitude: float | None) -> FreeEquations:
        """Evaluate the equations of a free motion.

        Parameters
        ----------
        x : (N,) array
            Unknowns.
        amplitude : float or None
            Amplitude of the output [m]; None for a motion without damping, zeta = 0.
        """
        balance = self.balance
        omega = x[-3] * self.omega
        zeta, a = x[-2:]
        if not omega > 0:
            return FreeEquations(np.full(x.size, np.inf), np.eye(x.size), None)

        # Motion under the negative damping and the spring, whose other end moves by a.
        damping = balance.modes.damping_matrix - 2 * zeta * omega * self.excitation
        unit = self.holding[:, self.mode]
        motion = balance.find_motion(
            x[:-3], omega, unit * a, damping, -2 * zeta * self.excitation, self.holding
        )

        # Derivatives of the coordinates by all unknowns.
        k = np.arange(len(unit))
        by_zeta = 2j * omega**2 * np.einsum("k,kab,kb->ka", k, self.excitation, motion.modal)
        by_last = motion.inverse @ np.stack([by_zeta, unit], axis=2)
        by_omega = motion.by_omega[..., None] * self.omega
        slopes = np.concatenate([motion.by_unknowns, by_omega, by_last], axis=2)

        # Equations: slides, amplitude and phase of the coordinate, and the condition of the motion.
        first = motion.modal[1, self.mode]
        by_first = slopes[1, self.mode]
        condition, gradient = self._evaluate_amplitude_condition(x, amplitude, motion.modal, slopes)
        slides = x[:-3] - split_equations(motion.modal @ balance.rows.T)
        residual = np.append(slides, [first.real - a, first.imag, condition])
        jacobian = np.eye(x.size)
        jacobian[:-3] -= split_equations(balance.rows @ slopes)
        jacobian[-3:] = by_first.real, by_first.imag, gradient
        jacobian[-3, -1] -= 1.0
        slides = balance.unpack_slides(x[:-3])
        return FreeEquations(
            residual, jacobian, FreeMotion(a, omega, zeta, slides, motion.force, motion.modal)
        )

    def _evaluate_amplitude_condition(
        self, x, amplitude: float | None, modal, slopes
    ) -> tuple[float, np.ndarray]:
        """Return residual [m] and derivatives (N,) of the condition that selects the motion.

        Parameters
        ----------
        x : (N,) array
            Unknowns, which end with omega, zeta and the amplitude of the coordinate.
        amplitude : float or None
            Amplitude of the output [m]. None selects a motion without damping, zeta a = 0.
        modal : (H + 1, n) array
            Harmonics of the coordinates [m].
        slopes : (H + 1, n, N) array
            Derivatives of these harmonics by the unknowns.
        """
        gradient = np.zeros(x.size)
        if amplitude is None:
            gradient[-2:] = x[-1], x[-2]
            return x[-2] * x[-1], gradient
        if self.output is None:
            gradient[-1] = 1.0
            return x[-1] - amplitude, gradient
        output = modal @ self.output
        motion = evaluate_series(output, N_SAMPLES)
        ends = 2 * np.pi / N_SAMPLES * np.array([np.argmax(motion), np.argmin(motion)])
        high, low = np.exp(1j * np.outer(ends, np.arange(output.size)))
        return half_range(output) - amplitude, ((high - low) @ (self.output @ slopes)).real / 2

    def solve(
        self, x, amplitude: float | None, max_steps: int = 40
    ) -> tuple[np.ndarray, FreeMotion]:
        """Solve for the unknowns and the motion at an amplitude of the output [m], or without damping for None.

        Parameters
        ----------
        x : (N,) array
            Unknowns of a similar motion.
        amplitude : float or None
            At the output [m]; None for a motion without damping.
        max_steps : int
            Number of Newton steps.

        Raises
        ------
        NotConverged
            If there is no motion near x.
        """
        # Slides and residuals in units of the amplitude. Frequency and damping ratio have the size 1.
        size = abs(x[-1])
        unit = np.full(x.size, size)
        unit[-3:-1] = 1.0

        def evaluate(scaled) -> FreeEquations:
            """Return the equations (`FreeEquations`) for scaled unknowns (N,), in units of the motion."""
            residual, jacobian, motion = self.evaluate(scaled * unit, amplitude)
            return FreeEquations(residual / size, jacobian * unit / size, motion)

        def is_solved(equations, residual, size) -> bool:
            """Return whether the scaled residual is small after the last step.

            Parameters
            ----------
            equations : FreeEquations
                Scaled equations before the step (unused).
            residual : (N,) array
                Their linearised residual after it [1].
            size : float
                Norm of the unknowns. It is not used, because the residual is scaled.
            """
            return float(np.linalg.norm(residual)) < MAX_RESIDUAL

        solution = solve_damped(evaluate, x / unit, is_solved, max_steps)
        if solution is None:
            raise NotConverged(
                f"backbone: no free motion with the amplitude {format_length(amplitude or size, 3)} was found by "
                "following the motion from smaller amplitudes"
            )
        x = solution[0] * unit
        return x, self.evaluate(x, amplitude).motion

    def follow(self, x, start: float, target: float) -> tuple[np.ndarray, FreeMotion]:
        """Follow a free motion from one amplitude to another.

        Parameters
        ----------
        x : (N,) array
            Unknowns at the first amplitude.
        start, target : float
            First and last amplitude [m].

        Returns
        -------
        x : (N,) array
            Unknowns at the last amplitude.
        motion : FreeMotion

        Raises
        ------
        NotConverged
            If a step fails after MAX_STEP_HALVINGS halvings.
        """
        targets = [float(target)]
        while targets:
            # First guess: slides and amplitude in proportion to the target. Frequency and damping ratio stay.
            scaled = x * (targets[-1] / start)
            scaled[-3:-1] = x[-3:-1]
            try:
                x, motion = self.solve(scaled, targets[-1], MAX_CONTINUATION_STEPS)
                start = targets.pop()
            except NotConverged:
                if len(targets) > MAX_STEP_HALVINGS:
                    raise
                targets.append(float(np.sqrt(start * targets[-1])))
        return x, motion


class FreeSolution(NamedTuple):
    """Free motion at an amplitude of the output [m], and its unknowns (N,)."""

    amplitude: float
    unknowns: np.ndarray
    motion: FreeMotion


def make_free_balance(
    modes,
    group,
    mode: int,
    max_amplitude: float,
    harmonics: int,
    excitation=None,
    output=None,
    factor: int = 1,
) -> FreeBalance:
    """Return the balance of the free motions of a mode up to an amplitude of the output [m].

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    group : LawGroup
        Laws of the interfaces.
    mode : int
        Index of the coordinate of the mode.
    harmonics : int
        Number of harmonics.
    excitation : (n, n) array, optional
        Matrix E of the exciting force 2 zeta omega m E z'; default: a negative damping of all coordinates.
    output : (n,) array, optional
        Row of the displacement to which amplitudes belong; default: the coordinate.
    max_amplitude : float
        At the output [m]; it decides how many samples resolve the corners of the force.
    factor : int, optional
        Samples per cycle, relative to those that the laws need.
    """
    shape = modes.compute_stuck_mode(group.rows, group.stiffness(), mode).shape
    reach = 1.0 if output is None else abs(float(output @ shape))
    widest = np.abs(group.rows @ shape) * max_amplitude / reach
    samples = min(factor * group.samples_for(harmonics, widest), MAX_SAMPLES_PER_CYCLE)
    balance = HarmonicBalance(modes, group, samples)
    return FreeBalance(balance, mode, harmonics, excitation, output)


def find_free_motions(
    equations: FreeBalance,
    amplitudes,
    small: float = 0.0,
    starts: list[FreeSolution | None] | None = None,
    mode: tuple | None = None,
) -> list[FreeSolution | None]:
    """Find the free motions at increasing amplitudes (k,) [m] of the output; None where none is found.

    A search starts from the similar motion in `starts`, else from the motion at the amplitude before. If there is none,
    for example after a fold of the curve, it starts from the linear mode, for the first motion also via a small
    amplitude. Motions that are still missing are then searched for from the motion at the next larger amplitude.

    Parameters
    ----------
    equations : FreeBalance
        Equations of the mode.
    amplitudes : (k,) array
        At the output [m], increasing.
    small : float, optional
        Amplitude [m] at which the linear mode is nearly exact.
    starts : list, optional
        Similar motions.
    mode : tuple, optional
        Frequency [rad/s] and shape (n,) of the linear mode; by default that of the sticking contact.
    """
    linear_mode = mode or equations.stuck_mode

    def solve_near(neighbour: FreeSolution | None, amplitude: float) -> FreeSolution | None:
        """Solve at an amplitude with a similar motion as initial guess; None if this fails."""
        if neighbour is None:
            return None
        try:
            found = equations.follow(neighbour.unknowns, neighbour.amplitude, amplitude)
        except NotConverged:
            return None
        return FreeSolution(amplitude, *found)

    def solve_linear_mode(amplitude: float) -> FreeSolution | None:
        """Solve at an amplitude with the linear mode as initial guess; None if this fails."""
        try:
            return FreeSolution(
                amplitude, *equations.solve(equations.start(*linear_mode, amplitude), amplitude)
            )
        except NotConverged:
            return None

    # Motions are followed upwards, then downwards to those that are missing.
    out: list[FreeSolution | None] = [None] * len(amplitudes)
    for k, amplitude in enumerate(map(float, amplitudes)):
        out[k] = solve_near(starts[k] if starts else None, amplitude)
        out[k] = out[k] or solve_near(out[k - 1] if k else None, amplitude)
        out[k] = out[k] or solve_linear_mode(amplitude)
        if out[k] is None and 0 < small < amplitude and not any(out):
            out[k] = solve_near(solve_linear_mode(small), amplitude)

    for k in range(len(amplitudes) - 2, -1, -1):
        out[k] = out[k] or solve_near(out[k + 1], float(amplitudes[k]))
    return out
