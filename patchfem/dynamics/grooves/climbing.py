"""Contact models for friction laws with memory that act along the flanks of grooves."""

from dataclasses import dataclass, replace

import numpy as np

from ...contact.stiffness import tangential_stiffness
from ...core import Outcome, PatchfemError, Response
from ...friction.grooves import Grooves
from ...slip.shear_modes import N_SHEAR_MODES, find_sufficient_modes, shear_modes
from ..integrated import find_accelerations
from ..interfaces.arrays import ClimbingPoints
from ..ledger import Ledger
from ..march.run import Run
from ..march.varying_load import (
    LawKind,
    VaryingLoadLaw,
    make_elastic_plastic_law,
    make_pressed_fields,
)
from .arrays import ClimbIndex

CONTACT_MODULE = "dynamics.grooves.contact_kernels"
# Bond length of the points that represent Coulomb's law, relative to the tolerance times the slide
# at gross slip; the force error is at most 0.17 of the tolerance.
COULOMB_LENGTH_RATIO = 0.1
# Smallest bond length for the choice of shear modes, relative to the slide at gross slip.
MIN_LENGTH_RATIO = 1e-3


def check_lifted_mass(grooves: Grooves, static: float, modes) -> None:
    """Raise PatchfemError if friction due to a lifted mass exceeds the inertia of the sliding mass.

    That is the case where 1 + m s t (t - mu)/(1 + mu t) <= 0 on some flank, with s [1/kg] the
    acceleration of the relative displacement per newton.

    Parameters
    ----------
    grooves : Grooves
    static : float
        Coefficient of friction.
    modes : ModalBasis
    """
    sliding_mass = modes.mass / float(modes.slide @ modes.slide)
    friction_mass = -grooves.lifted_mass * grooves.min_mass_ratio(static)
    if friction_mass >= sliding_mass:
        raise PatchfemError(
            f"a lifted mass of {grooves.lifted_mass:.6g} kg presses so hard on the downward flank that "
            f"friction exceeds the inertia of the sliding mass of {sliding_mass:.6g} kg, and the motion is then "
            f"not determined; the lifted mass must be below {sliding_mass / -grooves.min_mass_ratio(static):.6g} "
            "kg",
            f"{grooves.key}.lifted_mass",
        )


def lift_message(grooves: Grooves, time: float) -> str:
    """Return the error message for a lifted mass that leaves its grooves at a time [s]."""
    return (
        f"the lifted mass of {grooves.lifted_mass:.3g} kg leaves the grooves at {time:.6g} s: the inertia of this "
        f"mass takes all of the load; lower {grooves.key}.lifted_mass or the drive, or raise the load"
    )


def make_model(grooves: Grooves, load: float, law: VaryingLoadLaw, modes) -> "ClimbingModel":
    """Return the contact model for a friction law with memory along the flanks of grooves.

    Coulomb's law at points of pieces that deform in shear is an elastic-plastic law of length 0;
    `with_shear_modes` sets its length.

    Parameters
    ----------
    grooves : Grooves
    load : float
        Normal load [N].
    law : VaryingLoadLaw
        Law from `march.varying_load.make_elastic_plastic_law` or `make_bonds_law`.
    modes : ModalBasis or None
        None for a bench, whose inertia is not checked.

    Returns
    -------
    ClimbingModel

    Raises
    ------
    PatchfemError
        See `check_lifted_mass`.
    """
    if modes is not None:
        check_lifted_mass(grooves, law.static, modes)
    return ClimbingModel(grooves, load, law)


def with_shear_modes(
    model: "ClimbingModel", patch, count: int | None, tolerance: float
) -> "ClimbingModel":
    """Return a copy of the model that has the points and shear modes of a solved patch.

    Coulomb points on pieces of the shear stiffness K_t become elastic-plastic ones
    with a bond length COULOMB_LENGTH_RATIO tolerance mu N/K_t: on flat ground the force is then
    wrong by at most 0.17 of the tolerance, relative to the friction limit, compared with exact elements
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
        gross_slip_slide = limit.sum() / tangential_stiffness(patch.slip_compliance, force > 0)
        law = make_elastic_plastic_law(
            law.static, COULOMB_LENGTH_RATIO * tolerance * gross_slip_slide
        )
        length = max(COULOMB_LENGTH_RATIO * tolerance, MIN_LENGTH_RATIO) * gross_slip_slide
    if law.growth[0] >= 0:
        weakening = law.growth[3] / law.growth[4] if law.growth[4] > 0 else np.inf
    modes = (
        shear_modes(patch.slip_compliance, limit, length, count, weakening)
        if count is not None
        else find_sufficient_modes(
            patch.slip_compliance, limit, length, N_SHEAR_MODES, 0.1 * tolerance, weakening
        )
    )
    return replace(model, law=law, shear=modes, share=tuple(force[modes.points] / force.sum()))


class FlankModel:
    """Base class of contact models along the flanks of grooves, for `march.march`.

    A model has a normal `load` [N] and a static coefficient of friction `static` [1].
    """

    __slots__ = ()
    # A contact on the flanks of grooves has no further friction elements, and the compiled loop
    # treats the load as constant.
    joints = ()
    laws = ()
    loading = ""

    @property
    def limit(self) -> float:
        """Largest friction force [N] on the steepest flank, which scales the residuals."""
        return self.grooves.max_force(self.load, self.static)

    @property
    def reduction(self):
        """Shear modes of the pieces in contact, or None if the pieces are rigid in shear."""

    @property
    def set_valued(self) -> bool:
        """Return whether the law sticks rigidly (is set-valued); always False for a law with memory."""
        return False

    def get_plot_fields(self, contact) -> dict:
        """Return an empty dict, because all points have the same stretch and need no plot."""
        return {}


@dataclass(frozen=True, eq=False, slots=True)
class ClimbingModel(FlankModel):
    """Contact model of a friction law with memory along the flanks of grooves.

    - grooves, load, law: geometry, normal load [N] and friction law
    - shear: ShearModes of the points under load if the pieces deform in shear, otherwise None
    - share: (a,) fractions of the load carried by the points

    All points climb together: height and slope are those at the relative displacement of the holder,
    and the points carry the same fractions of the normal force as of the load.
    """

    grooves: Grooves
    load: float
    law: VaryingLoadLaw
    shear: object = None
    share: tuple = (1.0,)

    @property
    def kind(self) -> tuple:
        """Contact module and law module for which `march.instances` compiles the loop."""
        return CONTACT_MODULE, ""

    @property
    def static(self) -> float:
        """Static coefficient of friction [1]."""
        return self.law.static

    @property
    def length(self) -> float:
        """Bond length of the law [m]."""
        return self.law.length

    @property
    def runner(self):
        """Class that integrates a motion with this contact over time."""
        return ClimbingRun

    def allocate_contact(self) -> ClimbingPoints:
        """Allocate the contact arrays at rest, at zero relative displacement."""
        g = self.grooves
        share = np.array(self.share, float)
        flank = np.array(
            [self.load, g.wave_number, g.amplitude, g.phase, g.lifted_mass, self.law.kind]
        )
        normal = self.load * np.hypot(1.0, float(g.slope(0.0)))
        climb = np.zeros(len(ClimbIndex))
        climb[[ClimbIndex.VERTICAL_FORCE, ClimbIndex.START_NORMAL, ClimbIndex.END_NORMAL]] = (
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

    def get_plot_fields(self, contact) -> dict:
        """Return friction, stretch and load of the points (3, a) for plotting.

        The rows are friction along the flank [N], elastic stretch [m] and the fraction of the vertical
        force [N].
        """
        if self.shear is None:
            return {}
        top = contact.memory[0]
        bottom = contact.memory[1]
        if self.law.kind == LawKind.PLASTIC:
            force = self.law.static * top
            stretch = self.law.length * np.divide(
                top, bottom, where=bottom > 0, out=np.zeros_like(top)
            )
        else:
            force = self.law.static / self.law.length * bottom
            stretch = np.divide(bottom, top, where=top > 0, out=np.zeros_like(top))
        return {
            "nodes": np.stack(
                [
                    force,
                    stretch + contact.b @ contact.modes,
                    contact.share * contact.climb[ClimbIndex.VERTICAL_FORCE],
                ]
            )
        }


class GroovesRun(Run):
    """Time integration of a modal basis whose interface slides over grooves."""

    def make_response(self, rows, number) -> Response:
        """Return the time histories of samples, including the vertical force on a lifted mass.

        The vertical force is `extra["normal_load"]` [N].

        """
        response = super().make_response(rows, number)
        g = self.model.grooves
        modes = self.modes
        if not g.lifted_mass:
            return response
        acceleration = (
            find_accelerations(
                modes,
                self.drive.values(response.time),
                response.modal,
                response.modal_rate,
                np.outer(response.force, modes.slide),
            )
            @ modes.slide
        )
        lift = (
            g.slope(response.slide) * acceleration
            + g.slope_derivative(response.slide) * response.slide_rate**2
        )
        return replace(
            response, extra=response.extra | {"normal_load": self.model.load + g.lifted_mass * lift}
        )

    def _set_grooves_left(self) -> None:
        """Set the outcome and message for a march in which the lifted mass has left the grooves."""
        self.outcome = Outcome.LEAVES_GROOVES
        self.message = lift_message(self.model.grooves, self.done * self.prop.dt)


class ClimbingRun(GroovesRun):
    """Time integration over grooves under a friction law with memory."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, loops, start=None):
        super().__init__(modes, drive, model, steps_per_cycle, travel, loops, start)
        q = self.modes.slide @ self.state[0]
        v = self.modes.slide @ self.state[1]
        slope = float(model.grooves.slope(q))
        contact = self.contact
        climb = self.contact.climb
        normal = model.load * np.hypot(1.0, slope)
        contact.memory[:] *= normal / climb[ClimbIndex.END_NORMAL]
        contact.pressed[:] *= normal / climb[ClimbIndex.END_NORMAL]
        climb[[ClimbIndex.RISE_SPEED, ClimbIndex.START_NORMAL, ClimbIndex.END_NORMAL]] = (
            slope * v,
            normal,
            normal,
        )
        self.ledger[Ledger.DRIVE_WORK] += self.find_interface_energy()

    def move_to(self, position, rate) -> None:
        """Set the modal coordinates and rates at the start of a cycle, like `Run.move_to`.

        The lifted mass gets the vertical velocity of the flank there.

        """
        super().move_to(position, rate)
        self.contact.climb[ClimbIndex.RISE_SPEED] = (
            float(self.model.grooves.slope(self.modes.slide @ position)) * self.modes.slide @ rate
        )

    def set_outcome(self, status: int) -> None:
        super().set_outcome(status)
        if self.contact.climb[ClimbIndex.HAS_LIFTED] and self.outcome is None:
            self._set_grooves_left()
