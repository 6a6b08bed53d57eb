"""Solution branches of steady motions over the drive frequency."""

from dataclasses import dataclass, replace

import numpy as np

from ...core import NotConverged, SineDrive
from .continuation import NEWTON_TOL, PathEquations, PathSettings, correct_point, follow_curve
from .equations import HarmonicBalance
from .motion import SteadyMotion
from .series import pack_harmonics, pad_harmonics
from .steady import (
    HARMONIC_COUNTS,
    find_amplitudes,
    find_steady_motion,
    make_group,
    make_motion,
)

# Steps along a response curve
PATH = PathSettings(first_step=0.0125, max_step=0.05)
# Ratio of the harmonics of the first motion, which meet the tolerance alone, to those of the first curve.
FIRST_REDUCTION = 4
TRUNCATION_RATIO = 0.25  # part of the tolerance that the harmonics above H may have
MAX_SAMPLE_CHANGES = 3  # largest number of curves with more samples each


@dataclass(frozen=True, eq=False, slots=True)
class Branch:
    """Solution branch of steady motions over the drive frequency.

    - points: tuple of SteadyMotion, in order along the curve
    - folds: frequencies at the folds [Hz]
    - ended: see `continuation.CurvePath`
    """

    points: tuple[SteadyMotion, ...]
    folds: tuple[float, ...]
    ended: str


def trace_over_frequency(
    modes,
    drive: SineDrive,
    group,
    ends: tuple[float, float],
    harmonics: int | None = None,
    tolerance: float = 1e-3,
) -> Branch:
    """Trace a branch of steady motions over the drive frequency at a constant drive level, through its folds.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    drive : SineDrive
        Its level is that of all points.
    group : LawGroup, or what `steady.make_group` takes
        Laws of the interfaces.
    ends : tuple of float
        First and last frequency [Hz], above 0.
    harmonics : int, optional
        Number of harmonics; as many as the tolerance needs by default, the same at all points.
    tolerance : float, optional
        Relative error of each motion.
    """
    omegas = [2 * np.pi * float(frequency) for frequency in ends]
    drive = replace(drive, omega=omegas[0])
    first = find_steady_motion(modes, drive, make_group(modes, group), harmonics, tolerance)
    limit = TRUNCATION_RATIO * tolerance
    least = first.harmonics // FIRST_REDUCTION
    for h in [harmonics] if harmonics else [h for h in HARMONIC_COUNTS if h >= least]:
        branch = _trace_with_harmonics(modes, drive, omegas, first, h)
        left_out = max(point.error for point in branch.points)
        if harmonics or left_out <= limit:
            return branch
    raise NotConverged(
        f"harmonic balance with {HARMONIC_COUNTS[-1]} harmonics leaves out {left_out:.1e} of the motion, more than "
        f"the limit of {limit:g}; raise the tolerance"
    )


def _trace_with_harmonics(modes, drive: SineDrive, omegas, first: SteadyMotion, h: int) -> Branch:
    """Trace a branch with h harmonics, and with enough samples per cycle for the largest amplitude.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    drive : SineDrive
        Drive, whose frequency is varied.
    omegas : tuple of float
        First and last circular frequency [rad/s].
    first : SteadyMotion
        Motion near the first frequency, from which the branch starts.
    h : int
        Number of harmonics.
    """
    group = first.group
    samples = group.samples_for(h, find_amplitudes(first.slides))
    for _ in range(MAX_SAMPLE_CHANGES):
        balance = HarmonicBalance(modes, group, samples)
        x = pack_harmonics(pad_harmonics(first.slides, h))
        evaluate = _differentiate(balance, drive)
        path = follow_curve(evaluate, x, omegas[0], sorted(omegas), omegas[1] > omegas[0], PATH)
        slides = np.array([balance.unpack_slides(x) for x in path.x])
        needed = group.samples_for(h, find_amplitudes(slides).max(axis=0))
        if needed <= samples:
            break
        samples = needed
    points = tuple(
        make_motion(balance, x, replace(drive, omega=float(omega)))
        for x, omega in zip(path.x, path.p)
    )
    return Branch(points, tuple(fold / (2 * np.pi) for fold in path.folds), path.ended)


def _differentiate(balance: HarmonicBalance, drive: SineDrive):
    """Return a function of unknowns and frequency [rad/s] that gives the equations of a curve."""

    def evaluate(x, omega):
        """Return the `PathEquations` at packed slides x (N,) and a frequency omega [rad/s]."""
        equations = balance.evaluate(x, omega, drive.acceleration)
        return PathEquations(equations.residual, equations.jacobian, equations.by_omega)

    return evaluate


def _pack_points(
    first: SteadyMotion, second: SteadyMotion, width: float
) -> tuple[HarmonicBalance, np.ndarray, np.ndarray, np.ndarray]:
    """Return the balance of two points on a branch, both points (packed slides, omega), and their unit, (N + 1,) each.

    Both motions have the same number of harmonics. `width` is the unit of omega [rad/s], such as the width of a sweep.
    """
    balance = HarmonicBalance(first.group.modes, first.group, first.samples)
    packed = [pack_harmonics(motion.slides) for motion in (first, second)]
    size = max(float(np.linalg.norm(x)) for x in packed) or 1.0
    unit = np.append(np.full(packed[0].size, size), width)
    points = [np.append(x, motion.omega) for x, motion in zip(packed, (first, second))]
    return balance, *points, unit


def measure_distance(first: SteadyMotion, second: SteadyMotion, width: float) -> float:
    """Return the distance between two points on a branch in scaled unknowns and frequency.

    Parameters
    ----------
    first, second : SteadyMotion
        Points on the branch.
    width : float
        Frequency step [rad/s] that counts as 1.
    """
    _, begin, end, unit = _pack_points(first, second, width)
    return float(np.linalg.norm((end - begin) / unit))


def find_point_between(
    modes, drive, first: SteadyMotion, second: SteadyMotion, fraction: float, width: float
) -> SteadyMotion:
    """Find the point on a branch at a given fraction of the step between two points.

    Newton's method corrects the linear interpolation perpendicular to the step, so folds are no obstacle.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the structure without the contact.
    drive : SineDrive
        Its level is that of the branch.
    first, second : SteadyMotion
        Points at the ends of the step.
    fraction : float
        Fraction of the step.
    width : float
        Frequency step [rad/s] that counts as 1.

    Raises
    ------
    NotConverged
        If Newton's method finds no motion near the interpolated one.
    """
    balance, begin, end, unit = _pack_points(first, second, width)
    step = (end - begin) / unit
    tangent = step / np.linalg.norm(step)
    guess = begin + fraction * (end - begin)
    corrected = correct_point(_differentiate(balance, drive), guess, tangent, unit, NEWTON_TOL)
    if corrected is None:
        raise NotConverged(
            "accuracy.method: no steady motion was found between two neighbouring points of the curve"
        )
    w = corrected[0]
    return make_motion(balance, w[:-1], replace(drive, omega=float(w[-1])))
