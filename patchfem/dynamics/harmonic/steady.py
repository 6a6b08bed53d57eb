"""Steady motion under a sinusoidal drive by harmonic balance, with an error estimate.

The number of harmonics is doubled until the motion changes by less than the tolerance.
"""

from itertools import pairwise

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from ...core import NotConverged
from .continuation import PathEquations, PathSettings, follow_curve
from .equations import HarmonicBalance, has_undamped_resonance
from .forces import LawGroup
from .motion import SteadyMotion
from .series import evaluate_series, pad_harmonics

# Numbers of harmonics that are tried in turn, each about twice the previous one.
HARMONIC_COUNTS = (7, 15, 31, 63, 127, 255, 511)
MAX_FIRST_COUNT = 63  # largest number of harmonics that is tried first
N_ROOT_SAMPLES = 512  # samples per cycle of the balance with one harmonic
N_ROOT_AMPLITUDES = 240  # amplitudes at which this balance is evaluated
# Smallest and largest of these amplitudes, relative to that of the linear motion.
ROOT_RANGE = (1e-7, 1e4)
# Weakest drive from which a motion is followed, relative to the drive, and the settings of this curve.
WEAK_DRIVE = 1e-3
LEVEL_PATH = PathSettings(0.05, 0.5, 1000, 1e-6)


class Unbounded(NotConverged):
    """Error: no bounded motion was found at the resonance of an undamped mode."""


def make_group(modes, group) -> LawGroup:
    """Return a LawGroup, or make it from a law or pairs (row, law)."""
    return group if isinstance(group, LawGroup) else LawGroup(modes, group)


def find_steady_motion(
    modes, drive, group, harmonics: int | None = None, tolerance: float = 1e-3, start=None
) -> SteadyMotion:
    """Find a steady motion under a sinusoidal drive by harmonic balance.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    drive : core.SineDrive
        Frequency and level.
    group : LawGroup, or what `make_group` takes
        Laws of the interfaces.
    harmonics : int, optional
        Number of harmonics; as many as the tolerance needs by default.
    tolerance : float, optional
        Largest change of the motion, relative to it, with twice the harmonics.
    start : SteadyMotion or (i, K + 1) array, optional
        Initial guess, a motion or harmonics of the slides [m]; otherwise the stuck contact, the motions with one
        harmonic and weaker drives are tried.

    Raises
    ------
    NotConverged
        If no balance is found, or no number of harmonics meets the tolerance.
    """
    group = make_group(modes, group)
    slides = start.slides if isinstance(start, SteadyMotion) else start

    motion = None
    for h in _choose_counts(drive, group, harmonics, start):
        # Corners of the force are resolved once the amplitude is known.
        samples = group.samples_for(h, None if slides is None else find_amplitudes(slides))
        balance = HarmonicBalance(modes, group, samples)
        try:
            x, count = _solve_from_guesses(balance, drive, h, slides)
        except NotConverged as failure:
            if isinstance(failure, Unbounded) or h == HARMONIC_COUNTS[-1] or harmonics:
                raise
            continue

        known = None if motion is None else motion.slides
        motion = make_motion(balance, x, drive, known, count)
        if motion.error <= tolerance and known is not None and not harmonics:
            break
        slides = motion.slides

    if not harmonics and motion.error > tolerance:
        raise NotConverged(
            f"accuracy.tolerance: with {HARMONIC_COUNTS[-1]} harmonics the motion still has an error of "
            f"{motion.error:.1e}, more than {tolerance:g}; raise the tolerance, or "
            'use accuracy.method = "march"'
        )
    return motion


def _choose_counts(drive, group: LawGroup, harmonics: int | None, start) -> list[int]:
    """Return the numbers of harmonics that are tried in turn; a given number twice, because the samples change."""
    if harmonics is not None:
        return [harmonics, harmonics]
    if isinstance(start, SteadyMotion):
        least = start.harmonics / 2
    else:
        # Inertia dominates the contact stiffness in higher harmonics.
        stiffness = float(np.sum(group.stiffness() * np.sum(group.rows**2, axis=1)))
        least = min(np.sqrt(stiffness / group.modes.mass) / drive.omega, MAX_FIRST_COUNT)
    return [h for h in HARMONIC_COUNTS if h >= int(least)]


def find_amplitudes(slides) -> np.ndarray:
    """Return the amplitudes (...) [m] of slides (..., H + 1), half their range at equal samples."""
    count = 2 ** (slides.shape[-1] + 63).bit_length()
    return np.ptp(evaluate_series(slides, count), axis=-1) / 2


def make_motion(balance: HarmonicBalance, x, drive, coarser=None, n_steps: int = 0) -> SteadyMotion:
    """Return the motion of unknowns (N,) that solve the balance.

    Parameters
    ----------
    balance : HarmonicBalance
        Balance that is solved.
    x : (N,) array
        Packed slides [m] that solve it.
    drive : core.SineDrive
        Frequency and level.
    coarser : (i, K + 1) array, optional
        Slides [m] of a coarser solution; the change from them is the error. Without them it is the size of as many further
        harmonics, which follow from the force.
    n_steps : int
        Number of Newton steps.
    """
    equations = balance.evaluate(x, drive.omega, drive.acceleration)
    slides = balance.unpack_slides(x)
    if coarser is None:
        change = balance.find_higher_harmonics(slides, drive.omega)
    else:
        change = slides - pad_harmonics(coarser, slides.shape[1] - 1)
    error = float(np.linalg.norm(change)) / max(float(np.linalg.norm(slides)), 1e-300)
    return SteadyMotion(
        drive.omega,
        drive.acceleration,
        slides,
        equations.motion.contact.force,
        equations.motion.modal,
        balance.samples,
        error,
        n_steps,
        balance.group,
    )


def refine_steady_motion(motion: SteadyMotion, modes, drive) -> SteadyMotion:
    """Solve for a steady motion again with twice the harmonics and samples.

    One harmonic becomes three, because a symmetric law has no even harmonics.

    Parameters
    ----------
    motion : SteadyMotion
        Motion that is the initial guess.
    modes : ModalBasis
        Modes of the structure without the contact.
    drive : core.SineDrive
        Frequency and level.

    Raises
    ------
    NotConverged
        If no solution is found.
    """
    balance = HarmonicBalance(modes, motion.group, 2 * motion.samples)
    start = balance.pack_slides(pad_harmonics(motion.slides, max(2 * motion.harmonics, 3)))
    x, _, n_steps = balance.solve(start, drive.omega, drive.acceleration)
    return make_motion(balance, x, drive, motion.slides, n_steps)


# ---- search for a first solution


def _solve_from_guesses(balance: HarmonicBalance, drive, h: int, slides) -> tuple[np.ndarray, int]:
    """Solve a balance from several initial guesses in turn, and finally from weaker drives.

    Returns the unknowns, and the number of Newton steps.
    """
    omega = drive.omega
    level = drive.acceleration

    def make_guesses():
        """Yield initial guesses, the most promising first."""
        if slides is not None:
            yield balance.pack_slides(pad_harmonics(slides, h))
        yield balance.solve_stuck(omega, level, h)
        for root in find_one_harmonic_roots(balance, omega, level):
            yield balance.pack_slides(pad_harmonics(root, h))

    for guess in make_guesses():
        try:
            x, _, count = balance.solve(guess, omega, level)
            return x, count
        except NotConverged:
            pass

    x, _, count = balance.solve(_follow_levels(balance, omega, level, h), omega, level)
    return x, count


def _follow_levels(balance: HarmonicBalance, omega: float, level: float, h: int) -> np.ndarray:
    """Return the unknowns at a drive level by continuation from WEAK_DRIVE of it."""

    def evaluate(x, level):
        equations = balance.evaluate(x, omega, level)
        return PathEquations(equations.residual, equations.jacobian, equations.by_level)

    start = balance.solve_stuck(omega, level, h) * WEAK_DRIVE
    path = follow_curve(evaluate, start, WEAK_DRIVE * level, (0.0, level), settings=LEVEL_PATH)
    if path.ended == "end":
        return path.x[-1]
    failure = (
        f"accuracy.harmonics: harmonic balance with {h} harmonics found no steady motion at "
        f"{omega / (2 * np.pi):.6g} Hz; "
    )
    if has_undamped_resonance(balance.modes, omega):
        raise Unbounded(
            f"{failure}an undamped mode that is driven at its natural frequency stays bounded only if "
            "friction is strong enough to stop the slip; give the mode damping"
        )
    raise NotConverged(
        f"{failure}the search began at the sticking contact and also followed the motion while the drive rose from zero"
    )


def find_one_harmonic_roots(
    balance: HarmonicBalance, omega: float, level: float
) -> list[np.ndarray]:
    """Find the slides (i, 2) [m] of all solutions of the balance with one harmonic.

    The balance is evaluated at amplitudes of the linear motion. For one row the result is exact, because a phase turns
    slide and force alike; for several it is an initial guess.

    Parameters
    ----------
    balance : HarmonicBalance
        Balance of modes and laws.
    omega, level : float
        Frequency [rad/s] and amplitude [m s-2] of the drive.
    """
    balance = HarmonicBalance(balance.modes, balance.group, N_ROOT_SAMPLES)
    unmoved = balance.evaluate(np.zeros(3 * balance.rank), omega, level)
    drive = (unmoved.motion.modal @ balance.faces.T)[1]
    size = float(np.linalg.norm(drive))
    if size == 0:
        return []
    direction = drive / size

    def find_drive(log: float) -> complex:
        """Return the complex amplitude of the drive that an amplitude of the slide needs, in units of the drive."""
        y = np.zeros((balance.rank, 2), complex)
        y[:, 1] = direction * np.exp(log)
        motion = balance.evaluate(balance.pack_slides(balance.lift @ y), omega, 0.0).motion
        return complex(direction.conj() @ (y[:, 1] - balance.faces @ motion.modal[1])) / size

    def find_mismatch(log: float) -> float:
        return abs(find_drive(log)) - 1

    # An amplitude of the slide is a root if it needs the given drive; its phase turns that of the drive to 0.
    grid = np.log(size) + np.linspace(*np.log(ROOT_RANGE), N_ROOT_AMPLITUDES)
    values = [find_mismatch(log) for log in grid]
    roots = []
    for low, high in _bracket_roots(find_mismatch, grid, values):
        log = brentq(find_mismatch, low, high, xtol=1e-10)
        phase = find_drive(log).conjugate()
        slide = balance.lift @ direction * np.exp(log) * phase / abs(phase)
        roots.append(np.stack([0 * slide, slide], axis=1))
    return roots


def _bracket_roots(function, grid, values) -> list[tuple[float, float]]:
    """Return intervals (a, b) that enclose the sign changes of a function on a grid (k,).

    A sample closer to zero than its neighbours may hide two roots; its minimum is then located.
    """
    points = list(zip(grid, values))
    for k in range(1, len(grid) - 1):
        sign = np.sign(values[k])
        if all(0 < sign * values[k] < sign * value for value in (values[k - 1], values[k + 1])):
            low = minimize_scalar(
                lambda x, sign=sign: sign * function(x),
                bounds=(grid[k - 1], grid[k + 1]),
                method="bounded",
                options={"xatol": 1e-8},
            )
            if low.fun < 0:
                points.append((float(low.x), sign * low.fun))
    points.sort()
    return [(a, b) for (a, u), (b, v) in pairwise(points) if u * v <= 0]
