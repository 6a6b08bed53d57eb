"""Numerical settings that can be varied in a model, with values from coarse to fine."""

from dataclasses import replace
from typing import NamedTuple

from ..effects import law_has_trait
from ..model.model import Model
from ..runs.bench import engine
from ..runs.plan import plan
from ..runs.rig import numerics
from ..scene.rules.accuracy import has_effect

NUMERICAL_SETTINGS = ("element_size", "steps_per_cycle", "shear_modes", "jumps")
N_VALUES = 5  # Number of values of a setting, each twice as fine as the previous one.
# Tolerances for a series of automatic meshes.
TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
# Tolerances for a series of runs; smaller ones take long and are rarely met.
SCENE_TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4)
MAX_CELLS = 1600  # Largest number of cells of a uniform mesh along the interface.
MAX_STEPS = 12800  # Largest number of time steps per cycle.
# Middle value of a setting that the scene does not set.
DEFAULT_SETTING_VALUES = {"shear_modes": 8, "jumps": 8}


class Setting(NamedTuple):
    """Value of a numerical setting, and the model with this value.

    Attributes
    ----------
    label : str
        Label for tables.
    value : float or None
        Value in SI; None if it follows from the tolerance of the scene.
    words : str
        Description of the setting for use in a sentence.
    model : Model
    """

    label: str
    value: float | None
    words: str
    model: Model


def find_applicable_settings(model: Model) -> list:
    """Return the NUMERICAL_SETTINGS that have an effect on a model.

    Possible settings are element size, time steps, shear modes and jumps over wear cycles.
    """
    has_own_mesh = model.patch is not None and model.patch.mesh.file is None
    settings = ["element_size"] if has_own_mesh else []
    # All engines of a bench, including the sum over bonds, take the same time steps.
    engine_name = "bench" if model.kind == "bench" else plan(model).engine
    if has_effect("steps_per_cycle", model.kind, engine_name):
        settings.append("steps_per_cycle")
    has_shear_modes = model.partial_slip and law_has_trait(model.friction.law, "bonds")
    if has_shear_modes and has_effect("shear_modes", model.kind, engine_name):
        settings.append("shear_modes")
    if model.wear is not None and model.patch is not None:
        settings.append("jumps")
    return settings


def make_setting_values(model: Model, setting_name: str) -> list:
    """Return the values of a numerical setting from coarse to fine, including that of the scene.

    An automatic value is the last one, unless the values are tolerances.
    """
    if setting_name != "element_size":
        return _list_integer_values(model, setting_name)
    if model.patch.mesh.is_automatic:
        return _list_tolerance_meshes(model)
    return _list_uniform_meshes(model)


def list_tolerances(model: Model) -> list:
    """Return settings for several values of accuracy.tolerance, from large to small.

    The values include the tolerance of the scene.
    """
    models = {value: _with_accuracy_key(model, "tolerance", value) for value in SCENE_TOLERANCES}
    models[model.accuracy.tolerance] = model
    settings = []
    for value in sorted(models, reverse=True):
        settings.append(Setting(f"{value:g}", value, f"tolerance {value:g}", models[value]))
    return settings


def _with_accuracy_key(model: Model, key: str, value: float) -> Model:
    """Return a model with another value of a key of the table [accuracy], such as "tolerance"."""
    return replace(model, accuracy=model.accuracy.model_copy(update={key: value}))


def _list_tolerance_meshes(model: Model) -> list:
    """Return settings with the automatic meshes for several tolerances."""
    scene_tolerance = model.accuracy.tolerance
    settings = []
    for value in sorted({*TOLERANCES, scene_tolerance}, reverse=True):
        words = "element size set by the tolerance"
        if value != scene_tolerance:
            words += f" {value:g}"
        meshed_model = replace(model, patch=model.patch.with_mesh(tolerance=value))
        settings.append(Setting(f"tolerance {value:g}", value, words, meshed_model))
    return settings


def _list_uniform_meshes(model: Model) -> list:
    """Return settings for uniform meshes, and for the automatic mesh of a static patch."""
    length = model.patch.pieces.length
    settings = []
    middle_count = round(length / model.patch.uniform_element_size)
    for power in range(-3, N_VALUES - 3):
        cells = round(middle_count * 2.0**power)
        if 8 <= cells <= MAX_CELLS or not power:
            label = f"{1e6 * length / cells:.4g} um"
            size = length / cells
            meshed_model = (
                replace(model, patch=model.patch.with_element_size(size)) if power else model
            )
            settings.append(Setting(label, size, f"element size {label}", meshed_model))
    if model.kind == "patch":
        automatic_model = replace(model, patch=model.patch.with_element_size(None))
        settings.append(
            Setting("by tolerance", None, "element size set by the tolerance", automatic_model)
        )
    return settings


def _list_integer_values(model: Model, setting_name: str) -> list[Setting]:
    """Return settings for integer values around the value of the scene.

    There are fewer coarse values if the value of the scene is small, because values less than 1 are
    excluded.
    """
    of_scene = getattr(model.wear if setting_name == "jumps" else model.accuracy, setting_name)
    is_step_count = setting_name == "steps_per_cycle"
    middle = of_scene or DEFAULT_SETTING_VALUES.get(setting_name)
    if is_step_count and model.kind == "bench":
        middle = engine.steps_per_cycle(model)
    elif is_step_count:
        middle = numerics.choose_numerics(model).steps
    unit = setting_name.replace("_", " ")
    models = {}
    for power in range(-2, N_VALUES - 2):
        value = max(1, round(middle * 2.0**power))
        if not power and (of_scene or is_step_count):
            models[value] = model
        elif setting_name == "jumps":
            models[value] = replace(model, wear=replace(model.wear, jumps=value))
        elif not is_step_count or 4 <= value <= MAX_STEPS:
            models[value] = _with_accuracy_key(model, setting_name, value)
    settings = []
    for value, changed in models.items():
        settings.append(Setting(str(value), float(value), f"{value} {unit}", changed))
    if not of_scene and not is_step_count:
        settings.append(Setting("by tolerance", None, f"{unit} set by the tolerance", model))
    return settings
