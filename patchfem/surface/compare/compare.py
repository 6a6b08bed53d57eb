"""Two traces or two areal scans, before and after: everything that tells them apart, in one frozen record."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core import PatchfemError, say
from ..areal import Areal
from ..files.read import read_surface
from ..profile import Profile, despiked, even
from ..quantity import SIDE, Quantity, around, refused
from ..roughness.spectrum import BAND
from ..scans.change import Change, changed
from . import depth as worn_depth
from .carried import Carried, carried, hidden_wear, outside, raised
from .depth import Worn
from .flanks import Flanks, flanks_of
from .place import CLEAR, Match
from .ratios import BEYOND, Size, at_step, bridged, likeness, loose, of_noise, ratio, scattered, size_along, size_of
from .registration import Registration, gain_of, register
from .rivals import BENT, flanks_differ, readings
from .same import Place, found_place
from .shallow import on_flanks, shallow_of
from .specks import without_specks
from .tracks import Tracks, beside_flanks, of_flanks, pieces_of, tracks_of

SHIFT = "shift: the point at x in the first trace (before wear) is at x + shift in the second trace (after wear)"
STRETCH = ("length of the second trace (after wear) divided by the length of the first trace for the same stretch of "
           "surface, found from the unworn valleys")
LOUD = 1.0  # mean square of the noise over that of the surface, from which a ratio is one of noise
TILT = "tilt of the second trace (after wear) relative to the first (before wear)"
AMPLITUDE = ("amplitude of a sine with the same mean square as the waves of 60 um to 110 um: value after wear divided "
             "by value before")
SLOPE = "root mean square slope between neighbouring samples: value after wear divided by value before"


@dataclass(frozen=True, eq=False)
class Comparison:
    """What `compared` found for one direction.

    before, after: Profile or Areal; direction: "x", "y" or ""; reference: what the worn depth counts from: "place",
    "flanks" or "" for nothing; match: the search for the same place, None for scans and where the shift was told;
    shift, stretch, tilt, worn_*, amplitude_ratio, slope_ratio, abbott: Quantity; sizes: `Size` before and after; notes:
    sentences; exchanged: whether material stands above the first trace and none is missing, or a place shows in the
    other order alone; tracks; carried: what carries the registration, None without one; hidden: what a wedge may hide;
    removed: heights missing or left out in each; mirrored, turned: whether one trace was, for the registration; gain:
    heights after over before where they differ by one factor, None where not. change: of two scans, place by place.
    visible [m]: depth from which a track would have been found where none is shown, None where that is not known;
    open: the readings that explain two traces alike, in a few words, "" where there is one.
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
    carried: Carried | None = None
    hidden: Quantity = field(default_factory=lambda: hidden_wear(None, None))
    removed: tuple = (0, 0)
    mirrored: bool = False
    turned: bool = False
    gain: float | None = None
    change: Change | None = None
    visible: float | None = None
    open: str = ""

    @property
    def values(self) -> dict:
        """Every `Quantity` by its name."""
        if isinstance(self.before, Areal):
            own = {} if self.change is None else {**self.change.values, **self.change.registration}
            if self.change is not None and self.change.track is not None and not self.change.track.why:
                own |= _named(self.change.track.values)
            return {**own, "amplitude_ratio": self.amplitude_ratio, "slope_ratio": self.slope_ratio}
        out = {"shift": self.shift, "worn_depth_max": self.worn.largest, "worn_depth_mean": self.worn.mean,
               "worn_area": self.worn.area, "amplitude_ratio": self.amplitude_ratio, "slope_ratio": self.slope_ratio,
               "tilt": self.tilt, "scale": self.stretch}
        if self.worn.extent is not None:
            names = (f"worn_{end}_{when}" for when in ("before", "after") for end in ("from", "to"))
            known = self.worn.extent.known
            out.update(zip(names, (*known.before, *known.after)))
            out |= {} if self.worn.within is None else {"worn_depth_within": self.worn.within}
        out |= _named(self.tracks.sizes)
        if isinstance(self.before, Profile):
            out["hidden_wear"] = self.hidden
        return out if self.abbott is None else {**out, "worn_depth_mean_from_abbott": self.abbott}


def compared(before: Profile, after: Profile, direction: str = "", band: tuple = BAND, shift: float | None = None,
             keep_spikes: bool = False, straight: bool = False) -> Comparison:
    """Compare two traces of a surface.

    Spikes, dropouts and dust are left out unless keep_spikes. Where valleys or parts of both traces agree
    beyond chance (`same`), as they are, mirrored or turned over, they are registered on each other (`registration`) and
    the worn depth is what is missing, where unworn parts or valleys carry that (`carried`). Else the worn depth counts
    from unworn flanks of the trace after (`flanks`), or is refused and the guess from the Abbott curves stands beside
    it. band [m]: waves of the amplitude ratio. shift [m]: where it is known, a place at x of the one is taken to stand
    at x + shift of the other, give or take half a wave. straight: the datum is known to be straight, so no bow is taken
    out. PatchfemError for traces that cannot show the band.
    """
    sides = (before, after) if keep_spikes else (despiked(before), despiked(after))
    place = found_place(*sides, shift, not straight)
    if place.found is not None and not keep_spikes:
        place = _without_specks(place, not straight)
    removed = tuple(int(one.missing.sum()) for one in (place.before, place.after))
    return _placed(place, direction, band, removed) if place.found is not None else \
        _flanked(_apart(place, direction, band, removed), straight, shift)


def _named(track) -> dict:
    """Sizes of a track by the names that a comparison has for them."""
    return {f"track_{name.removesuffix('_mean')}": one for name, one in track.items()}


def identical(before, after) -> bool:
    """Whether two surfaces have the same heights at the same places, as a file has with itself."""
    return type(before) is type(after) and all(
        np.array_equal(getattr(before, name), getattr(after, name), equal_nan=True) for name in "xyz"
        if hasattr(before, name))


def _without_specks(place: Place, bow: bool) -> Place:
    """The place again without what stands out of the difference as no surface does."""
    for _ in range(2):
        before, after = without_specks(place.found, place.before, place.after)
        if before is place.before and after is place.after:
            break
        try:
            found = register(before, after, place.found.shift, bow=bow)
        except PatchfemError:
            break
        place = place._replace(before=before, after=after, found=found)
    return place


def _placed(place: Place, direction: str, band: tuple, removed: tuple) -> Comparison:
    """The comparison of two traces of one place."""
    before, after, found = place.before, place.after, place.found
    if identical(before, after):  # but for round-off the fit finds no shift and no tilt
        found = replace(found, shift=0.0, slope=0.0)
    by, visible = carried(found), None
    opened, why = readings(found, by, before, after)
    if opened:
        by = by._replace(by="")
    elif not by.by and not raised(found):
        visible = shallow_of(found)
        if visible is not None and visible.span is not None:
            found, by = on_flanks(found, visible.span)
            opened, why = readings(found, by, before, after)
            by = by._replace(by="") if opened else by
    hidden = hidden_wear(found, by)
    notes, step = _steps(before, after)
    gain = gain_of(found) if not (by.by or raised(found)) else None
    notes += _told(found)
    worn, tracks = worn_depth.of_registration(found), Tracks(())
    if by.by:
        tracks = tracks_of(found, worn_depth.neighbours(found), band[1])
        worn = replace(worn, largest=_deepest(found, worn.largest, tracks.sizes.get("depth_floor")))
    else:
        worn = worn_depth.nowhere(
            why if opened else "no part of the traces is known to be unworn, so uniform, "
            "wedge-shaped or bow-shaped wear cannot be told from no wear", worn.deposited if raised(found) else 0.0)
    pieces = pieces_of(found, tracks, band[1])
    flat = pieces_of(found, tracks, band[1], True)
    by = outside(by, worn.extent)
    ratios, sizes = [], [tuple(_pooled(side, step, band) for side in zip(*one)) for one in (flat, pieces)]
    for name, text, alike, noise in zip(("amplitude", "slope"), (AMPLITUDE, SLOPE), _alike(flat, step, band),
                                        of_noise(sizes[0], float(np.sqrt(np.mean(found.scatter**2))), step, band)):
        one, other = (ratio(name, text, *pair[::-1], alike) for pair in sizes)
        off = abs(np.log(one.value / other.value)) if one.value and other.value else 0.0
        ratios.append(loose(one, float(np.hypot(np.hypot(BEYOND, noise), off))) if noise < LOUD else refused(
            "1", text, f"the noise of the measurement, {say(found.noise)} between the traces, has a larger {name} than "
                       "the surface, so this ratio tells nothing of the surface; measure with less noise, or smooth "
                       "both traces alike"))
    stretch = around(1 + found.stretch[0], found.stretch[1], "1", STRETCH) if np.isfinite(found.stretch[0]) \
        else refused("1", STRETCH, "too few heights are unworn")
    grew = not opened and worn.deposited > (worn.area.high or 0.0) and not (worn.mean.low or 0.0) > 0
    return Comparison(before, after, direction, "place", place.match, around(found.shift, found.errors[2], "m", SHIFT),
                      stretch, around(found.slope, found.errors[1], "rad", TILT), worn, *ratios, None, sizes[0], found,
                      None, tuple(notes), grew, tracks, by, hidden, removed, place.mirrored, place.turned, gain,
                      visible=None if visible is None or by.by or opened else visible.least, open=opened)


def _deepest(found: Registration, largest: Quantity, floor: Quantity | None) -> Quantity:
    """The largest worn depth, which is not less than the floor of a track: both are told with their errors."""
    if floor is None or (found.track is None and floor.value <= largest.value):
        return largest
    if found.track is not None:  # no single height stands out, only the floor does
        return floor._replace(text=worn_depth.MAX)
    return largest._replace(value=floor.value, low=min(largest.low, floor.value), high=max(largest.high, floor.high))


def _apart(place: Place, direction: str, band: tuple, removed: tuple) -> Comparison:
    """The comparison of two traces without a common place."""
    before, after, why = place.before, place.after, place.why
    notes, step = _steps(before, after)
    if place.order:
        why = "the two traces match only if the second is taken as the unworn one: material grew between the " \
              "measurements, or the two files are in the wrong order"
    flanks = flanks_of(before, after)
    if place.order and flanks is not None:
        notes.append(why)
    abbott = None if flanks is not None else worn_depth.abbott_estimate(before, after)
    sides = [[before], [after] if flanks is None else beside_flanks(after, flanks, band[1])]
    worn = worn_depth.of_flanks(flanks) if flanks is not None else worn_depth.nowhere(why if place.order else
        f"{why}; the second trace shows no track between unworn flanks either; a worn depth needs one of the two")
    sizes = tuple(_pooled(side, step, band) for side in sides)
    freedom = [[scattered(one, step, band) for one in side] for side in sides]
    sizes = tuple(one._replace(freedom=tuple(min(a, b) for a, b in zip(one.freedom, np.sum(each, axis=0))))
                  for one, each in zip(sizes, freedom))
    ratios = [ratio(name, text, sizes[1], sizes[0]) for name, text in (("amplitude", AMPLITUDE), ("slope", SLOPE))]
    blank = [refused(unit, text, why) for unit, text in (("m", SHIFT), ("1", STRETCH), ("rad", TILT))]
    return Comparison(before, after, direction, "" if flanks is None else "flanks", place.match, *blank, worn, *ratios,
                      abbott, sizes, None, flanks, tuple(notes), place.order,
                      of_flanks(flanks) if flanks is not None else Tracks(()), removed=removed)


def _flanked(one: Comparison, straight: bool, shift: float | None) -> Comparison:
    """The comparison without the depth below flanks which the first trace shows to be worn, at the shift [m] that is
    known or clear."""
    match = one.match
    if shift is None and match is not None and not match.repeats and match.clear > CLEAR:
        shift = match.shift
    if one.flanks is None or shift is None:
        return one
    why = flanks_differ(one.before, one.after, shift, one.flanks, straight)
    return one if not why else replace(one, reference="", worn=worn_depth.nowhere(why), tracks=Tracks(()),
                                       flanks=None, open="" if straight else BENT)


def _steps(before: Profile, after: Profile) -> tuple:
    """Notes of both traces, and the coarser of their steps [m]."""
    steps = [one.length / (one.x.size - 1) for one in (even(before), even(after))]
    notes = list(before.notes + after.notes)
    if max(steps) > 1.01 * min(steps):
        notes.append(f"samples lie {say(steps[0])} apart before wear and {say(steps[1])} apart after wear; slopes and "
                     f"amplitudes are computed at a step of {say(max(steps))}")
    return notes, max(steps)


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
    text = (f"the same stretch of surface is {1 + value:.5g} (+- {SIDE * error:.1g}) times as long in the second trace "
            "(after wear) as in the first")
    return [text + ("; this difference in length is corrected" if out else "; calibrate x of the instrument")]


def compared_scans(before: Areal, after: Areal, first: str = "x", keep_spikes: bool = False) -> list[Comparison]:
    """Compare two areal scans, place by place and by their waves in each direction: two `Comparison`, the first of
    which has the `Change`."""
    flat, found = tuple(map(bridged, (before, after))), changed(before, after, keep_spikes)
    notes = tuple(dict.fromkeys((*found.before.notes, *found.after.notes)))
    return [replace(_waves(before, after, flat, first), change=found, notes=notes, removed=found.removed),
            _waves(before, after, flat, "y" if first == "x" else "x")]


def _waves(before: Areal, after: Areal, flat: tuple, direction: str) -> Comparison:
    """The waves of two scans in one direction; flat: both as `bridged`."""
    why = "areal scans are compared point by point in x and y together"
    try:
        sizes = tuple(size_along(*one, direction) for one in flat)
        ratios = [ratio(part, text, *sizes[::-1]) for part, text in (("amplitude", AMPLITUDE), ("slope", SLOPE))]
    except PatchfemError as error:  # a scan too short for the waves of the band
        sizes, ratios = (), [refused("1", text, str(error)) for text in (AMPLITUDE, SLOPE)]
    blank = [refused(unit, text, why) for unit, text in (("m", SHIFT), ("1", STRETCH), ("rad", TILT))]
    return Comparison(before, after, direction, "", None, *blank, worn_depth.nowhere(why), *ratios, None, sizes)


def directions_of(parts: list) -> list:
    """Direction x against y, before and after: (when, amplitude ratio, slope ratio) each; nothing for one direction.

    Traces are read at the coarsest step of all of them, so that slopes compare.
    """
    if len(parts) < 2 or not all(one.sizes for one in parts):
        return []
    along = {one.direction: one for one in parts}
    sides = [(along["x"].before, along["y"].before), (along["x"].after, along["y"].after)]
    sizes = [(one, other) for one, other in zip(along["x"].sizes, along["y"].sizes)]
    if isinstance(parts[0].before, Profile):
        step = max(one.length / (one.x.size - 1) for pair in sides for one in map(even, pair))
        sizes = [tuple(size_of(one, step) for one in pair) for pair in sides]
    return [(when, *(ratio(part, f"{part} along x divided by that along y, "
                                 f"{when}", *pair) for part in ("amplitude", "slope")))
            for when, pair in zip(("before", "after"), sizes)]


def compared_files(paths: tuple, direction: str = "", units: tuple | None = None,
                   shift: float | None = None, keep_spikes: bool = False, datum: str = "") -> list[Comparison]:
    """One `Comparison` for each direction that the files show.

    paths: of the surface before and after, along one direction; two more for the other direction, of traces only. An
    areal scan shows both. direction: "x", "y" or "" for two traces of no told direction; with four files or a scan it
    is that of the first pair, x unless told. units: of x and of z as `read_surface` takes them. shift [m]: where it
    is known, as `compared` takes it, of two traces alone; keep_spikes as there. datum: "straight" where that of the
    traces is known to be, so that no bow is taken out. PatchfemError for another number of files, another direction, a
    trace beside a scan, four scans, a shift of other than two traces, another datum, and one of scans.
    """
    if datum not in ("", "straight"):
        raise PatchfemError(f"compare: datum {datum!r}: straight is needed, or nothing")
    if direction not in ("", "x", "y"):
        raise PatchfemError(f"compare: direction {direction!r}: x or y is needed")
    if len(paths) not in (2, 4):
        raise PatchfemError(f"compare: {len(paths)} files; two files are needed, or four: before and after along one "
                            "direction, then before and after along the other direction")
    files = [read_surface(path, units) for path in paths]
    scans = {isinstance(one, Areal) for one in files}
    if shift is not None and len(files) != 2:
        raise PatchfemError("compare: a shift needs exactly two traces; compare each direction separately")
    if len(scans) > 1 or (True in scans and len(files) == 4):
        raise PatchfemError("compare: two or four traces are needed, or two areal scans")
    if shift is not None and True in scans:
        raise PatchfemError("compare: a shift can be given only for traces; areal scans are registered automatically")
    if datum and True in scans:
        raise PatchfemError("compare: a datum can be given only for traces; the plane of areal scans is fitted")
    how = {"keep_spikes": keep_spikes, "straight": bool(datum)}
    if True in scans:
        return compared_scans(*files, direction or "x", keep_spikes)
    if len(files) == 2:
        return [compared(*files, direction, shift=shift, **how)]
    first = direction or "x"
    return [compared(*pair, along, **how) for pair, along in
            ((files[:2], first), (files[2:], "y" if first == "x" else "x"))]
