"""Contacts of laws with memory along the flanks of grooves, for marches and for prescribed slides."""

from dataclasses import dataclass, replace

import numpy as np

from ...contact.stiffness import tangential_stiffness
from ...core import Outcome, PatchfemError, Response
from ...friction.grooves import Grooves
from ...slip.shear_modes import N_SHEAR_MODES, enough_modes, shear_modes
from ..integrated import accelerations
from ..interfaces.arrays import Climbing
from ..march.march import Run
from ..march.varying_load import PLASTIC, Rubbing, plastic, rub_of

HERE = "dynamics.grooves.contact_kernels"
STIFF = 0.1  # of tolerance times the slide at which pieces let go: a bond length that is 1.7 of it off in force at most
SHORT = 1e-3  # of that slide: the shortest bonds by which shear modes are chosen
# of Climbing.now_at
RISE = 0
VERTICAL = 1
LIFTS = 4
BEFORE = 12
NORMAL = 13


def refuse_heavy(grooves: Grooves, static: float, modes) -> None:
    """Raise PatchfemError where friction under the lifted mass takes all of the mass that slides, 1 + m s t (t - mu)/(1
    + mu t) <= 0 on some flank, s [1/kg] the slide's acceleration per newton."""
    own = modes.mass / float(modes.slide @ modes.slide)
    taken = -grooves.lifted_mass * grooves.min_mass_ratio(static)
    if taken >= own:
        raise PatchfemError(
            f"a lifted mass of {grooves.lifted_mass:.6g} kg presses so hard on the downward flank that "
            f"friction exceeds the inertia of the sliding mass of {own:.6g} kg, and the motion is then "
            f"not determined; the lifted mass must be below {own / -grooves.min_mass_ratio(static):.6g} "
            "kg",
            f"{grooves.key}.lifted_mass",
        )


def lifts(grooves: Grooves, time: float) -> str:
    """The sentence on a lifted mass that leaves its grooves at a time [s]."""
    return (
        f"the lifted mass of {grooves.lifted_mass:.3g} kg leaves the grooves at {time:.6g} s: the inertia of this "
        f"mass takes all of the load; lower {grooves.key}.lifted_mass or the drive, or raise the load"
    )


def model_of(grooves: Grooves, load: float, law: Rubbing, modes) -> "ClimbingModel":
    """Return the model of a law with memory (`march.varying_load.plastic` or `bonds`) under a load [N].

    Coulomb's law at the points of pieces that give way is plastic of the length 0, which `giving` makes anew.
    modes: of the rig, None of a bench; PatchfemError as of `refuse_heavy`.
    """
    if modes is not None:
        refuse_heavy(grooves, law.static, modes)
    return ClimbingModel(grooves, load, law)


def giving(model: "ClimbingModel", patch, count: int | None, tolerance: float) -> "ClimbingModel":
    """The model whose points are those of a solved Patch, behind the shear modes of its pieces: `count` of them, or as
    many as the tolerance asks for.

    Points of Coulomb's law behind pieces of the stiffness K_t are elastic-plastic ones whose springs are 1/(STIFF
    tolerance) times as stiff, a bond length STIFF tolerance mu N/K_t: on flat ground the force is then off by at most
    0.17 of the tolerance, over the friction limit, from the exact elements (`slip.shear_modes.jenkins_set`).
    """
    law = model.law
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    limit = law.static * force
    weakening = 1.0
    length = law.length
    if not length:
        reach = limit.sum() / tangential_stiffness(patch.giving, force > 0)
        law = plastic(law.static, STIFF * tolerance * reach)
        length = max(STIFF * tolerance, SHORT) * reach
    if law.growth[0] >= 0:
        weakening = law.growth[3] / law.growth[4] if law.growth[4] > 0 else np.inf
    found = (
        shear_modes(patch.giving, limit, length, count, weakening)
        if count is not None
        else enough_modes(patch.giving, limit, length, N_SHEAR_MODES, 0.1 * tolerance, weakening)
    )
    return replace(model, law=law, shear=found, share=tuple(force[found.points] / force.sum()))


class FlankModel:
    """What `march.march` asks of a contact along the flanks of `grooves`, under a `load` [N], of the coefficient
    `static` [1]."""

    __slots__ = ()
    # nothing beside it, and the loop knows of a load that stays
    joints = ()
    laws = ()
    loading = ""

    @property
    def limit(self) -> float:
        """Scale of the residuals [N]: the largest force of the steepest flank."""
        return self.grooves.max_force(self.load, self.static)

    @property
    def reduction(self):
        """ShearModes behind the contact, None of pieces that are rigid in shear."""

    @property
    def set_valued(self) -> bool:
        """Whether the law holds without any stretch: it stretches."""
        return False

    def shown(self, contact) -> dict:
        """Nothing: all points share its stretch, if it has any."""
        return {}


@dataclass(frozen=True, eq=False, slots=True)
class ClimbingModel(FlankModel):
    """A law with memory, as under a load that changes.

    shear: ShearModes on the points under load where the pieces give way, share (a,): those of the points in the load.
    The pieces climb as one: the height and the slope are those at the slide of the holder, and the points share the
    normal force as they share the load.
    """

    grooves: Grooves
    load: float
    law: Rubbing
    shear: object = None
    share: tuple = (1.0,)

    @property
    def kind(self) -> tuple:
        """(contact, law): what `march.instances` takes an instance of its loop for."""
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

    def build(self) -> Climbing:
        """The Climbing with arrays of its own, at rest at the slide 0."""
        g = self.grooves
        share = np.array(self.share, float)
        flank = np.array(
            [self.load, g.wave_number, g.amplitude, g.phase, g.lifted_mass, self.law.kind]
        )
        normal = self.load * np.hypot(1.0, float(g.slope(0.0)))
        now_at = np.zeros(14)
        now_at[[VERTICAL, BEFORE, NORMAL]] = self.load, normal, normal
        return Climbing(
            flank, now_at, share, *rub_of(self.law, normal * share, self.shear, self.limit)
        )

    def shown(self, contact) -> dict:
        """Of pieces that give way the points' friction along the flank [N], what is elastic there [m] and their share
        of the vertical force [N], (3, a); nothing of one point, which has no field."""
        if self.shear is None:
            return {}
        top = contact.memory[0]
        bottom = contact.memory[1]
        if self.law.kind == PLASTIC:
            force = self.law.static * top
            over = self.law.length * np.divide(
                top, bottom, where=bottom > 0, out=np.zeros_like(top)
            )
        else:
            force = self.law.static / self.law.length * bottom
            over = np.divide(bottom, top, where=top > 0, out=np.zeros_like(top))
        return {
            "nodes": np.stack(
                [force, over + contact.b @ contact.modes, contact.share * contact.now_at[VERTICAL]]
            )
        }


class GroovesRun(Run):
    """The arrays of a march over grooves, and its clock."""

    def response(self, rows, number) -> Response:
        """Histories; with a lifted mass `extra` has normal_load [N], the vertical force N + m (t q'' + t' q'^2)."""
        out = super().response(rows, number)
        g = self.model.grooves
        modes = self.modes
        if not g.lifted_mass:
            return out
        along = (
            accelerations(
                modes,
                self.drive.values(out.time),
                out.modal,
                out.modal_rate,
                np.outer(out.force, modes.slide),
            )
            @ modes.slide
        )
        lift = g.slope(out.slide) * along + g.slope_derivative(out.slide) * out.slide_rate**2
        return replace(
            out, extra=out.extra | {"normal_load": self.model.load + g.lifted_mass * lift}
        )

    def _leaves(self) -> None:
        """Mark the run as one whose lifted mass has left the grooves."""
        self.outcome = Outcome.LEAVES_GROOVES
        self.message = lifts(self.model.grooves, self.done * self.prop.dt)


class ClimbingRun(GroovesRun):
    """The arrays of a march whose points have a memory of their loads, and its clock."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, loops, start=None):
        super().__init__(modes, drive, model, steps_per_cycle, travel, loops, start)
        q = self.modes.slide @ self.state[0]
        v = self.modes.slide @ self.state[1]
        slope = float(model.grooves.slope(q))
        contact = self.contact
        now_at = self.contact.now_at
        normal = model.load * np.hypot(1.0, slope)
        contact.memory[:] *= normal / now_at[NORMAL]
        contact.pressed[:] *= normal / now_at[NORMAL]
        now_at[[RISE, BEFORE, NORMAL]] = slope * v, normal, normal
        self.ledger[0] += self.strained()

    def placed(self, place, rate) -> None:
        """As of a Run; what rises has the speed of the flank there."""
        super().placed(place, rate)
        self.contact.now_at[RISE] = (
            float(self.model.grooves.slope(self.modes.slide @ place)) * self.modes.slide @ rate
        )

    def _judge(self, status: int) -> None:
        super()._judge(status)
        if self.contact.now_at[LIFTS] and self.outcome is None:
            self._leaves()
