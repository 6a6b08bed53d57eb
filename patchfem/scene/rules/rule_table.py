"""Tables of rules: a row holds a condition, the key that causes the mistake, and the sentence shown.

A mistake goes one way to the screen: `apply_rules` hands the key and the sentence of a row to the `SceneDraft`, which
finds the line of the key. A new rule is a new row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property, partial
from typing import Any, NamedTuple

from ..keys.types import Table
from .methods import find_compliance_key, find_load_change_key
from .scene_draft import SceneDraft, find_value
from .view import TableView


class TableFacts(TableView):
    """Properties of the scene that the checks of one table use.

    Subclasses add what follows from the values as properties. The tables do not change while rules are applied, so that
    a property which several rules use is a `cached_property`.

    Parameters
    ----------
    draft : SceneDraft
    table_key : str
        Dotted key of the table, such as "contact" or "structure.interface.0.contact".
    table : Table or None
        The table as far as it could be read.
    """

    def __init__(self, draft: SceneDraft, table_key: str, table: Table | None) -> None:
        super().__init__(table)
        self.draft = draft
        self.table_key = table_key
        self._written = draft.written_value(table_key)

    @property
    def scene(self) -> TableView:
        """All tables of the scene."""
        return self.draft.values

    @cached_property
    def load_change(self) -> str:
        """Name of the key that makes the load vary, or "" if the load is constant."""
        return find_load_change_key(self.draft.tables)

    @cached_property
    def compliance(self) -> str:
        """Key of the compliance that enables partial slip of the patch, or "" if there is none."""
        return find_compliance_key(self.table, self.draft.tables)

    def has(self, *names: str) -> bool:
        """Return whether the scene sets all of the given keys of the table."""
        for name in names:
            if find_value(self._written, name) is None:
                return False
        return True

    def has_any(self, *names: str) -> bool:
        """Return whether the scene sets at least one of the given keys of the table."""
        return any(map(self.has, names))


class Rule(NamedTuple):
    """Rule for a table: a condition, and the message that is shown if it holds.

    - report: method of `SceneDraft` that takes the key and the sentence.
    - condition: function of the facts that is true where the sentence applies.
    - key: dotted key to which the sentence belongs. `{name}` in it, and in the sentence, stands for a fact.
    - sentence: what is wrong, why, and which key to set.
    """

    report: Callable
    condition: Callable
    key: str
    sentence: str


MistakeRule = partial(Rule, SceneDraft.add_mistake)
MissingKeyRule = partial(Rule, SceneDraft.add_missing)
RemarkRule = partial(Rule, SceneDraft.add_remark)


def apply_rules(draft: SceneDraft, rules: Iterable[Rule], facts: Any) -> None:
    """Report the message of every rule whose condition holds.

    Parameters
    ----------
    draft : SceneDraft
        Receives the reports.
    rules : iterable of Rule
    facts : mapping
        Argument of the conditions, and values of the names in braces.
    """
    for rule in rules:
        if rule.condition(facts):
            rule.report(draft, rule.key.format_map(facts), rule.sentence.format_map(facts))
