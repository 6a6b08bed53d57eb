"""Rules of [friction] and of the law of an interface."""

from __future__ import annotations

from functools import cached_property

from ...effects import (
    law_has_trait,
    law_takes_key,
    law_takes_stiffness_or_length,
)
from ..keys.contact import Contact
from ..keys.tables import Friction
from .methods import find_climbed_grooves
from .rule_table import MissingKeyRule, MistakeRule, RemarkRule, TableFacts, apply_rules
from .scene_draft import SceneDraft
from .view import TableView


class LawFacts(TableFacts):
    """Properties of the scene that the checks of a friction law use."""

    def __init__(
        self, draft: SceneDraft, table_key: str, law: Friction, contact: Contact | None
    ) -> None:
        super().__init__(draft, table_key, law)
        self.contact = TableView(contact)

    def has_key(self, key: str) -> bool:
        """Return whether the friction law has a given key."""
        return law_takes_key(self.table.law, key)

    def has_trait(self, trait: str) -> bool:
        """Return whether the law has a trait of `effects.LAWS[...].traits`."""
        return law_has_trait(self.table.law, trait)

    @cached_property
    def unused_keys(self) -> list[str]:
        """Keys without effect, because the length of the bonds is constant or does not grow at rest."""
        return find_unused_law_keys(self.table)

    @property
    def has_unsupported_kinetic(self) -> bool:
        """Whether the scene gives a kinetic coefficient for a law that does not use one."""
        return self.has("kinetic") and not self.has_key("kinetic")

    @property
    def is_kinetic_larger(self) -> bool:
        """Whether the kinetic coefficient is larger than the static one."""
        return not self.has_unsupported_kinetic and self.kinetic > self.static

    @property
    def order_requirement(self) -> str:
        """Condition on the bond order, as text for a message."""
        if self.has_trait("averaged"):
            return "> -1"
        return (
            ">= 0 (reading 'stretch')" if self.reading == "stretch" else "> -1 (reading 'report')"
        )

    @property
    def is_order_wrong(self) -> bool:
        """Whether the bond order is too small for the law."""
        is_strict = self.reading == "stretch" and not self.has_trait("averaged")
        return self.order <= -1 or (is_strict and self.order < 0)

    @property
    def missing_temperature_keys(self) -> str:
        """Missing keys without which a surface temperature has no effect, as a clause of a message."""
        if not self.rest_growth:
            return "keys for the growth of the bonds; add rest_growth and slip_growth"
        return "activation temperatures; add rest_activation, slip_activation or both"

    @property
    def has_unknown_springs(self) -> bool:
        """Whether `stiffness` is given for a law whose number of springs depends on the load."""
        return law_takes_stiffness_or_length(self.table.law) and bool(self.stiffness)

    @property
    def load_change_description(self) -> str:
        """Cause of the changing normal load, as text for a message."""
        return self.load_change or find_climbed_grooves(self.draft.tables)


LAW_RULES = (
    MistakeRule(
        lambda law: law.is_kinetic_larger,
        "{table_key}.kinetic",
        "{kinetic} is larger than static = {static}; kinetic <= static is needed",
    ),
    RemarkRule(
        lambda law: (
            not law.has_unsupported_kinetic
            and not law.is_kinetic_larger
            and "kinetic" in law.unused_keys
        ),
        "{table_key}.kinetic",
        "has no effect while the bond length is constant; add rest_growth and slip_growth",
    ),
    RemarkRule(
        lambda law: "rest_speed" in law.unused_keys,
        "{table_key}.rest_speed",
        "has no effect while the bond length is constant; add rest_growth and slip_growth",
    ),
    MissingKeyRule(
        lambda law: (
            law.spread
            and law.has_key("spread")
            and law.table_key == "friction"
            and law.draft.tables.normal is not None
            and not law.draft.has("normal.width")
        ),
        "normal.width",
        "friction.spread needs this key",
    ),
    RemarkRule(
        lambda law: "temperature" in law.unused_keys,
        "{table_key}.temperature",
        "has no effect without {missing_temperature_keys}",
    ),
    MistakeRule(
        lambda law: law.is_order_wrong,
        "{table_key}.order",
        "must be {order_requirement}, not {order}",
    ),
    MistakeRule(
        lambda law: law.has_unknown_springs and law.load_change_description,
        "{table_key}.stiffness",
        "{load_change_description} changes the load, and the number of springs in contact changes "
        "with the load; give bond_length in place of stiffness",
    ),
    MistakeRule(
        lambda law: (
            law.has_unknown_springs
            and not law.load_change_description
            and law.contact.approach
            and not law.contact.load
        ),
        "{table_key}.stiffness",
        "needs a known load, but [contact.approach] prescribes a distance; give bond_length in place of stiffness, or "
        "contact.load in place of [contact.approach]",
    ),
    MistakeRule(
        lambda law: law.static == 0 and law.stiffness and law.has_key("stiffness"),
        "{table_key}.static",
        "must be > 0 with law '{law}', whose springs need a slip force",
    ),
    MistakeRule(
        lambda law: law.static == 0 and law.compliance,
        "{table_key}.static",
        "must be > 0 with {compliance}, because at static = 0 no point carries friction; raise static or leave out "
        "{compliance}",
    ),
)


def check_laws(draft: SceneDraft) -> None:
    """Report mistakes inside [friction] and inside the laws of interfaces."""
    if draft.tables.friction is not None:
        _check_law(draft, "friction", draft.tables.friction, draft.tables.contact)
    for index, interface in enumerate(draft.values.structure.interface):
        law = interface.table
        _check_law(draft, f"structure.interface.{index}", law, law.contact)


def _check_law(draft: SceneDraft, table_key: str, law: Friction, contact: Contact | None) -> None:
    facts = LawFacts(draft, table_key, law, contact)
    apply_rules(draft, LAW_RULES, facts)


def find_unused_law_keys(law: Friction) -> list[str]:
    """Return the keys that have no effect on the bonds of a law, whose length is constant or does not grow at rest."""
    if not law_has_trait(law.law, "bonds"):
        return []
    bond = TableView(law)
    unused = {
        "temperature": law.temperature is not None
        and not (
            (bond.temperature.rest_activation or bond.temperature.slip_activation)
            and (law.rest_growth is not None or law.slip_growth is not None)
        ),
        "kinetic": bond.kinetic < bond.static and not (bond.rest_growth or bond.slip_growth),
        "rest_speed": law.rest_speed is not None and law.rest_growth is None,
    }
    return [key for key, is_unused in unused.items() if is_unused]
