"""Steady motion under a sinusoidal drive by harmonic balance, with an error estimate.

The number of harmonics is doubled until the motion changes by less than the tolerance.
"""

import numpy as np

from ...core import NotConverged
from .continuation import CurvePath, PathEquations, PathSettings, follow_curve
from .equations import HarmonicBalance, has_undamped_resonance
from .forces import LawGroup
from .motion import SteadyMotion
from .series import evaluate_series, pack_harmonics, pad_harmonics

# Numbers of harmonics that are tried in turn, each about twice the previous one.
HARMONIC_COUNTS = (7, 15, 31, 63, 127, 255, 511)
MAX_FIRST_COUNT = 63  # largest number of harmonics that is tried first
# Weakest drive from which a motion is followed, relative to the drive, and the settings of this curve.
WEAK_DRIVE = 1e-3
LEVEL_PATH = PathSettings(0.05, 0.5, 1000, 1e-6)
# Strongest drive to which coexisting motions are followed, relative to the drive, and the settings of this curve.
MAX_LEVEL_RATIO = 10.0
COEXISTING_PATH = PathSettings(0.005, 0.02, 2000, 1e-6)


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
        Initial guess, a motion or harmonics of the slides [m]; otherwise the stuck contact and weaker drives are tried.

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
    """Return the numbers of harmonics that are tried in turn.

    A given number is tried twice, because the samples change.

    Parameters
    ----------
    drive : core.SineDrive
        Sine drive with its frequency.
    group : LawGroup
        Friction laws and the modes on which they act.
    harmonics : int or None
        Number that the user asks for.
    start : SteadyMotion or None
        Motion from which the search begins, whose number of harmonics is a hint.
    """
    if harmonics is not None:
        return [harmonics, harmonics]
    if isinstance(start, SteadyMotion):
        min_count = start.harmonics / 2
    else:
        # Inertia dominates the contact stiffness in higher harmonics.
        stiffness = float(np.sum(group.stiffness() * np.sum(group.rows**2, axis=1)))
        min_count = min(np.sqrt(stiffness / group.modes.mass) / drive.omega, MAX_FIRST_COUNT)
    return [h for h in HARMONIC_COUNTS if h >= int(min_count)]


def find_amplitudes(slides) -> np.ndarray:
    """Return the amplitudes (...) [m] of slides (..., H + 1), half their range at equal samples."""
    # More than twice as many samples as harmonics, and at least 64.
    size = slides.shape[-1]
    count = 2 ** max(size + 63, 2 * size - 1).bit_length()
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
        equations.motion.force,
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
    start = pack_harmonics(pad_harmonics(motion.slides, max(2 * motion.harmonics, 3)))
    x, _, n_steps = balance.solve(start, drive.omega, drive.acceleration)
    return make_motion(balance, x, drive, motion.slides, n_steps)


def list_coexisting_slides(motion: SteadyMotion, drive) -> list[np.ndarray]:
    """Return slides (i, H + 1) [m] near the motions that coexist under a drive, as starts of `find_steady_motion`.

    The curve of the motions over the drive level begins at rest and passes the level once for each of them, through its
    folds up to MAX_LEVEL_RATIO of the level.

    Parameters
    ----------
    motion : SteadyMotion
        A motion under the drive, with as many harmonics and samples.
    drive : core.SineDrive
        Frequency and level.
    """
    balance = HarmonicBalance(motion.group.modes, motion.group, motion.samples)
    level = drive.acceleration
    path = _follow_levels(
        balance, drive.omega, level, motion.harmonics, MAX_LEVEL_RATIO, COEXISTING_PATH
    )
    is_above = path.p > level
    return [balance.unpack_slides(x) for x in path.x[:-1][is_above[1:] != is_above[:-1]]]


def _solve_from_guesses(balance: HarmonicBalance, drive, h: int, slides) -> tuple[np.ndarray, int]:
    """Solve a balance from given slides, from the stuck contact, and finally from weaker drives.

    Parameters
    ----------
    balance : HarmonicBalance
        Equations of the motion.
    drive : core.SineDrive
        Frequency and level.
    h : int
        Number H of harmonics of the motion.
    slides : (i, K + 1) array or None
        Harmonics 0 to K of the slides of all interfaces [m], from which the first trial starts.

    Returns
    -------
    x : (N,) array
        Unknowns of the balance.
    count : int
        Number of Newton steps.
    """
    omega = drive.omega
    level = drive.acceleration
    guesses = [] if slides is None else [pack_harmonics(pad_harmonics(slides, h))]
    for guess in (*guesses, balance.solve_stuck(omega, level, h)):
        try:
            x, _, count = balance.solve(guess, omega, level)
            return x, count
        except NotConverged:
            pass

    # The curve of the motions over the drive level leads to one of them.
    path = _follow_levels(balance, omega, level, h)
    if path.ended == "end":
        x, _, count = balance.solve(path.x[-1], omega, level)
        return x, count
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


def _follow_levels(
    balance: HarmonicBalance,
    omega: float,
    level: float,
    h: int,
    ratio: float = 1.0,
    settings: PathSettings = LEVEL_PATH,
) -> CurvePath:
    """Follow the motions with h harmonics over the drive level, from WEAK_DRIVE up to a ratio of a level [m s-2].

    Parameters
    ----------
    balance : HarmonicBalance
        Equations for the laws with a number of samples.
    omega : float
        Frequency of the drive [rad/s].
    level : float
        Amplitude of the acceleration of the drive [m s-2].
    h : int
        Number of harmonics.
    ratio : float
        Last level divided by `level`.
    settings : PathSettings
        Steps along the curve.
    """

    def evaluate(x, level):
        """Return the `PathEquations` at packed slides x (N,) and a drive level [m s-2]."""
        equations = balance.evaluate(x, omega, level)
        return PathEquations(equations.residual, equations.jacobian, equations.by_level)

    start = balance.solve_stuck(omega, level, h) * WEAK_DRIVE
    bounds = (0.0, ratio * level)
    return follow_curve(evaluate, start, WEAK_DRIVE * level, bounds, settings=settings)
