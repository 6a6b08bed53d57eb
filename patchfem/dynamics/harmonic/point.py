"""Single steady motion by harmonic balance, with an estimate of its error.

The balance is solved for H harmonics. Those above H follow from the harmonics of the force
(q_k = -G_k F_k, a contraction once the inertia of k > H outweighs the stiffness of the contact),
and their effect below H estimates the truncation error. `find_point` raises H until this error meets the
tolerance.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import NotConverged
from .continuation import PathSettings, follow_curve
from .forces import LawGroup
from .harmonic import Balance, System, pack_harmonics, solve_linear, solve_newton, unpack_harmonics
from .laws import Interlock, SampledSlide, evaluate_series
from .starts import find_one_harmonic_roots

# numbers of harmonics that are tried in turn, each about twice the one before
HARMONIC_COUNTS = (7, 15, 31, 63, 127, 255)
# ratio of all harmonics to those that Newton's method solves for; the others follow from the force
FOLLOWING_RATIO = 4
# numbers of harmonics that are solved in turn where the direct solution with many harmonics fails
CLIMB_COUNTS = (11, 15, 23, 31, 47, 63, 95, 127, 191)
# largest number of sweeps over the harmonics that follow from the force
MAX_SWEEPS = 40
# change in the last sweep over the tolerance, so that the sweeps add no error
SWEEP_TOL_RATIO = 1e-5
# relative tolerance of the sweeps where the caller gives none
DEFAULT_TOLERANCE = 1e-3


class _Unbounded(NotConverged):
    """Error: no bounded motion was found at the resonance of an undamped mode."""


@dataclass(frozen=True, eq=False, slots=True)
class SteadyMotion:
    """Steady periodic motion under sinusoidal drive, from harmonic balance.

    - omega, level: frequency [rad/s] and amplitude [m s-2] of the drive
    - coefficients, forces: (i, K + 1) harmonics of the slides [m] and forces [N] of the rows of
      `group`
    - modal: (K + 1, n) modal harmonics [m]
    - harmonics, samples: H that were solved for (K >= H), and samples per cycle
    - residual: rms of the unbalanced force in time, on twice the samples, over the rms
      of the force
    - error: relative error of the motion
    - iterations: number of Newton steps
    - unknowns: (N,) unknowns of the balance, the initial guess for a neighbouring motion
    - left: relative change that further sweeps of the higher harmonics would make
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
    left: float = 0.0
    stable: bool | None = None
    multipliers: np.ndarray | None = None

    @property
    def base_samples(self) -> int:
        """Number of samples per cycle with which the unknowns were solved."""
        return (
            self.samples // 2 if self.coefficients.shape[1] > self.harmonics + 1 else self.samples
        )

    def amplitude(self, row, samples: int = 4096) -> float:
        """Return the displacement amplitude [m], half the range of row @ modal coordinates.

        row: (n,); extremes between samples are interpolated by parabolas.

        """
        y = evaluate_series(self.modal @ np.asarray(row, float), samples)
        return (find_peak(y) + find_peak(-y)) / 2

    def turns(self) -> tuple:
        """Return slide [m], friction force [N] and slip [m] of the first row at both reversals.

        The result is () for an interface at rest.
        """
        angles, places, _, _ = SampledSlide(
            self.coefficients[0], self.omega, self.samples
        ).turning_points
        if not angles.size:
            return ()
        k = np.arange(self.coefficients.shape[1])
        out = []
        for at in (
            np.argmin(places),
            np.argmax(places),
        ):  # the cycle begins at the reversal, so its first sample is the reversal
            track = SampledSlide(
                self.coefficients[0] * np.exp(1j * k * angles[at]), self.omega, self.samples
            )
            found = [law.sample(track) for law in self.group.laws[0]]
            out.append(
                (
                    float(places[at]),
                    float(friction_force(self.group.laws[0], found)[0]),
                    float(find_slip(track, found)[0]),
                )
            )
        return tuple(out)


def friction_force(laws: tuple, sampled: list) -> np.ndarray:
    """Return the friction force (N,) [N] of an interface row, without interlocking springs.

    The interlock of [structure.bonded] is a spring parallel to the contact, so its force is not
    friction.
    """
    friction = [one.force for law, one in zip(laws, sampled) if not isinstance(law, Interlock)]
    return sum(friction or [one.force for one in sampled])


def find_slip(track: SampledSlide, found: list) -> np.ndarray:
    """Return the slip (N,) [m] of an interface row from its sampled laws.

    The slip is the slide minus the mean elastic stretch; it is 0 without friction.

    """
    limit = sum(one.limit for one in found)
    stretch = sum(one.stretch for one in found if one.stretch is not None)
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
    """Return the laws of a rig as a LawGroup.

    group: a LawGroup, a law, a contact model or (row, law) pairs.

    """
    return group if isinstance(group, LawGroup) else LawGroup(modes, group)


def make_balance(modes, group: LawGroup, samples: int) -> Balance:
    """Return the harmonic balance of a law group with a number of samples per cycle.

    Parameters
    ----------
    modes : ModalBasis
    group : LawGroup
    samples : int

    Returns
    -------
    Balance
    """
    gridded = group.with_samples(samples)
    return Balance(modes, gridded.rows, gridded)


def find_point(
    modes, drive, group, harmonics: int | None = None, tolerance: float = 1e-3, start=None
) -> SteadyMotion:
    """Find a steady motion under sinusoidal drive by harmonic balance.

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
    x, near = (
        (start.unknowns, start.base_samples) if isinstance(start, SteadyMotion) else (start, 0)
    )
    if harmonics is not None:
        return _solve_harmonics(modes, drive, group, harmonics, x, 1, near=near)
    found = None
    least = (
        start.harmonics if isinstance(start, SteadyMotion) else _min_harmonics(modes, drive, group)
    )
    for h in [h for h in HARMONIC_COUNTS if h >= least] or HARMONIC_COUNTS[-1:]:
        try:
            found = _solve_harmonics(modes, drive, group, h, x, FOLLOWING_RATIO, tolerance, near)
        except _Unbounded:
            raise
        except NotConverged:
            if h == HARMONIC_COUNTS[-1]:
                raise
            continue
        if found.error <= tolerance:
            return found
        x = with_harmonics(
            make_balance(modes, group, 0), found.coefficients, found.unknowns, h, _next_harmonics(h)
        )
    if found is None or found.error > tolerance:
        raise NotConverged(
            f"accuracy.tolerance: with {HARMONIC_COUNTS[-1]} harmonics the motion still has an error of "
            f"{found.error if found else np.inf:.1e}, more than {tolerance:g}; raise the tolerance, or "
            'use accuracy.method = "march"'
        )
    return found


def _min_harmonics(modes, drive, group) -> float:
    """Return the number of harmonics (<= 63) above which inertia exceeds the contact stiffness."""
    stiff = float(np.sum(group.stiffness() * np.sum(group.rows**2, axis=1))) / modes.mass
    return min(np.sqrt(stiff) / drive.omega, 63)


def _next_harmonics(h: int) -> int:
    return (
        HARMONIC_COUNTS[min(HARMONIC_COUNTS.index(h) + 1, len(HARMONIC_COUNTS) - 1)]
        if h in HARMONIC_COUNTS
        else 2 * h + 1
    )


def with_harmonics(balance, slides, unknowns, h: int, harmonics: int) -> np.ndarray:
    """Convert the unknowns of a balance with h harmonics to another number of harmonics.

    Parameters
    ----------
    balance : Balance
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


def refine_point(found: SteadyMotion, modes, drive) -> SteadyMotion:
    """Recompute a steady motion with twice its harmonics and samples.

    One harmonic becomes three, because a symmetric law has no even ones. NotConverged is raised if it
    is not found.

    Parameters
    ----------
    found : SteadyMotion
    modes : ModalBasis
    drive

    Returns
    -------
    SteadyMotion
    """
    h = found.harmonics
    x = found.unknowns
    top = max(2 * (found.coefficients.shape[1] - 1), 3)
    balance = make_balance(modes, found.group, 2 * found.base_samples)
    here = balance.system(x, drive.omega, drive.acceleration, h)
    one = _add_harmonics(
        balance, SweepStart(x, here, 0, found.coefficients), drive, h, top // h, DEFAULT_TOLERANCE
    )
    return (
        one
        if np.isfinite(one.error)
        else _solve_harmonics(modes, drive, balance.contact, top, x, 1)
    )


def _solve_harmonics(
    modes, drive, group, h, x, wider, tolerance=DEFAULT_TOLERANCE, near=0
) -> SteadyMotion:
    """Solve the balance with h harmonics, then add harmonics that follow from the force.

    The harmonics that are added extend up to `wider` times h. The samples resolve the shortest stick phase.

    near: number of samples of a neighbouring motion, 0 for none.
    """
    samples = group.samples or max(group.samples_for(h * wider), near)
    balance = make_balance(modes, group, samples)
    for _ in range(3):
        x, here, count = _solve_balance(balance, x, drive, h)
        swing = (
            np.ptp(
                evaluate_series(balance.slides(x, drive.omega, h), 2 ** (h + 64).bit_length()),
                axis=1,
            )
            / 2
        )
        want = group.samples or group.samples_for(h * wider, swing)
        if want <= balance.contact.samples:
            break
        balance = balance.with_contact(balance.contact.with_samples(want))
    return _add_harmonics(balance, SweepStart(x, here, count), drive, h, wider, tolerance)


def _solve_balance(balance, x, drive, h: int):
    """Solve a harmonic balance from several initial guesses in turn, last from weaker drives."""
    omega = drive.omega
    level = drive.acceleration
    for start in _iterate_starts(balance, x, omega, level, h):
        try:
            return solve_newton(balance, start, omega, level, h)
        except NotConverged:
            pass
    return solve_newton(balance, _climb_harmonics(balance, omega, level, h), omega, level, h)


def _iterate_starts(balance, x, omega, level, h: int):
    """Yield initial guesses for Newton's method, the most promising first."""
    r = balance.lift.shape[1]
    if x is not None:
        free = sum(1 if k == 0 else 2 for k, *_ in balance.linear(omega, h).free)
        have, rest = divmod(x.size - free - r, 2 * r)
        if have >= 0 and not rest:
            yield with_harmonics(
                balance, balance.lift @ unpack_harmonics(x[: r * (2 * have + 1)], r), x, have, h
            )
    yield _solve_stuck(balance, omega, level, h)
    for one_harmonic_root in find_one_harmonic_roots(balance, omega, level):
        yield with_harmonics(
            balance, balance.slides(one_harmonic_root, omega, 1), one_harmonic_root, 1, h
        )


def _climb_harmonics(balance, omega, level, h: int) -> np.ndarray:
    """Return an initial guess by raising the number of harmonics step by step.

    Few harmonics are inexpensive to follow from weaker drives.

    """
    below = min(HARMONIC_COUNTS[0], h)
    x = _follow_levels(balance, omega, level, below)
    for more in [k for k in CLIMB_COUNTS if below < k < h] + [h] * (h > below):
        try:
            start = with_harmonics(balance, balance.slides(x, omega, below), x, below, more)
            x = solve_newton(balance, start, omega, level, more)[0]
            below = more
        except NotConverged:
            pass
    return x if below == h else _follow_levels(balance, omega, level, h)


def _follow_levels(balance, omega, level, h: int) -> np.ndarray:
    """Return the unknowns at a drive level by continuation from a thousandth of it."""
    path = follow_curve(
        lambda v, p: evaluate_by_level(balance, v, omega, p, h),
        _solve_stuck(balance, omega, level, h) * 1e-3,
        1e-3 * level,
        (0.0, level),
        settings=PathSettings(0.05, 0.5, 1000, 1e-6),
    )
    if path.ended != "end":
        bare = any(k for k, *_ in balance.linear(omega, h).free)
        why = (
            (
                "; an undamped mode that is driven at its natural frequency stays bounded only if friction is strong "
                "enough to stop the slip; give the mode damping"
            )
            if bare
            else "; the search began at the sticking contact and also followed the motion while the drive rose from zero"
        )
        raise (_Unbounded if bare else NotConverged)(
            f"accuracy.harmonics: harmonic balance with {h} harmonics found no steady motion at "
            f"{omega / (2 * np.pi):.6g} Hz{why}"
        )
    return path.x[-1]


def evaluate_by_level(balance, x, omega, level, h) -> tuple:
    """Return residual, Jacobian and derivative of a balance by the drive level.

    Parameters
    ----------
    balance, x, omega, level, h
        See `Balance.system`.

    Returns
    -------
    tuple
    """
    s = balance.system(x, omega, level, h)
    return s.residual, s.jacobian, s.by_level


def evaluate_by_omega(balance, x, omega, level, h) -> tuple:
    """Return residual, Jacobian and derivative of a balance by the drive frequency.

    Parameters
    ----------
    balance, x, omega, level, h
        See `Balance.system`.

    Returns
    -------
    tuple
    """
    s = balance.system(x, omega, level, h)
    return s.residual, s.jacobian, s.by_omega


def make_point(balance, x, drive, h: int) -> tuple:
    """Return the steady motion of solved unknowns, and the size of the truncated harmonics.

    Parameters
    ----------
    balance : Balance
    x : ndarray
    drive
    h : int

    Returns
    -------
    tuple
    SteadyMotion, and norm of h further harmonics over that of the motion.
    """
    here = balance.system(x, drive.omega, drive.acceleration, h)
    found = _add_harmonics(balance, SweepStart(x, here), drive, h, 1, 1.0)
    force = balance.contact.force(found.coefficients, drive.omega, 2 * h, balance.contact.samples)
    z = balance.motion(x, drive.omega, drive.acceleration, h, force)
    above = float(np.linalg.norm(z[h + 1 :] @ balance.rows.T))
    return found, above / max(float(np.linalg.norm(found.coefficients)), 1e-300)


def _solve_stuck(balance, omega, level, h: int) -> np.ndarray:
    """Return the unknowns of the linear motion with all contacts stuck."""
    x = np.zeros(balance.size(omega, h))
    here = balance.system(x, omega, level, h)
    return -solve_linear(here.jacobian)(here.residual)


class SweepStart(NamedTuple):
    """Initial values of the sweeps over the higher harmonics.

    - x, system, count: unknowns (N,), their equations, and iterations so far
    - slides: (i, K + 1) [m] with harmonics above those of the unknowns, or None
    """

    x: np.ndarray
    system: System
    count: int = 0
    slides: np.ndarray | None = None


def _add_harmonics(balance, start: SweepStart, drive, h, wider, tolerance) -> SteadyMotion:
    """Add harmonics above h by fixed-point sweeps, and estimate the truncation error.

    The harmonics up to h are corrected with their Jacobian. The last sweep takes twice the samples.
    """
    x, here, count, known = start
    omega = drive.omega
    level = drive.acceleration
    top = h * wider
    solve = solve_linear(here.jacobian)
    probe = max(top, 2 * h)  # additional harmonics that estimate the truncation error
    q = np.zeros((len(balance.rows), probe + 1), complex)
    if known is not None:
        q[:, : known.shape[1]] = known[:, : probe + 1]
    q[:, : h + 1] = balance.slides(x, omega, h)
    samples = fine = balance.contact.samples
    size = float(np.linalg.norm(q))
    changes = []
    for sweep in range(MAX_SWEEPS):
        force = balance.contact.force(q, omega, probe, fine)
        z = balance.motion(x, omega, level, h, force)
        moved = -solve(_find_residual(balance, x, omega, level, h, force, z))
        if sweep and wider > 1:
            x = x + moved
        new = (z @ balance.rows.T).T
        new[:, : h + 1] = balance.slides(x, omega, h)
        changes.append(
            float(np.hypot(np.linalg.norm(moved), np.linalg.norm(new[:, h + 1 :] - q[:, h + 1 :])))
        )
        q = new
        if fine > samples or (wider == 1 and sweep):
            break
        if sweep and changes[-1] <= SWEEP_TOL_RATIO * tolerance * size:
            fine = 2 * samples
        if sweep > 2 and (changes[-1] > changes[-2] > changes[-3] or changes[-1] > changes[1]):
            return _make_diverged(balance, start, drive, h, samples)
    return _make_periodic(balance, x, drive, h, top, fine, changes, size, count, q)


def _make_diverged(balance, start: SweepStart, drive, h, samples) -> SteadyMotion:
    """Return the steady motion of h harmonics with unknown error, if higher harmonics diverge."""
    x, here, count, _ = start
    q = balance.slides(x, drive.omega, h)
    z = balance.motion(x, drive.omega, drive.acceleration, h, here.fold.force)
    return SteadyMotion(
        drive.omega,
        drive.acceleration,
        q,
        here.fold.force,
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
    """Return the residual (N,) of a balance under forces with additional harmonics."""
    low = balance.lift.shape[1] * (2 * h + 1)
    at = 0
    y = unpack_harmonics(x[:low], balance.lift.shape[1])
    out = [pack_harmonics(y - (z[: h + 1] @ balance.faces.T).T)]
    for k, _, left, stiffness in balance.linear(omega, h).free:
        parts = x[low + at : low + at + (2 if k else 1)]
        miss = balance.free_residual((k, left, stiffness), complex(*parts), omega, level, force)
        out.append(np.array([miss.real, miss.imag])[: parts.size])
        at += parts.size
    return np.concatenate(out)


def _make_periodic(balance, x, drive, h, top, samples, changes, size, count, q) -> SteadyMotion:
    omega = drive.omega
    level = drive.acceleration
    group = balance.contact
    q = q[:, : top + 1]
    fine = group.forces(q, omega, 2 * samples)
    used = group.force(q, omega, top, samples)
    left = fine - evaluate_series(used, 2 * samples)
    scale = float(np.sqrt(np.mean(fine**2)))
    residual = float(np.sqrt(np.mean(left**2))) / scale if scale > 0 else 0.0
    z = balance.motion(x, omega, level, h, used)
    error = max(changes)
    left = 0.0
    if top > h:
        # error of the unfinished sweeps, and of the harmonics above `top`, which decrease like k^-5/2
        ratio = (
            min((changes[-2] / changes[1]) ** (1 / max(len(changes) - 3, 1)), 0.9)
            if len(changes) > 3
            else 0.9
        )
        left = changes[-2] * ratio / (1 - ratio)
        error = 2 * (changes[-1] + left + max(changes) * (h / top) ** 2.5)
    size = max(size, 1e-300)
    return SteadyMotion(
        omega, level, q, used, z, h, samples, residual, error / size, count, x, group, left / size
    )
