"""Contact models: friction laws under load as arrays for the compiled loops of a march."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from ...compiled import load
from ...friction.bonds import list_numbers as numbers
from ...friction.bonds.list_rows_kernels import N_ROWS, PATH, STATUS
from ...friction.laws.coulomb import Coulomb
from ...friction.laws.elastic_plastic import parallel_element
from ...friction.laws.stretch import growth_numbers, points_element, unpack_bonds
from ...friction.protocol import Element
from ..interfaces import arrays
from ..interfaces.arrays import FullSlipRow, PointRow, SlipStateIndex
from ..interfaces.dispatch import COULOMB_LAW

INTERFACES_FOLDER = "dynamics.interfaces"
ELEMENT_KERNELS = f"{INTERFACES_FOLDER}.element_kernels"
# Initial number of entries of the bond list of a point, in addition to those of one step.
N_FIRST_ENTRIES = 256
# Width [bond lengths] over which the initial bonds of a point are distributed, so
# that their force is continuous.
FIRST_BOND_WIDTH = 1e-6
# Divisor of the padded number of points, equal to the number of points that
# compiled loops process at once.
POINTS_MULTIPLE = 16
# Type code of an inactive contact, which is never evaluated.
IDLE_KIND = ELEMENT_KERNELS, "friction.laws.elastic_plastic_kernels"


def load_instances(say=None):
    """Load the module with the compiled loops.

    say: callback that reports when loops have to be compiled.

    """
    return load("dynamics.march.instances", say)


@dataclass(frozen=True, eq=False, slots=True)
class Joint:
    """Friction law or spring on one port of a march.

    - `port`: number of the row of slides.
    - `element`: the law under its load.
    - `potential`: function of the slide [m] that returns the energy of a spring [J]; None for friction.
    """

    port: int
    element: Element
    potential: Callable | None = None


@dataclass(frozen=True, eq=False, slots=True)
class ContactModel:
    """Model of a contact for the compiled loop of a march.

    - `contact`: module of the compiled contact.
    - `limit`: friction limit [N].
    - `fields`: initial arrays of `tuple_of`; `allocate_contact` copies them.
    - `length`: bond length of the criterion for sticking [m].
    - `law`: module of the compiled law, "" if the contact has a fixed law.
    - `reduction`: the JenkinsSet or ShearModes from which the arrays were made.
    - `element`: the law of an `interfaces.arrays.Element`.
    """

    contact: str
    limit: float
    fields: dict
    length: float = 0.0
    law: str = ""
    reduction: object = None
    element: Element | None = None
    tuple_of: type = arrays.Element

    loading = ""  # constant load

    @property
    def kind(self) -> tuple:
        """Contact module and law module for which the loop is compiled."""
        return self.contact, self.law

    @property
    def set_valued(self) -> bool:
        """Return whether the contact sticks rigidly (set-valued Coulomb friction)."""
        return self.law == COULOMB_LAW

    @property
    def laws(self) -> tuple:
        """Modules with the compiled laws of the elements (`joints`)."""
        return (COULOMB_LAW,) if self.set_valued else ()

    @property
    def joints(self) -> tuple:
        """Set-valued element that replaces the contact, so that it is solved together with other such elements."""
        return (Joint(0, self.element),) if self.set_valued else ()

    def get_plot_fields(self, contact) -> dict:
        """Return the memory of a contact as fields for plotting.

        The fields are "stretch" (t,) of elements, or "bonds" (5, m).
        """
        form = self.element.form if self.element is not None else ""
        if form == "parallel":
            return {"stretch": contact.mem[0, 3:].copy()}
        if form in ("points", "places"):
            return {"bonds": unpack_bonds(self.element, contact.mem[0]).copy()}
        if not hasattr(contact, "psi"):
            return {}
        if hasattr(contact, "bondlist"):
            # All bonds of a point are plotted at their mean stretch.
            load = contact.points[PointRow.LOAD]
            share = contact.statuses[:, STATUS.force]
            here = load * point_pressures(contact)
            return {
                "bonds": np.stack(
                    [
                        here,
                        self.length * load * share,
                        share,
                        contact.nows[:, PATH.displacement],
                        0 * share,
                    ]
                ),
                "b": contact.b.copy(),
            }
        m, z, s2, play = contact.points[: PointRow.LOAD, : self.reduction.points.size]
        return {
            "bonds": np.stack(
                [
                    m,
                    z,
                    s2,
                    contact.slip_state[SlipStateIndex.TOTAL_SLIDE]
                    - self.reduction.shape @ contact.b,
                    play,
                ]
            ),
            "b": contact.b.copy(),
        }

    def allocate_contact(self):
        """Allocate the contact arrays as copies of the initial arrays."""
        fields = {k: np.array(v, dtype=np.float64, order="C") for k, v in self.fields.items()}
        return self.tuple_of(**fields)


def element_model(element: Element, reduction=None) -> ContactModel:
    """Return the contact model for one law that acts along one relative displacement."""
    bound = element.limit if element.is_bounded else np.inf
    fields = {
        "num": element.numbers[None],
        "mem": element.memory[None],
        "last": np.zeros(2),
        "eps": np.zeros(1),
        "bound": [bound],
    }
    return ContactModel(
        ELEMENT_KERNELS,
        element.limit,
        fields,
        element.length,
        element.kernels or COULOMB_LAW,
        reduction,
        element,
    )


@cache
def frictionless_model() -> ContactModel:
    """Return the contact model for a frictionless interface."""
    return jenkins_model([0.0], [1.0])


def coulomb_model(static: float, kinetic: float) -> ContactModel:
    """Return the model for a rigid Coulomb contact with given static and kinetic friction forces [N]."""
    return element_model(Coulomb(kinetic, static).element(1.0))


def jenkins_model(stiffness, yield_displacement, reduction=None) -> ContactModel:
    """Return the contact model for parallel Jenkins elements.

    Parameters
    ----------
    stiffness
    yield_displacement
    reduction
    """
    return element_model(parallel_element(stiffness, yield_displacement), reduction)


def points_model(law, area, sigma, shear=None, pattern=None) -> ContactModel:
    """Return the contact model for bond points of order 1 with friction.reading = "stretch".

    Parameters
    ----------
    law : friction.bonds.parameters.Bonds
    area, sigma : (m,) array
        Nodal areas [m2] and pressures [Pa]; only their products, the normal forces [N], matter.
    shear : ShearModes or None
        Shear of the pieces; None for pieces that are rigid in shear.
    pattern : tuple or None
        Positions x and pressures of a pressure that is fixed to the lower piece; `area` and `sigma` then belong to the
        points of the upper one. It cannot be combined with `shear`.

    Returns
    -------
    ContactModel
    """
    if shear is not None and pattern is not None:
        raise ValueError(
            "elastic shear of the pieces cannot be combined with a pressure that stays on the lower piece"
        )
    if shear is None:
        return element_model(points_element(law, area, sigma, pattern))
    area = np.asarray(area, float)[shear.points]
    sigma = np.asarray(sigma, float)[shear.points]
    fields = arrays.make_sheared_fields(
        law.static * area / law.length,
        law.length,
        growth_numbers(law),
        np.asarray(shear.shape),
        shear.stiffness,
        POINTS_MULTIPLE,
        sigma,
    )
    fields["points"][PointRow.DENSITY, : area.size] = law.initial * sigma
    limit = law.static * float(area @ sigma)
    return ContactModel(
        f"{INTERFACES_FOLDER}.shear_kernels",
        limit,
        fields,
        law.length,
        "",
        shear,
        None,
        arrays.ShearedPoints,
    )


def point_lists_model(
    law, limit, sigma, shear, reach: float, merge: float, pressure_fields: dict | None = None
) -> ContactModel:
    """Return the contact model for points that are coupled by shear modes and each have a bond list.

    The bonds have any order and either value of `friction.reading`.

    Parameters
    ----------
    law : friction.bonds.parameters.Bonds
    limit : (m,) array
        Friction limits of the points [N].
    sigma : (m,) array
        Pressures [Pa].
    shear : ShearModes or None
        Shear of the pieces; None for pieces that are rigid in shear.
    reach : float
        Cut-off in bond lengths.
    merge : float
        Widest merged strip in bond lengths at zero age; 0 merges nothing.
    pressure_fields : dict or None
        Result of `lower_pressure_fields` or `nodal_load_fields` for a varying pressure; `limit` and `sigma` are then a
        measure of it.

    Returns
    -------
    ContactModel
    """
    limit = np.asarray(limit, float)
    shape = np.zeros((limit.size, 0)) if shear is None else np.asarray(shear.shape)
    stiffness = () if shear is None else shear.stiffness
    capacity = min(
        numbers.list_capacity(law, reach, merge),
        N_FIRST_ENTRIES + numbers.MAX_STRIPS_PER_LENGTH * int(min(reach, numbers.MAX_DAMAGE)),
    )
    fields = arrays.make_sheared_fields(limit, law.length, growth_numbers(law), shape, stiffness)
    fields["points"][PointRow.LOAD] = sigma
    fields["full_slip"][FullSlipRow.MEAN_SLIDE, 1:] = shape.T @ limit / limit.sum()
    fields |= {
        "bondlist": np.zeros((N_ROWS, limit.size * capacity)),
        "status": numbers.make_status(capacity),
        "time": np.ones(1),
        "statuses": numbers.make_status(capacity, limit.size),
        "now": numbers.make_path_state(law),
        "nows": np.tile(numbers.make_path_state(law), (limit.size, 1)),
        "table": numbers.gamma_table(law),
        "law": numbers.law_numbers(law, reach, merge, FIRST_BOND_WIDTH),
        "pressed": np.zeros((2, 0)),
        "pattern": np.zeros((2, 0)),
        "places": np.zeros(0),
    }
    if pressure_fields is not None:
        at_first = pressure_fields.pop("at first")
        fields |= pressure_fields
        fields["statuses"][:, STATUS.pressure] = at_first
        fields["statuses"][:, STATUS.initial_pressure] = at_first
        limit = limit * at_first
    return ContactModel(
        f"{INTERFACES_FOLDER}.shear_list_kernels",
        float(limit.sum()),
        fields,
        law.length,
        "",
        shear,
        None,
        arrays.ShearedLists,
    )


def lower_pressure_fields(x, sigma, measure: float) -> dict:
    """Return fields of `point_lists_model` for a pressure distribution that is fixed to the lower piece.

    Parameters
    ----------
    x : (m,) array
        Positions of the points [m].
    sigma : (m,) array
        Pressures [Pa].
    measure : float
        Pressure of their limits [Pa].

    Returns
    -------
    dict
    """
    return {
        "pattern": np.stack([x, sigma / measure]),
        "places": np.array(x, float),
        "at first": sigma / measure,
    }


def nodal_load_fields(force, measure) -> dict:
    """Return fields of `point_lists_model` for points under varying nodal forces.

    `force` (m,) [N] are the present normal forces, `measure` (m,) [N] those for which the friction limits hold.
    """
    return {"pressed": np.stack([force, force]), "at first": force / measure}


def point_pressures(contact) -> np.ndarray:
    """Return the present pressures (m,) at points with bond lists, divided by those of the friction limits."""
    if contact.pattern.size:
        x, pressure = contact.pattern
        return np.interp(
            contact.places + contact.nows[:, PATH.displacement], x, pressure, left=0.0, right=0.0
        )
    if contact.pressed.size:
        return contact.pressed[1] / contact.points[PointRow.LOAD]
    return np.ones(contact.weight.size)


def bond_list_model(law, limit: float, reach: float, merge: float) -> ContactModel:
    """Return the contact model for one bond list along a uniform relative displacement.

    The bonds have any order and either value of `friction.reading`.

    Parameters
    ----------
    law : friction.bonds.parameters.Bonds
    limit : float
        Friction limit mu_s N [N].
    reach : float
        Cut-off in bond lengths.
    merge : float
        Widest merged strip in bond lengths at zero age; 0 merges nothing.

    Returns
    -------
    ContactModel
    """
    capacity = numbers.list_capacity(law, reach, merge)
    fields = {
        "force": [limit],
        "bondlist": np.zeros((N_ROWS, capacity)),
        "now": numbers.make_path_state(law),
        "status": numbers.make_status(capacity),
        "law": numbers.law_numbers(law, reach, merge),
        "table": numbers.gamma_table(law),
        "growth": growth_numbers(law),
        "last": np.zeros(2),
        "bound": [(1 + law.initial) * limit],
    }
    return ContactModel(
        f"{INTERFACES_FOLDER}.list_kernels", limit, fields, law.length, tuple_of=arrays.BondList
    )
