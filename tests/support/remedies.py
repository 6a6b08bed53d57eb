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
from torture.toml import text_of
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


def drawn(seed: int) -> dict:
    """Return the tables of the first scene of a seed that is valid and planned as cheap."""
    trial = Trial(np.random.default_rng([28, seed]), None, None, None)
    while True:
        tables = _loose(trial, KINDS[seed % len(KINDS)])
        try:
            asked = plan(loads(text_of(tables)))
        except (PatchfemError, SceneError):
            continue
        if asked.seconds < DEAR:
            return tables


def _loose(trial: Trial, word: str) -> dict:
    """Draw a scene with fixed settings: few steps, harmonics, elements or strips, or a tight tolerance."""
    kind = {
        "wear": trial.draw("bench", "rig"),
        "harmonic": trial.draw("rig", "masses"),
        "soft": "rig",
    }.get(word, word)
    out = grammar.scene(trial, kind)
    if word == "soft":
        out.pop("normal", None)
        out["contact"] = grammar.patch(trial) | {"shear": {}}
    if word == "wear":
        out["wear"] = {
            "coefficient": grammar.quantity(trial, 1e-16, 1e-13, "m^2/N"),
            "cycles": trial.wide(10, 1e5),
        }
    pins = out["accuracy"] = {"tolerance": trial.draw(1e-2, 1e-3, 1e-4, 1e-5)}
    if kind != "patch" and trial.chance(0.5):
        pins["steps_per_cycle"] = int(trial.r.integers(8, 80))
    if kind in ("rig", "masses", "linear"):
        pins["method"] = trial.draw("auto", "auto", "march", "exact")
    if word == "harmonic":
        pins["method"] = "harmonic"
        pins |= {"harmonics": int(trial.r.integers(1, 12))} if trial.chance(0.6) else {}
    if "contact" in out and trial.chance(0.6):
        out["contact"].pop("element_size", None)
    if "contact" in out and trial.chance(0.2):
        out["contact"]["strips"] = {
            "count": int(trial.r.integers(2, 5)),
            "roll": grammar.quantity(trial, 1e-7, 1e-4, "rad"),
        }
    return out


# Pattern of a key; `reading`, `order` and `initial_bonds` of [friction] are printed without their
# table.
KEY = r"(?:(?:accuracy|contact|drive|friction|normal|slide|structure|wear)(?:\.\w+)+|reading|order|initial_bonds)"
SETS = re.compile(rf'({KEY}) (?:= |<= )("[^"]*"|[\w.+-]*\w)')
WITHOUT = re.compile(rf"leave out ({KEY})")
INSTEAD = re.compile(rf'leave out ({KEY}), or set it to ("[^"]*")')
VAGUE = re.compile(rf"(?:raise|lower|loosen|name|make|compare with) ({KEY})(?! below)")


def remedies_of(sentence: str) -> list:
    """Return the remedies that a warning or note names; keys joined by `and` belong to one remedy."""
    tail = sentence.rpartition("; ")[2] if "; " in sentence else sentence
    out = []
    if found := INSTEAD.search(tail):
        return [Remedy(sentence, {found[1]: None}), Remedy(sentence, {found[1]: _value(found[2])})]
    for part in re.split(r",? or ", tail):
        sets = {_whole(key): _value(value) for key, value in SETS.findall(part)}
        sets |= dict.fromkeys(map(_whole, WITHOUT.findall(part)))
        vague = tuple(map(_whole, VAGUE.findall(part)))
        if sets or vague:
            out.append(Remedy(sentence, sets, vague if not sets else ()))
    return out


def _whole(key: str) -> str:
    """Return a key with its table; keys without one belong to [friction]."""
    return key if "." in key else f"friction.{key}"


def _value(text: str):
    """Return the value of a printed number or string."""
    if text.startswith('"'):
        return text[1:-1]
    return int(text) if text.isdigit() else float(text)


def changed(tables: dict, sets: dict) -> dict:
    """Return the tables with these keys set, or left out if their value is None."""
    out = copy.deepcopy(tables)
    for key, value in sets.items():
        *path, last = key.split(".")
        at = out
        for name in path:
            at = at.setdefault(name, {})
        if value is None:
            at.pop(last, None)
        else:
            at[last] = value
    return out


def ran(tables: dict):
    """Return the Result of a scene; None if it is refused, does not converge or is too expensive."""
    try:
        asked = plan(loads(text_of(tables)))
        return run(asked) if asked.seconds < LONG else None
    except (NotConverged, PatchfemError, SceneError):
        return None


def verdict(tables: dict, found, remedy: Remedy) -> str:
    """Return the effect of a remedy: `gone`, `better`, `failed`, `refused`, or `dear` if it was too expensive to try.

    found: Result of the tables.
    """
    sets = remedy.sets or {
        key: _turned(tables, found, key, remedy.sentence) for key in remedy.vague
    }
    if not sets or any(value is None and key in remedy.vague for key, value in sets.items()):
        return "refused"
    asked = changed(tables, sets)
    try:
        what = plan(loads(text_of(asked)))
        if what.seconds > LONG:
            return "dear"
        again = run(what)
    except (NotConverged, PatchfemError, SceneError):
        return "refused"
    return _judged(found, again, remedy, sets)


def _turned(tables: dict, found, key: str, sentence: str):
    """Return a number of the scene or of the run times or over FACTOR; None if there is no number."""
    table, _, last = key.rpartition(".")
    number = tables.get(table, {}).get(last, found.extra.get(last))
    if not isinstance(number, int | float):
        return None
    return number * FACTOR if "raise" in sentence else number / FACTOR


def _judged(before, after, remedy: Remedy, sets: dict) -> str:
    """Return the effect of a remedy from the results before and after it."""
    sentence = remedy.sentence
    if not (names := _named(before, sentence)):
        said = [*after.warnings, *after.extra.get("notes", [])]
        old = sentence
        new = next((one for one in said if _gist(one) == _gist(sentence)), None)
        if new is None:
            return "gone"
        share = re.compile(r"^work_check is (\S+) ")
        pair = [share.search(one) for one in (new, old)]
        return (
            "better" if all(pair) and float(pair[0][1]) <= BETTER * float(pair[1][1]) else "failed"
        )
    asked = before.plan.model.accuracy.tolerance
    if "would meet" in sentence and "accuracy.tolerance" in sets:
        misses = [one for one in after.warnings if set(_named(after, one)) & set(names)]
        return "failed" if misses else "gone"
    worst = max(names, key=lambda name: _over(before.measures[name], asked))
    one = after.measures.get(worst)
    if one is None or one.value is None or one.error is None:
        return "failed" if one is None or one.value is not None else "gone"
    if _over(one, asked) <= 1:
        return "gone"
    share = REFINED if "to refine" in sentence else BETTER
    return "better" if one.error <= share * before.measures[worst].error else "failed"


def _named(found, sentence: str) -> list:
    """Return the measures that a sentence about errors names, in its order; [] for another sentence."""
    if "; the tolerance is " not in sentence:
        return []
    said = sentence.partition("; the tolerance is ")[0]
    words = re.findall(r"(?:^|, )(\w+) (?:has an estimated error )?of ", said)
    return [one for one in words if one in found.measures]


def _over(one, tolerance: float) -> float:
    """Return the error relative to the permitted error."""
    return one.error / max(tolerance * abs(one.value) + one.floor, 1e-300)


def _gist(sentence: str) -> str:
    """Return a sentence without its numbers."""
    return re.sub(r"[-+]?\d[\d.e+-]*", "#", sentence.partition("; ")[0])
