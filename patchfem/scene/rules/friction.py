"""Rules of [friction] and of the law of an interface."""

from ...effects import law_has_trait, law_takes_key
from ..keys.tables import Friction
from .facts import TableFacts
from .scene_draft import SceneDraft
from .view import TableView


def check_laws(draft: SceneDraft) -> None:
    """Report mistakes inside [friction] of a draft and inside the laws of its interfaces."""
    laws = {"friction": draft.tables.friction}
    for index, interface in enumerate(draft.values.structure.interface):
        laws[f"structure.interface.{index}"] = interface.table
    for table_key, table in laws.items():
        if table is not None:
            law = TableFacts(draft, table_key, table)
            unused = find_unused_law_keys(table)
            _check_coefficients(law, unused)
            _check_bonds(law, unused)


def _check_coefficients(law: TableFacts, unused: list[str]) -> None:
    """Report coefficients of friction that exclude each other or the other keys of the law.

    `unused` are the keys that have no meaning for this law.
    """
    # A kinetic coefficient of a law that has none is reported as a key without meaning.
    if law_takes_key(law.table.law, "kinetic") or not law.has("kinetic"):
        if law.kinetic > law.static:
            law.add_mistake(
                "kinetic",
                f"{law.kinetic} is larger than static = {law.static}; kinetic <= static is needed",
            )
        elif "kinetic" in unused:
            law.add_remark("kinetic", CONSTANT_LENGTH_REMARK)
    if law.static == 0 and law.stiffness and law_takes_key(law.table.law, "stiffness"):
        law.add_mistake(
            "static", f"must be > 0 with law '{law.law}', whose springs need a slip force"
        )


# Remark on a key that has no effect
CONSTANT_LENGTH_REMARK = (
    "has no effect while the bond length is constant; add rest_growth and slip_growth"
)


def _check_bonds(law: TableFacts, unused: list[str]) -> None:
    """Report keys of the bonds of a law that are impossible, missing or without effect.

    `unused` are the keys that have no meaning for this law.
    """
    if "rest_speed" in unused:
        law.add_remark("rest_speed", CONSTANT_LENGTH_REMARK)
    if "temperature" in unused:
        missing = "activation temperatures; add rest_activation, slip_activation or both"
        if not law.rest_growth:
            missing = "keys for the growth of the bonds; add rest_growth and slip_growth"
        law.add_remark("temperature", f"has no effect without {missing}")

    # Bonds of the average pressure have no stretch, so that their order has the limit of reading 'report'.
    is_averaged = law_has_trait(law.table.law, "averaged")
    needed = "> -1" if is_averaged else "> -1 (reading 'report')"
    is_wrong = law.order <= -1
    if law.reading == "stretch" and not is_averaged:
        needed = ">= 0 (reading 'stretch')"
        is_wrong = law.order < 0
    if is_wrong:
        law.add_mistake("order", f"must be {needed}, not {law.order}")

    # A spread needs the width of the pad.
    if law.spread and law_takes_key(law.table.law, "spread"):
        if law.table_key != "friction" and not law.contact:
            law.add_missing("contact", "spread needs the width of a patch")
        elif law.table_key == "friction" and law.scene.normal and not law.draft.has("normal.width"):
            law.draft.add_missing("normal.width", "friction.spread needs this key")


def find_unused_law_keys(law: Friction) -> list[str]:
    """Return the keys of a law of bonds that have no effect because their length is constant or does not grow at rest."""
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
