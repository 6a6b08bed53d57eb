"""Harmonic balance under sinusoidal drive, with the interface slides as unknowns.

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

# dynamic stiffness of a mode over its scale, below which the mode has no receptance at a harmonic
SINGULAR_RATIO = 1e-10


class ContactResponse(NamedTuple):
    """Harmonics of the contact forces of a cycle, and their derivatives.

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
    """Unpack complex harmonics (rows, H + 1) from the real vector of `pack_harmonics`."""
    v = v.reshape(rows, -1)
    h = v.shape[1] // 2
    x = v[:, : h + 1].astype(complex)
    x[:, 1:] += 1j * v[:, h + 1 :]
    return x


def _to_real_equations(c) -> np.ndarray:
    """Split complex equations (H + 1, ...) into real equations (2 H + 1, ...)."""
    return np.concatenate([c.real, c.imag[1:]], axis=0)


@dataclass(frozen=True, eq=False, slots=True)
class LinearPart:
    """Receptances of the modes at the harmonics of one frequency.

    - inverse, slope: (H + 1, n, n) receptance R_k and d(R_k^-1)/d omega
    - free: (k, right (n,), left (n,), stiffness) of every coordinate without receptance
    """

    inverse: np.ndarray
    slope: np.ndarray
    free: tuple


def make_linear_part(modes: ModalBasis, omega: float, harmonics: int) -> LinearPart:
    """Return the modal receptances at the harmonics of a frequency.

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
    around = k * omega
    slope = (-2 * k * around)[:, None, None] * np.eye(n) + 1j * k[
        :, None, None
    ] * modes.damping_matrix
    if modes.damping is None:
        along = (
            modes.omega**2 - around[:, None] ** 2 + 2j * around[:, None] * modes.zeta * modes.omega
        )
        scale = np.maximum(modes.omega**2 + around[:, None] ** 2, omega**2)
        bad = np.abs(along) < SINGULAR_RATIO * scale
        inverse = np.zeros((k.size, n, n), complex)
        inverse[:, np.arange(n), np.arange(n)] = np.where(bad, 0.0, 1 / np.where(bad, 1.0, along))
        unit = np.eye(n)
        return LinearPart(
            inverse,
            slope,
            tuple((int(h), unit[j], unit[j], along[h, j]) for h, j in np.argwhere(bad)),
        )
    p = (
        np.diag(modes.omega**2)
        - (around**2)[:, None, None] * np.eye(n)
        + 1j * around[:, None, None] * modes.damping_matrix
    )
    u, s, vh = np.linalg.svd(p)
    bad = s < SINGULAR_RATIO * np.maximum(np.max(modes.omega) ** 2 + around[:, None] ** 2, omega**2)
    inverse = (
        vh.conj().transpose(0, 2, 1) * np.where(bad, 0.0, 1 / np.where(bad, 1.0, s))[:, None, :]
    ) @ u.conj().transpose(0, 2, 1)
    return LinearPart(
        inverse,
        slope,
        tuple((int(h), vh[h, j].conj(), u[h, :, j].conj(), s[h, j]) for h, j in np.argwhere(bad)),
    )


class System(NamedTuple):
    """Residual and Jacobian of the harmonic balance at given unknowns.

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


class Balance:
    """Harmonic balance of a modal basis with contact forces on interface rows.

    rows: (i, n); contact: (q (i, H + 1), omega) -> ContactResponse.

    If the rows are linearly dependent, the unknowns are `rank` combinations
    y of the slides, q = lift y. The unknowns are the packed harmonics of y, then the coordinates without
    receptance. PatchfemError is raised where no mode moves the rows.
    """

    def __init__(self, modes: ModalBasis, rows, contact):
        rows = np.asarray(rows, float)
        u, s, vt = np.linalg.svd(rows, full_matrices=False)
        # singular values of linearly dependent rows are below this round-off limit
        rank = int(np.sum(s > 1e-12 * s[0])) if s[0] > 0 else 0
        if rank == 0:
            raise PatchfemError(
                "structure.mode.slide: no mode moves the interface, so no friction acts and harmonic "
                "balance is not needed; give a mode the key `slide`"
            )
        full = rank == rows.shape[0]
        self.modes = modes
        self.rows = rows
        self.contact = contact
        self.lift = np.eye(rank) if full else u[:, :rank]
        self.faces = rows if full else s[:rank, None] * vt[:rank]
        self._linear = {}

    def with_contact(self, contact) -> "Balance":
        """Return a copy of the harmonic balance with another contact."""
        other = object.__new__(Balance)
        other.__dict__.update(self.__dict__, contact=contact)
        return other

    def linear(self, omega: float, harmonics: int) -> LinearPart:
        """Return the modal receptances at a frequency [rad/s], from a cache of nine frequencies."""
        key = (omega, harmonics)
        if key not in self._linear:
            if len(self._linear) > 8:
                self._linear.clear()
            self._linear[key] = make_linear_part(self.modes, omega, harmonics)
        return self._linear[key]

    def size(self, omega: float, harmonics: int) -> int:
        """Return the number of real unknowns at a frequency omega [rad/s]."""
        free = self.linear(omega, harmonics).free
        return self.lift.shape[1] * (2 * harmonics + 1) + sum(1 if k == 0 else 2 for k, *_ in free)

    def slides(self, x, omega: float, harmonics: int) -> np.ndarray:
        """Unpack the harmonics of the interface slides (i, H + 1) [m] from the unknowns.

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

    def motion(self, x, omega: float, level: float, harmonics: int, force) -> np.ndarray:
        """Return the modal harmonics (K + 1, n) [m] under drive and contact forces.

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
        top = force.shape[1] - 1
        return self._motion(
            self.linear(omega, top),
            self._coordinates(x, self.linear(omega, harmonics), harmonics),
            level,
            force,
        )

    def _coordinates(self, x, here: LinearPart, harmonics) -> list:
        rest = x[self.lift.shape[1] * (2 * harmonics + 1) :]
        out = []
        at = 0
        for k, *_ in here.free:
            out.append(complex(rest[at], rest[at + 1] if k else 0.0))
            at += 2 if k else 1
        return out

    def _motion(self, here, coordinates, level, force):
        push = -(force.T @ self.rows) / self.modes.mass + 0j
        if len(push) > 1:
            push[1] += 1j * level * self.modes.base
        z = np.einsum("kab,kb->ka", here.inverse, push)
        for (k, right, *_), c in zip(here.free, coordinates):
            z[k] += right * c
        return z

    def system(
        self, x, omega: float, level: float, harmonics: int, here: LinearPart | None = None
    ) -> System:
        """Evaluate residual and Jacobian of the harmonic balance at given unknowns.

        Parameters
        ----------
        x : ndarray
        omega, level : float
            Frequency [rad/s] and amplitude [m s-2] of the drive.
        harmonics : int
        here : LinearPart, optional
            Receptances in place of those of the modes.

        Returns
        -------
        System
        """
        h = harmonics
        r = self.lift.shape[1]
        mass = self.modes.mass
        here = here or self.linear(omega, h)
        coordinates = self._coordinates(x, here, h)
        y = unpack_harmonics(x[: r * (2 * h + 1)], r)
        fold = self.contact(self.lift @ y, omega)
        z = self._motion(here, coordinates, level, fold.force[:, : h + 1])
        through = -np.einsum("ra,kab->krb", self.faces, here.inverse)  # -faces R_k
        miss = y - (z @ self.faces.T).T
        receptance = -through @ self.faces.T / mass  # (H + 1, r, r)
        linked = self.combine_slopes(fold.slope)
        block = (receptance @ linked).reshape(h + 1, r, r, 2 * h + 1)
        size = r * (2 * h + 1)
        jacobian = np.eye(x.size)
        block = _to_real_equations(block).transpose(1, 0, 2, 3).reshape(size, size)
        jacobian[:size, :size] += block
        turned = -np.einsum("krb,kbc,kc->rk", through, here.slope, z)
        if fold.rate is not None:
            turned = turned + np.einsum("krs,sk->rk", receptance, self.lift.T @ fold.rate)
        lifted = np.zeros((r, h + 1), complex)
        if h:
            lifted[:, 1] = 1j * through[1] @ self.modes.base
        parts = [[pack_harmonics(miss)], [pack_harmonics(turned)], [pack_harmonics(lifted)]]
        self._free(here, coordinates, jacobian, parts, fold, z, level, linked, omega, size)
        return System(
            *[np.concatenate(parts[0])],
            jacobian,
            np.concatenate(parts[1]),
            np.concatenate(parts[2]),
            fold,
            z,
        )

    def free_residual(self, free, c, omega: float, level: float, force) -> complex:
        """Return the force residual of a modal coordinate without receptance, over omega^2 [m].

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
        k, left, stiffness = free
        drive = left @ self.modes.base if k == 1 else 0.0
        return (
            stiffness * c
            + left @ (self.rows.T @ force[:, k]) / self.modes.mass
            - 1j * level * drive
        ) / omega**2

    def combine_slopes(self, slope) -> np.ndarray:
        """Transform force derivatives of the interface rows to the reduced slides y.

        Their shapes are (i, H + 1, 2 H + 1) and (H + 1, r, r (2 H + 1)).
        """
        count, r = self.lift.shape
        h = slope.shape[1] - 1
        pairs = (self.lift[:, :, None] * self.lift[:, None, :]).reshape(count, r * r)
        both = (pairs.T @ np.ascontiguousarray(slope).reshape(count, -1).view(float)).view(complex)
        return both.reshape(r, r, h + 1, 2 * h + 1).transpose(2, 0, 1, 3).reshape(h + 1, r, -1)

    def is_rounding(
        self, here: System, left, omega: float, level: float, harmonics: int, size: float
    ) -> bool:
        """Return whether the residual after the last Newton step is due to round-off.

        A least-squares step can vanish at a point that is no solution.

        Parameters
        ----------
        here : LinearPart
        left : ndarray
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
        low = self.lift.shape[1] * (2 * harmonics + 1)
        push = float(np.linalg.norm(here.fold.force) * np.linalg.norm(self.rows)) / (
            self.modes.mass * omega**2
        )
        for part, own in ((slice(0, low), size), (slice(low, None), push)):
            scale = own + abs(level) * float(np.linalg.norm(here.by_level[part]))
            # the residual of a solution is round-off; at a minimum of the residual without a root it is larger
            if float(np.linalg.norm(left[part])) > 1e-7 * scale:
                return False
        return True

    def _free(self, here, coordinates, jacobian, parts, fold, z, level, linked, omega, size):
        """Append the equations of modal coordinates without receptance to the balance.

        The equations are divided by omega^2 [m].
        """
        h = z.shape[0] - 1
        r = self.lift.shape[1]
        at = size
        for (k, right, left, stiffness), c in zip(here.free, coordinates):
            w = left @ self.rows.T / self.modes.mass / omega**2
            drive = left @ self.modes.base / omega**2 if k == 1 else 0.0
            miss = self.free_residual((k, left, stiffness), c, omega, level, fold.force)
            by_omega = left @ here.slope[k] @ z[k] / omega**2 - 2 * miss / omega
            if fold.rate is not None:
                by_omega = by_omega + w @ fold.rate[:, k]
            row = left @ self.faces.T / self.modes.mass / omega**2 @ linked[k]
            across = self.faces @ right
            count = 2 if k else 1
            for j in range(count):
                unit = 1j**j
                jacobian[at + j, :size] = (row.real, row.imag)[j]
                own = stiffness / omega**2 * unit
                column = np.zeros((r, h + 1), complex)
                column[:, k] = -across * unit
                jacobian[:size, at + j] = pack_harmonics(column)
                jacobian[at : at + count, at + j] = [own.real, own.imag][:count]
            for part, value in zip(parts, (miss, by_omega, -1j * drive)):
                part.append(np.array([value.real, value.imag][:count]))
            at += count


def solve_damped(
    system, x, is_accepted, tolerance: float = 1e-10, max_steps: int = 40
) -> tuple | None:
    """Solve equations by damped Newton iteration with the natural monotonicity test.

    Parameters
    ----------
    system : callable
        system(x) -> BalanceEquations.
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
    here = system(x)
    for count in range(1, max_steps + 1):
        solve = solve_linear(here.jacobian)
        step = -solve(here.residual)
        length = float(np.linalg.norm(step))
        size = float(np.linalg.norm(x))
        if not np.isfinite(length):
            break
        if length <= tolerance * max(size, 1e-300) or length < 1e-300:
            return (
                (x + step, here, count)
                if is_accepted(here, here.residual + here.jacobian @ step, size)
                else None
            )
        fraction = 1.0
        best = None
        while True:
            trial = x + fraction * step
            there = system(trial)
            residual = float(np.linalg.norm(solve(there.residual)))
            if best is None or residual < best[0] or not np.isfinite(best[0]):
                best = (residual, trial, there)
            # natural monotonicity (Deuflhard): the next simplified step must be shorter; a tiny step is always
            # accepted
            if (
                residual <= (1 - fraction / 4) * length
                or fraction < 0.02
                or not length > 1e-8 * size
            ):
                break
            fraction /= 2
        _, x, here = best
    return None


def solve_newton(
    balance: Balance, x, omega: float, level: float, harmonics: int, max_steps: int = 40
):
    """Solve a harmonic balance by damped Newton iteration from an initial guess.

    Parameters
    ----------
    balance : Balance
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

    def is_accepted(here, left, size) -> bool:
        return balance.is_rounding(here, left, omega, level, harmonics, size)

    found = solve_damped(
        lambda v: balance.system(v, omega, level, harmonics), x, is_accepted, max_steps=max_steps
    )
    if found is None:
        at = f"{harmonics} harmonics at {omega / (2 * np.pi):.6g} Hz"
        raise NotConverged(
            f"accuracy.harmonics: harmonic balance with {at} did not converge in {max_steps} iterations; "
            "give a motion to start from, or begin at a lower drive level"
        )
    return found
