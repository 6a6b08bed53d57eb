"""What a comparison proves, in words: reduced or not, worn or not, anisotropic or not, at what confidence."""

import numpy as np

from ...core import say
from .compare import Comparison
from .extent import DEPOSITED
from .quantity import SIDE, Quantity

EXCHANGED = "the files may be in the wrong order, or material grew"
NEAR = 1e-6  # a ratio that close to one is one but for round-off


def verdicts(parts: list, directions: list = ()) -> tuple:
    """The headline and the sentences of one or two comparisons.

    directions: (when, amplitude ratio x over y, slope ratio) for each time at which both directions are known. The
    headline is "worn", where a depth is shown, then "reduced", "increased" or "no change shown", by the amplitude of
    the band in each direction; the first sentence says where and how deep. Unchanged surfaces are called "reduced" in
    2.5 of 100 cases, and as often "increased". Where the other order of the files is the likelier one, that is said
    before it.
    """
    words = [changed(one.amplitude_ratio) for one in parts]
    names = [f" along {one.direction}" if one.direction else "" for one in parts]
    same = len(set(words)) == 1
    headline = words[0] if same else ", ".join(word + name for word, name in zip(words, names))
    worn = ["worn"] * any(_sure(one.worn.mean) for one in parts)
    if worn and headline != "no change shown":
        headline = f"worn, waves {headline}"
    elif headline == "no change shown":
        told = worn + ["flatter"] * any(changed(one.slope_ratio) == "reduced" for one in parts)
        headline = " and ".join(told) + ", no change of the waves shown" if told else headline
    if any(one.exchanged for one in parts):
        headline = f"{EXCHANGED}; as given: {headline}"
    out = []
    for one, word, name in zip(parts, words, names):
        out += [_worn(one, name), _amplitude(one.amplitude_ratio, word, name), _slope(one.slope_ratio, name)]
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
    from scipy.stats import norm

    side = (ratio.high if ratio.value < 1 else ratio.low) / ratio.value
    error = abs(np.log(side)) / SIDE
    return float(2 * norm.cdf(abs(np.log(ratio.value)) / error) - 1) if error > 0 else 1.0


def sure(ratio: Quantity) -> str:
    """The confidence as words."""
    found = 100 * confidence(ratio)
    return "above 99.9 % confidence" if found > 99.9 else f"{np.floor(found * 10) / 10:.3g} % confidence"


def _range(ratio: Quantity) -> str:
    return f"{ratio.value:.3g} ({ratio.low:.3g} to {ratio.high:.3g})"


def _amplitude(ratio: Quantity, word: str, name: str) -> str:
    if ratio.value is None:
        return f"Amplitude{name}: {ratio.reason}."
    start = f"The waves of the band{name} have {_range(ratio)} of the amplitude before: "
    if word == "no change shown":
        return start + "the interval holds 1, no change is shown."
    return start + f"{word}, at {sure(ratio)}."


def _slope(ratio: Quantity, name: str) -> str:
    if ratio.value is None:
        return f"Slope{name}: {ratio.reason}."
    word = changed(ratio)
    tail = "no change is shown" if word == "no change shown" else \
        f"{'flatter' if word == 'reduced' else 'steeper'}, at {sure(ratio)}"
    return f"The slope{name} is {_range(ratio)} of that before: {tail}."


def _sure(mean: Quantity) -> bool:
    return mean.value is not None and mean.low > 0


def _length(one: Quantity) -> str:
    return f"{say(one.value)} ({say(one.low)} to {say(one.high)})"


def _worn(one: Comparison, name: str) -> str:
    mean = one.worn.mean
    if mean.value is None:
        text = f"Worn depth{name}: not available; {mean.reason}."
        if one.abbott is not None and one.abbott.value is not None:
            text += (f" The valley tails of the Abbott curves suggest {_length(one.abbott)}, if the surface is alike "
                     "everywhere and its valleys are unworn.")
        return text
    if not _sure(mean):
        return f"Worn depth{name}: none shown; at most {say(mean.high)} in the mean."
    what = "over the track below its unworn flanks" if one.reference == "flanks" else "over the common length"
    text = (f"Worn{name}: {_track(one)}{_length(mean)} in the mean {what}, {_length(one.worn.largest)} at the deepest "
            "place.")
    if one.worn.deposited > DEPOSITED * one.worn.area.value:
        text += f" {1e12 * one.worn.deposited:.3g} um^2 stand above the surface before: deposits."
    if one.worn.extent is not None:
        before, after = (_span(*(end.value for end in ends)) for ends in one.worn.extent)
        text += f" Worn from x = {before} of the trace before, that is from {after} of the trace after."
    return text


def _track(one: Comparison) -> str:
    """The longest track as the begin of a sentence."""
    start, end, depth = one.tracks[1:4]
    if one.flanks is not None:
        return f"a track from about x = {_span(one.flanks.start, one.flanks.end)} of the trace after; "
    if depth is None:
        return ""
    return f"a track from x = {_span(start.value, end.value)} of the trace after, {_length(depth)} deep in the mean; "


def _apart(one: Comparison) -> list:
    """What stands beside the wear: edges that the ratios leave out, a valley that is new."""
    cut = one.tracks.spans or one.flanks is not None
    out = ["Amplitude and slope leave out the edges of the track."] if cut else []
    if one.tracks.valley is not None:
        place, depth = one.tracks.valley
        out.append(f"A valley {say(depth, 3)} deep at x = {say(place, 4)} is in the trace after only: a scratch or a "
                   "pit; the worn depths hold it too.")
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
            f"{'smaller' if word == 'reduced' else 'larger'} along x, at {sure(one)}"
        parts.append(f"{name} along x over along y {_range(one)}: {shown}")
    whole = "anisotropic" if changed(amplitude) in ("reduced", "increased") else "no anisotropy shown"
    return f"{when[0].upper() + when[1:]}: {whole}; " + "; ".join(parts) + "."
