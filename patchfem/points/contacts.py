"""Contact points of a rig or a bench with their laws: elements, bonds, patches under changing loads, flanks of grooves."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..friction.bonds.parameters import Bonds
from ..friction.grooves import Grooves
from ..friction.record import make_law
from .law_rows import Law
from .laws import (
    PointLaw,
    make_bonds,
    make_cubic,
    make_interlocking,
    make_jenkins,
    make_list,
    make_point_law,
)
from .march_rows import LOWER

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

    @property
    def engine(self):
        """Module that makes the arrays and loads the kernels of this contact; None for `time_march`."""
        return None

    def is_rigid(self, point_set: PointSet) -> bool:
        """Return whether a set of points sticks without displacement."""
        return bool((point_set.law.numbers[0] == Law.COULOMB).all())

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


def make_contact(laws, rows, springs=(), scale: float = 0.0, length: float = 0.0) -> Contact:
    """Return the contact of interfaces under constant loads, one point each, and of springs.

    Parameters
    ----------
    laws : sequence of PointLaw
        Law of each interface under its load.
    rows : (i, n) array
        Slide of each interface per modal coordinate.
    springs : sequence of PointSet
        Springs of the rig, each with its row.
    scale : float
        Force by which residuals are measured where there is no friction [N].
    length : float
        Elastic length of the first interface [m].
    """
    point_sets = [PointSet(law, row) for law, row in zip(laws, rows)]
    # The first number of a law is its friction limit per newton of load.
    limit = sum(float(np.sum(law.numbers[1] * law.load)) for law in laws)
    return Contact([*point_sets, *springs], limit or scale, length)


def make_cubic_spring(stiffness: float, row) -> PointSet:
    """Return a spring whose force is k_3 q^3 on a port with the displacement q.

    Parameters
    ----------
    stiffness : float
        Stiffness k_3 [N/m3].
    row : (n,) array
        Displacement of the port per modal coordinate.
    """
    return PointSet(make_cubic(stiffness), row, is_spring=True)


def make_interlocking_spring(stiffness: float, wavelength: float, row) -> PointSet:
    """Return a spring whose force is stiffness/k sin(k q) on a port with the displacement q, k = 2 pi/wavelength.

    Parameters
    ----------
    stiffness : float
        Stiffness at q = 0 [N/m].
    wavelength : float
        Displacement between two equal states of the spring [m].
    row : (n,) array
        Displacement of the port per modal coordinate.
    """
    return PointSet(make_interlocking(stiffness, wavelength), row, is_spring=True)


def make_bond_contact(
    bonds: Bonds, force, row, shear=None, bond_sum: BondSum | None = None, lower=None
) -> Contact:
    """Return the contact of an interface whose points follow the nonlocal law, which sums over bonds.

    Parameters
    ----------
    bonds : Bonds
        Coefficient of friction, bond length and growth of the bonds.
    force : (m,) array or float
        Normal force of each point [N]; with `lower`, its area times the mean pressure.
    row : (n,) array
        Slide per modal coordinate.
    shear : ShearModes, optional
        Shear of the pieces, with the points in the order of `force`.
    bond_sum : BondSum, optional
        Sum over lists of bonds; without it the bonds have the closed form of the reading "stretch" and order 1.
    lower : (2, k) array, optional
        Positions [m] and relative pressures of a distribution that is fixed to the lower piece; the points are at these
        positions.
    """
    loads = np.atleast_1d(np.asarray(force, float))
    shares = places = nodes = pressure = None
    now = loads
    if lower is not None:
        pressure = np.array(lower, float)
        shares = loads
        places = pressure[0]
        now = loads * pressure[1]
        nodes = np.full(loads.size, LOWER)
    make = make_bonds if bond_sum is None else make_list
    points = PointSet(make(bonds, now), row, nodes, shear, shares=shares, places=places)
    limit = bonds.static * float(now.sum())
    return Contact([points], limit, bonds.length, bond_sum=bond_sum, pressure=pressure)


def make_pressed_contact(
    law, force, row, shear=None, bond_sum: BondSum | None = None, **load
) -> Contact:
    """Return the points of an interface under a load that changes.

    Parameters
    ----------
    law : Bonds, or keys `law`, `static`, `kinetic`, `reference_speed`, `bond_length` of a table [friction]
        Laws "coulomb" and "tanh" act on the resultant, others on every point.
    force : (m,) array or float
        Nodal forces of the preload [N], or the preload of a single point.
    row : (n,) array
        Slide per modal coordinate.
    shear : ShearModes, optional
        Shear of the pieces at all nodes.
    bond_sum : BondSum, optional
        Sum over lists of bonds.
    **load
        Fields of Contact that describe the load.
    """
    loads = np.atleast_1d(np.asarray(force, float))
    nodes = None if np.ndim(force) == 0 else np.arange(loads.size)
    length = 0.0
    if isinstance(law, Bonds):
        length = law.length
        make = make_bonds if bond_sum is None else make_list
        points = make(law, loads)

    # Laws of the resultant make one point of the whole interface.
    elif law.law in ("coulomb", "tanh"):
        nodes = None
        points = make_point_law(law.law, make_law(law), loads.sum())
    else:
        length = law.bond_length or 0.0
        points = make_jenkins(law.static, length, loads)

    limit = (law.static or 1.0) * max(float(loads.sum()), 1e-9)
    point_sets = [PointSet(points, row, nodes, shear)]
    return Contact(point_sets, limit, length, bond_sum=bond_sum, preload=float(loads.sum()), **load)
