"""Two traces or two areal scans, before and after: everything that tells them apart, in one frozen record."""

from dataclasses import dataclass, field

import numpy as np

from ...core import PatchfemError, say
from ..areal import Areal
from ..profile import Profile
from ..roughness.filter import even
from ..roughness.spectrum import BAND
from . import depth as worn_depth
from .depth import Worn
from .extent import exchanged, grown
from .flanks import Flanks, flanks_of
from .place import Match
from .quantity import SIDE, Quantity, around, refused
from .ratios import Size, at_step, likeness, ratio, size_along, size_of
from .registration import Registration
from .same import placed, turned
from .tracks import Tracks, beside_flanks, pieces_of, tracks_of

SHIFT = "a place at x of the trace before stands at x + shift of the trace after"
STRETCH = "length of the trace after over that of the trace before, from their unworn valleys"
TILT = "slope of the trace after against the trace before"
AMPLITUDE = "amplitude of the sine with the mean square of the waves of 60 um to 110 um, after over before"
SLOPE = "root mean square slope between neighbouring samples, after over before"


@dataclass(frozen=True, eq=False)
class Comparison:
    """What `compared` found for one direction.

    before, after: Profile or Areal; direction: "x", "y" or ""; reference: what the worn depth counts from: "place",
    "flanks" or "" for nothing; match: the search for the same place, None for scans and where the shift was told;
    shift, stretch, tilt, worn_*, amplitude_ratio, slope_ratio, abbott: Quantity; sizes: `Size` before and after; notes:
    sentences; exchanged: whether the other order of the traces is the likelier one.
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
    tracks: Tracks = field(default=Tracks(()))

    @property
    def values(self) -> dict:
        """Every `Quantity` by its name."""
        out = {"shift": self.shift, "worn_depth_max": self.worn.largest, "worn_depth_mean": self.worn.mean,
               "worn_area": self.worn.area, "amplitude_ratio": self.amplitude_ratio, "slope_ratio": self.slope_ratio,
               "tilt": self.tilt, "scale": self.stretch}
        if self.worn.extent is not None:
            names = (f"worn_{end}_{when}" for when in ("before", "after") for end in ("from", "to"))
            out.update(zip(names, (*self.worn.extent.before, *self.worn.extent.after)))
        sizes = zip(("track_from", "track_to", "track_depth"), self.tracks[1:4])
        out.update((name, one) for name, one in sizes if one is not None)
        return out if self.abbott is None else {**out, "worn_depth_mean_from_abbott": self.abbott}


def compared(before: Profile | Areal, after: Profile | Areal, direction: str = "", band: tuple = BAND,
             shift: float | None = None) -> Comparison:
    """Compare two traces of a surface, or two areal scans of it in one direction.

    Where valleys or parts of both traces agree beyond chance (`same`), they are registered on each other
    (`registration`) and the worn depth is what is missing. Else the worn depth counts from unworn flanks of the trace
    after (`flanks`), or is refused and the guess from the Abbott curves stands beside it. band [m]: waves of the
    amplitude ratio. shift [m]: where it is known, a place at x of the one is taken to stand at x + shift of the other,
    give or take half a wave. PatchfemError for a trace beside a scan, a shift of scans, and traces that cannot show
    the band.
    """
    if isinstance(before, Areal) != isinstance(after, Areal):
        raise PatchfemError(f"{before.source} and {after.source}: a trace and an areal scan; two of a kind are wanted")
    if isinstance(before, Areal):
        if shift is not None:
            raise PatchfemError("compare: a shift is told for traces; areal scans are not laid on each other")
        return _scans(before, after, direction or "x", band)
    return _traces(before, after, direction, band, shift)


def _traces(before: Profile, after: Profile, direction: str, band: tuple, told: float | None) -> Comparison:
    steps = [one.length / (one.x.size - 1) for one in (even(before), even(after))]
    match, found, why, order = placed(before, after, told)
    notes, flanks, abbott, tracks = list(before.notes + after.notes), None, None, Tracks(())
    sides, alike = [[before], [after]], (0.0, 0.0)
    if max(steps) > 1.01 * min(steps):
        notes.append(f"samples lie {say(steps[0])} apart before and {say(steps[1])} after; slopes and amplitudes are "
                     f"read every {say(max(steps))}")
    if found is not None:
        tracks = tracks_of(found, worn_depth.neighbours(found), band[1])
        pieces = pieces_of(found, tracks, band[1])
        sides, alike = list(zip(*pieces)), _alike(pieces, max(steps), band)
        notes += _told(found)
        shift = around(found.shift, found.errors[2], "m", SHIFT)
        tilt = around(found.slope, found.errors[1], "rad", TILT)
        stretch = around(1 + found.stretch[0], found.stretch[1], "1", STRETCH) if np.isfinite(found.stretch[0]) \
            else refused("1", STRETCH, "too few heights are unworn")
        worn, reference = worn_depth.of_registration(found), "place"
        other = turned(before, after, found.shift)
        notes += grown(found, other, worn.area.value, worn.deposited)
        order = exchanged(found, other, worn.area, worn.deposited)
    else:
        if order:
            notes.append("taken the other way round, as wear of the trace after, the traces show a common place: are "
                         "the two files in the wrong order?")
        shift, tilt, stretch = (refused(unit, text, why) for unit, text in
                                (("m", SHIFT), ("rad", TILT), ("1", STRETCH)))
        flanks = flanks_of(before, after)
        abbott = None if flanks is not None else worn_depth.abbott_estimate(before, after)
        reference = "flanks" if flanks is not None else ""
        if flanks is not None:
            sides[1] = beside_flanks(after, flanks, band[1])
        worn = worn_depth.of_flanks(flanks) if flanks is not None else worn_depth.nowhere(
            why + ", and no unworn flanks stand beside a track; a worn depth wants one or the other")
    sizes = tuple(_pooled(side, max(steps), band) for side in sides)
    ratios = [ratio(part, text, sizes[1], sizes[0], one) for part, text, one in
              zip(("amplitude", "slope"), (AMPLITUDE, SLOPE), alike)]
    return Comparison(before, after, direction, reference, match, shift, stretch, tilt, worn, *ratios, abbott, sizes,
                      found, flanks, tuple(notes), order, tracks)


def _pooled(pieces: tuple, step: float, band: tuple) -> Size:
    """Size of the pieces of a trace: mean squares by their lengths; the spectrum is that of the longest."""
    sizes = [size_of(one, step, band) for one in pieces]
    share = _shares(pieces)
    squares = share @ np.array([(one.amplitude**2, one.slope**2) for one in sizes])
    freedom = tuple(float(each) for each in np.sum([one.freedom for one in sizes], axis=0))
    return Size(*(float(each) for each in np.sqrt(squares)), freedom, sizes[int(np.argmax(share))].spectrum)


def _alike(pieces: list, step: float, band: tuple) -> tuple:
    """Likeness of the registered pieces at an even step, by their lengths."""
    sides = [[at_step(one, step) for one in pair] for pair in pieces]
    found = np.array([likeness(first[0], second[0], first[1], band) for first, second in sides])
    return tuple(float(each) for each in _shares([pair[0] for pair in pieces]) @ found)


def _shares(pieces) -> np.ndarray:
    length = np.array([one.length for one in pieces])
    return length / length.sum()


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
