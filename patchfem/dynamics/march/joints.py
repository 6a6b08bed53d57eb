"""Several interfaces and springs that are not linear beside, or instead of, the patch: the march of many elements."""

from dataclasses import dataclass, replace

import numpy as np

from ...compiled import load
from ...core import Response
from .march import GOAL, Run
from .models import ContactModel, growth_numbers

COULOMB, JENKINS, POINTS, RATE, CUBIC, SINE = 0, 1, 2, 4, 5, 6  # as in the kernels
NUMBERS, MEMORY = 9, 8


@dataclass(frozen=True, eq=False, slots=True)
class Element:
    """A law on one port: kind, its numbers (9,) and first memory (8,) as in joint_laws_kernels; limit: friction
    limit [N], 0 for a spring; length: of its bonds [m], 0 without."""

    kind: int
    port: int
    numbers: np.ndarray
    memory: np.ndarray
    limit: float = 0.0
    length: float = 0.0


def _element(kind: int, port: int, numbers, limit: float = 0.0, length: float = 0.0, memory=()) -> Element:
    filled = [np.zeros(NUMBERS), np.zeros(MEMORY)]
    for whole, part in zip(filled, (numbers, memory)):
        whole[:len(part)] = part
    return Element(kind, port, *filled, limit, length)


def coulomb(port: int, static: float, kinetic: float) -> Element:
    """Rigid Coulomb friction of static and kinetic force [N]."""
    return _element(COULOMB, port, [static, kinetic], static)


def elastic_plastic(port: int, limit: float, length: float) -> Element:
    """A spring limit/length that slips at the limit [N] (3.12 with its reversal); length [m]."""
    return _element(JENKINS, port, [limit, limit / length, length], limit, length)


def bonds(port: int, law, load: float) -> Element:
    """The stretch reading with p = 1 under a normal load [N]; law: friction.law.Bonds."""
    numbers = [law.static * load, law.static / law.length, load, *growth_numbers(law)]
    return _element(POINTS, port, numbers, law.static * load, law.length, [law.initial * load, 0, 0, 0, law.length])


def rate(port: int, limit: float, speed: float) -> Element:
    """limit tanh(v/speed) of eq. 2.4, limit [N], speed [m/s]."""
    return _element(RATE, port, [limit, speed], limit)


def cubic(port: int, stiffness: float) -> Element:
    """Restoring force k_3 q^3 [N], k_3 [N/m3]."""
    return _element(CUBIC, port, [stiffness])


def interlock(port: int, stiffness: float, wavelength: float) -> Element:
    """Restoring force k lambda/(2 pi) sin(2 pi q/lambda) [N] of interlocking peaks."""
    return _element(SINE, port, [stiffness, wavelength])


@dataclass(frozen=True, eq=False, slots=True)
class SlotsModel:
    """A patch (ContactModel on port 0, or None) and elements; rows (p, n): slide of every port per coordinate.

    scale [N]: force against which residuals of springs count.
    """

    patch: ContactModel | None
    elements: tuple
    rows: np.ndarray
    scale: float

    @property
    def limit(self) -> float:
        """Friction limit of all [N]."""
        return (self.patch.limit if self.patch is not None else 0.0) + sum(e.limit for e in self.elements)

    @property
    def length(self) -> float:
        """Bond length of the patch, or else of the first interface [m]."""
        return self.patch.length if self.patch is not None else self.elements[0].length

    @property
    def fields(self) -> dict:
        """Of the patch."""
        return self.patch.fields if self.patch is not None else {}

    @property
    def reduction(self):
        """Of the patch."""
        return self.patch.reduction if self.patch is not None else None

    @property
    def kind(self) -> int:
        """Of the patch, or else of the first interface."""
        return self.patch.kind if self.patch is not None else self.elements[0].kind

    @property
    def runner(self):
        """The class that marches it."""
        return SlotRun

    def build(self, hub):
        """(Contact, Work) of the patch; an idle point where there is none."""
        idle = ContactModel(COULOMB, 1.0, {"force": [0.0, 0.0, 0.0]})
        return (self.patch or idle).build(hub)


class SlotRun(Run):
    """The arrays of a march of many elements and its clock."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, hub, start=None):
        self.loop = load("dynamics.march.joints_kernels")
        self.laws = load("dynamics.march.joint_laws_kernels")
        elements = model.elements
        self.kinds = np.array([e.kind for e in elements], np.int64)
        self.ports = np.array([e.port for e in elements], np.int64)
        self.numbers = np.array([e.numbers for e in elements])
        self.memory = np.array([e.memory for e in elements])
        super().__init__(modes, drive, model, steps_per_cycle, travel, hub, start)
        self.rows = np.ascontiguousarray(model.rows, float)
        self.width = 2 * modes.omega.size + 7 + 4 * len(elements)
        patch = model.patch
        self.kind = patch.kind if patch is not None else -1
        self.goal = GOAL * np.array([patch.limit if patch is not None else 1.0,
                                     *(e.limit or max(model.scale, 1e-300) for e in elements)])
        self.ledger[0] += self.strained()

    def _steps(self, count: int, rows) -> tuple:
        table, row = self.table(count)
        n = 2 * self.modes.omega.size
        more = np.zeros((count + 1, len(self.kinds), 4))
        own = np.empty((count + 1, n + 7))
        done = self.loop.march_slots(row, count, self.state, self.held, self.arrays, self.steps, self.prop.beta, table,
                                     self.modes.mass, self.kind, self.contact, self.work, self.rows, self.ports,
                                     self.kinds, self.numbers, self.memory, self.goal, self.travel, self.ledger, own,
                                     more)
        rows[:, :n + 7], rows[:, n + 7:] = own, more.reshape(count + 1, -1)
        return done

    def _works(self, rows) -> np.ndarray:
        return rows[:-1, 2 * self.modes.omega.size + 6]

    def watched(self, rows) -> tuple:
        """(rates, slips) (k, e) of the patch and of all elements."""
        rate, slip = super().watched(rows)
        parts = rows[:, 2 * self.modes.omega.size + 10:].reshape(len(rows), len(self.kinds), 4)
        return np.column_stack([rate, parts[:, :, 1]]), np.column_stack([slip, parts[:, :, 3]])

    def strained(self) -> float:
        """Energy of the patch, of the interfaces and of the springs [J]."""
        slide = self.model.rows @ self.state[0]
        out = sum(float(self.laws.element_state(int(kind), self.numbers, self.memory, e, float(slide[port]), 0.0)[1])
                  for e, (kind, port) in enumerate(zip(self.kinds, self.ports)))
        return out + (super().strained() if self.model.patch is not None else 0.0)

    def response(self, rows, number) -> Response:
        """Histories; `extra`: slides, slide_rates, forces, slips (k, i) of the interfaces, spring_forces (k, s)."""
        n, modes = 2 * self.modes.omega.size, self.modes
        out = super().response(rows, number)
        parts = rows[:, n + 10:].reshape(len(rows), len(self.kinds), 4)
        push = -np.einsum("ke,en->kn", parts[:, :, 2], self.rows[self.ports]) / modes.mass
        if self.model.patch is None:
            push += np.outer(out.force, modes.slide) / modes.mass  # of the first element, counted already
        rubs = self.kinds < CUBIC
        extra = out.extra | {"spring_forces": parts[:, ~rubs, 2]}
        if rubs.any():
            names = ("slides", "slide_rates", "forces", "slips")
            extra |= {name: parts[:, rubs, k] for k, name in enumerate(names)}
        return replace(out, acceleration=out.acceleration + push @ modes.output, extra=extra)
