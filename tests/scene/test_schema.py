"""The JSON schema of a scene accepts what the program reads and refuses what an editor should mark."""

import re
import tomllib
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from patchfem.scene import (
    BOUNDS_FORM,
    UNIT_FACTORS,
    loads,
    make_schema,
    parse_modes,
    parse_quantity,
    read_assignments,
    read_template,
)
from patchfem.scene import TEMPLATE_DESCRIPTIONS as TEMPLATES
from patchfem.scene.keys.quantities import EXAMPLE_QUANTITIES
from patchfem.scene.scene import SceneError
from patchfem.scene.schema import make_quantity_pattern

ROOT = Path(__file__).parents[2]
SCENES = sorted((ROOT / "studies").rglob("*.toml"))
RIG = read_template("rig")
WRONG = {  # change of a rig scene that both program and schema refuse -> (old text, new text)
    "a bare number": ('"115 N"', "115"),
    "a unit of another kind": ('"115 N"', '"115 mm"'),
    "an ambiguous unit": ('"115 N"', '"115 lb"'),
    "no blank": ('"115 N"', '"115N"'),
    "an unknown key": ("acceleration =", "acelleration ="),
    "beyond a limit": ("1e-3", "-1e-3"),
    "a text for a number": ("static = 0.3", 'static = "0.3"'),
    "a table for a value": ('"115 N"', "{value = 115}"),
    "an unknown table": ("[normal]", "[nromal]"),
}


@pytest.fixture(scope="module")
def schema_validator():
    """Return a validator of the schema."""
    made = make_schema()
    Draft202012Validator.check_schema(made)
    return Draft202012Validator(made)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: "-".join(path.parts[-2:]))
def test_always_schema_accepts_shipped_scenes(schema_validator, path):
    """The schema accepts every shipped scene."""
    assert [
        one.message for one in schema_validator.iter_errors(tomllib.loads(path.read_text("utf-8")))
    ] == []


@pytest.mark.parametrize("kind", TEMPLATES)
def test_always_schema_accepts_templates(schema_validator, kind):
    """The schema accepts every template."""
    assert schema_validator.is_valid(tomllib.loads(read_template(kind)))


@pytest.mark.parametrize("text, value", [("0.2 %", 0.002), ("2.5e-1%", 0.0025), ("-7 %", -0.07)])
def test_exact_percentage_is_accepted_by_schema_and_program(schema_validator, text, value):
    """A number without a unit may be written in percent, in a scene and in --set, --over and --free."""
    key = "structure.mode.axial.damping"
    scene = RIG.replace("damping = 0.003", f'damping = "{text}"')
    assert schema_validator.is_valid(tomllib.loads(scene))
    assert loads(scene).structure.mode[0].damping == value
    assert loads(RIG, sets=[f"{key}={text}"]).structure.mode[0].damping == value
    assert [tuple(axis.values) for axis in read_assignments([f"{key}={text}, 1 %..2 %:2"])[0]] == [
        (value, 0.01, 0.02)
    ]
    assert [
        (free.low, free.high) for free in read_assignments([f"{key}={text}..50 %"], BOUNDS_FORM)[0]
    ] == [(value, 0.5)]
    assert [mode[:3] for mode in parse_modes(f"212 Hz:{text}:1 %")] == [(212.0, value, 0.01)]


@pytest.mark.parametrize("right, wrong", WRONG.values(), ids=WRONG)
def test_refuses_scene_in_schema_and_program(schema_validator, right, wrong):
    """Wrong values are refused both by the schema and by the program."""
    text = RIG.replace(right, wrong, 1)
    assert not schema_validator.is_valid(tomllib.loads(text)) and schema_validator.is_valid(
        tomllib.loads(RIG)
    )
    with pytest.raises(SceneError):
        loads(text)


@pytest.mark.parametrize("kind", UNIT_FACTORS)
def test_exact_quantity_pattern_agrees_with_parser(kind):
    """The pattern of a quantity accepts exactly the texts that the program reads, for every unit and spelling."""
    units = {unit for units in UNIT_FACTORS.values() for unit in units}
    units |= {
        unit.translate(signs)
        for unit in units
        for signs in ({ord("u"): "µ"}, {ord("u"): "μ"}, {ord(" "): "·"})
    } | {u.replace("^2", "²").replace("^3", "³") for u in units}
    for text in [f"{number} {unit}" for unit in units for number in ("1", "-2.5e-3", ".5")] + [
        EXAMPLE_QUANTITIES[kind],
        "1",
        "",
    ]:
        try:
            reads = bool(parse_quantity(text, kind)) or True
        except ValueError as error:
            reads = "below 0 K" in str(error)
        assert bool(re.search(make_quantity_pattern(kind), text)) == reads, text


def test_exact_law_description_names_required_keys():
    """The description of each law names exactly the keys that the program reports as missing."""
    keys = make_schema()["$defs"]["Friction"]["properties"]
    description = keys["law"]["description"].replace(" or stiffness", "")
    named = {
        law: set(words.split(", "))
        for law, words in re.findall(r"'([\w-]+)' needs ([\w, ]+)", description)
    }
    for law in keys["law"]["enum"]:
        try:
            loads(
                read_template("bench")
                .replace('"nonlocal"', f'"{law}"')
                .replace("bond_length", "# ")
            )
            missing = set()
        except SceneError as error:
            missing = set(re.findall(r"friction\.(\w+): missing", str(error)))
        assert missing == named.get(law, set()), law
        for key in missing:
            assert f"'{law}'" in keys[key]["description"].partition("needed with law ")[2], key
    assert named["elastic-plastic"] == {"bond_length"}
    assert "bond_length or stiffness" in keys["law"]["description"]
