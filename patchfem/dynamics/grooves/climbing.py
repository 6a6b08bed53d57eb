"""Contacts of laws with memory along flanks, for marches and prescribed slides."""

from dataclasses import dataclass, replace

import numpy as np

from ...contact.stiffness import tangential_stiffness
from ...core import Outcome, PatchfemError, Response
from ...friction.grooves import Grooves
from ...slip.shear_modes import N_SHEAR_MODES, enough_modes, shear_modes
from ..integrated import find_accelerations
from ..interfaces.arrays import ClimbingPoints
from ..ledger import Ledger
from ..march.run import Run
from ..march.varying_load import (
    PLASTIC,
    VaryingLoadLaw,
    make_elastic_plastic_law,
    make_pressed_fields,
)
from .arrays import ClimbPlace

CONTACT_MODULE = "dynamics.grooves.contact_kernels"
# bond length of points of Coulomb's law over the tolerance times the slide at which pieces slip as a whole; the force is
# then wrong by at most 0.17 of the tolerance
COULOMB_LENGTH_RATIO = 0.1
# shortest bond length over that slide by which shear modes are chosen
MIN_LENGTH_RATIO = 1e-3


def check_lifted_mass(grooves: Grooves, static: float, modes) -> None:
    """Raise PatchfemError where friction takes all inertia of the sliding mass.

    That is the case where 1 + m s t (t - mu)/(1 + mu t) <= 0 on some flank, with s [1/kg] the
    acceleration of the relative displacement per newton.

    Parameters
    ----------
    grooves : Grooves
    static : float
        Coefficient of friction.
    modes : ModalBasis
    """
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


def lift_message(grooves: Grooves, time: float) -> str:
    """Return the sentence on a lifted mass that leaves its grooves at a time [s]."""
    return (
        f"the lifted mass of {grooves.lifted_mass:.3g} kg leaves the grooves at {time:.6g} s: the inertia of this "
        f"mass takes all of the load; lower {grooves.key}.lifted_mass or the drive, or raise the load"
    )


def make_model(grooves: Grooves, load: float, law: VaryingLoadLaw, modes) -> "ClimbingModel":
    """Return the model of a law with memory along flanks.

    Coulomb's law at the points of pieces that deform in shear is elastic-plastic with length 0;
    `with_shear_modes` gives it a length.

    Parameters
    ----------
    grooves : Grooves
    load : float
        [N].
    law : VaryingLoadLaw
        Of `march.varying_load.plastic` or `bonds`.
    modes : ModalBasis or None
        None for a bench, where no mass is checked.

    Returns
    -------
    ClimbingModel

    Raises
    ------
    PatchfemError
        As `check_lifted_mass`.
    """
    if modes is not None:
        check_lifted_mass(grooves, law.static, modes)
    return ClimbingModel(grooves, load, law)


def with_shear_modes(
    model: "ClimbingModel", patch, count: int | None, tolerance: float
) -> "ClimbingModel":
    """Return the model with the points of a solved patch, behind the shear modes of its pieces.

    Points of Coulomb's law behind pieces of the shear stiffness K_t become elastic-plastic ones
    with a bond length COULOMB_LENGTH_RATIO tolerance mu N/K_t: on flat ground the force is then
    wrong by at most 0.17 of the tolerance, over the friction limit, compared with exact elements
    (`slip.shear_modes.jenkins_set`).

    Parameters
    ----------
    model : ClimbingModel
    patch : Patch
    count : int or None
        Number of shear modes; None for as many as the tolerance needs.
    tolerance : float

    Returns
    -------
    ClimbingModel
    """
    law = model.law
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    limit = law.static * force
    weakening = 1.0
    length = law.length
    if not length:
        reach = limit.sum() / tangential_stiffness(patch.giving, force > 0)
        law = make_elastic_plastic_law(law.static, COULOMB_LENGTH_RATIO * tolerance * reach)
        length = max(COULOMB_LENGTH_RATIO * tolerance, MIN_LENGTH_RATIO) * reach
    if law.growth[0] >= 0:
        weakening = law.growth[3] / law.growth[4] if law.growth[4] > 0 else np.inf
    found = (
        shear_modes(patch.giving, limit, length, count, weakening)
        if count is not None
        else enough_modes(patch.giving, limit, length, N_SHEAR_MODES, 0.1 * tolerance, weakening)
    )
    return replace(model, law=law, shear=found, share=tuple(force[found.points] / force.sum()))


class FlankModel:
    """Description of a contact along the flanks of `grooves` for `march.march`.

    It is under a `load` [N] and has the coefficient of friction `static` [1].
    """

    __slots__ = ()
    # there are no other elements, and the compiled loop treats the load as constant
    joints = ()
    laws = ()
    loading = ""

    @property
    def limit(self) -> float:
        """Largest force of the steepest flank [N], the scale of the residuals."""
        return self.grooves.max_force(self.load, self.static)

    @property
    def reduction(self):
        """ShearModes behind the contact, None for pieces that are rigid in shear."""

    @property
    def set_valued(self) -> bool:
        """Whether the law holds without any stretch; it does not."""
        return False

    def picture_fields(self, contact) -> dict:
        """Return an empty dict, because all points have the same stretch."""
        return {}


@dataclass(frozen=True, eq=False, slots=True)
class ClimbingModel(FlankModel):
    """A law with memory along flanks.

    - grooves, load [N], law
    - shear: ShearModes on the points under load where the pieces deform in shear, else None
    - share: (a,) fractions of the load that the points carry

    The pieces climb as one: height and slope are those at the relative displacement of the holder,
    and the points carry the same fractions of the normal force as of the load.
    """

    grooves: Grooves
    load: float
    law: VaryingLoadLaw
    shear: object = None
    share: tuple = (1.0,)

    @property
    def kind(self) -> tuple:
        """Contact and law of which `march.instances` makes a loop."""
        return CONTACT_MODULE, ""

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
        """Class that marches this contact."""
        return ClimbingRun

    def build(self) -> ClimbingPoints:
        """Return the arrays of the contact at rest at the relative displacement 0."""
        g = self.grooves
        share = np.array(self.share, float)
        flank = np.array(
            [self.load, g.wave_number, g.amplitude, g.phase, g.lifted_mass, self.law.kind]
        )
        normal = self.load * np.hypot(1.0, float(g.slope(0.0)))
        climb = np.zeros(len(ClimbPlace))
        climb[[ClimbPlace.VERTICAL_FORCE, ClimbPlace.START_NORMAL, ClimbPlace.END_NORMAL]] = (
            self.load,
            normal,
            normal,
        )
        return ClimbingPoints(
            flank,
            climb,
            share,
            *make_pressed_fields(self.law, normal * share, self.shear, self.limit),
        )

    def picture_fields(self, contact) -> dict:
        """Return fields of the points (3, a), nothing for one point.

        They are friction along the flank [N], elastic stretch [m] and the fraction of the vertical
        force [N].
        """
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
                [
                    force,
                    over + contact.b @ contact.modes,
                    contact.share * contact.climb[ClimbPlace.VERTICAL_FORCE],
                ]
            )
        }


class GroovesRun(Run):
    """Arrays and time of a march over grooves."""

    def make_response(self, rows, number) -> Response:
        """Return histories; with a lifted mass `extra` has normal_load [N], the vertical force."""
        out = super().make_response(rows, number)
        g = self.model.grooves
        modes = self.modes
        if not g.lifted_mass:
            return out
        along = (
            find_accelerations(
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
        """Set the outcome of a run whose lifted mass has left the grooves."""
        self.outcome = Outcome.LEAVES_GROOVES
        self.message = lift_message(self.model.grooves, self.done * self.prop.dt)


class ClimbingRun(GroovesRun):
    """Arrays and time of a march whose points remember their loads."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, loops, start=None):
        super().__init__(modes, drive, model, steps_per_cycle, travel, loops, start)
        q = self.modes.slide @ self.state[0]
        v = self.modes.slide @ self.state[1]
        slope = float(model.grooves.slope(q))
        contact = self.contact
        climb = self.contact.climb
        normal = model.load * np.hypot(1.0, slope)
        contact.memory[:] *= normal / climb[ClimbPlace.END_NORMAL]
        contact.pressed[:] *= normal / climb[ClimbPlace.END_NORMAL]
        climb[[ClimbPlace.RISE_SPEED, ClimbPlace.START_NORMAL, ClimbPlace.END_NORMAL]] = (
            slope * v,
            normal,
            normal,
        )
        self.ledger[Ledger.DRIVE_WORK] += self.find_interface_energy()

    def move_to(self, place, rate) -> None:
        """Set the state, like `Run.move_to`; the lifted mass has the velocity of the flank there."""
        super().move_to(place, rate)
        self.contact.climb[ClimbPlace.RISE_SPEED] = (
            float(self.model.grooves.slope(self.modes.slide @ place)) * self.modes.slide @ rate
        )

    def set_outcome(self, status: int) -> None:
        super().set_outcome(status)
        if self.contact.climb[ClimbPlace.HAS_LIFTED] and self.outcome is None:
            self._leaves()
