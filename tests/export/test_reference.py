"""Reference page of keys, effects and measures: it agrees with the records in the code and is complete."""

import pytest
from pydantic import BaseModel
from reference import joint_laws, limits, records
from reference.keys import FILE, Equations, format_effects, iterate_tables, text
from scene_texts import SMALL_PATCH, STRUCTURE

from patchfem import SceneError
from patchfem.effects import EFFECTS, LAWS
from patchfem.response import TABLE as MOTION
from patchfem.runs import TABLE as STATIC
from patchfem.scene import MATERIALS, UNIT_FACTORS, find_meaning, loads, parse_quantity
from patchfem.scene.keys.lookup import is_table_or_value
from patchfem.scene.keys.types import attributes_by_key, find_inner_table, find_key_record

PAGE = text()


def value_keys() -> list:
    """Return (model, key) of all keys that hold a value instead of a table."""
    return [
        (model, key)
        for _, model in iterate_tables()
        for key, name in attributes_by_key(model).items()
        if find_inner_table(model, name) is None or is_table_or_value(model, name)
    ]


def table_cells(header: str) -> list:
    """Return the rows of the table under a header, as lists of cells."""
    body = PAGE.split(f"\n### {header}\n")[1].split("\n#")[0]
    lines = [line for line in body.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line[1:-1].split(" | ")] for line in lines[2:]]


def test_exact_committed_pages_agree_with_records():
    """The committed reference pages equal the pages that are generated from the records."""
    for page in (records.MeasuresPage, records.MaterialsPage, limits, Equations, joint_laws):
        assert page.FILE.read_text("utf-8") == page.text(), "run python tests/support/reference"
    assert FILE.read_text("utf-8") == PAGE, "run python tests/support/reference"


def test_always_every_key_has_description():
    """Every key has a description without a full stop; a required key has no condition."""
    for model, key in value_keys():
        description = find_meaning(model, key)
        assert (
            description and not description.endswith(".") and description == description.strip()
        ), (model, key)
        condition = find_key_record(model, key).required
        assert condition == condition.strip().rstrip(".")
        assert not (
            condition and model.model_fields[attributes_by_key(model)[key]].is_required()
        ), (
            model,
            key,
        )


def test_refuses_key_without_description():
    """A key without a description raises KeyError with the name of the key."""

    class Table(BaseModel):
        """A table with a key that has no description."""

        angle: float

    with pytest.raises(KeyError, match=r"no record of Table\.angle"):
        find_meaning(Table, "angle")


def test_exact_reference_is_complete():
    """The reference contains all tables, effects, materials, measures and units, and its example values are valid."""
    for header, _ in iterate_tables():
        assert not header or f"`{header}`" in PAGE, header
    for page, names in (
        (format_effects(), [name for name in EFFECTS if "structure.interface." not in name]),
        (records.MaterialsPage.text(), MATERIALS),
        (records.MeasuresPage.text(), [*STATIC, *MOTION]),
    ):
        for name in names:
            assert f"| `{name}` |" in page, name
    for kind, units in UNIT_FACTORS.items():
        row = next(line for line in PAGE.splitlines() if line.startswith(f"| {kind} | `"))
        assert all(f"`{unit}`" in row for unit in units)
        # the example of this kind of quantity
        parse_quantity(row.split('`"')[1].split('"`')[0], kind)


def test_exact_rows_state_kind_limits_and_default():
    """The rows of the reference state the kind, limits, default and condition of a key."""
    rows = {key: cells for key, *cells in table_cells("`[contact]`")}
    assert rows["`length`"][:3] == ["length, > 0", "", "yes"]
    assert rows["`pairs`"][:3] == ["whole number, >= 1, <= 1000000", "1", ""]
    assert rows["`plane`"][:2] == ["`strain`, `stress`", "`strain`"]
    assert rows["`load`"][2] == "unless [contact.approach] is given"
    rows = {key: cells for key, *cells in table_cells("`[friction]`")}
    assert rows["`reference_speed`"][:3] == ["velocity, > 0", "", "with law `tanh`"]
    assert rows["`breakaway`"][:2] == ["number, >= 0, <= 1", "0"]
    rows = {key: cells for key, *cells in table_cells("`[drive]`")}
    assert rows["`levels`"][0] == "list of accelerations, >= 0"
    assert rows["`from`"][2] == "with waveform `sweep`"
    assert table_cells("`[[structure.spring]]`")[0][:2] == [
        "`between`",
        "pair of whole numbers, >= 0, <= 1000000",
    ]
    assert {key for key, *_ in table_cells("`[[structure.interface]]`")} == {
        "`between`",
        "`lateral`",
        "`load`",
    }


def read_limit_cells(title: str) -> dict:
    """Return the cells of a table of the page of limits, by law and heading."""
    lines = limits.FILE.read_text("utf-8").split(f"\n## {title}\n")[1].split("\n#")[0].splitlines()
    header, _, *rows = [
        [cell.strip() for cell in line[1:-1].split(" | ")] for line in lines if line.startswith("|")
    ]
    return {
        (row[0], name): cell for row in rows for name, cell in zip(header[1:], row[1:], strict=True)
    }


def test_exact_page_of_limits_agrees_with_refusals():
    """Scenes are refused where the page of limits states "no", with the message it gives, and accepted elsewhere."""
    cells = (
        read_limit_cells("Laws in a rig")
        | read_limit_cells("Laws in a rig, continued")
        | read_limit_cells("Methods")
    )
    assert {law.partition(",")[0] for law, _ in cells} == set(LAWS)
    refusals = {}
    for _, columns in limits.TABLES:
        refusals |= limits.find_refusals(columns)
    lugre = 'stiffness = "1e7 N/m"\nstribeck_speed = "1 mm/s"\n'
    shapes_below = "shapes on the lower piece"
    for law, friction_keys, column, sets, extra_tables in (
        ("coulomb", "", "`[contact.shear]`", [], "[contact.shear]\n"),
        ("lugre", lugre, "`[contact.shear]`", [], "[contact.shear]\n"),
        ("tanh", 'reference_speed = "1 mm/s"\n', shapes_below, ["contact.tilt.on=lower"], ""),
        ("nonlocal", 'bond_length = "1 um"\n', shapes_below, ["contact.tilt.on=lower"], ""),
    ):
        text = f'{SMALL_PATCH}{extra_tables}[friction]\nlaw = "{law}"\nstatic = 0.3\n{friction_keys}{STRUCTURE}'
        cell = cells[law, column]
        try:
            loads(text, sets=sets)
            assert cell == "yes"
        except SceneError as error:
            message = str(error).rpartition(": ")[2]
            assert cell == "no" and refusals[law, column][0].rpartition(": ")[2] == message
            assert message in limits.format_messages()
    assert cells["coulomb", "`exact`"] == "yes" and cells["tanh", "`exact`"] == "no"


def test_always_page_of_limits_has_integer_bounds():
    """The page of limits states the bounds of all keys with whole numbers."""
    page = limits.FILE.read_text("utf-8")
    for header, model in iterate_tables():
        for key, name in attributes_by_key(model).items():
            if model.model_fields[name].annotation is int:
                assert f"| `{header.strip('[]')}.{key}` | whole number, >= " in page, key
