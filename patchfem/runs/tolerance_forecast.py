"""Forecast whether a scene will miss its tolerance, and which keys to change.

In: a Model, before anything is computed. Out: a `Forecast`. A scene that leaves its numerical
settings to the tolerance usually meets it. A key that fixes a setting can prevent this: steps per
cycle, the element size, a method, or the neglected part of a sum over bonds. The rules below
compare such a key with the value that the tolerance requires. They apply only where nearly all
measured runs missed the tolerance (`MIN_RIG_STEP_RATIO`, `MIN_ELEMENT_ERROR_RATIO`); in other cases
the run itself warns.
"""

from dataclasses import replace
from math import ceil, exp, floor, log, log10
from typing import NamedTuple

from ..effects import law_has_trait
from ..formatting import format_length, format_number
from ..model.model import Model
from ..structure import drive_sizes
from .bench import engine as bench_engine
from .patch import grids as patch_grids
from .rig import bond_lists, costs, engines, numerics

# Smallest ratio of present to required steps per cycle at which a rig may meet the tolerance. Of 60
# random rigs and 30 benches with 50 to 6400 steps and tolerances of 0.1 to 1e-4, one in twenty met
# it below the ratios for rigs and benches.
MIN_RIG_STEP_RATIO = 2 / 3
# The same ratio for a bench, by whether its law has bonds.
MIN_BENCH_STEP_RATIOS = {True: 1 / 3, False: 1 / 8}
# Ratio of proposed to required steps per cycle of a rig, at which all measures met the tolerance,
# not only the displacement.
RIG_STEP_FACTOR = 4.0
BENCH_STEP_FACTOR = 2.0  # The same ratio for a bench: a triangle needs 1.1, a sine at most 1.
# Smallest ratio of the relative error of a patch to (element size / contact length); patches with
# equal elements had 0.2 to 7 (crowns, tilts, flat ends).
MIN_ELEMENT_ERROR_RATIO = 0.2
# Relative error on the finest mesh of a static patch, which takes some CPU seconds.
MIN_PATCH_ERROR = 1e-6
# Relative error on the finest mesh of a patch with partial slip in a rig, which is coarser because
# of the time steps.
MIN_SLIP_PATCH_ERROR = 3e-5
SAFE_TOLERANCE = 1e-3  # Tolerance that is proposed, because the meshes of all patches meet it.
STEPLESS_ENGINES = ("exact", "piecewise", "hybrid")  # Engines that choose their own steps.
MAX_CYCLES = 1e5  # Largest number of drive cycles that is proposed.


class Cause(NamedTuple):
    """Reason why a run will miss its tolerance, with the scene keys to change.

    - words: reason, as the end of a sentence.
    - cure: value to set by scene key; None to leave the key out.
    """

    words: str
    cure: dict


class Forecast(NamedTuple):
    """Tolerance of a run, and the reasons why it will be missed."""

    asked: float
    causes: tuple

    def sentence(self) -> str:
        """Return a sentence on why the tolerance will be missed and what to change; "" if it is met."""
        if not self.causes:
            return ""
        words = " and ".join(cause.words for cause in self.causes)
        return (
            f"the tolerance {self.asked:g} will not be met {words}; {_format_changes(self.cure())}"
        )

    def cure(self) -> dict:
        """Return the values to set by scene key so that the tolerance is met; None: leave it out."""
        cure = {}
        for cause in self.causes:
            cure |= cause.cure
        return cure

    def as_json(self) -> dict:
        """Return the forecast as the object under "tolerance" in the output of `plan --json`."""
        return {
            "asked": self.asked,
            "missed": bool(self.causes),
            "cure": self.cure(),
            "sentence": self.sentence(),
        }


EMPTY_FORECAST = Forecast(0.0, ())


def _format_changes(cure: dict) -> str:
    """Format the scene keys to set and those to leave out as advice."""
    dropped = [key for key, value in cure.items() if value is None]
    given = [f"{key} = {value:.15g}" for key, value in cure.items() if value is not None]
    parts = [f"leave out {' and '.join(dropped)}"] * bool(dropped) + [
        f"set {' and '.join(given)}"
    ] * bool(given)
    return " and ".join(parts)


def forecast_tolerance(model: Model) -> Forecast:
    """Forecast from the settings of a model whether its run will miss the tolerance."""
    tolerance = model.accuracy.tolerance
    if cause := _find_mesh_cause(model, tolerance):
        return Forecast(tolerance, (cause,))
    causes = [_find_element_size_cause(model, tolerance)]
    if model.kind in ("rig", "linear"):
        causes += [_find_rig_steps_cause(model), _find_bond_sum_cause(model, tolerance)]
    elif model.kind == "bench":
        causes.append(_find_bench_steps_cause(model))
    return Forecast(tolerance, tuple(cause for cause in causes if cause is not None))


def _replace_accuracy(model: Model, **keys) -> Model:
    """Return the model with some values of its [accuracy] table replaced."""
    return replace(model, accuracy=model.accuracy.model_copy(update=keys))


def _find_mesh_cause(model: Model, tolerance: float) -> Cause | None:
    """Return the Cause if no affordable mesh of the pieces meets the tolerance, else None."""
    if model.kind == "patch" and model.patch.mesh.file is None and tolerance < MIN_PATCH_ERROR / 2:
        finest = MIN_PATCH_ERROR
    elif (
        model.kind == "rig"
        and (model.partial_slip or model.rig.friction.has_partial_slip)
        and tolerance < MIN_SLIP_PATCH_ERROR
    ):
        finest = MIN_SLIP_PATCH_ERROR
    else:
        return None
    cure = {"accuracy.tolerance": SAFE_TOLERANCE}
    if (
        model.patch is not None
        and model.patch.uniform_element_size is not None
        and not model.patch.mesh.is_automatic
    ):
        cure["contact.element_size"] = None
    if model.kind == "rig":
        cure |= _suggest_steps(_replace_accuracy(model, tolerance=SAFE_TOLERANCE))
    return Cause(f"by any mesh: the finest one leaves errors of about {finest:g} or more", cure)


def _find_element_size_cause(model: Model, tolerance: float) -> Cause | None:
    """Return the Cause if elements of prescribed size are too long for the contact, else None."""
    patch = model.patch
    if patch is None or patch.mesh.is_automatic:
        return None
    if patch.mesh.file is not None or patch.mesh.shared is not None:
        return None
    if not patch.nominal_load > 0:
        return None
    size = patch.uniform_element_size
    size_ratio = size / patch_grids.make_base_grids(patch).contact.width
    if tolerance > MIN_ELEMENT_ERROR_RATIO * size_ratio:
        return None
    words = f"with contact.element_size = {format_length(size, 3)} ({format_number(size_ratio, 2)} of the length in contact)"
    return Cause(words, {"contact.element_size": None})


def _find_rig_steps_cause(model: Model) -> Cause | None:
    """Return the Cause if a rig has too few time steps for its tolerance, else None."""
    engine = engines.choose_engine(model)
    if (
        not engine.coarser_in_time(model, numerics.choose_numerics(model))
        or engine is engines.HYBRID
    ):
        return None
    steps = numerics.choose_numerics(model).steps
    required_steps = costs.required_steps_per_cycle(model)
    if steps > MIN_RIG_STEP_RATIO * required_steps:
        return None
    words = f"with the {steps} steps per cycle of this run"
    if model.accuracy.steps_per_cycle is not None:
        words = f"with accuracy.steps_per_cycle = {steps}"
    return Cause(words, _suggest_steps(model) | _suggest_cycles(model))


def _suggest_steps(model: Model) -> dict:
    """Return the scene keys that give a rig enough time steps for its tolerance.

    They select an engine that chooses its own steps if there is one, else more steps. The result is
    {} if the steps suffice.
    """
    accuracy = model.accuracy
    automatic_engine = engines.choose_engine(
        _replace_accuracy(model, method="auto", steps_per_cycle=None)
    )
    if automatic_engine.name in STEPLESS_ENGINES:
        changes = {"accuracy.steps_per_cycle": None} if accuracy.steps_per_cycle is not None else {}
        return changes | ({"accuracy.method": None} if accuracy.method != "auto" else {})
    steps = numerics.choose_numerics(model).steps
    required_steps = RIG_STEP_FACTOR * costs.required_steps_per_cycle(model)
    if steps >= required_steps:
        return {}
    return {"accuracy.steps_per_cycle": _round_steps(required_steps)}


def _round_steps(steps: float) -> int:
    """Round steps per cycle up to two significant digits and to a multiple of four.

    Half and a quarter of the steps are then integers.
    """
    unit = 10 ** (floor(log10(steps)) - 1)
    return 4 * ceil(ceil(steps / unit) * unit / 4)


def _suggest_cycles(model: Model) -> dict:
    """Return the number of drive cycles needed for the transient to decay below the tolerance.

    It is {drive.cycles: number} for the slowest mode; {} if the scene has enough cycles.
    """
    rig = model.rig
    tolerance = model.accuracy.tolerance
    if not rig.drive.waveform.is_sine or not drive_sizes.is_sinusoidal(rig.drive.signal):
        return {}
    decay = drive_sizes.find_min_decay_rate(rig.modes) * rig.drive.signal.period
    if decay <= 0 or exp(-decay * rig.drive.cycles) <= tolerance:
        return {}
    cycles = ceil(log(1 / tolerance) / decay)
    return {"drive.cycles": cycles} if cycles <= MAX_CYCLES else {}


def _find_bond_sum_cause(model: Model, tolerance: float) -> Cause | None:
    """Return the Cause if the scene truncates the sum over bonds too early, else None."""
    keys = [key for key in ("tail", "merge") if getattr(model.accuracy, key) is not None]
    fixed_keys = [f"accuracy.{key}" for key in keys]
    if (
        not fixed_keys
        or model.friction is None
        or not law_has_trait(model.friction.law, "bonds")
        or engines.choose_engine(model).name != engines.MARCH.name
    ):
        return None
    if bond_lists.choose_bond_summation(model, numerics.choose_numerics(model)).error <= tolerance:
        return None
    return Cause(f"with {' and '.join(fixed_keys)} as given", dict.fromkeys(fixed_keys))


def _find_bench_steps_cause(model: Model) -> Cause | None:
    """Return the Cause if a bench has too few time steps for its tolerance, else None."""
    if model.accuracy.steps_per_cycle is None or (
        law_has_trait(model.friction.law, "memoryless") and not model.partial_slip
    ):
        return None  # A law without memory has a closed form.
    steps = bench_engine.steps_per_cycle(model)
    required_steps = bench_engine.steps_per_cycle(_replace_accuracy(model, steps_per_cycle=None))
    if steps > MIN_BENCH_STEP_RATIOS[law_has_trait(model.friction.law, "bonds")] * required_steps:
        return None
    proposed_steps = _round_steps(BENCH_STEP_FACTOR * required_steps)
    return Cause(
        f"with accuracy.steps_per_cycle = {steps}", {"accuracy.steps_per_cycle": proposed_steps}
    )
