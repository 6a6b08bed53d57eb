"""Scenes that are loose by chance, the remedies that a sentence prints, and what a remedy does when it is tried.

`drawn(seed)` is a scene of any kind, law and engine whose numerical settings are pinned too coarse, or whose tolerance
is too tight for them, so that it warns; `remedies_of` reads the sentences of its run, `tried` follows one.
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
DEAR = 3.0  # planned seconds beyond which a scene is not drawn
LONG = 15.0  # and beyond which a remedy is not tried
BETTER = 0.5  # of what it was, at which a bar or a share is better by what any remedy promises
REFINED = 0.75  # where it promises no more than to refine
FACTOR = 4  # on a number, up or down, where a sentence names a key without a value


class Remedy(NamedTuple):
    """One printed remedy: the whole sentence, and the keys to set with their values, None for one to leave out; keys
    that the sentence names without a value stand in `vague`."""

    sentence: str
    sets: dict
    vague: tuple = ()


def drawn(seed: int) -> dict:
    """Tables of the first scene, of those that a seed draws, that is read without a mistake and planned as cheap."""
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
    """A scene of chance whose settings are pinned: few steps, harmonics, elements or strips, or a tight tolerance."""
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


# a key of a scene; `reading`, `order` and `initial_bonds` of [friction] are printed without their table
KEY = r"(?:(?:accuracy|contact|drive|friction|normal|slide|structure|wear)(?:\.\w+)+|reading|order|initial_bonds)"
SETS = re.compile(rf'({KEY}) (?:= |<= )("[^"]*"|[\w.+-]*\w)')
WITHOUT = re.compile(rf"leave out ({KEY})")
INSTEAD = re.compile(rf'leave out ({KEY}), or set it to ("[^"]*")')
VAGUE = re.compile(rf"(?:raise|lower|loosen|name|make|compare with) ({KEY})(?! below)")


def remedies_of(sentence: str) -> list:
    """The remedies that a warning or a note prints, each by itself; those of a list joined by `and` are one."""
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
    return key if "." in key else f"friction.{key}"


def _value(text: str):
    if text.startswith('"'):
        return text[1:-1]
    return int(text) if text.isdigit() else float(text)


def changed(tables: dict, sets: dict) -> dict:
    """The tables with these keys set, or left out where their value is None."""
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
    """The Result of a scene of tables; None where it is refused, does not converge or is too dear."""
    try:
        asked = plan(loads(text_of(tables)))
        return run(asked) if asked.seconds < LONG else None
    except (NotConverged, PatchfemError, SceneError):
        return None


def verdict(tables: dict, found, remedy: Remedy) -> str:
    """What a remedy of a run did when it was tried: `gone`, `better`, `failed`, `refused`, or `dear` where it was not.

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
    """A number that stands in the scene or was chosen by the run, FACTOR times as large or as small; None without."""
    table, _, last = key.rpartition(".")
    number = tables.get(table, {}).get(last, found.extra.get(last))
    if not isinstance(number, int | float):
        return None
    return number * FACTOR if "raise" in sentence else number / FACTOR


def _judged(before, after, remedy: Remedy, sets: dict) -> str:
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
    """The measures that a sentence on bars names, in its order; none of another sentence."""
    if "; the tolerance is " not in sentence:
        return []
    said = sentence.partition("; the tolerance is ")[0]
    words = re.findall(r"(?:^|, )(\w+) (?:has an estimated error )?of ", said)
    return [one for one in words if one in found.measures]


def _over(one, tolerance: float) -> float:
    return one.error / max(tolerance * abs(one.value) + one.floor, 1e-300)


def _gist(sentence: str) -> str:
    """The words of a sentence without its numbers."""
    return re.sub(r"[-+]?\d[\d.e+-]*", "#", sentence.partition("; ")[0])
