"""Rules of [contact.grooves] and [normal.grooves]: their slope, and supported friction laws."""

from __future__ import annotations

from math import pi
from typing import Any

from ...effects import describe_law, law_has_trait, law_supports, needs_bond_list, suggest_laws
from ..keys import removed
from .methods import find_yaw_key, list_lower_shapes
from .rule_table import MistakeRule, TableFacts, apply_rules, make_unsupported_rule
from .scene_draft import SceneDraft


class GrooveFacts(TableFacts):
    """Properties of the scene that the checks of grooves use."""

    @property
    def law_table(self) -> Any:
        """Table [friction]."""
        return self.draft.tables.friction

    @property
    def law(self) -> str:
        """Name of the friction law as text."""
        return describe_law(self.law_table)

    @property
    def law_advice(self) -> str:
        """Advice on a friction law that does not support grooves."""
        return suggest_laws("grooves", friction=self.law_table)

    @property
    def has_bonds(self) -> bool:
        """Whether the law is a sum over bonds."""
        return law_has_trait(self.law_table.law, "bonds")

    @property
    def key_preventing_recursion(self) -> str:
        """Key of [friction] that prevents computing the sum over bonds by recursion, or "" if none does."""
        law = self.scene.friction
        if not self.has_bonds or not (needs_bond_list(self.law_table) or law.breakaway):
            return ""
        if law.reading == "report":
            return "reading"
        return "breakaway" if law.breakaway else "order"

    @property
    def is_removed_law(self) -> bool:
        """Whether an earlier version of patchfem could compute the law with grooves."""
        return (
            not self.key_preventing_recursion
            and self.law_table.law in removed.LAWS_REMOVED_OVER_GROOVES
        )

    @property
    def slope(self) -> float:
        """Steepest slope of the flanks."""
        return 2 * pi / self.wavelength * self.amplitude

    @property
    def static(self) -> float:
        """Coefficient of static friction."""
        return self.scene.friction.static

    @property
    def max_amplitude(self) -> float:
        """Amplitude [m] at which the flanks lock."""
        return 1 / (2 * pi / self.wavelength * self.static)

    @property
    def lower_shape(self) -> str:
        """Scene key of the first gap shape on the lower piece, or "" if it has none."""
        return next(iter(list_lower_shapes(self.draft.tables.contact)), "")


LOCKING_RULES = (
    MistakeRule(
        lambda g: g.static * g.slope >= 1,
        "{table_key}.amplitude",
        "{amplitude:.6g} m gives flanks of slope {slope:.6g}, on which the pieces lock with static = {static:g}: no "
        "force can move one piece over the flanks of the other; an amplitude below wavelength/(2 pi static) = "
        "{max_amplitude:.6g} m is needed, or a smaller `static`",
    ),
)
COMBINATION_RULES = (
    make_unsupported_rule(
        lambda g: g.key_preventing_recursion,
        "friction.{key_preventing_recursion}",
        "with [{table_key}]",
        "recursion",
    ),
    MistakeRule(
        lambda g: g.is_removed_law,
        "friction.law",
        "{law} with [{table_key}] was removed in patchfem 1.0; " + suggest_laws("grooves"),
    ),
    make_unsupported_rule(
        lambda g: (
            not g.key_preventing_recursion
            and not g.is_removed_law
            and not law_supports(g.law_table, "grooves")
        ),
        "friction.law",
        "{law} with [{table_key}]",
        "{law_advice}",
    ),
    make_unsupported_rule(
        lambda g: g.has_bonds and g.scene.accuracy.quadrature in ("direct", "truncated", "merged"),
        "accuracy.quadrature",
        "'{scene.accuracy.quadrature}' with [{table_key}]",
        "use 'recursion' or 'auto'",
    ),
    MistakeRule(
        lambda g: g.scene.accuracy.method == "harmonic" and g.scene.accuracy.harmonics,
        "accuracy.harmonics",
        "harmonic balance with [{table_key}] was removed in patchfem 1.0; leave `harmonics` out: method 'harmonic' then "
        "integrates in time until the motion repeats",
    ),
    make_unsupported_rule(
        lambda g: g.scene.contact.holder.tangential_stiffness,
        "contact.holder.tangential_stiffness",
        "with [{table_key}]",
        "out",
    ),
    make_unsupported_rule(
        lambda g: g.scene.contact.strips and (find_yaw_key(g.draft.tables) or g.compliance),
        "{table_key}",
        "with strips that yaw or are elastic",
        "either",
    ),
    MistakeRule(
        lambda g: g.load_change == "normal.amplitude",
        "normal.amplitude",
        "a normal load that oscillates over grooves was removed in patchfem 1.0; leave one of the two out",
    ),
    make_unsupported_rule(
        lambda g: g.load_change and g.load_change != "normal.amplitude",
        "{load_change}",
        "with [{table_key}]",
        "either",
    ),
    make_unsupported_rule(
        lambda g: g.lower_shape, "{lower_shape}", "'lower' with [{table_key}]", "shapes"
    ),
    make_unsupported_rule(
        lambda g: g.scene.structure.stiffening,
        "structure.stiffening",
        "with [{table_key}]",
        "either",
    ),
    make_unsupported_rule(
        lambda g: g.scene.structure.bonded.wavelength,
        "structure.bonded.wavelength",
        "with [{table_key}]",
        "either",
    ),
)


def check_grooves(draft: SceneDraft, kind: str) -> None:
    """Report mistakes in the grooves of a scene."""
    table_key = find_groove_key(draft)
    if not table_key or not kind:
        return
    if kind not in ("bench", "rig"):
        draft.add_mistake(
            table_key,
            f"[{table_key}] needs a sliding motion: add [friction] and [slide], or [structure] with [drive]",
        )
        return
    law = draft.tables.friction
    if law is None or law.law is None:
        return
    grooves = GrooveFacts(draft, table_key, find_groove_table(draft).table)
    apply_rules(draft, LOCKING_RULES, grooves)
    if kind == "bench" and grooves.lifted_mass:
        draft.add_remark(
            f"{table_key}.lifted_mass",
            "has no meaning with [slide], because a prescribed slide has no inertia, and is not used",
        )
    if grooves.amplitude:
        apply_rules(draft, COMBINATION_RULES, grooves)


def find_groove_key(draft: SceneDraft) -> str:
    """Return the key of the grooves of a scene, or "" if it has none."""
    for name in ("contact", "normal"):
        if draft.values[name].grooves:
            return f"{name}.grooves"
    return ""


def find_groove_table(draft: SceneDraft) -> Any:
    """Return the table of the grooves of a scene, or UNKNOWN_VALUE if it has none."""
    return draft.values.contact.grooves or draft.values.normal.grooves
