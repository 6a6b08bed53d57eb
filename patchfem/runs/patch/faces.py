"""Patches of the interfaces of a rig, each replaced by parallel elements in the motion.

In: a model whose interfaces have patches. Out: `Face`s with solved patches on two or more meshes,
their Jenkins elements for the motion, and fields.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...core import PatchfemError
from ...friction import record
from ...slip import fields as slip_fields
from ..results.interfaces import Face
from ..results.result import SlipRule, collect_rest_frame, make_interface_frames
from . import mesh_levels
from .jenkins_elements import PatchElements, make_elements
from .press import Patches


def solve_interface_patches(model) -> Iterator[Face]:
    """Solve the static contact of each interface of a rig that has a patch of its own.

    Yields a Face for each of them, with its number and name, its Model, and the patch on its meshes.
    """
    rig = model.rig
    for number, interface in enumerate(rig.friction.interfaces if rig is not None else ()):
        if interface.patch is not None:
            interface_model = replace(model, patch=interface.patch, friction=interface.numbers)
            yield Face(
                number,
                rig.friction.names[number],
                interface_model,
                solve_contact_on_meshes(interface, model.accuracy.tolerance),
            )


def solve_contact_on_meshes(interface, tolerance: float) -> Patches:
    """Solve the contact of an interface on its mesh and on coarser meshes.

    Raises
    ------
    PatchfemError
        With the scene key of the interface that is in error.
    """
    try:
        return mesh_levels.solve_with_coarser(interface.patch, tolerance)
    except PatchfemError as error:
        error.key = error.key and f"{interface.key}.{error.key}"
        raise


def make_patch_elements(interface, tolerance: float, coarser: bool = False) -> PatchElements:
    """Return the parallel Jenkins elements of an interface with partial slip.

    An unloaded patch has a single element, which yields at once.

    Parameters
    ----------
    interface : InterfaceLaw
        Friction law and patch of the interface.
    tolerance : float
        Relative error of the static measures for which the patch is solved.
    coarser : bool
        Whether to use the coarser mesh, for the error estimate.

    Returns
    -------
    PatchElements
    """
    patch = solve_contact_on_meshes(interface, tolerance)[int(coarser)]
    length = record.make_law(interface.numbers, interface.load).length
    return make_elements(patch, interface.numbers.static, length)


def group_interfaces_with_coarse_mesh(model) -> list[tuple[int, ...]]:
    """Return groups of indices of the interfaces that have a coarser mesh for the error estimate.

    Interfaces with equal patches share one solution, and are a group.
    """
    out = {}
    for face in solve_interface_patches(model):
        if face.partial_slip and face.patches[1] is not None:
            out.setdefault(face.patches, []).append(face.number)
    return [tuple(numbers) for numbers in out.values()]


def add_slip_fields(model, faces: tuple[Face, ...], snapshots) -> tuple[Face, ...]:
    """Return interfaces of a rig with frames of their slip and shear stress.

    Without elements or snapshots, an interface has only the fields of its static contact.

    Parameters
    ----------
    model : Model
        Model of the rig.
    faces : tuple of Face
        Pressed interfaces of the rig, in their order.
    snapshots : list
        States of the event-driven engine: time [s], and for each interface its slide [m] and the
        stretch (t,) [m] of its elements.
    """
    out = []
    for face in faces:
        law = model.rig.friction.interfaces[face.number]
        fields = collect_rest_frame(face.patch)

        # Only an interface whose pieces deform in shear has slip that varies along x.
        jenkins_set = None
        if face.partial_slip and snapshots:
            jenkins_set = make_patch_elements(law, model.accuracy.tolerance).jenkins_set

        # The tractions of the cells of a face are interpolated, so that they do not reach their limits exactly.
        limit = None
        if face.model.patch.area is None:
            limit = law.numbers.static * face.patch.pressure.sigma_n

        # The stretches of the elements give the shear stress and the local slip of each node.
        if jenkins_set is not None:
            states = [snapshot.faces[face.number] for snapshot in snapshots]
            length = record.make_law(law.numbers, law.load).length
            tau, local = slip_fields.compute_element_fields(face.patch, jenkins_set, states, length)
            fields = make_interface_frames(
                face.patch,
                np.array([snapshot.time for snapshot in snapshots]),
                tau,
                local,
                np.array([slide for slide, _ in states]),
                SlipRule(limit),
            )
        out.append(face._replace(fields=fields))
    return tuple(out)


def has_error_meshes(model) -> bool:
    """Return whether all patches with partial slip have a coarser mesh for the error estimate."""
    slipping_faces = (face for face in solve_interface_patches(model) if face.partial_slip)
    return all(face.patches[1] is not None for face in slipping_faces)
