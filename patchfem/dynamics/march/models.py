"""From a law under its load to the arrays of a contact in the compiled loops."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from ...compiled import load
from ...friction.bonds import list_numbers as numbers
from ...friction.bonds.list_rows_kernels import CLOCK, N_ROWS, STATUS
from ...friction.laws.coulomb import Coulomb
from ...friction.laws.elastic_plastic import parallel_element
from ...friction.laws.stretch import growth_numbers, points_element, unpack_bonds
from ...friction.protocol import Element
from ..interfaces import arrays
from ..interfaces.dispatch import COULOMB

HERE = "dynamics.interfaces"
ELEMENTS = f"{HERE}.element_kernels"
# strips that the list of a point has room for before it grows, besides those of one step
MOST_AT_FIRST = 256
WIDE = 1e-6  # bond lengths over which the first bonds of a point lie: one may rest where their force turns
LANES = 16  # points that compiled loops take at once: fewer left over are one after the other
IDLE = ELEMENTS, "friction.laws.elastic_plastic_kernels"  # kind of a contact that nothing asks


def load_kernels(say=None):
    """The instances of the loop of the march, `instances`; `say` is told when its loops have to be compiled first."""
    return load("dynamics.march.instances", say)


@dataclass(frozen=True, eq=False, slots=True)
class Joint:
    """A law on one port.

    port: row of slides; element: the law under its load; potential: energy [J] of a slide [m] of a spring, None for
    friction; mate: of one that slides in a plane, how far behind it in the list the joint of its second direction
    stands, below 0 of that one how far before it the first; 0 of all others.
    """

    port: int
    element: Element
    potential: Callable | None = None
    mate: int = 0


@dataclass(frozen=True, eq=False, slots=True)
class ContactModel:
    """What the loop needs to know of an interface; `build()` makes fresh arrays, so a model can be run many times.

    contact: module of the compiled contact; law: that of the compiled law in it, "" where the contact
    has none to choose; limit: friction limit [N]; fields: arrays of `tuple_of`;
    length: bond length for the stick criterion [m]; reduction: the JenkinsSet or ShearModes behind the arrays; element:
    the law of an Element.
    """

    contact: str
    limit: float
    fields: dict
    length: float = 0.0
    law: str = ""
    reduction: object = None
    element: Element | None = None
    tuple_of: type = arrays.Element

    loading = ""  # the load stays

    @property
    def kind(self) -> tuple:
        """(contact, law): what `instances` takes an instance of the loop for."""
        return self.contact, self.law

    @property
    def set_valued(self) -> bool:
        """Whether the contact holds without any stretch."""
        return self.law == COULOMB

    @property
    def laws(self) -> tuple:
        """Modules of the compiled laws of `joints`."""
        return (COULOMB,) if self.set_valued else ()

    @property
    def joints(self) -> tuple:
        """Elements in place of the contact: a set-valued one, as all that hold are solved together."""
        return (Joint(0, self.element),) if self.set_valued else ()

    def shown(self, contact) -> dict:
        """What a picture of the interface needs of the memory: "stretch" (t,) of elements, or "bonds" (5, m)."""
        form = self.element.form if self.element is not None else ""
        if form == "parallel":
            return {"stretch": contact.mem[0, 3:].copy()}
        if form in ("points", "places"):
            return {"bonds": unpack_bonds(self.element, contact.mem[0]).copy()}
        if not hasattr(contact, "psi"):
            return {}
        if hasattr(contact, "bondlist"):
            # as if all bonds of a point were stretched alike
            load = contact.points[4]
            share = contact.statuses[:, STATUS.force]
            here = load * pressures_of(contact)
            return {
                "bonds": np.stack(
                    [
                        here,
                        self.length * load * share,
                        share,
                        contact.nows[:, CLOCK.displacement],
                        0 * share,
                    ]
                ),
                "b": contact.b.copy(),
            }
        m, z, s2, play = contact.points[:4, : self.reduction.points.size]
        return {
            "bonds": np.stack([m, z, s2, contact.flow[1] - self.reduction.shape @ contact.b, play]),
            "b": contact.b.copy(),
        }

    def build(self):
        """The contact with arrays of its own."""
        made = {k: np.array(v, dtype=np.float64, order="C") for k, v in self.fields.items()}
        return self.tuple_of(**made)


def element_model(element: Element, reduction=None) -> ContactModel:
    """A contact of one law on one slide."""
    bound = element.limit if element.is_bounded else np.inf
    fields = {
        "num": element.numbers[None],
        "mem": element.memory[None],
        "last": np.zeros(2),
        "eps": np.zeros(1),
        "bound": [bound],
    }
    return ContactModel(
        ELEMENTS,
        element.limit,
        fields,
        element.length,
        element.kernels or COULOMB,
        reduction,
        element,
    )


@cache
def free_model() -> ContactModel:
    """A contact that rubs nothing."""
    return jenkins_model([0.0], [1.0])


def coulomb_model(static: float, kinetic: float) -> ContactModel:
    """Rigid Coulomb contact with static and kinetic friction force [N]."""
    return element_model(Coulomb(kinetic, static).element(1.0))


def jenkins_model(stiffness, yield_displacement, reduction=None) -> ContactModel:
    """Parallel Jenkins elements (t,) [N/m], [m]."""
    return element_model(parallel_element(stiffness, yield_displacement), reduction)


def points_model(law, area, sigma, shear=None, pattern=None) -> ContactModel:
    """Bond points (stretch reading, p = 1) on nodal areas (m,) [m2] under sigma (m,) [Pa].

    shear: ShearModes of the contact set or None for a rigid slide; pattern: (x, sigma on x) when the pressure stays on
    the lower piece, `area` and `sigma` then belong to the points of the upper one. ValueError for both together.
    """
    if shear is not None and pattern is not None:
        raise ValueError(
            "elastic shear of the pieces cannot be combined with a pressure that stays on the lower piece"
        )
    if shear is None:
        return element_model(points_element(law, area, sigma, pattern))
    area = np.asarray(area, float)[shear.points]
    sigma = np.asarray(sigma, float)[shear.points]
    fields = arrays.sheared(
        law.static * area / law.length,
        law.length,
        growth_numbers(law),
        np.asarray(shear.shape),
        shear.stiffness,
        LANES,
        sigma,
    )
    fields["points"][0, : area.size] = law.initial * sigma
    limit = law.static * float(area @ sigma)
    return ContactModel(
        f"{HERE}.shear_kernels", limit, fields, law.length, "", shear, None, arrays.Sheared
    )


def lists_model(
    law, limit, sigma, shear, reach: float, merge: float, under: dict | None = None
) -> ContactModel:
    """Lists of bonds behind shear modes, one a point: any order, either reading. limit: mu_s N (m,) [N] of the points
    of the ShearModes `shear`, None of pieces that are rigid in shear; sigma: their pressures (m,) [Pa]; reach, merge:
    as `list_model` has them; under: `under_the_lower` or `under_loads` of a pressure that changes, of which limit and
    sigma are then a measure."""
    limit = np.asarray(limit, float)
    shape, stiffness = (
        (np.zeros((limit.size, 0)), ())
        if shear is None
        else (np.asarray(shear.shape), shear.stiffness)
    )
    capacity = min(
        numbers.list_capacity(law, reach, merge),
        MOST_AT_FIRST + numbers.MAX_STRIPS_PER_LENGTH * int(min(reach, numbers.MAX_DAMAGE)),
    )
    fields = arrays.sheared(limit, law.length, growth_numbers(law), shape, stiffness)
    fields["points"][4], fields["drag"][2, 1:] = sigma, shape.T @ limit / limit.sum()
    fields |= {
        "bondlist": np.zeros((N_ROWS, limit.size * capacity)),
        "status": numbers.make_status(capacity),
        "time": np.ones(1),
        "statuses": numbers.make_status(capacity, limit.size),
        "now": numbers.make_clocks(law),
        "nows": np.tile(numbers.make_clocks(law), (limit.size, 1)),
        "table": numbers.gamma_table(law),
        "law": numbers.law_numbers(law, reach, merge, WIDE),
        "pressed": np.zeros((2, 0)),
        "pattern": np.zeros((2, 0)),
        "places": np.zeros(0),
    }
    if under is not None:
        at_first = under.pop("at first")
        fields |= under
        fields["statuses"][:, STATUS.pressure] = at_first
        fields["statuses"][:, STATUS.initial_pressure] = at_first
        limit = limit * at_first
    return ContactModel(
        f"{HERE}.shear_list_kernels",
        float(limit.sum()),
        fields,
        law.length,
        "",
        shear,
        None,
        arrays.ShearedLists,
    )


def under_the_lower(x, sigma, measure: float) -> dict:
    """What `lists_model` asks of points at x (m,) [m] under the pressure sigma (m,) [Pa] of the lower piece, that stays
    there; measure [Pa]: the pressure of their limits."""
    return {
        "pattern": np.stack([x, sigma / measure]),
        "places": np.array(x, float),
        "at first": sigma / measure,
    }


def under_loads(force, measure) -> dict:
    """What `lists_model` asks of points under nodal forces that change; force (m,) [N]: at the start, measure (m,) [N]:
    those of their limits, which are its `sigma` as well."""
    return {"pressed": np.stack([force, force]), "at first": force / measure}


def pressures_of(contact) -> np.ndarray:
    """Pressures (m,) of the points of a `ShearedLists` as they stand, over those of their limits."""
    if contact.pattern.size:
        x, pressure = contact.pattern
        return np.interp(
            contact.places + contact.nows[:, CLOCK.displacement], x, pressure, left=0.0, right=0.0
        )
    return (
        contact.pressed[1] / contact.points[4]
        if contact.pressed.size
        else np.ones(contact.weight.size)
    )


def list_model(law, limit: float, reach: float, merge: float) -> ContactModel:
    """One shared bond list for a rigid slide: any order, either reading; limit = mu_s N [N].

    reach: cut-off in bond lengths; merge: widest merged strip in bond lengths at zero age, 0 merges nothing.
    """
    capacity = numbers.list_capacity(law, reach, merge)
    fields = {
        "force": [limit],
        "bondlist": np.zeros((N_ROWS, capacity)),
        "now": numbers.make_clocks(law),
        "status": numbers.make_status(capacity),
        "law": numbers.law_numbers(law, reach, merge),
        "table": numbers.gamma_table(law),
        "growth": growth_numbers(law),
        "last": np.zeros(2),
        "bound": [(1 + law.initial) * limit],
    }
    return ContactModel(f"{HERE}.list_kernels", limit, fields, law.length, tuple_of=arrays.BondList)
