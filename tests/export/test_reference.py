"""Reference page of keys, effects and measures: it agrees with the records in the code and is complete."""

from reference import joint_laws, limits, records
from reference.keys import FILE, Equations, format_effects, iterate_tables, text
from scene_texts import SMALL_PATCH, STRUCTURE

from patchfem import SceneError
from patchfem.effects import EFFECTS, LAWS
from patchfem.export.quantities import QUANTITIES
from patchfem.response import INTERNAL_VALUES
from patchfem.response import TABLE as MOTION
from patchfem.runs import TABLE as STATIC
from patchfem.scene import MATERIALS, UNIT_FACTORS, loads, parse_quantity
from patchfem.scene.keys.types import list_keys

PAGE = text()


def value_keys() -> list:
    """Return all keys that hold a value instead of a table."""
    tables = (list_keys(model).values() for _, model in iterate_tables())
    return [key for keys in tables for key in keys if key.accepts_value]


def test_exact_committed_pages_agree_with_records():
    """The committed reference pages equal the pages that are generated from the records."""
    for page in (records.MeasuresPage, records.MaterialsPage, limits, Equations, joint_laws):
        assert page.FILE.read_text("utf-8") == page.text(), "run python tests/support/reference"
    assert FILE.read_text("utf-8") == PAGE, "run python tests/support/reference"


def test_always_every_key_has_description():
    """Every key has a description without a full stop; a required key has no condition."""
    for key in value_keys():
        description = key.record.meaning
        place = (key.table, key.name)
        assert description and not description.endswith("."), place
        assert description == description.strip(), place
        condition = key.record.required
        assert condition == condition.strip().rstrip(".")
        assert not (condition and key.field.is_required()), place


def test_exact_reference_is_complete():
    """The reference contains all tables, effects, materials, measures and units, and its example values are valid."""
    for header, _ in iterate_tables():
        assert not header or f"`{header}`" in PAGE, header
    for page, names in (
        (format_effects(), [name for name in EFFECTS if "structure.interface." not in name]),
        (records.MaterialsPage.text(), MATERIALS),
        (records.MeasuresPage.text(), [*STATIC, *(MOTION.keys() - INTERNAL_VALUES), *QUANTITIES]),
    ):
        for name in names:
            assert f"| `{name}` |" in page, name
    for kind, units in UNIT_FACTORS.items():
        row = next(line for line in PAGE.splitlines() if line.startswith(f"| {kind} | `"))
        assert all(f"`{unit}`" in row for unit in units)
        # the example of this kind of quantity
        parse_quantity(row.split('`"')[1].split('"`')[0], kind)


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
    assert cells["coulomb", "`exact`"] == "yes" and cells["tanh", "`exact`"] == "yes"
