"""Two traces or two areal scans, before and after: everything that tells them apart, in one frozen record."""

from dataclasses import dataclass, field

import numpy as np

from ...core import PatchfemError, frozen_array, say
from ..areal import Areal
from ..profile import Profile
from ..roughness.filter import even
from ..roughness.spectrum import BAND
from . import depth as worn_depth
from .depth import Worn
from .extent import exchanged, grown
from .flanks import Flanks, flanks_of
from .place import CLEAR, Match, matched
from .quantity import SIDE, Quantity, around, refused
from .ratios import at_step, likeness, ratio, size_along, size_of
from .registration import Registration, register

# Noise of the registration over the root mean square height, and likeness that goes with it: where valleys agree to
# 2 %, less likeness will do. A noise above 10 % is no noise: it is wear of the valleys too.
ENOUGH = ((0.1, CLEAR), (0.02, 2.5))
SHARE = 0.15  # of the heights, at least, unworn

SHIFT = "a place at x of the trace before stands at x + shift of the trace after"
STRETCH = "length of the trace after over that of the trace before, from their unworn valleys"
TILT = "slope of the trace after against the trace before"
AMPLITUDE = "amplitude of the sine with the mean square of the waves of 60 um to 110 um, after over before"
SLOPE = "root mean square slope between neighbouring samples, after over before"


@dataclass(frozen=True, eq=False)
class Comparison:
    """What `compared` found for one direction.

    before, after: Profile or Areal; direction: "x", "y" or ""; reference: what the worn depth counts from: "place",
    "flanks" or "" for nothing; match: the search for the same place, None for scans; shift, stretch, tilt, worn_*,
    amplitude_ratio, slope_ratio, abbott: Quantity; sizes: `Size` before and after; notes: sentences; exchanged: whether
    the other order of the traces is the likelier one.
    """

    before: Profile | Areal
    after: Profile | Areal
    direction: str
    reference: str
    match: Match | None
    shift: Quantity
    stretch: Quantity
    tilt: Quantity
    worn: Worn
    amplitude_ratio: Quantity
    slope_ratio: Quantity
    abbott: Quantity | None
    sizes: tuple
    registration: Registration | None = None
    flanks: Flanks | None = None
    notes: tuple = field(default=())
    exchanged: bool = False

    @property
    def values(self) -> dict:
        """Every `Quantity` by its name."""
        out = {"shift": self.shift, "worn_depth_max": self.worn.largest, "worn_depth_mean": self.worn.mean,
               "worn_area": self.worn.area, "amplitude_ratio": self.amplitude_ratio, "slope_ratio": self.slope_ratio,
               "tilt": self.tilt, "scale": self.stretch}
        if self.worn.extent is not None:
            names = (f"worn_{end}_{when}" for when in ("before", "after") for end in ("from", "to"))
            out.update(zip(names, (*self.worn.extent.before, *self.worn.extent.after)))
        return out if self.abbott is None else {**out, "worn_depth_mean_from_abbott": self.abbott}


def compared(before: Profile | Areal, after: Profile | Areal, direction: str = "", band: tuple = BAND) -> Comparison:
    """Compare two traces of a surface, or two areal scans of it in one direction.

    Where the valleys of both traces agree beyond chance, they are registered on each other (`registration`) and the
    worn depth is what is missing. Else the worn depth counts from unworn flanks of the trace after (`flanks`), or is
    refused and the guess from the Abbott curves stands beside it. band [m]: waves of the amplitude ratio. PatchfemError
    for a trace beside a scan, and traces that cannot show the band.
    """
    if isinstance(before, Areal) != isinstance(after, Areal):
        raise PatchfemError(f"{before.source} and {after.source}: a trace and an areal scan; two of a kind are wanted")
    if isinstance(before, Areal):
        return _scans(before, after, direction or "x", band)
    return _traces(before, after, direction, band)


def same_place(before: Profile, after: Profile) -> tuple:
    """The search for the same place, and the registration where it is the same, else None."""
    match = matched(before, after)
    if match.repeats or not match.clear > min(clear for _, clear in ENOUGH):
        return match, None
    try:
        found = register(before, after, match.shift)
    except PatchfemError:
        return match, None
    return match, found if _same(found, match) else None


def _same(found: Registration, match: Match) -> bool:
    """Whether the unworn heights of a registration are so many and so alike that the place is the same."""
    height = float(np.std(found.first - np.polyval(np.polyfit(found.x, found.first, 1), found.x)))
    same = any(found.noise < noise * height and match.clear > clear for noise, clear in ENOUGH)
    return same and bool(found.used.mean() > SHARE)


def _turned(before: Profile, after: Profile, shift: float) -> Registration | None:
    """The first trace registered on the second one."""
    try:
        return register(after, before, -shift)
    except PatchfemError:
        return None


def _likelier(before: Profile, after: Profile, shift: float, other: Registration) -> bool:
    """Whether the other order is likelier for traces that are too noisy for a place: a worn floor has a place too."""
    try:
        found = register(before, after, shift)
    except PatchfemError:
        return True
    worn = worn_depth.of_registration(found)
    return exchanged(found, other, worn.area, worn.deposited)


def _traces(before: Profile, after: Profile, direction: str, band: tuple) -> Comparison:
    steps = [one.length / (one.x.size - 1) for one in (even(before), even(after))]
    match, found = same_place(before, after)
    notes, alike, flanks, abbott = list(before.notes + after.notes), (0.0, 0.0), None, None
    if max(steps) > 1.01 * min(steps):
        notes.append(f"samples lie {say(steps[0])} apart before and {say(steps[1])} after; slopes and amplitudes are "
                     f"read every {say(max(steps))}")
    if found is not None:
        alike = _alike(found, max(steps), band)
        notes += _told(found)
        shift = around(found.shift, found.errors[2], "m", SHIFT)
        tilt = around(found.slope, found.errors[1], "rad", TILT)
        stretch = around(1 + found.stretch[0], found.stretch[1], "1", STRETCH) if np.isfinite(found.stretch[0]) \
            else refused("1", STRETCH, "too few heights are unworn")
        worn, reference = worn_depth.of_registration(found), "place"
        other = _turned(before, after, found.shift)
        notes += grown(found, other, worn.area.value, worn.deposited)
        order = exchanged(found, other, worn.area, worn.deposited)
    else:
        why = (f"the surface repeats itself: shifts apart from each other fit alike, {match.likeness:.3f} and "
               f"{match.second:.3f}") if match.repeats and match.clear > CLEAR else \
            f"the traces show no common place: chance brings their valleys the likeness of {match.likeness:.2f} too"
        other = _turned(before, after, match.shift) if match.clear > CLEAR and not match.repeats else None
        order = other is not None and _same(other, match) and _likelier(before, after, match.shift, other)
        if order:
            notes.append("taken the other way round, as wear of the trace after, the traces show a common place: are "
                         "the two files in the wrong order?")
        shift, tilt, stretch = (refused(unit, text, why) for unit, text in
                                (("m", SHIFT), ("rad", TILT), ("1", STRETCH)))
        flanks = flanks_of(before, after)
        abbott = None if flanks is not None else worn_depth.abbott_estimate(before, after)
        reference = "flanks" if flanks is not None else ""
        worn = worn_depth.of_flanks(flanks) if flanks is not None else worn_depth.nowhere(
            why + ", and no unworn flanks stand beside a track; a worn depth wants one or the other")
    pair = (before, after) if found is None else _common(found)
    sizes = tuple(size_of(one, max(steps), band) for one in pair)
    ratios = [ratio(part, text, sizes[1], sizes[0], one) for part, text, one in
              zip(("amplitude", "slope"), (AMPLITUDE, SLOPE), alike)]
    return Comparison(before, after, direction, reference, match, shift, stretch, tilt, worn, *ratios, abbott, sizes,
                      found, flanks, tuple(notes), order)


def _alike(found: Registration, step: float, band: tuple) -> tuple:
    """Likeness of the registered traces at an even step."""
    pair = [at_step(one, step) for one in _common(found)]
    return likeness(pair[0][0], pair[1][0], pair[0][1], band)


def _common(found: Registration) -> tuple:
    """Both traces over their common part, the second laid on the first."""
    return tuple(Profile(found.x, frozen_array(z), "the common part") for z in (found.first, found.first - found.rest))


def _told(found: Registration) -> list:
    value, error, out = found.stretch
    if not np.isfinite(value) or abs(value) < max(SIDE * 2 * error, 1e-4):
        return []
    text = f"the trace after is {1 + value:.5g} times as long as the same place before (+- {SIDE * error:.1g})"
    return [text + ("; this is taken out" if out else "; calibrate x of the instrument")]


def _scans(before: Areal, after: Areal, direction: str, band: tuple) -> Comparison:
    why = "a worn depth is taken from traces; write one row of each scan to a file with the header `x [um],z [um]`"
    sizes = tuple(size_along(one, direction, band) for one in (before, after))
    ratios = [ratio(part, text, sizes[1], sizes[0]) for part, text in (("amplitude", AMPLITUDE), ("slope", SLOPE))]
    blank = [refused(unit, text, why) for unit, text in (("m", SHIFT), ("1", STRETCH), ("rad", TILT))]
    return Comparison(before, after, direction, "", None, *blank, worn_depth.nowhere(why), *ratios, None, sizes,
                      notes=before.notes + after.notes)


def directions_of(parts: list) -> list:
    """Direction x against y, before and after: (when, amplitude ratio, slope ratio) each; nothing for one direction.

    Traces are read at the coarsest step of all of them, so that slopes compare.
    """
    if len(parts) < 2:
        return []
    along = {one.direction: one for one in parts}
    sides = [(along["x"].before, along["y"].before), (along["x"].after, along["y"].after)]
    sizes = [(one, other) for one, other in zip(along["x"].sizes, along["y"].sizes)]
    if isinstance(parts[0].before, Profile):
        step = max(one.length / (one.x.size - 1) for pair in sides for one in map(even, pair))
        sizes = [tuple(size_of(one, step) for one in pair) for pair in sides]
    return [(when, *(ratio(part, f"{part} along x over along y, {when}", *pair) for part in ("amplitude", "slope")))
            for when, pair in zip(("before", "after"), sizes)]
