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
N_VALUES = 5  # number of values of a setting; each is twice as fine as the one before
TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)  # tolerances of a mesh that is chosen automatically
# Tolerances of a whole scene; smaller ones take long, and few scenes meet them.
SCENE_TOLERANCES = (
    1e-1,
    1e-2,
    1e-3,
    1e-4,
)
MAX_CELLS = 1600  # columns of the finest uniform mesh
MAX_STEPS = 12800
DEFAULT_MIDDLES = {"shear_modes": 8, "jumps": 8}  # middle value, if the scene does not set the key


class Setting(NamedTuple):
    """One value of a numerical setting.

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
    """Return the settings, of NUMERICAL_SETTINGS, that have an effect on a model.

    They are its element size, time steps, shear modes, and the jumps over cycles of wear.
    """
    out = ["element_size"] if model.patch is not None else []
    engine = plan(model).engine
    # The sum over the bonds takes the same steps as a bench.
    engine = "bench" if model.kind == "bench" else engine
    out += [
        knob
        for knob in ("steps_per_cycle", "shear_modes")
        if has_effect(knob, model.kind, engine)
        and (
            knob != "shear_modes"
            or (model.partial_slip and law_has_trait(model.friction.law, "bonds"))
        )
    ]
    if model.wear is not None and model.patch is not None:
        out.append("jumps")
    return out


def list_settings(model: Model, knob: str) -> list:
    """Return the values of a setting from coarse to fine, including that of the scene.

    A value that the tolerance chooses comes last if the others are numbers.
    """
    if knob == "element_size":
        if model.patch.mesh.file is not None:
            return [
                Setting(
                    f"file, edges / {2**level}", float(2**-level), _split_words(level), model, level
                )
                for level in range(3)
            ]
        return _by_tolerance(model) if model.patch.mesh.is_automatic else _uniform_meshes(model)
    return _integer_values(model, knob)


def _split_words(level: int) -> str:
    """Describe a mesh file whose edges are halved `level` times."""
    return (
        f"contact.mesh with every element edge halved {level} times"
        if level
        else "contact.mesh as it is"
    )


def with_tolerance(model: Model) -> list:
    """Return settings for several values of accuracy.tolerance, from large to small.

    The tolerance of the scene is one of them.
    """
    own = model.accuracy.tolerance
    models = {one: with_setting(model, "tolerance", one) for one in SCENE_TOLERANCES} | {own: model}
    return [
        Setting(f"{one:g}", one, f"tolerance {one:g}", models[one])
        for one in sorted(models, reverse=True)
    ]


def with_setting(model: Model, key: str, value: float) -> Model:
    """Return a model with another value of a key of [accuracy]."""
    return replace(model, accuracy=model.accuracy.model_copy(update={key: value}))


def _by_tolerance(model: Model) -> list:
    """Return meshes that several tolerances choose; the label of the scene's mesh has no number."""
    own = model.accuracy.tolerance
    return [
        Setting(
            f"tolerance {one:g}",
            one,
            "element size set by the tolerance" + f" {one:g}" * (one != own),
            replace(model, patch=model.patch.with_mesh(tolerance=one)),
        )
        for one in sorted({*TOLERANCES, own}, reverse=True)
    ]


def _uniform_meshes(model: Model) -> list:
    """Return uniform meshes, and for a static patch also the mesh that its tolerance chooses."""
    length = model.patch.pieces.length
    out = []
    middle = round(length / model.patch.uniform_element_size)
    for power in range(-3, N_VALUES - 3):
        cells = round(middle * 2.0**power)
        if 8 <= cells <= MAX_CELLS or not power:
            label = f"{1e6 * length / cells:.4g} um"
            size = length / cells
            turned = replace(model, patch=model.patch.with_element_size(size)) if power else model
            out.append(Setting(label, size, f"element size {label}", turned))
    if model.kind == "patch":
        chosen = replace(model, patch=model.patch.with_element_size(None))
        out.append(Setting("by tolerance", None, "element size set by the tolerance", chosen))
    return out


def _integer_values(model: Model, knob: str) -> list:
    """Return values of a setting that is a whole number, around the value of the scene.

    A small value of the scene has fewer coarser values: a quarter and a half of 1 are no numbers of
    shear modes.
    """
    pinned = _scene_value(model, knob)
    middle = _middle_value(model, knob)
    words = "{} " + knob.replace("_", " ")
    models = {}
    for power in range(-2, N_VALUES - 2):
        value = max(1, round(middle * 2.0**power))
        own = not power and (pinned or knob == "steps_per_cycle")
        if own or knob != "steps_per_cycle" or 4 <= value <= MAX_STEPS:
            models[value] = model if own else _with_integer(model, knob, value)
    out = []
    for value, turned in models.items():
        out.append(Setting(str(value), float(value), words.format(value), turned))
    if not pinned and knob != "steps_per_cycle":
        out.append(
            Setting("by tolerance", None, words.format("").strip() + " set by the tolerance", model)
        )
    return out


def _scene_value(model: Model, knob: str) -> int | None:
    """Return the value of a setting in the scene; None if it does not set one."""
    return model.wear.jumps if knob == "jumps" else getattr(model.accuracy, knob)


def _middle_value(model: Model, knob: str) -> int:
    """Return the middle of the values of a setting."""
    if knob != "steps_per_cycle":
        return _scene_value(model, knob) or DEFAULT_MIDDLES[knob]
    if model.kind == "bench":
        return engine.steps_per_cycle(model)

    return numerics.choose(model).steps


def _with_integer(model: Model, knob: str, value: int) -> Model:
    """Return a model with another value of a setting that is a whole number."""
    if knob == "jumps":
        return replace(model, wear=replace(model.wear, jumps=value))
    return with_setting(model, knob, value)
