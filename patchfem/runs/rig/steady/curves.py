"""Points of a curve of steady motions as columns, and the levels of a drive as the table that a march makes of them."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ....core import NotConverged, Outcome, SineDrive
from ....dynamics.curve_points import adapted
from ....response.levels import KEPT, Level
from ..solution import gauged

# column of a curve -> measure
SHOWN = {
    "amplitude": "relative_displacement_amplitude",
    "acceleration_peak": "absolute_acceleration_peak",
    "acceleration_fundamental": "absolute_acceleration_fundamental",
    "acceleration_distortion": "acceleration_distortion",
}
READ = 1e-9  # relative error of what an exact engine reads off a motion that it is given
LAST = 1e-12  # of the first harmonic: round-off of the third
POINTS = 121  # of a curve over frequency, before its bends ask for more
# of a peak, down to which its neighbourhood reaches and above which no other is; of
FALLEN, NARROW, FEW = (
    0.8,
    0.75,
    7,
)
# a whole curve, a neighbourhood that is worth it; points with which its curve begins
SHARE = 0.01  # by which straight lines between points of a curve may miss it


class Shown(NamedTuple):
    """A point of a curve: its sine, values and errors by measure name (none where no bounded motion is), regime,
    largest |Floquet multiplier|, whether a disturbance dies out, outcome, and a start for a motion nearby."""

    drive: SineDrive
    values: dict
    errors: dict
    regime: str
    multiplier: float
    stable: bool
    outcome: Outcome
    near: Any = None

    @property
    def level(self) -> Level:
        """The point as a level of the drive; without a bounded motion its values are NaN."""
        values = (
            {name: self.values.get(name) for name in KEPT}
            if self.values
            else {SHOWN["amplitude"]: np.nan}
        )
        kept = {name: value for name, value in values.items() if value is not None}
        errors = {name: self.errors[name] for name in kept if name in self.errors}
        return Level(
            self.drive.acceleration,
            self.outcome is Outcome.STUCK,
            kept,
            errors,
            outcome=str(self.outcome),
        )


def exact_errors(values: dict, left: float) -> dict:
    """Errors by name of what is read off a motion that closes to the relative error `left`."""
    return {
        name: abs(v) * (READ + left) + LAST * (name == "acceleration_distortion")
        for name, v in values.items()
        if v is not None
    }


def unlasting(multipliers) -> str:
    """The sentence on a steady motion that does not last; multipliers: Floquet's (m,)."""
    size = np.abs(multipliers).max()
    return (
        f"the steady motion that was found is unstable: a disturbance grows by the factor {size:.3g} per cycle; "
        'use accuracy.method = "march"'
    )


def curve_point(drive, raw, near=None) -> Shown:
    """The Solution of a steady motion as a point of a curve."""
    size = float(np.abs(np.asarray(raw.extra["multipliers"])).max(initial=0.0))
    bounded = raw.outcome not in (Outcome.GROWS, Outcome.LEAVES_GROOVES, Outcome.NOT_CONVERGED)
    return Shown(
        drive,
        raw.values if bounded else {},
        raw.errors if bounded else {},
        raw.extra["regime"],
        size,
        "unstable" not in raw.extra["regime"] and bounded,
        raw.outcome,
        near,
    )


def lost(drive) -> Shown:
    """A point at which no steady motion was found."""
    return Shown(drive, {}, {}, "not found", np.nan, False, Outcome.NOT_CONVERGED)


class Followed:
    """Curves over frequency whose points `shown` finds at any frequency; leaves: as of `top.highest`."""

    leaves = 1e-2, 0.1

    def apart(self, one: Shown, other: Shown) -> float:
        """Way [rad/s] along the curve from one of its points to another."""
        return abs(other.drive.omega - one.drive.omega)

    def between(self, one: Shown, other: Shown, share: float) -> Shown:
        """The point of the curve at a share of the way from one of its points to another."""
        omega = one.drive.omega + share * (other.drive.omega - one.drive.omega)
        return self.shown(replace(one.drive, omega=omega), one.near)


def traced(modes, drive, find) -> list:
    """Points of the curve of a sweep. find(sine, near) -> Shown; near: the start that the point before gives, or None.

    POINTS frequencies and those of the modes are where the curve begins; straight lines between its points miss it by
    SHARE at most.
    """

    def found(frequency, before):
        one = find(
            SineDrive(drive.acceleration, 2 * np.pi * frequency, drive.moving),
            before and before[1].near,
        )
        return one.values.get(SHOWN["amplitude"], np.nan), one

    return [one for _, one in adapted(found, starts_of(modes, drive), SHARE)[1]]


def starts_of(modes, drive) -> np.ndarray:
    """Frequencies [Hz] from end to end of a sweep with which its curve begins: POINTS of them, and those of the modes
    between, where a peak may be narrower than their spacing."""
    space = np.geomspace if drive.logarithmic else np.linspace
    ends, own = sorted((drive.low, drive.high)), modes.omega / (2 * np.pi)
    places = np.union1d(
        space(*ends, drive.starts or POINTS), own[(own > ends[0]) & (own < ends[1])]
    )
    places = places[np.append(True, np.diff(places) > 1e-9 * places[1:])]
    return places if drive.low < drive.high else places[::-1]


def around_the_top(drive, curve: dict, at: float):
    """A Sweep over the neighbourhood of the largest amplitude of a curve, at a frequency `at` [Hz], for a run that
    checks it; curve: columns of `curve_columns`. None where another peak is nearly as high, or the curve is short.

    It reaches to where the curve has fallen to FALLEN of the largest amplitude, and a quarter of that way beyond.
    """
    order = np.argsort(curve["frequency"], kind="stable")
    places, heights = curve["frequency"][order], np.nan_to_num(curve["amplitude"][order])
    best = int(np.argmin(np.abs(places - at)))
    low = heights < FALLEN * heights[best]
    before, after = np.flatnonzero(low[:best]), np.flatnonzero(low[best:])
    first, last = (
        (before[-1] if before.size else 0),
        (best + after[0] if after.size else len(places) - 1),
    )
    outside = np.delete(heights, slice(first, last + 1))
    if heights[best] <= 0 or outside.max(initial=0.0) > FALLEN * heights[best]:
        return None
    a, b = places[first], places[last]
    ends = np.clip([a - (b - a) / 4, b + (b - a) / 4], places[0], places[-1])
    if not 0 < ends[1] - ends[0] < NARROW * (places[-1] - places[0]):
        return None
    low, high = ends if drive.low < drive.high else ends[::-1]
    return replace(drive, low=float(low), high=float(high), starts=FEW)


def largest_of(points) -> int:
    """Number of the point with the largest amplitude, among those that are stable where any is."""
    sizes = np.array([one.values.get(SHOWN["amplitude"], -1.0) for one in points])
    lasting = np.array([one.stable for one in points])
    return int(np.argmax(np.where(lasting | ~lasting.any(), sizes, -2.0)))


def curve_columns(points, folds=()) -> dict:
    """Columns (c,) of a curve by name: frequency [Hz], level [m s-2], regime, multiplier, and each of SHOWN with its
    error; NaN where no bounded motion is. folds: where it turns back."""
    out = {
        "frequency": np.array([one.drive.omega / (2 * np.pi) for one in points]),
        "level": np.array([one.drive.acceleration for one in points]),
    }
    for column, name in SHOWN.items():
        out[column] = np.array([one.values.get(name, np.nan) for one in points])
        out[f"{column}_error"] = np.array([one.errors.get(name, np.nan) for one in points])
    return out | {
        "regime": np.array([one.regime for one in points]),
        "multiplier": np.array([one.multiplier for one in points]),
        "folds": np.array(folds),
    }


def motion_at_levels(finder, drive):
    """The Solution of the largest of the levels of a drive, each found from the one before it as a rig comes to it,
    with the curve of them all, the Level of each and a probe as `levels.onset` asks.

    A level without a steady motion is kept as not converged and said; NotConverged where all are.
    """
    points, said, best = [], [], None
    for part in drive.segments:
        sine = SineDrive(part.amplitude, part.omega, drive.moving)
        near = points[-1].near if points and points[-1].stable else None
        try:
            raw, near = finder.point(sine, near)
        except NotConverged as why:
            if finder.tries_another:
                raise
            points.append(lost(sine))
            said.append(why)
            continue
        points.append(curve_point(sine, gauged(finder.model, raw), near))
        if best is None or largest_of(points) == len(points) - 1:
            best = raw, sine
        said += [raw.message] if raw.message else []
    if best is None:
        raise said[0]  # no level has a motion

    def probe(number: int, level: float) -> Level:
        sine = SineDrive(level, drive.segments[0].omega, drive.moving)
        return finder.shown(sine, points[number].near if number >= 0 else None).level

    lost_ones = f"no steady motion was found at {len(said)} of {len(points)} drive levels; at the first of them: "
    notes = tuple(f"{lost_ones}{one}" for one in said[:1])
    return replace(
        best[0],
        extra=best[0].extra | {"curve": curve_columns(points), "at": best[1]},
        probe=probe,
        levels=tuple(one.level for one in points),
        notes=(*best[0].notes, *notes),
    )
