"""Rules of the friction law's own sub-keys: a surface temperature, the spread of its bonds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from patchfem.scene_tables import Friction

if TYPE_CHECKING:
    from patchfem.scene_rules import Draft


def check_spread(draft: Draft, at: str, law: Friction) -> None:
    """Say a spread beside a law without bonds, or over a width that is not known."""
    if law.spread is None:
        return
    if law.law not in ("nonlocal", "convolution", None):
        draft.say(f"{at}.spread", f"law '{law.law}' has no bonds to spread; spread belongs to nonlocal and convolution")
    elif at == "friction" and draft.tables.normal is not None and not draft.given("normal.width"):
        draft.lacks("normal.width", "friction.spread needs it")


def remark_temperature(draft: Draft, at: str, law: Friction) -> None:
    """Remark a surface temperature that changes no growth."""
    if temperature_unused(law):
        lacking = "its activations; add rest_activation, slip_activation or both"
        if law.rest_growth is None:
            lacking = "growth of the bonds; add rest_growth and slip_growth"
        draft.remark(f"{at}.temperature has no effect without {lacking}")


def temperature_unused(law: Friction) -> bool:
    """Whether a surface temperature stands where it changes no growth."""
    if law.temperature is None or law.law != "nonlocal":
        return False
    still = not law.temperature.rest_activation and not law.temperature.slip_activation
    return still or (law.rest_growth is None and law.slip_growth is None)
