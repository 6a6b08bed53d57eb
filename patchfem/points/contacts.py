"""Contact points of a rig with their laws, from elements, bonds, patches and varying loads."""

from dataclasses import dataclass, field

import numpy as np

from ..contact.contact_sets import ContactSets
from ..friction.protocol import Element
from .laws import N_MEMORY, N_NUMBERS, PointLaw, make_bonds, make_coulomb, make_jenkins, make_tanh
from .return_maps_kernels import Law

RESULTANT = -1  # node of a point whose load is a fraction of the resultant
# Law and rows of numbers of the elements of a single number of memory, by the module of their kernels
FLOW_LAWS = {
    "friction.laws.tanh_kernels": Law.TANH,
    "friction.laws.bouc_wen_kernels": Law.BOUC_WEN,
    "friction.laws.lugre_kernels": Law.LUGRE,
}


@dataclass(frozen=True, eq=False)
class PointSet:
    """Points that act on one port.

    - laws: law of each point
    - row (n,): displacement of the port per modal coordinate
    - nodes (m,): node whose normal force is the load of a point under a varying load, else RESULTANT
    - shapes (r, m), stiffness (r,): shear coordinates of the pieces, see `march_rows.Points`
    - is_spring: whether the point is a spring
    """

    laws: list[PointLaw]
    row: np.ndarray
    nodes: np.ndarray | None = None
    shapes: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    stiffness: np.ndarray = field(default_factory=lambda: np.zeros(0))
    is_spring: bool = False


@dataclass(frozen=True, eq=False)
class Contact:
    """Interfaces and springs of a rig with the load of the first interface.

    - point_sets: interfaces, then springs
    - sets: contact sets of a patch whose pressure changes with heave and pitch
    - heave, pitch (n,): motions of the holder per modal coordinate, with `sets`
    - load: function of times (k,) [s] that returns a prescribed load [N]
    - preload: load at the start [N], with `sets` or `load`
    """

    point_sets: list[PointSet]
    sets: ContactSets | None = None
    heave: np.ndarray | None = None
    pitch: np.ndarray | None = None
    load: object = None
    preload: float = 1.0


def convert_element(element: Element) -> list[PointLaw]:
    """Return the points of a law of one contact under a constant load.

    Parallel elements become one point each, bonds at points of equal slide a single point.
    """
    numbers = element.numbers
    if not element.kernels:
        return [make_coulomb(numbers[1], numbers[2])]
    if element.form == "parallel":
        count = int(numbers[1])
        pairs = zip(numbers[2 : 2 + count], numbers[2 + count : 2 + 2 * count])
        return [make_jenkins(stiffness * length, length) for stiffness, length in pairs]
    if element.form == "points":
        rows = np.zeros(N_NUMBERS)
        # Points of equal slide and a density of 1 per load are one point.
        rows[:9] = (
            Law.BONDS,
            numbers[1] * numbers[2],
            numbers[2],
            *numbers[3:8],
            element.memory[1],
        )
        memory = np.zeros(N_MEMORY)
        memory[:4] = element.memory[:4]
        return [PointLaw(rows, memory, 1.0)]
    if element.kernels in FLOW_LAWS:
        rows = np.zeros(N_NUMBERS)
        rows[0] = FLOW_LAWS[element.kernels]
        rows[1 : numbers.size] = numbers[1:]
        if rows[0] == Law.TANH:
            rows[2] = 1 / numbers[2]
        return [PointLaw(rows, np.zeros(N_MEMORY), 1.0)]
    raise ValueError(f"law of {element.kernels} has no return map")


def make_bond_points(bonds, force, shear, row) -> PointSet:
    """Return points with bonds under constant normal forces (m,) [N], coupled by slip.shear_modes.ShearModes."""
    laws = [make_bonds(bonds, load) for load in force]
    return PointSet(laws, row, None, np.array(shear.shape.T), np.asarray(shear.stiffness, float))


def make_pressed_points(law, force, shear, row) -> PointSet:
    """Return the points of an interface under a load that changes.

    Parameters
    ----------
    law : object
        Friction keys `law`, `static`, `kinetic`, `reference_speed`, `bond_length`, or Bonds.
    force : (m,) array or float
        Nodal forces of the preload [N], or the preload of a single point.
    shear : ShearModes or None
        Shear of the pieces.
    row : (n,) array
        Slide per modal coordinate.
    """
    name = getattr(law, "law", "bonds")
    if name in ("coulomb", "tanh"):
        load = float(np.sum(force))
        kinetic = law.static if law.kinetic is None else law.kinetic
        make = make_coulomb if name == "coulomb" else make_tanh
        second = kinetic if name == "coulomb" else law.reference_speed
        return PointSet([make(law.static, second, load)], row)
    loads = np.atleast_1d(np.asarray(force, float))
    if name == "bonds":
        laws = [make_bonds(law, load) for load in loads]
    else:
        laws = [make_jenkins(law.static, law.bond_length, load) for load in loads]
    nodes = None if np.ndim(force) == 0 else np.arange(loads.size)
    if shear is None:
        return PointSet(laws, row, nodes)
    return PointSet(laws, row, nodes, np.array(shear.shape.T), np.asarray(shear.stiffness, float))
