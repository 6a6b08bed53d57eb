"""One steady motion by harmonic balance.

`point` chooses its harmonics by an estimate of the error: the balance is solved for H harmonics, the higher ones follow
from the force that those leave over (q_k = -G_k F_k, a contraction once the inertia of k > H outweighs the contact's
stiffness), and what that changes below H tells what H had missed.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import NotConverged
from .continuation import follow
from .forces import Group
from .harmonic import Balance, System, newton, pack, solve_linear, unpack
from .laws import Interlock, Track, synthesis
from .starts import one_harmonic

LADDER = (7, 15, 31, 63, 127, 255)  # harmonics that are tried
WIDER = 4  # harmonics that follow, over those that are solved for
CLIMB = (11, 15, 23, 31, 47, 63, 95, 127, 191)  # on the way from few
SWEEPS = 40
CLOSED = 1e-5  # of the tolerance, what the last sweep may change
TOLERANCE = 1e-3  # where none is given


class _Unbounded(NotConverged):
    """More harmonics would not help."""


@dataclass(frozen=True, eq=False, slots=True)
class Periodic:
    """A steady motion at omega [rad/s] under the drive amplitude level [m s-2].

    coefficients (i, K + 1) complex: slides [m] of the rows of `group`, x = Re sum X_k exp(i k omega t); forces (i, K +
    1) [N], modal (K + 1, n) [m]; harmonics H solved for (K >= H). residual: rms of the force that the motion does not
    balance in time, on twice the samples, over the rms of the force; error: estimate for the motion, relative to it;
    left: what the sweeps of the higher harmonics still change of it;
    stable and multipliers None until asked for; unknowns: those of the balance, a start for a neighbour.
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
    group: Group
    left: float = 0.0
    stable: bool | None = None
    multipliers: np.ndarray | None = None

    @property
    def base_samples(self) -> int:
        """Samples on which the unknowns were solved for."""
        return (
            self.samples // 2 if self.coefficients.shape[1] > self.harmonics + 1 else self.samples
        )

    def amplitude(self, row, samples: int = 4096) -> float:
        """(max - min)/2 [m] of row @ coordinates, row (n,), between the samples by parabolas."""
        y = synthesis(self.modal @ np.asarray(row, float), samples)
        return (top(y) + top(-y)) / 2

    def turns(self) -> tuple:
        """(slide [m], force [N], slip [m]) of the first row where its slide is smallest and where it is largest;
        () of one that rests."""
        angles, places, _, _ = Track(self.coefficients[0], self.omega, self.samples).turning
        if not angles.size:
            return ()
        k = np.arange(self.coefficients.shape[1])
        out = []
        for at in (
            np.argmin(places),
            np.argmax(places),
        ):  # the cycle begins there: its first sample is the turn
            track = Track(
                self.coefficients[0] * np.exp(1j * k * angles[at]), self.omega, self.samples
            )
            found = [law.sample(track) for law in self.group.laws[0]]
            out.append(
                (
                    float(places[at]),
                    float(friction_force(self.group.laws[0], found)[0]),
                    float(slip_of(track, found)[0]),
                )
            )
        return tuple(out)


def friction_force(laws: tuple, sampled: list) -> np.ndarray:
    """Return the force (N,) [N] of the laws of a row at its samples, without that of an interlock beside friction.

    The interlock of [structure.bonded] is a spring beside the contact, so its force is no friction force.
    """
    friction = [one.force for law, one in zip(laws, sampled) if not isinstance(law, Interlock)]
    return sum(friction or [one.force for one in sampled])


def slip_of(track: Track, found: list) -> np.ndarray:
    """Irreversible part (N,) [m] of a slide from the laws sampled along it; 0 where nothing rubs."""
    limit = sum(one.limit for one in found)
    stretch = sum(one.stretch for one in found if one.stretch is not None)
    return track.q - stretch / limit if limit > 0 else np.zeros(track.samples)


def top(y) -> float:
    """Largest value of a cycle y (N,), between the samples by a parabola: the largest of 4096 samples of a sine can be
    (pi/4096)^2/2 = 3e-7 of it smaller."""
    k = int(np.argmax(y))
    a = y[k - 1]
    b = y[k]
    c = y[(k + 1) % y.size]
    bend = a - 2 * b + c
    return float(b - (a - c) ** 2 / (8 * bend)) if bend < 0 else float(b)


def group_of(modes, group) -> Group:
    """A Group of laws given as such, as a law, as a contact model, or as (row, law) pairs."""
    return group if isinstance(group, Group) else Group(modes, group)


def balance_of(modes, group: Group, samples: int) -> Balance:
    """The equations of the rows of `group` on `samples` of a cycle."""
    gridded = group.with_samples(samples)
    return Balance(modes, gridded.rows, gridded)


def point(
    modes, drive, group, harmonics: int | None = None, tolerance: float = 1e-3, start=None
) -> Periodic:
    """The steady motion under a core.SineDrive. harmonics: exactly so many; None: as many as `tolerance` wants.

    start: a Periodic or unknowns nearby; else the held contact, what one harmonic would do, weaker drives.
    NotConverged where no balance is found or LADDER ends before the tolerance.
    """
    group = group_of(modes, group)
    x, near = (start.unknowns, start.base_samples) if isinstance(start, Periodic) else (start, 0)
    if harmonics is not None:
        return _solved(modes, drive, group, harmonics, x, 1, near=near)
    found = None
    least = start.harmonics if isinstance(start, Periodic) else _least(modes, drive, group)
    for h in [h for h in LADDER if h >= least] or LADDER[-1:]:
        try:
            found = _solved(modes, drive, group, h, x, WIDER, tolerance, near)
        except _Unbounded:
            raise
        except NotConverged:
            if h == LADDER[-1]:
                raise
            continue
        if found.error <= tolerance:
            return found
        x = cut(balance_of(modes, group, 0), found.coefficients, found.unknowns, h, _next(h))
    if found is None or found.error > tolerance:
        raise NotConverged(
            f"accuracy.tolerance: with {LADDER[-1]} harmonics the motion still has an error of "
            f"{found.error if found else np.inf:.1e}, more than {tolerance:g}; raise the tolerance, or "
            'use accuracy.method = "march"'
        )
    return found


def _least(modes, drive, group) -> float:
    """Harmonics (63 at most) from which inertia outweighs the contact's stiffness, so that the higher ones follow."""
    stiff = float(np.sum(group.stiffness() * np.sum(group.rows**2, axis=1))) / modes.mass
    return min(np.sqrt(stiff) / drive.omega, 63)


def _next(h: int) -> int:
    return LADDER[min(LADDER.index(h) + 1, len(LADDER) - 1)] if h in LADDER else 2 * h + 1


def cut(balance, slides, unknowns, h: int, harmonics: int) -> np.ndarray:
    """Unknowns for `harmonics` harmonics from those for h: the slides' harmonics (i, K + 1) [m], cut or with zeros.

    What stands behind the slides' harmonics in the unknowns, other numbers of the balance, is kept.
    """
    y = np.zeros((balance.lift.shape[1], harmonics + 1), complex)
    keep = min(harmonics, slides.shape[1] - 1) + 1
    y[:, :keep] = balance.lift.T @ slides[:, :keep]
    return np.concatenate([pack(y), unknowns[y.shape[0] * (2 * h + 1) :]])


def finer(found: Periodic, modes, drive) -> Periodic:
    """The same motion with twice its harmonics, three of one (a law alike both ways has no even ones), and twice its
    samples, those above following where they do. NotConverged where it is not found."""
    h = found.harmonics
    x = found.unknowns
    top = max(2 * (found.coefficients.shape[1] - 1), 3)
    balance = balance_of(modes, found.group, 2 * found.base_samples)
    here = balance.system(x, drive.omega, drive.acceleration, h)
    one = _widened(balance, Reached(x, here, 0, found.coefficients), drive, h, top // h, TOLERANCE)
    return one if np.isfinite(one.error) else _solved(modes, drive, balance.contact, top, x, 1)


def _solved(modes, drive, group, h, x, wider, tolerance=TOLERANCE, near=0) -> Periodic:
    """The balance with h harmonics, those above up to wider h following, on samples sharp enough for its slides; near:
    samples that a neighbour took."""
    samples = group.samples or max(group.samples_for(h * wider), near)
    balance = balance_of(modes, group, samples)
    for _ in range(3):
        x, here, count = _reach(balance, x, drive, h)
        swing = (
            np.ptp(synthesis(balance.slides(x, drive.omega, h), 2 ** (h + 64).bit_length()), axis=1)
            / 2
        )
        want = group.samples or group.samples_for(h * wider, swing)
        if want <= balance.contact.samples:
            break
        balance = balance.on(balance.contact.with_samples(want))
    return _widened(balance, Reached(x, here, count), drive, h, wider, tolerance)


def _reach(balance, x, drive, h: int):
    """`newton` from a start of any number of harmonics, from the held contact, what one harmonic would do, or along
    weaker drives."""
    omega = drive.omega
    level = drive.acceleration
    for start in _starts(balance, x, omega, level, h):
        try:
            return newton(balance, start, omega, level, h)
        except NotConverged:
            pass
    return newton(balance, _climbed(balance, omega, level, h), omega, level, h)


def _starts(balance, x, omega, level, h: int):
    """Unknowns from which Newton's method may lead to a motion, the likeliest first."""
    r = balance.lift.shape[1]
    if x is not None:
        free = sum(1 if k == 0 else 2 for k, *_ in balance.linear(omega, h).free)
        have, rest = divmod(x.size - free - r, 2 * r)
        if have >= 0 and not rest:
            yield cut(balance, balance.lift @ unpack(x[: r * (2 * have + 1)], r), x, have, h)
    yield _held(balance, omega, level, h)
    for one in one_harmonic(balance, omega, level):
        yield cut(balance, balance.slides(one, omega, 1), one, 1, h)


def _climbed(balance, omega, level, h: int) -> np.ndarray:
    """Unknowns by way of few harmonics, which are cheap to follow from weaker drives, to more of them."""
    below = min(LADDER[0], h)
    x = _along_levels(balance, omega, level, below)
    for more in [k for k in CLIMB if below < k < h] + [h] * (h > below):
        try:
            start = cut(balance, balance.slides(x, omega, below), x, below, more)
            x = newton(balance, start, omega, level, more)[0]
            below = more
        except NotConverged:
            pass
    return x if below == h else _along_levels(balance, omega, level, h)


def _along_levels(balance, omega, level, h: int) -> np.ndarray:
    """Unknowns by following the motion from a thousandth of the drive amplitude."""
    path = follow(
        lambda v, p: by_level(balance, v, omega, p, h),
        _held(balance, omega, level, h) * 1e-3,
        1e-3 * level,
        (0.0, level),
        True,
        0.05,
        0.5,
        1000,
        1e-6,
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


def by_level(balance, x, omega, level, h) -> tuple:
    """(residual, Jacobian, slope over the level) for `continuation`; level: acceleration of the drive [m s-2]."""
    s = balance.system(x, omega, level, h)
    return s.residual, s.jacobian, s.by_level


def by_omega(balance, x, omega, level, h) -> tuple:
    """(residual, Jacobian, slope over omega) for `continuation`; omega [rad/s] of the drive."""
    s = balance.system(x, omega, level, h)
    return s.residual, s.jacobian, s.by_omega


def plain(balance, x, drive, h: int) -> tuple:
    """(Periodic of solved unknowns, share of the motion that the next h harmonics would add) without more of them."""
    here = balance.system(x, drive.omega, drive.acceleration, h)
    found = _widened(balance, Reached(x, here), drive, h, 1, 1.0)
    force = balance.contact.force(found.coefficients, drive.omega, 2 * h, balance.contact.samples)
    z = balance.motion(x, drive.omega, drive.acceleration, h, force)
    above = float(np.linalg.norm(z[h + 1 :] @ balance.rows.T))
    return found, above / max(float(np.linalg.norm(found.coefficients)), 1e-300)


def _held(balance, omega, level, h: int) -> np.ndarray:
    """Unknowns with every contact at its stiffness at rest: one linear step from zero."""
    x = np.zeros(balance.size(omega, h))
    here = balance.system(x, omega, level, h)
    return -solve_linear(here.jacobian)(here.residual)


class Reached(NamedTuple):
    """Where sweeps begin: unknowns (N,), their System, iterations so far, and slides (i, K + 1) [m] that know harmonics
    above those of the unknowns."""

    x: np.ndarray
    system: System
    count: int = 0
    slides: np.ndarray | None = None


def _widened(balance, start: Reached, drive, h, wider, tolerance) -> Periodic:
    """Harmonics above h by sweeps with the Jacobian of those below; the error they leave.

    The last sweep takes twice the samples. changes: of the slides per sweep [m], first those that follow alone.
    """
    x, here, count, known = start
    omega = drive.omega
    level = drive.acceleration
    top = h * wider
    solve = solve_linear(here.jacobian)
    probe = max(top, 2 * h)  # harmonics that tell what is left out
    q = np.zeros((len(balance.rows), probe + 1), complex)
    if known is not None:
        q[:, : known.shape[1]] = known[:, : probe + 1]
    q[:, : h + 1] = balance.slides(x, omega, h)
    samples = fine = balance.contact.samples
    size = float(np.linalg.norm(q))
    changes = []
    for sweep in range(SWEEPS):
        force = balance.contact.force(q, omega, probe, fine)
        z = balance.motion(x, omega, level, h, force)
        moved = -solve(_missed(balance, x, omega, level, h, force, z))
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
        if sweep and changes[-1] <= CLOSED * tolerance * size:
            fine = 2 * samples
        if sweep > 2 and (changes[-1] > changes[-2] > changes[-3] or changes[-1] > changes[1]):
            return _diverged(balance, start, drive, h, samples)
    return _periodic(balance, x, drive, h, top, fine, changes, size, count, q)


def _diverged(balance, start: Reached, drive, h, samples) -> Periodic:
    """The plain balance, where the harmonics above h do not follow: nothing is known of its error."""
    x, here, count, _ = start
    q = balance.slides(x, drive.omega, h)
    z = balance.motion(x, drive.omega, drive.acceleration, h, here.fold.force)
    return Periodic(
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


def _missed(balance, x, omega, level, h, force, z) -> np.ndarray:
    """Residual (N,) under forces (i, K + 1) that come from more harmonics than the unknowns have."""
    low = balance.lift.shape[1] * (2 * h + 1)
    at = 0
    y = unpack(x[:low], balance.lift.shape[1])
    out = [pack(y - (z[: h + 1] @ balance.faces.T).T)]
    for k, _, left, stiffness in balance.linear(omega, h).free:
        parts = x[low + at : low + at + (2 if k else 1)]
        miss = balance.free_miss((k, left, stiffness), complex(*parts), omega, level, force)
        out.append(np.array([miss.real, miss.imag])[: parts.size])
        at += parts.size
    return np.concatenate(out)


def _periodic(balance, x, drive, h, top, samples, changes, size, count, q) -> Periodic:
    omega = drive.omega
    level = drive.acceleration
    group = balance.contact
    q = q[:, : top + 1]
    fine = group.forces(q, omega, 2 * samples)
    used = group.force(q, omega, top, samples)
    left = fine - synthesis(used, 2 * samples)
    scale = float(np.sqrt(np.mean(fine**2)))
    residual = float(np.sqrt(np.mean(left**2))) / scale if scale > 0 else 0.0
    z = balance.motion(x, omega, level, h, used)
    error = max(changes)
    left = 0.0
    if top > h:
        # what is left of the sweeps, and what lies beyond the top: as below it, falling like k^-5/2
        ratio = (
            min((changes[-2] / changes[1]) ** (1 / max(len(changes) - 3, 1)), 0.9)
            if len(changes) > 3
            else 0.9
        )
        left = changes[-2] * ratio / (1 - ratio)
        error = 2 * (changes[-1] + left + max(changes) * (h / top) ** 2.5)
    size = max(size, 1e-300)
    return Periodic(
        omega, level, q, used, z, h, samples, residual, error / size, count, x, group, left / size
    )
