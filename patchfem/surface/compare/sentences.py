"""Sentences of a comparison on wear, tracks, reference, waves and slopes, and directions."""

import numpy as np

from ...formatting import format_length, format_number
from ..areal import Areal
from ..profile import Profile
from ..quantity import SIDE, Quantity, format_interval
from ..scans import change as scans
from .ambiguity import describe_other
from .compare import Comparison, are_identical
from .reference import describe_bow_area, describe_hidden_wear, describe_reference

# Smallest ratio of deposited to worn area from which on material above the first trace is reported.
MIN_DEPOSITED = 0.05
ROUNDING = 1e-6  # largest difference of a ratio from 1 that is round-off
SQUARE_UM = 1e12  # um^2 in a m^2


def describe_comparisons(parts: list, directions: list) -> list:
    """Return the sentences that describe one or two comparisons.

    Parameters
    ----------
    parts : list of Comparison
    directions : list
        As `compare_directions` returns it.
    """
    out = []
    change = parts[0].change
    if change is not None:
        if are_identical(parts[0].before, parts[0].after):
            out.append("The heights of both scans are the same; was the same file given twice?")
        out += scans.describe_change(change)
    for part in parts:
        name = f" along {part.direction}" if part.direction else ""
        if not isinstance(part.before, Areal):
            out += _describe_traces(part, name)
        out += _describe_waves(part, name)
        out += _describe_remarks(part)
    return out + [_compare_directions(*each) for each in directions]


def describe_ratio_change(ratio: Quantity) -> str:
    """Describe the change that a ratio of after to before shows: reduced, increased, none or unknown."""
    if ratio.value is None:
        return "not known"
    if ratio.high < 1 - ROUNDING:
        return "reduced"
    return "increased" if ratio.low > 1 + ROUNDING else "no change shown"


def compute_confidence(ratio: Quantity) -> float:
    """Return the confidence level at which the interval of a ratio just includes 1.

    It follows from the width of the interval of the logarithm.
    """
    from scipy.special import ndtr

    end = ratio.high if ratio.value < 1 else ratio.low
    error = abs(np.log(end / ratio.value)) / SIDE
    return float(2 * ndtr(abs(np.log(ratio.value)) / error) - 1) if error > 0 else 1.0


def _describe_confidence(ratio: Quantity) -> str:
    percent = 100 * compute_confidence(ratio)
    if percent > 99.9:
        return "with more than 99.9 % confidence"
    return f"with {np.floor(percent * 10) / 10:.3g} % confidence"


def is_significant(mean: Quantity) -> bool:
    """Return whether a mean depth is significantly above zero."""
    return mean.value is not None and mean.low > 0


def is_elsewhere(part: Comparison) -> bool:
    """Return whether two traces have no part of the surface in common."""
    return isinstance(part.before, Profile) and part.alignment is None


def is_gain(part: Comparison) -> bool:
    """Return whether a single amplification factor explains the changes of heights, waves and slopes."""
    changes = {
        describe_ratio_change(part.ratios.amplitude),
        describe_ratio_change(part.ratios.slope),
    }
    return part.gain is not None and bool(changes & {"reduced", "increased"})


def _describe_traces(part: Comparison, name: str) -> list:
    """Describe the wear that two traces show; `name` is their direction as text."""
    out = []
    if part.is_mirrored:
        out.append(
            f"The second trace{name} was measured in the opposite direction; the trace was mirrored here, so "
            "its x counts from the other end."
        )
    out.append(_describe_wear(part, name))
    if is_elsewhere(part) and part.worn.mean.value is not None:
        out.append(f"Comparison place by place{name}: not available; {part.motion.shift.reason}.")
    out += _describe_datum(part)
    out += _describe_other_tracks(part)
    return out if part.ambiguity else out + describe_other(part.alignment)


def _describe_wear(part: Comparison, name: str) -> str:
    """Describe the worn depth of the second surface, or state why it is not known."""
    if are_identical(part.before, part.after):
        return f"Worn depth{name}: none; the heights before and after wear are the same."
    mean = part.worn.mean
    above = _describe_deposits(part)
    if part.basis == "place" and not part.reference.kind and not part.ambiguity:
        visible_depth = ""
        if part.detection_limit is not None:
            visible_depth = f" {describe_visible_depth(part.detection_limit)}"
        hidden = describe_hidden_wear(part.alignment, part.hidden)
        return f"Worn depth{name}: no wear detected.{above}{visible_depth} {hidden}"
    if mean.value is None:
        return f"Worn depth{name}: not available; {mean.reason}."
    if not is_significant(mean):
        return f"Worn depth{name}: no wear detected; at most {format_length(mean.high)} on average.{above}"
    over = f"over {part.mean_region}"
    if part.basis == "flanks":
        over += ", measured from the unworn flanks of the track"
    text = (
        f"Worn{name}: {_describe_track(part)}{format_interval(mean)} on average {over}, "
        f"{format_interval(part.worn.largest)} at the deepest place.{above}"
    )
    return text if part.worn.extent is None or part.tracks.sizes else text + _describe_extent(part)


def _describe_deposits(part: Comparison) -> str:
    """Describe the material above the first trace, or return "" if there is little."""
    deposited = part.worn.deposited
    if deposited <= 0 or deposited <= MIN_DEPOSITED * (part.worn.area.value or 0.0):
        return ""
    cause = "deposits or pile-up"
    if part.is_exchanged:
        cause = "deposits, or the two files are in the wrong order"
    return f" {SQUARE_UM * deposited:.3g} um^2 of material lie above the first trace (before wear): there are {cause}."


def _describe_extent(part: Comparison) -> str:
    """Describe where wear begins and ends in a trace that has no track."""
    before, after = (_format_span(*(end.value for end in ends)) for ends in part.worn.extent[:2])
    text = f" Worn from x = {before} in the first trace (before wear), that is from {after} in the second"
    within = part.worn.within
    if within is None:
        return text + "."
    return f"{text}, with a depth of {format_interval(within)} on average between these places."


def _describe_datum(part: Comparison) -> list:
    """Describe the surface from which the depth is measured, and a bow that was subtracted."""
    if part.alignment is None or not part.reference.kind:
        return []
    out = [describe_reference(part.reference)]
    bend = part.alignment.bend
    if bend:
        out.append(
            f"A curvature (bow) of {format_length(abs(bend), 3)} over the common length was subtracted, because a bent "
            f"datum and wear of that shape{describe_bow_area(part.alignment)} look alike."
        )
    return out


def _describe_other_tracks(part: Comparison) -> list:
    """Describe the tracks other than the longest one; `compare.json` lists all their dimensions."""
    others = part.tracks.others
    if not others:
        return []
    out = [
        f"{len(others) + 1} tracks were found; the first sentence and the table describe the longest one."
    ]
    for sizes in others:
        area = format_number(SQUARE_UM * sizes["area_gross"].value, 4)
        out.append(
            f"Worn, too: {_describe_sizes(sizes)}the area lost in this track is {area} um^2."
        )
    return out


def _describe_track(part: Comparison) -> str:
    """Return the beginning of the sentence on the longest track, or "" if there is no track."""
    if part.flanks is not None:
        span = _format_span(part.flanks.start, part.flanks.end)
        return f"a track from about x = {span} in the second trace (after wear); "
    return _describe_sizes(part.tracks.sizes)


def _describe_sizes(sizes: dict) -> str:
    """Return the beginning of a sentence on a track with these dimensions, or "" if there is no track."""
    if not sizes:
        return ""
    start = sizes["from"].value
    end = sizes["to"].value
    depths = f"{format_interval(sizes['depth_mean'])} deep on average, its floor {format_interval(sizes['depth_floor'])}; "
    if start is not None and end is not None:
        return f"a track from x = {_format_span(start, end)} in the second trace (after wear), {depths}"
    first = (
        "the beginning of the common part" if start is None else f"x = {format_length(start, 4)}"
    )
    last = "the end of the common part" if end is None else f"x = {format_length(end, 4)}"
    return (
        f"a track from {first} to {last} in the second trace (after wear), so the track may be longer than the "
        f"{format_length(sizes['width'].value)} that both traces show of it; there {depths}"
    )


def _describe_remarks(part: Comparison) -> list:
    """Describe what the intervals of a track and the ratios leave out."""
    out = []
    width = part.tracks.sizes.get("width")
    if width is not None and width.high is not None:
        out.append(
            "The intervals of the ends and of the width of the track are those on these two traces; its mean width needs "
            "traces at several places, for its ends may be ragged."
        )
    if part.tracks.spans or part.flanks is not None:
        out.append(
            "Amplitude and slope are computed without the edges of the track; their ratios are those of the track and its "
            "surroundings together, and slopes contain the noise of the instrument."
        )
    return out


def _describe_waves(part: Comparison, name: str) -> list:
    """Describe how waves and slopes changed."""
    if isinstance(part.before, Areal) and not part.ratios.sizes:
        return [f"Waves{name}: not available; {part.ratios.amplitude.reason}."]
    out = [
        _describe_amplitude(part.ratios.amplitude, name),
        _describe_slope(part.ratios.slope, name),
    ]
    if is_gain(part):
        out.append(
            f"All heights{name} after wear are {part.gain:.4g} times the heights before; a difference in the gain of "
            "the instrument explains this factor, but wear does not; calibrate z of both measurements."
        )
    return out


def _describe_amplitude(ratio: Quantity, name: str) -> str:
    if ratio.value is None:
        return f"Amplitude{name}: {ratio.reason}."
    start = f"The waves of the band{name} have {_format_ratio(ratio)} times their amplitude before wear: "
    word = describe_ratio_change(ratio)
    if word == "no change shown":
        return start + "the interval contains 1, so no change is shown."
    return f"{start}{word}, {_describe_confidence(ratio)}."


def _describe_slope(ratio: Quantity, name: str) -> str:
    if ratio.value is None:
        return f"Slope{name}: {ratio.reason}."
    word = {"reduced": "flatter", "increased": "steeper"}.get(describe_ratio_change(ratio))
    change = "no change is shown" if word is None else f"{word}, {_describe_confidence(ratio)}"
    return f"The slope{name} is {_format_ratio(ratio)} times the slope before wear: {change}."


def _compare_directions(when: str, amplitude: Quantity, slope: Quantity) -> str:
    """Describe how waves and slopes along x differ from those along y."""
    texts = []
    for name, ratio in (("amplitude", amplitude), ("slope", slope)):
        if ratio.value is None:
            continue
        word = {"reduced": "smaller", "increased": "larger"}.get(describe_ratio_change(ratio))
        difference = "no difference is shown"
        if word is not None:
            difference = f"{word} along x, {_describe_confidence(ratio)}"
        texts.append(
            f"{name} along x divided by that along y = {_format_ratio(ratio)}: {difference}"
        )
    is_anisotropic = describe_ratio_change(amplitude) in ("reduced", "increased")
    anisotropy = "anisotropic" if is_anisotropic else "no anisotropy shown"
    return f"{when[0].upper() + when[1:]}: {anisotropy}; {'; '.join(texts)}."


def describe_visible_depth(depth: float) -> str:
    """Describe the smallest mean depth [m] of a track that would have been found."""
    return (
        "A track over the middle third of the common length, with both of its flanks unworn, would have been found "
        f"from a mean depth of {format_length(depth, 2)} on."
    )


def _format_ratio(ratio: Quantity) -> str:
    return f"{ratio.value:.3g} ({ratio.low:.3g} to {ratio.high:.3g})"


def _format_span(first: float, last: float) -> str:
    """Format two positions [m] to the fourth digit of the larger one."""
    step = 10.0 ** (np.floor(np.log10(max(abs(first), abs(last), 1e-12))) - 3)
    return " to ".join(
        format_length(float(np.round(place / step)) * step) for place in (first, last)
    )
