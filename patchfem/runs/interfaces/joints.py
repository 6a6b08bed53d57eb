"""Interfaces of a rig or a bench with their laws, loads and patches, from which each engine makes its own form.

In: a Model and its Patch. Out: `SlidingPart`s. A patch that slips part by part under a constant load is its exact set of
Jenkins elements.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ... import friction
from ...effects import law_has_trait, law_supports
from ...model.model import Model
from ..patch import faces, jenkins_elements
from ..results.interfaces import depends_on_pressure
from . import bands


class SlidingPart(NamedTuple):
    """Interface of a rig or a bench, or a band of its face that slides apart, under its load.

    - model: Model, with the expected speed of the slide.
    - keys: effective keys of the friction law.
    - load: mean normal load [N]; that of a point may oscillate (`model.load_varies`).
    - total: mean load [N] on the whole contact, of which a band is a part; stiffness and damping in the keys refer to it.
    - row (n,): slide per modal coordinate.
    - patch: solved Patch, if the motion depends on its pressure; None for a point.
    - is_soft: whether the patch slips part by part.
    - band: number of the band, or None for the whole interface.
    """

    model: Model
    keys: object
    load: float
    total: float
    row: np.ndarray
    patch: object = None
    is_soft: bool = False
    band: int | None = None

    @property
    def elements(self) -> jenkins_elements.PatchElements | None:
        """Parallel elements of a patch that slips part by part; None where it has none, or slips as a whole."""
        if self.band is not None or not (self.is_soft and has_elements(self.keys)):
            return None
        length = friction.record.make_law(self.keys, self.total).length
        return jenkins_elements.make_elements(self.patch, self.keys.static, length)

    @property
    def node_loads(self) -> np.ndarray:
        """Mean loads (m,) [N] of the nodes of the patch, or that of the point or the band (1,)."""
        if self.patch is None or self.band is not None:
            return np.array([self.load])
        return self.patch.pressure.sigma_n * self.patch.pieces.interface.weight

    def make_law(self, keys=None):
        """Return the friction law of an interface that slips as a whole, as the record from which engines take its numbers.

        Its forces are per newton of load. For the nonlocal law it is the record of the bonds. `keys` replace those of the
        interface.
        """
        keys = keys or self.keys
        if law_has_trait(keys.law, "bonds"):
            return self.model.make_bonds(keys)
        return friction.record.make_law(keys, self.total)

    def list_elements(self) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffness [N/m] and yield displacement [m], both (e,), of the parallel spring-slider elements.

        Both are empty for a law that is not made of such elements.
        """
        elements = self.elements
        if elements is not None:
            return elements.stiffness, elements.yield_displacement
        find = getattr(self.make_law(), "elements", None)
        return find(self.load) if find else (np.zeros(0), np.zeros(0))

    def split_by_bands(self) -> list[SlidingPart]:
        """Return the bands of a face that slide apart, or the joint itself."""
        if not (self.model.rig and self.model.rig.friction.bands_slide_apart):
            return [self]
        rows = self.model.rig.modes.interfaces
        loads = bands.compute_band_loads(self.patch).tolist()
        parts = []
        for number, load in enumerate(loads):
            parts.append(self._replace(load=load, row=rows[number], band=number))
        return parts


def list_joints(model: Model, patch, meshed=()) -> list[SlidingPart]:
    """Return the interfaces of a rig or a bench with their laws and loads, or [] without friction.

    Parameters
    ----------
    model : Model
        Rig or bench with its interfaces.
    patch : Patch or None
        Patch of [contact]; None under [normal] and between masses.
    meshed : tuple of int
        Indices of the interfaces whose patches have a coarser mesh.
    """
    interfaces = () if model.rig is None else model.rig.friction.interfaces
    rows = [np.zeros(0)] if model.rig is None else model.rig.modes.interfaces
    if model.friction is not None and (patch is not None or model.rig is None):
        load = model.point.load if patch is None else float(patch.pressure.load)
        return [
            SlidingPart(model, model.friction, load, load, rows[0], patch, bool(model.partial_slip))
        ]
    joints = []
    for k, interface in enumerate(interfaces):
        load = model.point.load if interface.load is None else interface.load
        own = None
        # Between masses only a patch whose shape matters to the motion is pressed; any other is a point.
        if interface.patch is not None and depends_on_pressure(interface.numbers, interface.patch):
            solved = faces.solve_contact_on_meshes(interface, model.accuracy.tolerance)
            own = solved[int(k in meshed)]
        is_soft = bool(interface.partial_slip)
        joints.append(SlidingPart(model, interface.numbers, load, load, rows[k], own, is_soft))
    return joints


def list_parts(model: Model, patch, meshed=()) -> list[SlidingPart]:
    """Return the interfaces of a model, or the bands of its face that slide apart.

    Parameters
    ----------
    model : Model
        Rig or bench with its interfaces.
    patch : Patch or None
        Patch of [contact]; None under [normal] and between masses.
    meshed : tuple of int
        Indices of the interfaces whose patches have a coarser mesh.
    """
    parts = []
    for joint in list_joints(model, patch, meshed):
        parts += joint.split_by_bands()
    return parts


def has_elements(law) -> bool:
    """Return whether a patch with a law that slips part by part is a set of parallel elements, under a constant load."""
    return law_supports(law, "pieces") and law_supports(law, "shear")


def find_climbed_grooves(model: Model):
    """Return the grooves that the upper piece climbs.

    Raises
    ------
    PatchfemError
        If the mass that they lift in a rig makes the acceleration undefined.
    """
    if model.rig is None:
        # A prescribed slide has no inertia.
        return replace(model.grooves, lifted_mass=0.0)
    # The lifted mass is compared to the modal mass at the interface, m / (s . s).
    modes = model.rig.modes
    mass = modes.mass / float(modes.slide @ modes.slide)
    model.grooves.check_lifted_mass(model.friction.static, mass)
    return model.grooves
