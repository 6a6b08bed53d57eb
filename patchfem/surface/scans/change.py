"""Two areal scans before and after in one frozen record: place, map, measures, and what they prove in words."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core import PatchfemError, frozen_array, say
from ..areal import Areal
from ..quantity import SIDE, Quantity, refused
from ..spikes import apart, spikes_of
from .registration import REACH, Laid, laid
from .search import CLEAR, variant
from .track import ScanTrack, track_of
from .volumes import Volumes, measured, nothing

SHIFT = ("shift along {}: position of a point in the second scan (after wear) minus its position in the first, after "
         "rotation about the middle of the first scan")
ROTATION = "rotation of the second scan (after wear) relative to the first, anticlockwise"
ALIKE = 0.95  # correlation of the unworn heights of both scans, from which on they show the same place
LIKELY = 0.98  # the same where the search is no clearer than chance, as on a lay that repeats itself
SPECK = 12.0, 48.0, 192.0  # noises that a speck of the depths jumps by
SEEN = 0.1  # of the worn part without heights, from which on this is told
DIGITS = 4
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
    """What `changed` found.

    before, after: the scans without spikes; found, volumes: None where they show no common place, for the reason why;
    removed: heights left out of each as spikes, specks of the depths counted with the scan after; registration: shift
    and rotation by name; track: None where no wear is shown.
    """

    before: Areal
    after: Areal
    found: Laid | None
    volumes: Volumes | None
    why: str = ""
    removed: tuple = (0, 0)
    registration: dict = field(default_factory=dict)
    track: ScanTrack | None = None

    @property
    def values(self) -> dict:
        """Every `Quantity` by its name."""
        if self.volumes is None:
            return nothing(self.why)
        found = self.volumes.values
        if found["worn_volume"].low > 0:
            return found
        blank = nothing(_unshown(self.volumes))
        return blank | {"grown_volume": found["grown_volume"]} if found["grown_volume"].low > 0 else blank


def changed(before: Areal, after: Areal, keep_spikes: bool = False) -> Change:
    """Compare two scans place by place.

    Spikes are left out unless keep_spikes. The scans are laid on each other as they are, mirrored, or turned over;
    where no place is common, the record says why.
    """
    removed = (0, 0)
    if not keep_spikes:
        (before, one), (after, two) = without_spikes(before), without_spikes(after)
        removed = one, two
    try:
        found, volumes, specks = _laid(before, after, keep_spikes)
    except PatchfemError as error:
        return Change(before, after, None, None, str(error), removed, _place(None, str(error)))
    if found.guess.turned and volumes.values["grown_volume"].value > volumes.values["worn_volume"].value:
        before, guess = variant(before, "", True), found.guess  # it counts into the material instead
        found, volumes, specks = _laid(before, variant(after, "", True), keep_spikes)
        found = replace(found, guess=guess)
    track = track_of(found, volumes.filled, volumes.worn, (before.x, before.y), volumes.error) \
        if volumes.values["worn_volume"].low > 0 else None
    return Change(before, after, found, volumes, "", (removed[0], removed[1] + specks), _place(found, ""), track)


def _laid(before: Areal, after: Areal, keep_spikes: bool) -> tuple:
    """(registration, volumes, number of specks left out); PatchfemError with the reason where no place is common."""
    found = laid(before, after)
    least = ALIKE if found.guess.clear > CLEAR else LIKELY
    if found.like <= least:
        raise PatchfemError("the two scans show no common area: the heights that agree up to a plane have a "
                            f"correlation of {found.like:.3f}, but only values above {least:g} are significant; scan "
                            "the same area before and after wear, including unworn parts beside the rubbed part")
    found, specks = (found, 0) if keep_spikes else without_specks(found)
    return found, measured(found, before.x, before.y), specks


def without_specks(found: Laid) -> tuple:
    """A registration without the few depths side by side that jump out of their neighbours, as dust, dropouts and what
    is left of a spike do and worn tops do not, and how many there were."""
    specks = np.zeros(found.depth.shape, bool)
    for least in SPECK:
        with np.errstate(invalid="ignore"):
            specks |= apart(found.depth, np.abs(found.depth) > least * found.noise, least * found.noise)
    if not specks.any():
        return found, 0
    other = None if found.other is None else without_specks(found.other)[0]
    return replace(found, depth=np.where(specks, np.nan, found.depth), used=found.used & ~specks, other=other), \
        int(specks.sum())


def _place(found: Laid | None, why: str) -> dict:
    """Shift and rotation as quantities by name."""
    texts = {"shift_x": ("m", SHIFT.format("x")), "shift_y": ("m", SHIFT.format("y")), "rotation": ("rad", ROTATION)}
    if found is None:
        return {name: refused(*one, why) for name, one in texts.items()}
    angle = float((found.angle + np.pi) % (2 * np.pi) - np.pi)
    values = dict(zip(texts, (*found.shift, angle)))
    deviations = np.sqrt(np.diag(found.covariance))
    errors = dict(zip(texts, (*deviations[1:3], deviations[0])))
    return {name: Quantity(float(values[name]), float(values[name] - SIDE * errors[name]),
                           float(values[name] + SIDE * errors[name]), *texts[name]) for name in texts}


def without_spikes(scan: Areal) -> tuple:
    """A scan without its spikes (`spikes_of`), and how many there were."""
    missing, spikes = scan.missing, spikes_of(scan)
    if not spikes.any():
        return scan, 0
    z = np.where(spikes, np.nan, scan.z)
    note = (f"{scan.source}: {spikes.sum()} of {(~missing).sum()} heights are spikes or dropouts and are left out; "
            "use --keep-spikes to keep them")
    return replace(scan, z=frozen_array(z), notes=(*scan.notes, note)), int(spikes.sum())


def hidden(one: Change) -> Quantity:
    """Why no number tells what uniform wear or a wedge may hide."""
    if one.volumes is None:
        return refused("m", HIDDEN, one.why)
    carried = one.volumes.values["worn_volume"].low > 0
    return refused("m", HIDDEN, "unworn parts are used for the alignment" if carried else _unshown(one.volumes))


def _unshown(found: Volumes) -> str:
    """Why no wear is shown."""
    return EITHER if found.open else GROWN if found.values["grown_volume"].low > 0 else UNSURE


def headline(one: Change) -> str:
    """What two scans prove about material, in a few words."""
    if one.volumes is None:
        return ELSEWHERE
    worn, grown = (one.volumes.values[name] for name in ("worn_volume", "grown_volume"))
    if grown.low > 0 and grown.value > 2 * worn.value:
        return GREW
    if one.volumes.open:
        return OPEN
    return WORN if worn.low > 0 else NONE


def sentences(one: Change) -> list:
    """What two scans prove about material, in sentences."""
    if one.volumes is None:
        return [f"Worn volume: not available; {one.why}."]
    out, values = _ways(one), one.volumes.values
    worn, grown = values["worn_volume"], values["grown_volume"]
    if worn.low > 0:
        out.append(f"Worn: {_volume(worn)} over {100 * values['worn_share'].value:.3g} % of the region that both scans "
                   f"show, {_length(values['worn_depth_mean'])} on average over that region, "
                   f"{_length(values['worn_depth_max'])} at the deepest place.")
        out += _unseen(one)
    elif one.volumes.open:
        out.append(f"It is not known which part is unworn: {EITHER}. If the first part is unworn, up to {_most(worn)} "
                   f"wore off the second part; if the second part is unworn, up to {_most(grown)} grew on the first "
                   "part. To tell the two cases apart, scan farther beyond the rubbed part.")
    else:
        out.append("Worn volume: no wear detected. Uniform wear of any depth would give the same two scans. "
                   "Wedge-shaped "
                   "wear would also give the same two scans if the worn part was mounted level for the second scan. To "
                   "tell wear from no wear, scan an unworn part beside the rubbed part before and after wear.")
    out += [] if one.track is None or one.track.why else [_track(one.track)]
    if grown.low > 0:
        out.append(f"{_volume(grown)} of material lie above the first scan (before wear): pile-up or deposits"
                   + (", or the two files are in the wrong order." if headline(one) == GREW else "."))
    share = 100 * float(one.found.used.sum()) / max(float(np.isfinite(one.found.depth).sum()), 1.0)
    out.append(f"Depths are measured from the {share:.0f} % of the heights that agree within "
               f"{say(REACH * one.found.noise, 3)} once a plane is subtracted; if these heights also wore, "
               "uniformly or as a wedge, the true depths are larger by the wear of these heights.")
    if one.found.other is not None and not one.volumes.open:
        out.append("Another part of the scans may be unworn instead, for example where two planes meet in an edge; the "
                   "intervals cover both cases.")
    return out


def _unseen(one: Change) -> list:
    """How much of the worn part has no heights, as a sentence."""
    worn = one.volumes.worn
    share = float((worn & ~np.isfinite(one.found.depth)).sum()) / max(float(worn.sum()), 1.0)
    return [f"{100 * share:.0f} % of the worn part has no heights in one scan or lies next to a hole: the depth there "
            "is taken from the nearest heights, so a deeper place may be missed."] if share > SEEN else []


def _track(one: ScanTrack) -> str:
    """The wear track as a sentence."""
    found = one.values
    text = (f"A track at {np.degrees(found['direction'].value):.1f} degrees from x: on average over "
            f"{one.sections} sections it is {_length(found['width'])} wide and {_length(found['depth_mean'])} deep, "
            f"with its floor at {_length(found['depth_floor'])}; ")
    if found["volume"].value is None:
        return text + f"its volume is not known: {found['volume'].reason}."
    return text + f"{_length(found['length'])} long, so that area times length is {_volume(found['volume'])}."


def _ways(one: Change) -> list:
    out, guess = [], one.found.guess
    if guess.mirrored:
        out.append(f"The second scan (after wear) is mirrored: its {guess.mirrored} counts from the other end.")
    if abs(abs(one.registration["rotation"].value) - np.pi) < 0.2:
        out.append("The second scan (after wear) is rotated by 180 degrees.")
    if guess.turned:
        out.append("In one scan the heights point out of the material, in the other scan into the material. One scan "
                   "was inverted here: the one with which more material is lost than gained. Check in which file the "
                   "heights point into the material.")
    return out


def over(one: Change) -> str:
    """What was mirrored or turned over, for the headline."""
    guess = one.found.guess if one.found is not None else None
    words = [] if guess is None else ["mirrored"] * bool(guess.mirrored) + ["turned over"] * guess.turned
    return f"one scan is {' and '.join(words)} relative to the other" if words else ""


def _most(one: Quantity) -> str:
    """The upper end of a volume as words."""
    scale, unit = _scale(one)
    return f"{one.high * scale:.{DIGITS}g} {unit}"


def _scale(one: Quantity) -> tuple:
    """um^3, or mm^3 from a thousandth of one on: (how many in a m^3, name)."""
    return (1e9, "mm^3") if max(one.high, 0.0) >= 1e-12 else (1e18, "um^3")


def _volume(one: Quantity) -> str:
    """A volume with its interval as words."""
    scale, unit = _scale(one)
    return f"{one.value * scale:.{DIGITS}g} {unit} ({one.low * scale:.{DIGITS}g} to {one.high * scale:.{DIGITS}g})"


def _length(one: Quantity) -> str:
    return f"{say(one.value)} ({say(one.low)} to {say(one.high)})"
