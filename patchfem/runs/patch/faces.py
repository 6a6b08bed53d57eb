"""The patches of the interfaces of a rig: each is pressed once, and then is elements that its interface moves."""

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
from ..results.result import at_rest, frames_of, surface_of
from . import jenkins_elements, result, store
from .press import Patch
from .values import values


class Face(NamedTuple):
    """A patch of an interface of a rig.

    number: of the interface, from 0; name: as the scene's places, "1-0"; model: of the rig, with this patch and law as
    its own; patches: the pressed Patch and those on coarser meshes, None where one is lacking; fields: frames of the
    interface by name, as a Result has them, None before its run.
    """

    number: int
    name: str
    model: object
    patches: tuple
    fields: dict | None = None

    @property
    def patch(self) -> Patch:
        """The pressed Patch."""
        return self.patches[0]

    @property
    def surface(self):
        """The press.Surface on whose points its fields are given."""
        return surface_of(self.patch, self.fields or {})

    @property
    def folder(self) -> str:
        """Its name as that of a folder."""
        return self.name.replace(" (", "_").removesuffix(")")

    @property
    def partial_slip(self) -> str:
        """What lets it slip part by part; "" where nothing does."""
        return self.model.patch.interface.partial_slip

    def slide(self, response) -> np.ndarray:
        """Slide (k,) [m] of its interface in a Response."""
        slides = response.extra.get("slides")
        return response.slide if slides is None else slides[:, self.number]


def faces_of(model) -> Iterator[Face]:
    """The interfaces of a model that have a patch, pressed."""
    rig = model.rig
    for number, one in enumerate(rig.friction.interfaces if rig is not None else ()):
        if one.patch is not None:
            own = replace(model, patch=one.patch, friction=one.numbers)
            yield Face(
                number, rig.friction.names[number], own, patches_of(one, model.accuracy.tolerance)
            )


def patches_of(one, tolerance: float) -> tuple:
    """The Patch of an InterfaceLaw and those on coarser meshes, pressed once for all runs of one process that ask for
    the same; a patch with files, which may change, once for its model. PatchfemError with the key at fault."""
    asked = one.patch
    files = asked.mesh.file is not None or asked.gap.profile is not None
    key = ("face", asked if files else store.content_key(asked), tolerance)
    try:
        return store.reuse(key, lambda: result.solve_all(asked, tolerance))
    except PatchfemError as error:
        error.key = error.key and f"{one.key}.{error.key}"
        raise


def condensed_anew(model) -> None:
    """Condense the pieces of every interface again, whatever is kept of them."""
    store.clear()
    for one in model.rig.friction.interfaces if model.rig is not None else ():
        if one.patch is not None:
            result.solve_all(one.patch, model.accuracy.tolerance, fresh=True)


def elements_of(one, tolerance: float, coarser: bool = False) -> tuple:
    """(stiffness (t,) [N/m], yield slide (t,) [m], JenkinsSet or None of strips) of the parallel elements of an
    InterfaceLaw whose patch gives way; coarser: on the mesh of its error. One that bears nothing yields at once."""
    patch, static = patches_of(one, tolerance)[int(coarser)], one.numbers.static
    if not patch.pressure.load > 0:
        return np.array([1 / patch.giving.mean()]), np.zeros(1), None
    length = record.law_from(one.numbers, one.load).element(one.load).length
    if patch.strips is not None:
        return *map(
            np.concatenate, zip(*jenkins_elements.strip_elements(patch, static, length))
        ), None
    found = jenkins_elements.elements(patch, static, length)
    return found.stiffness, found.yield_slide, found


def meshed(model) -> list:
    """Numbers of the interfaces whose patches have a coarser mesh, in a tuple for each patch that is another one."""
    out = {}
    for face in faces_of(model):
        if face.partial_slip and face.patches[1] is not None:
            out.setdefault(face.patches, []).append(face.number)
    return [tuple(numbers) for numbers in out.values()]


def seen(model, shots) -> tuple:
    """The patches of the interfaces with their frames, of one whose elements no shot of the motion shows the pressed
    state alone; shots: of the event engine, of (slide [m], stretch (t,) [m]) for every interface."""
    out = []
    for face in faces_of(model):
        one, fields = model.rig.friction.interfaces[face.number], at_rest(face.patch)
        found = elements_of(one, model.accuracy.tolerance)[2] if face.partial_slip else None
        if found is not None and shots:
            states = [shot["faces"][face.number] for shot in shots]
            length = record.law_from(one.numbers, one.load).element(one.load).length
            tau, local = slip_fields.element_fields(face.patch, found, states, length)
            fields = frames_of(
                face.patch,
                np.array([shot["time"] for shot in shots]),
                tau,
                local,
                np.array([slide for slide, _ in states]),
            )
        out.append(face._replace(fields=fields))
    return tuple(out)


def known(model) -> bool:
    """Whether every patch that gives way has a coarser mesh to tell its error."""
    return all(face.patches[1] is not None for face in faces_of(model) if face.partial_slip)


def probed(model) -> dict:
    """Static measures by name of the patch of a model or of its interfaces, solved alone and without errors; {} without
    any."""
    if model.patch is not None:
        return result.probed(model)
    with locate_errors(model.source):
        return {
            rows.of_number(name, face.number): found
            for face in faces_of(model)
            for name, found in values(face.patch).items()
        }


def measured(model) -> dict:
    """Static measures of the patches by name, of an interface after the first with its number behind the name."""
    return {
        rows.of_number(name, face.number): found
        for face in faces_of(model)
        for name, found in result.measured(face.model, face.patch, face.patches[1:]).items()
    }


def warnings_of(model) -> list:
    """Warnings of the pressed patches."""
    return together(
        model,
        lambda face: [
            *result.strained(face.model.patch, face.patch),
            *([UNKNOWN] if face.patches[1] is None else []),
        ],
    )


UNKNOWN = "the interface has too few elements for an estimate of the error; leave out contact.element_size"


def notes_of(model) -> list:
    """Notes on what the static model of the patches leaves out."""
    return together(model, lambda face: result.left_out(face.model, face.patch, face.patches[1:]))


def together(model, told: Callable) -> list:
    """The sentences told(Face) of all patches, each once behind the names of its interfaces and with its keys as they
    stand in the scene."""
    out: dict = {}
    for face in faces_of(model):
        for text in told(face):
            out.setdefault(in_scene(model, text), []).append(face.name)
    return [
        f"interface{'s' * (len(names) > 1)} {', '.join(names)}: {text}"
        for text, names in out.items()
    ]


def in_scene(model, text: str) -> str:
    """A sentence on a patch with the keys of [contact] as they stand in the scene, below their interface where the
    model has no patch of its own."""
    return (
        text
        if model.patch is not None
        else re.sub(r"(?<![\w.])contact\.(?=[a-z])", "structure.interface.contact.", text)
    )
