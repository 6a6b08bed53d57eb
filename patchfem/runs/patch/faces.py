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
from ..results.result import SlipRule, collect_rest_frame, make_interface_frames, patch_surface
from . import jenkins_elements, result, store
from .press import Patch
from .values import values


class Face(NamedTuple):
    """Solved patch of one interface of a rig, on several meshes.

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
        """Patch of the interface, solved on the finest mesh."""
        return self.patches[0]

    @property
    def surface(self):
        """Points at which the fields of the interface are given (`press.Surface`)."""
        return patch_surface(self.patch, self.fields or {})

    @property
    def folder(self) -> str:
        """Name of the subfolder of the interface in the output of a run."""
        return self.name.replace(" (", "_").removesuffix(")")

    @property
    def partial_slip(self) -> str:
        """Scene key that enables partial slip of the patch; "" if the patch moves as one point."""
        return self.model.patch.interface.partial_slip

    def slide(self, response) -> np.ndarray:
        """Return the relative displacement (k,) [m] of the interface in a Response."""
        slides = response.extra.get("slides")
        return response.slide if slides is None else slides[:, self.number]


def press_faces(model) -> Iterator[Face]:
    """Yield every interface of a model that has a patch, with its contact solved."""
    rig = model.rig
    for number, interface in enumerate(rig.friction.interfaces if rig is not None else ()):
        if interface.patch is not None:
            interface_model = replace(model, patch=interface.patch, friction=interface.numbers)
            yield Face(
                number,
                rig.friction.names[number],
                interface_model,
                press_on_meshes(interface, model.accuracy.tolerance),
            )


def press_on_meshes(interface, tolerance: float) -> tuple:
    """Solve the contact of an interface on its mesh and on coarser meshes.

    The solution is computed once for all runs of a process with the same patch. A patch with files,
    which may change, is solved once per model.

    Raises
    ------
    PatchfemError
        With the key of the interface at fault.
    """
    patch_model = interface.patch
    files = patch_model.mesh.file is not None or patch_model.gap.profile is not None
    key = ("face", patch_model if files else store.content_key(patch_model), tolerance)
    try:
        return store.get_or_compute(key, lambda: result.solve_with_coarser(patch_model, tolerance))
    except PatchfemError as error:
        error.key = error.key and f"{interface.key}.{error.key}"
        raise


def condense_again(model) -> None:
    """Condense the pieces of every interface again, without the cached stiffness."""
    store.clear_cache()
    for interface in model.rig.friction.interfaces if model.rig is not None else ():
        if interface.patch is not None:
            result.solve_with_coarser(interface.patch, model.accuracy.tolerance, fresh=True)


def make_elements(interface, tolerance: float, coarser: bool = False) -> tuple:
    """Return the parallel Jenkins elements of an interface whose patch slips partially.

    A patch without load has a single element that yields at once.

    Parameters
    ----------
    interface : InterfaceLaw
    tolerance : float
    coarser : bool
        Whether to use the coarser mesh of the error estimate.

    Returns
    -------
    tuple
        Stiffness (t,) [N/m], yield displacement (t,) [m], and the JenkinsSet (None for strips).
    """
    patch = press_on_meshes(interface, tolerance)[int(coarser)]
    static = interface.numbers.static
    if not patch.pressure.load > 0:
        return np.array([1 / patch.giving.mean()]), np.zeros(1), None
    length = record.make_law(interface.numbers, interface.load).element(interface.load).length
    if patch.strips is not None:
        return *map(
            np.concatenate, zip(*jenkins_elements.strip_elements(patch, static, length))
        ), None
    jenkins_set = jenkins_elements.elements(patch, static, length)
    return jenkins_set.stiffness, jenkins_set.yield_displacement, jenkins_set


def interfaces_with_coarse_mesh(model) -> list:
    """Return the indices of interfaces with a coarser mesh, grouped by distinct patch."""
    out = {}
    for face in press_faces(model):
        if face.partial_slip and face.patches[1] is not None:
            out.setdefault(face.patches, []).append(face.number)
    return [tuple(numbers) for numbers in out.values()]


def faces_with_frames(model, snapshots) -> tuple:
    """Return the patches of all interfaces with snapshots of their slip and shear stress.

    The frames of a patch without elements, or without shots, show the pressed state only.

    Parameters
    ----------
    model : Model
    snapshots : list
        Snapshots of the event engine: time [s], and (slide [m], stretch (t,) [m]) of every
        interface.
    """
    out = []
    for face in press_faces(model):
        interface = model.rig.friction.interfaces[face.number]
        fields = collect_rest_frame(face.patch)
        jenkins_set = (
            make_elements(interface, model.accuracy.tolerance)[2] if face.partial_slip else None
        )
        if jenkins_set is not None and snapshots:
            states = [shot["faces"][face.number] for shot in snapshots]
            length = (
                record.make_law(interface.numbers, interface.load).element(interface.load).length
            )
            tau, local = slip_fields.element_fields(face.patch, jenkins_set, states, length)
            fields = make_interface_frames(
                face.patch,
                np.array([shot["time"] for shot in snapshots]),
                tau,
                local,
                np.array([slide for slide, _ in states]),
                SlipRule(interface.numbers.static * face.patch.pressure.sigma_n),
            )
        out.append(face._replace(fields=fields))
    return tuple(out)


def has_error_meshes(model) -> bool:
    """Return whether every patch with partial slip has a coarser mesh for its error estimate."""
    return all(face.patches[1] is not None for face in press_faces(model) if face.partial_slip)


def static_measures_without_errors(model) -> dict:
    """Return the static measures of all patches of a model as a dict, without errors."""
    if model.patch is not None:
        return result.static_measures_without_errors(model)
    with locate_errors(model.source):
        return {
            rows.add_interface_number(name, face.number): value
            for face in press_faces(model)
            for name, value in values(face.patch).items()
        }


def static_measures(model) -> dict:
    """Return the static measures of all patches of a model as a dict, with error estimates.

    From the second interface on, the number of the interface follows the name.
    """
    return {
        rows.add_interface_number(name, face.number): measure
        for face in press_faces(model)
        for name, measure in result.static_measures(
            face.model, face.patch, face.patches[1:]
        ).items()
    }


def collect_warnings(model) -> list:
    """Return the warnings on strains and missing error estimates of the patches of a model."""
    return merge_sentences(
        model,
        lambda face: [
            *result.warn_of_strains(face.model.patch, face.patch),
            *([NO_ERROR_ESTIMATE] if face.patches[1] is None else []),
        ],
    )


NO_ERROR_ESTIMATE = "the interface has too few elements for an estimate of the error; leave out contact.element_size"


def collect_notes(model) -> list:
    """Return notes on the effects that the static model of the patches neglects."""
    return merge_sentences(
        model,
        lambda face: result.notes_on_neglected_effects(face.model, face.patch, face.patches[1:]),
    )


def merge_sentences(model, list_sentences: Callable) -> list:
    """Join equal sentences on several patches, each with the names of its interfaces.

    Keys are written as they occur in the scene.

    Parameters
    ----------
    model : Model
    list_sentences : callable
        Function of a Face that returns its sentences.
    """
    out: dict = {}
    for face in press_faces(model):
        for text in list_sentences(face):
            out.setdefault(use_scene_keys(model, text), []).append(face.name)
    return [
        f"interface{'s' * (len(names) > 1)} {', '.join(names)}: {text}"
        for text, names in out.items()
    ]


def use_scene_keys(model, text: str) -> str:
    """Replace the [contact] keys in a sentence by the keys of the interface in the scene.

    If the model has no patch of its own, these keys belong to [structure.interface.contact].
    """
    if model.patch is not None:
        return text
    return re.sub(r"(?<![\w.])contact\.(?=[a-z])", "structure.interface.contact.", text)
