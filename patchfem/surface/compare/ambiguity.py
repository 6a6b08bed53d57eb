"""Ambiguous traces: scar or bent datum, scar or growth, wear or a drifting datum.

An interpretation is one of the floors that the fit finds (`alignment`). If two of them explain the traces
equally well, no worn depth is given, and a sentence states the numbers of both.
"""

from typing import NamedTuple

import numpy as np

from ...formatting import format_length, format_number
from ..profile import Profile, robust_deviation
from .alignment import SHORT_FLANK, Alignment
from .boxes import N_PARTS, average_parts, part_edges, subtract_line
from .errors import correlation_length
from .flanks import Flanks
from .reference import MIN_DEPTH_OVER_DRIFT, Reference
from .robust import MAX_NOISE
from .section import median_of_five

# Headlines of traces that have two interpretations.
BENT_DATUM_HEADLINE = "a scar or a bent datum, both are possible"
GROWN_ENDS_HEADLINE = "a scar or material that grew at the ends, both are possible"
NOISE = "a scar or noise, both are possible"
DRIFT = "a scar or a datum that drifts, both are possible"
# Smallest covariance of neighbouring unworn parts relative to their variance that shows a drift; it
# is near 1 for a drift and 0 for noise.
MIN_SLOW_FRACTION = 0.5
# Largest long-wave difference of the traces on the flanks relative to the depth of the track;
# above it, the flanks are worn.
MAX_FLANK_ERROR = 0.1
N_WAVES = 8  # largest number of half waves in the cosines that describe a drift along the trace
# Residual of these cosines relative to the noise, below which a drift explains the
# whole difference of the traces.
MAX_SCATTER_RATIO = 1.3
# Smallest number of independent unworn heights; fewer do not show how large their error is.
MIN_BLOCKS = 12.0


class Ambiguity(NamedTuple):
    """Headline of an ambiguity, or "" if there is none, and the reason why no depth is given."""

    headline: str
    reason: str


def find_ambiguity(alignment: Alignment, reference: Reference, *, has_grown: bool) -> Ambiguity:
    """Check whether two interpretations explain the traces equally well; wear without a reference may be a drift.

    Parameters
    ----------
    alignment : Alignment
    reference : Reference
    has_grown : bool
        Whether growth is seen.
    """
    rival = alignment.rival
    if rival is not None and _have_different_areas(alignment, rival):
        is_deeper = rival.bend != 0 or alignment.depth.mean() > rival.depth.mean()
        is_line = alignment.bend == 0 and is_deeper
        if not (is_line and reference.kind):
            bow, line = (rival, alignment) if is_line else (alignment, rival)
            return Ambiguity(_name_ambiguity(bow), describe_both(bow, line))
    is_changed = reference.has_wear or has_grown
    is_unreferenced = reference.has_wear and not reference.kind
    if is_unreferenced or (is_changed and may_be_drift(alignment)):
        return Ambiguity(DRIFT, describe_drift(alignment))
    return Ambiguity("", "")


def _have_different_areas(first: Alignment, second: Alignment) -> bool:
    """Return whether two interpretations give different worn or grown areas in the printed digits."""
    has_other_loss = _describe_loss(first) != _describe_loss(second)
    return has_other_loss or _format_grown_area(first) != _format_grown_area(second)


def _name_ambiguity(bow: Alignment) -> str:
    if bow.bend and not _growth_exceeds_wear(bow):
        return BENT_DATUM_HEADLINE
    return GROWN_ENDS_HEADLINE if _has_changed(bow) else NOISE


def detrended_means(depth, unworn=None) -> np.ndarray:
    """Average the (unworn) depths [m] over parts of the trace, and subtract a line from the means."""
    edges = part_edges(depth.size, N_PARTS)[:-1]
    unworn = np.ones(depth.size, bool) if unworn is None else unworn
    count = np.add.reduceat(unworn.astype(float), edges)
    means = (np.add.reduceat(np.where(unworn, depth, 0.0), edges) / np.maximum(count, 1))[count > 2]
    at = np.flatnonzero(count > 2)
    return subtract_line(at, means) if at.size > 2 else np.zeros(at.size)


def may_be_drift(alignment: Alignment) -> bool:
    """Return whether a drift of the datum may explain what looks like wear.

    This is so if the means of unworn parts vary slowly, with a standard deviation of a twelfth of the
    depth or more, or if cosines of at most eight half waves fit the whole difference of the traces.
    """
    depth = np.asarray(alignment.depth)
    means = detrended_means(depth, alignment.unworn)
    power = float(np.mean(means**2)) if means.size > 6 else 0.0
    slow = power - float(np.mean(np.diff(means) ** 2)) / 2 if means.size > 6 else 0.0
    place = (np.arange(depth.size) + 0.5) / depth.size
    waves = np.column_stack([place, *(np.cos(np.pi * k * place) for k in range(N_WAVES + 1))])
    residual = depth - waves @ np.linalg.lstsq(waves, depth, rcond=None)[0]
    deepest = max(
        float(np.abs(detrended_means(depth)).max()), float(median_of_five(residual).max())
    )
    if slow > MIN_SLOW_FRACTION * power and deepest < MIN_DEPTH_OVER_DRIFT * np.sqrt(slow):
        return True
    blocks = alignment.unworn.sum() / correlation_length(depth, alignment.unworn)
    if blocks < MIN_BLOCKS and deepest < MIN_DEPTH_OVER_DRIFT * alignment.noise:
        return True
    return alignment.bend != 0 and robust_deviation(residual) < MAX_SCATTER_RATIO * alignment.noise


def describe_both(bow: Alignment, line: Alignment) -> str:
    """Explain, with the values of both interpretations, why no worn depth is given."""
    if bow.bend and not _growth_exceeds_wear(bow):
        other = (
            f"the datum bent by {format_length(bow.bend, 3)} (sag over the common length) and "
            f"{_describe_loss(bow)} at the ends"
        )
    elif _has_changed(bow):
        other = (
            f"{_format_grown_area(bow)} um^2 of material grew at the ends, where it lies above the first "
            f"trace (before wear), and {_describe_loss(bow)} elsewhere"
        )
    else:
        other = f"nothing grew and nothing wore off, and the traces differ by noise of {format_length(bow.noise, 3)}"
    return (
        f"two readings explain both traces alike: either {other}, or the ends are unworn and in a scar over most of "
        f"the trace {_describe_loss(line)}, if the datum is straight; the flanks beside the scar are too short, or "
        "not on one straight line, to tell these readings apart; measure longer flanks, or the datum on a flat"
    )


def _has_changed(alignment: Alignment) -> bool:
    """Return whether an interpretation has growth or wear that is large enough to be printed."""
    return any(format_number(1e12 * area, 3) != "0" for area in _measure_areas(alignment))


def _growth_exceeds_wear(alignment: Alignment) -> bool:
    """Return whether more material grew than wore off in an interpretation."""
    lost, grown = _measure_areas(alignment)
    return grown > lost


def _measure_areas(alignment: Alignment) -> tuple:
    """Return the areas [m2] of lost and of deposited material in an interpretation of the traces."""
    step = float(np.ptp(alignment.x)) / (alignment.x.size - 1)
    deposit = alignment.depth < -MAX_NOISE * alignment.noise_at
    lost = max(float(alignment.depth[~deposit].sum()) * step, 0.0)
    return lost, float(-alignment.depth[deposit].sum()) * step


def _format_grown_area(alignment: Alignment) -> str:
    return format_number(1e12 * _measure_areas(alignment)[1], 3)


def _describe_loss(alignment: Alignment) -> str:
    """Describe the worn area, mean depth and largest depth of an interpretation."""
    lost = _measure_areas(alignment)[0]
    deepest = max(float(median_of_five(alignment.depth).max()), 0.0)
    return (
        f"{format_number(1e12 * lost, 3)} um^2 wore off, "
        f"{format_length(lost / float(np.ptp(alignment.x)), 3)} on average over the common "
        f"length and {format_length(deepest, 3)} at the deepest place"
    )


def describe_drift(alignment: Alignment) -> str:
    """Explain, with both interpretations, why no worn depth is given if the datum may drift."""
    along = np.linspace(-1, 1, alignment.depth.size)
    span = float(np.ptp(detrended_means(np.asarray(alignment.depth) - alignment.bend * along**2)))
    bent = ""
    if alignment.bend:
        bent = f" and the datum bent by {format_length(abs(alignment.bend), 3)} (over the common length)"
    return (
        f"the traces differ slowly along x, by {format_length(span, 3)} from the lowest to the highest place about a line, "
        "and what would be unworn differs in the same way, as with an instrument whose datum drifts; two readings "
        f"explain both traces: either nothing wore off and the datum drifted, or {_describe_loss(alignment)}{bent}; measure "
        "the datum on a flat, or each trace twice to see the drift"
    )


def find_worn_flanks(
    before: Profile, after: Profile, shift: float, flanks: Flanks, *, is_straight: bool
) -> str:
    """State why the flanks of a track are known to be worn, or return "" if they may be unworn.

    The difference of both traces is straight over unworn flanks. If its long-wave part varies there by a
    tenth of the depth of the track, the flanks are worn or the datum is bent.

    Parameters
    ----------
    before, after : Profile
    shift : float
        Shift [m] at which the traces agree best.
    flanks : Flanks
        Track of the second trace.
    is_straight : bool
        Whether the datum is known to be straight.
    """
    x = np.asarray(after.x)
    at = x - shift
    both = (at >= before.x[0]) & (at <= before.x[-1]) & ~after.missing
    known = ~before.missing
    x = x[both]
    difference = np.interp(at[both], before.x[known], before.z[known]) - after.z[both]
    means = detrended_means(difference, (x < flanks.start) | (x > flanks.end))
    slow = float(means.max() - means.min()) if means.size else 0.0
    if slow < MAX_FLANK_ERROR * flanks.largest.value:
        return ""
    ends = np.minimum(np.arange(x.size), np.arange(x.size)[::-1]) < max(
        int(SHORT_FLANK * x.size), 1
    )
    deep = difference - np.polyval(np.polyfit(x[ends], difference[ends], 1), x)
    means = average_parts(deep, part_edges(x.size, N_PARTS))
    worn = (
        f"{format_length(float(deep.mean()), 3)} wore off on average over the common length and "
        f"{format_length(float(means.max()), 3)} at the deepest place"
    )
    if is_straight:
        two = f"if both outermost ends are unworn, {worn}; measure longer flanks"
    else:
        two = (
            "two readings explain both traces: either the datum bent, or, if it is straight and both outermost ends "
            f"are unworn, {worn}; measure longer flanks, or the datum on a flat"
        )
    return (
        f"beside a track that looks like one, the traces differ slowly along x by {format_length(slow, 3)}, so these parts "
        f"are not known to be unworn; {two}"
    )


def describe_other(alignment: Alignment | None) -> list:
    """Describe the rejected interpretation in a sentence; an empty list if there is none."""
    if (
        alignment is None
        or alignment.rival is None
        or alignment.is_straight
        or not _have_different_areas(alignment, alignment.rival)
    ):
        return []
    other = alignment.rival
    if other.bend:
        return [
            f"Other reading: a datum bent by {format_length(other.bend, 3)} over the common length, with "
            f"{format_number(1e12 * _measure_areas(other)[0], 3)} um^2 worn off at its ends. This "
            "reading is not taken, because "
            "both flanks lie on one straight line; a bow would have left this line only if the ends had worn off to it."
        ]
    return [
        f"Other reading: if the middle is unworn, {_format_grown_area(other)} um^2 of material lie above the first "
        "trace (before wear) at both ends. This reading is not taken, because both flanks agree with the first "
        "trace on one straight line and all heights between them lie lower."
    ]
