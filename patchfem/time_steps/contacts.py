"""Contact points of a rig or a bench: their laws, their ports, their loads, and the shear of their pieces."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..friction.bonds.parameters import Bonds
from ..friction.grooves import Grooves
from .laws import PointLaw
from .step_rows_kernels import Law

if TYPE_CHECKING:
    from ..contact.contact_sets import ContactSets


class BondSum(NamedTuple):
    """Settings of the sum over a list of bonds.

    - bonds: law
    - reach: cut-off in bond lengths
    - merge: widest merged strip in bond lengths at zero age; 0 merges nothing
    """

    bonds: Bonds
    reach: float
    merge: float


@dataclass(frozen=True, eq=False)
class PointSet:
    """Contact points that act on one port, that is, on one displacement of the rig such as the slide of an interface.

    - law: laws of the m points under their loads at the start
    - row (n,): displacement of the port per modal coordinate
    - nodes (m,): node whose normal force is the load of a point, RESULTANT or LOWER
    - shear: slip.shear_modes.ShearModes of pieces that deform, or None
    - is_spring: whether the point is a spring
    - shares (m,): load [N] of a point at the relative pressure 1 of the lower piece, with LOWER
    - places (m,): positions of the points [m], with LOWER
    """

    law: PointLaw
    row: np.ndarray
    nodes: np.ndarray | None = None
    shear: object = None
    is_spring: bool = False
    shares: np.ndarray | None = None
    places: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Contact:
    """Interfaces and springs of a rig with the load of the first interface.

    - point_sets: interfaces, then springs
    - limit: friction limit of all interfaces [N], or another force by which residuals are measured
    - length: elastic length of the first interface [m]
    - sets: contact sets of a patch whose pressure changes with heave and pitch
    - heave, pitch (n,): motions of the holder per modal coordinate, with `sets`
    - load: function of times (k,) [s] that returns a prescribed load [N]
    - preload: load at the start [N], with `sets`, `load` or `grooves`
    - bond_sum: sum over the bonds of points with lists
    - pressure (2, k): positions [m] and relative pressures of the lower piece
    - grooves: grooves whose flanks the first interface climbs
    - elements: slip.shear_modes.JenkinsSet whose elements are the points, or None
    """

    point_sets: list[PointSet]
    limit: float = 0.0
    length: float = 0.0
    sets: "ContactSets | None" = None
    heave: np.ndarray | None = None
    pitch: np.ndarray | None = None
    load: object = None
    preload: float = 1.0
    bond_sum: BondSum | None = None
    pressure: np.ndarray | None = None
    grooves: Grooves | None = None
    elements: object = None

    def is_rigid(self, point_set: PointSet) -> bool:
        """Return whether a set of points sticks without displacement."""
        return point_set.law.law == Law.COULOMB

    @property
    def set_valued(self) -> bool:
        """Whether the first interface sticks rigidly."""
        return bool(self.point_sets) and self.is_rigid(self.point_sets[0])

    @property
    def reduction(self):
        """Shear modes or elements to which a patch was reduced, or None."""
        return self.elements or (self.point_sets[0].shear if self.point_sets else None)

    @property
    def has_loads(self) -> bool:
        """Whether the load of a point changes, by the motion, with time, or as it slides."""
        parts = (self.sets, self.load, self.pressure, self.grooves)
        return any(part is not None for part in parts)
