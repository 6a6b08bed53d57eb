"""Contact points of a rig or a bench: their laws, their ports, their loads, and the shear of their pieces."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..core import PatchfemError
from ..friction.bonds.parameters import Bonds
from ..friction.grooves import Grooves
from .laws import PointLaw
from .step_rows_kernels import Law

if TYPE_CHECKING:
    from ..contact.contact_sets import ContactSets
    from ..partial_slip.shear_modes import JenkinsSet, ShearModes


class BondSum(NamedTuple):
    """Settings of the sum over a list of bonds.

    - bonds: law
    - reach: cut-off in bond lengths
    - merge: widest merged strip in bond lengths at zero age; 0 merges nothing
    """

    bonds: Bonds
    reach: float
    merge: float


class LowerPressure(NamedTuple):
    """Pressure of the lower piece, over which the points of a set slide.

    - places (m,): positions of the points [m]
    - shares (m,): load [N] of a point at the relative pressure 1
    - tables: positions [m] and relative pressures (2, k) for slides to +x, and others for slides to -x if the law
      averages the pressure
    """

    places: np.ndarray
    shares: np.ndarray
    tables: tuple[np.ndarray, ...]


class Press(NamedTuple):
    """Patch of m nodes whose pressure changes with heave and pitch.

    - sets: its contact sets
    - heave, pitch (n,): motions of the holder per modal coordinate
    - averages (2, m, m - 1, 2): weights of the nodal forces in averages for slides to +x and -x, or None
    """

    sets: "ContactSets"
    heave: np.ndarray
    pitch: np.ndarray
    averages: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class PointSet:
    """Contact points that act on one port, that is, on one displacement of the rig such as the slide of an interface.

    - law: laws of the m points under their loads at the start
    - row (n,): displacement of the port per modal coordinate
    - nodes (m,): node whose normal force is the load of a point; None for a share of the resultant. Nodes (2, m) of
      slides to +x and -x number the averages behind the nodes, in both directions, and then their sums
    - shear: shear modes of pieces that deform, or None
    - is_spring: whether the point is a spring
    - lower: pressure of the lower piece, if it gives the loads, or None
    - bond_sum: sum over the bonds of points with lists, or None
    - shares_shear: whether the shear coordinates are those of the set before it, because the pieces are the same
    """

    law: PointLaw
    row: np.ndarray
    nodes: np.ndarray | None = None
    shear: "ShearModes | None" = None
    is_spring: bool = False
    lower: LowerPressure | None = None
    bond_sum: BondSum | None = None
    shares_shear: bool = False

    def divide(self, numbers: np.ndarray, rows: np.ndarray) -> "list[PointSet]":
        """Return the set divided among ports, whose points deform the same pieces.

        Parameters
        ----------
        numbers : (m,) array
            Number of the port of each point.
        rows : (p, n) array
            Displacement of the ports per modal coordinate.
        """
        parts = []
        for k, row in enumerate(rows):
            own = numbers == k
            shear = self.shear
            shear = replace(
                shear, points=shear.points[own], limit=shear.limit[own], shape=shear.shape[own]
            )
            law = self.law.select(own)
            parts.append(replace(self, law=law, row=row, shear=shear, shares_shear=k > 0))
        return parts


@dataclass(frozen=True, eq=False)
class Contact:
    """Interfaces and springs of a rig with the load of the first interface.

    - point_sets: interfaces, then springs
    - limit: friction limit of all interfaces [N], or another force by which residuals are measured
    - length: elastic length of the first interface [m]
    - press: patch whose pressure changes with heave and pitch, or None
    - load: function of times (k,) [s] that returns a prescribed load [N]
    - preload: load at the start [N], with `press`, `load` or `grooves`
    - grooves: grooves whose flanks the first interface climbs
    - elements: set whose elements are the points, or None
    """

    point_sets: list[PointSet]
    limit: float = 0.0
    length: float = 0.0
    press: Press | None = None
    load: Callable[[np.ndarray], np.ndarray] | None = None
    preload: float = 1.0
    grooves: Grooves | None = None
    elements: "JenkinsSet | None" = None

    def is_rigid(self, point_set: PointSet) -> bool:
        """Return whether a set of points sticks without displacement."""
        return point_set.law.law == Law.COULOMB

    @property
    def first_sets(self) -> list[PointSet]:
        """Point sets of the first interface: one set, or one for each band of a face that yaws with partial slip."""
        n_sets = 1
        while n_sets < len(self.point_sets) and self.point_sets[n_sets].shares_shear:
            n_sets += 1
        return self.point_sets[:n_sets]

    @property
    def law_module(self) -> str:
        """Module of the law that has one of its own, without the name of the package; "" if all laws are numbered."""
        laws = [point_set.law.law for point_set in self.point_sets]
        modules = {law.partition(".")[2] for law in laws if isinstance(law, str)}
        if len(modules) > 1:
            raise PatchfemError(f"a march has at most one law with a module of its own: {modules}")
        return next(iter(modules), "")

    @property
    def has_lists(self) -> bool:
        """Whether the bonds of some points are summed over lists."""
        return any(point_set.bond_sum is not None for point_set in self.point_sets)

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
        parts = [self.press, self.load, self.grooves]
        parts += [point_set.lower for point_set in self.point_sets]
        return any(part is not None for part in parts)
