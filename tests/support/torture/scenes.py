"""Scenes with wrong keys or values, and scenes with wrong bytes: checked, planned and, if cheap, run."""

import copy

from . import grammar
from .results import ran
from .toml import Raw, known, parent, places, text_of
from .trial import Trial

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


def by_grammar(trial: Trial) -> None:
    """Run a random scene with none to four wrong keys."""
    tables = grammar.scene(trial)
    for _ in range(trial.draw(0, 0, 1, 1, 1, 2, 4)):
        mutate(trial, tables)
    ran(trial, written(trial, text_of(tables).encode("utf-8", "surrogatepass")))


def by_bytes(trial: Trial) -> None:
    """Run a random scene whose bytes are cut, flipped, doubled or mixed with invalid ones."""
    text = bytearray(text_of(grammar.scene(trial)).encode())
    for _ in range(trial.draw(1, 1, 2, 5, 20)):
        damage(trial, text)
    ran(trial, written(trial, bytes(text)))


def written(trial: Trial, text: bytes) -> str:
    """Write a scene file and return its name."""
    (trial.folder / "scene.toml").write_bytes(text)
    return "scene.toml"


def damage(trial: Trial, text: bytearray) -> None:
    """Apply one random damage to a text or binary file, in place."""
    at = int(trial.r.integers(len(text) + 1))
    to = min(len(text), at + int(trial.wide(1, 200)))
    how = trial.draw("flip", "cut", "double", "insert", "end", "broken", "digit", "line")
    if how == "flip" and at < len(text):
        text[at] = int(trial.r.integers(256))
    elif how == "cut":
        del text[at:to]
    elif how == "double":
        text[at:at] = text[at:to]
    elif how == "insert":
        text[at:at] = trial.r.bytes(int(trial.wide(1, 60)))
    elif how == "end":
        del text[at:]
    elif how == "broken":
        text[at:at] = trial.draw(*BROKEN).encode(
            "latin-1" if trial.chance(0.3) else "utf-8", "replace"
        )
    elif how == "digit":
        digits = [k for k, c in enumerate(text) if 48 <= c <= 57]
        if digits:
            text[trial.draw(*digits)] = 48 + int(trial.r.integers(10))
    elif how == "line":
        lines = bytes(text).splitlines(True)
        trial.r.shuffle(lines)
        text[:] = b"".join(lines)


def mutate(trial: Trial, tables: dict) -> None:
    """Apply one random mistake to a scene, in place."""
    there = places(tables)
    path = trial.draw(*there)
    how = trial.draw(
        "value", "value", "value", "scale", "scale", "drop", "rename", "add", "add", "copy", "type"
    )
    if how == "add":
        _add(trial, tables)
        return
    holder = parent(tables, path)
    key = path[-1]
    value = holder[key]
    if how == "value":
        holder[key] = anything(trial, value)
    elif how == "scale":
        holder[key] = scaled(trial, value)
    elif how == "drop":
        del holder[key]
    elif how == "rename" and isinstance(key, str):
        del holder[key]
        at = int(trial.r.integers(len(key) + 1))
        name = trial.draw(
            key[:at] + key[at + 1 :], key + "s", key.upper(), key[:at] + "é" + key[at:], "x" * 3000
        )
        holder[name] = value
    elif how == "copy" and isinstance(holder, dict):
        holder[trial.draw(*(one[-1] for one in there if isinstance(one[-1], str)))] = copy.deepcopy(
            value
        )
    elif how == "type":
        holder[key] = trial.draw(
            [value], {"x": value}, True, [], {}, Raw("2026-11-21T20:00:00Z"), Raw("07:32:00"), 7
        )


def _add(trial: Trial, tables: dict) -> None:
    """Add a key of the schema that the scene does not have, with a value of its kind."""
    path, kind, model = trial.draw(*known())
    for step, key in enumerate(path[:-1]):
        if isinstance(tables, dict):
            tables = tables.setdefault(key, [{}] if isinstance(path[step + 1], int) else {})
        elif isinstance(tables, list) and tables:
            tables = tables[0]
        if not isinstance(tables, dict | list):
            return
    if isinstance(tables, dict) and path[-1] not in tables:
        tables[path[-1]] = {} if model is not None else of_kind(trial, kind)


def of_kind(trial: Trial, kind: str | None):
    """Return a value for a key: a quantity of its kind over thirty decades, else a number or a word."""
    from patchfem.scene import UNIT_FACTORS

    if kind is None:
        return trial.draw(
            *NUMBERS,
            *TEXTS,
            *grammar.LAWS,
            *grammar.WAVEFORMS,
            "stretch",
            "merged",
            "harmonic",
            "upper",
        )
    number = trial.draw(trial.wide(1e-15, 1e15), trial.wide(1e-3, 1e3), -trial.wide(1e-3, 1e3), 0)
    return f"{number!r} {trial.draw(*UNIT_FACTORS[kind])}"


def anything(trial: Trial, value):
    """Return another value: an unusual number or text, or a number with an unusual unit."""
    if isinstance(value, list) and value and trial.chance(0.5):
        return (
            value * trial.draw(0, 2, 30)
            if trial.chance(0.5)
            else [anything(trial, one) for one in value]
        )
    number = trial.draw(*NUMBERS)
    return trial.draw(
        number,
        trial.draw(*TEXTS),
        f"{number!r} {trial.draw(*UNITS)}" if abs(number) < 1e300 else number,
        f"{trial.wide(1e-300, 1e300)!r} {trial.draw(*UNITS)}",
    )


def scaled(trial: Trial, value):
    """Return the value times up to twelve decades; a value that is no number is replaced."""
    factor = trial.wide(1e-3, 1e3) ** trial.draw(1, 1, 1, 4) * trial.draw(1, 1, 1, 1, -1)
    if isinstance(value, str):
        number, blank, unit = value.partition(" ")
        try:
            return f"{float(number) * factor:.6g} {unit}" if blank else anything(trial, value)
        except ValueError:
            return anything(trial, value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return anything(trial, value)
    if isinstance(value, float):
        return value * factor
    return value * int(factor) if abs(value) > 2**60 else int(value * factor)
