"""JSON schema of a scene, with which editors complete and check the TOML text.

A schema cannot express which keys go together and which files exist; `patchfem check` reports these mistakes.
"""

import json
import re
from typing import Any

from .keys.choices import find_selectors, format_keys, split_keys
from .keys.contact import Material
from .keys.materials import IGNORED_SEPARATORS_PATTERN, MATERIALS, is_case_sensitive, list_spellings
from .keys.quantities import NUMBER_PATTERN, PERCENTAGE_PATTERN, UNIT_FACTORS, find_si_unit
from .keys.tables import Tables
from .keys.types import (
    INNER_TABLE_WORD,
    Key,
    Table,
    list_inner_tables,
    list_keys,
)

# Words of a schema that restrict a number.
NUMBER_SCHEMA_WORDS = ("type", "exclusiveMinimum", "minimum", "exclusiveMaximum", "maximum")
# Regular expressions of all spellings of a part of a unit.
UNIT_SPELLINGS = {"u": "[uµμ]", "^2": "(?:\\^2|²)", "^3": "(?:\\^3|³)", " ": "[ ·]"}


def make_schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of a scene: meaning, limits, default, unit of keys."""
    tables = sorted(set(list_inner_tables(Tables).values()), key=lambda model: model.__name__)
    definitions = {model.__name__: _describe_table(model) for model in tables}
    definitions[Material.__name__] = _describe_material(definitions[Material.__name__])
    scene = _describe_table(Tables)
    scene["properties"]["sweep"] = _describe_sweep()
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "patchfem scene",
        **scene,
        "$defs": definitions,
    }
    # Pydantic describes each table by itself, in which an inner table is only named.
    text = json.dumps(schema).replace(f'"{INNER_TABLE_WORD}": "', '"$ref": "#/$defs/')
    return json.loads(text)


def _describe_table(model: type[Table]) -> dict[str, Any]:
    """Return the schema of a table class, `model`: meaning and default of each key, without null."""
    raw = model.model_json_schema(by_alias=True)
    properties = raw.get("properties", {})
    schema = {
        "type": "object",
        "description": " ".join((model.__doc__ or "").split()),
        "additionalProperties": False,
        "properties": {
            name: _describe_key(key, properties[name]) for name, key in list_keys(model).items()
        },
    }
    return schema | ({"required": raw["required"]} if raw.get("required") else {})


def _describe_key(key: Key, raw: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a key, based on the one that pydantic makes, `raw`."""
    schema = {word: raw[word] for word in raw if word not in ("title", "anyOf", "default")}
    types = [choice for choice in raw.get("anyOf", []) if choice.get("type") != "null"]
    if len(types) == 1:
        schema |= types[0]
    elif types:
        schema["anyOf"] = types
    default = raw.get("default")
    if default not in (None, "", []) and not isinstance(default, dict):
        schema["default"] = default
    if key.kind:
        _add_units(schema, key.kind)
    elif schema.get("type") == "number":
        number = {word: schema.pop(word) for word in NUMBER_SCHEMA_WORDS if word in schema}
        schema["anyOf"] = [number, {"type": "string", "pattern": f"^{PERCENTAGE_PATTERN}$"}]
    if key.inner in (None, Material):
        clauses = (key.record.meaning, _describe_selection(key.table, key.name))
        schema["description"] = "; ".join(filter(None, clauses))
    return schema


def _describe_selection(model: type[Table], key: str) -> str:
    """Describe the keys that a value of a selector requires, or the values that require a key; "" if there are none.

    A selector is a key, such as `law`, whose value decides which others the table needs. `model` is the class of the
    table.
    """
    clauses = []
    for selector in filter(lambda one: one.key, find_selectors(model)):
        if key == selector.key:
            needs = {value: required for value, (required, _) in selector.choices.items()}
            clauses += [
                f"'{value}' needs {format_keys(needs[value])}" for value in filter(needs.get, needs)
            ]
        for place, verb in enumerate(("needed with", "used with")):
            values = [
                f"'{value}'"
                for value, texts in selector.choices.items()
                if key in split_keys(texts[place])
            ]
            if values:
                clauses.append(f"{verb} {selector.key} {', '.join(values)}")
    return "; ".join(clauses)


def _add_units(schema: dict[str, Any], kind: str) -> None:
    """Add the pattern of quantities of a `kind`, such as "length", with their units to a schema."""
    if isinstance(schema.get("default"), int | float):
        schema["default"] = f"{schema['default']:g} {find_si_unit(kind)}"
    for part in (schema, *schema.get("anyOf", ()), schema.get("items", {})):
        if part.get("type") == "string":
            part["pattern"] = make_quantity_pattern(kind)


def make_quantity_pattern(kind: str) -> str:
    """Return a regular expression that matches a quantity (number, blank, unit) whose kind is `kind`."""
    units = sorted(UNIT_FACTORS[kind], key=len, reverse=True)
    return rf"^\s*{NUMBER_PATTERN}[ \t]+(?:{'|'.join(map(_make_unit_pattern, units))})\s*$"


def _make_unit_pattern(unit: str) -> str:
    """Return a regular expression that matches all spellings of a unit."""
    parts = re.split(r"(\^2|\^3| |u)", unit)
    return "".join(UNIT_SPELLINGS.get(part, re.escape(part)) for part in parts)


def _describe_material(table: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a material, which is a name or a table."""
    return {
        "description": "the name of a listed material, or elastic constants and density",
        "anyOf": [
            {"type": "string", "enum": list(MATERIALS)},
            {"type": "string", "pattern": _make_material_pattern()},
            table,
        ],
    }


def _make_material_pattern() -> str:
    """Return a regular expression that matches every spelling of every material name."""
    spellings = []
    for spelling, name in list_spellings().items():
        letters = map(_make_letter_pattern, spelling)
        if is_case_sensitive(spelling):
            letters = map(re.escape, name)
        spellings.append(f"{IGNORED_SEPARATORS_PATTERN}*".join(letters))
    return rf"^{IGNORED_SEPARATORS_PATTERN}*(?:{'|'.join(spellings)}){IGNORED_SEPARATORS_PATTERN}*$"


def _make_letter_pattern(letter: str) -> str:
    """Return a regular expression for a letter in upper and lower case, or for another character."""
    return f"[{letter}{letter.upper()}]" if letter.isalpha() else re.escape(letter)


def _describe_sweep() -> dict[str, Any]:
    """Return the schema of the table [sweep], whose keys are those of a scene."""
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
