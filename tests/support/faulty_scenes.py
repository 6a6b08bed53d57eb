"""Scenes with one to four random changes of shipped scenes: most are faulty, and all have a fixed seed.

`tests/scene/faulty_scenes.json` holds refused scenes with the file, line and key of each of their mistakes in release
1.5; `scene/test_faulty_scenes.py` reads it. To see what a change of the program does to the answers on many scenes:

    python tests/support/faulty_scenes.py before.json
    python tests/support/faulty_scenes.py --again before.json after.json
    python tests/support/faulty_scenes.py --compare before.json after.json

`--record FILE.json` writes the refused scenes and the places of their mistakes anew. The first line takes a number of
scenes and a seed besides: `python tests/support/faulty_scenes.py before.json 1000 98790001`. Seeds that were used for a
score: 98790001 (version 1.7 and the next one).
"""

import json
import random
import re
import sys
import tomllib
from copy import deepcopy
from hashlib import sha256
from pathlib import Path
from typing import Any, get_args, get_origin

from patchfem.effects import LAWS, WAVEFORMS
from patchfem.scene.keys.quantities import EXAMPLE_QUANTITIES
from patchfem.scene.keys.tables import Tables
from patchfem.scene.keys.types import list_keys
from patchfem.scene.scene import SceneError, loads

ROOT = Path(__file__).resolve().parents[2]
SEED = 79
COUNT = 1000
N_RECORDED = 320  # number of refused scenes in the record
MAX_RECORDED_LENGTH = 800  # largest number of characters of a recorded scene
FOLDERS = ("patchfem/scene/templates", "studies")
# Scenes of kinds that few of the shipped scenes have.
MORE_SCENES = (
    """
[structure]
masses = ["1 kg", "2 kg"]
spring = [{between = [1, 0], stiffness = "1e6 N/m"}, {between = [2, 1], stiffness = "1e6 N/m"}]
damper = [{between = [1, 0], coefficient = "10 N s/m"}]
[[structure.interface]]
between = [2, 0]
law = "elastic-plastic"
static = 0.3
bond_length = "1 um"
load = "20 N"
[[structure.interface]]
between = [2, 1]
law = "coulomb"
static = 0.3
[structure.interface.contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "steel"
[structure.interface.contact.shear]
[drive]
kind = "force"
mass = 1
frequency = "143 Hz"
force = "5 N"
cycles = 20
""",
    """
[friction]
law = "coulomb"
static = 0.3
[normal]
load = "20 N"
[structure]
travel = "1 mm"
[structure.reduced]
stiffness = "k.mtx"
mass = "m.mtx"
boundary = [1, 5, 9]
slide = [1, 0]
[drive]
kind = "free"
displacement = "1 mm"
cycles = 20
""",
    """
[friction]
law = "nonlocal"
static = 0.3
bond_length = "1 um"
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "steel"
mesh = "pieces.msh"
[contact.strips]
count = 4
[contact.profile]
file = "trace.csv"
[contact.asperities]
law = "hertz"
rms_height = "1 um"
rms_slope = 0.1
rms_curvature = "0.05 1/um"
[structure]
file = "modes.uff"
moving_mass = "1 kg"
slide_at = "12:+x"
[drive]
kind = "base"
waveform = "levels"
frequency = "143 Hz"
levels = ["1 g", "2 g"]
cycles = 20
[accuracy]
method = "harmonic"
[measured]
file = "rows.csv"
reading = "lowpass"
reading_cutoff = "600 Hz"
""",
)
WRONG_VALUES = (
    -1, 0, 1.5, 7, 1e60, True, "", "mm", "5 parsec", "-1 mm", "0 mm", "1e9 N", "12 mm", "5 %", [], [1, 2],
    ["1 mm", "2 mm"], {}, {"a": 1}, float("nan"),
)  # fmt: skip


def list_base_scenes() -> list[dict]:
    """Return the plain values of all shipped scenes and templates, and of MORE_SCENES."""
    paths = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.toml"))
    return [
        *(tomllib.loads(path.read_text(encoding="utf-8")) for path in paths),
        *map(tomllib.loads, MORE_SCENES),
    ]


def iterate_tables(values: dict, model: Any = Tables) -> Any:
    """Yield (model, plain table) for all tables of a scene that the program knows."""
    yield model, values
    for key, value in values.items():
        inner = key in list_keys(model) and list_keys(model)[key].inner
        for item in value if isinstance(value, list) else [value]:
            if inner and isinstance(item, dict):
                yield from iterate_tables(item, inner)


def collect_values(scenes: list[dict]) -> dict[str, list]:
    """Return the values that the scenes give to each key, by the names of its table and of the key."""
    pool: dict[str, list] = {}
    for scene in scenes:
        for model, table in iterate_tables(scene):
            for key, value in table.items():
                pool.setdefault(f"{model.__name__}.{key}", []).append(value)
    return pool


def make_value(rng: random.Random, model: Any, key: str, pool: dict[str, list]) -> Any:
    """Return a value for a key: mostly one that the key accepts."""
    known = list_keys(model)[key]
    types = known.types
    choices = list(known.allowed)
    choices += pool.get(f"{model.__name__}.{key}", [])[:6]
    kind = known.kind
    if tuple in map(get_origin, types) and kind:
        choices += [
            [EXAMPLE_QUANTITIES[kind]] * 2,
            [f"0 {EXAMPLE_QUANTITIES[kind].partition(' ')[2]}"] * 3,
        ]
    elif kind:
        choices += [
            EXAMPLE_QUANTITIES[kind],
            re.sub("[0-9.e-]+", "1e-3", EXAMPLE_QUANTITIES[kind], count=1),
        ]
    elif known.inner is not None:
        table = {
            name: make_value(rng, known.inner, name, pool)
            for name, inside in list_keys(known.inner).items()
            if inside.field.is_required() or rng.random() < 0.2
        }
        choices.append([table] if known.is_array else table)
    elif any(get_args(part) == (int, int) for part in types):
        choices += [[1, 0], [2, 1], [3, 3]]
    elif float in types:
        choices += [1.0, 0.5, 0.0, -0.5]
    elif int in types:
        choices += [1, 2, 400]
    elif not choices:
        choices = ["trace.csv", "k.mtx", "modes.npz", "12:+x"]
    return deepcopy(rng.choice(choices))


def change_scene(rng: random.Random, scene: dict, pool: dict[str, list]) -> None:
    """Change a scene in one random way."""
    tables = list(iterate_tables(scene))
    model, table = rng.choice(tables)
    keys = list_keys(model)
    written = list(table)
    way = rng.choice(("misspell", "drop", "value", "add", "add", "select", "table", "swap"))
    if way == "misspell" and written:
        key = rng.choice(written)
        place = rng.randrange(len(key))
        wrong = key[:place] + rng.choice(("", "e", key[place] * 2)) + key[place + 1 :]
        table[wrong or "x"] = table.pop(key)
    elif way == "drop" and written:
        del table[rng.choice(written)]
    elif way == "value" and written:
        table[rng.choice(written)] = deepcopy(rng.choice(WRONG_VALUES))
    elif way == "swap" and len(written) > 1:
        first, second = rng.sample(written, 2)
        table[first], table[second] = table[second], table[first]
    elif way == "select":
        selectors = [
            (m, t, key)
            for m, t in tables
            for key in t
            if key in list_keys(m) and list_keys(m)[key].allowed
        ]
        if selectors:
            m, t, key = rng.choice(selectors)
            names = (
                LAWS if key == "law" and "static" in t else WAVEFORMS if key == "waveform" else ()
            )
            t[key] = rng.choice(list(names) or list(list_keys(m)[key].allowed))
    elif way == "table":
        key = rng.choice([name for name, known in list_keys(Tables).items() if known.inner])
        scene[key] = make_value(rng, Tables, key, pool)
    elif keys:
        key = rng.choice(list(keys))
        table[key] = make_value(rng, model, key, pool)


def format_value(value: Any) -> str:
    """Format a plain value as TOML, with tables inline."""
    if isinstance(value, dict):
        return (
            "{" + ", ".join(f"{json.dumps(k)} = {format_value(v)}" for k, v in value.items()) + "}"
        )
    if isinstance(value, list):
        return "[" + ", ".join(map(format_value, value)) + "]"
    return json.dumps(value).replace("NaN", "nan") if not isinstance(value, float) else repr(value)


def format_scene(values: dict, path: str = "") -> list[str]:
    """Return the lines of a scene with one key on each line."""
    lines = []
    inner = []
    for key, value in values.items():
        name = f"{path}.{key}" if path else key
        if isinstance(value, dict):
            inner += [f"[{name}]", *format_scene(value, name)]
        elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            for item in value:
                inner += [f"[[{name}]]", *format_scene(item, name)]
        else:
            lines.append(f"{json.dumps(key)} = {format_value(value)}")
    return [*lines, *inner]


def make_faulty_scenes(count: int = COUNT, seed: int = SEED) -> list[str]:
    """Return the texts of `count` changed scenes."""
    rng = random.Random(seed)
    bases = list_base_scenes()
    pool = collect_values(bases)
    texts = []
    for _ in range(count):
        scene = deepcopy(rng.choice(bases))
        for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 4))):
            change_scene(rng, scene, pool)
        texts.append("\n".join(format_scene(scene)) + "\n")
    return texts


def describe(text: str) -> dict:
    """Return what the program says about a scene: its mistakes, or what it reads."""
    try:
        scene = loads(text, "scene.toml")
    except SceneError as error:
        return {"mistakes": error.mistakes}
    read = [scene.resolved(), scene.kind, scene.effect_names(), scene.notes]
    return {"remarks": scene.remarks, "read": sha256(repr(read).encode()).hexdigest()[:16]}


def find_place(mistake: str) -> str:
    """Return file, line and key of a mistake."""
    return ": ".join(mistake.split(": ")[:2])


def record_places(count: int = N_RECORDED) -> list[dict]:
    """Return short refused scenes with the place of every mistake."""
    rows = []
    for text in make_faulty_scenes(4 * count):
        mistakes = describe(text).get("mistakes", ())
        if mistakes and len(text) <= MAX_RECORDED_LENGTH:
            rows.append({"text": text, "places": sorted(map(find_place, mistakes))})
    return rows[:count]


def compare(before: list[dict], after: list[dict]) -> None:
    """Print the differences between two lists of answers."""
    counts = {"refused": 0, "places": 0, "sentences": 0, "remarks": 0, "read": 0}
    sentences: dict[tuple, int] = {}
    for number, (old, new) in enumerate(zip(before, after, strict=True)):
        counts["refused"] += "mistakes" in old
        if ("mistakes" in old) != ("mistakes" in new):
            print(number, "REFUSED" if "mistakes" in new else "ACCEPTED", old, new)
        elif "mistakes" in old:
            places = (
                sorted(map(find_place, old["mistakes"])),
                sorted(map(find_place, new["mistakes"])),
            )
            if places[0] != places[1]:
                counts["places"] += 1
                print(number, "PLACES", old["mistakes"], new["mistakes"])
            for one in set(old["mistakes"]) ^ set(new["mistakes"]):
                words = re.sub(r"scene.toml:?\d*: ", "", one)
                sentences[words, one in new["mistakes"]] = (
                    sentences.get((words, one in new["mistakes"]), 0) + 1
                )
            counts["sentences"] += old["mistakes"] != new["mistakes"]
        else:
            if old["remarks"] != new["remarks"]:
                counts["remarks"] += 1
                print(number, "REMARKS", old["remarks"], new["remarks"])
            if old["read"] != new["read"]:
                counts["read"] += 1
                print(number, "READ")
    for (words, is_new), n in sorted(sentences.items())[:80]:
        print("+" if is_new else "-", n, words)
    print(len(before), counts)


if __name__ == "__main__":
    if sys.argv[1] == "--compare":
        compare(*(json.loads(Path(name).read_text()) for name in sys.argv[2:]))
    elif sys.argv[1] == "--record":
        Path(sys.argv[2]).write_text(json.dumps(record_places(), indent=0) + "\n")
    elif sys.argv[1] == "--again":
        answers = json.loads(Path(sys.argv[2]).read_text())
        again = [{"text": answer["text"], **describe(answer["text"])} for answer in answers]
        Path(sys.argv[3]).write_text(json.dumps(again, indent=1))
    else:
        texts = make_faulty_scenes(*map(int, sys.argv[2:]))
        answers = [{"text": text, **describe(text)} for text in texts]
        Path(sys.argv[1]).write_text(json.dumps(answers, indent=1))
