"""Check of the proposals in error messages: each proposed value is inserted at the key that the message names.

A proposal is valid if its mistake disappears, even if another mistake replaces it.
"""

import copy
import re
from ast import literal_eval

import numpy as np
from remedies import KINDS, _loose
from torture import scenes
from torture.toml import text_of
from torture.trial import Trial

from patchfem.scene import loads
from patchfem.scene.scene import SceneError

WORD = r"'[^']*'|\"[^\"]*\""
LIST = rf"((?:{WORD})(?:(?:, | or )(?:{WORD}))*)"
SUCH = re.compile(r"such as ('[^']*'|\[[^]]*\])")
USE = re.compile(rf"\b(?:use|or) (?:(law|waveform|kind) )?{LIST}")
ONE_OF = re.compile(r"one of ((?:[\w-]+, )+[\w-]+)(?: is needed|$)")
MEANT = re.compile(r"did you mean '(\w+)'")
PRINTED = {"reading": "stretch", "order": 1}


def wrong(seed: int) -> tuple:
    """Return (tables, mistakes) of a random scene; every second seed inserts a mistake on purpose."""
    trial = Trial(np.random.default_rng([29, seed]), None, None, None)
    tables = _loose(trial, KINDS[seed % len(KINDS)])
    if seed % 2:
        scenes.mutate(trial, tables)
    return tables, mistakes(tables)


def mistakes(tables: dict) -> list:
    """Return (key, message) of each mistake of a scene."""
    try:
        loads(text_of(tables).encode("utf-8", "replace").decode(), "scene.toml")
    except SceneError as error:
        return [tuple(line.split(": ", 2)[1:]) for line in error.mistakes if line.count(": ") > 1]
    return []


def tries(tables: dict, key: str, message: str) -> list:
    """Return the proposals of a message for a mistake at a key, each as {key: value}.

    None stands for a key to leave out, ("", name) for one to rename.
    """
    out = [{key: literal_eval(found)} for found in SUCH.findall(message)]
    count = (
        len(tables["structure"].get("interface", ()))
        if isinstance(tables.get("structure"), dict)
        else 0
    )
    laws = [f"structure.interface[{k + 1}]" for k in range(count)] or ["friction"]
    beside = re.search(r"with (accuracy\.\w+) '", message)
    for kind, words in USE.findall(message):
        at = {
            "law": [f"{one}.law" for one in laws],
            "waveform": ["drive.waveform"],
            "kind": ["drive.kind"],
        }.get(kind, [beside[1]] if beside else [key] if key.startswith("accuracy.") else [])
        out += [dict.fromkeys(at, word[1:-1]) for word in re.findall(WORD, words) if at]
    if 'use reading = "stretch" with order = 1' in message:
        more = {"breakaway": None} if "breakaway" in message else {}
        out.append(
            {f"{one}.{name}": value for one in laws for name, value in (PRINTED | more).items()}
        )
    out += [{key: word} for words in ONE_OF.findall(message) for word in words.split(", ")]
    out += [{key: ("", word)} for word in MEANT.findall(message)]
    if re.search(r"leave (?:it|`?method`?) out", message):
        out.append({key: None})
    if "on the upper piece" in message and key.endswith(".on"):
        out.append({key: "upper"})
    return out


def put(tables: dict, key: str, value) -> dict | None:
    """Return the tables with a value at a key written as in a message; None if the key cannot exist there."""
    out = at = copy.deepcopy(tables)
    *path, last = re.sub(r"\[(\d+)\]", lambda found: f".{int(found[1]) - 1}", key).split(".")
    for name in path:
        if isinstance(at, list):
            named = [one for one in at if isinstance(one, dict) and one.get("name") == name]
            at = (
                named[0]
                if named
                else at[int(name)]
                if name.isdecimal() and int(name) < len(at)
                else None
            )
        else:
            at = at.setdefault(name, {}) if isinstance(at, dict) else None
    if not isinstance(at, dict):
        return None
    if isinstance(value, tuple):
        if last not in at:
            return None
        at[value[1]] = at.pop(last)
    elif value is None:
        at.pop(last, None)
    else:
        at[last] = value
    return out


def vain(tables: dict, found: list) -> list:
    """Return (key, message, {key: value}) of proposals after which the same mistake remains at the same key."""
    out = []
    for key, message in found:
        for sets in tries(tables, key, message):
            changed = tables
            for to, value in sets.items():
                changed = changed and put(changed, to, value)
            if changed is not None and (key, message) in mistakes(changed):
                out.append((key, message, sets))
    return out
