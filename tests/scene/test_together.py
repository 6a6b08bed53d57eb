"""Each row of the rules across tables names keys that exist, and reports a scene that fulfils its condition."""

import pytest

from patchfem.scene.keys.contact import Contact
from patchfem.scene.keys.lookup import find_key
from patchfem.scene.keys.tables import Tables
from patchfem.scene.keys.types import build_table
from patchfem.scene.rules import together
from patchfem.scene.rules.check import find_kind
from patchfem.scene.rules.scene_draft import SceneDraft

ROWS = (
    together.MISTAKE_RULES
    | together.REMARK_RULES
    | together.MISSING_KEY_RULES
    | together.MISSING_TABLE_RULES
)


def write_plain_values(condition: str) -> dict:
    """Return the plain values of a scene that has the keys of a condition."""
    raw = {}
    for clause in condition.split(" & "):
        keys, _, words = clause.partition("=")
        key = keys.split("|")[0]
        if key != "kind" and not key.startswith("!"):
            *tables, name = key.split(".")
            table = raw
            for piece in tables:
                table = table.setdefault(piece, {})
            table.setdefault(name, words.split("|")[0] if words else {})
    return raw


@pytest.mark.parametrize("condition", ROWS)
def test_reports_each_row_at_its_first_key(condition):
    """Keys and words of a row are those of a scene; a scene with its keys is reported with its sentence."""
    condition_of_contact = condition.replace("patch.", "contact.")
    for clause in condition_of_contact.split(" & "):
        keys, _, words = clause.lstrip("!").partition("=")
        for key in keys.split("|"):
            known = find_key(key)
            assert key == "kind" or known is not None, key
            assert known is None or not words or set(words.split("|")) <= {*known.allowed}, clause

    draft = SceneDraft("a.toml", "", write_plain_values(condition_of_contact))
    draft.tables = build_table(Tables, {"contact": build_table(Contact, {})})
    together.check_together(draft, find_kind(draft))
    first = condition_of_contact.split(" & ")[0].lstrip("!").partition("=")[0]
    reports = [*draft.mistake_lines(), *draft.remarks]
    assert any(first in line and ROWS[condition] in line for line in reports), reports
