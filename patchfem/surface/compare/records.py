"""Records of a comparison of two surfaces before and after wear: what it found, and the evidence.

Depth is the height before minus the height after, so that lost material has a positive depth. Codes
and numbers stand here; sentences are made where results are shown.
"""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..areal import Areal
from ..profile import Profile
from ..quantity import SIDE, Quantity

if TYPE_CHECKING:
    from .depth_map import DepthMap

# Unit and definition of each quantity of a comparison.
DEFINITIONS = {
    "shift": ("m", "x of a feature in the second trace minus its x in the first"),
    "scale": ("1", "length of the second trace divided by that of the first"),
    "gain": (
        "1",
        "factor by which the heights of the second surface were divided; 1 if no other gain of the instrument shows",
    ),
    "significance": (
        "1",
        "agreement of both surfaces at this place, in standard deviations of that at all other places",
    ),
    "common_length": ("m", "length that both traces show"),
    "common_area": ("m2", "area that both scans show"),
    "worn_depth_mean": ("m", "lost area or volume divided by the size of the common part"),
    "worn_depth_max": ("m", "largest depth"),
    "worn_depth_max_at": ("m", "x in the second trace of the largest depth"),
    "worn_depth_max_x": ("m", "x in the first scan of the largest depth"),
    "worn_depth_max_y": ("m", "y in the first scan of the largest depth"),
    "worn_area": ("m2", "area lost in the common part, per unit of width"),
    "grown_area": ("m2", "area above the first trace in the common part"),
    "worn_depth_within": ("m", "mean depth of the longest track: lost area divided by its width"),
    "worn_from_before": ("m", "x in the first trace at which the longest track begins"),
    "worn_to_before": ("m", "x in the first trace at which the longest track ends"),
    "worn_from_after": ("m", "x in the second trace at which the longest track begins"),
    "worn_to_after": ("m", "x in the second trace at which the longest track ends"),
    "amplitude_ratio": ("1", "rms of the waves from 60 to 110 um after wear divided by before"),
    "slope_ratio": (
        "1",
        "rms slope of the waves up to 110 um after wear divided by before, at the same step; with the noise of both",
    ),
    "hidden_wear": ("m", "largest mean wear that an even or wedge-shaped loss may hide"),
    "worn_volume": ("m3", "volume lost in the common part"),
    "grown_volume": ("m3", "volume above the first scan in the common part"),
    "worn_share": ("1", "worn area divided by the area of the common part"),
    "shift_x": ("m", "x of a feature in the second scan minus its x in the first"),
    "shift_y": ("m", "y of a feature in the second scan minus its y in the first"),
    "rotation": ("rad", "rotation of the second scan about the middle of the first, anticlockwise"),
    "from": ("m", "x in the second trace at which the track begins"),
    "to": ("m", "x in the second trace at which the track ends"),
    "width": ("m", "width of the track"),
    "depth_mean": ("m", "lost area divided by width"),
    "depth_floor": ("m", "mean depth of the deepest part that is a fifth of the width long"),
    "area_gross": ("m2", "area lost in the track"),
    "pile_up": ("m2", "area above the first trace within one width of the track on both sides"),
    "area_net": ("m2", "lost area less pile-up"),
    "Ra": ("m", "mean of the absolute heights of the roughness profile"),
    "Rq": ("m", "root mean square of the heights of the roughness profile"),
    "slope": ("m m-1", "root mean square slope of the roughness profile"),
}


class Finding(NamedTuple):
    """Code of something that was found, and the numbers (SI) that a sentence about it needs."""

    code: str
    numbers: dict[str, float | int | str | None]


@dataclass(frozen=True, eq=False)
class Placement:
    """Place of the second surface on the first.

    - values: shift, tilt, scale of a trace; shift_x, shift_y, rotation of a scan; significance unless the place was given.
    - mirrored: whether the second surface was mirrored, along "x" (traces) or "x", "y" (scans); "".
    - basis: "place" if heights are compared at the same place, "flanks" if the depth is measured
      below the unworn flanks of the second trace alone, "" if there is no reference.
    """

    values: dict[str, Quantity]
    mirrored: str = ""
    basis: str = "place"


@dataclass(frozen=True, eq=False)
class Track:
    """Single worn track of a trace.

    - values: from, to, width, depth_mean, depth_floor, area_gross, area_net, pile_up.
    - cut: whether the track leaves the common part at its beginning, and at its end.
    """

    values: dict[str, Quantity]
    cut: tuple[bool, bool] = (False, False)


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the numbers of a comparison rest on; None where there is no common place.

    - placement: how the second surface was laid on the first.
    - curves: depths and heights of the aligned surfaces.
    - roughness: {"inside", "outside": {"before", "after", "ratio": {"Ra", "Rq", "slope": Quantity}}}
      of the track, with the ratio after/before; {} without a track. `cutoff` [m] is that of these values.
    - removed: heights left out before and after as spikes, dropouts or dust.
    """

    placement: Placement | None = None
    curves: "DepthMap | None" = None
    roughness: dict[str, dict[str, dict[str, Quantity]]] = field(default_factory=dict)
    cutoff: float | None = None
    removed: tuple[int, int] = (0, 0)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Comparison of two surfaces.

    - before, after: the surfaces as read.
    - verdict: `Finding` with one of the codes of `compare`.
    - values: quantities by name, a missing value with the code of its reason.
    - tracks: worn tracks of traces, the longest one first.
    - findings: what else a reader must know.
    - evidence: placement, curves and roughness.
    - direction: "x", "y" or "".
    """

    before: Profile | Areal
    after: Profile | Areal
    verdict: Finding
    values: dict[str, Quantity]
    tracks: tuple[Track, ...] = ()
    findings: tuple[Finding, ...] = ()
    evidence: Evidence = Evidence()
    direction: str = ""

    @property
    def track(self) -> Track | None:
        """The longest track, or None."""
        return self.tracks[0] if self.tracks else None

    @property
    def is_areal(self) -> bool:
        """Whether scans are compared, not traces."""
        return isinstance(self.before, Areal)


def name_quantity(name: str, value: float, low: float | None, high: float | None) -> Quantity:
    """Return the quantity of this name with its interval."""
    bounds = [None if number is None else float(number) for number in (value, low, high)]
    return Quantity(*bounds, *DEFINITIONS[name], name=name)


def name_estimate(name: str, value: float, error: float, least: float = -np.inf) -> Quantity:
    """Return the quantity of this name with its 95 % interval, which ends at the least possible value.

    Parameters
    ----------
    name : str
    value, error : float
        Value and its standard deviation.
    least : float, optional
        0 for a quantity that cannot be negative.
    """
    return name_quantity(name, value, max(value - SIDE * error, least), value + SIDE * error)


def name_unknown(name: str, reason: str) -> Quantity:
    """Return the quantity of this name without a value; reason: its code."""
    return Quantity(None, None, None, *DEFINITIONS[name], reason, name)
