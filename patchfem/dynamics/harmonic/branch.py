"""Curves of steady motions: over frequency or drive level through folds, every motion at one drive, the backbone."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ...core import NotConverged, PatchfemError, SineDrive
from .backbone import FreeBalance, trace
from .continuation import GOAL, correct, follow
from .laws import synthesis
from .point import LADDER, Periodic, balance_of, by_level, by_omega, cut, group_of, plain, point
from .stability import with_stability
from .starts import one_harmonic


@dataclass(frozen=True, eq=False, slots=True)
class Branch:
    """Points in the order of the curve; parameter: "frequency" [Hz] or "level" [m s-2]; folds and crossings: its values
    there (crossings: another branch meets); ended: "end", "start" (back through where it came from), "points", "step",
    or "listed" for given values."""

    points: tuple
    parameter: str
    folds: tuple = ()
    crossings: tuple = ()
    ended: str = "listed"

    @property
    def values(self) -> np.ndarray:
        """The parameter at every point (k,), [Hz] or [m s-2]."""
        return np.array(
            [
                p.omega / (2 * np.pi) if self.parameter == "frequency" else p.level
                for p in self.points
            ]
        )

    def amplitudes(self, row) -> np.ndarray:
        """(max - min)/2 [m] of row @ coordinates at every point (k,)."""
        return np.array([p.amplitude(row) for p in self.points])


def response(modes, drive: SineDrive, group, frequencies, stability: bool = False, **how) -> Branch:
    """Steady motions over frequency [Hz] at the drive's amplitude.

    frequencies: (first, last), followed from the first through folds, or more than two: a point at each, started from
    the one before. stability: multipliers at every point. how: `How`.
    """
    drives = [
        replace(drive, omega=2 * np.pi * f)
        for f in _values(frequencies, "drive.frequency: a frequency response", "frequencies")
    ]
    return _along("frequency", modes, drives, group, How(**how), stability)


def levels(modes, drive: SineDrive, group, accelerations, stability: bool = False, **how) -> Branch:
    """Steady motions over the drive's amplitude [m s-2] at its frequency; arguments as in `response`."""
    drives = [
        replace(drive, acceleration=float(a))
        for a in _values(
            accelerations, "drive.acceleration: a sweep of the drive level", "amplitudes"
        )
    ]
    return _along("level", modes, drives, group, How(**how), stability)


class How(NamedTuple):
    """harmonics: exactly so many, None: as many as tolerance wants; start: as of `point`; longest: step of the arc."""

    harmonics: int | None = None
    tolerance: float = 1e-3
    start: Any = None
    longest: float = 0.05


def _values(given, what: str, noun: str) -> np.ndarray:
    values = np.asarray(given, float)
    if values.size < 2 or not (np.isfinite(values).all() and values.min() > 0):
        raise PatchfemError(f"{what} needs two or more positive {noun}")
    return values


def _along(parameter: str, modes, drives, group, how: How, stability: bool) -> Branch:
    found = (_curve if len(drives) == 2 else _listed)(
        modes, drives, group_of(modes, group), parameter, how
    )
    return (
        replace(found, points=tuple(with_stability(p, modes) for p in found.points))
        if stability
        else found
    )


def _listed(modes, drives, group, parameter, how: How) -> Branch:
    points = []
    last = how.start
    for drive in drives:
        last = point(modes, drive, group, how.harmonics, how.tolerance, last)
        points.append(last)
    return Branch(tuple(points), parameter)


def _curve(modes, drives, group, parameter, how: How) -> Branch:
    """By arc length with as many harmonics everywhere; more where what follows above them is not small."""
    harmonics, tolerance, start, longest = how
    first = point(modes, drives[0], group, harmonics, tolerance, start)
    for h in [harmonics] if harmonics else [h for h in LADDER if h >= first.harmonics]:
        points, above, path, scale = _followed(modes, drives, group, parameter, h, first, longest)
        if harmonics or above <= tolerance / 4:
            return Branch(
                points,
                parameter,
                tuple(f / scale for f in path.folds),
                tuple(f / scale for f in path.crossings),
                path.ended,
            )
    raise NotConverged(
        f"harmonic balance with {LADDER[-1]} harmonics leaves out {above:.1e} of the motion, more than "
        f"the limit of {tolerance / 4:g}; raise the tolerance"
    )


def _followed(modes, drives, group, parameter, h, first, longest) -> tuple:
    """(points, largest share of the motion above h, Path, unit) with enough samples for the widest slide."""
    samples = max(first.samples // 2, group.samples or group.samples_for(h))
    frequency = parameter == "frequency"
    ends = [d.omega if frequency else d.acceleration for d in drives]
    for _ in range(3):
        balance = balance_of(modes, group, samples)
        x = cut(balance, first.coefficients, first.unknowns, first.harmonics, h)

        def system(v, p, balance=balance):
            if frequency:
                return by_omega(balance, v, p, drives[0].acceleration, h)
            return by_level(balance, v, drives[0].omega, p, h)

        path = follow(
            system, x, ends[0], (min(ends), max(ends)), ends[1] > ends[0], longest / 4, longest
        )
        made = [
            plain(
                balance,
                v,
                replace(drives[0], **{"omega" if frequency else "acceleration": float(p)}),
                h,
            )
            for v, p in zip(path.x, path.p)
        ]
        widest = np.max(
            [
                np.ptp(synthesis(p.coefficients, 2 ** (h + 64).bit_length()), axis=1) / 2
                for p, _ in made
            ],
            axis=0,
        )
        want = group.samples or group.samples_for(h, widest)
        if want <= samples:
            break
        samples = want
    return tuple(p for p, _ in made), max(a for _, a in made), path, 2 * np.pi if frequency else 1.0


def way(one: Periodic, other: Periodic, width: float) -> float:
    """Way from one Periodic of a branch to another, over the size of the motion and the `width` [rad/s]."""
    return float(np.linalg.norm(_step(one, other, width)[0]))


def _step(one: Periodic, other: Periodic, width: float) -> tuple:
    """((N + 1,) from the unknowns and omega of one Periodic to those of another, over their size; that size)."""
    size = max(float(np.linalg.norm(one.unknowns)), float(np.linalg.norm(other.unknowns))) or 1.0
    return np.append(
        (other.unknowns - one.unknowns) / size, (other.omega - one.omega) / width
    ), size


def between(modes, drive, one: Periodic, other: Periodic, share: float, width: float) -> Periodic:
    """The Periodic of a branch over frequency at a share of the way from one of its points to another.

    Newton goes across the straight line that joins them, so folds are no obstacle; width: as of `way`. NotConverged
    where it leads elsewhere.
    """
    balance = balance_of(modes, one.group, one.base_samples)
    step, size = _step(one, other, width)
    h = one.harmonics
    length = float(np.linalg.norm(step))
    found = correct(
        lambda x, p: by_omega(balance, x, p, drive.acceleration, h),
        one.unknowns + share * size * step[:-1],
        one.omega + share * width * step[-1],
        step[:-1] / length,
        step[-1] / length,
        size,
        width,
        GOAL,
    )
    if found is None:
        raise NotConverged(
            "accuracy.method: no steady motion was found between two neighbouring points of the curve"
        )
    return plain(balance, found[0], replace(drive, omega=float(found[1])), h)[0]


def branches(
    modes, drive: SineDrive, group, tolerance: float = 1e-3, stability: bool = True
) -> list:
    """Every steady motion at a drive that starts from the roots of the one-harmonic balance reach, smallest first.

    The one-harmonic balance is scanned over the amplitude along the free linear motion: exact for one row, a start for
    more. A motion that no such root leads to (an isola of a higher harmonic) is not found.
    """
    group = group_of(modes, group)
    found = []
    for start in [
        None,
        *one_harmonic(balance_of(modes, group, 512), drive.omega, drive.acceleration),
    ]:
        try:
            new = point(modes, drive, group, None, tolerance, start)
        except NotConverged:
            continue
        size = max(np.abs(new.coefficients).max(), 1e-300)
        if not any(_apart(new, old) < 10 * tolerance * size for old in found):
            found.append(new)
    if not found:
        raise NotConverged(
            f"accuracy.method: no steady motion was found at {drive.omega / (2 * np.pi):.6g} Hz"
        )
    found.sort(key=lambda p: float(np.linalg.norm(p.coefficients)))
    return [with_stability(p, modes) for p in found] if stability else found


def _apart(a: Periodic, b: Periodic) -> float:
    k = min(a.coefficients.shape[1], b.coefficients.shape[1])
    return float(np.abs(a.coefficients[:, :k] - b.coefficients[:, :k]).max())


@dataclass(frozen=True, eq=False, slots=True)
class Backbone:
    """amplitude (k,) [m] of the mode's coordinate, frequency (k,) [Hz], damping (k,) [1], slide (k,) [m]: amplitude of
    the first row, loss (k,) [J] of the contact per cycle."""

    amplitude: np.ndarray
    frequency: np.ndarray
    damping: np.ndarray
    slide: np.ndarray
    loss: np.ndarray


def backbone(modes, group, amplitudes, mode: int = 0, harmonics: int = 9) -> Backbone:
    """Frequency and damping of a mode over its amplitude (k,) [m], rising, as dynamics.backbone defines them.

    It starts from the mode of the held contact of the same number. PatchfemError for amplitudes that do not rise.
    """
    group = group_of(modes, group)
    wanted = np.asarray(amplitudes, float)
    if (
        wanted.size == 0
        or not np.isfinite(wanted).all()
        or wanted[0] <= 0
        or np.any(np.diff(wanted) <= 0)
    ):
        raise PatchfemError("backbone: the amplitudes must be positive and in rising order")
    if not 0 <= mode < modes.omega.size:
        raise PatchfemError(
            f"backbone: there is no mode {mode}; the rig has {modes.omega.size} modes, counted from 0"
        )
    samples = group.samples or group.samples_for(harmonics, np.full(len(group.rows), wanted[-1]))
    balance = balance_of(modes, group, samples)
    omega, shape = modes.stuck_mode(group.rows, group.stiffness(), mode)
    found = trace(FreeBalance(balance, mode, harmonics, omega), wanted, omega, shape)
    k = np.arange(harmonics + 1)
    loss = [np.pi * float(np.sum(k * (np.conj(f.slides) * f.forces).imag)) for f in found]
    slide = [np.ptp(synthesis(f.slides[0], 2 ** (harmonics + 128).bit_length())) / 2 for f in found]
    return Backbone(
        wanted,
        np.array([f.omega for f in found]) / (2 * np.pi),
        np.array([f.zeta for f in found]),
        np.array(slide),
        np.array(loss),
    )
