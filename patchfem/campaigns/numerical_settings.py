"""Numerical settings that can be varied in a model, and their values from coarse to fine."""

from dataclasses import replace
from typing import NamedTuple

from ..effects import law_has_trait
from ..model.model import Model
from ..runs.bench import engine
from ..runs.plan import plan
from ..runs.rig import numerics
from ..scene.rules.accuracy import has_effect

NUMERICAL_SETTINGS = ("element_size", "steps_per_cycle", "shear_modes", "jumps")
N_VALUES = 5  # Number of values of a setting; each is twice as fine as the previous one.
# Tolerances that choose the meshes of an automatic mesh study.
TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
# Tolerances of a complete scene; smaller ones take long, and few scenes meet them.
SCENE_TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4)
MAX_CELLS = 1600  # Number of columns of the finest uniform mesh.
MAX_STEPS = 12800
# Middle value of a setting if the scene does not set its key.
DEFAULT_SETTING_VALUES = {"shear_modes": 8, "jumps": 8}


class Setting(NamedTuple):
    """Value of a numerical setting together with its model.

    Attributes
    ----------
    label : str
        Label for tables.
    value : float or None
        Value in SI; None if the tolerance of the scene chooses it.
    words : str
        The setting as part of a sentence.
    model : Model
    level : int
        Number of times that the edges of a mesh file are halved.
    """

    label: str
    value: float | None
    words: str
    model: Model
    level: int = 0


def applicable_settings(model: Model) -> list:
    """Return the NUMERICAL_SETTINGS that have an effect on a model.

    They are among the element size, time steps, shear modes, and the jumps over cycles of wear.
    """
    settings = ["element_size"] if model.patch is not None else []
    # The sum over the bonds takes the same steps as a bench.
    engine_name = "bench" if model.kind == "bench" else plan(model).engine
    if has_effect("steps_per_cycle", model.kind, engine_name):
        settings.append("steps_per_cycle")
    has_shear_modes = model.partial_slip and law_has_trait(model.friction.law, "bonds")
    if has_shear_modes and has_effect("shear_modes", model.kind, engine_name):
        settings.append("shear_modes")
    if model.wear is not None and model.patch is not None:
        settings.append("jumps")
    return settings


def list_settings(model: Model, knob: str) -> list:
    """Return the values of a numerical setting from coarse to fine, with that of the scene.

    A value that the tolerance chooses comes last if the others are numbers.
    """
    if knob != "element_size":
        return _list_integer_values(model, knob)
    if model.patch.mesh.file is not None:
        return _split_meshes(model)
    if model.patch.mesh.is_automatic:
        return _list_tolerance_meshes(model)
    return _list_uniform_meshes(model)


def _split_meshes(model: Model) -> list:
    """Return the mesh of a file and meshes with its edges halved, as settings."""
    settings = []
    for level in range(3):
        words = "contact.mesh as it is"
        if level:
            words = f"contact.mesh with every element edge halved {level} times"
        settings.append(Setting(f"file, edges / {2**level}", float(2**-level), words, model, level))
    return settings


def with_tolerance(model: Model) -> list:
    """Return settings for several values of accuracy.tolerance, from large to small.

    The tolerance of the scene is one of them.
    """
    models = {value: with_setting(model, "tolerance", value) for value in SCENE_TOLERANCES}
    models[model.accuracy.tolerance] = model
    settings = []
    for value in sorted(models, reverse=True):
        settings.append(Setting(f"{value:g}", value, f"tolerance {value:g}", models[value]))
    return settings


def with_setting(model: Model, key: str, value: float) -> Model:
    """Return a model with another value of a key of [accuracy].

    Parameters
    ----------
    model : Model
    key : str
        Key of the table, such as "tolerance".
    value : float

    Returns
    -------
    Model
    """
    return replace(model, accuracy=model.accuracy.model_copy(update={key: value}))


def _list_tolerance_meshes(model: Model) -> list:
    """Return settings with the meshes that are chosen for several tolerances."""
    scene_tolerance = model.accuracy.tolerance
    settings = []
    for value in sorted({*TOLERANCES, scene_tolerance}, reverse=True):
        words = "element size set by the tolerance"
        if value != scene_tolerance:
            words += f" {value:g}"
        meshed = replace(model, patch=model.patch.with_mesh(tolerance=value))
        settings.append(Setting(f"tolerance {value:g}", value, words, meshed))
    return settings


def _list_uniform_meshes(model: Model) -> list:
    """Return settings for uniform meshes, and for the automatic mesh of a static patch."""
    length = model.patch.pieces.length
    settings = []
    middle = round(length / model.patch.uniform_element_size)
    for power in range(-3, N_VALUES - 3):
        cells = round(middle * 2.0**power)
        if 8 <= cells <= MAX_CELLS or not power:
            label = f"{1e6 * length / cells:.4g} um"
            size = length / cells
            meshed = replace(model, patch=model.patch.with_element_size(size)) if power else model
            settings.append(Setting(label, size, f"element size {label}", meshed))
    if model.kind == "patch":
        chosen = replace(model, patch=model.patch.with_element_size(None))
        settings.append(Setting("by tolerance", None, "element size set by the tolerance", chosen))
    return settings


def _list_integer_values(model: Model, knob: str) -> list:
    """Return settings for integer values around the value of the scene.

    A small value of the scene has fewer coarser values, because a quarter and a half of 1 are no
    numbers of shear modes.
    """
    pinned = _scene_value(model, knob)
    has_steps = knob == "steps_per_cycle"
    middle = _middle_value(model, knob)
    unit = knob.replace("_", " ")
    models = {}
    for power in range(-2, N_VALUES - 2):
        value = max(1, round(middle * 2.0**power))
        is_scene_value = not power and (pinned or has_steps)
        if is_scene_value:
            models[value] = model
        elif not has_steps or 4 <= value <= MAX_STEPS:
            models[value] = _with_integer(model, knob, value)
    settings = []
    for value, changed in models.items():
        settings.append(Setting(str(value), float(value), f"{value} {unit}", changed))
    if not pinned and not has_steps:
        settings.append(Setting("by tolerance", None, f"{unit} set by the tolerance", model))
    return settings


def _scene_value(model: Model, knob: str) -> int | None:
    """Return the value of a numerical setting in the scene; None if it does not set one."""
    return model.wear.jumps if knob == "jumps" else getattr(model.accuracy, knob)


def _middle_value(model: Model, knob: str) -> int:
    """Return the middle of the values of a numerical setting."""
    if knob != "steps_per_cycle":
        return _scene_value(model, knob) or DEFAULT_SETTING_VALUES[knob]
    if model.kind == "bench":
        return engine.steps_per_cycle(model)
    return numerics.choose_numerics(model).steps


def _with_integer(model: Model, knob: str, value: int) -> Model:
    """Return a model with another value of an integer setting."""
    if knob == "jumps":
        return replace(model, wear=replace(model.wear, jumps=value))
    return with_setting(model, knob, value)
