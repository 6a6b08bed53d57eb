"""The JSON schema of a scene, for editors that complete and check TOML as it is typed; generated from the records.

What an editor cannot know (which keys go together, which files exist) is left to `patchfem check`.
"""

import re

from .keys.contact import Material
from .keys.materials import MATERIALS
from .keys.quantities import KINDS, NUMBER
from .keys.tables import Tables
from .keys.types import Table, keys, kind_of, meaning, model_of, whole_tables
from .rules.scene_draft import SELECTORS, each

DIALECT = "https://json-schema.org/draft/2020-12/schema"
SPELLED = {"u": "[uµμ]", "^2": "(?:\\^2|²)", "^3": "(?:\\^3|³)", " ": "[ ·]"}


def schema() -> dict:
    """JSON schema (draft 2020-12) of a scene: every table and key with its meaning, limits, default and units."""
    with whole_tables():
        _made_whole(Tables)
    found = Tables.model_json_schema(by_alias=True)
    definitions = found.pop("$defs")
    for model in _below(Tables):
        definitions[model.__name__] = _table(model, definitions[model.__name__])
    definitions[Material.__name__] = _material(definitions[Material.__name__])
    whole = _table(Tables, found)
    whole["properties"]["sweep"] = _sweep()
    return {"$schema": DIALECT, "title": "patchfem scene", **whole, "$defs": definitions}


def _made_whole(model: type[Table]) -> None:
    """Make the checks of a table anew, after those of the tables inside it."""
    for name in keys(model).values():
        if inner := model_of(model, name):
            _made_whole(inner)
    model.model_rebuild(force=True)


def _below(model: type[Table]) -> set[type[Table]]:
    """The models of all tables inside one."""
    inside = {found for name in keys(model).values() if (found := model_of(model, name))}
    return inside.union(*map(_below, inside))


def _table(model: type[Table], found: dict) -> dict:
    """The schema of one table: what its keys mean, no null (TOML has none), defaults as a scene writes them."""
    out = {
        "type": "object",
        "description": " ".join((model.__doc__ or "").split()),
        "additionalProperties": False,
        "properties": {key: _key(model, key, found["properties"][key]) for key in keys(model)},
    }
    return out | ({"required": found["required"]} if found.get("required") else {})


def _key(model: type[Table], key: str, given: dict) -> dict:
    found = {
        word: value for word, value in given.items() if word not in ("title", "anyOf", "default")
    }
    choices = [one for one in given.get("anyOf", []) if one.get("type") != "null"]
    found |= choices[0] if len(choices) == 1 else {"anyOf": choices} if choices else {}
    if given.get("default") not in (None, "", []) and not isinstance(given["default"], dict):
        found["default"] = given["default"]
    name = keys(model)[key]
    if kind := kind_of(model, name):
        _quantities(found, kind)
    if (inner := model_of(model, name)) is None or inner is Material:
        found["description"] = "; ".join(filter(None, (meaning(model, key), _selected(model, key))))
    return found


def _selected(model: type[Table], key: str) -> str:
    """Which keys each value of a selector wants, or which values of its selector want or use a key; "" for others."""
    selector, values = next(
        (each for table, *each in SELECTORS.values() if issubclass(model, table)), ("", {})
    )
    if key == selector:
        return "; ".join(
            f"'{value}' needs {', '.join(needs.split()).replace('|', ' or ')}"
            for value, (needs, _) in values.items()
            if needs
        )
    wanted, used = ([f"'{value}'" for value, words in values.items() if key in each(words[place])]
                    for place in (0, 1))  # fmt: skip
    return "; ".join(
        f"{verb} {selector} {', '.join(found)}"
        for verb, found in (("needed with", wanted), ("used with", used))
        if found
    )


def _quantities(found: dict, kind: str) -> None:
    """Every text below is a quantity of this kind; a default in SI has its unit."""
    if isinstance(found.get("default"), int | float):
        found["default"] = f"{found['default']:g} {next(iter(KINDS[kind]))}"
    for one in (found, *found.get("anyOf", ()), found.get("items", {})):
        if one.get("type") == "string":
            one["pattern"] = pattern(kind)


def pattern(kind: str) -> str:
    """Regular expression of a quantity of a kind of `scene.keys.quantities.KINDS`: a number, a blank, a unit."""
    units = "|".join(_spelled(unit) for unit in sorted(KINDS[kind], key=len, reverse=True))
    return rf"^\s*{NUMBER}[ \t]+(?:{units})\s*$"


def _spelled(unit: str) -> str:
    """A unit with all its spellings."""
    pieces = re.split(r"(\^2|\^3| |u)", unit)
    return "".join(SPELLED.get(piece, re.escape(piece)) for piece in pieces)


def _material(table: dict) -> dict:
    return {
        "description": "the name of a listed material, or elastic constants and density",
        "anyOf": [{"type": "string", "enum": list(MATERIALS)}, table],
    }


def _sweep() -> dict:
    values = {
        "anyOf": [{"type": "string"}, {"type": "array", "minItems": 1}, {"type": "object"}],
        "examples": ["1e-6 rad..1e-2 rad:9"],
    }
    return {
        "type": "object",
        "minProperties": 1,
        "additionalProperties": values,
        "description": 'keys of the scene with their values or ranges, "table.key" = "low..high:number"; '
        "patchfem sweep runs the scene for all combinations",
    }
