"""Decision whether two traces show the same part of a surface."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ...formatting import format_length
from ..profile import Profile
from .alignment import SHORT_FLANK, Alignment, align
from .boxes import subtract_line
from .errors import correlation_length
from .robust import MIN_UNWORN
from .search import (
    MIN_CLEARANCE,
    Match,
    decorrelation_lag,
    find_period,
    resample_both,
    search_shift,
    search_shift_in_parts,
)
from .worn import wear_balance

# Largest ratio of noise to rms height at a match; a larger one may be due to wear of the valleys.
MAX_NOISE = 0.1
MAX_LOW_NOISE = 0.02  # largest ratio of noise to rms height for which a smaller clearance suffices
MIN_LOW_CLEARANCE = 2.5  # this smaller clearance, in standard deviations of random traces
# Largest ratio of white noise to rms height at a match; only instruments cause white noise.
MAX_WHITE_NOISE = 0.3
# Largest ratio of white noise to rms height at a shift that the user gave.
MAX_WHITE_NOISE_AT_MARK = 0.5
MAX_WHITE_LENGTH = 1.5  # largest correlation length of white noise, in samples
# Smallest ratio (lost - grown) / (lost + grown) of areas for which wear alone explains the change.
MIN_WEAR_BALANCE = 0.9
# Smallest fraction of agreeing heights at a match; most traces of different surfaces have fewer.
MIN_AGREED = 0.6
# Largest ratio of noise to rms height where that many heights agree; pairs at one position reach
# 0.19, saw teeth at two positions 0.29.
MAX_AGREED_NOISE = 0.2
USE_SAME_MARK = "if both traces were measured from the same mark, use --shift '0 mm'"


class Place(NamedTuple):
    """Common part of two traces, or the reason why there is none.

    - match: result of the search; None if the shift is given.
    - alignment: alignment of the common part, None if there is none.
    - reason: reason why there is no alignment.
    - is_reversed: whether the traces have a common part if the second one is taken as the unworn
      one.
    - before, after: traces as they were compared.
    - is_mirrored: whether the second trace was mirrored.
    """

    match: Match | None
    alignment: Alignment | None
    reason: str = ""
    is_reversed: bool = False
    before: Profile | None = None
    after: Profile | None = None
    is_mirrored: bool = False


class _Candidate(NamedTuple):
    """Match with its alignment, which is None if it fails, and the match of the valleys."""

    match: Match
    alignment: Alignment | None
    valleys: Match


def find_place(
    before: Profile, after: Profile, shift: float | None = None, *, is_straight: bool = False
) -> Place:
    """Find the common part of two traces, with the second one unchanged or mirrored.

    Traces of a periodic surface, and traces at a known shift, are not mirrored.

    Parameters
    ----------
    before, after : Profile
    shift : float, optional
        Shift [m] that is known from a mark.
    is_straight : bool
        Whether the datum is known to be straight, so that no bow is subtracted.
    """
    place = find_place_as_given(before, after, shift, is_straight=is_straight)
    place = place._replace(before=before, after=after)
    if place.alignment is not None or shift is not None:
        return place
    if place.match.is_ambiguous and place.match.is_significant:
        return place
    x = frozen_array(after.x[0] + after.x[-1] - after.x[::-1])
    mirrored = replace(after, x=x, z=frozen_array(after.z[::-1]))
    match, alignment, _ = _search_place(before, mirrored, is_straight)
    if alignment is None:
        return place
    return Place(match, alignment, before=before, after=mirrored, is_mirrored=True)


def find_place_as_given(
    before: Profile, after: Profile, shift: float | None = None, *, is_straight: bool = False
) -> Place:
    """Find the common part of two traces, neither mirrored, by their valleys or part by part.

    The correlation must exceed that of chance at a single shift, and the unworn heights must agree there
    within 10 % of the rms height, or within 30 % if their differences are white noise. Parameters are
    those of `find_place`.
    """
    if shift is not None:
        return _align_at_mark(before, after, shift, is_straight)
    match, alignment, valleys = _search_place(before, after, is_straight)
    if alignment is not None:
        return Place(match, alignment)
    is_reversed = _is_reversed(before, after, match)
    return Place(match, None, _describe_failure(before, after, match, valleys), is_reversed)


def _search_place(before: Profile, after: Profile, is_straight: bool) -> _Candidate:
    """Search for the common part by the valleys, and part by part if the valleys do not show it."""
    match = search_shift(before, after)
    valleys = match
    alignment = None
    if not match.is_ambiguous:
        alignment = _align_at_match(before, after, match, is_straight)
    if alignment is None:
        parts = search_shift_in_parts(before, after)
        if parts is not None and parts.is_significant and not parts.is_ambiguous:
            match = parts
            alignment = _align_at_match(before, after, parts, is_straight)
    return _Candidate(match, alignment, valleys)


def try_align(
    before: Profile, after: Profile, shift: float, is_straight: bool = False
) -> Alignment | None:
    """Align two traces (`align`), or return None if hardly any heights agree."""
    try:
        return align(before, after, shift, is_straight=is_straight)
    except PatchfemError:
        return None


def _align_at_match(
    before: Profile, after: Profile, match: Match, is_straight: bool
) -> Alignment | None:
    """Align two traces at a match, or return None if their unworn heights do not agree there."""
    if not match.clearance > min(MIN_CLEARANCE, MIN_LOW_CLEARANCE):
        return None
    alignment = try_align(before, after, match.shift, is_straight)
    if alignment is None or not _is_same_place(alignment, match):
        return None
    return alignment


def _align_at_mark(before: Profile, after: Profile, shift: float, is_straight: bool) -> Place:
    """Align two traces at a known shift [m], or state why they do not agree there."""
    start = f"at the given shift of {format_length(shift)}, "
    alignment = try_align(before, after, shift, is_straight)
    if alignment is None:
        return Place(
            None, None, f"{start}hardly any heights of the traces agree; is the shift right?"
        )
    resampled = resample_both(before, after)
    if abs(alignment.shift - shift) > decorrelation_lag(resampled.first) * resampled.step:
        best = format_length(alignment.shift)
        return Place(
            None, None, f"{start}the traces do not match: the best fit has a shift of {best}"
        )
    is_quiet = _is_quiet(alignment, MAX_WHITE_NOISE_AT_MARK) and _has_enough_unworn(alignment)
    if not (_has_high_agreement(alignment) or is_quiet):
        reason = f"{start}{_describe_noise(alignment)}, which is no better than chance; is the shift right?"
        return Place(None, None, reason)
    return Place(None, alignment)


def _has_enough_unworn(alignment: Alignment) -> bool:
    """Return whether enough heights agree for a reference; a straight datum needs more than two flanks."""
    return alignment.agreed_fraction > (2 * SHORT_FLANK if alignment.is_straight else MIN_UNWORN)


def _rms_height(x, z) -> float:
    """Return the root mean square height [m] about the least-squares line."""
    return float(np.std(subtract_line(x, z)))


def _relative_noise(alignment: Alignment) -> float:
    """Return the ratio of the noise to the root mean square height of the first trace."""
    return alignment.noise / _rms_height(alignment.x, alignment.first)


def _is_same_place(alignment: Alignment, match: Match) -> bool:
    """Return whether so many unworn heights agree so closely that the traces have a common part."""
    if _agrees_closely(alignment, match):
        return True
    is_quiet = _is_quiet(alignment, MAX_WHITE_NOISE) and _has_enough_unworn(alignment)
    return match.is_significant and (is_quiet or _has_high_agreement(alignment))


def _has_high_agreement(alignment: Alignment) -> bool:
    """Return whether more heights agree than in traces of different surfaces."""
    height = _rms_height(alignment.x, alignment.first)
    return alignment.agreed_fraction > MIN_AGREED and alignment.noise < MAX_AGREED_NOISE * height


def _agrees_closely(alignment: Alignment, match: Match, max_height: float = np.inf) -> bool:
    """Return whether the traces agree so closely that their noise need not be tested for whiteness.

    max_height [m] limits the height that the noise is compared with: the depth of a track does not
    count as roughness.
    """
    height = min(_rms_height(alignment.x, alignment.first), max_height)
    is_close = alignment.noise < MAX_NOISE * height and match.is_significant
    if not is_close:
        is_close = alignment.noise < MAX_LOW_NOISE * height and match.clearance > MIN_LOW_CLEARANCE
    return is_close and _has_enough_unworn(alignment)


def _is_quiet(alignment: Alignment, max_white: float) -> bool:
    """Return whether the relative noise is below 10 %, or white and below a limit."""
    noise = _relative_noise(alignment)
    if noise < MAX_NOISE:
        return True
    length = correlation_length(np.asarray(alignment.depth), alignment.unworn)
    return noise < max_white and length <= MAX_WHITE_LENGTH


def _is_reversed(before: Profile, after: Profile, match: Match) -> bool:
    """Return whether the traces match only in the reverse order, with the second one as the unworn trace.

    In this order wear alone must explain the difference, and in the given order neither end may be
    unworn, or the traces are too noisy for a match.
    """
    if not match.is_significant or match.is_ambiguous:
        return False
    reversed_alignment = try_align(after, before, -match.shift)
    if reversed_alignment is None or not _agrees_closely(
        reversed_alignment, match, _rms_height(before.x, before.z)
    ):
        return False
    if not wear_balance(reversed_alignment) > MIN_WEAR_BALANCE:
        return False
    alignment = try_align(before, after, match.shift)
    return alignment is None or not any(alignment.has_unworn_ends())


def _describe_noise(alignment: Alignment) -> str:
    return (
        f"the best-matching {100 * alignment.unworn.mean():.0f} % of the heights still differ by "
        f"{format_length(alignment.noise)}, {100 * _relative_noise(alignment):.0f} % of the root "
        "mean square height before wear"
    )


def _describe_failure(before: Profile, after: Profile, match: Match, valleys: Match) -> str:
    """Describe why no common part was found and what the user can do."""
    if valleys.is_ambiguous and valleys.is_significant and match is valleys:
        return (
            f"the surface is periodic, with a period of {format_length(find_period(before, after))}, so shifts that are far "
            f"apart match equally well (correlations {valleys.correlation:.3f} and {valleys.second:.3f}); {USE_SAME_MARK}"
        )
    if match.is_significant and not match.is_ambiguous:
        alignment = try_align(before, after, match.shift)
        if alignment is None:
            return f"at the most likely shift, {format_length(match.shift)}, hardly any heights are unworn"
        return (
            f"no unworn part was found that both traces show: at the most likely shift, {format_length(match.shift)}, "
            f"{_describe_noise(alignment)}; {USE_SAME_MARK}"
        )
    mean, scatter = valleys.chance
    threshold = np.tanh(mean + MIN_CLEARANCE * scatter)
    return (
        f"the two traces show no common part: the best correlation of their valleys is {valleys.correlation:.2f}, but "
        f"only values above {threshold:.2f} are significant; {USE_SAME_MARK}; if the "
        "heights of one trace count into the material, change their sign"
    )
