"""Solution branches of steady motions, coexisting steady motions at one drive, and backbones."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ...core import NotConverged, PatchfemError, SineDrive
from .backbone import FreeBalance, trace_free_motions
from .continuation import NEWTON_TOL, PathSettings, Scales, correct_point, follow_curve
from .laws import evaluate_series
from .point import (
    HARMONIC_COUNTS,
    SteadyMotion,
    change_harmonic_count,
    differentiate_by_frequency,
    differentiate_by_level,
    find_steady_motion,
    make_balance,
    make_group,
    make_motion_from_unknowns,
)
from .stability import add_stability
from .starts import find_one_harmonic_roots


@dataclass(frozen=True, eq=False, slots=True)
class Branch:
    """Solution branch of steady motions, in order along the curve.

    - points: tuple of SteadyMotion
    - parameter: "frequency" [Hz] or "level" [m s-2]
    - folds, crossings: values of the parameter at folds and at bifurcations to another branch
    - ended: see `continuation.CurvePath`, or "listed" for prescribed values of the parameter
    """

    points: tuple
    parameter: str
    folds: tuple = ()
    crossings: tuple = ()
    ended: str = "listed"

    @property
    def values(self) -> np.ndarray:
        """Values (k,) of the parameter along the branch: drive frequency [Hz] or drive amplitude [m s-2]."""
        if self.parameter == "frequency":
            return np.array([point.omega / (2 * np.pi) for point in self.points])
        return np.array([point.level for point in self.points])

    def amplitudes(self, row) -> np.ndarray:
        """Return the displacement amplitudes (k,) [m] along the branch.

        The displacement is row @ modal coordinates; its amplitude is half its range.

        """
        return np.array([point.amplitude(row) for point in self.points])


def trace_over_frequency(
    modes, drive: SineDrive, group, frequencies, stability: bool = False, **numerics
) -> Branch:
    """Trace a branch of steady motions over the drive frequency at a constant drive amplitude.

    Parameters
    ----------
    modes : ModalBasis
    drive : SineDrive
    group : LawGroup, or what `point.make_group` takes
    frequencies : sequence of float
        First and last [Hz], between which the curve is followed through folds; or more than two,
        at each of which a point is solved from the one before.
    stability : bool, optional
        Whether multipliers are computed.
    **numerics
        Fields of `CurveNumerics`.

    Returns
    -------
    Branch
    """
    checked = _check_values(frequencies, "drive.frequency: a frequency response", "frequencies")
    drives = [replace(drive, omega=2 * np.pi * frequency) for frequency in checked]
    return _trace_branch("frequency", modes, drives, group, CurveNumerics(**numerics), stability)


def trace_over_level(
    modes, drive: SineDrive, group, accelerations, stability: bool = False, **numerics
) -> Branch:
    """Trace a branch of steady motions over the drive amplitude [m s-2] at a constant frequency.

    Parameters
    ----------
    modes, drive, group, stability, **numerics
        See `trace_over_frequency`.
    accelerations : sequence of float
        As `frequencies` there [m s-2].

    Returns
    -------
    Branch
    """
    checked = _check_values(
        accelerations, "drive.acceleration: a sweep of the drive level", "amplitudes"
    )
    drives = [replace(drive, acceleration=float(acceleration)) for acceleration in checked]
    return _trace_branch("level", modes, drives, group, CurveNumerics(**numerics), stability)


class CurveNumerics(NamedTuple):
    """Numerical settings for tracing a solution branch.

    - harmonics: number of harmonics, or None for as many as the tolerance needs
    - tolerance: relative error of each motion
    - start: initial guess, see `point.find_steady_motion`
    - longest: longest step of the arc length
    """

    harmonics: int | None = None
    tolerance: float = 1e-3
    start: Any = None
    longest: float = 0.05


def _check_values(parameter_values, subject: str, noun: str) -> np.ndarray:
    """Return drive amplitudes or frequencies as an array; raise PatchfemError unless all are positive."""
    values = np.asarray(parameter_values, float)
    if values.size < 2 or not (np.isfinite(values).all() and values.min() > 0):
        raise PatchfemError(f"{subject} needs two or more positive {noun}")
    return values


def _trace_branch(
    parameter: str, modes, drives, group, numerics: CurveNumerics, stability: bool
) -> Branch:
    """Trace a branch of steady motions through given drive values, and its stability if requested."""
    solve = _trace_curve if len(drives) == 2 else _solve_points
    branch = solve(modes, drives, make_group(modes, group), parameter, numerics)
    if not stability:
        return branch
    return replace(branch, points=tuple(add_stability(point, modes) for point in branch.points))


def _solve_points(modes, drives, group, parameter, numerics: CurveNumerics) -> Branch:
    """Find the motion at each drive value, starting from the motion at the previous value."""
    points = []
    last = numerics.start
    for drive in drives:
        last = find_steady_motion(modes, drive, group, numerics.harmonics, numerics.tolerance, last)
        points.append(last)
    return Branch(tuple(points), parameter)


def _trace_curve(modes, drives, group, parameter, numerics: CurveNumerics) -> Branch:
    """Trace a branch by arc-length continuation with the same number of harmonics at all points.

    The number is raised until the harmonics above it are negligible at all points.
    """
    harmonics, tolerance, start, max_step = numerics
    first = find_steady_motion(modes, drives[0], group, harmonics, tolerance, start)
    for h in [harmonics] if harmonics else [h for h in HARMONIC_COUNTS if h >= first.harmonics]:
        points, truncated, path, scale = _trace_with_harmonics(
            modes, drives, group, parameter, h, first, max_step
        )
        if harmonics or truncated <= tolerance / 4:
            return Branch(
                points,
                parameter,
                tuple(f / scale for f in path.folds),
                tuple(f / scale for f in path.crossings),
                path.ended,
            )
    raise NotConverged(
        f"harmonic balance with {HARMONIC_COUNTS[-1]} harmonics leaves out {truncated:.1e} of the motion, more than "
        f"the limit of {tolerance / 4:g}; raise the tolerance"
    )


def _trace_with_harmonics(modes, drives, group, parameter, h, first, max_step) -> tuple:
    """Trace a branch with h harmonics, and with enough samples per cycle for the largest amplitude.

    Returns the points, the largest fraction of a motion above h, the CurvePath and the unit of its
    parameter.
    """
    samples = max(first.samples // 2, group.samples or group.samples_for(h))
    is_frequency = parameter == "frequency"
    ends = [d.omega if is_frequency else d.acceleration for d in drives]
    for _ in range(3):
        balance = make_balance(modes, group, samples)
        x = change_harmonic_count(balance, first.coefficients, first.unknowns, first.harmonics, h)

        def evaluate_equations(v, p, balance=balance):
            """Evaluate the equations and their derivatives at a point of the curve."""
            if is_frequency:
                return differentiate_by_frequency(balance, v, p, drives[0].acceleration, h)
            return differentiate_by_level(balance, v, drives[0].omega, p, h)

        settings = PathSettings(first_step=max_step / 4, max_step=max_step)
        path = follow_curve(
            evaluate_equations, x, ends[0], (min(ends), max(ends)), ends[1] > ends[0], settings
        )
        key = "omega" if is_frequency else "acceleration"
        solved_points = [
            make_motion_from_unknowns(balance, v, replace(drives[0], **{key: float(p)}), h)
            for v, p in zip(path.x, path.p)
        ]
        amplitudes = np.max(
            [_find_amplitude(p.coefficients, h + 64) for p, _ in solved_points], axis=0
        )
        needed_samples = group.samples or group.samples_for(h, amplitudes)
        if needed_samples <= samples:
            break
        samples = needed_samples
    return (
        tuple(p for p, _ in solved_points),
        max(a for _, a in solved_points),
        path,
        2 * np.pi if is_frequency else 1.0,
    )


def _find_amplitude(coefficients, min_samples: int):
    """Return the amplitudes (...) of relative displacements from their harmonics (..., H + 1).

    The amplitude is half the range of equidistant samples of a cycle.

    """
    samples = evaluate_series(coefficients, 2 ** min_samples.bit_length())
    return np.ptp(samples, axis=-1) / 2


def measure_distance(first: SteadyMotion, second: SteadyMotion, width: float) -> float:
    """Return the distance between two points on a branch in scaled unknowns and frequency.

    Parameters
    ----------
    first, second : SteadyMotion
    width : float
        Frequency step [rad/s] that counts as 1.

    Returns
    -------
    float
    """
    return float(np.linalg.norm(_find_scaled_step(first, second, width)[0]))


def _find_scaled_step(first: SteadyMotion, second: SteadyMotion, width: float) -> tuple:
    """Return the scaled step (N + 1,) between two points on a branch, and the norm of the motion."""
    size = max(float(np.linalg.norm(first.unknowns)), float(np.linalg.norm(second.unknowns))) or 1.0
    return np.append(
        (second.unknowns - first.unknowns) / size, (second.omega - first.omega) / width
    ), size


def find_point_between(
    modes, drive, first: SteadyMotion, second: SteadyMotion, fraction: float, width: float
) -> SteadyMotion:
    """Find the point on a frequency branch at a given fraction of the step between two points.

    Newton's method corrects the linear interpolation perpendicular to the step, so folds are no obstacle.

    Parameters
    ----------
    modes, drive
    first, second : SteadyMotion
    fraction : float
        Fraction of the step.
    width : float
        See `measure_distance`.

    Returns
    -------
    SteadyMotion

    Raises
    ------
    NotConverged
        If Newton's method finds no motion near the interpolated one.
    """
    balance = make_balance(modes, first.group, first.base_samples)
    step, size = _find_scaled_step(first, second, width)
    h = first.harmonics
    length = float(np.linalg.norm(step))
    corrected = correct_point(
        lambda x, p: differentiate_by_frequency(balance, x, p, drive.acceleration, h),
        (first.unknowns + fraction * size * step[:-1], first.omega + fraction * width * step[-1]),
        step / length,
        Scales(size, width),
        NEWTON_TOL,
    )
    if corrected is None:
        raise NotConverged(
            "accuracy.method: no steady motion was found between two neighbouring points of the curve"
        )
    return make_motion_from_unknowns(
        balance, corrected.x, replace(drive, omega=float(corrected.p)), h
    )[0]


def find_branches(
    modes, drive: SineDrive, group, tolerance: float = 1e-3, stability: bool = True
) -> list:
    """Find coexisting steady motions at one drive, starting from all roots of the one-harmonic balance.

    Parameters
    ----------
    modes : ModalBasis
    drive : SineDrive
    group : LawGroup, or what `point.make_group` takes
    tolerance : float, optional
    stability : bool, optional
        Whether multipliers are computed.

    Returns
    -------
    list of SteadyMotion
        In increasing size. A motion that no such root leads to (an isola of a higher harmonic) is
        not found.
    """
    group = make_group(modes, group)
    motions = []
    for start in [
        None,
        *find_one_harmonic_roots(make_balance(modes, group, 512), drive.omega, drive.acceleration),
    ]:
        try:
            motion = find_steady_motion(modes, drive, group, None, tolerance, start)
        except NotConverged:
            continue
        size = max(np.abs(motion.coefficients).max(), 1e-300)
        if not any(
            _max_harmonic_difference(motion, old) < 10 * tolerance * size for old in motions
        ):
            motions.append(motion)
    if not motions:
        raise NotConverged(
            f"accuracy.method: no steady motion was found at {drive.omega / (2 * np.pi):.6g} Hz"
        )
    motions.sort(key=lambda p: float(np.linalg.norm(p.coefficients)))
    return [add_stability(p, modes) for p in motions] if stability else motions


def _max_harmonic_difference(a: SteadyMotion, b: SteadyMotion) -> float:
    k = min(a.coefficients.shape[1], b.coefficients.shape[1])
    return float(np.abs(a.coefficients[:, :k] - b.coefficients[:, :k]).max())


@dataclass(frozen=True, eq=False, slots=True)
class Backbone:
    """Backbone curve of a mode: frequency and damping ratio as functions of amplitude.

    - amplitude: (k,) amplitude of the coordinate of the mode [m]
    - frequency, damping: (k,) frequency [Hz] and damping ratio [1]
    - slide: (k,) amplitude of the slide of the first interface row [m]
    - loss: (k,) friction loss per cycle [J]
    """

    amplitude: np.ndarray
    frequency: np.ndarray
    damping: np.ndarray
    slide: np.ndarray
    loss: np.ndarray


def find_backbone(modes, group, amplitudes, mode: int = 0, harmonics: int = 9) -> Backbone:
    """Compute the backbone curve of a mode: frequency and damping ratio as functions of amplitude.

    See `harmonic.backbone` for the equations.

    Parameters
    ----------
    modes : ModalBasis
    group : LawGroup, or what `point.make_group` takes
    amplitudes : array_like
        (k,) increasing amplitudes of the coordinate of the mode [m].
    mode : int, optional
        Mode of the stuck contact from which the path starts.
    harmonics : int, optional

    Returns
    -------
    Backbone

    Raises
    ------
    PatchfemError
        If the amplitudes do not increase.
    """
    group = make_group(modes, group)
    checked_amplitudes = np.asarray(amplitudes, float)
    if (
        checked_amplitudes.size == 0
        or not np.isfinite(checked_amplitudes).all()
        or checked_amplitudes[0] <= 0
        or np.any(np.diff(checked_amplitudes) <= 0)
    ):
        raise PatchfemError("backbone: the amplitudes must be positive and in rising order")
    if not 0 <= mode < modes.omega.size:
        raise PatchfemError(
            f"backbone: there is no mode {mode}; the rig has {modes.omega.size} modes, counted from 0"
        )
    samples = group.samples or group.samples_for(
        harmonics, np.full(len(group.rows), checked_amplitudes[-1])
    )
    balance = make_balance(modes, group, samples)
    omega, shape = modes.compute_stuck_mode(group.rows, group.stiffness(), mode)
    motions = trace_free_motions(
        FreeBalance(balance, mode, harmonics, omega), checked_amplitudes, omega, shape
    )
    k = np.arange(harmonics + 1)
    loss = [np.pi * float(np.sum(k * (np.conj(f.slides) * f.forces).imag)) for f in motions]
    slide = [_find_amplitude(f.slides[0], harmonics + 128) for f in motions]
    return Backbone(
        checked_amplitudes,
        np.array([f.omega for f in motions]) / (2 * np.pi),
        np.array([f.zeta for f in motions]),
        np.array(slide),
        np.array(loss),
    )
