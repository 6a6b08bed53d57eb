"""The contact of a law with memory along the flanks of grooves, for marches and for slides that are given."""

from dataclasses import dataclass, replace

import numpy as np

from ...core import Outcome, Response
from ...friction.grooves import Grooves
from ..contacts.arrays import Climbing, sheared
from ..march.march import Run
from ..march.varying_load import PLASTIC, POINTS, Rubbing, bonds, plastic
from .run import lifts, refuse_heavy

HERE = "dynamics.grooves.contact_kernels"
RISE, VERTICAL, LIFTS = 0, 1, 4  # of Climbing.now_at


def model_of(grooves: Grooves, load: float, static: float, length: float, law, modes) -> "ClimbingModel":
    """The model of the elastic-plastic law of a length [m], or of the bonds `law` (friction.bonds.parameters.Bonds).

    modes: of the rig, None of a bench; PatchfemError as of `run.refuse_heavy`.
    """
    if modes is not None:
        refuse_heavy(grooves, static, modes)
    return ClimbingModel(grooves, load, plastic(static, length) if law is None else bonds(law))


@dataclass(frozen=True, eq=False, slots=True)
class ClimbingModel:
    """What `march.march` needs to know: grooves under a load [N], and the law as under a load that changes."""

    grooves: Grooves
    load: float
    law: Rubbing

    @property
    def kind(self) -> tuple:
        """(contact, law): what the hub takes an instance of its loop for."""
        return HERE, ""

    @property
    def limit(self) -> float:
        """Scale of the residuals [N]: the largest force of the steepest flank."""
        return self.grooves.capacity(self.load, self.law.static)

    @property
    def length(self) -> float:
        """Bond length [m]."""
        return self.law.length

    @property
    def reduction(self):
        """None: no shear modes."""

    @property
    def set_valued(self) -> bool:
        """Whether the law holds without any stretch: it stretches."""
        return False

    @property
    def runner(self):
        """The class that marches it."""
        return ClimbingRun

    def build(self, hub=None) -> tuple:
        """(Climbing, None) with arrays of their own, at rest at the slide 0."""
        g, law = self.grooves, self.law
        normal = np.array([self.load * np.hypot(1.0, float(g.slope(0.0)))])
        memory = np.zeros((3, 1))
        memory[1 if law.kind == PLASTIC else 0] = normal * (1.0 if law.kind == PLASTIC else law.force[3])
        weight = np.array([law.static / (law.length if law.kind == POINTS else 1.0)])
        at = np.zeros(12)
        at[VERTICAL] = self.load
        flank = np.array([self.load, g.wave, g.amplitude, g.phase, g.lifted_mass, law.kind])
        return Climbing(flank, at, np.array(law.force, float), memory, normal.copy(), normal, np.zeros((0, 1)),
                        np.arange(1), **sheared(weight, law.length, law.growth, np.zeros((1, 0)), ())), None

    def shown(self, contact) -> dict:
        """Nothing: one point has no field."""
        return {}


class ClimbingRun(Run):
    """The arrays of a march over grooves, and its clock."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, hub, start=None):
        super().__init__(modes, drive, model, steps_per_cycle, travel, hub, start)
        q, v = self.modes.slide @ self.state[0], self.modes.slide @ self.state[1]
        steep, c = float(model.grooves.slope(q)), self.contact
        c.now_at[RISE] = steep * v
        normal = model.load * np.hypot(1.0, steep)
        c.memory[:] *= normal / c.before  # it was built at the slide 0
        c.before[:] = c.now[:] = normal
        self.ledger[0] += self.strained()

    def response(self, rows, number) -> Response:
        """Histories; with a lifted mass `extra` has normal_load [N], the vertical force N + m (t q'' + t' q'^2)."""
        out, g, modes = super().response(rows, number), self.model.grooves, self.modes
        if not g.lifted_mass:
            return out
        push, springs = np.outer(self.drive.values(out.time), modes.base), out.modal * modes.omega**2
        pull = np.outer(out.force, modes.slide) / modes.mass
        along = -(push + out.modal_rate @ modes.dampers.T + springs + pull) @ modes.slide
        lift = g.slope(out.slide) * along + g.bend(out.slide) * out.slide_rate**2
        return replace(out, extra=out.extra | {"normal_load": self.model.load + g.lifted_mass * lift})

    def _judge(self, status: int) -> None:
        super()._judge(status)
        if self.contact.now_at[LIFTS] and self.outcome is None:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = lifts(self.model.grooves, self.done * self.prop.dt)

