"""Random scenes with poor numerical settings, the remedies that their warnings name, and the effect of a remedy.

`draw_scene(seed)` returns a scene of any kind, law and engine with coarse settings or a tight
tolerance, so that it warns; `parse_remedies` reads the warnings of its run, and `try_remedy`
applies one.
"""

import copy
import re
from typing import NamedTuple

import numpy as np
from torture import grammar
from torture.effort import estimate_seconds
from torture.toml import to_toml
from torture.trial import Trial

from patchfem.core import NotConverged, PatchfemError
from patchfem.runs.plan import plan
from patchfem.runs.run import run
from patchfem.scene import loads
from patchfem.scene.scene import SceneError

KINDS = ("patch", "bench", "rig", "masses", "wear", "harmonic", "soft", "linear", "rig", "bench")
DEAR = 3.0  # Largest planned time of a scene that is drawn [s].
LONG = 15.0  # Largest planned time at which a remedy is tried [s].
BETTER = 0.5  # Ratio of errors below which a remedy counts as effective.
REFINED = 0.75  # The same ratio if the sentence only proposes to refine.
FACTOR = 4  # Factor on a number if a sentence names a key without a value.


class Remedy(NamedTuple):
    """Remedy named in a message.

    The whole sentence; the keys to set with their values, None for a key to leave out; in `vague`,
    keys that the sentence names without a value.
    """

    sentence: str
    sets: dict
    vague: tuple = ()


def draw_scene(seed: int) -> dict:
    """Return the tables of the first scene of a seed that is valid and planned as cheap."""
    trial = Trial(np.random.default_rng([28, seed]))
    while True:
        tables = _draw_coarse_scene(trial, KINDS[seed % len(KINDS)])
        try:
            planned = plan(loads(to_toml(tables)))
        except (PatchfemError, SceneError):
            continue
        if estimate_seconds(planned) < DEAR:
            return tables


def _draw_coarse_scene(trial: Trial, name: str) -> dict:
    """Draw a scene with fixed settings: few steps, harmonics, elements or strips, or a tight tolerance."""
    kind = {
        "wear": trial.draw("bench", "rig"),
        "harmonic": trial.draw("rig", "masses"),
        "soft": "rig",
    }.get(name, name)
    out = grammar.draw_scene(trial, kind)
    if name == "soft":
        out.pop("normal", None)
        out["contact"] = grammar.draw_patch(trial) | {"shear": {}}
    if name == "wear":
        out["wear"] = {
            "coefficient": grammar.draw_quantity(trial, 1e-16, 1e-13, "m^2/N"),
            "cycles": trial.log_uniform(10, 1e5),
        }
    settings = out["accuracy"] = {"tolerance": trial.draw(1e-2, 1e-3, 1e-4, 1e-5)}
    if kind != "patch" and name != "wear":
        settings["max_seconds"] = DEAR
    if kind != "patch" and trial.chance(0.5):
        settings["steps_per_cycle"] = int(trial.r.integers(8, 80))
    if kind in ("rig", "masses", "linear"):
        settings["method"] = trial.draw("auto", "auto", "march", "exact")
    if name == "harmonic":
        settings["method"] = "harmonic"
        settings |= {"harmonics": int(trial.r.integers(1, 12))} if trial.chance(0.6) else {}
    if "contact" in out and trial.chance(0.6):
        out["contact"].pop("element_size", None)
    if "contact" in out and trial.chance(0.2):
        out["contact"]["strips"] = {
            "count": int(trial.r.integers(2, 5)),
            "roll": grammar.draw_quantity(trial, 1e-7, 1e-4, "rad"),
        }
    return out


# Pattern of a key; `reading`, `order` and `initial_bonds` of [friction] are printed without their
# table.
KEY = r"(?:(?:accuracy|contact|drive|friction|normal|slide|structure|wear)(?:\.\w+)+|reading|order|initial_bonds)"
SETS = re.compile(rf'({KEY}) (?:= |<= )("[^"]*"|[\w.+-]*\w)')
WITHOUT = re.compile(rf"leave out ({KEY})")
INSTEAD = re.compile(rf'leave out ({KEY}), or set it to ("[^"]*")')
VAGUE = re.compile(rf"(?:raise|lower|loosen|name|make|compare with) ({KEY})(?! below)")


def parse_remedies(sentence: str) -> list:
    """Return the remedies that a warning or note names; keys joined by `and` belong to one remedy."""
    tail = sentence.rpartition("; ")[2] if "; " in sentence else sentence
    out = []
    if match := INSTEAD.search(tail):
        return [
            Remedy(sentence, {match[1]: None}),
            Remedy(sentence, {match[1]: _parse_value(match[2])}),
        ]
    for part in re.split(r",? or ", tail):
        sets = {_complete_key(key): _parse_value(value) for key, value in SETS.findall(part)}
        sets |= dict.fromkeys(map(_complete_key, WITHOUT.findall(part)))
        vague = tuple(map(_complete_key, VAGUE.findall(part)))
        if sets or vague:
            out.append(Remedy(sentence, sets, vague if not sets else ()))
    return out


def _complete_key(key: str) -> str:
    """Return a key with its table; keys without one belong to [friction]."""
    return key if "." in key else f"friction.{key}"


def _parse_value(text: str):
    """Return the value of a printed number or string."""
    if text.startswith('"'):
        return text[1:-1]
    return int(text) if text.isdigit() else float(text)


def set_keys(tables: dict, sets: dict) -> dict:
    """Return the tables with these keys set, or left out if their value is None."""
    out = copy.deepcopy(tables)
    for key, value in sets.items():
        *path, last = key.split(".")
        table = out
        for name in path:
            table = table.setdefault(name, {})
        if value is None:
            table.pop(last, None)
        else:
            table[last] = value
    return out


def run_tables(tables: dict):
    """Return the Result of a scene; None if it is refused, does not converge or is too expensive."""
    try:
        planned = plan(loads(to_toml(tables)))
        return run(planned) if estimate_seconds(planned) < LONG else None
    except (NotConverged, PatchfemError, SceneError):
        return None


def try_remedy(tables: dict, found, remedy: Remedy) -> str:
    """Return the effect of a remedy: `gone`, `better`, `failed`, `refused`, or `dear` if it was too expensive to try.

    found: Result of the tables.
    """
    sets = remedy.sets or {
        key: _scale_number(tables, found, key, remedy.sentence) for key in remedy.vague
    }
    if not sets or any(value is None and key in remedy.vague for key, value in sets.items()):
        return "refused"
    changed_tables = set_keys(tables, sets)
    try:
        planned = plan(loads(to_toml(changed_tables)))
        if estimate_seconds(planned) > LONG or sets.get("accuracy.max_seconds", 0) > LONG:
            return "dear"
        new_result = run(planned)
    except (NotConverged, PatchfemError, SceneError):
        return "refused"
    return _judge_effect(found, new_result, remedy, sets)


def _scale_number(tables: dict, result, key: str, sentence: str):
    """Return a number of the scene or of the run times or over FACTOR; None if there is no number."""
    table, _, last = key.rpartition(".")
    number = tables.get(table, {}).get(last, getattr(result.settings, last, None))
    if not isinstance(number, int | float):
        return None
    return number * FACTOR if "raise" in sentence else number / FACTOR


def _judge_effect(before, after, remedy: Remedy, sets: dict) -> str:
    """Return the effect of a remedy from the results before and after it."""
    sentence = remedy.sentence
    if not (names := _find_measures(before, sentence)):
        messages = [*after.warnings, *after.notes]
        old_sentence = sentence
        new_sentence = next(
            (
                measure
                for measure in messages
                if _strip_numbers(measure) == _strip_numbers(sentence)
            ),
            None,
        )
        if new_sentence is None:
            return "gone"
        pattern = re.compile(r"^work_check is (\S+) ")
        pair = [pattern.search(measure) for measure in (new_sentence, old_sentence)]
        return (
            "better" if all(pair) and float(pair[0][1]) <= BETTER * float(pair[1][1]) else "failed"
        )
    tolerance = before.plan.model.accuracy.tolerance
    if "would meet" in sentence and "accuracy.tolerance" in sets:
        remaining = [
            measure
            for measure in after.warnings
            if set(_find_measures(after, measure)) & set(names)
        ]
        return "failed" if remaining else "gone"
    worst_name = max(names, key=lambda name: _relative_error(before.measures[name], tolerance))
    measure = after.measures.get(worst_name)
    if measure is None or measure.value is None or measure.error is None:
        return "failed" if measure is None or measure.value is not None else "gone"
    if _relative_error(measure, tolerance) <= 1:
        return "gone"
    pattern = REFINED if "to refine" in sentence else BETTER
    return "better" if measure.error <= pattern * before.measures[worst_name].error else "failed"


def _find_measures(result, sentence: str) -> list:
    """Return the measures that a sentence about errors names, in its order; [] for another sentence."""
    if "; the tolerance is " not in sentence:
        return []
    list_of_errors = sentence.partition("; the tolerance is ")[0]
    words = re.findall(r"(?:^|, )(\w+) (?:has an estimated error )?of ", list_of_errors)
    return [word for word in words if word in result.measures]


def _relative_error(measure, tolerance: float) -> float:
    """Return the error relative to the permitted error."""
    return measure.error / max(tolerance * abs(measure.value) + measure.floor, 1e-300)


def _strip_numbers(sentence: str) -> str:
    """Return a sentence without its numbers."""
    return re.sub(r"[-+]?\d[\d.e+-]*", "#", sentence.partition("; ")[0])
