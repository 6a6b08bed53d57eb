"""Records of a comparison of two surfaces before and after wear: what it found, and the evidence.

Depth is the height before minus the height after, so that lost material has a positive depth. Codes
and numbers stand here; sentences are made where results are shown.
"""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..areal import Areal
from ..profile import Profile
from ..quantity import HALF_WIDTH_95, Quantity, read_definitions

if TYPE_CHECKING:
    from .depth_map import DepthMap

# Unit and definition of each quantity of a comparison, by name
COMPARISON_DEFINITIONS = read_definitions("comparison")


class Finding(NamedTuple):
    """Code of something that was found, and the numbers (SI) that a sentence about it needs."""

    code: str
    numbers: dict[str, float | int | str | None]


@dataclass(frozen=True, eq=False)
class Placement:
    """Place of the second surface on the first.

    - values: shift, tilt, scale of a trace; shift_x, shift_y, rotation of a scan; significance unless the place was given.
    - mirrored: axis along which the second surface was mirrored, "x" (traces) or "x", "y" (scans); "" if it was not.
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
    - direction: "x" or "y", along which traces run, or lines of scans are evaluated; "" if the user does not state it.
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
    """Return a quantity of a comparison from its name, its value and its interval.

    Unit and definition follow from the name. `low` and `high` are the ends of the interval, or None if they are not
    known.
    """
    bounds = [None if number is None else float(number) for number in (value, low, high)]
    return Quantity(*bounds, *COMPARISON_DEFINITIONS[name], name=name)


def name_estimate(name: str, value: float, error: float, least: float = -np.inf) -> Quantity:
    """Return the quantity of this name with its 95 % interval, which ends at the least possible value.

    Parameters
    ----------
    name : str
        Name of the quantity, such as "worn_depth_mean".
    value, error : float
        Value and its standard deviation.
    least : float, optional
        0 for a quantity that cannot be negative.
    """
    half_width = HALF_WIDTH_95 * error
    return name_quantity(name, value, max(value - half_width, least), value + half_width)


def name_unknown(name: str, reason: str) -> Quantity:
    """Return a quantity of a comparison without a value; `reason` is the code that says why it has none."""
    return Quantity(None, None, None, *COMPARISON_DEFINITIONS[name], reason, name)
