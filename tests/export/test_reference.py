"""Reference page of keys, effects and measures: it agrees with the records in the code and is complete."""

from reference import joint_laws, limits, records
from reference.keys import FILE, Equations, format_effects, iterate_tables, text

from patchfem.effects import EFFECTS
from patchfem.export.quantities import QUANTITIES
from patchfem.measures import INTERNAL_VALUES
from patchfem.measures import MOTION_TABLE as MOTION
from patchfem.runs import PATCH_TABLE as STATIC
from patchfem.scene import MATERIALS, UNIT_FACTORS, parse_quantity
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
