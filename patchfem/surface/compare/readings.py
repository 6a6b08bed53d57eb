"""Two readings of the same traces: a bent datum or a scar, growth or a scar, a datum that drifts or wear.

Each reading is a floor that the fit found (`alignment`); where the traces do not tell them apart there
is no worn depth, and the sentence gives the numbers of both.
"""

from typing import NamedTuple

import numpy as np

from ...core import say
from ...formatting import plain
from ..profile import Profile
from .alignment import SHORT_END, Alignment
from .boxes import N_PARTS, part_means, split_edges, subtract_line
from .errors import correlation_length
from .flanks import Flanks
from .section import median_of_five

# headlines of traces that two readings explain
BENT = "a scar or a bent datum, both are possible"
GREW = "a scar or material that grew at the ends, both are possible"
NOISE = "a scar or noise, both are possible"
DRIFT = "a scar or a datum that drifts, both are possible"
# depth of a scar over the standard deviation of slow errors: 3 of their widths
MIN_DEPTH_OVER_DRIFT = 12.0
# share of the variance of unworn parts that neighbouring parts have in common, in a drift
SLOW_SHARE = 0.5
# slow differences beside a track over its depth, from which its flanks are worn
MAX_FLANK_ERROR = 0.1
N_WAVES = 8  # half waves along the trace that a drift may have
LOUDER = 1.3  # noise over that of the traces that such waves leave where they explain all of the difference
MIN_BLOCKS = 12.0  # independent heights of the unworn part, below which its error is not known


class Reading(NamedTuple):
    """headline: what is possible, "" where there is a single reading; reason: why there is no depth."""

    headline: str
    reason: str


def find_readings(found: Alignment, is_referenced: bool, changed: bool) -> Reading:
    """Find whether two readings explain the traces.

    is_referenced: whether unworn parts or valleys are known; changed: whether they or growth show.
    """
    rival = found.rival
    if rival is not None and _differ(found, rival):
        told_apart = found.bend == 0 and (
            rival.bend != 0 or found.depth.mean() > rival.depth.mean()
        )
        if not (told_apart and is_referenced):
            bow, line = (rival, found) if told_apart else (found, rival)
            return Reading(_name(bow), describe_both(bow, line))
    if changed and drifts(found):
        return Reading(DRIFT, describe_drift(found))
    return Reading("", "")


def _differ(one: Alignment, other: Alignment) -> bool:
    """Whether two readings give different worn or grown areas, as printed."""
    return _worn(one) != _worn(other) or _grown_area(one) != _grown_area(other)


def _name(bow: Alignment) -> str:
    if bow.bend and not _has_grown_most(bow):
        return BENT
    return GREW if _has_changed(bow) else NOISE


def slow_means(depth, unworn=None) -> np.ndarray:
    """Means (k,) [m] of the depths, or of the unworn ones, in parts of the trace, about the line through them."""
    edges = split_edges(depth.size, N_PARTS)[:-1]
    unworn = np.ones(depth.size, bool) if unworn is None else unworn
    count = np.add.reduceat(unworn.astype(float), edges)
    means = (np.add.reduceat(np.where(unworn, depth, 0.0), edges) / np.maximum(count, 1))[count > 2]
    at = np.flatnonzero(count > 2)
    return subtract_line(at, means) if at.size > 2 else np.zeros(at.size)


def drifts(found: Alignment) -> bool:
    """Whether what looks worn may be a datum that drifts.

    The unworn parts vary slowly then, by a twelfth of the depth or more, or waves as slow as a drift
    explain all of the difference of the traces.
    """
    depth = np.asarray(found.depth)
    means = slow_means(depth, found.unworn)
    power = float(np.mean(means**2)) if means.size > 6 else 0.0
    slow = power - float(np.mean(np.diff(means) ** 2)) / 2 if means.size > 6 else 0.0
    place = (np.arange(depth.size) + 0.5) / depth.size
    waves = np.column_stack([place, *(np.cos(np.pi * k * place) for k in range(N_WAVES + 1))])
    left = depth - waves @ np.linalg.lstsq(waves, depth, rcond=None)[0]
    deepest = max(float(np.abs(slow_means(depth)).max()), float(median_of_five(left).max()))
    if slow > SLOW_SHARE * power and deepest < MIN_DEPTH_OVER_DRIFT * np.sqrt(slow):
        return True
    blocks = found.unworn.sum() / correlation_length(depth, found.unworn)
    if blocks < MIN_BLOCKS and deepest < MIN_DEPTH_OVER_DRIFT * found.noise:
        return True
    return found.bend != 0 and float(np.std(left)) < LOUDER * found.noise


def describe_both(bow: Alignment, line: Alignment) -> str:
    """Describe why there is no worn depth where both readings are possible, with the numbers of both."""
    if bow.bend and not _has_grown_most(bow):
        other = f"the datum bent by {say(bow.bend, 3)} (sag over the common length) and {_worn(bow)} at the ends"
    elif _has_changed(bow):
        other = (
            f"{_grown_area(bow)} um^2 of material grew at the ends, where it lies above the first "
            f"trace (before wear), and {_worn(bow)} elsewhere"
        )
    else:
        other = f"nothing grew and nothing wore off, and the traces differ by noise of {say(bow.noise, 3)}"
    return (
        f"two readings explain both traces alike: either {other}, or the ends are unworn and in a scar over most of "
        f"the trace {_worn(line)}, if the datum is straight; the flanks beside the scar are too short, or "
        "not on one straight line, to tell these readings apart; measure longer flanks, or the datum on a flat"
    )


def _has_changed(found: Alignment) -> bool:
    """Whether anything that can be printed grew or wore off in a reading."""
    return any(plain(1e12 * area, 3) != "0" for area in _areas(found))


def _has_grown_most(found: Alignment) -> bool:
    """Whether more material grew than wore off in a reading."""
    lost, grown = _areas(found)
    return grown > lost


def _areas(found: Alignment) -> tuple:
    """Lost and grown area [m2] of a reading."""
    step = float(np.ptp(found.x)) / (found.x.size - 1)
    deposit = found.depth < -4 * found.noise_at
    lost = max(float(found.depth[~deposit].sum()) * step, 0.0)
    return lost, float(-found.depth[deposit].sum()) * step


def _grown_area(found: Alignment) -> str:
    return plain(1e12 * _areas(found)[1], 3)


def _worn(found: Alignment) -> str:
    """Describe the wear of a reading, without an interval."""
    lost = _areas(found)[0]
    deepest = max(float(median_of_five(found.depth).max()), 0.0)
    return (
        f"{plain(1e12 * lost, 3)} um^2 wore off, {say(lost / float(np.ptp(found.x)), 3)} on average over the common "
        f"length and {say(deepest, 3)} at the deepest place"
    )


def describe_drift(found: Alignment) -> str:
    """Describe why there is no worn depth where the datum may drift, with the numbers of each reading."""
    along = np.linspace(-1, 1, found.depth.size)
    seen = float(np.ptp(slow_means(np.asarray(found.depth) - found.bend * along**2)))
    bent = (
        f" and the datum bent by {say(abs(found.bend), 3)} (over the common length)"
        if found.bend
        else ""
    )
    return (
        f"the traces differ slowly along x, by {say(seen, 3)} from the lowest to the highest place about a line, "
        "and what would be unworn differs in the same way, as with an instrument whose datum drifts; two readings "
        f"explain both traces: either nothing wore off and the datum drifted, or {_worn(found)}{bent}; measure "
        "the datum on a flat, or each trace twice to see the drift"
    )


def find_worn_flanks(
    before: Profile, after: Profile, shift: float, flanks: Flanks, is_straight: bool
) -> str:
    """Find whether flanks of the second trace are worn: why, "" where they may be unworn.

    At the shift [m] at which the traces agree best, their difference must be straight over unworn
    flanks: slow differences of a tenth of the depth are wear, or a datum that bends.
    """
    x = np.asarray(after.x)
    at = x - shift
    both = (at >= before.x[0]) & (at <= before.x[-1]) & ~after.missing
    known = ~before.missing
    x, off = x[both], np.interp(at[both], before.x[known], before.z[known]) - after.z[both]
    means = slow_means(off, (x < flanks.start) | (x > flanks.end))
    slow = float(means.max() - means.min()) if means.size else 0.0
    if slow < MAX_FLANK_ERROR * flanks.largest.value:
        return ""
    ends = np.minimum(np.arange(x.size), np.arange(x.size)[::-1]) < max(int(SHORT_END * x.size), 1)
    deep = off - np.polyval(np.polyfit(x[ends], off[ends], 1), x)
    means = part_means(deep, split_edges(x.size, N_PARTS))
    worn = (
        f"{say(float(deep.mean()), 3)} wore off on average over the common length and "
        f"{say(float(means.max()), 3)} at the deepest place"
    )
    if is_straight:
        two = f"if both outermost ends are unworn, {worn}; measure longer flanks"
    else:
        two = (
            "two readings explain both traces: either the datum bent, or, if it is straight and both outermost ends "
            f"are unworn, {worn}; measure longer flanks, or the datum on a flat"
        )
    return (
        f"beside a track that looks like one, the traces differ slowly along x by {say(slow, 3)}, so these parts "
        f"are not known to be unworn; {two}"
    )


def describe_other(found: Alignment | None) -> list:
    """Describe the other reading of the traces that is not taken, as a sentence; nothing without one."""
    if found is None or found.rival is None or found.is_straight or not _differ(found, found.rival):
        return []
    other = found.rival
    if other.bend:
        return [
            f"Other reading: a datum bent by {say(other.bend, 3)} over the common length, with "
            f"{plain(1e12 * _areas(other)[0], 3)} um^2 worn off at its ends. This reading is not taken, because both "
            "flanks lie on one straight line; a bow would have left this line only if the ends had worn off to it."
        ]
    return [
        f"Other reading: if the middle is unworn, {_grown_area(other)} um^2 of material lie above the first "
        "trace (before wear) at both ends. This reading is not taken, because both flanks agree with the first "
        "trace on one straight line and all heights between them lie lower."
    ]
