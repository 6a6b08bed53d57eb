"""Reference of the worn depth: unworn parts or valleys. If there is none, wear may be hidden."""

from typing import NamedTuple

import numpy as np

from ...formatting import format_length, format_number
from ..profile import find_runs
from ..quantity import SIDE, Quantity, make_unknown
from .alignment import LONG_FLANK, MAX_CHI2, MIN_UNWORN_FRACTION, SHORT_FLANK, Alignment
from .boxes import subtract_line
from .errors import correlation_length
from .model import Parameter
from .robust import MAX_UNWORN, MIN_UNWORN
from .section import Section, median_of_five

MIN_SAMPLES = 40  # smallest number of samples in an unworn part
# Smallest depth of the deepest height of a worn part, in standard deviations.
MIN_WORN_DEPTH = 2 * MAX_UNWORN
# Smallest number of samples of a worn valley at half its depth; a narrower one
# may be an interpolation error.
SPECK_SAMPLES = 16
NARROW_SAMPLES = 5  # smallest number of samples of a scratch at half its depth
MIN_SCRATCH = 20.0  # smallest depth of a scratch, in standard deviations
# Smallest depth of a scar in standard deviations of the drift: three times the width of
# an interval of +-2 deviations.
MIN_DEPTH_OVER_DRIFT = 12.0
MIN_TOPS = 8  # smallest number of worn tops for which the valleys between them are a reference
# Smallest mean fraction of unworn heights that were lower than a worn one before wear; the
# fraction is 1 if only tops wore off.
MIN_HIGHER = 0.65
HIDDEN_TEXT = (
    "largest mean depth of wedge-shaped wear that is possible if the tilt between the traces (upper end of its "
    "interval) is due to wear alone; uniform wear of any depth would not be detected"
)
NO_LIMIT = "no limit"


class Reference(NamedTuple):
    """Reference surface from which the worn depth is measured.

    - kind: "parts", "valleys", or "" without a reference.
    - parts: (from, to) [m] of each unworn part in x of the second trace.
    - unworn: fraction of the heights that are unworn.
    - has_wear: whether wear is seen, although there may be no reference for its depth.
    """

    kind: str
    parts: tuple
    unworn: float
    has_wear: bool = False


def find_reference(alignment: Alignment, section: Section) -> Reference:
    """Find unworn parts or valleys of aligned traces from which the worn depth can be measured.

    Unworn parts are at least a twentieth of the length (a fiftieth if the datum is straight) and beside worn
    places. Slight wear bends a part, so they are straight, or bent by a drift of at most a twelfth of the depth.
    Valleys are a reference if they lie between at least eight worn tops. Without either, the difference may
    be uniform wear, a wedge or a bow.

    Parameters
    ----------
    alignment : Alignment
    section : Section
        Section of the same traces.
    """
    relative = median_of_five(section.depth / section.noise)
    unworn = float(alignment.unworn.mean())
    places = find_deep_runs(relative)
    has_tops = len(places) >= MIN_TOPS and _higher_fraction(alignment, relative) > MIN_HIGHER
    worn = section.worn_heights
    if not has_tops and not _has_wear(relative, find_runs(worn)):
        return Reference("", (), unworn)
    is_unworn = (relative <= MAX_UNWORN) & ~worn
    deepest = float(median_of_five(section.depth).max())
    runs = [run for run in find_runs(is_unworn) if _is_flank(alignment, *run, deepest)]
    if runs:
        x = alignment.x
        parts = tuple((float(x[first]), float(x[last])) for first, last in runs)
        return Reference("parts", parts, unworn, has_wear=True)
    has_valleys = has_tops and unworn > MIN_UNWORN
    return Reference("valleys" if has_valleys else "", (), unworn, has_wear=True)


def find_deep_runs(relative) -> list:
    """Find runs (first, last) of depths (n,) [standard deviations] that exceed the noise."""
    runs = find_runs(relative > MAX_UNWORN)
    return [
        (first, last) for first, last in runs if relative[first : last + 1].max() > MIN_WORN_DEPTH
    ]


def _has_wear(relative, places: list) -> bool:
    """Return whether some worn run is wider than an interpolation error, or as deep as a scratch."""
    if _is_wide(relative, places):
        return True
    for first, last in places:
        deep = relative[first : last + 1]
        if (deep > deep.max() / 2).sum() >= NARROW_SAMPLES and deep.max() > MIN_SCRATCH:
            return True
    return False


def _is_wide(relative, places: list) -> bool:
    """Return whether more samples of a worn run exceed half its depth than in an interpolation error."""
    parts = [relative[first : last + 1] for first, last in places]
    return any((deep > deep.max() / 2).sum() >= SPECK_SAMPLES for deep in parts)


def _higher_fraction(alignment: Alignment, relative) -> float:
    """Return the mean fraction of unworn heights that were lower than a worn one before wear."""
    height = subtract_line(alignment.x, alignment.first)
    unworn = np.sort(height[relative <= MAX_UNWORN])
    n_lower = np.searchsorted(unworn, height[relative > MIN_WORN_DEPTH])
    return float(n_lower.mean() / max(unworn.size, 1))


def _is_flank(alignment: Alignment, first: int, last: int, deepest: float) -> bool:
    """Return whether a run of heights is long and unworn, and straight or hardly bent against the deepest wear [m]."""
    x = alignment.x
    min_length = (SHORT_FLANK if alignment.is_straight else LONG_FLANK) * (x[-1] - x[0])
    if x[last] - x[first] < min_length or last - first < MIN_SAMPLES:
        return False
    # Wear may begin in the tenth of the run that is next to the track.
    margin = (last - first) // 10
    start = first + margin if first else 0
    stop = last + 1 - margin if last < x.size - 1 else last + 1
    unworn = alignment.unworn[start:stop]
    if unworn.mean() < MIN_UNWORN_FRACTION:
        return False
    along = np.linspace(-1, 1, unworn.size)[unworn]
    depth = alignment.depth[start:stop][unworn]
    base = np.linalg.qr(np.vander(along, 3, True))[0]
    power = float(((base[:, 1:].T @ depth) ** 2).sum())
    scatter = float(np.std(depth - base @ (base.T @ depth)))
    correlation = correlation_length(np.asarray(alignment.depth), alignment.unworn)
    is_drift_small = MIN_DEPTH_OVER_DRIFT * np.sqrt(power / depth.size) < deepest
    return is_drift_small or power <= MAX_CHI2 * correlation * scatter**2


def has_grown(alignment: Alignment, section: Section) -> bool:
    """Return whether material above the first trace is clearly wider than an interpolation error."""
    relative = median_of_five(-section.depth / section.noise)
    return _is_wide(relative, find_runs(section.grown_heights))


def limit_hidden_wear(alignment: Alignment | None, reference: Reference | None) -> Quantity:
    """Estimate the mean depth [m] of wedge-shaped wear that may have caused the tilt.

    The tilt between both traces comes from their mounting or from a wedge that wore off, whose mean depth
    is half of the tilt times the length. There is no upper limit, because uniform wear of any depth, or a
    mounting that turns a wedge back, would not be seen. With a reference there is no value.
    """
    if alignment is None:
        return make_unknown("m", HIDDEN_TEXT, "the traces are not registered to each other")
    if reference.kind:
        reference_name = (
            "valleys between worn tops" if reference.kind == "valleys" else "unworn parts"
        )
        return make_unknown("m", HIDDEN_TEXT, f"{reference_name} are used for the alignment")
    length = float(alignment.x[-1] - alignment.x[0])
    error = SIDE * alignment.error_of(Parameter.SLOPE) / alignment.half
    return Quantity((abs(alignment.slope) + error) * length / 2, 0.0, None, "m", HIDDEN_TEXT)


def cut_at_wear(reference: Reference, extent) -> Reference:
    """Shorten the unworn parts to end at the first and last worn position (`worn.Extent` or None)."""
    if extent is None:
        return reference
    wear_start, wear_end = (end.value for end in extent.after)
    parts = []
    for start, end in reference.parts:
        if start < wear_start:
            end = min(end, wear_start)
        if end > wear_end:
            start = max(start, wear_end)
        if end > start:
            parts.append((start, end))
    return reference._replace(parts=tuple(parts))


def describe_reference(reference: Reference) -> str:
    """Describe the parts of the traces from which the worn depths are measured."""
    if reference.kind == "valleys":
        return (
            "Depths are measured from the valleys between the worn tops. These valleys "
            f"({100 * reference.unworn:.0f} % of "
            "the heights) agree in both traces and are taken as unworn; if the valleys also wore uniformly, the "
            "true depths are larger by the wear of the valleys."
        )
    listed_parts = reference.parts[:4]
    spans = ", ".join(
        f"{format_length(start, 4)} to {format_length(end, 4)}" for start, end in listed_parts
    )
    n_more = len(reference.parts) - len(listed_parts)
    more = f" and {n_more} more" if n_more else ""
    return (
        f"Depths are measured from the parts in which the traces agree: x = {spans}{more} of the second trace "
        "(after wear). These parts are taken as unworn; if these parts also wore, uniformly or as a wedge, the "
        "true depths are larger by the wear of these parts."
    )


def describe_hidden_wear(alignment: Alignment, hidden: Quantity) -> str:
    """Describe which wear may be hidden if there is no reference, and which measurement would show it."""
    bow = ""
    if alignment.bend:
        bow = (
            f" A curvature (bow) of {format_length(abs(alignment.bend), 3)} was subtracted; this "
            "bow may come from a bent datum "
            f"of the instrument or from wear{describe_bow_area(alignment)}."
        )
    length = float(alignment.x[-1] - alignment.x[0])
    tilt = format_number(1e6 * abs(alignment.slope), 3)
    max_tilt = format_number(1e6 * (2 * hidden.value / length), 3)
    within = (
        "" if max_tilt == tilt else f" (up to {max_tilt} urad at the upper end of its interval)"
    )
    return (
        "Uniform wear of any depth would give the same two traces. Wedge-shaped wear would also give the same two "
        f"traces if the worn part was mounted level for the second trace. The tilt of {tilt} urad between the "
        f"traces{within} may hide a mean worn depth of up to {format_length(hidden.value, 3)}: half the tilt times the "
        f"length.{bow} To tell wear from no wear, measure an unworn flank beside the rubbed part, or a reference "
        "mark, in both traces."
    )


def describe_bow_area(alignment: Alignment) -> str:
    """Describe the area under a sagging bow: two thirds of the sag times the length."""
    area = alignment.bend * float(alignment.x[-1] - alignment.x[0]) * 2 / 3
    return f" that took {format_number(1e12 * area, 3)} um^2 between both ends" if area > 0 else ""
