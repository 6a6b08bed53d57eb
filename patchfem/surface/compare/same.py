"""Whether two traces run over the same place: found by their valleys, part by part, or told; or why they do not."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array, say
from ..profile import Profile
from .alignment import SHORT_END, Alignment, align
from .errors import correlation_length
from .place import CLEAR, Match, alone, matched, matched_in_parts, prepared
from .worn import balance

# Noise of the registration over the root mean square height, and likeness that goes with it: where valleys agree to
# 2 %, less likeness will do. A noise above 10 % may be wear of the valleys too, unless it is white: wear moves
# neighbouring heights alike, noise of the instrument does not.
ENOUGH = ((0.1, CLEAR), (0.02, 2.5))
WHITE, NEIGHBOURS = 0.3, 1.5  # noise up to which white noise passes for that of the instrument; how many err alike
TOLD = 0.5  # white noise up to which a shift that was told is believed
NOTHING_GREW = 0.9  # balance of what is missing and what grew, beyond which wear alone stands in a registration
MOST = 0.6  # share of the heights that agree at a shift that was told, beyond what chance brings at WHITE: 0.41
SHARE = 0.08  # of the heights, at least, unworn
MARK = "if both traces were measured from the same mark, use --shift '0 mm'"


class Place(NamedTuple):
    """match: the search; found: `Alignment`, None where the places are not the same, and why, in words; order:
    whether the traces show a place when they are taken the other way round; before, after: the traces as they were
    compared; mirrored: whether one of them was mirrored along x for that."""

    match: Match | None
    found: Alignment | None
    why: str = ""
    order: bool = False
    before: Profile | None = None
    after: Profile | None = None
    mirrored: bool = False


def found_place(before: Profile, after: Profile, shift: float | None = None, bow: bool = True) -> Place:
    """Find the place that both traces share, as they are, else with the second one mirrored.

    A surface that repeats itself, and a known shift, are taken as they are. bow: whether a bow may be taken out.
    """
    place = placed(before, after, shift, bow)._replace(before=before, after=after)
    if place.found is not None or shift is not None or (place.match.repeats and place.match.clear > CLEAR):
        return place
    other = _mirrored(after)
    match, found, _ = _searched(before, other, bow)
    if found is None:
        return place
    return Place(match, found, "", False, before, other, True)


def _mirrored(one: Profile) -> Profile:
    return replace(one, x=frozen_array(one.x[0] + one.x[-1] - one.x[::-1]), z=frozen_array(one.z[::-1]))


def placed(before: Profile, after: Profile, shift: float | None = None, bow: bool = True) -> Place:
    """Find the place that both traces share, by their valleys (`place`), else part by part (`matched_in_parts`).

    A place counts where it stands out from chance, only once, and the unworn heights agree there, within 10 % of the
    root mean square height or within 30 % where their differences are white noise. shift [m]: known from a mark; the
    search is left out then, and the fit starts there. bow: whether a bow may be taken out.
    """
    if shift is not None:
        return _told(before, after, shift, bow)
    match, found, valleys = _searched(before, after, bow)
    if found is not None:
        return Place(match, found)
    other = _align_reversed(before, after, match.shift) if match.clear > CLEAR and not match.repeats else None
    order = other is not None and _alike(other, match, _about_line(before.x, before.z)) \
        and _likelier(before, after, match.shift, other)
    return Place(match, None, _why(before, after, match, valleys), order)


def _searched(before: Profile, after: Profile, bow: bool = True) -> tuple:
    """(match, registration or None, match of the valleys of the whole traces)."""
    match = valleys = matched(before, after)
    found = None if match.repeats else _registered(before, after, match, bow)
    if found is None:
        parts = matched_in_parts(before, after)
        if parts is not None and parts.clear > CLEAR and not parts.repeats:
            match, found = parts, _registered(before, after, parts, bow)
    return match, found, valleys


def _align_reversed(before: Profile, after: Profile, shift: float) -> Alignment | None:
    """The first trace registered on the second one."""
    try:
        return align(after, before, -shift)
    except PatchfemError:
        return None


def _registered(before: Profile, after: Profile, match: Match, bow: bool) -> Alignment | None:
    """The traces registered at a match; None where their unworn heights do not agree there.

    Where a track is deeper than the valleys, most of the lowest heights may lie in it; the fit starts from all then.
    """
    if not match.clear > min(clear for _, clear in ENOUGH):
        return None
    try:
        found = align(before, after, match.shift, is_straight=not bow)
    except PatchfemError:
        return None
    return found if _same(found, match) else None


def _told(before: Profile, after: Profile, shift: float, bow: bool) -> Place:
    """The traces registered from a shift [m] that is known; refused where they do not agree near it."""
    first, _, step, _ = prepared(before, after)
    why = f"at the given shift of {say(shift)}, "
    try:
        found = align(before, after, shift, is_straight=not bow)
    except PatchfemError:
        return Place(None, None, why + "hardly any heights of the traces agree; is the shift right?")
    if abs(found.shift - shift) > alone(first) * step:
        return Place(None, None, why + f"the traces do not match: the best fit has a shift of {say(found.shift)}")
    if not (_mostly_agrees(found) or (_quiet(found, TOLD) and found.agreed > _share(found))):
        return Place(None, None, why + _apart(found) + ", which is no better than chance; is the shift right?")
    return Place(None, found)


def _share(found: Alignment) -> float:
    """Share of the heights, at least, that must be unworn: both flanks where the datum was declared straight."""
    return 2 * SHORT_END if found.is_straight else SHARE


def _height(found: Alignment) -> float:
    """Root mean square height [m] of the first trace about its line."""
    return _about_line(found.x, found.first)


def _about_line(x, z) -> float:
    return float(np.std(z - np.polyval(np.polyfit(x, z, 1), x)))


def _same(found: Alignment, match: Match) -> bool:
    """Whether the unworn heights of a registration are so many and so alike that the place is the same."""
    if _alike(found, match):
        return True
    quiet = _quiet(found, WHITE) and found.agreed > _share(found)
    return match.clear > CLEAR and (quiet or _mostly_agrees(found))


def _mostly_agrees(found: Alignment) -> bool:
    """Whether more heights agree than chance brings at this noise."""
    return found.agreed > MOST and found.noise < WHITE * _height(found)


def _alike(found: Alignment, match: Match, most: float = np.inf) -> bool:
    """The same for noise that may be wear: a floor that wore uniformly is no proof of the other order of the traces.

    most [m]: height that counts at most; a deep track is none of the roughness beside which noise is small.
    """
    height = min(_height(found), most)
    same = any(found.noise < noise * height and match.clear > clear for noise, clear in ENOUGH)
    return same and found.agreed > _share(found)


def _quiet(found: Alignment, most: float) -> bool:
    """Whether the noise is below 10 % of the height, or white and below a share of it."""
    share = found.noise / _height(found)
    if share < ENOUGH[0][0]:
        return True
    return share < most and correlation_length(np.asarray(found.depth), found.unworn) <= NEIGHBOURS


def _likelier(before: Profile, after: Profile, shift: float, other: Alignment) -> bool:
    """Whether the other order is likelier for traces that are too noisy for a place: a worn floor has a place too.

    It is where wear alone, and nothing grown, stands in it, and as given neither end of the traces is unworn.
    """
    if not balance(other) > NOTHING_GREW:
        return False
    try:
        found = align(before, after, shift)
    except PatchfemError:
        return True
    return not any(found.unworn_ends())


def _apart(found: Alignment) -> str:
    return (f"the best-matching {100 * found.unworn.mean():.0f} % of the heights still differ by {say(found.noise)}, "
            f"{100 * found.noise / _height(found):.0f} % of the root mean square height before wear")


def _why(before: Profile, after: Profile, match: Match, valleys: Match) -> str:
    """Why no place was found, in words to act on."""
    if valleys.repeats and valleys.clear > CLEAR and match is valleys:
        return (f"the surface is periodic, with a period of {say(_period(before, after))}, so shifts that are far "
                f"apart match equally well (correlations {valleys.likeness:.3f} and {valleys.second:.3f}); {MARK}")
    if match.clear > CLEAR and not match.repeats:
        try:
            found = align(before, after, match.shift)
        except PatchfemError:
            return f"at the most likely shift, {say(match.shift)}, hardly any heights are unworn"
        return (f"no unworn part was found that both traces show: at the most likely shift, {say(match.shift)}, "
                f"{_apart(found)}; {MARK}")
    mean, scatter = valleys.chance
    return (f"the two traces show no common part: the best correlation of their valleys is {valleys.likeness:.2f}, but "
            f"only values above {np.tanh(mean + CLEAR * scatter):.2f} are significant; {MARK}; if the "
            "heights of one trace count into the material, change their sign (the search for such traces was removed "
            "in patchfem 1.0)")


def _period(before: Profile, after: Profile) -> float:
    """Length [m] after which the first trace is most like itself again."""
    first, _, step, _ = prepared(before, after)
    power = np.abs(np.fft.rfft(first, 2 * first.size)) ** 2
    like = np.fft.irfft(power)[:first.size // 2]
    start = min(alone(first), like.size - 1)
    return float(start + np.argmax(like[start:])) * step
