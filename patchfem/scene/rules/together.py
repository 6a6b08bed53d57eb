"""Keys that need, exclude or idle beside keys of other tables: one row of together.toml for each such case.

A row is a condition and its sentence. The clauses of a condition are joined by `&`: `structure.mode` holds where the scene
has this key or table, `friction|wear` where it has one of them, `!structure.file` where it does not, and
`drive.kind=force|free` where the key has one of these values; `kind` is the kind of the scene, and `patch` stands for
[contact] and for the patch of each interface. The first clause names the key of the message; with several keys it stands
for one row each. What a table needs by its own selectors stands in `keys.choices`, and what no run can compute together in
`support`.
"""

from __future__ import annotations

import tomllib
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from ...effects import GAP_SHAPES, LAWS, WAVEFORMS, law_takes_stiffness_or_length
from ..keys.values import TomlValue
from .contact import iterate_patches
from .scene_draft import SceneDraft

_TABLES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
# What the names in braces stand for. The angle of a tilt depends on the piece, also where nothing slides.
_NAMES = {
    "laws_with_stiffness_or_length": filter(law_takes_stiffness_or_length, LAWS),
    "waveforms_besides_sine": (name for name, wave in WAVEFORMS.items() if not wave.is_sine),
    "shapes": (f"contact.{name}.on" for name in GAP_SHAPES if name != "tilt"),
}
_WORDS = {name: "|".join(words) for name, words in _NAMES.items()}


def _list_rows(table: str) -> dict[str, str]:
    """Return the rules of a table of together.toml as {condition: sentence}.

    A condition that begins with several keys, such as "a|b=1", is a rule for each of them: "a=1" and "b=1".
    """
    rows = {}
    for condition, sentence in _TABLES[table].items():
        first, *others = condition.format_map(_WORDS).split(" & ")
        keys, equals, values = first.partition("=")
        for key in keys.split("|"):
            rows[" & ".join([key + equals + values, *others])] = sentence
    return rows


MISTAKE_RULES = _list_rows("mistakes")
REMARK_RULES = _list_rows("remarks")
MISSING_TABLE_RULES = _list_rows("missing_tables")
MISSING_KEY_RULES = _list_rows("missing")


def check_together(draft: SceneDraft, kind: str) -> None:
    """Add to a draft all keys that need or exclude keys of other tables, or that have no effect beside them.

    `kind` is the kind of scene. Each row of the tables MISTAKE_RULES, REMARK_RULES, MISSING_TABLE_RULES and
    MISSING_KEY_RULES is a condition, such as a key and its value, with a sentence.
    """
    patches = [key for key, _ in iterate_patches(draft)]
    for rows, report in (
        (MISTAKE_RULES, draft.add_mistake),
        (REMARK_RULES, draft.add_remark),
        (MISSING_TABLE_RULES, draft.add_missing_table),
        (MISSING_KEY_RULES, draft.add_missing),
    ):
        for condition, sentence in rows.items():
            for patch in patches if "patch." in condition else [""]:
                condition_here = condition.replace("patch.", f"{patch}.")
                if holds(draft, kind, condition_here):
                    report(_split_condition(condition_here)[0].keys[0], sentence)


def holds(draft: SceneDraft, kind: str, condition: str) -> bool:
    """Return whether all clauses of a condition hold in a scene.

    Parameters
    ----------
    draft : SceneDraft
        Scene with its written values.
    kind : str
        Kind of the scene.
    condition : str
        Clauses such as "drive.kind=force & !structure.file", which means a force drive and no structure file.
    """
    for clause in _split_condition(condition):
        written = (kind if key == "kind" else draft.written_value(key) for key in clause.keys)
        if clause.is_negated == any(clause.accepts(value) for value in written):
            return False
    return True


class _Clause(NamedTuple):
    """Clause of a condition on the keys of a scene.

    - is_negated: whether the clause must not hold.
    - keys: dotted keys, of which one must be given.
    - values: values that this key must have, () for any.
    """

    is_negated: bool
    keys: tuple[str, ...]
    values: tuple[str, ...]

    def accepts(self, written: TomlValue | None) -> bool:
        """Return whether the clause, without its `!`, holds for the written value of a key."""
        return written is not None and (not self.values or str(written) in self.values)


@lru_cache(4096)
def _split_condition(condition: str) -> list[_Clause]:
    """Return the clauses of a condition."""
    clauses = []
    for text in condition.split(" & "):
        keys, _, values = text.removeprefix("!").partition("=")
        names = tuple(filter(None, values.split("|")))
        clauses.append(_Clause(text.startswith("!"), tuple(keys.split("|")), names))
    return clauses
