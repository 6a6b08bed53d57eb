"""What carries a registration: unworn parts, valleys, or nothing, so that uniform wear, a wedge and a bend may hide."""

from typing import NamedTuple

import numpy as np

from ...core import say
from ...scales import plain
from ..profile import runs_of
from ..quantity import SIDE, Quantity, refused
from .alignment import LONG_END, SHORT_END, Alignment
from .model import Parameter
from .robust import REACH
from .section import Section, median_of_five

MIN_SAMPLES = 40  # samples of an unworn part
FILLED = 0.7  # fraction of unworn heights of an unworn part
WORN = 2 * REACH  # standard deviations of a worn place
SPECK_SAMPLES = 16  # samples at half of its depth from which a worn place is no speck of interpolation
MIN_LENGTH = 0.005  # fraction of the common length from which a worn place is no speck
NARROW_SAMPLES = 5  # samples at half of its depth of a place that is far deeper than noise
FAR = 20.0  # standard deviations of a depth that is far deeper than noise
CURVED, BOWED = 30.0, 0.75  # chi-squared of a bow in an unworn part, and its size in noises, from which it is none
TURNS, HIGHER, VALLEYS = 8, 0.65, 0.1  # worn tops, share of unworn heights that lie lower than they, share of valleys
HIDDEN = (
    "largest mean depth of wedge-shaped wear that is possible if the tilt between the traces (upper end of its "
    "interval) is due to wear alone; uniform wear of any depth would not be detected"
)
NO_LIMIT = "no limit"


class Reference(NamedTuple):
    """by: "parts", "valleys" or "" for nothing; parts: (from, to) [m] of the unworn parts in the x of the trace after;
    share: of the heights that are unworn."""

    by: str
    parts: tuple
    share: float


def find_reference(found: Alignment, section: Section) -> Reference:
    """What tells the worn heights of a registration from unworn ones.

    Unworn parts are runs of a twentieth of the length or more (a fiftieth, where the datum is straight) whose heights
    are unworn and straight, beside rubbed places (`_broad`); a part that is bowed is the foot of wear that runs out
    slowly. Valleys carry where more than eight worn tops stand between them. Without either, wear that is the same
    everywhere, a wedge, or a bow may be anything: specks where interpolation errs are no rubbed place.
    """
    off, x = median_of_five(section.depth / section.noise), found.x
    share = float(found.unworn.mean())
    places = deep_runs(off)
    tops = len(places) >= TURNS and _higher(found, off) > HIGHER
    if not tops and not _is_broad(found, off, places):
        return Reference("", (), share)
    covered = off <= REACH
    for first, last in _shallow_runs(found):
        covered[first : last + 1] = False
    long = [(a, b) for a, b in runs_of(covered) if _is_flank(found, a, b)]
    if long:
        return Reference("parts", tuple((float(x[a]), float(x[b])) for a, b in long), share)
    return Reference("valleys" if tops and share > VALLEYS else "", (), share)


def deep_runs(off) -> list:
    """First and last of each run of depths (n,) [deviations] that are no noise, and clearly none at the deepest."""
    return [(a, b) for a, b in runs_of(off > REACH) if off[a : b + 1].max() > WORN]


def _shallow_runs(found: Alignment) -> list:
    """Runs that the fit left out as worn although single heights do not show it."""
    left_out = ~found.unworn & (np.abs(found.depth) <= REACH * found.noise)
    return [(a, b) for a, b in runs_of(left_out) if b - a > MIN_SAMPLES]


def _is_broad(found: Alignment, off, places: list) -> bool:
    """Whether a deep place is wider than a speck, or narrow and far deeper than noise, as a scratch is."""
    if _shallow_runs(found) or _is_wide(found, off, places):
        return True
    for first, last in places:
        deep = off[first : last + 1]
        if (deep > deep.max() / 2).sum() >= NARROW_SAMPLES and deep.max() > FAR:
            return True
    return False


def _is_wide(found: Alignment, off, places: list) -> bool:
    """Whether one of the deep places is wider than a speck, at half of its depth too."""
    least = MIN_LENGTH * (found.x[-1] - found.x[0])
    return any(
        (off[a : b + 1] > off[a : b + 1].max() / 2).sum() >= SPECK_SAMPLES and found.x[b] - found.x[a] > least
        for a, b in places
    )


def _higher(found: Alignment, off) -> float:
    """Share of the unworn heights that lie lower than a clearly worn one, in the mean of these: 1 for tops cut off."""
    high = found.first - np.polyval(np.polyfit(found.x, found.first, 1), found.x)
    unworn = np.sort(high[off <= REACH])
    return float(np.searchsorted(unworn, high[off > WORN]).mean() / max(unworn.size, 1))


def _is_flank(found: Alignment, first: int, last: int) -> bool:
    """Whether a run of heights is long, unworn and straight."""
    least = SHORT_END if found.is_straight else LONG_END
    x, trim = found.x, (last - first) // 10
    part = slice(first + (trim if first else 0), last + 1 - (trim if last < x.size - 1 else 0))
    if x[last] - x[first] < least * (x[-1] - x[0]) or last - first < MIN_SAMPLES or found.unworn[part].mean() < FILLED:
        return False
    used = found.unworn[part]
    along, rest = np.linspace(-1, 1, used.size)[used], found.depth[part][used]
    base = np.linalg.qr(np.vander(along, 3, True))[0]
    bow = base[:, 1:].T @ rest
    size = float(np.sqrt((bow**2).sum() / rest.size))
    left = float(np.std(rest - base @ (base.T @ rest)))
    return not (float((bow**2).sum()) > CURVED * found.errors.correlation * left**2 and size > BOWED * found.noise)


def has_grown(found: Alignment, section: Section) -> bool:
    """Whether heights stand clearly above the first trace, wider than a speck."""
    off = median_of_five(-section.depth / section.noise)
    return _is_wide(found, off, deep_runs(off))


def limit_hidden_wear(found: Alignment | None, by: Reference | None) -> Quantity:
    """What a wedge may hide [m]: half of the tilt times the common length; no numbers where nothing can hide.

    A tilt between both traces is that of their mounting or of a wedge that wore off; its mean depth is then half of the
    tilt times the length. Uniform wear adds any depth, as does a mounting that turns a wedge back: there is no limit.
    """
    if found is None:
        return refused("m", HIDDEN, "the traces are not registered to each other")
    if by.by:
        return refused("m", HIDDEN, f"{_what(by)} are used for the alignment")
    length = float(found.x[-1] - found.x[0])
    return Quantity(
        (abs(found.slope) + SIDE * found.error_of(Parameter.SLOPE) / found.half) * length / 2, 0.0, None, "m", HIDDEN
    )


def cut_at_wear(by: Reference, extent) -> Reference:
    """The same with the unworn parts cut off where the wear begins and ends; extent: `worn.Extent` or None."""
    if extent is None:
        return by
    first, last = (one.value for one in extent.after)
    parts = ((a, min(b, first) if a < first else b) for a, b in by.parts)
    parts = ((max(a, last) if b > last else a, b) for a, b in parts)
    return by._replace(parts=tuple((a, b) for a, b in parts if b > a))


def _what(by: Reference) -> str:
    return "valleys between worn tops" if by.by == "valleys" else "unworn parts"


def describe_reference(by: Reference) -> str:
    """What the worn depths count from, as a sentence."""
    if by.by == "valleys":
        return (
            f"Depths are measured from the valleys between the worn tops. These valleys ({100 * by.share:.0f} % of "
            "the heights) agree in both traces and are taken as unworn; if the valleys also wore uniformly, the "
            "true depths are larger by the wear of the valleys."
        )
    spans = ", ".join(f"{say(a, 4)} to {say(b, 4)}" for a, b in by.parts[:4])
    more = f" and {len(by.parts) - 4} more" if len(by.parts) > 4 else ""
    return (
        f"Depths are measured from the parts in which the traces agree: x = {spans}{more} of the second trace "
        "(after wear). These parts are taken as unworn; if these parts also wore, uniformly or as a wedge, the "
        "true depths are larger by the wear of these parts."
    )


def describe_hidden_wear(found: Alignment, hidden: Quantity) -> str:
    """What may hide where nothing carries the registration, and what would settle it, as a sentence."""
    bow = (
        (
            f" A curvature (bow) of {say(abs(found.bend), 3)} was subtracted; this bow may come from a bent datum of "
            f"the instrument or from wear{area_of_bow(found)}."
        )
        if found.bend
        else ""
    )
    tilt, most = (plain(1e6 * one, 3) for one in (abs(found.slope), 2 * hidden.value / float(found.x[-1] - found.x[0])))
    within = "" if most == tilt else f" (up to {most} urad at the upper end of its interval)"
    return (
        "Uniform wear of any depth would give the same two traces. Wedge-shaped wear would also give the same two "
        f"traces if the worn part was mounted level for the second trace. The tilt of {tilt} urad between the "
        f"traces{within} may hide a mean worn depth of up to {say(hidden.value, 3)}: half the tilt times the "
        f"length.{bow} To tell wear from no wear, measure an unworn flank beside the rubbed part, or a reference "
        "mark, in both traces."
    )


def area_of_bow(found: Alignment) -> str:
    """The area under a bow that sags, as words: two thirds of the sag times the length."""
    area = found.bend * float(found.x[-1] - found.x[0]) * 2 / 3
    return f" that took {plain(1e12 * area, 3)} um^2 between both ends" if area > 0 else ""
