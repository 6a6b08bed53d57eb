"""Patches of the interfaces of a rig.

In: a model whose interfaces have patches. Out: `PressedFace`s with solved patches on two or more meshes.
"""

from collections.abc import Iterator
from dataclasses import replace

from ...core import PatchfemError
from ..results.interfaces import PressedFace
from . import case_meshes
from .press import Patches


def solve_interface_patches(model) -> Iterator[PressedFace]:
    """Solve the static contact of each interface of a rig that has a patch of its own.

    Yields a PressedFace for each of them, with its number and name, its Model, and the patch on its meshes.
    """
    rig = model.rig
    for number, interface in enumerate(rig.friction.interfaces if rig is not None else ()):
        if interface.patch is not None:
            interface_model = replace(model, patch=interface.patch, friction=interface.numbers)
            yield PressedFace(
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
        return case_meshes.solve_with_coarser(interface.patch, tolerance)
    except PatchfemError as error:
        error.key = error.key and f"{interface.key}.{error.key}"
        raise


def group_interfaces_with_coarse_mesh(model) -> list[tuple[int, ...]]:
    """Group the indices of the interfaces that need a comparison run on a coarser mesh.

    A group has all interfaces with equal patches, which share one solution. Left out are interfaces whose motion follows
    from their load alone, and those without a coarser mesh.
    """
    groups = {}
    for face in solve_interface_patches(model):
        if face.depends_on_pressure and face.patches[1] is not None:
            groups.setdefault(face.patches, []).append(face.number)
    return [tuple(numbers) for numbers in groups.values()]


def has_error_meshes(model) -> bool:
    """Return whether all patches with partial slip have a coarser mesh for the error estimate."""
    slipping_faces = (face for face in solve_interface_patches(model) if face.partial_slip)
    return all(face.patches[1] is not None for face in slipping_faces)
