"""The reference of keys, effects and measures: it agrees with the records it is made from, and leaves nothing out."""

import pytest

from patchfem.effects import EFFECTS
from patchfem.export.reference import FILE, tables, text
from patchfem.response.rows import TABLE as MOTION
from patchfem.runs.results.patch_rows import TABLE as STATIC
from patchfem.scene.keys import meanings
from patchfem.scene.keys.materials import MATERIALS
from patchfem.scene.keys.meanings import CONDITIONS, MEANINGS, meaning
from patchfem.scene.keys.quantities import KINDS, parse
from patchfem.scene.keys.types import keys, kind_of, model_of
from patchfem.scene.reader import is_value, owner_of

PAGE = text()


def plain() -> list:
    """(model, key) of every key that holds no table of its own."""
    return [(model, key) for _, model in tables() for key, name in keys(model).items()
            if model_of(model, name) is None or is_value(model, name)]


def section(header: str) -> list:
    """The rows of the table under a header, as cells."""
    body = PAGE.split(f"\n### {header}\n")[1].split("\n#")[0]
    lines = [line for line in body.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line[1:-1].split(" | ")] for line in lines[2:]]


def test_exact_the_committed_file_is_what_the_records_say():
    assert FILE.read_text("utf-8") == PAGE, "run python -m patchfem.export.reference"


def test_always_every_key_has_a_sentence_and_no_sentence_lacks_its_key():
    for model, key in plain():
        said = meaning(model, key)
        assert said and not said.endswith(".") and said == said.strip(), (model, key)
    models = {model.__name__: model for _, model in tables()}
    for table, said in MEANINGS.items():
        model = models.get(table)
        assert set(said) <= set(keys(model) if model else ("name", "young", "poisson", "density")), table
    for path in CONDITIONS:
        assert owner_of(path)[0] is not None, path


def test_refuses_a_key_without_a_sentence(monkeypatch):
    monkeypatch.setitem(meanings.MEANINGS, "Tilt", {"on": "the piece"})
    with pytest.raises(KeyError, match=r"Tilt\.angle in scene/keys/meanings"):
        text()


def test_exact_nothing_is_left_out():
    for header, _ in tables():
        assert not header or f"`{header}`" in PAGE, header
    for name in (*MATERIALS, *STATIC, *MOTION, *(name for name in EFFECTS if "structure.interface." not in name)):
        assert f"| `{name}` |" in PAGE, name
    for kind, units in KINDS.items():
        row = next(line for line in PAGE.splitlines() if line.startswith(f"| {kind} | `"))
        assert all(f"`{unit}`" in row for unit in units)
        parse(row.split('`"')[1].split('"`')[0], kind)  # its example


def test_exact_rows_say_kind_limits_default_and_what_needs_the_key():
    rows = {key: rest for key, *rest in section("`[contact]`")}
    assert rows["`length`"][:3] == ["length, > 0", "", "yes"]
    assert rows["`pairs`"][:3] == ["whole number, >= 1, <= 1000000", "1", ""]
    assert rows["`plane`"][:2] == ["`strain`, `stress`", "`strain`"]
    assert rows["`load`"][2] == "unless [contact.approach]"
    rows = {key: rest for key, *rest in section("`[friction]`")}
    assert rows["`reference_speed`"][:3] == ["velocity, > 0", "", "law `tanh`"]
    assert rows["`breakaway`"][:2] == ["number, >= 0, <= 1", "0"]
    rows = {key: rest for key, *rest in section("`[drive]`")}
    assert rows["`levels`"][0] == "list of acceleration, >= 0" and rows["`from`"][2] == "waveform `sweep`"
    assert section("`[[structure.spring]]`")[0][:2] == ["`between`", "pair of whole number, >= 0, <= 1000000"]
    assert {key for key, *_ in section("`[[structure.interface]]`")} == {"`between`", "`load`"}


def test_always_a_table_has_as_many_cells_as_its_head():
    blocks = [block.splitlines() for block in PAGE.split("\n\n") if block.startswith("|")]
    assert len(blocks) > 30
    for block in blocks:
        assert len({line.replace("\\|", "").count("|") for line in block}) == 1, block[0]


def test_exact_items_of_an_array_go_by_number_or_name():
    for path in ("structure.mode.0.frequency", "structure.mode.axial.frequency", "structure.mode.name.frequency"):
        assert kind_of(*owner_of(path)) == "frequency"
    assert kind_of(*owner_of("drive.levels.2")) == kind_of(*owner_of("drive.levels")) == "acceleration"
    assert owner_of("structure.mode.axial.frequenzy")[0] is None and owner_of("contact.tillt")[0] is None
