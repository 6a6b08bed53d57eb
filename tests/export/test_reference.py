"""The reference of keys, effects and measures: it agrees with the records it is made from, and leaves nothing out."""

import pytest
from pydantic import BaseModel
from reference import joint_laws, limits, records
from reference.keys import FILE, Equations, effects_table, tables, text
from scene_texts import SMALL_PATCH, STRUCTURE

from patchfem import SceneError
from patchfem.effects import EFFECTS, LAWS
from patchfem.response import TABLE as MOTION
from patchfem.runs import TABLE as STATIC
from patchfem.scene import MATERIALS, UNIT_FACTORS, find_meaning, loads, parse_quantity
from patchfem.scene.keys.lookup import is_table_or_value
from patchfem.scene.keys.types import attributes_by_key, find_inner_table, find_key_record

PAGE = text()


def plain() -> list:
    """(model, key) of every key that holds no table of its own."""
    return [
        (model, key)
        for _, model in tables()
        for key, name in attributes_by_key(model).items()
        if find_inner_table(model, name) is None or is_table_or_value(model, name)
    ]


def section(header: str) -> list:
    """The rows of the table under a header, as cells."""
    body = PAGE.split(f"\n### {header}\n")[1].split("\n#")[0]
    lines = [line for line in body.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line[1:-1].split(" | ")] for line in lines[2:]]


def test_exact_the_committed_file_is_what_the_records_say():
    for page in (records.Measures, records.Materials, limits, Equations, joint_laws):
        assert page.FILE.read_text("utf-8") == page.text(), "run python tests/support/reference"
    assert FILE.read_text("utf-8") == PAGE, "run python tests/support/reference"


def test_always_every_key_has_a_sentence_and_may_have_a_condition():
    for model, key in plain():
        said = find_meaning(model, key)
        assert said and not said.endswith(".") and said == said.strip(), (model, key)
        needed = find_key_record(model, key).required
        assert needed == needed.strip().rstrip(".")
        assert not (needed and model.model_fields[attributes_by_key(model)[key]].is_required()), (
            model,
            key,
        )


def test_refuses_a_key_without_a_sentence():
    class Table(BaseModel):
        angle: float

    with pytest.raises(KeyError, match=r"no record of Table\.angle"):
        find_meaning(Table, "angle")


def test_exact_nothing_is_left_out():
    for header, _ in tables():
        assert not header or f"`{header}`" in PAGE, header
    for page, names in (
        (effects_table(), [name for name in EFFECTS if "structure.interface." not in name]),
        (records.Materials.text(), MATERIALS),
        (records.Measures.text(), [*STATIC, *MOTION]),
    ):
        for name in names:
            assert f"| `{name}` |" in page, name
    for kind, units in UNIT_FACTORS.items():
        row = next(line for line in PAGE.splitlines() if line.startswith(f"| {kind} | `"))
        assert all(f"`{unit}`" in row for unit in units)
        parse_quantity(row.split('`"')[1].split('"`')[0], kind)  # its example


def test_exact_rows_say_kind_limits_default_and_what_needs_the_key():
    rows = {key: rest for key, *rest in section("`[contact]`")}
    assert rows["`length`"][:3] == ["length, > 0", "", "yes"]
    assert rows["`pairs`"][:3] == ["whole number, >= 1, <= 1000000", "1", ""]
    assert rows["`plane`"][:2] == ["`strain`, `stress`", "`strain`"]
    assert rows["`load`"][2] == "unless [contact.approach] is given"
    rows = {key: rest for key, *rest in section("`[friction]`")}
    assert rows["`reference_speed`"][:3] == ["velocity, > 0", "", "with law `tanh`"]
    assert rows["`breakaway`"][:2] == ["number, >= 0, <= 1", "0"]
    rows = {key: rest for key, *rest in section("`[drive]`")}
    assert rows["`levels`"][0] == "list of accelerations, >= 0"
    assert rows["`from`"][2] == "with waveform `sweep`"
    assert section("`[[structure.spring]]`")[0][:2] == [
        "`between`",
        "pair of whole numbers, >= 0, <= 1000000",
    ]
    assert {key for key, *_ in section("`[[structure.interface]]`")} == {
        "`between`",
        "`lateral`",
        "`load`",
    }


def limits_at(title: str) -> dict:
    """(law, heading) -> cell of a table of the page of limits."""
    lines = limits.FILE.read_text("utf-8").split(f"\n## {title}\n")[1].split("\n#")[0].splitlines()
    head, _, *rows = [
        [cell.strip() for cell in line[1:-1].split(" | ")] for line in lines if line.startswith("|")
    ]
    return {
        (row[0], name): cell for row in rows for name, cell in zip(head[1:], row[1:], strict=True)
    }


def test_exact_the_page_of_limits_says_what_a_scene_is_answered():
    """Of scenes written here anew: what it calls "no" is refused with its sentence, what it calls "yes" is not."""
    cells = (
        limits_at("Laws in a rig") | limits_at("Laws in a rig, continued") | limits_at("Methods")
    )
    assert {law.partition(",")[0] for law, _ in cells} == set(LAWS)
    said = {}
    for _, columns in limits.TABLES:
        said |= limits.refusals(columns)
    lugre = 'stiffness = "1e7 N/m"\nstribeck_speed = "1 mm/s"\n'
    lower = "shapes on the lower piece"
    for law, keys_of, beside, sets, more in (
        ("coulomb", "", "`[contact.shear]`", [], "[contact.shear]\n"),
        ("lugre", lugre, "`[contact.shear]`", [], "[contact.shear]\n"),
        ("tanh", 'reference_speed = "1 mm/s"\n', lower, ["contact.tilt.on=lower"], ""),
        ("nonlocal", 'bond_length = "1 um"\n', lower, ["contact.tilt.on=lower"], ""),
    ):
        text = f'{SMALL_PATCH}{more}[friction]\nlaw = "{law}"\nstatic = 0.3\n{keys_of}{STRUCTURE}'
        cell = cells[law, beside]
        try:
            loads(text, sets=sets)
            assert cell == "yes"
        except SceneError as error:
            message = str(error).rpartition(": ")[2]
            assert cell == "no" and said[law, beside][0].rpartition(": ")[2] == message
            assert message in limits.messages()
    assert cells["coulomb", "`exact`"] == "yes" and cells["tanh", "`exact`"] == "no"


def test_always_the_page_of_limits_has_every_bound_of_whole_numbers():
    page = limits.FILE.read_text("utf-8")
    for header, model in tables():
        for key, name in attributes_by_key(model).items():
            if model.model_fields[name].annotation is int:
                assert f"| `{header.strip('[]')}.{key}` | whole number, >= " in page, key
