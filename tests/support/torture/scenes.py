"""Scenes with wrong keys or values, and scenes with wrong bytes: checked, planned and, if cheap, run."""

import copy
import json
from pathlib import Path

from patchfem.effects import LAWS, WAVEFORMS

from .results import run_scene
from .toml import Raw, get_parent, list_changed_paths, list_paths, list_schema_keys, to_toml
from .trial import Trial, TrialFailure

# Cheap scenes of every kind of run, table, law, drive and method, drawn at random by the grammar of version 1.11
# (`torture/grammar.py`). Combinations that are not permitted are among them.
SCENES = json.loads(Path(__file__).with_name("random_scenes.json").read_text("utf-8"))
NUMBERS = (
    0,
    -1,
    1,
    2,
    3,
    10**18,
    -(10**30),
    10**400,
    1e-320,
    1e308,
    -0.0,
    1e-12,
    0.5,
    1e12,
    float("nan"),
    float("inf"),
)
UNITS = (
    "m",
    "mm",
    "um",
    "N",
    "lbf",
    "Hz",
    "kg",
    "s",
    "g",
    "rad",
    "m/s",
    "Pa",
    "K",
    "lb",
    "",
    "furlong",
    "N/m",
    "±",
    "%",
)
TEXTS = (
    "",
    " ",
    "none",
    "auto",
    "\x00",
    "\x1b[31mred",
    "ü" * 40,
    "x" * 3000,
    "../../x",
    "/etc/passwd",
    "a\nb",
    "\u202e",
    "<b>",
    "'; --",
    "%s%n",
    "\U0001f600",
    "1e5",
    "12,7 mm",
    "12 mm ± 0.1",
    "NaN",
    "-0 m",
    "\ud7ff",
    "{0}",
    "~",
    "\\",
)
BROKEN = (
    "[",
    "]]",
    "= 3",
    "[a.b.c]\n",
    "\x00",
    "\xff",
    '"""',
    "a = 1\na = 2\n",
    "[contact]\n[contact]\n",
    "é = 1",
    "x = 2026-11-21",
    "x = 0b111_",
    "a." * 5000 + "a = 1",
    "[" * 3000,
    "#" * 10**5,
    "\r",
    "\ufeff",
    "x = [1, [2, [3]]]",
    "[[structure.mode.x]]\n",
)


def draw_scene(trial: Trial) -> dict:
    """Return the tables of a random scene, which may be changed."""
    return copy.deepcopy(trial.draw(*SCENES))


def run_grammar_trial(trial: Trial) -> None:
    """Run a random scene with none to four wrong keys; the refusal of a single one names it."""
    tables = draw_scene(trial)
    n_mistakes = trial.draw(0, 0, 1, 1, 1, 2, 4)
    right = copy.deepcopy(tables)
    for _ in range(n_mistakes):
        mutate_scene(trial, tables)
    name = write_scene(trial, to_toml(right).encode("utf-8", "surrogatepass"))
    is_right = n_mistakes == 1 and trial.run("check", name).code == 0
    write_scene(trial, to_toml(tables).encode("utf-8", "surrogatepass"))
    if is_right:
        refusal = trial.run("check", name)
        if refusal.code == 2:
            check_named_fault(refusal.err, list_changed_paths(right, tables))
    run_scene(trial, name)


def check_named_fault(message: str, paths: list[tuple]) -> None:
    """Raise TrialFailure if a refusal has no word of the keys at `paths`, or of the tables that contain them."""
    words = {str(key)[:20] for path in paths for key in path if isinstance(key, str)}
    if not any(word in message for word in words):
        raise TrialFailure(
            f"the refusal does not name {' or '.join(sorted(words))}: {message[:300]}"
        )


def run_bytes_trial(trial: Trial) -> None:
    """Run a random scene whose bytes are cut, flipped, doubled or mixed with invalid ones."""
    text = bytearray(to_toml(draw_scene(trial)).encode())
    for _ in range(trial.draw(1, 1, 2, 5, 20)):
        damage_bytes(trial, text)
    run_scene(trial, write_scene(trial, bytes(text)))


def write_scene(trial: Trial, text: bytes) -> str:
    """Write a scene file and return its name."""
    (trial.folder / "scene.toml").write_bytes(text)
    return "scene.toml"


def damage_bytes(trial: Trial, text: bytearray) -> None:
    """Apply one random damage to a text or binary file, in place."""
    start = int(trial.r.integers(len(text) + 1))
    stop = min(len(text), start + int(trial.log_uniform(1, 200)))
    damage_kind = trial.draw(*"flip cut double insert end broken digit line".split())
    if damage_kind == "flip" and start < len(text):
        text[start] = int(trial.r.integers(256))
    elif damage_kind == "cut":
        del text[start:stop]
    elif damage_kind == "double":
        text[start:start] = text[start:stop]
    elif damage_kind == "insert":
        text[start:start] = trial.r.bytes(int(trial.log_uniform(1, 60)))
    elif damage_kind == "end":
        del text[start:]
    elif damage_kind == "broken":
        text[start:start] = trial.draw(*BROKEN).encode(
            "latin-1" if trial.chance(0.3) else "utf-8", "replace"
        )
    elif damage_kind == "digit":
        digits = [k for k, c in enumerate(text) if 48 <= c <= 57]
        if digits:
            text[trial.draw(*digits)] = 48 + int(trial.r.integers(10))
    elif damage_kind == "line":
        lines = bytes(text).splitlines(True)
        trial.r.shuffle(lines)
        text[:] = b"".join(lines)


def mutate_scene(trial: Trial, tables: dict) -> None:
    """Apply one random mistake to a scene, in place."""
    paths = list_paths(tables)
    path = trial.draw(*paths)
    mistake_kind = trial.draw(
        *"value value value scale scale drop rename add add copy type".split()
    )
    if mistake_kind == "add":
        _add_key(trial, tables)
        return
    holder = get_parent(tables, path)
    key = path[-1]
    value = holder[key]
    if mistake_kind == "value":
        holder[key] = draw_wrong_value(trial, value)
    elif mistake_kind == "scale":
        holder[key] = scale_value(trial, value)
    elif mistake_kind == "drop":
        del holder[key]
    elif mistake_kind == "rename" and isinstance(key, str):
        del holder[key]
        position = int(trial.r.integers(len(key) + 1))
        name = trial.draw(
            key[:position] + key[position + 1 :],
            key + "s",
            key.upper(),
            key[:position] + "é" + key[position:],
            "x" * 3000,
        )
        holder[name] = value
    elif mistake_kind == "copy" and isinstance(holder, dict):
        holder[
            trial.draw(*(other_path[-1] for other_path in paths if isinstance(other_path[-1], str)))
        ] = copy.deepcopy(value)
    elif mistake_kind == "type":
        holder[key] = trial.draw(
            [value], {"x": value}, True, [], {}, Raw("2026-11-21T20:00:00Z"), Raw("07:32:00"), 7
        )


def _add_key(trial: Trial, tables: dict) -> None:
    """Add a key of the schema that the scene does not have, with a value of its kind."""
    path, kind, model = trial.draw(*list_schema_keys())
    for step, key in enumerate(path[:-1]):
        if isinstance(tables, dict):
            tables = tables.setdefault(key, [{}] if isinstance(path[step + 1], int) else {})
        elif isinstance(tables, list) and tables:
            tables = tables[0]
        if not isinstance(tables, dict | list):
            return
    if isinstance(tables, dict) and path[-1] not in tables:
        tables[path[-1]] = {} if model is not None else draw_value(trial, kind)


def draw_value(trial: Trial, kind: str | None):
    """Return a value for a key: a quantity of its kind over thirty decades, else a number or a word."""
    from patchfem.scene import UNIT_FACTORS

    if kind is None:
        return trial.draw(
            *NUMBERS,
            *TEXTS,
            *LAWS,
            *WAVEFORMS,
            "stretch",
            "merged",
            "harmonic",
            "upper",
        )
    number = trial.draw(
        trial.log_uniform(1e-15, 1e15),
        trial.log_uniform(1e-3, 1e3),
        -trial.log_uniform(1e-3, 1e3),
        0,
    )
    return f"{number!r} {trial.draw(*UNIT_FACTORS[kind])}"


def draw_wrong_value(trial: Trial, value):
    """Return another value: an unusual number or text, or a number with an unusual unit."""
    if isinstance(value, list) and value and trial.chance(0.5):
        return (
            value * trial.draw(0, 2, 30)
            if trial.chance(0.5)
            else [draw_wrong_value(trial, item) for item in value]
        )
    number = trial.draw(*NUMBERS)
    return trial.draw(
        number,
        trial.draw(*TEXTS),
        f"{number!r} {trial.draw(*UNITS)}" if abs(number) < 1e300 else number,
        f"{trial.log_uniform(1e-300, 1e300)!r} {trial.draw(*UNITS)}",
    )


def scale_value(trial: Trial, value):
    """Return the value times up to twelve decades; a value that is no number is replaced."""
    factor = trial.log_uniform(1e-3, 1e3) ** trial.draw(1, 1, 1, 4) * trial.draw(1, 1, 1, 1, -1)
    if isinstance(value, str):
        number, blank, unit = value.partition(" ")
        try:
            return (
                f"{float(number) * factor:.6g} {unit}" if blank else draw_wrong_value(trial, value)
            )
        except ValueError:
            return draw_wrong_value(trial, value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return draw_wrong_value(trial, value)
    if isinstance(value, float):
        return value * factor
    return value * int(factor) if abs(value) > 2**60 else int(value * factor)
