"""The contact of a law with memory along the flanks of grooves, for marches and for slides that are given."""

from dataclasses import dataclass, replace

import numpy as np

from ...core import Outcome, Response
from ...friction.grooves import STEADY, Grooves, Swing
from ...slip.shear_modes import SHEAR_MODES, enough_modes, shear_modes, tangential_stiffness
from ..contacts.arrays import Climbing
from ..march.march import Run
from ..march.varying_load import PLASTIC, Rubbing, bonds, plastic, rub_of
from .run import lifts, refuse_heavy

HERE = "dynamics.grooves.contact_kernels"
STIFF = 0.1  # of tolerance times the slide at which pieces let go: a bond length that is 1.7 of it off in force at most
SHORT = 1e-3  # of that slide: the shortest bonds by which shear modes are chosen
RISE, VERTICAL, LIFTS, BEFORE, NORMAL, RAISED = 0, 1, 4, 12, 13, 15  # of Climbing.now_at


def model_of(grooves: Grooves, load: float, static: float, length: float, law, modes) -> "ClimbingModel":
    """The model of the elastic-plastic law of a length [m], or of the bonds `law` (friction.bonds.parameters.Bonds).

    length 0: Coulomb's law at the points of pieces that give way, which `giving` makes.
    modes: of the rig, None of a bench; PatchfemError as of `run.refuse_heavy`.
    """
    if modes is not None:
        refuse_heavy(grooves, static, modes)
    return ClimbingModel(grooves, load, plastic(static, length) if law is None else bonds(law))


def giving(model: "ClimbingModel", patch, count: int | None, tolerance: float) -> "ClimbingModel":
    """The model whose points are those of a solved Patch, behind the shear modes of its pieces: `count` of them, or as
    many as the tolerance asks for.

    Points of Coulomb's law behind pieces of the stiffness K_t are elastic-plastic ones whose springs are 1/(STIFF
    tolerance) times as stiff, a bond length STIFF tolerance mu N/K_t: on flat ground the force is then off by at most
    0.17 of the tolerance, over the friction limit, from the exact elements (`slip.shear_modes.jenkins_set`).
    """
    law, force = model.law, patch.pressure.sigma_n * patch.pieces.interface.weight
    limit, weakening, length = law.static * force, 1.0, law.length
    if not length:
        reach = limit.sum() / tangential_stiffness(patch.giving, force > 0)
        law, length = plastic(law.static, STIFF * tolerance * reach), max(STIFF * tolerance, SHORT) * reach
    if law.growth[0] >= 0:
        weakening = law.growth[3] / law.growth[4] if law.growth[4] > 0 else np.inf
    found = shear_modes(patch.giving, limit, length, count, weakening) if count is not None else \
        enough_modes(patch.giving, limit, length, SHEAR_MODES, 0.1 * tolerance, weakening)
    return replace(model, law=law, shear=found, share=tuple(force[found.points] / force.sum()))


class FlankModel:
    """What `march.march` asks of a contact along flanks: of `grooves`, under a `load` [N] with its `swing`, of the
    coefficient `static` [1]."""

    __slots__ = ()
    joints, laws, loading = (), (), ""  # nothing beside it, and the loop knows of a load that stays

    @property
    def limit(self) -> float:
        """Scale of the residuals [N]: the largest force of the steepest flank."""
        return self.grooves.capacity(self.load + abs(self.swing.amplitude), self.static)

    @property
    def reduction(self):
        """ShearModes behind the contact, None of pieces that are rigid in shear."""

    @property
    def set_valued(self) -> bool:
        """Whether the law holds without any stretch: it stretches."""
        return False

    @property
    def runner(self):
        """The class that marches it."""
        return FlankRun


@dataclass(frozen=True, eq=False, slots=True)
class ClimbingModel(FlankModel):
    """What `march.march` needs to know: grooves under a load [N], and the law as under a load that changes.

    shear: ShearModes on the points under load where the pieces give way, share (a,): those of the points in the load.
    The pieces climb as one: the height and the slope are those at the slide of the holder, and the points share the
    normal force as they share the load. swing: of the load about its mean; the books then count the work done against
    it, int N dz, for what its height stores.
    """

    grooves: Grooves
    load: float
    law: Rubbing
    shear: object = None
    share: tuple = (1.0,)
    swing: Swing = STEADY

    @property
    def kind(self) -> tuple:
        """(contact, law): what the hub takes an instance of its loop for."""
        return HERE, ""

    @property
    def static(self) -> float:
        """Coefficient of friction [1]."""
        return self.law.static

    @property
    def length(self) -> float:
        """Bond length [m]."""
        return self.law.length

    @property
    def runner(self):
        """The class that marches it."""
        return ClimbingRun

    def build(self, hub=None) -> tuple:
        """(Climbing, None) with arrays of their own, at rest at the slide 0."""
        g, law, share = self.grooves, self.law, np.array(self.share, float)
        begin = float(self.swing.about(self.load, 0.0))
        whole, at = begin * np.hypot(1.0, float(g.slope(0.0))), np.zeros(16)
        at[[VERTICAL, BEFORE, NORMAL, RAISED]] = begin, whole, whole, begin * g.height(0.0)
        swing = self.swing.amplitude, self.swing.omega, self.swing.phase
        flank = np.array([self.load, g.wave, g.amplitude, g.phase, g.lifted_mass, law.kind, *swing])
        return Climbing(flank, at, share, *rub_of(law, whole * share, self.shear, self.limit)), None

    def shown(self, contact) -> dict:
        """Of pieces that give way the points' friction along the flank [N], what is elastic there [m] and their share
        of the vertical force [N], (3, a); nothing of one point, which has no field."""
        if self.shear is None:
            return {}
        top, bottom = contact.memory[0], contact.memory[1]
        if self.law.kind == PLASTIC:
            force, over = self.law.static * top, self.law.length * np.divide(top, bottom, where=bottom > 0,
                                                                             out=np.zeros_like(top))
        else:
            force, over = self.law.static / self.law.length * bottom, np.divide(bottom, top, where=top > 0,
                                                                                out=np.zeros_like(top))
        return {"nodes": np.stack([force, over + contact.b @ contact.modes, contact.share * contact.now_at[VERTICAL]])}


class FlankRun(Run):
    """The arrays of a march of a contact along flanks, and its clock."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, hub, start=None):
        super().__init__(modes, drive, model, steps_per_cycle, travel, hub, start)
        q, v = self.modes.slide @ self.state[0], self.modes.slide @ self.state[1]
        steep, at = float(model.grooves.slope(q)), self.contact.now_at
        begin = float(model.swing.about(model.load, 0.0))
        normal = begin * np.hypot(1.0, steep)
        self._pressed(normal / at[NORMAL])
        at[RISE], at[BEFORE], at[NORMAL], at[RAISED] = steep * v, normal, normal, begin * model.grooves.height(q)
        self.ledger[0] += self.strained()

    def placed(self, place, rate) -> None:
        """As of a Run; what rises has the speed of the flank there."""
        super().placed(place, rate)
        self.contact.now_at[RISE] = float(self.model.grooves.slope(self.modes.slide @ place)) * self.modes.slide @ rate

    def _pressed(self, share: float) -> None:
        """Bring the memory to a normal force that is `share` of that at the slide 0, for which it was built."""

    def response(self, rows, number) -> Response:
        """Histories; with a lifted mass or a load that swings `extra` has normal_load [N], the vertical force
        N + m (t q'' + t' q'^2)."""
        out, g, modes, swing = super().response(rows, number), self.model.grooves, self.modes, self.model.swing
        if not g.lifted_mass and not swing.amplitude:
            return out
        push, springs = np.outer(self.drive.values(out.time), modes.base), out.modal * modes.omega**2
        pull = np.outer(out.force, modes.slide) / modes.mass
        along = -(push + out.modal_rate @ modes.dampers.T + springs + pull) @ modes.slide
        lift = g.slope(out.slide) * along + g.bend(out.slide) * out.slide_rate**2
        return replace(out, extra=out.extra | {"normal_load": swing.about(self.model.load, out.time)
                                               + g.lifted_mass * lift})

    def _judge(self, status: int) -> None:
        super()._judge(status)
        if self.contact.now_at[LIFTS] and self.outcome is None:
            self.outcome = Outcome.LEAVES_GROOVES
            self.message = lifts(self.model.grooves, self.done * self.prop.dt)


class ClimbingRun(FlankRun):
    """The arrays of a march whose points have a memory of their loads."""

    def _pressed(self, share: float) -> None:
        c = self.contact
        c.memory[:] *= share
        c.before[:] *= share
        c.now[:] *= share
