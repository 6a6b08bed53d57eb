"""Patches of the interfaces of a rig: pressed once, then represented by parallel elements.

In: a model whose interfaces have patches. Out: `Face`s with pressed patches on two or more
meshes, their Jenkins elements for the motion, static measures, warnings and fields.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...friction import record
from ...model.source import locate_errors
from ...response import rows
from ...slip import fields as slip_fields
from ..results.result import at_rest, interface_frames, patch_surface
from . import jenkins_elements, result, store
from .press import Patch
from .values import values


class Face(NamedTuple):
    """Patch of an interface of a rig.

    - number: index of the interface.
    - name: nodes of the interface as the scene writes them, "1-0".
    - model: model of the rig, with this patch and friction law as its own.
    - patches: the pressed Patch and those on coarser meshes; None for a missing one.
    - fields: frames of the interface by name (see `Result`); None before its run.
    """

    number: int
    name: str
    model: object
    patches: tuple
    fields: dict | None = None

    @property
    def patch(self) -> Patch:
        """Pressed Patch on the finest mesh."""
        return self.patches[0]

    @property
    def surface(self):
        """`press.Surface` on whose points the fields are given."""
        return patch_surface(self.patch, self.fields or {})

    @property
    def folder(self) -> str:
        """Name of the interface as the name of a folder."""
        return self.name.replace(" (", "_").removesuffix(")")

    @property
    def partial_slip(self) -> str:
        """Key that lets the patch slip in part; "" if there is none."""
        return self.model.patch.interface.partial_slip

    def slide(self, response) -> np.ndarray:
        """Return the slide (k,) [m] of the interface in a Response."""
        slides = response.extra.get("slides")
        return response.slide if slides is None else slides[:, self.number]


def press_faces(model) -> Iterator[Face]:
    """Yield a Face for each interface of a model that has a patch, pressed."""
    rig = model.rig
    for number, one in enumerate(rig.friction.interfaces if rig is not None else ()):
        if one.patch is not None:
            own = replace(model, patch=one.patch, friction=one.numbers)
            yield Face(
                number,
                rig.friction.names[number],
                own,
                press_on_meshes(one, model.accuracy.tolerance),
            )


def press_on_meshes(one, tolerance: float) -> tuple:
    """Return the Patch of an InterfaceLaw and those on coarser meshes.

    They are computed once for all runs of a process with the same patch; a patch with files, which
    may change, once for its model.

    Raises
    ------
    PatchfemError
        With the key of the interface at fault.
    """
    patch_model = one.patch
    files = patch_model.mesh.file is not None or patch_model.gap.profile is not None
    key = ("face", patch_model if files else store.content_key(patch_model), tolerance)
    try:
        return store.reuse(key, lambda: result.solve_all(patch_model, tolerance))
    except PatchfemError as error:
        error.key = error.key and f"{one.key}.{error.key}"
        raise


def condense_again(model) -> None:
    """Condense the pieces of every interface again, ignoring all kept results."""
    store.clear()
    for one in model.rig.friction.interfaces if model.rig is not None else ():
        if one.patch is not None:
            result.solve_all(one.patch, model.accuracy.tolerance, fresh=True)


def make_elements(one, tolerance: float, coarser: bool = False) -> tuple:
    """Return the parallel elements of an InterfaceLaw whose patch slips in part.

    A patch without load has one element that yields at once.

    Parameters
    ----------
    one : InterfaceLaw
    tolerance : float
    coarser : bool
        Whether to use the coarser mesh of the error estimate.

    Returns
    -------
    tuple
        Stiffness (t,) [N/m], yield slide (t,) [m], and the JenkinsSet (None for strips).
    """
    patch = press_on_meshes(one, tolerance)[int(coarser)]
    static = one.numbers.static
    if not patch.pressure.load > 0:
        return np.array([1 / patch.giving.mean()]), np.zeros(1), None
    length = record.make_law(one.numbers, one.load).element(one.load).length
    if patch.strips is not None:
        return *map(
            np.concatenate, zip(*jenkins_elements.strip_elements(patch, static, length))
        ), None
    found = jenkins_elements.elements(patch, static, length)
    return found.stiffness, found.yield_displacement, found


def interfaces_with_coarse_mesh(model) -> list:
    """Return the indices of interfaces that have a coarser mesh, one tuple per distinct patch."""
    out = {}
    for face in press_faces(model):
        if face.partial_slip and face.patches[1] is not None:
            out.setdefault(face.patches, []).append(face.number)
    return [tuple(numbers) for numbers in out.values()]


def faces_with_frames(model, shots) -> tuple:
    """Return the Faces of a model with their frames.

    The frames of a patch without elements, or without shots, show the pressed state only.

    Parameters
    ----------
    model : Model
    shots : list
        Snapshots of the event engine: time [s], and (slide [m], stretch (t,) [m]) of every
        interface.
    """
    out = []
    for face in press_faces(model):
        one = model.rig.friction.interfaces[face.number]
        fields = at_rest(face.patch)
        found = make_elements(one, model.accuracy.tolerance)[2] if face.partial_slip else None
        if found is not None and shots:
            states = [shot["faces"][face.number] for shot in shots]
            length = record.make_law(one.numbers, one.load).element(one.load).length
            tau, local = slip_fields.element_fields(face.patch, found, states, length)
            fields = interface_frames(
                face.patch,
                np.array([shot["time"] for shot in shots]),
                tau,
                local,
                np.array([slide for slide, _ in states]),
            )
        out.append(face._replace(fields=fields))
    return tuple(out)


def has_error_meshes(model) -> bool:
    """Return whether every patch that slips in part has a coarser mesh for its error."""
    return all(face.patches[1] is not None for face in press_faces(model) if face.partial_slip)


def static_measures_without_errors(model) -> dict:
    """Return static measures by name of all patches of a model, without errors."""
    if model.patch is not None:
        return result.static_measures_without_errors(model)
    with locate_errors(model.source):
        return {
            rows.add_interface_number(name, face.number): found
            for face in press_faces(model)
            for name, found in values(face.patch).items()
        }


def static_measures(model) -> dict:
    """Return the static measures of the patches by name.

    Those of an interface after the first have its number after the name.
    """
    return {
        rows.add_interface_number(name, face.number): found
        for face in press_faces(model)
        for name, found in result.static_measures(face.model, face.patch, face.patches[1:]).items()
    }


def collect_warnings(model) -> list:
    """Return the warnings on the pressed patches."""
    return merge_sentences(
        model,
        lambda face: [
            *result.warn_of_strains(face.model.patch, face.patch),
            *([UNKNOWN] if face.patches[1] is None else []),
        ],
    )


UNKNOWN = "the interface has too few elements for an estimate of the error; leave out contact.element_size"


def collect_notes(model) -> list:
    """Return notes on what the static model of the patches neglects."""
    return merge_sentences(
        model,
        lambda face: result.notes_on_neglected_effects(face.model, face.patch, face.patches[1:]),
    )


def merge_sentences(model, told: Callable) -> list:
    """Return the sentences on all patches, each once with the names of its interfaces.

    Keys are written as they occur in the scene.

    Parameters
    ----------
    model : Model
    told : callable
        Function of a Face that returns its sentences.
    """
    out: dict = {}
    for face in press_faces(model):
        for text in told(face):
            out.setdefault(in_scene(model, text), []).append(face.name)
    return [
        f"interface{'s' * (len(names) > 1)} {', '.join(names)}: {text}"
        for text, names in out.items()
    ]


def in_scene(model, text: str) -> str:
    """Return a sentence on a patch with its keys of [contact] as they are in the scene.

    If the model has no patch of its own, these keys belong to [structure.interface.contact].
    """
    if model.patch is not None:
        return text
    return re.sub(r"(?<![\w.])contact\.(?=[a-z])", "structure.interface.contact.", text)
