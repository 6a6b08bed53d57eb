"""Mode of a rig with its contact: shape of the stuck mode and scales of its amplitudes."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...effects import law_has_trait
from ...event_driven.cases import UndrivenRig
from ...model.model import Model
from ...runs.joint import FreeRig, solve_without_joint
from ...runs.patch.press import Patch
from ...runs.plan import plan
from ...runs.rig import decays
from ...runs.rig.plan import stuck_stiffnesses
from .bench_loops import compute_steady_loop

# Ratio of the smallest default amplitude to the amplitude at which the complete contact slips.
MIN_AMPLITUDE_OVER_GROSS_SLIP = 1e-2
# End of the message where another method has a curve
QUASI_STATIC_ADVICE = "; use --method quasi-static"
# Reason why the friction loop of a law has no closed form
NO_CLOSED_FORM = (
    "the friction loop of bonds has a closed form only with reading = "
    '"stretch", order = 1, a constant bond length and pieces that are rigid in shear'
)


class StuckMode(NamedTuple):
    """Structural mode with its contact stuck.

    - omega: circular frequency [rad/s], or None if nothing is elastic.
    - shape (n,): modal coordinates of the mode.
    """

    omega: float | None
    shape: np.ndarray


class JointMode(NamedTuple):
    """Mode of a rig coupled to its contact.

    Attributes
    ----------
    model : Model
        Model with the rig and its contact.
    patch : Patch or None
        Pressed patch of [contact].
    coarser : tuple
        Patches on coarser meshes, or None.
    mode : int
        Index of the coordinate of the mode.
    stuck_mode : StuckMode
        Frequency and shape of the mode while nothing slips.
    stiffness : (i,) array
        Tangential stiffness [N/m] of each interface while nothing slips.
    has_errors : bool
        Whether the errors of the steps and of the mesh are computed.
    has_force : bool
        Whether the force of phase resonance is computed.
    stiffer : FreeRig or None
        Rig and patch with a stiffer joint, if a joint was subtracted from the modes.
    """

    model: Model
    patch: Patch | None
    coarser: tuple[Patch | None, ...]
    mode: int
    stuck_mode: StuckMode
    stiffness: np.ndarray
    has_errors: bool = True
    has_force: bool = True
    stiffer: FreeRig | None = None

    @property
    def modes(self):
        """Modal basis of the rig."""
        return self.model.rig.modes

    @property
    def coarse(self):
        """Contact patch on the first coarser mesh; None if there is none."""
        return self.coarser[0]

    @property
    def shape(self) -> np.ndarray:
        """Shape (n,) of the mode with the contact stuck."""
        return self.stuck_mode.shape

    @property
    def omega(self) -> float:
        """Angular frequency [rad/s] of the stuck mode, or of the free mode if the former is 0."""
        return self.stuck_mode.omega or self.modes.omega[self.mode]

    @property
    def reach(self) -> float:
        """Magnitude of the displacement at the output per unit of the stuck mode shape."""
        return abs(self.modes.output @ self.shape)

    @property
    def face(self) -> int:
        """Index of the dominant interface, whose stiffness times relative displacement in the mode is largest."""
        slides = np.abs(self.modes.interfaces @ self.shape)
        is_elastic = np.isfinite(self.stiffness) & (self.stiffness > 0)
        return int(np.argmax(slides * np.where(is_elastic, self.stiffness, 1)))

    @property
    def face_slide(self) -> float:
        """Relative displacement of the dominant interface per unit of the stuck mode shape."""
        return self.modes.interfaces[self.face] @ self.shape

    @property
    def friction_limit(self) -> float:
        """Friction limit of the dominant interface [N]; 0 without friction."""
        model = self.model
        if len(model.rig.friction.interfaces) > 1 and self.patch is None:
            return self.interface_limits[self.face]
        if model.friction is None:
            return 0.0
        load = model.nominal_load if self.patch is None else self.patch.pressure.load
        return model.friction.static * load

    @property
    def interface_limits(self) -> list[float]:
        """Friction limits of the interfaces [N] under the loads that their tables give; 0 without one."""
        interfaces = self.model.rig.friction.interfaces
        return [(face.numbers.static or 0.0) * (face.load or 0.0) for face in interfaces]

    @property
    def is_linear(self) -> bool:
        """Whether no friction acts and no spring is nonlinear."""
        has_friction = bool(self.friction_limit) or any(self.interface_limits)
        return not (has_friction or self.model.rig.springs.is_nonlinear)

    @property
    def is_rigid(self) -> bool:
        """Whether friction sticks without any elastic displacement."""
        if self.model.partial_slip:
            return False
        for interface in self.model.rig.friction.interfaces:
            if law_has_trait(interface.numbers.law, "set-valued") and not interface.partial_slip:
                return True
        return False

    @property
    def has_cells(self) -> bool:
        """Whether a law has a density of sliders, which begin to slip one after the other."""
        interfaces = self.model.rig.friction.interfaces
        return any(law_has_trait(interface.numbers.law, "cells") for interface in interfaces)

    @property
    def has_partial_slip(self) -> bool:
        """Whether a part of a contact slips before the whole of it does."""
        return self.model.partial_slip or self.model.rig.friction.has_partial_slip

    @property
    def spring(self) -> float:
        """Stiffness of the mode without the contact [N/m], per unit of its coordinate."""
        return self.modes.mass * (self.modes.omega[self.mode] or self.stuck_mode.omega) ** 2

    @property
    def deflection(self) -> float:
        """Static relative displacement [m] of the mode without its contact, under the friction limit."""
        return self.friction_limit * self.face_slide**2 / self.spring

    @property
    def slip_displacement(self) -> float:
        """Relative displacement [m] at which the complete contact slips.

        For rigid friction it is the static deflection under the friction limit. Without friction it is the displacement
        at which a cubic spring doubles the stiffness of the mode, or at which an interlock engages.
        """
        rig = self.model.rig
        if not self.friction_limit:
            if rig.springs.cubic is None:
                return rig.springs.interlock[1]
            return np.sqrt(self.spring / abs(rig.springs.cubic))
        stiffness = self.stiffness[self.face]
        return self.friction_limit / stiffness if stiffness else self.deflection

    def output_amplitude(self, slide):
        """Return the amplitude at the output [m] for a relative displacement amplitude `slide` [m]."""
        return self.reach / (abs(self.face_slide) or 1.0) * slide

    @property
    def slip_amplitude(self) -> float:
        """Amplitude at the output [m] at which the complete contact slips."""
        return self.output_amplitude(self.slip_displacement)

    def slides(self, amplitudes) -> np.ndarray:
        """Return the amplitudes (k,) [m] of the slide of the first interface, in the stuck mode, for those at the output."""
        return np.abs(self.modes.interfaces[0] @ self.shape) * np.asarray(amplitudes) / self.reach

    def steady_laws(self) -> UndrivenRig:
        """Return the rig without its drive, with the laws of all interfaces.

        Raises PatchfemError if a law has no steady loop.
        """
        try:
            return decays.make_laws_on_mesh(self.model, self.patch)
        except PatchfemError:
            rig = self.model.rig
            has_bench = not rig.springs.is_nonlinear and len(rig.friction.interfaces) < 2
            advice = QUASI_STATIC_ADVICE if has_bench else ""
            raise PatchfemError(NO_CLOSED_FORM + advice) from None

    def require_steady_loops(self, method: str) -> None:
        """Raise PatchfemError if the free motion does not follow from steady friction loops.

        `method` names what cannot be computed, in the message.
        """
        model = self.model
        reason = ""
        if model.grooves is not None:
            reason = "on grooves"
        elif model.rig.friction.load_varies:
            reason = "with a load that changes with the motion"
        elif model.rig.friction.bands_slide_apart:
            reason = "for bands that slide independently of one another"
        elif self.is_rigid and len(model.rig.friction.interfaces) > 1:
            reason = "for several interfaces with rigid friction"
        if reason:
            raise PatchfemError(f"{method} cannot be computed {reason}")

    def spatial_discretization_errors(
        self, compute: Callable[["JointMode", UndrivenRig], np.ndarray], amplitudes
    ) -> np.ndarray | float:
        """Return the error estimates of a quantity for the mesh of patches in partial slip.

        Parameters
        ----------
        compute : callable
            Function of a JointMode and an UndrivenRig that returns quantities (r, k).
        amplitudes : (k,)
            Amplitudes of the quantities [m].

        Returns
        -------
        ndarray or float
            Error of each value, with the shape of the quantity; 0.0 if no errors are estimated, or without partial slip.
        """
        if not self.has_errors or not self.has_partial_slip:
            return 0.0
        return decays.estimate_mesh_error(
            self.steady_laws(),
            decays.make_laws_on_coarse_meshes(self.model, self.coarse, self.stiffer),
            lambda laws: compute(self.with_modes(laws.modes, laws.stiffness), laws),
            amplitudes,
        )

    def with_modes(self, modes, stiffness: np.ndarray) -> "JointMode":
        """Return the mode in another modal basis, with interfaces of stiffness (i,) [N/m] in stick."""
        if modes is self.modes:
            return self
        rig = replace(self.model.rig, modes=modes)
        stuck_mode = modes.compute_stuck_mode(modes.interfaces, stiffness, self.mode)
        return self._replace(model=replace(self.model, rig=rig), stuck_mode=StuckMode(*stuck_mode))


def build_joint(model: Model, name: str) -> JointMode:
    """Solve the contact of a rig and combine it with one of its modes.

    Parameters
    ----------
    model : Model
        Of a rig.
    name : str
        Name of the mode, or its number from 1 in a rig of masses; "" for the first mode.

    Returns
    -------
    JointMode
        Mode, pressed patch on several meshes, and stiffness of the stuck contact.

    Raises
    ------
    PatchfemError
        For a scene without a rig, and for a mode that has no backbone.
    """
    if model.rig is None:
        raise PatchfemError(
            "a backbone needs the scene of a rig; add the tables [structure] and [drive]",
            "structure",
        )

    # The pressed patch on its mesh and on coarser ones, of which None marks the end. The joint that was bolted in the modal
    # test is taken off the modes of `model`.
    patch = None
    stiffer = None
    coarser: tuple[Patch | None, ...] = (None,)
    if model.patch is not None:
        model, (patch, *others), stiffer = solve_without_joint(model)
        coarser = (*others, None)

    # First the mode without its contact, which has no frequency of stick.
    number = _find_mode(model.rig, name)
    modes = model.rig.modes
    free_mode = StuckMode(None, np.eye(modes.omega.size)[number])
    joint = JointMode(
        model, patch, coarser, number, free_mode, np.zeros(len(modes.interfaces)), stiffer=stiffer
    )

    # The contact sticks at small amplitudes and adds its stiffness to the mode.
    if not joint.is_linear:
        planned = joint._replace(stiffness=stuck_stiffnesses(model.rig, plan(model).chain))
        stiffness = _stuck_stiffness(planned)
        stuck_mode = modes.compute_stuck_mode(modes.interfaces, stiffness, number)
        joint = joint._replace(stuck_mode=StuckMode(*stuck_mode), stiffness=stiffness)

    _check_mode(joint)
    return joint


def _check_mode(joint: JointMode) -> None:
    """Raise PatchfemError if the mode of a joint has no backbone."""
    model = joint.model
    modes = joint.modes
    rig = model.rig
    has_friction = model.friction is not None or bool(rig.friction.interfaces)

    # Friction without a limit, beside a nonlinear spring that alone would have a backbone.
    if not joint.friction_limit and rig.springs.is_nonlinear and has_friction:
        raise PatchfemError(
            "the load or the coefficient of friction is 0, so no friction acts; for the backbone "
            "without friction leave out [friction] and the normal load",
            "friction.static",
        )

    # The mode has a natural frequency while the joint slides or while it sticks.
    if not (modes.omega[joint.mode] or joint.stuck_mode.omega):
        raise PatchfemError(
            "this mode has 0 Hz and rigid friction acts on it, so the mode has no natural frequency; "
            "use a law with a stiffness, such as elastic-plastic"
        )

    # Damping depends on the amplitude only if the mode moves the contact, or if a spring is nonlinear. The amplitude is the
    # motion of the output (`reach` per unit of the mode).
    moves_contact = np.abs(modes.interfaces @ joint.shape).max(initial=0.0) > 0
    if not (joint.is_linear or rig.springs.is_nonlinear or moves_contact):
        raise PatchfemError(
            "the mode does not move the contact, so no friction acts on the mode; choose another "
            "mode with --mode, or give this mode the key `slide`"
        )

    if not joint.reach > 0:
        raise PatchfemError(
            "the mode does not move the point of the output, so its amplitude there is 0; give the "
            "mode the key `output`, or choose another mode with --mode"
        )


def _find_mode(rig, name: str) -> int:
    """Return the index of the coordinate of the mode `name` of a rig.

    "" is the first mode.
    """
    modes = rig.modes
    names = list(rig.modes.names)
    count = modes.omega.size
    # Computed modes have numbers, listed ones have names.
    if not rig.structure.lists_modes:
        if not name:
            return int(np.argmax(modes.omega > 0))
        if not (name.isdecimal() and 1 <= int(name) <= count):
            plural = "s" if count != 1 else ""
            raise PatchfemError(
                f"backbone --mode {name}: the rig has {count} mode{plural}, counted from 1", ""
            )
        return int(name) - 1
    if name and name not in names:
        raise PatchfemError(
            f"backbone --mode {name}: no mode has this name; the modes of the rig are "
            f"{', '.join(names)}",
            "",
        )
    k = names.index(name) if name else 0
    return k if modes.shapes is None else int(np.argmax(np.abs(modes.shapes[k])))


def _stuck_stiffness(joint: JointMode) -> np.ndarray:
    """Return the tangential stiffness (i,) [N/m] of each interface before any slip.

    If the laws have friction loops in closed form, it is that of these loops. Otherwise it is that of a small loop on a
    bench for a single interface, and that of the plan (`joint.stiffness`) for several.
    """
    model = joint.model
    planned = joint.stiffness
    load_changes = model.rig.friction.load_varies or model.rig.friction.bands_slide_apart
    if joint.is_rigid or model.friction is None or model.grooves is not None or load_changes:
        return planned
    if not np.isfinite(planned).all() or not planned.all():
        return planned
    try:
        laws = joint.steady_laws()
        is_equal = (laws.rows == joint.modes.interfaces[:, None]).all(axis=2)
        return is_equal @ laws.stiffness
    except PatchfemError:
        if planned.size > 1:
            return planned
        # Fraction of the gross-slip amplitude at which there is no slip at all.
        small = 1e-5 * joint.friction_limit / planned[0]
        loop = compute_steady_loop(model, joint.patch, small, model.rig.first_mode.frequency)
        return np.array([loop.run.values["secant_stiffness"]])
