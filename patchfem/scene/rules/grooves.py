"""Rules of [contact.grooves] and [normal.grooves]: their slope and their motion."""

from __future__ import annotations

from math import pi
from typing import Any

from .rule_table import MistakeRule, TableFacts, apply_rules
from .scene_draft import SceneDraft


class GrooveFacts(TableFacts):
    """Properties of the scene that the checks of grooves use."""

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


LOCKING_RULES = (
    MistakeRule(
        lambda g: g.static * g.slope >= 1,
        "{table_key}.amplitude",
        "{amplitude:.6g} m gives flanks of slope {slope:.6g}, on which the pieces lock with static = {static:g}: no "
        "force can move one piece over the flanks of the other; an amplitude below wavelength/(2 pi static) = "
        "{max_amplitude:.6g} m is needed, or a smaller `static`",
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


def find_groove_key(draft: SceneDraft) -> str:
    """Return the key of the grooves of a scene, or "" if it has none."""
    for name in ("contact", "normal"):
        if draft.values[name].grooves:
            return f"{name}.grooves"
    return ""


def find_groove_table(draft: SceneDraft) -> Any:
    """Return the table of the grooves of a scene, or UNKNOWN_VALUE if it has none."""
    return draft.values.contact.grooves or draft.values.normal.grooves
