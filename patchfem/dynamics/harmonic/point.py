"""Steady motion under one sinusoidal drive signal by harmonic balance, with an error estimate.

The balance is solved for H harmonics. Those above H follow from the harmonics of the force
(q_k = -G_k F_k, a contraction once the inertia of k > H outweighs the stiffness of the contact),
and their effect below H estimates the truncation error. `find_steady_motion` raises H until this error meets the
tolerance.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import NotConverged
from .continuation import PathSettings, follow_curve
from .forces import LawGroup
from .harmonic import (
    BalanceEquations,
    HarmonicBalance,
    pack_harmonics,
    solve_linear,
    solve_newton,
    unpack_harmonics,
)
from .laws import Interlock, SampledSlide, evaluate_series
from .starts import find_one_harmonic_roots

# Numbers of harmonics that are tried in turn, each about twice the previous one.
HARMONIC_COUNTS = (7, 15, 31, 63, 127, 255)
# Ratio of all harmonics to those that Newton's method solves for; the others follow from the force.
ALL_HARMONICS_RATIO = 4
# Numbers of harmonics that are solved in turn if the direct solution with many harmonics fails.
INTERMEDIATE_HARMONIC_COUNTS = (11, 15, 23, 31, 47, 63, 95, 127, 191)
# Largest number of sweeps over the harmonics that follow from the force.
MAX_SWEEPS = 40
# Largest change in the last sweep, relative to the tolerance, so that the
# error of the sweeps is negligible.
SWEEP_TOL_RATIO = 1e-5
# Default relative tolerance of the sweeps.
DEFAULT_TOLERANCE = 1e-3


class _Unbounded(NotConverged):
    """Error: no bounded motion was found at the resonance of an undamped mode."""


@dataclass(frozen=True, eq=False, slots=True)
class SteadyMotion:
    """Steady periodic motion under a sinusoidal drive signal, from harmonic balance.

    - omega, level: frequency [rad/s] and amplitude [m s-2] of the drive
    - coefficients, forces: (i, K + 1) harmonics of the slides [m] and forces [N] of the rows of
      `group`
    - modal: (K + 1, n) modal harmonics [m]
    - harmonics, samples: H that were solved for (K >= H), and samples per cycle
    - residual: rms of the unbalanced force at twice the samples, relative to the rms of the
      force
    - error: relative error of the motion
    - iterations: number of Newton steps
    - unknowns: (N,) unknowns of the balance, the initial guess for a neighbouring motion
    - remaining_change: relative change that further sweeps of the higher harmonics would make
    - stable, multipliers: None until they are computed
    """

    omega: float
    level: float
    coefficients: np.ndarray
    forces: np.ndarray
    modal: np.ndarray
    harmonics: int
    samples: int
    residual: float
    error: float
    iterations: int
    unknowns: np.ndarray
    group: LawGroup
    remaining_change: float = 0.0
    stable: bool | None = None
    multipliers: np.ndarray | None = None

    @property
    def base_samples(self) -> int:
        """Number of samples per cycle that was used to solve for the unknowns."""
        return (
            self.samples // 2 if self.coefficients.shape[1] > self.harmonics + 1 else self.samples
        )

    def amplitude(self, row, samples: int = 4096) -> float:
        """Return the displacement amplitude [m]: half of the range of row @ modal coordinates.

        row: (n,); extremes between samples are interpolated by parabolas.

        """
        y = evaluate_series(self.modal @ np.asarray(row, float), samples)
        return (find_peak(y) + find_peak(-y)) / 2

    def find_reversals(self) -> tuple:
        """Return displacement [m], friction force [N] and slip [m] of the first row at both reversals.

        The result is () for an interface at rest.
        """
        angles, slides, _, _ = SampledSlide(
            self.coefficients[0], self.omega, self.samples
        ).turning_points
        if not angles.size:
            return ()
        k = np.arange(self.coefficients.shape[1])
        reversals = []
        # The cycle begins at the reversal, so its first sample is the reversal.
        for index in (np.argmin(slides), np.argmax(slides)):
            track = SampledSlide(
                self.coefficients[0] * np.exp(1j * k * angles[index]), self.omega, self.samples
            )
            sampled = [law.sample(track) for law in self.group.laws[0]]
            reversals.append(
                (
                    float(slides[index]),
                    float(friction_force(self.group.laws[0], sampled)[0]),
                    float(find_slip(track, sampled)[0]),
                )
            )
        return tuple(reversals)


def friction_force(laws: tuple, sampled: list) -> np.ndarray:
    """Return the friction force (N,) [N] on an interface row, excluding interlocking springs.

    The interlock of [structure.bonded] is a spring parallel to the contact, so its force is not
    friction.
    """
    friction = [
        law_force.force for law, law_force in zip(laws, sampled) if not isinstance(law, Interlock)
    ]
    return sum(friction or [law_force.force for law_force in sampled])


def find_slip(track: SampledSlide, sampled: list) -> np.ndarray:
    """Compute the slip (N,) [m] of an interface row from its sampled laws.

    The slip is the slide minus the mean elastic stretch; it is 0 if there is no friction.

    """
    limit = sum(law_force.limit for law_force in sampled)
    stretch = sum(law_force.stretch for law_force in sampled if law_force.stretch is not None)
    return track.q - stretch / limit if limit > 0 else np.zeros(track.samples)


def find_peak(y) -> float:
    """Return the maximum of a sampled cycle (N,), interpolated by a parabola.

    The largest of 4096 samples of a sine can be (pi/4096)^2/2 = 3e-7 too small.
    """
    k = int(np.argmax(y))
    a = y[k - 1]
    b = y[k]
    c = y[(k + 1) % y.size]
    bend = a - 2 * b + c
    return float(b - (a - c) ** 2 / (8 * bend)) if bend < 0 else float(b)


def make_group(modes, group) -> LawGroup:
    """Combine the friction laws of a rig in a LawGroup.

    group: a LawGroup, a law, a contact model or (row, law) pairs.

    """
    return group if isinstance(group, LawGroup) else LawGroup(modes, group)


def make_balance(modes, group: LawGroup, samples: int) -> HarmonicBalance:
    """Return the harmonic balance of a law group for a given number of samples per cycle.

    Parameters
    ----------
    modes : ModalBasis
    group : LawGroup
    samples : int

    Returns
    -------
    HarmonicBalance
    """
    sampled_group = group.with_samples(samples)
    return HarmonicBalance(modes, sampled_group.rows, sampled_group)


def find_steady_motion(
    modes, drive, group, harmonics: int | None = None, tolerance: float = 1e-3, start=None
) -> SteadyMotion:
    """Find a steady motion under a sinusoidal drive signal by harmonic balance.

    Parameters
    ----------
    modes : ModalBasis
    drive : core.SineDrive
    group : LawGroup, or what `make_group` takes
    harmonics : int, optional
        Number of harmonics; as many as the tolerance needs by default.
    tolerance : float, optional
    start : SteadyMotion or ndarray, optional
        Initial guess; otherwise the stuck contact, the one-harmonic motions and weaker drives are
        tried.

    Returns
    -------
    SteadyMotion

    Raises
    ------
    NotConverged
        If no balance is found, or no number of harmonics meets the tolerance.
    """
    group = make_group(modes, group)
    x, min_samples = (
        (start.unknowns, start.base_samples) if isinstance(start, SteadyMotion) else (start, 0)
    )
    if harmonics is not None:
        return _solve_harmonics(modes, drive, group, harmonics, x, 1, near=min_samples)
    motion = None
    if isinstance(start, SteadyMotion):
        min_count = start.harmonics
    else:
        min_count = _estimate_min_harmonics(modes, drive, group)
    for h in [h for h in HARMONIC_COUNTS if h >= min_count] or HARMONIC_COUNTS[-1:]:
        try:
            motion = _solve_harmonics(
                modes, drive, group, h, x, ALL_HARMONICS_RATIO, tolerance, min_samples
            )
        except _Unbounded:
            raise
        except NotConverged:
            if h == HARMONIC_COUNTS[-1]:
                raise
            continue
        if motion.error <= tolerance:
            return motion
        x = change_harmonic_count(
            make_balance(modes, group, 0),
            motion.coefficients,
            motion.unknowns,
            h,
            _next_harmonic_count(h),
        )
    if motion is None or motion.error > tolerance:
        raise NotConverged(
            f"accuracy.tolerance: with {HARMONIC_COUNTS[-1]} harmonics the motion still has an error of "
            f"{motion.error if motion else np.inf:.1e}, more than {tolerance:g}; raise the tolerance, or "
            'use accuracy.method = "march"'
        )
    return motion


def _estimate_min_harmonics(modes, drive, group) -> float:
    """Return the number of harmonics (<= 63) above which inertia dominates the contact stiffness."""
    stiff = float(np.sum(group.stiffness() * np.sum(group.rows**2, axis=1))) / modes.mass
    return min(np.sqrt(stiff) / drive.omega, 63)


def _next_harmonic_count(h: int) -> int:
    if h not in HARMONIC_COUNTS:
        return 2 * h + 1
    return HARMONIC_COUNTS[min(HARMONIC_COUNTS.index(h) + 1, len(HARMONIC_COUNTS) - 1)]


def change_harmonic_count(balance, slides, unknowns, h: int, harmonics: int) -> np.ndarray:
    """Convert the unknowns of a balance with h harmonics to a different number of harmonics.

    Parameters
    ----------
    balance : HarmonicBalance
    slides : ndarray
        (i, K + 1) harmonics of the slides [m]; they are truncated or padded with zeros.
    unknowns : ndarray
        (N,) unknowns for h harmonics; those of coordinates without receptance are copied.
    h, harmonics : int

    Returns
    -------
    ndarray
    """
    y = np.zeros((balance.lift.shape[1], harmonics + 1), complex)
    keep = min(harmonics, slides.shape[1] - 1) + 1
    y[:, :keep] = balance.lift.T @ slides[:, :keep]
    return np.concatenate([pack_harmonics(y), unknowns[y.shape[0] * (2 * h + 1) :]])


def refine_steady_motion(motion: SteadyMotion, modes, drive) -> SteadyMotion:
    """Recompute a steady motion with twice the number of harmonics and samples.

    One harmonic becomes three, because a symmetric law has no even harmonics. NotConverged is raised if
    no solution is found.

    Parameters
    ----------
    motion : SteadyMotion
    modes : ModalBasis
    drive

    Returns
    -------
    SteadyMotion
    """
    h = motion.harmonics
    x = motion.unknowns
    n_harmonics = max(2 * (motion.coefficients.shape[1] - 1), 3)
    balance = make_balance(modes, motion.group, 2 * motion.base_samples)
    equations = balance.evaluate(x, drive.omega, drive.acceleration, h)
    refined = _add_harmonics(
        balance,
        SweepStart(x, equations, 0, motion.coefficients),
        drive,
        h,
        n_harmonics // h,
        DEFAULT_TOLERANCE,
    )
    if np.isfinite(refined.error):
        return refined
    return _solve_harmonics(modes, drive, balance.contact, n_harmonics, x, 1)


def _solve_harmonics(
    modes, drive, group, h, x, harmonics_ratio, tolerance=DEFAULT_TOLERANCE, near=0
) -> SteadyMotion:
    """Solve the balance with h harmonics, then add higher harmonics that follow from the force.

    The harmonics that are added extend up to `harmonics_ratio` times h. The samples resolve the shortest stick phase.

    near: number of samples of a neighbouring motion, 0 for none.
    """
    samples = group.samples or max(group.samples_for(h * harmonics_ratio), near)
    balance = make_balance(modes, group, samples)
    for _ in range(3):
        x, equations, count = _solve_balance(balance, x, drive, h)
        amplitudes = (
            np.ptp(
                evaluate_series(
                    balance.unpack_slides(x, drive.omega, h), 2 ** (h + 64).bit_length()
                ),
                axis=1,
            )
            / 2
        )
        needed_samples = group.samples or group.samples_for(h * harmonics_ratio, amplitudes)
        if needed_samples <= balance.contact.samples:
            break
        balance = balance.with_contact(balance.contact.with_samples(needed_samples))
    return _add_harmonics(
        balance, SweepStart(x, equations, count), drive, h, harmonics_ratio, tolerance
    )


def _solve_balance(balance, x, drive, h: int):
    """Solve a harmonic balance from several initial guesses in turn, and finally from weaker drives."""
    omega = drive.omega
    level = drive.acceleration
    for start in _generate_guesses(balance, x, omega, level, h):
        try:
            return solve_newton(balance, start, omega, level, h)
        except NotConverged:
            pass
    return solve_newton(balance, _raise_harmonics(balance, omega, level, h), omega, level, h)


def _generate_guesses(balance, x, omega, level, h: int):
    """Generate initial guesses for Newton's method, the most promising first."""
    r = balance.lift.shape[1]
    if x is not None:
        free = sum(1 if k == 0 else 2 for k, *_ in balance.get_linear_part(omega, h).free)
        n_harmonics, rest = divmod(x.size - free - r, 2 * r)
        if n_harmonics >= 0 and not rest:
            yield change_harmonic_count(
                balance,
                balance.lift @ unpack_harmonics(x[: r * (2 * n_harmonics + 1)], r),
                x,
                n_harmonics,
                h,
            )
    yield _solve_stuck(balance, omega, level, h)
    for one_harmonic_root in find_one_harmonic_roots(balance, omega, level):
        yield change_harmonic_count(
            balance, balance.unpack_slides(one_harmonic_root, omega, 1), one_harmonic_root, 1, h
        )


def _raise_harmonics(balance, omega, level, h: int) -> np.ndarray:
    """Compute an initial guess by increasing the number of harmonics step by step.

    Few harmonics are inexpensive to follow from weaker drives.

    """
    n_solved = min(HARMONIC_COUNTS[0], h)
    x = _follow_levels(balance, omega, level, n_solved)
    for n_harmonics in [k for k in INTERMEDIATE_HARMONIC_COUNTS if n_solved < k < h] + [h] * (
        h > n_solved
    ):
        try:
            start = change_harmonic_count(
                balance, balance.unpack_slides(x, omega, n_solved), x, n_solved, n_harmonics
            )
            x = solve_newton(balance, start, omega, level, n_harmonics)[0]
            n_solved = n_harmonics
        except NotConverged:
            pass
    return x if n_solved == h else _follow_levels(balance, omega, level, h)


def _follow_levels(balance, omega, level, h: int) -> np.ndarray:
    """Compute the unknowns at a drive amplitude by continuation from a thousandth of it."""
    path = follow_curve(
        lambda v, p: differentiate_by_level(balance, v, omega, p, h),
        _solve_stuck(balance, omega, level, h) * 1e-3,
        1e-3 * level,
        (0.0, level),
        settings=PathSettings(0.05, 0.5, 1000, 1e-6),
    )
    if path.ended != "end":
        has_undamped_mode = any(k for k, *_ in balance.get_linear_part(omega, h).free)
        reason = (
            (
                "; an undamped mode that is driven at its natural frequency stays bounded only if friction is strong "
                "enough to stop the slip; give the mode damping"
            )
            if has_undamped_mode
            else "; the search began at the sticking contact and also followed the motion while the drive rose from zero"
        )
        raise (_Unbounded if has_undamped_mode else NotConverged)(
            f"accuracy.harmonics: harmonic balance with {h} harmonics found no steady motion at "
            f"{omega / (2 * np.pi):.6g} Hz{reason}"
        )
    return path.x[-1]


def differentiate_by_level(balance, x, omega, level, h) -> tuple:
    """Return residual and Jacobian of a balance, and its derivative by the drive amplitude.

    Parameters
    ----------
    balance, x, omega, level, h
        See `HarmonicBalance.evaluate`.

    Returns
    -------
    tuple
    """
    equations = balance.evaluate(x, omega, level, h)
    return equations.residual, equations.jacobian, equations.by_level


def differentiate_by_frequency(balance, x, omega, level, h) -> tuple:
    """Return residual and Jacobian of a balance, and its derivative by the drive frequency.

    Parameters
    ----------
    balance, x, omega, level, h
        See `HarmonicBalance.evaluate`.

    Returns
    -------
    tuple
    """
    equations = balance.evaluate(x, omega, level, h)
    return equations.residual, equations.jacobian, equations.by_omega


def make_motion_from_unknowns(balance, x, drive, h: int) -> tuple:
    """Return the steady motion for solved unknowns, and the relative magnitude of the truncated harmonics.

    Parameters
    ----------
    balance : HarmonicBalance
    x : ndarray
    drive
    h : int

    Returns
    -------
    tuple
    SteadyMotion, and norm of h further harmonics relative to that of the motion.
    """
    equations = balance.evaluate(x, drive.omega, drive.acceleration, h)
    motion = _add_harmonics(balance, SweepStart(x, equations), drive, h, 1, 1.0)
    force = balance.contact.compute_force_harmonics(
        motion.coefficients, drive.omega, 2 * h, balance.contact.samples
    )
    z = balance.compute_modal_motion(x, drive.omega, drive.acceleration, h, force)
    truncated = float(np.linalg.norm(z[h + 1 :] @ balance.rows.T))
    return motion, truncated / max(float(np.linalg.norm(motion.coefficients)), 1e-300)


def _solve_stuck(balance, omega, level, h: int) -> np.ndarray:
    """Solve for the unknowns of the linear motion in which all contacts stick."""
    x = np.zeros(balance.count_unknowns(omega, h))
    equations = balance.evaluate(x, omega, level, h)
    return -solve_linear(equations.jacobian)(equations.residual)


class SweepStart(NamedTuple):
    """Initial values of the fixed-point sweeps over the higher harmonics.

    - x, equations, count: unknowns (N,), their equations, and iterations so far
    - slides: (i, K + 1) [m] with harmonics above those of the unknowns, or None
    """

    x: np.ndarray
    equations: BalanceEquations
    count: int = 0
    slides: np.ndarray | None = None


def _add_harmonics(
    balance, start: SweepStart, drive, h, harmonics_ratio, tolerance
) -> SteadyMotion:
    """Add harmonics above h by fixed-point sweeps, and estimate the truncation error.

    The harmonics up to h are corrected with their Jacobian. The last sweep takes twice the samples.
    """
    x, equations, count, known_slides = start
    omega = drive.omega
    level = drive.acceleration
    n_harmonics = h * harmonics_ratio
    solve = solve_linear(equations.jacobian)
    n_probed = max(n_harmonics, 2 * h)  # additional harmonics that estimate the truncation error
    q = np.zeros((len(balance.rows), n_probed + 1), complex)
    if known_slides is not None:
        q[:, : known_slides.shape[1]] = known_slides[:, : n_probed + 1]
    q[:, : h + 1] = balance.unpack_slides(x, omega, h)
    samples = n_force_samples = balance.contact.samples
    size = float(np.linalg.norm(q))
    changes = []
    for sweep in range(MAX_SWEEPS):
        force = balance.contact.compute_force_harmonics(q, omega, n_probed, n_force_samples)
        z = balance.compute_modal_motion(x, omega, level, h, force)
        correction = -solve(_find_residual(balance, x, omega, level, h, force, z))
        if sweep and harmonics_ratio > 1:
            x = x + correction
        new = (z @ balance.rows.T).T
        new[:, : h + 1] = balance.unpack_slides(x, omega, h)
        changes.append(
            float(
                np.hypot(
                    np.linalg.norm(correction), np.linalg.norm(new[:, h + 1 :] - q[:, h + 1 :])
                )
            )
        )
        q = new
        if n_force_samples > samples or (harmonics_ratio == 1 and sweep):
            break
        if sweep and changes[-1] <= SWEEP_TOL_RATIO * tolerance * size:
            n_force_samples = 2 * samples
        if sweep > 2 and (changes[-1] > changes[-2] > changes[-3] or changes[-1] > changes[1]):
            return _make_diverged_motion(balance, start, drive, h, samples)
    return _make_steady_motion(
        balance, x, drive, h, n_harmonics, n_force_samples, changes, size, count, q
    )


def _make_diverged_motion(balance, start: SweepStart, drive, h, samples) -> SteadyMotion:
    """Return the steady motion with h harmonics and unknown error, if the sweeps have diverged."""
    x, equations, count, _ = start
    q = balance.unpack_slides(x, drive.omega, h)
    z = balance.compute_modal_motion(x, drive.omega, drive.acceleration, h, equations.fold.force)
    return SteadyMotion(
        drive.omega,
        drive.acceleration,
        q,
        equations.fold.force,
        z,
        h,
        samples,
        np.inf,
        np.inf,
        count,
        x,
        balance.contact,
    )


def _find_residual(balance, x, omega, level, h, force, z) -> np.ndarray:
    """Return the residual (N,) of a balance for forces that contain additional harmonics."""
    n_slide_unknowns = balance.lift.shape[1] * (2 * h + 1)
    position = 0
    y = unpack_harmonics(x[:n_slide_unknowns], balance.lift.shape[1])
    residuals = [pack_harmonics(y - (z[: h + 1] @ balance.faces.T).T)]
    for k, _, left_vector, stiffness in balance.get_linear_part(omega, h).free:
        parts = x[n_slide_unknowns + position : n_slide_unknowns + position + (2 if k else 1)]
        free_residual = balance.free_residual(
            (k, left_vector, stiffness), complex(*parts), omega, level, force
        )
        residuals.append(np.array([free_residual.real, free_residual.imag])[: parts.size])
        position += parts.size
    return np.concatenate(residuals)


def _make_steady_motion(
    balance, x, drive, h, n_harmonics, samples, changes, size, count, q
) -> SteadyMotion:
    omega = drive.omega
    level = drive.acceleration
    group = balance.contact
    q = q[:, : n_harmonics + 1]
    sampled_forces = group.compute_forces(q, omega, 2 * samples)
    force_harmonics = group.compute_force_harmonics(q, omega, n_harmonics, samples)
    imbalance = sampled_forces - evaluate_series(force_harmonics, 2 * samples)
    scale = float(np.sqrt(np.mean(sampled_forces**2)))
    residual = float(np.sqrt(np.mean(imbalance**2))) / scale if scale > 0 else 0.0
    z = balance.compute_modal_motion(x, omega, level, h, force_harmonics)
    error = max(changes)
    remaining_change = 0.0
    if n_harmonics > h:
        # The error of the unfinished sweeps is that of a geometric series. The harmonics above
        # n_harmonics decrease like k^-5/2.
        ratio = 0.9
        if len(changes) > 3:
            ratio = min((changes[-2] / changes[1]) ** (1 / (len(changes) - 3)), ratio)
        remaining_change = changes[-2] * ratio / (1 - ratio)
        error = 2 * (changes[-1] + remaining_change + max(changes) * (h / n_harmonics) ** 2.5)
    size = max(size, 1e-300)
    return SteadyMotion(
        omega,
        level,
        q,
        force_harmonics,
        z,
        h,
        samples,
        residual,
        error / size,
        count,
        x,
        group,
        remaining_change / size,
    )
