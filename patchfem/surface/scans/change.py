"""Changes between two areal scans: alignment, depth map, volumes and sentences on wear."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core import PatchfemError, frozen_array
from ...formatting import format_length
from ..areal import Areal
from ..compare.robust import MAX_UNWORN
from ..quantity import Quantity, format_interval, make_quantity, make_unknown
from ..spikes import find_isolated, find_scan_spikes
from .alignment import ScanAlignment, align_scans
from .search import MIN_SIGNIFICANCE, transform_scan
from .track import ScanTrack, measure_scan_track
from .volumes import Volumes, measure_volumes, refuse_measures

PLACEMENT = {  # unit and definition of each quantity
    "shift_x": (
        "m",
        "shift along x: position of a point in the second scan (after wear) minus its position in "
        "the first, after rotation about the middle of the first scan",
    ),
    "shift_y": (
        "m",
        "shift along y: position of a point in the second scan (after wear) minus its position in "
        "the first, after rotation about the middle of the first scan",
    ),
    "rotation": (
        "rad",
        "rotation of the second scan (after wear) relative to the first, anticlockwise",
    ),
}
HIDDEN_WEAR_MEANING = "mean depth of uniform or wedge-shaped wear that may have remained hidden"
MIN_CORRELATION = 0.95  # smallest correlation of the unworn heights of scans of the same area
MIN_CORRELATION_UNSURE = 0.98  # smallest correlation if the search found no significant position
MIN_UNMEASURED = 0.1  # smallest fraction of the worn part without heights that a sentence reports
HALF_TURN_TOL = 0.2  # largest difference of a rotation from pi [rad] that counts as 180 degrees
N_DIGITS = 4  # number of significant digits of volumes in sentences
WORN_HEADLINE = "worn"
NONE = "no wear shown"
GREW = "material grew, or the files are in the wrong order"
ELSEWHERE = "not comparable point by point"
OPEN = "changed: either one part is worn, or another part has grown"
EITHER = "in each of two parts the scans agree up to a plane, and either part may be the unworn one"
UNSURE = "the scans agree up to a plane: uniform or wedge-shaped wear would look the same"
GROWN_HEADLINE = f"apart from what grew, {UNSURE}"


@dataclass(frozen=True, eq=False)
class Change:
    """Measured differences between two areal scans.

    - before, after: the scans without spikes.
    - volumes: measures of the depth map; None, like `alignment`, without a common place.
    - why: reason why the scans are not comparable, "" if they are.
    - removed: heights of each scan that are left out as spikes; specks in the depth count for
      the second.
    - registration: shift and rotation by name.
    - track: wear track, None where no wear is shown.
    """

    before: Areal
    after: Areal
    alignment: ScanAlignment | None
    volumes: Volumes | None
    why: str = ""
    removed: tuple = (0, 0)
    registration: dict = field(default_factory=dict)
    track: ScanTrack | None = None

    @property
    def values(self) -> dict:
        """All quantities of the comparison as a dict."""
        if self.volumes is None:
            return refuse_measures(self.why)
        values = self.volumes.values
        if values["worn_volume"].low > 0:
            return values
        blank = refuse_measures(_why_no_wear(self.volumes))
        if values["grown_volume"].low > 0:
            blank["grown_volume"] = values["grown_volume"]
        return blank


def compare_scans(before: Areal, after: Areal, keep_spikes: bool = False) -> Change:
    """Compare two scans point by point.

    The second scan is tried as given, mirrored and inverted. Spikes are left out unless
    `keep_spikes`. If the scans show no common place, the record states why.
    """
    removed = (0, 0)
    if not keep_spikes:
        before, n_before = remove_spikes(before)
        after, n_after = remove_spikes(after)
        removed = n_before, n_after
    try:
        alignment, volumes, n_specks = _align_and_measure(before, after, keep_spikes)
        values = volumes.values
        placement = alignment.placement
        if placement.is_inverted and values["grown_volume"].value > values["worn_volume"].value:
            # More material grew than wore off, so the heights of the
            # first scan point into the material.
            before = transform_scan(before, "", True)
            inverted = transform_scan(after, "", True)
            alignment, volumes, n_specks = _align_and_measure(before, inverted, keep_spikes)
            alignment = replace(alignment, placement=placement)
    except PatchfemError as error:
        reason = str(error)
        registration = {name: make_unknown(*meaning, reason) for name, meaning in PLACEMENT.items()}
        return Change(before, after, None, None, reason, removed, registration)
    track = None
    if volumes.values["worn_volume"].low > 0:
        axes = (before.x, before.y)
        track = measure_scan_track(alignment, volumes.filled, volumes.worn, axes, volumes.error)
    removed = removed[0], removed[1] + n_specks
    return Change(
        before, after, alignment, volumes, "", removed, _collect_registration(alignment), track
    )


def _align_and_measure(before: Areal, after: Areal, keep_spikes: bool) -> tuple:
    """Return alignment, volumes and number of specks; raise PatchfemError if the scans have no common part."""
    alignment = align_scans(before, after)
    is_significant = alignment.placement.significance > MIN_SIGNIFICANCE
    min_correlation = MIN_CORRELATION if is_significant else MIN_CORRELATION_UNSURE
    if alignment.correlation <= min_correlation:
        raise PatchfemError(
            "the two scans show no common area: the heights that agree up to a plane have a "
            f"correlation of {alignment.correlation:.3f}, but only values above {min_correlation:g} "
            "are significant; scan the same area before and after wear, including unworn parts "
            "beside the rubbed part"
        )
    n_specks = 0
    if not keep_spikes:
        alignment, n_specks = remove_specks(alignment)
    return alignment, measure_volumes(alignment, before.x, before.y), n_specks


def remove_specks(alignment: ScanAlignment) -> tuple:
    """Remove isolated outliers from the depth between two scans, and count them.

    A speck is a small group of heights that differs from all of its neighbours, such as dust, a
    dropout or the remainder of a spike. Worn asperities do not differ like this.
    """
    specks = find_isolated(alignment.depth, np.abs(alignment.depth), alignment.noise)
    if not specks.any():
        return alignment, 0
    alternative = alignment.alternative
    if alternative is not None:
        alternative, _ = remove_specks(alternative)
    depth = np.where(specks, np.nan, alignment.depth)
    unworn = alignment.unworn & ~specks
    out = replace(alignment, depth=depth, unworn=unworn, alternative=alternative)
    return out, int(specks.sum())


def _collect_registration(alignment: ScanAlignment) -> dict:
    """Return shift and rotation of the second scan as quantities."""
    values = (*alignment.shift, alignment.angle)
    errors = np.sqrt(np.diag(alignment.covariance))[[1, 2, 0]]
    return {
        name: make_quantity(value, error, *PLACEMENT[name])
        for name, value, error in zip(PLACEMENT, values, errors)
    }


def remove_spikes(scan: Areal) -> tuple:
    """Return a copy of a scan in which spikes are removed (`find_scan_spikes`), and the number of them."""
    spikes = find_scan_spikes(scan)
    count = int(spikes.sum())
    if not count:
        return scan, 0
    note = (
        f"{scan.source}: {count} of {(~scan.missing).sum()} heights are spikes or dropouts and are "
        "left out; use --keep-spikes to keep them"
    )
    z = frozen_array(np.where(spikes, np.nan, scan.z))
    return replace(scan, z=z, notes=(*scan.notes, note)), count


def refuse_hidden_wear(change: Change) -> Quantity:
    """Return the amount of wear that a plane may hide as an unknown quantity."""
    if change.volumes is None:
        return make_unknown("m", HIDDEN_WEAR_MEANING, change.why)
    if change.volumes.values["worn_volume"].low > 0:
        return make_unknown("m", HIDDEN_WEAR_MEANING, "unworn parts are used for the alignment")
    return make_unknown("m", HIDDEN_WEAR_MEANING, _why_no_wear(change.volumes))


def _why_no_wear(volumes: Volumes) -> str:
    """Explain in a sentence why a comparison shows no wear."""
    if volumes.is_ambiguous:
        return EITHER
    return GROWN_HEADLINE if volumes.values["grown_volume"].low > 0 else UNSURE


def find_headline(change: Change) -> str:
    """Return the verdict on wear or growth in a few words."""
    if change.volumes is None:
        return ELSEWHERE
    worn, grown = (change.volumes.values[name] for name in ("worn_volume", "grown_volume"))
    if grown.low > 0 and grown.value > 2 * worn.value:
        return GREW
    if change.volumes.is_ambiguous:
        return OPEN
    return WORN_HEADLINE if worn.low > 0 else NONE


def describe_change(change: Change) -> list:
    """Return the verdict on wear or growth in sentences."""
    if change.volumes is None:
        return [f"Worn volume: not available; {change.why}."]
    alignment = change.alignment
    grown = change.volumes.values["grown_volume"]
    out = [*_describe_placement(change), *_describe_wear(change)]
    if change.track is not None and not change.track.why:
        out.append(_describe_track(change.track))
    if grown.low > 0:
        order = ", or the two files are in the wrong order" if find_headline(change) == GREW else ""
        out.append(
            f"{_format_volume(grown)} of material lie above the first scan (before wear): pile-up "
            f"or deposits{order}."
        )
    n_measured = max(float(np.isfinite(alignment.depth).sum()), 1.0)
    out.append(
        f"Depths are measured from the {100 * alignment.unworn.sum() / n_measured:.0f} % of the "
        f"heights that agree within {format_length(MAX_UNWORN * alignment.noise, 3)} once a plane is subtracted; "
        "if these heights also wore, uniformly or as a wedge, the true depths are larger by the "
        "wear of these heights."
    )
    if alignment.alternative is not None and not change.volumes.is_ambiguous:
        out.append(
            "Another part of the scans may be unworn instead, for example where two planes meet in "
            "an edge; the intervals cover both cases."
        )
    return out


def _describe_wear(change: Change) -> list:
    """Describe the wear, or state why none is shown, in sentences."""
    values = change.volumes.values
    worn = values["worn_volume"]
    grown = values["grown_volume"]
    if worn.low > 0:
        text = (
            f"Worn: {_format_volume(worn)} over {100 * values['worn_share'].value:.3g} % of the "
            f"region that both scans show, {format_interval(values['worn_depth_mean'])} on average "
            f"over that region, {format_interval(values['worn_depth_max'])} at the deepest place."
        )
        return [text, *_describe_unmeasured(change)]
    if change.volumes.is_ambiguous:
        return [
            f"It is not known which part is unworn: {EITHER}. If the first part is unworn, up to "
            f"{_format_upper_bound(worn)} wore off the second part; if the second part is unworn, "
            f"up to {_format_upper_bound(grown)} grew on the first part. To tell the two cases "
            "apart, scan farther beyond the rubbed part."
        ]
    return [
        "Worn volume: no wear detected. Uniform wear of any depth would give the same two scans. "
        "Wedge-shaped wear would also give the same two scans if the worn part was mounted level "
        "for the second scan. To tell wear from no wear, scan an unworn part beside the rubbed "
        "part before and after wear."
    ]


def _describe_unmeasured(change: Change) -> list:
    """State which fraction of the worn area has no measured heights."""
    worn = change.volumes.worn
    missing = (worn & ~np.isfinite(change.alignment.depth)).sum()
    fraction = float(missing) / max(float(worn.sum()), 1.0)
    if fraction <= MIN_UNMEASURED:
        return []
    return [
        f"{100 * fraction:.0f} % of the worn part has no heights in one scan or lies next to a "
        "hole: the depth there is taken from the nearest heights, so a deeper place may be missed."
    ]


def _describe_track(track: ScanTrack) -> str:
    """Describe the wear track in a sentence."""
    values = track.values
    text = (
        f"A track at {np.degrees(values['direction'].value):.1f} degrees from x: on average over "
        f"{track.sections} sections it is {format_interval(values['width'])} wide and "
        f"{format_interval(values['depth_mean'])} deep, with its floor at "
        f"{format_interval(values['depth_floor'])}; "
    )
    if values["volume"].value is None:
        return text + f"its volume is not known: {values['volume'].reason}."
    return (
        f"{text}{format_interval(values['length'])} long, so that area times length is "
        f"{_format_volume(values['volume'])}."
    )


def _describe_placement(change: Change) -> list:
    """State in sentences whether the second scan is mirrored, rotated or inverted."""
    out = []
    placement = change.alignment.placement
    if placement.mirrored:
        out.append(
            f"The second scan (after wear) is mirrored: its {placement.mirrored} counts from the "
            "other end."
        )
    if abs(abs(change.registration["rotation"].value) - np.pi) < HALF_TURN_TOL:
        out.append("The second scan (after wear) is rotated by 180 degrees.")
    if placement.is_inverted:
        out.append(
            "In one scan the heights point out of the material, in the other scan into the "
            "material. One scan was inverted here: the one with which more material is lost than "
            "gained. Check in which file the heights point into the material."
        )
    return out


def describe_variant(change: Change) -> str:
    """State for the headline whether a scan was mirrored or inverted."""
    if change.alignment is None:
        return ""
    placement = change.alignment.placement
    words = ["mirrored"] * bool(placement.mirrored) + ["turned over"] * placement.is_inverted
    return f"one scan is {' and '.join(words)} relative to the other" if words else ""


def _choose_unit(volume: Quantity) -> tuple:
    """Choose the factor and the unit of a volume: mm^3 if it is at least 0.001 mm^3, or else um^3."""
    return (1e9, "mm^3") if max(volume.high, 0.0) >= 1e-12 else (1e18, "um^3")


def _format_upper_bound(volume: Quantity) -> str:
    """Format the upper bound of a volume."""
    factor, unit = _choose_unit(volume)
    return f"{volume.high * factor:.{N_DIGITS}g} {unit}"


def _format_volume(volume: Quantity) -> str:
    """Format a volume with its interval."""
    factor, unit = _choose_unit(volume)
    value, low, high = (f"{bound * factor:.{N_DIGITS}g}" for bound in volume[:3])
    return f"{value} {unit} ({low} to {high})"
