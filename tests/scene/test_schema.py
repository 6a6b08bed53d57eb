"""The JSON schema of a scene: it accepts what the program reads and refuses what an editor should mark."""

import re
import tomllib
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from patchfem.scene import TEMPLATE_DESCRIPTIONS as TEMPLATES
from patchfem.scene import UNIT_FACTORS, loads, make_schema, parse_quantity, read_template
from patchfem.scene.keys.quantities import EXAMPLE_QUANTITIES
from patchfem.scene.scene import SceneError
from patchfem.scene.schema import make_quantity_pattern

ROOT = Path(__file__).parents[2]
SCENES = sorted((ROOT / "studies").rglob("*.toml"))
RIG = read_template("rig")
WRONG = {  # what is changed in the scene of a rig, as neither the program nor the schema reads it
    "a bare number": ('"115 N"', "115"),
    "a unit of another kind": ('"115 N"', '"115 mm"'),
    "an ambiguous unit": ('"115 N"', '"115 lb"'),
    "no blank": ('"115 N"', '"115N"'),
    "an unknown key": ("acceleration =", "acelleration ="),
    "an unknown value": ('"base"', '"bass"'),
    "an unknown law": ('"coulomb"', '"coulom"'),
    "beyond a limit": ("1e-3", "-1e-3"),
    "a text for a number": ("static = 0.3", 'static = "0.3"'),
    "a fraction of a whole": ("1e-3", "1e-3\nsteps_per_cycle = 10.5"),
    "a table for a value": ('"115 N"', "{value = 115}"),
    "an unknown table": ("[normal]", "[nromal]"),
}


@pytest.fixture(scope="module")
def check():
    made = make_schema()
    Draft202012Validator.check_schema(made)
    return Draft202012Validator(made)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: "-".join(path.parts[-2:]))
def test_always_it_accepts_the_scenes_that_ship(check, path):
    assert [one.message for one in check.iter_errors(tomllib.loads(path.read_text("utf-8")))] == []


@pytest.mark.parametrize("kind", TEMPLATES)
def test_always_it_accepts_the_scenes_to_start_from(check, kind):
    assert check.is_valid(tomllib.loads(read_template(kind)))


@pytest.mark.parametrize("right, wrong", WRONG.values(), ids=WRONG)
def test_refuses_what_the_program_refuses(check, right, wrong):
    text = RIG.replace(right, wrong, 1)
    assert not check.is_valid(tomllib.loads(text)) and check.is_valid(tomllib.loads(RIG))
    with pytest.raises(SceneError):
        loads(text)


@pytest.mark.parametrize("kind", UNIT_FACTORS)
def test_exact_a_quantity_is_what_the_unit_table_reads(kind):
    """Every unit of every kind, with each spelling of micro, powers and products: both read it or neither does."""
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


def test_always_every_key_says_what_it_means():
    made = make_schema()
    for table in (made, *made["$defs"].values()):
        for one in (table, *table.get("anyOf", ())):
            for key, found in one.get("properties", {}).items():
                assert found.get("description") or "$ref" in str(found), key


def test_exact_a_law_is_described_with_the_keys_that_the_program_asks_for():
    """What a scene with nothing but the law's name is told to be missing is what its description names."""
    keys = make_schema()["$defs"]["Friction"]["properties"]
    told = keys["law"]["description"].replace(" or stiffness", "")
    named = {
        law: set(words.split(", "))
        for law, words in re.findall(r"'([\w-]+)' needs ([\w, ]+)", told)
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
