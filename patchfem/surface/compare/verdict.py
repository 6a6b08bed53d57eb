"""What a comparison proves, in words: reduced or not, worn or not, anisotropic or not, at what confidence."""

import numpy as np

from ...core import say
from ...scales import plain
from ..areal import Areal
from ..profile import Profile
from ..quantity import SIDE, Quantity
from ..scans import change as scans
from .compare import Comparison, compared_files, directions_of, identical
from .readings import describe_other
from .reference import area_of_bow, describe_hidden_wear, describe_reference

EXCHANGED, ELSEWHERE = scans.GREW, scans.ELSEWHERE
DEPOSITED = 0.05  # of the worn area, what may stand above without a word
NEAR = 1e-6  # a ratio that close to one is one but for round-off


def judged(paths: tuple, direction: str = "", units: tuple | None = None, shift: float | None = None,
           keep_spikes: bool = False, datum: str = "") -> tuple:
    """(parts, verdict, directions) of the files before and after: `compared_files`, `verdicts`, `directions_of`."""
    parts = compared_files(paths, direction, units, shift, keep_spikes, datum)
    directions = directions_of(parts)
    return parts, verdicts(parts, directions), directions


def verdicts(parts: list, directions: list = ()) -> tuple:
    """The headline and the sentences of one or two comparisons.

    directions: (when, amplitude ratio x over y, slope ratio) for each time at which both directions are known. The
    headline is "worn", where a depth is shown, then "reduced", "increased" or "no change shown", by the amplitude of
    the band in each direction; the first sentence says where and how deep. Unchanged surfaces are called "reduced" in
    2.5 of 100 cases, and as often "increased". Before it stands that traces of other places are compared, or, where no
    depth is shown, that material stands above the trace before; behind it that a trace is mirrored.
    """
    words = [changed(one.amplitude_ratio) for one in parts]
    names = [f" along {one.direction}" if one.direction else "" for one in parts]
    same = len(set(words)) == 1
    headline = words[0] if same else ", ".join(word + name for word, name in zip(words, names))
    areal = "" if parts[0].change is None else scans.headline(parts[0].change)
    worn = ["worn"] * (areal == scans.WORN or any(_sure(one.worn.mean) for one in parts))
    if areal and set(words) == {"not known"}:
        headline = areal if areal in (scans.WORN, scans.NONE) else "waves not known"
    elif worn and headline != "no change shown":
        headline = f"worn, waves {headline}"
    elif headline == "no change shown":
        told = worn + ["flatter"] * any(changed(one.slope_ratio) == "reduced" for one in parts)
        headline = " and ".join(told) + ", no change detected in the amplitude of the waves" if told else headline
    if (areal == EXCHANGED or any(one.exchanged for one in parts)) and not worn:
        headline = f"{EXCHANGED}; as given: {headline}"
    elif areal == scans.OPEN:
        said = "no change detected in the amplitude of the waves" if headline == "no change shown" else headline
        headline = f"{areal}; {said}"
    elif areal == ELSEWHERE or any(_elsewhere(one) for one in parts):
        headline = f"{ELSEWHERE}; {headline}"
    if any(one.open for one in parts):
        said = "no change detected in the waves" if headline == "no change shown" else headline
        headline = f"{next(one.open for one in parts if one.open)}; {said}"
    if any(_gain(one, "") and word != "no change shown" for one, word in zip(parts, words)):
        headline += ", all heights by the same factor, as an error in the instrument's gain would do"
    over = _over(parts) if parts[0].change is None else scans.describe_variant(parts[0].change)
    headline = f"{headline}; {over}" if over else headline
    out = [] if parts[0].change is None else scans.sentences(parts[0].change)
    if areal and identical(parts[0].before, parts[0].after):
        out.insert(0, "The heights of both scans are the same; was the same file given twice?")
    for one, word, name in zip(parts, words, names):
        if not isinstance(one.before, Areal):
            out += [*_variant(one, name), _worn(one, name), *_no_place(one, name), *_reference(one),
                    *_other_tracks(one), *([] if one.open else describe_other(one.registration))]
        if one.sizes or not isinstance(one.before, Areal):
            out += [_amplitude(one.amplitude_ratio, word, name), _slope(one.slope_ratio, name), *_gain(one, name)]
        else:
            out.append(f"Waves{name}: not available; {one.amplitude_ratio.reason}.")
        out += _apart(one)
    out += [_direction(*each) for each in directions]
    return headline, out


def changed(ratio: Quantity) -> str:
    """Whether a ratio after over before shows a change."""
    if ratio.value is None:
        return "not known"
    if ratio.high < 1 - NEAR:
        return "reduced"
    return "increased" if ratio.low > 1 + NEAR else "no change shown"


def confidence(ratio: Quantity) -> float:
    """Confidence [1] at which the interval of a ratio just reaches one, from its own width in the logarithm."""
    from scipy.special import ndtr

    side = (ratio.high if ratio.value < 1 else ratio.low) / ratio.value
    error = abs(np.log(side)) / SIDE
    return float(2 * ndtr(abs(np.log(ratio.value)) / error) - 1) if error > 0 else 1.0


def sure(ratio: Quantity) -> str:
    """The confidence as words."""
    found = 100 * confidence(ratio)
    return "with more than 99.9 % confidence" if found > 99.9 else f"with {np.floor(found * 10) / 10:.3g} % confidence"


def _range(ratio: Quantity) -> str:
    return f"{ratio.value:.3g} ({ratio.low:.3g} to {ratio.high:.3g})"


def _amplitude(ratio: Quantity, word: str, name: str) -> str:
    if ratio.value is None:
        return f"Amplitude{name}: {ratio.reason}."
    start = f"The waves of the band{name} have {_range(ratio)} times their amplitude before wear: "
    if word == "no change shown":
        return start + "the interval contains 1, so no change is shown."
    return start + f"{word}, {sure(ratio)}."


def _slope(ratio: Quantity, name: str) -> str:
    if ratio.value is None:
        return f"Slope{name}: {ratio.reason}."
    word = changed(ratio)
    tail = "no change is shown" if word == "no change shown" else \
        f"{'flatter' if word == 'reduced' else 'steeper'}, {sure(ratio)}"
    return f"The slope{name} is {_range(ratio)} times the slope before wear: {tail}."


def _gain(one: Comparison, name: str) -> list:
    """That waves or slopes changed by one factor of all heights, as a sentence."""
    if one.gain is None or not {changed(one.amplitude_ratio), changed(one.slope_ratio)} & {"reduced", "increased"}:
        return []
    return [f"All heights{name} after wear are {one.gain:.4g} times the heights before; a difference in the gain of "
            "the instrument explains this factor, but wear does not; calibrate z of both measurements."]


def _sure(mean: Quantity) -> bool:
    return mean.value is not None and mean.low > 0


def _length(one: Quantity) -> str:
    return f"{say(one.value)} ({say(one.low)} to {say(one.high)})"


def _elsewhere(one: Comparison) -> bool:
    """Whether two traces have no place in common."""
    return isinstance(one.before, Profile) and one.registration is None


def _no_place(one: Comparison, name: str) -> list:
    """Why two traces have no place in common, as a sentence; `_worn` says it where no worn depth is known."""
    if not _elsewhere(one) or one.worn.mean.value is None:
        return []
    return [f"Comparison place by place{name}: not available; {one.shift.reason}."]


def _over(parts: list) -> str:
    """What was mirrored, for the headline."""
    return "one trace is mirrored relative to the other" if any(one.mirrored for one in parts) else ""


def _variant(one: Comparison, name: str) -> list:
    """What was mirrored for the comparison, as a sentence."""
    out = []
    if one.mirrored:
        out.append(f"The second trace{name} was measured in the opposite direction; the trace was mirrored here, so "
                   "its x counts from the other end.")
    return out


def _worn(one: Comparison, name: str) -> str:
    if identical(one.before, one.after):
        return f"Worn depth{name}: none; the heights before and after wear are the same."
    mean = one.worn.mean
    above = ""
    if one.worn.deposited > DEPOSITED * (one.worn.area.value or 0.0) and one.worn.deposited > 0:
        above = (f" {1e12 * one.worn.deposited:.3g} um^2 of material lie above the first trace (before wear): there "
                 "are deposits, or the two files are in the wrong order." if one.exchanged else
                 f" {1e12 * one.worn.deposited:.3g} um^2 of material lie above the first trace (before wear): there "
                 "are deposits or pile-up.")
    if one.reference == "place" and not one.reference_by.by and not one.open:
        seen = "" if one.visible is None else f" {would_show(one.visible)}"
        return f"Worn depth{name}: no wear detected.{above}{seen} {describe_hidden_wear(one.registration, one.hidden)}"
    if mean.value is None:
        return f"Worn depth{name}: not available; {mean.reason}."
    if not _sure(mean):
        return f"Worn depth{name}: no wear detected; at most {say(mean.high)} on average.{above}"
    what = "over the track, measured from its unworn flanks" if one.reference == "flanks" else \
        "over the common length"
    text = (f"Worn{name}: {_track(one)}{_length(mean)} on average {what}, {_length(one.worn.largest)} at the deepest "
            f"place.{above}")
    if one.worn.extent is not None and not one.tracks.sizes:
        before, after = (_span(*(end.value for end in ends)) for ends in one.worn.extent[:2])
        text += f" Worn from x = {before} in the first trace (before wear), that is from {after} in the second"
        mean = one.worn.within
        text += "." if mean is None else f", with a depth of {_length(mean)} on average between these places."
    return text


def _reference(one: Comparison) -> list:
    """What the depth counts from, and a bow that was taken out, as sentences."""
    if one.registration is None or not one.reference_by.by:
        return []
    out, bend = [describe_reference(one.reference_by)], one.registration.bend
    if bend:
        out.append(f"A curvature (bow) of {say(abs(bend), 3)} over the common length was subtracted, because a bent "
                   f"datum and wear of that shape{area_of_bow(one.registration)} look alike.")
    return out


def _other_tracks(one: Comparison) -> list:
    """Each track beside the longest one, as a sentence; `compare.json` has all of their sizes."""
    if not one.tracks.others:
        return []
    count = len(one.tracks.others) + 1
    out = [f"{count} tracks were found; the first sentence and the table describe the longest one."]
    for found in one.tracks.others:
        area = plain(1e12 * found["area_gross"].value, 4)
        out.append(f"Worn, too: {_sized(found)}the area lost in this track is {area} um^2.")
    return out


def _track(one: Comparison) -> str:
    """The longest track as the begin of a sentence."""
    if one.flanks is not None:
        return f"a track from about x = {_span(one.flanks.start, one.flanks.end)} in the second trace (after wear); "
    return _sized(one.tracks.sizes)


def _sized(found: dict) -> str:
    """A track by its sizes as the begin of a sentence; "" of none."""
    if not found:
        return ""
    ends = found["from"], found["to"]
    depths = f"{_length(found['depth_mean'])} deep on average, its floor {_length(found['depth_floor'])}; "
    if None not in (ends[0].value, ends[1].value):
        return f"a track from x = {_span(*(each.value for each in ends))} in the second trace (after wear), {depths}"
    places = [f"{word} {f'the {edge} of the common part' if each.value is None else f'x = {say(each.value, 4)}'}"
              for word, edge, each in zip(("from", "to"), ("beginning", "end"), ends)]
    return (f"a track {' '.join(places)} in the second trace (after wear), so the track may be longer than the "
            f"{say(found['width'].value)} that both traces show of it; there {depths}")


def _apart(one: Comparison) -> list:
    """What stands beside the wear: edges that the ratios leave out, a valley that is new."""
    cut = one.tracks.spans or one.flanks is not None
    out = ["Amplitude and slope are computed without the edges of the track."] if cut else []
    if one.tracks.valley is not None:
        place, depth = one.tracks.valley
        out.append(f"A valley {say(depth, 3)} deep at x = {say(place, 4)} is only in the second trace (after wear), "
                   "such as a scratch or a pit; the worn depths include this valley.")
    return out


def _span(first: float, last: float) -> str:
    """Two places [m] as words, both to the last of four digits of the farther one: one near 0 has no more than that."""
    step = 10.0 ** (np.floor(np.log10(max(abs(first), abs(last), 1e-12))) - 3)
    return " to ".join(say(float(np.round(place / step)) * step) for place in (first, last))


def _direction(when: str, amplitude: Quantity, slope: Quantity) -> str:
    parts = []
    for name, one in (("amplitude", amplitude), ("slope", slope)):
        if one.value is None:
            continue
        word = changed(one)
        shown = "no difference is shown" if word == "no change shown" else \
            f"{'smaller' if word == 'reduced' else 'larger'} along x, {sure(one)}"
        parts.append(f"{name} along x divided by that along y = {_range(one)}: {shown}")
    whole = "anisotropic" if changed(amplitude) in ("reduced", "increased") else "no anisotropy shown"
    return f"{when[0].upper() + when[1:]}: {whole}; " + "; ".join(parts) + "."


def would_show(least: float) -> str:
    """How deep a track would have been found, as a sentence."""
    return ("A track over the middle third of the common length, with both of its flanks unworn, would have been found "
            f"from a mean depth of {say(least, 2)} on.")
