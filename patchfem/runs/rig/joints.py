"""Interfaces of a rig under constant loads, in the form from which each engine makes its own.

In: a Model and its Patch. Out: a `Joint` for each interface, or for each strip of a patch that slides apart.
"""

from typing import NamedTuple

import numpy as np

from ...effects import law_has_trait
from ...friction.laws.elastic_plastic import parallel_element
from ...friction.laws.stretch import points_element
from ...friction.protocol import Element
from ...friction.record import make_law
from ...model.law import InterfaceLaw, make_bond_parameters
from ...model.model import MIN_RIG_REST_SPEED, Model
from ...slip import shear_modes
from ..patch import faces, jenkins_elements
from . import strips


class Joint(NamedTuple):
    """Interface of a rig under a constant load.

    - interface: InterfaceLaw
    - load: normal load [N]
    - stiffness, yields: stiffness [N/m] and yield displacement [m] (e,) of the parallel elements of a patch that slips part
      by part; None for an interface that slips as a whole
    - reduction: JenkinsSet of such a patch, or None
    """

    interface: InterfaceLaw
    load: float
    stiffness: np.ndarray | None = None
    yields: np.ndarray | None = None
    reduction: "shear_modes.JenkinsSet | None" = None

    def make_element(self, speed: float) -> Element:
        """Return the Element of the interface; the expected slip speed [m/s] is that of bonds that grow."""
        if self.stiffness is not None:
            return parallel_element(self.stiffness, self.yields)
        law = self.interface.numbers
        if law_has_trait(law.law, "bonds"):
            return points_element(make_bond_parameters(law, speed, MIN_RIG_REST_SPEED), self.load)
        return make_law(law, self.load).element(self.load)

    def list_elements(self, speed: float) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffness [N/m] and yield displacement [m] (e,) of parallel elements; empty for other laws."""
        element = self.make_element(speed)
        count = int(element.numbers[1]) if element.form == "parallel" else 0
        return element.numbers[2 : 2 + count], element.numbers[2 + count : 2 + 2 * count]


def list_joints(model: Model, patch, meshed=()) -> list[Joint]:
    """Return the interfaces of a rig, or the strips of its patch that slide apart.

    Parameters
    ----------
    model : Model
        Rig with its interfaces.
    patch : Patch or None
        None under [normal] and between masses.
    meshed : tuple of int
        Indices of the interfaces whose patches have a coarser mesh.
    """
    friction = model.rig.friction
    if patch is not None:
        return _list_joints_of_patch(friction, model, patch)
    joints = []
    for k, own in enumerate(friction.interfaces):
        load = model.point.load if own.load is None else own.load
        parts = ()
        if own.partial_slip:
            parts = faces.make_patch_elements(own, model.accuracy.tolerance, k in meshed)
        joints.append(Joint(own, load, *parts))
    return joints


def _list_joints_of_patch(friction, model: Model, patch) -> list[Joint]:
    """Return the interface of the table [contact], or its strips."""
    own = friction.interfaces[0]
    load = patch.pressure.load
    if not model.partial_slip:
        loads = strips.compute_strip_loads(patch) if friction.strips_slide_apart else [load]
        return [Joint(own, float(load)) for load in loads]
    static = model.friction.static
    length = make_law(model.friction, load).element(load).length
    if patch.strips is None:
        found = jenkins_elements.elements(patch, static, length)
        return [Joint(own, load, found.stiffness, found.yield_displacement, found)]
    parts = jenkins_elements.strip_elements(patch, static, length)
    if friction.strips_slide_apart:
        return [Joint(own, load, *part) for part in parts]
    # Strips of a patch that does not yaw have the same displacement.
    return [Joint(own, load, *map(np.concatenate, zip(*parts)))]
