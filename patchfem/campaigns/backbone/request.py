"""Request for backbones: a mode, its amplitudes or forces, methods, and the values of a key."""

import tomllib
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...formatting import format_quantity
from ...model.model import Model
from ...model.source import Source
from ...runs.joint import solve_without_joint
from ...scene.assignments import Axis, read_assignments, read_positive_values, read_values
from ...scene.scene import SceneError
from .curves import AmplitudesOrForces, choose_methods, compute_backbones
from .given_modes import prepare_model
from .records import Backbone


class BackboneRequest(NamedTuple):
    """Request for the backbone of a scene, with texts as the command line has them.

    Attributes
    ----------
    mode : str
        Name of the mode; "" for the first.
    amplitudes, forces : str
        Lists or ranges such as "1 um..1 mm:9" and "1 N..100 N:9"; "" for the default amplitudes.
    method : str
        "" for all methods.
    modes : str or iterable
        Modes in place of those of the scene, as in `scene.backbone_scene.parse_modes`.
    over : str
        Key with its values, "table.key=a,b,c"; "" for the scene as it is.
    """

    mode: str = ""
    amplitudes: str = ""
    forces: str = ""
    method: str = ""
    modes: str | Iterable = ""
    over: str = ""


class BackboneCases(NamedTuple):
    """Backbones of a scene for the values of a key, or a single one.

    - axis: the key with its values, or None for a single backbone.
    - backbones: a backbone for each value.
    - source: source of the scene without the values of the key; of the first backbone if that scene is not valid.
    """

    axis: Axis | None
    backbones: list[Backbone]
    source: Source


def compute_cases(
    build: Callable[..., Model], request: BackboneRequest, progress: Callable | None = None
) -> BackboneCases:
    """Compute the backbones that a request asks for.

    Parameters
    ----------
    build : callable
        Function of `BackboneTables` and of a tuple of assignments "table.key=value" that returns the model of the scene
        with these tables and changes. With None in place of the changes it is that of the scene as written, also without
        the changes by --set.
    request : BackboneRequest
        What is asked for.
    progress : callable, optional
        Takes the name of a method that begins.

    Returns
    -------
    BackboneCases
        Backbones, one for each value of the key `over`.

    Raises
    ------
    PatchfemError
        If the request is invalid, or the scene has no such mode.
    SceneError
        If the scene is invalid with a value of the key.
    """

    # Amplitudes or forces at which curves are wanted, and the values of another key
    methods = choose_methods(request.method)
    if request.amplitudes and request.forces:
        raise PatchfemError("--amplitudes and --forces: give only one of them")
    given = AmplitudesOrForces(
        read_positive_values(request.amplitudes, "--amplitudes") if request.amplitudes else (),
        read_positive_values(request.forces, "--forces", "force") if request.forces else (),
    )
    axis = None
    changes = [()]
    if request.over:
        axes, mistakes = read_assignments([request.over])
        if mistakes:
            raise PatchfemError("; ".join(mistakes))
        axis = axes[0]
        changes = [(f"{axis.key}={text}",) for text in axis.texts]

    # A model for each value of the other key
    prepared = []
    for sets in changes:
        try:
            prepared.append(prepare_model(build, request.modes, sets))
        except SceneError as error:
            if axis is None:
                raise
            # The program sets a value of --over as --set does, so its mistakes are reported as mistakes of --set. They
            # may name a mode by its name where --over has its number, so only the last piece of the key is compared.
            key_end = f".{axis.key.rpartition('.')[2]}: "
            mistakes = []
            for text in error.mistakes:
                prefix = "--over: " if key_end in text else "--set: "
                mistakes.append(text.replace("--set: ", prefix, 1))
            raise SceneError(mistakes) from None

    # All curves at common amplitudes
    models = [case.model for case in prepared]
    backbones = compute_backbones(models, request.mode, given, methods, progress)
    for k, case in enumerate(prepared):
        backbones[k] = backbones[k]._replace(notes=(*case.notes, *backbones[k].notes))
    base = models[0]
    if axis is not None:
        base = _build_base_model(build, request.modes) or base
    if base.has_bolted_patch:
        base = solve_without_joint(base).model
    notes = base.describe_removed_joint()
    if axis is not None:
        notes += _note_written_value(base, axis, backbones)
    backbones = [case._replace(notes=(*case.notes, *notes)) for case in backbones]
    return BackboneCases(axis, backbones, base.source)


def _build_base_model(build: Callable[..., Model], modes: str | Iterable) -> Model | None:
    """Return the model of the scene without the values of `over`, or None if the scene is not valid without them.

    A bolted joint is subtracted in the condition of the scene as written. With the first value of `over` the scene
    would state another condition of the modal test. `build` and `modes` are as in `compute_cases`.
    """
    try:
        return prepare_model(build, modes, ()).model
    except PatchfemError:
        return None


def _note_written_value(base: Model, axis: Axis, backbones: list[Backbone]) -> list[str]:
    """Return a list of notes on the value of the key at which bolted modes count as measured.

    Parameters
    ----------
    base : Model
        Model of the scene without the values of the key.
    axis : Axis
        Key with its values.
    backbones : list of Backbone
        One for each value. If all have the same frequency with a sticking joint, the key does not change this joint.
    """
    bolted = base.rig.structure.bolted
    if bolted is None or bolted.origin != "written":
        return []
    stuck = [backbone.frequencies.stuck for backbone in backbones]
    if axis.key.startswith("structure.") or None in stuck or np.allclose(stuck, stuck[0], 1e-9, 0):
        return []

    # A key with a number in it is an item of a list, which has no single place in the scene.
    value = tomllib.loads(base.source.resolved)
    for name in axis.key.split("."):
        value = value.get(name) if isinstance(value, dict) else None
    if not isinstance(value, str | float | int):
        return []
    written = read_values(axis.key, str(value))
    text, *listed = written.texts + axis.texts
    if written.unit:
        values = written.values + axis.values
        text, *listed = [format_quantity(number, written.unit, 4) for number in values]
    gap = "" if text in listed else ", which no curve has"
    return [
        f"the modes count as measured at {axis.key} = {text}, the value in the scene{gap}; set it there to that of "
        "the modal test"
    ]
