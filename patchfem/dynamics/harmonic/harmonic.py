"""Harmonic balance under a sinusoidal drive signal; the unknowns are relative displacements.

The linear part of the structure is exact.

With theta = omega t every quantity is x(theta) = Re sum_k X_k exp(i k theta), k = 0..H, and the
modes are condensed to the interface rows: q_k = q_k(drive) - G_k F_k, G_k = faces (Omega^2 - k^2
omega^2 + i k omega D)^-1 faces^T/m. The contact is any callable from the harmonics of the slides to
those of the forces with their Jacobian (alternating frequency/time), so the laws are independent of it.
Harmonics of the force above H estimate the truncation error.

A mode without dynamic stiffness at a harmonic (a rigid mode at k = 0, an undamped one
at its natural frequency) has no receptance: its coordinate becomes an additional unknown and the
balance of its forces an additional equation.

Method: Krack & Gross, Harmonic Balance for Nonlinear Vibration Problems, 2019; damped Newton:
Deuflhard 2004.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import ModalBasis, NotConverged, PatchfemError
from ..periodic import solve_linear

# Largest dynamic stiffness of a mode, relative to its scale, that is treated as singular;
# the mode then has no receptance.
SINGULAR_RATIO = 1e-10


class ContactResponse(NamedTuple):
    """Harmonics of the contact forces over a cycle, and their derivatives.

    - force: (i, K + 1) complex [N], K >= H
    - slope: (i, H + 1, 2 H + 1) complex [N/m], derivative with respect to Re q_0..Re q_H, Im
      q_1..Im q_H of the same row
    - rate: (i, H + 1) [N s], derivative with respect to omega, or None
    """

    force: np.ndarray
    slope: np.ndarray | None = None
    rate: np.ndarray | None = None


def pack_harmonics(x) -> np.ndarray:
    """Pack complex harmonics (r, H + 1) into a real vector (r (2 H + 1),).

    Each row has the real parts of k = 0 to H, then the imaginary parts of k = 1 to H.
    """
    return np.concatenate([x.real, x.imag[:, 1:]], axis=1).ravel()


def unpack_harmonics(v, rows: int) -> np.ndarray:
    """Unpack complex harmonics (rows, H + 1) from a real vector made by `pack_harmonics`."""
    v = v.reshape(rows, -1)
    h = v.shape[1] // 2
    x = v[:, : h + 1].astype(complex)
    x[:, 1:] += 1j * v[:, h + 1 :]
    return x


def _to_real_equations(c) -> np.ndarray:
    """Split complex equations (H + 1, ...) into their real and imaginary parts (2 H + 1, ...)."""
    return np.concatenate([c.real, c.imag[1:]], axis=0)


@dataclass(frozen=True, eq=False, slots=True)
class LinearPart:
    """Receptances of the modes at the harmonics of one drive frequency.

    - inverse, slope: (H + 1, n, n) receptance R_k and d(R_k^-1)/d omega
    - free: (k, right (n,), left (n,), stiffness) of every coordinate without receptance
    """

    inverse: np.ndarray
    slope: np.ndarray
    free: tuple


def make_linear_part(modes: ModalBasis, omega: float, harmonics: int) -> LinearPart:
    """Compute the receptances of the modes at the harmonics of a frequency.

    They are (Omega^2 - k^2 omega^2 + i k omega D)^-1 for k = 0 to `harmonics`.

    Parameters
    ----------
    modes : ModalBasis
    omega : float
        [rad/s].
    harmonics : int

    Returns
    -------
    LinearPart
    """
    n = modes.omega.size
    k = np.arange(harmonics + 1)
    angular_rates = k * omega
    slope = (-2 * k * angular_rates)[:, None, None] * np.eye(n) + 1j * k[
        :, None, None
    ] * modes.damping_matrix
    if modes.damping is None:
        stiffnesses = (
            modes.omega**2
            - angular_rates[:, None] ** 2
            + 2j * angular_rates[:, None] * modes.zeta * modes.omega
        )
        scale = np.maximum(modes.omega**2 + angular_rates[:, None] ** 2, omega**2)
        is_singular = np.abs(stiffnesses) < SINGULAR_RATIO * scale
        inverse = np.zeros((k.size, n, n), complex)
        inverse[:, np.arange(n), np.arange(n)] = np.where(
            is_singular, 0.0, 1 / np.where(is_singular, 1.0, stiffnesses)
        )
        unit = np.eye(n)
        return LinearPart(
            inverse,
            slope,
            tuple(
                (int(h), unit[j], unit[j], stiffnesses[h, j]) for h, j in np.argwhere(is_singular)
            ),
        )
    dynamic_stiffness = (
        np.diag(modes.omega**2)
        - (angular_rates**2)[:, None, None] * np.eye(n)
        + 1j * angular_rates[:, None, None] * modes.damping_matrix
    )
    u, s, vh = np.linalg.svd(dynamic_stiffness)
    is_singular = s < SINGULAR_RATIO * np.maximum(
        np.max(modes.omega) ** 2 + angular_rates[:, None] ** 2, omega**2
    )
    inverse = (
        vh.conj().transpose(0, 2, 1)
        * np.where(is_singular, 0.0, 1 / np.where(is_singular, 1.0, s))[:, None, :]
    ) @ u.conj().transpose(0, 2, 1)
    return LinearPart(
        inverse,
        slope,
        tuple(
            (int(h), vh[h, j].conj(), u[h, :, j].conj(), s[h, j])
            for h, j in np.argwhere(is_singular)
        ),
    )


class BalanceEquations(NamedTuple):
    """Residual and Jacobian of the harmonic balance for given unknowns.

    - residual: (N,), jacobian: (N, N)
    - by_omega, by_level: (N,) derivatives with respect to omega and to the amplitude of the drive
    - fold: forces of the contact
    - modal: (H + 1, n) modal harmonics [m]
    """

    residual: np.ndarray
    jacobian: np.ndarray
    by_omega: np.ndarray
    by_level: np.ndarray
    fold: ContactResponse
    modal: np.ndarray | None = None


class HarmonicBalance:
    """Harmonic balance of a modal basis with contact forces on its interface rows.

    rows: (i, n); contact: (q (i, H + 1), omega) -> ContactResponse.

    If the rows are linearly dependent, the unknowns are `rank` combinations
    y of the slides, q = lift y. The unknowns are the packed harmonics of y, then the coordinates without
    receptance. PatchfemError is raised if no mode moves the rows.
    """

    def __init__(self, modes: ModalBasis, rows, contact):
        rows = np.asarray(rows, float)
        u, s, vt = np.linalg.svd(rows, full_matrices=False)
        # The singular values of linearly dependent rows are below this round-off limit.
        rank = int(np.sum(s > 1e-12 * s[0])) if s[0] > 0 else 0
        if rank == 0:
            raise PatchfemError(
                "structure.mode.slide: no mode moves the interface, so no friction acts and harmonic "
                "balance is not needed; give a mode the key `slide`"
            )
        is_independent = rank == rows.shape[0]
        self.modes = modes
        self.rows = rows
        self.contact = contact
        self.lift = np.eye(rank) if is_independent else u[:, :rank]
        self.faces = rows if is_independent else s[:rank, None] * vt[:rank]
        self._linear = {}

    def with_contact(self, contact) -> "HarmonicBalance":
        """Return a copy of the harmonic balance with a different contact."""
        copy = object.__new__(HarmonicBalance)
        copy.__dict__.update(self.__dict__, contact=contact)
        return copy

    def get_linear_part(self, omega: float, harmonics: int) -> LinearPart:
        """Return the modal receptances at a frequency [rad/s]; nine frequencies are cached."""
        key = (omega, harmonics)
        if key not in self._linear:
            if len(self._linear) > 8:
                self._linear.clear()
            self._linear[key] = make_linear_part(self.modes, omega, harmonics)
        return self._linear[key]

    def count_unknowns(self, omega: float, harmonics: int) -> int:
        """Return the number of real unknowns at a frequency omega [rad/s]."""
        free = self.get_linear_part(omega, harmonics).free
        return self.lift.shape[1] * (2 * harmonics + 1) + sum(1 if k == 0 else 2 for k, *_ in free)

    def unpack_slides(self, x, omega: float, harmonics: int) -> np.ndarray:
        """Unpack the harmonics (i, H + 1) [m] of the relative displacements from the unknowns.

        Parameters
        ----------
        x : ndarray
        omega : float
        harmonics : int

        Returns
        -------
        ndarray
        """
        r = self.lift.shape[1]
        return self.lift @ unpack_harmonics(x[: r * (2 * harmonics + 1)], r)

    def compute_modal_motion(
        self, x, omega: float, level: float, harmonics: int, force
    ) -> np.ndarray:
        """Compute the modal harmonics (K + 1, n) [m] due to the drive signal and contact forces.

        Parameters
        ----------
        x : ndarray
            (N,) unknowns.
        omega, level : float
            Frequency [rad/s] and amplitude [m s-2] of the drive.
        harmonics : int
            H of the unknowns; K may be larger.
        force : ndarray

        Returns
        -------
        ndarray
        """
        n_harmonics = force.shape[1] - 1
        return self._compute_motion(
            self.get_linear_part(omega, n_harmonics),
            self._unpack_coordinates(x, self.get_linear_part(omega, harmonics), harmonics),
            level,
            force,
        )

    def _unpack_coordinates(self, x, linear_part: LinearPart, harmonics) -> list:
        free_unknowns = x[self.lift.shape[1] * (2 * harmonics + 1) :]
        coordinates = []
        position = 0
        for k, *_ in linear_part.free:
            coordinates.append(
                complex(free_unknowns[position], free_unknowns[position + 1] if k else 0.0)
            )
            position += 2 if k else 1
        return coordinates

    def _compute_motion(self, linear_part, coordinates, level, force):
        modal_force = -(force.T @ self.rows) / self.modes.mass + 0j
        if len(modal_force) > 1:
            modal_force[1] += 1j * level * self.modes.base
        z = np.einsum("kab,kb->ka", linear_part.inverse, modal_force)
        for (k, right, *_), c in zip(linear_part.free, coordinates):
            z[k] += right * c
        return z

    def evaluate(
        self, x, omega: float, level: float, harmonics: int, linear_part: LinearPart | None = None
    ) -> BalanceEquations:
        """Evaluate the residual and the Jacobian of the harmonic balance for given unknowns.

        Parameters
        ----------
        x : ndarray
        omega, level : float
            Frequency [rad/s] and amplitude [m s-2] of the drive.
        harmonics : int
        linear_part : LinearPart, optional
            Receptances in place of those of the modes.

        Returns
        -------
        BalanceEquations
        """
        h = harmonics
        r = self.lift.shape[1]
        mass = self.modes.mass
        linear_part = linear_part or self.get_linear_part(omega, h)
        coordinates = self._unpack_coordinates(x, linear_part, h)
        y = unpack_harmonics(x[: r * (2 * h + 1)], r)
        response = self.contact(self.lift @ y, omega)
        z = self._compute_motion(linear_part, coordinates, level, response.force[:, : h + 1])
        force_to_slide = -np.einsum("ra,kab->krb", self.faces, linear_part.inverse)  # -faces R_k
        residual = y - (z @ self.faces.T).T
        receptance = -force_to_slide @ self.faces.T / mass  # (H + 1, r, r)
        reduced_slope = self.combine_slopes(response.slope)
        block = (receptance @ reduced_slope).reshape(h + 1, r, r, 2 * h + 1)
        size = r * (2 * h + 1)
        jacobian = np.eye(x.size)
        block = _to_real_equations(block).transpose(1, 0, 2, 3).reshape(size, size)
        jacobian[:size, :size] += block
        by_omega = -np.einsum("krb,kbc,kc->rk", force_to_slide, linear_part.slope, z)
        if response.rate is not None:
            by_omega = by_omega + np.einsum("krs,sk->rk", receptance, self.lift.T @ response.rate)
        by_level = np.zeros((r, h + 1), complex)
        if h:
            by_level[:, 1] = 1j * force_to_slide[1] @ self.modes.base
        parts = [[pack_harmonics(residual)], [pack_harmonics(by_omega)], [pack_harmonics(by_level)]]
        self._append_free_equations(
            linear_part,
            coordinates,
            jacobian,
            parts,
            response,
            z,
            level,
            reduced_slope,
            omega,
            size,
        )
        return BalanceEquations(
            *[np.concatenate(parts[0])],
            jacobian,
            np.concatenate(parts[1]),
            np.concatenate(parts[2]),
            response,
            z,
        )

    def free_residual(self, free, c, omega: float, level: float, force) -> complex:
        """Return the force residual of a coordinate that has no receptance, divided by omega^2 [m].

        Parameters
        ----------
        free : tuple
            Harmonic, left vector and stiffness of the coordinate.
        c : float
            Value of the coordinate [m].
        omega : float
            [rad/s].
        level : float
            Amplitude of the drive [m s-2].
        force : ndarray
            (i, K + 1) harmonics of the forces [N].

        Returns
        -------
        complex
        """
        k, left_vector, stiffness = free
        drive = left_vector @ self.modes.base if k == 1 else 0.0
        return (
            stiffness * c
            + left_vector @ (self.rows.T @ force[:, k]) / self.modes.mass
            - 1j * level * drive
        ) / omega**2

    def combine_slopes(self, slope) -> np.ndarray:
        """Transform the force derivatives of the interface rows to the reduced displacements y.

        Their shapes are (i, H + 1, 2 H + 1) and (H + 1, r, r (2 H + 1)).
        """
        count, r = self.lift.shape
        h = slope.shape[1] - 1
        pairs = (self.lift[:, :, None] * self.lift[:, None, :]).reshape(count, r * r)
        combined = (pairs.T @ np.ascontiguousarray(slope).reshape(count, -1).view(float)).view(
            complex
        )
        return combined.reshape(r, r, h + 1, 2 * h + 1).transpose(2, 0, 1, 3).reshape(h + 1, r, -1)

    def is_round_off(
        self,
        equations: BalanceEquations,
        residual,
        omega: float,
        level: float,
        harmonics: int,
        size: float,
    ) -> bool:
        """Return whether the residual that remains after the last Newton step is due to round-off.

        A least-squares step can vanish at a point that is no solution.

        Parameters
        ----------
        equations : LinearPart
        residual : ndarray
            Residual after the step [m].
        omega : float
            [rad/s].
        level : float
            Amplitude of the drive [m s-2].
        harmonics : int
        size : float
            Size of the unknowns [m].

        Returns
        -------
        bool
        """
        n_slide_unknowns = self.lift.shape[1] * (2 * harmonics + 1)
        force_scale = float(np.linalg.norm(equations.fold.force) * np.linalg.norm(self.rows)) / (
            self.modes.mass * omega**2
        )
        for part, part_scale in (
            (slice(0, n_slide_unknowns), size),
            (slice(n_slide_unknowns, None), force_scale),
        ):
            scale = part_scale + abs(level) * float(np.linalg.norm(equations.by_level[part]))
            # The residual of a solution is round-off; at a minimum of the residual
            # that is not a root, it is larger.
            if float(np.linalg.norm(residual[part])) > 1e-7 * scale:
                return False
        return True

    def _append_free_equations(
        self,
        linear_part,
        coordinates,
        jacobian,
        parts,
        response,
        z,
        level,
        reduced_slope,
        omega,
        size,
    ):
        """Append the equations of modal coordinates that have no receptance to the balance.

        The equations are divided by omega^2 [m].
        """
        h = z.shape[0] - 1
        r = self.lift.shape[1]
        position = size
        for (k, right_vector, left_vector, stiffness), c in zip(linear_part.free, coordinates):
            w = left_vector @ self.rows.T / self.modes.mass / omega**2
            drive = left_vector @ self.modes.base / omega**2 if k == 1 else 0.0
            residual = self.free_residual(
                (k, left_vector, stiffness), c, omega, level, response.force
            )
            by_omega = left_vector @ linear_part.slope[k] @ z[k] / omega**2 - 2 * residual / omega
            if response.rate is not None:
                by_omega = by_omega + w @ response.rate[:, k]
            row = left_vector @ self.faces.T / self.modes.mass / omega**2 @ reduced_slope[k]
            slide_by_coordinate = self.faces @ right_vector
            count = 2 if k else 1
            for j in range(count):
                unit = 1j**j
                jacobian[position + j, :size] = (row.real, row.imag)[j]
                diagonal = stiffness / omega**2 * unit
                column = np.zeros((r, h + 1), complex)
                column[:, k] = -slide_by_coordinate * unit
                jacobian[:size, position + j] = pack_harmonics(column)
                jacobian[position : position + count, position + j] = [
                    diagonal.real,
                    diagonal.imag,
                ][:count]
            for part, value in zip(parts, (residual, by_omega, -1j * drive)):
                part.append(np.array([value.real, value.imag][:count]))
            position += count


def solve_damped(
    evaluate, x, is_accepted, tolerance: float = 1e-10, max_steps: int = 40
) -> tuple | None:
    """Solve equations by damped Newton iteration with the natural monotonicity test.

    Parameters
    ----------
    evaluate : callable
        evaluate(x) -> BalanceEquations.
    x : ndarray
        (N,) initial guess.
    is_accepted : callable
        is_accepted(BalanceEquations, linearised residual after the last step, norm of x) -> whether it is
        round-off.
    tolerance : float, optional
        Relative step below which the iteration has converged.
    max_steps : int, optional
        Largest number of Newton steps.

    Returns
    -------
    tuple or None
        Unknowns, BalanceEquations before the last step, and number of steps; None without convergence.
    """
    equations = evaluate(x)
    for count in range(1, max_steps + 1):
        solve = solve_linear(equations.jacobian)
        step = -solve(equations.residual)
        length = float(np.linalg.norm(step))
        size = float(np.linalg.norm(x))
        if not np.isfinite(length):
            break
        if length <= tolerance * max(size, 1e-300) or length < 1e-300:
            return (
                (x + step, equations, count)
                if is_accepted(equations, equations.residual + equations.jacobian @ step, size)
                else None
            )
        fraction = 1.0
        best = None
        while True:
            trial = x + fraction * step
            trial_equations = evaluate(trial)
            residual = float(np.linalg.norm(solve(trial_equations.residual)))
            if best is None or residual < best[0] or not np.isfinite(best[0]):
                best = (residual, trial, trial_equations)
            # Natural monotonicity (Deuflhard) requires that the next simplified step is shorter;
            # a tiny step is always accepted.
            if (
                residual <= (1 - fraction / 4) * length
                or fraction < 0.02
                or not length > 1e-8 * size
            ):
                break
            fraction /= 2
        _, x, equations = best
    return None


def solve_newton(
    balance: HarmonicBalance, x, omega: float, level: float, harmonics: int, max_steps: int = 40
):
    """Solve a harmonic balance by damped Newton iteration from an initial guess.

    Parameters
    ----------
    balance : HarmonicBalance
    x : ndarray
        (N,) initial guess.
    omega, level : float
        Frequency [rad/s] and amplitude [m s-2] of the drive.
    harmonics : int
    max_steps : int, optional
        Largest number of Newton steps.

    Returns
    -------
    tuple
        Unknowns, BalanceEquations before the last step, and number of steps.

    Raises
    ------
    NotConverged
        If the residual does not decrease to round-off within `max_steps`.
    """

    def is_accepted(equations, residual, size) -> bool:
        return balance.is_round_off(equations, residual, omega, level, harmonics, size)

    solution = solve_damped(
        lambda v: balance.evaluate(v, omega, level, harmonics), x, is_accepted, max_steps=max_steps
    )
    if solution is None:
        conditions = f"{harmonics} harmonics at {omega / (2 * np.pi):.6g} Hz"
        raise NotConverged(
            f"accuracy.harmonics: harmonic balance with {conditions} did not converge in {max_steps} iterations; "
            "give a motion to start from, or begin at a lower drive level"
        )
    return solution
