"""Comparison of two traces or two areal scans, before and after wear, as a frozen record."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ...formatting import format_length
from ..areal import Areal
from ..files.read import read_surface
from ..profile import Profile, level, remove_spikes, resample_evenly
from ..quantity import SIDE, Quantity, make_quantity, make_unknown
from ..roughness.spectrum import BAND
from ..scans.change import Change, compare_scans
from .alignment import Alignment
from .ambiguity import BENT_DATUM_HEADLINE, Ambiguity, find_ambiguity, find_worn_flanks
from .flanks import Flanks, find_flanks
from .gain import find_gain
from .model import Parameter
from .place import Place, find_place, try_align
from .ratios import (
    RATIO_ERROR,
    Size,
    correlate_traces,
    divide_sizes,
    estimate_freedom,
    fill_scan,
    measure_scan_size,
    measure_size,
    noise_fractions,
    resample,
    widen_ratio,
)
from .reference import Reference, cut_at_wear, find_reference, has_grown, limit_hidden_wear
from .search import Match
from .section import Section
from .specks import limit_left_out_wear, remove_specks
from .worn import (
    NO_TRACKS,
    Tracks,
    Worn,
    make_section,
    make_unknown_worn,
    measure_flank_track,
    measure_flank_wear,
    measure_tracks,
    measure_worn,
    split_at_flanks,
    split_at_tracks,
)

# Definitions of the quantities, as the user reads them.
SHIFT = "shift: the point at x in the first trace (before wear) is at x + shift in the second trace (after wear)"
STRETCH = (
    "length of the second trace (after wear) divided by the length of the first trace for the same stretch of "
    "surface, found from the unworn valleys"
)
TILT = "tilt of the second trace (after wear) relative to the first (before wear)"
AMPLITUDE = (
    "amplitude of a sine with the same mean square as the waves of 60 um to 110 um: value after wear divided "
    "by value before"
)
SLOPE = (
    "root mean square slope between neighbouring samples: value after wear divided by value before"
)

# Smallest relative length difference that a note reports; smaller ones are
# not reported even if significant.
MIN_STRETCH = 1e-4
# Smallest distance of a height from the mean line / largest height; smaller ones are rounding.
MIN_HEIGHT = 1e-9
# Largest ratio of the mean squares of noise and surface; above it, a
# measured ratio is that of the noise.
MAX_NOISE_FRACTION = 1.0
# Number of alignments after the removal of specks; the second one reveals
# specks next to the first ones.
N_SPECK_ROUNDS = 2


class Ratios(NamedTuple):
    """Ratios of amplitude and slope after wear to before; `Size` of both surfaces, or () if it is unknown."""

    amplitude: Quantity
    slope: Quantity
    sizes: tuple


class Motion(NamedTuple):
    """Shift [m], ratio of lengths [1] and tilt [rad] of the second trace relative to the first."""

    shift: Quantity
    stretch: Quantity
    tilt: Quantity


class DirectionRatios(NamedTuple):
    """Ratios of amplitude and slope along x to those along y; `when` is "before" or "after" wear."""

    when: str
    amplitude: Quantity
    slope: Quantity


@dataclass(frozen=True, eq=False)
class Comparison:
    """Differences of two traces or two scans, before and after wear.

    - direction: "x" or "y" for traces of scans, else "".
    - basis: surface from which the worn depth is measured: "place" (heights that agree in both traces),
      "flanks" (of the second trace) or "" (nothing; there is no worn depth).
    - match: search for the same place; None for scans and where the shift is given.
    - is_exchanged: whether material stands above the first trace and none is missing, or the
      traces share a place only if the second one is taken as the unworn one.
    - reference: unworn parts or valleys that the alignment rests on, or None.
    - hidden: wear that a wedge may hide; None for scans.
    - removed: heights that are missing or left out in each.
    - is_mirrored: whether the second trace was mirrored.
    - gain: heights after over heights before, where they differ by a factor alone, or None.
    - change: changes between two scans, None for traces.
    - detection_limit: depth [m] from which a track would have been found, where none was, or
      None.
    - ambiguity: interpretations that explain both traces equally well, "" if there is only one.
    """

    before: Profile | Areal
    after: Profile | Areal
    direction: str
    basis: str
    motion: Motion
    worn: Worn
    ratios: Ratios
    match: Match | None = None
    alignment: Alignment | None = None
    flanks: Flanks | None = None
    notes: tuple = ()
    is_exchanged: bool = False
    tracks: Tracks = NO_TRACKS
    reference: Reference | None = None
    hidden: Quantity | None = None
    removed: tuple = (0, 0)
    is_mirrored: bool = False
    gain: float | None = None
    change: Change | None = None
    detection_limit: float | None = None
    ambiguity: str = ""

    @property
    def mean_region(self) -> str:
        """Part of the surface over which the mean worn depth is computed."""
        if isinstance(self.before, Areal):
            return "the region that both scans show"
        return "the second trace" if self.basis == "flanks" else "the common length"

    @property
    def values(self) -> dict:
        """Every `Quantity` by its name."""
        ratios = {"amplitude_ratio": self.ratios.amplitude, "slope_ratio": self.ratios.slope}
        if isinstance(self.before, Areal):
            return {**self._scan_values(), **ratios}
        values = {
            "shift": self.motion.shift,
            "worn_depth_max": self.worn.largest,
            "worn_depth_mean": self.worn.mean,
            "worn_area": self.worn.area,
            **ratios,
            "tilt": self.motion.tilt,
            "scale": self.motion.stretch,
        }
        if self.worn.extent is not None:
            known = self.worn.extent.known
            for when, (start, end) in (("before", known.before), ("after", known.after)):
                values[f"worn_from_{when}"] = start
                values[f"worn_to_{when}"] = end
            if self.worn.within is not None:
                values["worn_depth_within"] = self.worn.within
        values |= _name_track_sizes(self.tracks.sizes)
        values["hidden_wear"] = self.hidden
        return values

    def _scan_values(self) -> dict:
        if self.change is None:
            return {}
        values = {**self.change.values, **self.change.registration}
        track = self.change.track
        if track is not None and not track.why:
            values |= _name_track_sizes(track.values)
        return values


def compare_traces(
    before: Profile,
    after: Profile,
    direction: str = "",
    *,
    shift: float | None = None,
    keep_spikes: bool = False,
    is_straight: bool = False,
) -> Comparison:
    """Compare two traces of a surface.

    Spikes, dropouts and dust are left out first. Traces that share a place, as they are or mirrored, are
    aligned on the heights that did not wear, and the worn depth is what is missing. Otherwise the worn
    depth is measured from unworn flanks of the second trace, or there is none.

    Parameters
    ----------
    before, after : Profile
    direction : str
    shift : float, optional
        Known shift [m]: a place at x of the first trace is at x + shift of the second, within half a wave.
    keep_spikes : bool
        Whether spikes stay.
    is_straight : bool
        Whether the datum is known to be straight, so that no bow is subtracted.

    Raises
    ------
    PatchfemError
        If a trace is too short for the band, or shows no heights but a straight line.
    """
    traces = (before, after) if keep_spikes else (remove_spikes(before), remove_spikes(after))
    for trace in traces:
        _refuse_flat(trace)
    place = find_place(*traces, shift, is_straight=is_straight)
    if place.alignment is None:
        return _check_flanks(_compare_separate(place, direction), shift, is_straight)
    if not keep_spikes:
        place = _remove_specks(place, is_straight)
    heights = after.z[::-1] if place.is_mirrored else after.z
    return _compare_aligned(place, heights, direction)


def _refuse_flat(trace: Profile) -> None:
    """Raise PatchfemError if all heights of a trace lie on a straight line."""
    known = trace.z[~trace.missing]
    deviation = level(trace).z[~trace.missing]
    if known.size and np.abs(deviation).max() <= MIN_HEIGHT * np.abs(known).max():
        raise PatchfemError(
            f"{trace.source}: all heights lie on a straight line, so this trace shows no surface to compare; was the "
            "instrument in contact and within its range?"
        )


def _name_track_sizes(sizes) -> dict:
    """Return the dimensions of a track by the names that they have in a comparison."""
    return {f"track_{name.removesuffix('_mean')}": size for name, size in sizes.items()}


def are_identical(before, after) -> bool:
    """Return whether two surfaces have equal heights at equal positions, for example the same file."""
    if type(before) is not type(after):
        return False
    names = [name for name in "xyz" if hasattr(before, name)]
    return all(
        np.array_equal(getattr(before, name), getattr(after, name), equal_nan=True)
        for name in names
    )


def _count_removed(place: Place) -> tuple:
    return tuple(int(trace.missing.sum()) for trace in (place.before, place.after))


def _remove_specks(place: Place, is_straight: bool) -> Place:
    """Remove the specks of two traces, and align the traces again."""
    for _ in range(N_SPECK_ROUNDS):
        before, after = remove_specks(place.alignment, place.before, place.after)
        if before is place.before and after is place.after:
            break
        alignment = try_align(before, after, place.alignment.shift, is_straight)
        if alignment is None:
            break
        place = place._replace(before=before, after=after, alignment=alignment)
    return place


class _Wear(NamedTuple):
    """Wear of aligned traces; the fields have the names of those in `Comparison`."""

    worn: Worn
    tracks: Tracks
    reference: Reference
    hidden: Quantity
    ambiguity: Ambiguity
    has_grown: bool
    is_exchanged: bool


def _compare_aligned(place: Place, heights, direction: str) -> Comparison:
    """Compare two traces of the same part of a surface.

    heights (n,) [m]: those of the second trace before any was left out.
    """
    before = place.before
    after = place.after
    alignment = place.alignment
    if are_identical(before, after):  # apart from rounding, the fit finds no shift and no tilt
        alignment = replace(alignment, state=frozen_array(np.zeros(5)))
    section = make_section(alignment)
    left_out = limit_left_out_wear(alignment, section, before, after, heights)
    wear = _measure_wear(alignment, section, left_out)
    is_unchanged = not wear.reference.kind and not wear.has_grown
    needs_limit = is_unchanged and not wear.ambiguity.headline
    step = _common_step(before, after)
    notes = [*_note_steps(before, after), *_note_stretch(alignment)]
    return Comparison(
        before=before,
        after=after,
        direction=direction,
        basis="place",
        motion=_measure_motion(alignment),
        worn=wear.worn,
        ratios=_compute_aligned_ratios(alignment, wear.tracks, step),
        match=place.match,
        alignment=alignment,
        notes=tuple(notes),
        is_exchanged=wear.is_exchanged,
        tracks=wear.tracks,
        reference=cut_at_wear(wear.reference, wear.worn.extent),
        hidden=wear.hidden,
        removed=_count_removed(place),
        is_mirrored=place.is_mirrored,
        gain=find_gain(alignment) if is_unchanged else None,
        detection_limit=alignment.detection_limit if needs_limit else None,
        ambiguity=wear.ambiguity.headline,
    )


def _measure_wear(alignment: Alignment, section: Section, left_out: float) -> _Wear:
    """Measure worn depth and tracks of aligned traces, or state why they are unknown.

    left_out [m2]: area of the dips that were left out (`limit_left_out_wear`).
    """
    reference = find_reference(alignment, section)
    grew = has_grown(alignment, section)
    ambiguity = find_ambiguity(alignment, reference, has_grown=grew)
    if ambiguity.headline:
        reference = reference._replace(kind="")
    tracks = measure_tracks(alignment, section, BAND[1]) if reference.kind else NO_TRACKS
    worn = measure_worn(alignment, section, tracks, left_out)
    is_mostly_deposit = worn.deposited > (worn.area.high or 0.0)
    if not worn.mean.low > 0 and is_mostly_deposit:
        reference = reference._replace(kind="")
    hidden = limit_hidden_wear(alignment, reference)
    if not reference.kind:
        tracks = NO_TRACKS
        reason = ambiguity.reason or (
            "no part of the traces is known to be unworn, so uniform, wedge-shaped or bow-shaped wear cannot be "
            "told from no wear"
        )
        worn = make_unknown_worn(reason, worn.deposited if grew else 0.0)
    is_worn = (worn.mean.low or 0.0) > 0
    is_exchanged = not ambiguity.headline and is_mostly_deposit and grew and not is_worn
    return _Wear(worn, tracks, reference, hidden, ambiguity, grew, is_exchanged)


def _measure_motion(alignment: Alignment) -> Motion:
    shift_error = alignment.error_of(Parameter.SHIFT)
    tilt_error = alignment.error_of(Parameter.SLOPE) / alignment.half
    stretch_error = alignment.error_of(Parameter.STRETCH)
    return Motion(
        make_quantity(alignment.shift, shift_error, "m", SHIFT),
        make_quantity(1 + alignment.stretch, stretch_error, "1", STRETCH),
        make_quantity(alignment.slope, tilt_error, "rad", TILT),
    )


def _refuse_motion(reason: str) -> Motion:
    return Motion(
        make_unknown("m", SHIFT, reason),
        make_unknown("1", STRETCH, reason),
        make_unknown("rad", TILT, reason),
    )


def _compute_aligned_ratios(alignment: Alignment, tracks: Tracks, step: float) -> Ratios:
    """Compute the ratios of amplitude and slope of aligned traces, excluding the edges of tracks.

    The difference between the ratios with and without the form of the tracks widens the intervals.
    """
    pieces = split_at_tracks(alignment, tracks, BAND[1])
    flat = split_at_tracks(alignment, tracks, BAND[1], is_flat=True)
    sizes = _pool_sides(pieces, step)
    flat_sizes = _pool_sides(flat, step)
    noise = float(np.sqrt(np.mean(alignment.noise_at**2)))
    fractions = noise_fractions(flat_sizes, noise, step, BAND)
    correlations = _correlate_pieces(flat, step)
    ratios = []
    for name, text, correlation, fraction in zip(
        ("amplitude", "slope"), (AMPLITUDE, SLOPE), correlations, fractions
    ):
        if fraction >= MAX_NOISE_FRACTION:
            reason = (
                f"the noise of the measurement, {format_length(alignment.noise)} between the "
                f"traces, has a larger {name} than "
                "the surface, so this ratio tells nothing of the surface; measure with less noise, or smooth both "
                "traces alike"
            )
            ratios.append(make_unknown("1", text, reason))
            continue
        ratio, other = (
            divide_sizes(name, text, after, before, correlation)
            for before, after in (flat_sizes, sizes)
        )
        has_both = ratio.value and other.value
        form_error = abs(np.log(ratio.value / other.value)) if has_both else 0.0
        ratios.append(
            widen_ratio(ratio, float(np.hypot(np.hypot(RATIO_ERROR, fraction), form_error)))
        )
    return Ratios(*ratios, flat_sizes)


def _compare_separate(place: Place, direction: str) -> Comparison:
    """Compare two traces from different parts of a surface."""
    before = place.before
    after = place.after
    reason = place.reason
    step = _common_step(before, after)
    notes = _note_steps(before, after)
    flanks = find_flanks(before, after)
    if place.is_reversed:
        reason = (
            "the two traces match only if the second is taken as the unworn one: material grew between the "
            "measurements, or the two files are in the wrong order"
        )
    after_pieces = [after]
    tracks = NO_TRACKS
    if flanks is not None:
        notes += [reason] * place.is_reversed
        after_pieces = split_at_flanks(after, flanks, BAND[1])
        tracks = measure_flank_track(flanks)
        worn = measure_flank_wear(flanks)
    elif place.is_reversed:
        worn = make_unknown_worn(reason)
    else:
        worn = make_unknown_worn(
            f"{reason}; the second trace shows no track between unworn flanks either; a worn depth needs one of the two"
        )
    sizes = tuple(_pool_with_scatter(side, step) for side in ([before], after_pieces))
    return Comparison(
        before=before,
        after=after,
        direction=direction,
        basis="" if flanks is None else "flanks",
        motion=_refuse_motion(reason),
        worn=worn,
        ratios=_compute_separate_ratios(sizes),
        match=place.match,
        flanks=flanks,
        notes=tuple(notes),
        is_exchanged=place.is_reversed,
        tracks=tracks,
        hidden=limit_hidden_wear(None, None),
        removed=_count_removed(place),
    )


def _compute_separate_ratios(sizes: tuple) -> Ratios:
    """Return the ratios of amplitude and slope of two traces from different parts of a surface."""
    before, after = sizes
    amplitude = divide_sizes("amplitude", AMPLITUDE, after, before)
    return Ratios(amplitude, divide_sizes("slope", SLOPE, after, before), sizes)


def _check_flanks(comparison: Comparison, shift: float | None, is_straight: bool) -> Comparison:
    """Mark the depth below the flanks as unknown if the first trace shows that they are worn.

    shift [m]: known shift between the traces; None takes that of a clear match.
    """
    match = comparison.match
    if shift is None and match is not None and not match.is_ambiguous and match.is_significant:
        shift = match.shift
    flanks = comparison.flanks
    if flanks is None or shift is None:
        return comparison
    reason = find_worn_flanks(
        comparison.before, comparison.after, shift, flanks, is_straight=is_straight
    )
    if not reason:
        return comparison
    return replace(
        comparison,
        basis="",
        worn=make_unknown_worn(reason),
        tracks=NO_TRACKS,
        flanks=None,
        ambiguity="" if is_straight else BENT_DATUM_HEADLINE,
    )


def _common_step(before: Profile, after: Profile) -> float:
    """Return the coarser sampling interval [m] of two traces."""
    return max(resample_evenly(before).step, resample_evenly(after).step)


def _note_steps(before: Profile, after: Profile) -> list:
    """Collect the notes of two traces, and add one if their sampling intervals differ."""
    steps = [resample_evenly(trace).step for trace in (before, after)]
    notes = [*before.notes, *after.notes]
    if max(steps) > 1.01 * min(steps):
        notes.append(
            f"samples lie {format_length(steps[0])} apart before wear and {format_length(steps[1])} "
            "apart after wear; slopes and "
            f"amplitudes are computed at a step of {format_length(max(steps))}"
        )
    return notes


def _pool(pieces, step: float) -> Size:
    """Pool amplitude, slope and degrees of freedom of the pieces of a trace, weighted by length.

    The spectrum is that of the longest piece.
    """
    sizes = [measure_size(piece, step, BAND) for piece in pieces]
    weights = _length_fractions(pieces)
    squares = weights @ np.array([(size.amplitude**2, size.slope**2) for size in sizes])
    amplitude, slope = (float(value) for value in np.sqrt(squares))
    freedom = tuple(float(value) for value in np.sum([size.freedom for size in sizes], axis=0))
    return Size(amplitude, slope, freedom, sizes[int(np.argmax(weights))].spectrum)


def _pool_sides(pairs: list, step: float) -> tuple:
    """Pool amplitude and slope of the pieces before wear, and of those after wear."""
    return tuple(_pool(side, step) for side in zip(*pairs))


def _pool_with_scatter(pieces: list, step: float) -> Size:
    """Pool pieces as in `_pool`, but limit the degrees of freedom by the scatter along the trace."""
    size = _pool(pieces, step)
    scatter = np.sum([estimate_freedom(piece, step, BAND) for piece in pieces], axis=0)
    freedom = tuple(min(value, limit) for value, limit in zip(size.freedom, scatter))
    return size._replace(freedom=freedom)


def _correlate_pieces(pairs: list, step: float) -> tuple:
    """Correlate the bands and the slopes of pairs of aligned pieces, weighted by length."""
    correlations = []
    for before, after in pairs:
        first, own_step = resample(before, step)
        second, _ = resample(after, step)
        correlations.append(correlate_traces(first, second, own_step, BAND))
    weights = _length_fractions([before for before, _ in pairs])
    return tuple(float(value) for value in weights @ np.array(correlations))


def _length_fractions(pieces) -> np.ndarray:
    lengths = np.array([piece.length for piece in pieces])
    return lengths / lengths.sum()


def _note_stretch(alignment: Alignment) -> list:
    """Return a list with a note if the stretch between the traces is significant, or an empty list if it is not."""
    value = alignment.stretch
    error = alignment.error_of(Parameter.STRETCH)
    if not abs(value) >= max(SIDE * 2 * error, MIN_STRETCH):
        return []
    return [
        f"the same stretch of surface is {1 + value:.5g} (+- {SIDE * error:.1g}) times as long in the second trace "
        "(after wear) as in the first; this difference in length is corrected"
    ]


def compare_areal_scans(
    before: Areal, after: Areal, direction: str = "x", *, keep_spikes: bool = False
) -> list[Comparison]:
    """Compare two areal scans height by height, and their waves in each direction.

    Parameters
    ----------
    before, after : Areal
    direction : str
        That of the first comparison, which also has the `Change`.
    keep_spikes : bool
        Whether spikes stay.
    """
    scans = (before, after)
    filled = tuple(fill_scan(scan) for scan in scans)
    change = compare_scans(before, after, keep_spikes)
    notes = tuple(dict.fromkeys((*change.before.notes, *change.after.notes)))
    first = compare_waves(scans, filled, direction)
    first = replace(first, change=change, notes=notes, removed=change.removed)
    return [first, compare_waves(scans, filled, _other_direction(direction))]


def _other_direction(direction: str) -> str:
    return "y" if direction == "x" else "x"


def compare_waves(scans: tuple, filled: tuple, direction: str) -> Comparison:
    """Compare the waves of two scans in one direction.

    `filled` holds the result of `fill_scan` for each scan.
    """
    reason = "areal scans are compared point by point in x and y together"
    try:
        ratios = _compute_separate_ratios(
            tuple(measure_scan_size(*scan, direction, BAND) for scan in filled)
        )
    except PatchfemError as error:  # a scan may be too short for the longest waves of the band
        unknown = [make_unknown("1", text, str(error)) for text in (AMPLITUDE, SLOPE)]
        ratios = Ratios(*unknown, ())
    return Comparison(
        *scans, direction, "", _refuse_motion(reason), make_unknown_worn(reason), ratios
    )


def compare_directions(parts: list) -> list[DirectionRatios]:
    """Compare direction x with y, before and after wear, or return [] if there is only one direction.

    Traces are read at the coarsest step of all of them, so that slopes compare.
    """
    if len(parts) < 2 or not all(part.ratios.sizes for part in parts):
        return []
    along = {part.direction: part for part in parts}
    directions = (along["x"], along["y"])
    sides = [part.ratios.sizes for part in directions]
    if isinstance(parts[0].before, Profile):
        step = max(_common_step(part.before, part.after) for part in directions)
        sides = [
            [measure_size(trace, step) for trace in (part.before, part.after)]
            for part in directions
        ]
    ratios = []
    for when, along_x, along_y in zip(("before", "after"), *sides):
        amplitude, slope = (
            divide_sizes(part, f"{part} along x divided by that along y, {when}", along_x, along_y)
            for part in ("amplitude", "slope")
        )
        ratios.append(DirectionRatios(when, amplitude, slope))
    return ratios


def compare_files(
    paths: tuple,
    direction: str = "",
    units: tuple | None = None,
    shift: float | None = None,
    *,
    keep_spikes: bool = False,
    datum: str = "",
) -> list[Comparison]:
    """Compare files in each direction along which they contain heights.

    Parameters
    ----------
    paths : tuple
        Files before and after wear, along one direction; of traces, two more along the other one. An areal
        scan shows both.
    direction : str
        "x" or "y", that of the first pair; "" for two traces of unknown direction, otherwise "x".
    units : tuple, optional
        Units of x and z for `read_surface`.
    shift : float, optional
        Known shift [m] of two traces, as in `compare_traces`.
    keep_spikes : bool
        Whether spikes stay.
    datum : str
        "straight" where that of the traces is known to be, so that no bow is subtracted.

    Raises
    ------
    PatchfemError
        If the number of files, the direction, the datum or the shift do not fit the surfaces, or a trace
        stands beside a scan.
    """
    _refuse_if(
        (datum not in ("", "straight"), f"datum {datum!r}: straight is needed, or nothing"),
        (direction not in ("", "x", "y"), f"direction {direction!r}: x or y is needed"),
        (
            len(paths) not in (2, 4),
            f"{len(paths)} files; two files are needed, or four: before and after along one "
            "direction, then before and after along the other direction",
        ),
    )
    surfaces = [read_surface(path, units) for path in paths]
    has_scans = _check_surfaces(surfaces, shift, datum)
    if has_scans:
        return compare_areal_scans(*surfaces, direction or "x", keep_spikes=keep_spikes)
    settings = {"keep_spikes": keep_spikes, "is_straight": bool(datum)}
    if len(surfaces) == 2:
        return [compare_traces(*surfaces, direction, shift=shift, **settings)]
    first = direction or "x"
    return [
        compare_traces(*surfaces[:2], first, **settings),
        compare_traces(*surfaces[2:], _other_direction(first), **settings),
    ]


def _check_surfaces(surfaces: list, shift: float | None, datum: str) -> bool:
    """Check that shift and datum suit the surfaces, and find whether these are scans."""
    n_scans = sum(isinstance(surface, Areal) for surface in surfaces)
    has_shift = shift is not None
    _refuse_if(
        (
            has_shift and len(surfaces) == 4,
            "a shift needs exactly two traces; compare each direction separately",
        ),
        (
            n_scans not in (0, 2) or (n_scans and len(surfaces) == 4),
            "two or four traces are needed, or two areal scans",
        ),
        (
            n_scans and has_shift,
            "a shift can be given only for traces; areal scans are registered automatically",
        ),
        (
            n_scans and datum,
            "a datum can be given only for traces; the plane of areal scans is fitted",
        ),
    )
    return n_scans > 0


def _refuse_if(*rules: tuple) -> None:
    """Raise PatchfemError with the message of the first rule (condition, message) whose condition holds."""
    for is_wrong, message in rules:
        if is_wrong:
            raise PatchfemError(f"compare: {message}")
