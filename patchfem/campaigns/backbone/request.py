"""Request for backbones: a mode, its amplitudes or forces, methods, and the values of a key."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

from ...core import PatchfemError
from ...model.model import Model
from ...model.source import Source
from ...scene.assignments import Axis, read_assignments, read_positive_values
from ...scene.scene import SceneError
from .curves import Levels, choose_methods, compute_backbones
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

    axis: the key with its values; None without one. backbones: for each value. source: of the first one.
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
        Function of `BackboneTables` that returns the model of the scene with these tables. With `is_written` it is that of
        the scene as written; with `sets`, a tuple of assignments "table.key=value", that of the changed scene.
    request : BackboneRequest
        What is asked for.
    progress : callable, optional
        Takes the name of a method that begins.

    Raises
    ------
    PatchfemError
        If the request is invalid, or the scene has no such mode.
    SceneError
        If the scene is invalid with a value of the key.
    """
    methods = choose_methods(request.method)
    if request.amplitudes and request.forces:
        raise PatchfemError("--amplitudes and --forces: give only one of them")
    levels = Levels(
        read_positive_values(request.amplitudes, "--amplitudes") if request.amplitudes else (),
        read_positive_values(request.forces, "--forces", "force") if request.forces else (),
    )
    axis = _read_axis(request.over) if request.over else None
    changes = [()] if axis is None else [(f"{axis.key}={text}",) for text in axis.texts]

    prepared = []
    for sets in changes:

        def build_changed(tables, *, is_written: bool, sets=sets):
            """Build the scene as written, or the one with the value of the key."""
            return build(tables, is_written=is_written, sets=() if is_written else sets)

        try:
            prepared.append(prepare_model(build_changed, request.modes))
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
    models = [case.model for case in prepared]
    backbones = compute_backbones(models, request.mode, levels, methods, progress)
    backbones = [one.add_notes(case.notes) for one, case in zip(backbones, prepared)]
    return BackboneCases(axis, backbones, models[0].source)


def _read_axis(over: str) -> Axis:
    """Read the key of --over with its values; raise PatchfemError for any other text."""
    axes, mistakes = read_assignments([over])
    if mistakes:
        raise PatchfemError("; ".join(mistakes))
    return axes[0]
