"""Two areal scans before and after in one frozen record: place, map, measures, and what they prove in words."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core import PatchfemError, frozen_array, say
from ..areal import Areal
from ..compare.robust import REACH
from ..quantity import Quantity, around, refused
from ..spikes import apart, spikes_of
from .alignment import ScanAlignment, align_scans
from .search import CLEAR, variant
from .track import ScanTrack, measure_scan_track
from .volumes import Volumes, measure_volumes, no_values

SHIFT = (
    "shift along {}: position of a point in the second scan (after wear) minus its position in the first, after "
    "rotation about the middle of the first scan"
)
ROTATION = "rotation of the second scan (after wear) relative to the first, anticlockwise"
ALIKE = 0.95  # correlation of the unworn heights of both scans above which they show the same place
ALIKE_UNCLEAR = (
    0.98  # the same where the search is no clearer than chance, as on a lay that repeats itself
)
SPECK_THRESHOLDS = (
    12.0,
    48.0,
    192.0,
)  # heights of a speck above its neighbours, in standard deviations of the noise
MIN_UNSEEN = 0.1  # fraction of the worn part without heights above which a sentence says so
HALF_TURN = 0.2  # rad from pi within which a scan is called rotated by 180 degrees
N_DIGITS = 4  # digits of volumes in sentences
WORN, NONE = "worn", "no wear shown"
GREW = "material grew, or the files are in the wrong order"
ELSEWHERE = "not comparable point by point"
HIDDEN = "mean depth of uniform or wedge-shaped wear that may have remained hidden"
OPEN = "changed: either one part is worn, or another part has grown"
EITHER = "in each of two parts the scans agree up to a plane, and either part may be the unworn one"
UNSURE = "the scans agree up to a plane: uniform or wedge-shaped wear would look the same"
GROWN = "apart from what grew, the scans agree up to a plane: uniform or wedge-shaped wear would look the same"


@dataclass(frozen=True, eq=False)
class Change:
    """Differences of two areal scans.

    Attributes
    ----------
    before, after : Areal
        The scans without spikes.
    found : ScanAlignment or None
    volumes : Volumes or None
        None, as `found`, where the scans show no common place; `why` says the reason.
    why : str
    removed : tuple of int
        Heights left out of each scan as spikes; specks of the depths count with the scan after.
    registration : dict of Quantity
        Shift and rotation by name.
    track : ScanTrack or None
        None where no wear is shown.
    """

    before: Areal
    after: Areal
    found: ScanAlignment | None
    volumes: Volumes | None
    why: str = ""
    removed: tuple = (0, 0)
    registration: dict = field(default_factory=dict)
    track: ScanTrack | None = None

    @property
    def values(self) -> dict:
        """Every `Quantity` by its name."""
        if self.volumes is None:
            return no_values(self.why)
        values = self.volumes.values
        if values["worn_volume"].low > 0:
            return values
        blank = no_values(_why_no_wear(self.volumes))
        return (
            blank | {"grown_volume": values["grown_volume"]}
            if values["grown_volume"].low > 0
            else blank
        )


def compare_scans(before: Areal, after: Areal, keep_spikes: bool = False) -> Change:
    """Compare two scans place by place.

    The scans are aligned as they are, mirrored, or inverted; where no place is common, the record says
    why. Spikes are left out unless `keep_spikes`.
    """
    removed = (0, 0)
    if not keep_spikes:
        before, n_before = without_spikes(before)
        after, n_after = without_spikes(after)
        removed = n_before, n_after
    try:
        found, volumes, n_specks = _aligned(before, after, keep_spikes)
        if (
            found.guess.turned
            and volumes.values["grown_volume"].value > volumes.values["worn_volume"].value
        ):
            before, guess = (
                variant(before, "", True),
                found.guess,
            )  # the heights of the first scan are inverted then
            found, volumes, n_specks = _aligned(before, variant(after, "", True), keep_spikes)
            found = replace(found, guess=guess)
    except PatchfemError as error:
        return Change(before, after, None, None, str(error), removed, _placement(None, str(error)))
    track = None
    if volumes.values["worn_volume"].low > 0:
        track = measure_scan_track(
            found, volumes.filled, volumes.worn, (before.x, before.y), volumes.error
        )
    removed = removed[0], removed[1] + n_specks
    return Change(before, after, found, volumes, "", removed, _placement(found, ""), track)


def _aligned(before: Areal, after: Areal, keep_spikes: bool) -> tuple:
    """Return alignment, volumes and the number of specks left out; PatchfemError where no place is common."""
    found = align_scans(before, after)
    least = ALIKE if found.guess.clear > CLEAR else ALIKE_UNCLEAR
    if found.likeness <= least:
        raise PatchfemError(
            "the two scans show no common area: the heights that agree up to a plane have a "
            f"correlation of {found.likeness:.3f}, but only values above {least:g} are significant; scan "
            "the same area before and after wear, including unworn parts beside the rubbed part"
        )
    found, n_specks = (found, 0) if keep_spikes else without_specks(found)
    return found, measure_volumes(found, before.x, before.y), n_specks


def without_specks(found: ScanAlignment) -> tuple:
    """Return an alignment without specks of the depths, and how many heights these are.

    A speck is a few heights side by side that stand off all of their neighbours, as dust, dropouts
    and what is left of a spike do and worn tops do not.
    """
    specks = np.zeros(found.depth.shape, bool)
    for threshold in SPECK_THRESHOLDS:
        with np.errstate(invalid="ignore"):
            far = np.abs(found.depth) > threshold * found.noise
        specks |= apart(found.depth, far, threshold * found.noise)
    if not specks.any():
        return found, 0
    other = None if found.other is None else without_specks(found.other)[0]
    depth = np.where(specks, np.nan, found.depth)
    return replace(found, depth=depth, used=found.used & ~specks, other=other), int(specks.sum())


def _placement(found: ScanAlignment | None, why: str) -> dict:
    """Return shift and rotation as quantities by name."""
    texts = {
        "shift_x": ("m", SHIFT.format("x")),
        "shift_y": ("m", SHIFT.format("y")),
        "rotation": ("rad", ROTATION),
    }
    if found is None:
        return {name: refused(*text, why) for name, text in texts.items()}
    values = (*found.shift, found.angle)
    errors = np.sqrt(np.diag(found.covariance))[[1, 2, 0]]
    return {
        name: around(value, error, *texts[name])
        for name, value, error in zip(texts, values, errors)
    }


def without_spikes(scan: Areal) -> tuple:
    """Return a scan without its spikes (`spikes_of`), and how many there were."""
    missing, spikes = scan.missing, spikes_of(scan)
    if not spikes.any():
        return scan, 0
    z = np.where(spikes, np.nan, scan.z)
    note = (
        f"{scan.source}: {spikes.sum()} of {(~missing).sum()} heights are spikes or dropouts and are left out; "
        "use --keep-spikes to keep them"
    )
    return replace(scan, z=frozen_array(z), notes=(*scan.notes, note)), int(spikes.sum())


def hidden_wear(change: Change) -> Quantity:
    """Return why no number tells what uniform wear or a wedge may hide."""
    if change.volumes is None:
        return refused("m", HIDDEN, change.why)
    if change.volumes.values["worn_volume"].low > 0:
        return refused("m", HIDDEN, "unworn parts are used for the alignment")
    return refused("m", HIDDEN, _why_no_wear(change.volumes))


def _why_no_wear(volumes: Volumes) -> str:
    """Return why no wear is shown."""
    if volumes.open:
        return EITHER
    return GROWN if volumes.values["grown_volume"].low > 0 else UNSURE


def headline(change: Change) -> str:
    """Return the verdict on wear or growth of two scans, in a few words."""
    if change.volumes is None:
        return ELSEWHERE
    worn, grown = (change.volumes.values[name] for name in ("worn_volume", "grown_volume"))
    if grown.low > 0 and grown.value > 2 * worn.value:
        return GREW
    if change.volumes.open:
        return OPEN
    return WORN if worn.low > 0 else NONE


def sentences(change: Change) -> list:
    """Return the verdict on wear or growth of two scans, in sentences."""
    if change.volumes is None:
        return [f"Worn volume: not available; {change.why}."]
    grown = change.volumes.values["grown_volume"]
    out = [*_variants(change), *_wear(change)]
    if change.track is not None and not change.track.why:
        out.append(_describe_track(change.track))
    if grown.low > 0:
        order = ", or the two files are in the wrong order." if headline(change) == GREW else "."
        out.append(
            f"{_volume(grown)} of material lie above the first scan (before wear): pile-up or deposits{order}"
        )
    share = (
        100
        * float(change.found.used.sum())
        / max(float(np.isfinite(change.found.depth).sum()), 1.0)
    )
    out.append(
        f"Depths are measured from the {share:.0f} % of the heights that agree within "
        f"{say(REACH * change.found.noise, 3)} once a plane is subtracted; if these heights also wore, "
        "uniformly or as a wedge, the true depths are larger by the wear of these heights."
    )
    if change.found.other is not None and not change.volumes.open:
        out.append(
            "Another part of the scans may be unworn instead, for example where two planes meet in an edge; the "
            "intervals cover both cases."
        )
    return out


def _wear(change: Change) -> list:
    """Return what is known of the wear, as sentences."""
    values = change.volumes.values
    worn, grown = values["worn_volume"], values["grown_volume"]
    if worn.low > 0:
        share = 100 * values["worn_share"].value
        text = (
            f"Worn: {_volume(worn)} over {share:.3g} % of the region that both scans "
            f"show, {_length(values['worn_depth_mean'])} on average over that region, "
            f"{_length(values['worn_depth_max'])} at the deepest place."
        )
        return [text, *_unseen(change)]
    if change.volumes.open:
        return [
            f"It is not known which part is unworn: {EITHER}. If the first part is unworn, up to {_upper_end(worn)} "
            f"wore off the second part; if the second part is unworn, up to {_upper_end(grown)} grew on the first "
            "part. To tell the two cases apart, scan farther beyond the rubbed part."
        ]
    return [
        "Worn volume: no wear detected. Uniform wear of any depth would give the same two scans. Wedge-shaped "
        "wear would also give the same two scans if the worn part was mounted level for the second scan. To "
        "tell wear from no wear, scan an unworn part beside the rubbed part before and after wear."
    ]


def _unseen(change: Change) -> list:
    """Return the fraction of the worn area with missing heights, as a sentence."""
    worn = change.volumes.worn
    share = float((worn & ~np.isfinite(change.found.depth)).sum()) / max(float(worn.sum()), 1.0)
    if share <= MIN_UNSEEN:
        return []
    return [
        f"{100 * share:.0f} % of the worn part has no heights in one scan or lies next to a hole: the depth there "
        "is taken from the nearest heights, so a deeper place may be missed."
    ]


def _describe_track(track: ScanTrack) -> str:
    """Return the wear track as a sentence."""
    values = track.values
    text = (
        f"A track at {np.degrees(values['direction'].value):.1f} degrees from x: on average over "
        f"{track.sections} sections it is {_length(values['width'])} wide and {_length(values['depth_mean'])} deep, "
        f"with its floor at {_length(values['depth_floor'])}; "
    )
    if values["volume"].value is None:
        return text + f"its volume is not known: {values['volume'].reason}."
    return (
        text
        + f"{_length(values['length'])} long, so that area times length is {_volume(values['volume'])}."
    )


def _variants(change: Change) -> list:
    """Return how the second scan was mirrored, rotated or inverted, as sentences."""
    out, guess = [], change.found.guess
    if guess.mirrored:
        out.append(
            f"The second scan (after wear) is mirrored: its {guess.mirrored} counts from the other end."
        )
    if abs(abs(change.registration["rotation"].value) - np.pi) < HALF_TURN:
        out.append("The second scan (after wear) is rotated by 180 degrees.")
    if guess.turned:
        out.append(
            "In one scan the heights point out of the material, in the other scan into the material. One scan "
            "was inverted here: the one with which more material is lost than gained. Check in which file the "
            "heights point into the material."
        )
    return out


def describe_variant(change: Change) -> str:
    """Return what was mirrored or inverted, for the headline."""
    if change.found is None:
        return ""
    words = ["mirrored"] * bool(change.found.guess.mirrored) + [
        "turned over"
    ] * change.found.guess.turned
    return f"one scan is {' and '.join(words)} relative to the other" if words else ""


def _upper_end(volume: Quantity) -> str:
    """Return the upper end of a volume as words."""
    scale, unit = _unit_of(volume)
    return f"{volume.high * scale:.{N_DIGITS}g} {unit}"


def _unit_of(volume: Quantity) -> tuple:
    """Return how many units a cubic metre has, and the unit: um^3, or mm^3 from a thousandth of one on."""
    return (1e9, "mm^3") if max(volume.high, 0.0) >= 1e-12 else (1e18, "um^3")


def _volume(volume: Quantity) -> str:
    """Return a volume with its interval as words."""
    scale, unit = _unit_of(volume)
    value, low, high = (f"{one * scale:.{N_DIGITS}g}" for one in volume[:3])
    return f"{value} {unit} ({low} to {high})"


def _length(length: Quantity) -> str:
    """Return a length with its interval as words."""
    return f"{say(length.value)} ({say(length.low)} to {say(length.high)})"
