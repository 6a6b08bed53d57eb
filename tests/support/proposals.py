"""Check of the proposals in error messages: each proposed value is inserted at the key that the message names.

A proposal is valid if its mistake disappears, even if another mistake replaces it.
"""

import copy
import re
from ast import literal_eval

import numpy as np
from remedies import KINDS, _draw_coarse_scene
from torture import scenes
from torture.toml import to_toml
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


def draw_mistaken_scene(seed: int) -> tuple:
    """Return (tables, mistakes) of a random scene; every second seed inserts a mistake on purpose."""
    trial = Trial(np.random.default_rng([29, seed]), None, None, None)
    tables = _draw_coarse_scene(trial, KINDS[seed % len(KINDS)])
    if seed % 2:
        scenes.mutate_scene(trial, tables)
    return tables, list_mistakes(tables)


def list_mistakes(tables: dict) -> list:
    """Return (key, message) of each mistake of a scene."""
    try:
        loads(to_toml(tables).encode("utf-8", "replace").decode(), "scene.toml")
    except SceneError as error:
        return [tuple(line.split(": ", 2)[1:]) for line in error.mistakes if line.count(": ") > 1]
    return []


def parse_proposals(tables: dict, key: str, message: str) -> list:
    """Return the proposals of a message for a mistake at a key, each as {key: value}.

    None stands for a key to leave out, ("", name) for one to rename.
    """
    out = [{key: literal_eval(value)} for value in SUCH.findall(message)]
    count = (
        len(tables["structure"].get("interface", ()))
        if isinstance(tables.get("structure"), dict)
        else 0
    )
    laws = [f"structure.interface[{k + 1}]" for k in range(count)] or ["friction"]
    other_key = re.search(r"with (accuracy\.\w+) '", message)
    for kind, words in USE.findall(message):
        keys = {
            "law": [f"{law}.law" for law in laws],
            "waveform": ["drive.waveform"],
            "kind": ["drive.kind"],
        }.get(kind, [other_key[1]] if other_key else [key] if key.startswith("accuracy.") else [])
        out += [dict.fromkeys(keys, word[1:-1]) for word in re.findall(WORD, words) if keys]
    if 'use reading = "stretch" with order = 1' in message:
        out.append({f"{law}.{name}": value for law in laws for name, value in PRINTED.items()})
    out += [{key: word} for words in ONE_OF.findall(message) for word in words.split(", ")]
    out += [{key: ("", word)} for word in MEANT.findall(message)]
    if re.search(r"leave (?:it|`?method`?) out", message):
        out.append({key: None})
    if "on the upper piece" in message and key.endswith(".on"):
        out.append({key: "upper"})
    return out


def set_key(tables: dict, key: str, value) -> dict | None:
    """Return the tables with a value at a key written as in a message; None if the key cannot exist there."""
    out = position = copy.deepcopy(tables)
    *path, last = re.sub(r"\[(\d+)\]", lambda found: f".{int(found[1]) - 1}", key).split(".")
    for name in path:
        if isinstance(position, list):
            with_name = [
                entry for entry in position if isinstance(entry, dict) and entry.get("name") == name
            ]
            position = (
                with_name[0]
                if with_name
                else position[int(name)]
                if name.isdecimal() and int(name) < len(position)
                else None
            )
        else:
            position = position.setdefault(name, {}) if isinstance(position, dict) else None
    if not isinstance(position, dict):
        return None
    if isinstance(value, tuple):
        if last not in position:
            return None
        position[value[1]] = position.pop(last)
    elif value is None:
        position.pop(last, None)
    else:
        position[last] = value
    return out


def find_failed_proposals(tables: dict, mistakes_found: list) -> list:
    """Return (key, message, {key: value}) of proposals after which the same mistake remains at the same key."""
    out = []
    for key, message in mistakes_found:
        for sets in parse_proposals(tables, key, message):
            changed = tables
            for target, value in sets.items():
                changed = changed and set_key(changed, target, value)
            if changed is not None and (key, message) in list_mistakes(changed):
                out.append((key, message, sets))
    return out
