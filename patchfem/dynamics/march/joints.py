"""Several interfaces and springs that are not linear beside, or instead of, the patch: the march of many elements."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from ... import compiled
from ...core import Response
from ...friction.protocol import Element
from ..contacts import arrays
from ..contacts.dispatch import COULOMB, law_of, number_of
from ..second_book import sampled_work
from .hub import HERE, contact_of
from .march import GOAL, Run
from .models import SET_VALUED, ContactModel, coulomb_model


@dataclass(frozen=True, eq=False, slots=True)
class Joint:
    """A law on one port.

    port: row of slides; element: the law under its load; potential: energy [J] of a slide [m] of a spring, None for
    friction.
    """

    port: int
    element: Element
    potential: Callable | None = None


def cubic(port: int, stiffness: float) -> Joint:
    """Spring on a port with the restoring force k_3 q^3 [N]; stiffness: k_3 [N/m3]."""
    return _spring(port, [0.0, stiffness, 0.0, 1.0], lambda q: 0.25 * stiffness * q**4)


def interlock(port: int, stiffness: float, wavelength: float) -> Joint:
    """Spring on a port with the restoring force k lambda/(2 pi) sin(2 pi q/lambda) [N] of interlocking peaks.

    stiffness: k [N/m] at rest; wavelength: lambda [m].
    """
    turn = 2 * np.pi / wavelength
    return _spring(port, [0.0, 0.0, stiffness, wavelength],
                   lambda q: 2 * stiffness * (np.sin(0.5 * turn * q) / turn)**2)


def _spring(port: int, numbers, potential) -> Joint:
    law = "dynamics.contacts.spring_kernels"
    return Joint(port, Element(law, np.array(numbers), np.zeros(0), 0.0, 0.0, False), potential)


@cache
def loop_of(laws: tuple, patch: tuple):
    """The compiled loop of joints with these laws (modules) and the patch's contact of this kind."""
    law = law_of(laws)
    stops = "joints_stops_kernels" if COULOMB in laws else "joints_no_stops_kernels"
    parts = {"law": law, "stops": f"{HERE}.{stops}", "patch": contact_of(patch),
             "solver": compiled.instance("dynamics.contacts.element_solve_kernels", {"law": law}),
             "together": compiled.instance(f"{HERE}.joints_solve_kernels", {"law": law})}
    return compiled.instance(f"{HERE}.joints_kernels", parts)


@dataclass(frozen=True, eq=False, slots=True)
class JointsModel:
    """A patch (ContactModel on port 0, or None) and joints; rows (p, n): slide of every port per coordinate.

    A patch of set-valued friction becomes the first of the joints, since all that hold are solved together.
    scale [N]: force against which residuals of springs count; also: modules of compiled laws that the loop knows
    besides those of the joints, so that models of several sets of laws share one loop.
    """

    patch: ContactModel | None
    joints: tuple
    rows: np.ndarray
    scale: float
    also: tuple = ()

    def __post_init__(self):
        if self.patch is not None and self.patch.set_valued:
            object.__setattr__(self, "joints", (Joint(0, self.patch.element), *self.joints))
            object.__setattr__(self, "patch", None)

    @property
    def limit(self) -> float:
        """Friction limit [N] of patch and joints together."""
        return (self.patch.limit if self.patch is not None else 0.0) + sum(one.element.limit for one in self.joints)

    @property
    def length(self) -> float:
        """Bond length [m] of the patch, or else of the first interface."""
        return self.patch.length if self.patch is not None else self.joints[0].element.length

    @property
    def reduction(self):
        """What the arrays of the patch were reduced from (ContactModel.reduction), None without a patch."""
        return self.patch.reduction if self.patch is not None else None

    @property
    def set_valued(self) -> bool:
        """Whether the patch, or else the first interface, holds without any stretch."""
        return self.patch.set_valued if self.patch is not None else not self.joints[0].element.kernels

    @property
    def laws(self) -> tuple:
        """Modules of the compiled laws, each once."""
        return tuple(sorted({*self.also, *(one.element.kernels or COULOMB for one in self.joints)}))

    @property
    def kind(self) -> tuple:
        """Kind of the patch's contact (ContactModel.kind), that of an idle one without a patch."""
        return self.patch.kind if self.patch is not None else (SET_VALUED, "")

    @property
    def runner(self):
        """The class that marches such a model."""
        return JointsRun

    def shown(self, contact) -> dict:
        """What a picture needs of the patch's memory (ContactModel.shown), {} without a patch."""
        return self.patch.shown(contact) if self.patch is not None else {}

    def build(self, hub=None):
        """(contact, None) of the patch with arrays of their own; an idle point where there is none."""
        return (self.patch or coulomb_model(0.0, 0.0)).build()

    def arrays(self, prop, plant, mass: float) -> arrays.Joints:
        """Fresh `arrays.Joints` of a march, from the Propagator and the Plant of its modes [kg]."""
        e, (p, n), numbers = len(self.joints), self.rows.shape, number_of(self.laws)
        elements = [one.element for one in self.joints]
        num, mem = (np.zeros((e, max(1, *(len(part) for part in parts)))) for parts in (
            [one.numbers for one in elements], [one.memory for one in elements]))
        for k, one in enumerate(elements):
            num[k, :one.numbers.size], mem[k, :one.memory.size] = one.numbers, one.memory
            num[k, 0] = numbers[one.kernels or COULOMB]
        goal = [self.patch.limit if self.patch is not None else 1.0,
                *(one.limit or max(self.scale, 1e-300) for one in elements)]
        ports, rubs = (np.array(part, np.int64) for part in zip(*(
            (one.port, one.potential is None) for one in self.joints)))
        holds = np.array([k for k, one in enumerate(elements) if not one.kernels], np.int64)
        quick = prop.rows * prop.push[1] if not prop.dense.size else prop.rows @ prop.dense[n:, 2 * n:]
        gamma, m, at = quick @ prop.rows.T / mass, holds.size, ports[holds]
        gives = [give[np.ix_(at, at)] for give in (prop.beta, gamma, prop.rows @ prop.rows.T / mass)]
        stops = arrays.Stops(holds, np.zeros(m, np.int64), np.array(num[holds, 1:3].T, order="C"), np.array(gives),
                             np.ascontiguousarray(prop.rows[at]), np.zeros((m, m)), np.zeros((18, m)))
        return arrays.Joints(
            np.array([self.patch is not None], np.int64), np.array(prop.beta, float),
            np.ascontiguousarray(self.rows, float), ports, rubs, num, mem,
            np.array([one.limit if one.bounded else np.inf for one in elements]), GOAL * np.array(goal),
            plant.push[0] / mass, np.zeros((e, 2)), np.zeros(e), np.zeros(2), np.zeros(p), *np.zeros((5, e)),
            np.zeros((e, e)), np.zeros((3, n)), np.zeros((n, n)), gamma, np.zeros(p), stops)


class JointsRun(Run):
    """The arrays of a march of many elements and its clock."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, hub, start=None):
        super().__init__(modes, drive, model, steps_per_cycle, travel, hub, start)
        self.loop = loop_of(model.laws, model.kind)
        self.joints = model.arrays(self.prop, self.plant, modes.mass)
        self.rubs = self.joints.rubs == 1
        self.width = 2 * modes.omega.size + 7 + 4 * len(model.joints)
        self.ledger[0] += self.strained()

    def fork(self, drive):
        """A copy of the march as it stands, its joints too, that goes on under another drive."""
        twin = super().fork(drive)
        twin.joints = arrays.copied(self.joints)
        return twin

    def _moving(self) -> tuple:
        return *super()._moving(), *self.joints[:-1], *self.joints.stops

    def _steps(self, count: int, rows) -> tuple:
        table, row = self.table(count)
        return self.loop.march(row, count, self.state, self.plant, table, self.contact, self.joints, float(self.travel),
                               self.ledger, rows)

    def _sampled(self, rows) -> np.ndarray:
        n, out = 2 * self.modes.omega.size, np.zeros(len(rows) - 1)
        blows = rows[:-1, n + 6].copy()  # what is left of the work where all that rubs holds: as of a Run
        if self.model.patch is not None:
            out += sampled_work(rows[:, n], rows[:, n + 2])
            blows[:] = 0.0
        for k in np.flatnonzero(self.rubs):
            slide, _, force, _ = rows[:, n + 7 + 4 * k:n + 11 + 4 * k].T
            smooth = bool(self.model.joints[k].element.kernels)
            out += sampled_work(slide, force, None if smooth else force[:-1])
            blows = 0.0 * blows if smooth else blows - force[:-1] * np.diff(slide)
        return out + blows

    def watched(self, rows) -> tuple:
        """Slide rates (k, e) [m/s] and slips (k, e) [m] of the patch and of all elements in booked rows."""
        rate, slip = super().watched(rows)
        parts = rows[:, 2 * self.modes.omega.size + 10:].reshape(len(rows), self.rubs.size, 4)
        return np.column_stack([rate, parts[:, :, 1]]), np.column_stack([slip, parts[:, :, 3]])

    def strained(self) -> float:
        """Energy [J] stored in the patch, the interfaces and the springs."""
        rows, n = np.empty((1, self.width)), 2 * self.modes.omega.size
        self.loop.march(0, 0, self.state, self.plant, np.zeros((1, 1)), self.contact, self.joints, np.inf, np.zeros(9),
                        rows)
        springs = [(k, one.potential) for k, one in enumerate(self.model.joints) if one.potential is not None]
        return float(rows[0, n + 5]) + sum(float(energy(rows[0, n + 7 + 4 * k])) for k, energy in springs)

    def response(self, rows, number) -> Response:
        """Histories; `extra`: slides, slide_rates, forces, slips (k, i) of the interfaces, spring_forces (k, s)."""
        n, modes, joints = 2 * self.modes.omega.size, self.modes, self.joints
        out = super().response(rows, number)
        parts = rows[:, n + 10:].reshape(len(rows), self.rubs.size, 4)
        push = -np.einsum("ke,en->kn", parts[:, :, 2], joints.rows[joints.ports]) / modes.mass
        if self.model.patch is None:
            push += np.outer(out.force, modes.slide) / modes.mass  # of the first element, counted already
        extra = out.extra | {"spring_forces": parts[:, ~self.rubs, 2]}
        if self.rubs.any():
            names = ("slides", "slide_rates", "forces", "slips")
            extra |= {name: parts[:, self.rubs, k] for k, name in enumerate(names)}
        return replace(out, acceleration=out.acceleration + push @ modes.output, extra=extra)
