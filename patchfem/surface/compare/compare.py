"""Two traces or two areal scans, before and after: everything that tells them apart, in one frozen record."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core import PatchfemError, frozen_array, say
from ..areal import Areal
from ..files.read import read_surface
from ..profile import Profile, despiked, even
from ..quantity import SIDE, Quantity, around, refused
from ..roughness.spectrum import BAND
from ..scans.change import Change, compare_scans
from .alignment import Alignment, align
from .flanks import Flanks, flanks_of
from .gain import find_gain
from .model import Parameter
from .place import CLEAR, Match
from .ratios import BEYOND, Size, at_step, bridged, likeness, loose, of_noise, ratio, scattered, size_along, size_of
from .readings import BENT, find_readings, find_worn_flanks
from .reference import Reference, cut_at_wear, find_reference, has_grown, limit_hidden_wear
from .same import Place, found_place
from .specks import without_specks
from .worn import (
    Tracks,
    Worn,
    beside_flanks,
    measure_tracks,
    measure_worn,
    pieces_of,
    section_of,
    tracks_of_flanks,
    unknown_worn,
    worn_of_flanks,
)

SHIFT = "shift: the point at x in the first trace (before wear) is at x + shift in the second trace (after wear)"
STRETCH = ("length of the second trace (after wear) divided by the length of the first trace for the same stretch of "
           "surface, found from the unworn valleys")
MIN_STRETCH = 1e-4  # difference in length that is told, however well it is known
LOUD = 1.0  # mean square of the noise over that of the surface, from which a ratio is one of noise
TILT = "tilt of the second trace (after wear) relative to the first (before wear)"
AMPLITUDE = ("amplitude of a sine with the same mean square as the waves of 60 um to 110 um: value after wear divided "
             "by value before")
SLOPE = "root mean square slope between neighbouring samples: value after wear divided by value before"


@dataclass(frozen=True, eq=False)
class Comparison:
    """Differences of two traces or two scans, before and after wear.

    Attributes
    ----------
    before, after : Profile or Areal
    direction : str
        "x" or "y" for traces of scans, else "".
    reference : str
        What the worn depth counts from: "place" (heights that agree in both traces), "flanks" (of the
        trace after) or "" (nothing; there is no worn depth).
    match : Match or None
        Search for the same place; None for scans and where the shift is given.
    shift, stretch, tilt, amplitude_ratio, slope_ratio : Quantity
    worn : Worn
    sizes : tuple
        `Size` before and after.
    registration : Alignment or None
    flanks : Flanks or None
    notes : tuple of str
    exchanged : bool
        Whether material stands above the first trace and none is missing, or the traces share a place in
        the other order alone.
    tracks : Tracks
    reference_by : Reference or None
        Unworn parts or valleys that the alignment rests on.
    hidden : Quantity
        Wear that a wedge may hide.
    removed : tuple of int
        Heights that are missing or left out in each.
    mirrored : bool
        Whether the second trace was mirrored.
    gain : float or None
        Heights after over heights before, where they differ by a factor alone.
    change : Change or None
        Of two scans.
    visible : float or None
        Depth [m] from which a track would have been found, where none was.
    open : str
        Readings that explain both traces alike, "" where there is one.
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
    sizes: tuple
    registration: Alignment | None = None
    flanks: Flanks | None = None
    notes: tuple = field(default=())
    exchanged: bool = False
    tracks: Tracks = field(default=Tracks(()))
    reference_by: Reference | None = None
    hidden: Quantity = field(default_factory=lambda: limit_hidden_wear(None, None))
    removed: tuple = (0, 0)
    mirrored: bool = False
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
        return out


def compared(before: Profile, after: Profile, direction: str = "", band: tuple = BAND, shift: float | None = None,
             keep_spikes: bool = False, straight: bool = False) -> Comparison:
    """Compare two traces of a surface.

    Spikes, dropouts and dust are left out first. Traces that share a place, as they are or mirrored, are
    aligned on the heights that did not wear, and the worn depth is what is missing. Else the worn depth
    counts from unworn flanks of the second trace, or there is none.

    Parameters
    ----------
    before, after : Profile
    direction : str
    band : tuple
        Shortest and longest wave [m] of the amplitude ratio.
    shift : float, optional
        Known shift [m]: a place at x of the first trace is at x + shift of the second, give or take half
        a wave.
    keep_spikes : bool
        Whether spikes stay.
    straight : bool
        Whether the datum is known to be straight, so that no bow is subtracted.

    Raises
    ------
    PatchfemError
        If a trace is too short for the band.
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
            found = align(before, after, place.found.shift, is_straight=not bow)
        except PatchfemError:
            break
        place = place._replace(before=before, after=after, found=found)
    return place


def _placed(place: Place, direction: str, band: tuple, removed: tuple) -> Comparison:
    """The comparison of two traces of one place."""
    before, after, found = place.before, place.after, place.found
    if identical(before, after):  # but for round-off the fit finds no shift and no tilt
        found = replace(found, state=frozen_array(np.zeros(5)))
    section = section_of(found)
    by = find_reference(found, section)
    grew = has_grown(found, section)
    reading = find_readings(found, bool(by.by), bool(by.by) or grew)
    if reading.headline:
        by = by._replace(by="")
    tracks = measure_tracks(found, section, band[1]) if by.by else Tracks(())
    worn = measure_worn(found, section, tracks)
    gone = worn.deposited > (worn.area.high or 0.0)
    if by.by and not worn.mean.low > 0 and gone:
        by = by._replace(by="")
    hidden = limit_hidden_wear(found, by)
    if not by.by:
        tracks = Tracks(())
        why = (
            "no part of the traces is known to be unworn, so uniform, wedge-shaped or bow-shaped wear cannot be "
            "told from no wear"
        )
        worn = unknown_worn(reading.reason or why, worn.deposited if grew else 0.0)
    notes, step = _steps(before, after)
    notes += _note_stretch(found)
    ratios, sizes = _ratios(found, tracks, step, band)
    by = cut_at_wear(by, worn.extent)
    shift = around(found.shift, found.error_of(Parameter.SHIFT), "m", SHIFT)
    tilt = around(found.slope, found.error_of(Parameter.SLOPE) / found.half, "rad", TILT)
    stretch = around(1 + found.stretch, found.error_of(Parameter.STRETCH), "1", STRETCH)
    grown = not reading.headline and gone and grew and not (worn.mean.low or 0.0) > 0
    return Comparison(
        before=before,
        after=after,
        direction=direction,
        reference="place",
        match=place.match,
        shift=shift,
        stretch=stretch,
        tilt=tilt,
        worn=worn,
        amplitude_ratio=ratios[0],
        slope_ratio=ratios[1],
        sizes=sizes,
        registration=found,
        notes=tuple(notes),
        exchanged=grown,
        tracks=tracks,
        reference_by=by,
        hidden=hidden,
        removed=removed,
        mirrored=place.mirrored,
        gain=None if by.by or grew else find_gain(found),
        visible=None if by.by or grew or reading.headline else found.visible,
        open=reading.headline,
    )


def _ratios(found: Alignment, tracks: Tracks, step: float, band: tuple) -> tuple:
    """Ratios of amplitude and slope of aligned traces without the edges of the tracks, and the sizes of both sides."""
    pieces = pieces_of(found, tracks, band[1])
    flat = pieces_of(found, tracks, band[1], True)
    sizes = [tuple(_pooled(side, step, band) for side in zip(*one)) for one in (flat, pieces)]
    noise_rms = float(np.sqrt(np.mean(found.noise_at**2)))
    shares = of_noise(sizes[0], noise_rms, step, band)
    ratios = []
    for name, text, alike, noise in zip(("amplitude", "slope"), (AMPLITUDE, SLOPE), _alike(flat, step, band), shares):
        if noise >= LOUD:
            why = (
                f"the noise of the measurement, {say(found.noise)} between the traces, has a larger {name} than "
                "the surface, so this ratio tells nothing of the surface; measure with less noise, or smooth both "
                "traces alike"
            )
            ratios.append(refused("1", text, why))
            continue
        one, other = (ratio(name, text, *pair[::-1], alike) for pair in sizes)
        off = abs(np.log(one.value / other.value)) if one.value and other.value else 0.0
        ratios.append(loose(one, float(np.hypot(np.hypot(BEYOND, noise), off))))
    return ratios, sizes[0]


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
    sides = [[before], [after] if flanks is None else beside_flanks(after, flanks, band[1])]
    worn = worn_of_flanks(flanks) if flanks is not None else unknown_worn(why if place.order else
        f"{why}; the second trace shows no track between unworn flanks either; a worn depth needs one of the two")
    sizes = tuple(_pooled(side, step, band) for side in sides)
    freedom = [[scattered(one, step, band) for one in side] for side in sides]
    sizes = tuple(one._replace(freedom=tuple(min(a, b) for a, b in zip(one.freedom, np.sum(each, axis=0))))
                  for one, each in zip(sizes, freedom))
    ratios = [ratio(name, text, sizes[1], sizes[0]) for name, text in (("amplitude", AMPLITUDE), ("slope", SLOPE))]
    blank = [refused(unit, text, why) for unit, text in (("m", SHIFT), ("1", STRETCH), ("rad", TILT))]
    return Comparison(before, after, direction, "" if flanks is None else "flanks", place.match, *blank, worn, *ratios,
                      sizes, None, flanks, tuple(notes), place.order,
                      tracks_of_flanks(flanks) if flanks is not None else Tracks(()), removed=removed)


def _flanked(one: Comparison, straight: bool, shift: float | None) -> Comparison:
    """The comparison without the depth below flanks which the first trace shows to be worn, at the shift [m] that is
    known or clear."""
    match = one.match
    if shift is None and match is not None and not match.repeats and match.clear > CLEAR:
        shift = match.shift
    if one.flanks is None or shift is None:
        return one
    why = find_worn_flanks(one.before, one.after, shift, one.flanks, straight)
    return one if not why else replace(one, reference="", worn=unknown_worn(why), tracks=Tracks(()),
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


def _note_stretch(found: Alignment) -> list:
    """Note that the traces differ in length, as a sentence; nothing where they do not for sure."""
    value, error = found.stretch, found.error_of(Parameter.STRETCH)
    if not abs(value) >= max(SIDE * 2 * error, MIN_STRETCH):
        return []
    return [
        f"the same stretch of surface is {1 + value:.5g} (+- {SIDE * error:.1g}) times as long in the second trace "
        "(after wear) as in the first; this difference in length is corrected"
    ]


def compared_scans(before: Areal, after: Areal, first: str = "x", keep_spikes: bool = False) -> list[Comparison]:
    """Compare two areal scans, place by place and by their waves in each direction: two `Comparison`, the first of
    which has the `Change`."""
    flat, found = tuple(map(bridged, (before, after))), compare_scans(before, after, keep_spikes)
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
    return Comparison(before, after, direction, "", None, *blank, unknown_worn(why), *ratios, sizes)


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
