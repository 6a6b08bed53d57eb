"""Friction laws of the interfaces of a rig in the form of each engine.

In: a Model, its Numerics and its Patch. Out: `Joint`s, from which follow the laws of the engine `hybrid` (`make_joints`),
the contact points of a march (`make_contact`), and the rig without a drive (`make_undriven_rig`).
A patch that slips part by part under a constant load is its exact set of Jenkins elements.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ... import friction, slip, time_steps
from ...core import PatchfemError
from ...effects import law_has_trait, law_supports
from ...hybrid import laws as hybrid_laws
from ...hybrid.cases import Load, UndrivenRig, list_interfaces
from ...hybrid.laws import grooves, masing
from ...hybrid.records import LawNumbers
from ...model.law import make_bond_parameters
from ...model.model import MIN_RIG_REST_SPEED, Model
from ..bench import averaged_law
from ..patch import faces, jenkins_elements
from ..results.interfaces import depends_on_pressure
from . import bands, bond_lists
from .engines import Numerics

NO_STEADY_LOOP = (
    'bonds have a steady loop only with friction.reading = "stretch", friction.order = 1, a constant bond length and '
    "pieces that are rigid in shear; run the scene in time instead"
)
NO_SOFT_LOOP = (
    "a patch that slips part by part has a steady loop only under law 'coulomb' or 'elastic-plastic'; run the scene in "
    "time instead"
)
MAX_STUCK_SLIP_RATIO = 1e-3  # largest slip per cycle of an interface that counts as stuck, relative to its elastic length


class Joint(NamedTuple):
    """Interface of a rig with its law and load.

    - law: effective keys of the friction law.
    - load: normal load, which may oscillate (`hybrid.cases.Load`).
    - speed: expected slip speed [m/s], from which the rest speed of bonds follows.
    - contact_load: mean load [N] on the whole contact, of which a band is a part; the stiffness and the damping in the
      keys of the law refer to it.
    - stiffness, yields: stiffness [N/m] and yield displacement [m] (e,) of the parallel elements of a patch that slips
      part by part, or None for an interface that slips as a whole.
    - reduction: JenkinsSet of such a patch, or None.
    """

    law: object
    load: Load
    speed: float
    contact_load: float
    stiffness: np.ndarray | None = None
    yields: np.ndarray | None = None
    reduction: slip.shear_modes.JenkinsSet | None = None

    def make_law(self):
        """Return the friction law of an interface that slips as a whole, as the record from which engines take its numbers.

        Its forces are per newton of load. For the nonlocal law it is the record of the bonds.
        """
        if law_has_trait(self.law.law, "bonds"):
            return make_bond_parameters(self.law, self.speed, MIN_RIG_REST_SPEED)
        return friction.record.make_law(self.law, self.contact_load)

    @property
    def length(self) -> float:
        """Relative displacement [m] over which the law stretches before it slips; 0 without a stretch."""
        if self.stiffness is None:
            return self.make_law().length
        total = self.stiffness.sum()
        return float(self.stiffness @ self.yields / total) if total > 0 else 0.0

    def make_step_law(self):
        """Return the law under its mean load as a `time_steps.laws.PointLaw`."""
        if self.stiffness is not None:
            return time_steps.laws.make_elements(self.stiffness, self.yields)
        return time_steps.laws.make_point_law(self.law.law, self.make_law(), self.load.mean)

    def make_hybrid_law(self) -> LawNumbers:
        """Return the law as LawNumbers, the form for the engine `hybrid`, which integrates from event to event."""
        if self.stiffness is not None:
            return masing.from_elements(self.stiffness, self.yields)
        load = self.load
        return hybrid_laws.make_law(self.law.law, self.make_law(), load.mean, varies=load.varies)

    def list_elements(self) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffness [N/m] and yield displacement [m], both (e,), of the parallel spring-slider elements.

        Both are empty for a law that is not made of such elements.
        """
        if self.stiffness is not None:
            return self.stiffness, self.yields
        list_elements = getattr(self.make_law(), "elements", None)
        return list_elements(self.load.mean) if list_elements else (np.zeros(0), np.zeros(0))


class Joints(NamedTuple):
    """Interfaces of a rig for the engine `hybrid`.

    - laws: (LawNumbers, Load) of each interface.
    - elements: stiffness [N/m] and yield displacement [m] (e,) of the elements of each interface, or () without partial
      slip.
    - contact: Joint of the only patch, if it slips part by part, or None.
    - stick_tolerance: largest slip per cycle [m] at which the interfaces count as stuck.
    """

    laws: tuple[tuple[LawNumbers, Load], ...] = ()
    elements: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    contact: Joint | None = None
    stick_tolerance: float = 0.0

    @property
    def has_kinks(self) -> bool:
        """Whether a law has elements that yield at several displacements."""
        return any(masing.has_many_elements(law) for law, _ in self.laws)

    @property
    def springs(self) -> np.ndarray:
        """Stiffness (i,) [N/m] of each interface in stick, or nan for a law that is not a single spring with a slider."""
        return np.array([_find_spring_stiffness(law) for law, _ in self.laws])


class LoadedInterface(NamedTuple):
    """Interface of a rig under its load.

    - keys: effective keys of the friction law.
    - load: normal load, which may oscillate.
    - patch: solved Patch, if the motion depends on its pressure; None for a point.
    - is_soft: whether the patch slips part by part.
    """

    keys: object
    load: Load
    patch: object
    is_soft: bool


def list_loaded_interfaces(model: Model, patch, meshed=()) -> list[LoadedInterface]:
    """Return the interfaces of a rig with their laws and loads, or [] without friction.

    Parameters
    ----------
    model : Model
        Rig with its interfaces.
    patch : Patch or None
        Patch of [contact]; None under [normal] and between masses.
    meshed : tuple of int
        Indices of the interfaces whose patches have a coarser mesh.
    """
    interfaces = model.rig.friction.interfaces
    if patch is not None and interfaces:
        load = Load(float(patch.pressure.load))
        return [LoadedInterface(model.friction, load, patch, bool(model.partial_slip))]
    parts = []
    for k, interface in enumerate(interfaces):
        load = interface.load
        load = _make_point_load(model.point) if load is None else Load(load)
        keys = interface.numbers
        own = None
        # Between masses only a patch whose shape matters to the motion is pressed; any other is a point.
        if interface.patch is not None and depends_on_pressure(keys, interface.patch):
            solved = faces.solve_contact_on_meshes(interface, model.accuracy.tolerance)
            own = solved[int(k in meshed)]
        parts.append(LoadedInterface(keys, load, own, bool(interface.partial_slip)))
    return parts


def list_joints(model: Model, patch, meshed=()) -> list[Joint]:
    """Return the interfaces of a rig, or the bands of its face that slide apart, or [] without friction.

    Parameters
    ----------
    model : Model
        Rig with its interfaces.
    patch : Patch or None
        None under [normal] and between masses.
    meshed : tuple of int
        Indices of the interfaces whose patches have a coarser mesh.
    """
    speed = model.rig.slide_speed_scale
    joints = []
    for part in list_loaded_interfaces(model, patch, meshed):
        law = replace_averaged_law(part.keys, part.patch)
        for load, elements in _list_parts(model, part):
            joints.append(Joint(law, load, speed, part.load.mean, *elements))
    return joints


def has_elements(law) -> bool:
    """Return whether a patch with a law that slips part by part is a set of parallel elements, under a constant load."""
    return law_supports(law, "pieces") and law_supports(law, "shear")


def replace_averaged_law(law, patch):
    """Return Coulomb's law in place of a law that averages the pressure; other laws are unchanged.

    On a rigid block the sum of the friction limits of all nodes is a constant fraction of the load, which replaces the
    coefficient of friction.

    Parameters
    ----------
    law : Friction
        Effective keys of the friction law.
    patch : Patch or None
        Solved patch with the pressure; None for a single point.

    Returns
    -------
    Friction
        Keys of the law of the resultant.
    """
    if not law_has_trait(law.law, "averaged"):
        return law
    static = law.static * averaged_law.slip_force_ratio(law, patch)
    return law.model_copy(update={"law": "coulomb", "static": static, "kinetic": static})


def _make_point_load(point) -> Load:
    """Return the load on a point, which may oscillate."""
    return Load(point.load, point.amplitude, 2 * np.pi * (point.frequency or 0.0), point.phase)


def _list_parts(model: Model, part: LoadedInterface) -> list[tuple[Load, tuple]]:
    """Return pairs of load and elements: one of the interface, or one of each band of its face if the bands slide apart.

    The elements are those of a patch that slips node by node, as the last fields of a Joint: stiffness, yield
    displacement and JenkinsSet. They are () for a patch that slips as a whole.
    """
    if model.rig.friction.bands_slide_apart:
        return [(Load(float(load)), ()) for load in bands.compute_band_loads(part.patch)]
    if not (part.is_soft and has_elements(part.keys)):
        return [(part.load, ())]
    length = friction.record.make_law(part.keys, part.load.mean).length
    return [(part.load, jenkins_elements.make_elements(part.patch, part.keys.static, length))]


# ---- engine `hybrid`


def make_joints(model: Model, numerics: Numerics, patch) -> Joints:
    """Return laws and loads of all interfaces of a rig for the engine `hybrid`.

    Parameters
    ----------
    model : Model
        Rig with its interfaces.
    numerics : Numerics
        Names the interfaces with a coarser mesh.
    patch : Patch or None
        None without [contact].
    """
    rig = model.rig
    joints = list_joints(model, patch, numerics.meshed)
    laws = []
    for joint in joints:
        law = joint.make_hybrid_law() if model.grooves is None else _make_groove_law(model, joint)
        if joint.stiffness is not None and rig.drive.kind == "free":
            # Decay curves are measured at the extremes of the output.
            law = masing.with_all_reversals(law)
        laws.append(law)

    is_soft = any(joint.stiffness is not None for joint in joints)
    return Joints(
        tuple((law, joint.load) for law, joint in zip(laws, joints)),
        tuple(joint.list_elements() for joint in joints) if is_soft else (),
        joints[0] if is_soft and len(joints) == 1 else None,
        _find_stick_tolerance(joints, laws),
    )


def _make_groove_law(model: Model, joint: Joint) -> LawNumbers:
    """Return the law of the only interface (`joint`), whose grooves lift the load along their flanks when it slides."""
    slide = model.rig.modes.slide
    mass = model.rig.modes.mass / float(slide @ slide)
    model.grooves.check_lifted_mass(model.friction.static, mass)
    return grooves.make_grooves(joint.law, model.grooves)


def _find_spring_stiffness(law: LawNumbers) -> float:
    """Return the stiffness [N/m] of a law that is a single element in stick, or nan for other laws."""
    if law.law != "masing" or law.numbers[1] >= 0 or masing.has_many_elements(law):
        return np.nan
    limit, length = law.numbers[2:4]
    return limit / length


def _find_stick_tolerance(joints, laws) -> float:
    """Return the largest slip per cycle [m] at which the interfaces still count as stuck, or 0 for rigid laws.

    It is a small fraction of the shortest displacement over which one of the laws reaches its friction limit. `joints`
    are the Joints of the interfaces, and `laws` their LawNumbers.
    """
    lengths = []
    for joint, law in zip(joints, laws):
        keys = joint.law
        if np.isfinite(law.length):
            lengths.append(law.length)
        elif keys.bond_length and not law_has_trait(keys.law, "set-valued"):
            lengths.append(keys.bond_length)
        elif keys.stiffness:
            lengths.append(keys.static * joint.contact_load / keys.stiffness)
    return MAX_STUCK_SLIP_RATIO * min(lengths, default=0.0)


# ---- march, and motions without a drive


def _has_bond_list(model: Model, numerics: Numerics) -> bool:
    """Return whether the bonds of the only interface are summed over lists, which have no state of a few numbers."""
    if not law_has_trait(model.friction.law, "bonds") or model.rig.friction.has_partial_slip:
        return False
    is_spread = model.partial_slip or model.side == "lower"
    return is_spread or bond_lists.choose_bond_summation(model, numerics).engine != "recursion"


def make_undriven_rig(model: Model, numerics: Numerics, patch) -> UndrivenRig:
    """Return the modes of a rig with the laws of all interfaces and its nonlinear springs, without the drive.

    Parameters
    ----------
    model : Model
        Rig, springs and friction laws.
    numerics : Numerics
        Method of bond summation and coarser meshes.
    patch : Patch or None
        None under [normal] and between masses.

    Raises
    ------
    PatchfemError
        If a law has no steady loop.
    """
    rig = model.rig
    joints = list_joints(model, patch, numerics.meshed)
    is_soft = bool(model.partial_slip)
    for number, joint in enumerate(joints):
        if patch is None:
            is_soft = rig.friction.interfaces[number].partial_slip
        if is_soft and joint.stiffness is None:
            raise PatchfemError(NO_SOFT_LOOP)
        has_bonds = joint.stiffness is None and law_has_trait(joint.law.law, "bonds")
        if has_bonds and joint.law.rest_growth is not None:
            raise PatchfemError(NO_STEADY_LOOP)
    if len(joints) == 1 and _has_bond_list(model, numerics):
        raise PatchfemError(NO_STEADY_LOOP)
    laws = [(joint.make_hybrid_law(), joint.load) for joint in joints]
    return UndrivenRig(rig.modes, tuple(list_interfaces(rig, laws)), len(laws))
