"""Numerical settings that can be varied in a model, with values from coarse to fine."""

from dataclasses import replace
from math import inf
from typing import NamedTuple

from ..effects import law_has_trait
from ..model.model import Model
from ..runs.bench import engine
from ..runs.plan import plan
from ..runs.rig import engines
from ..scene.keys.contact import MAX_AREA_CELLS, MIN_AREA_CELLS
from ..scene.rules.accuracy import has_effect

# Settings that are counts, with their limits, besides the element size.
COUNT_LIMITS = {
    "cells": (MIN_AREA_CELLS, MAX_AREA_CELLS),
    "steps_per_cycle": (4, 12800),
    "shear_modes": (1, inf),
    "jumps": (1, inf),
}
# Names of all numerical settings that can be varied
NUMERICAL_SETTINGS = ("element_size", *COUNT_LIMITS)
# Keys of a scene that set what a curve varies
SCENE_KEYS = {
    "contact.element_size": "element_size",
    "contact.area.cells": "cells",
    "accuracy.steps_per_cycle": "steps_per_cycle",
    "accuracy.shear_modes": "shear_modes",
    "wear.jumps": "jumps",
}
# Factors by which a count of the scene is varied
COUNT_FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0)
# Factors by which the number of cells of a uniform mesh is varied
CELL_COUNT_FACTORS = (0.125, 0.25, 0.5, 1.0, 2.0)
DEFAULT_MIDDLE_COUNT = 8  # middle value of a count that the scene does not set
# Name of the accuracy of all settings together, which a curve may vary in place of a single one.
TOLERANCE_SETTING = "tolerance"
# Tolerances for a series of runs; smaller ones take long and are rarely met.
TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4)
# Further ones of a motion from event to event without a mesh, which has errors near 1e-6 at all of these
FINE_TOLERANCES = (1e-5, 1e-6)


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
        Model of the scene with this value.
    """

    label: str
    value: float | None
    words: str
    model: Model


def find_applicable_settings(model: Model) -> list[str]:
    """Return the NUMERICAL_SETTINGS that have an effect on a model."""
    # All engines of a bench, including the sum over bonds, take the same time steps.
    engine_name = "bench" if model.kind == "bench" else plan(model).engine
    has_patch = model.patch is not None
    has_shear_modes = model.partial_slip and law_has_trait(model.friction.law, "bonds")
    applies = {
        "element_size": has_patch and model.patch.mesh.file is None and model.patch.area is None,
        "cells": has_patch and model.patch.area is not None,
        "steps_per_cycle": has_effect("steps_per_cycle", model.kind, engine_name),
        "shear_modes": has_shear_modes and has_effect("shear_modes", model.kind, engine_name),
        "jumps": has_patch and model.wear is not None,
    }
    return [name for name in NUMERICAL_SETTINGS if applies[name]]


def choose_tolerances(model: Model) -> tuple[float, ...]:
    """Return the tolerances of a series of runs of a model; they reach further for a motion from event to event alone."""
    is_from_event_to_event = model.rig is not None and plan(model).engine == "event_driven"
    if is_from_event_to_event and not find_applicable_settings(model):
        return TOLERANCES + FINE_TOLERANCES
    return TOLERANCES


def make_setting_values(
    model: Model, name: str, tolerances: tuple[float, ...] = TOLERANCES
) -> list[Setting]:
    """Return the values of a numerical setting of a model, or of its tolerance, from coarse to fine.

    The tolerances contain that of the scene. The last value of a setting is the automatic one. There are fewer coarse
    values if the value of the scene is small.

    Parameters
    ----------
    model : Model
        Model of the scene with its own settings.
    name : str
        Name of the setting, such as "element_size", or TOLERANCE_SETTING.
    tolerances : tuple of float
        Values of the tolerance.

    Returns
    -------
    list of Setting
    """
    words = name.replace("_", " ")
    if name == TOLERANCE_SETTING:
        values = sorted({*tolerances, model.accuracy.tolerance}, reverse=True)
    elif name == "element_size":
        length = model.patch.pieces.length
        cells = round(length / model.patch.uniform_element_size)
        # Numbers of cells of a uniform mesh along the interface
        counts = _scale_count(cells, CELL_COUNT_FACTORS, (8, 1600))
        values = [length / count for count in counts]
    else:
        values = _scale_count(_find_count(model, name), COUNT_FACTORS, COUNT_LIMITS[name])

    settings = []
    for value in values:
        label = format_setting(name, value)
        changed = _change_setting(model, name, value)
        settings.append(Setting(label, float(value), f"{words} {label}", changed))
    if name == TOLERANCE_SETTING:
        return settings
    automatic = _change_setting(model, name, None)
    return [*settings, Setting("by tolerance", None, f"{words} set by the tolerance", automatic)]


def format_setting(name: str, value: float) -> str:
    """Return a value [SI] of the numerical setting `name` as text."""
    return f"{1e6 * value:.4g} um" if name == "element_size" else f"{value:g}"


def _change_setting(model: Model, name: str, value: float | None) -> Model:
    """Return a model with another value of the numerical setting `name`.

    None lets the tolerance set it.
    """
    if name == "element_size":
        return replace(model, patch=model.patch.with_element_size(value))
    if name == "cells":
        return replace(
            model, patch=replace(model.patch, area=model.patch.area._replace(cells=value))
        )
    if name == "jumps":
        return replace(model, wear=replace(model.wear, jumps=value))
    accuracy = model.accuracy.model_copy(update={name: value})
    if value is None:
        accuracy.model_fields_set.discard(name)  # a run may choose this setting
    return replace(model, accuracy=accuracy)


def _find_count(model: Model, name: str) -> int:
    """Return the number of steps, modes or jumps that a run of the model takes by default.

    `name` is that of the setting. It is DEFAULT_MIDDLE_COUNT if only the run itself finds the number.
    """
    if name == "steps_per_cycle":
        if model.kind == "bench":
            return engine.steps_per_cycle(model)
        return engines.choose_numerics(model).steps
    if name == "cells":
        # Middle number of cells along the longer side of a face
        return model.patch.area.cells or 128
    return getattr(model.wear if name == "jumps" else model.accuracy, name) or DEFAULT_MIDDLE_COUNT


def _scale_count(middle: int, factors: tuple[float, ...], limits: tuple[float, float]) -> list[int]:
    """Return a count, `middle`, and its products with factors, without those outside of limits, in rising order."""
    low, high = limits
    scaled = (max(1, round(middle * factor)) for factor in factors)
    return sorted({middle, *(count for count in scaled if low <= count <= high)})
