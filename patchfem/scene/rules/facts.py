"""A table of a scene as its rules see it: values, what was written, and where mistakes are reported."""

from functools import cached_property

from ..keys.types import Table
from .methods import find_compliance_key, find_load_change_key
from .scene_draft import SceneDraft, find_value
from .view import TableView


class TableFacts(TableView):
    """View of a table to which its rules report mistakes and remarks.

    Parameters
    ----------
    draft : SceneDraft
        Scene that is being read, to which mistakes are added.
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
        """Return whether the scene sets at least one of the given keys of the table."""
        return any(find_value(self._written, name) is not None for name in names)

    def add_mistake(self, key: str, sentence: str) -> None:
        """Add a mistake at a key of the table.

        The sentence says what is wrong, and what to do.
        """
        self.draft.add_mistake(f"{self.table_key}.{key}", sentence)

    def add_missing(self, key: str, reason: str = "") -> None:
        """Add a missing key of the table as a mistake.

        The reason says what needs it.
        """
        self.draft.add_missing(f"{self.table_key}.{key}", reason)

    def add_remark(self, key: str, sentence: str) -> None:
        """Add a remark on a key of the table; `sentence` follows the name of the key."""
        self.draft.add_remark(f"{self.table_key}.{key}", sentence)
