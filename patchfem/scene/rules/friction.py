"""Rules of the friction law's own sub-keys: a surface temperature, the spread of its bonds."""

from __future__ import annotations

from ...effects import either, has, takes, using
from ..keys.contact import Contact
from ..keys.tables import Friction, Interface
from .methods import changing_load, climbed
from .scene_draft import LAWS, Draft, _needs


def check_spread(draft: Draft, at: str, law: Friction) -> None:
    """Say a spread beside a law without bonds, or over a width that is not known."""
    if law.spread is None:
        return
    if not takes(law.law, "spread"):
        draft.say(
            f"{at}.spread",
            f"law '{law.law}' has no spread; laws with a spread are {using('spread')}",
        )
    elif at == "friction" and draft.tables.normal is not None and not draft.given("normal.width"):
        draft.lacks("normal.width", "friction.spread needs this key")


def remark_temperature(draft: Draft, at: str, law: Friction) -> None:
    """Remark a surface temperature that changes no growth."""
    if temperature_unused(law):
        lacking = "activation temperatures; add rest_activation, slip_activation or both"
        if law.rest_growth is None:
            lacking = "keys for the growth of the bonds; add rest_growth and slip_growth"
        draft.remark(f"{at}.temperature has no effect without {lacking}")


def temperature_unused(law: Friction) -> bool:
    """Whether a surface temperature stands where it changes no growth."""
    if law.temperature is None or not has(law.law, "bonds"):
        return False
    still = not law.temperature.rest_activation and not law.temperature.slip_activation
    return still or (law.rest_growth is None and law.slip_growth is None)


def _frictions(draft: Draft) -> None:
    if draft.tables.friction is not None:
        _friction(draft, "friction", draft.tables.friction, draft.tables.contact)
    if draft.tables.structure is not None:
        for index, interface in enumerate(draft.tables.structure.interface or ()):
            _friction(draft, f"structure.interface.{index}", interface, interface.contact)


def _friction(draft: Draft, at: str, law: Friction, contact: Contact | None) -> None:
    _needs(draft, at, law, "law", LAWS)
    if draft.given(f"{at}.kinetic") and not takes(law.law, "kinetic"):
        draft.say(
            f"{at}.kinetic",
            f"law '{law.law}' has only one coefficient of friction; laws with a kinetic "
            f"coefficient are {using('kinetic')}",
        )
    elif law.kinetic is not None and law.static is not None and law.kinetic > law.static:
        draft.say(
            f"{at}.kinetic",
            f"{law.kinetic} is larger than static = {law.static}; kinetic <= static is needed",
        )
    elif kinetic_unused(law):
        draft.remark(
            f"{at}.kinetic has no effect while the bond length is constant; add rest_growth and slip_growth"
        )
    if rest_speed_unused(law):
        draft.remark(
            f"{at}.rest_speed has no effect while the bond length is constant; add rest_growth and "
            "slip_growth"
        )
    check_spread(draft, at, law)
    remark_temperature(draft, at, law)
    for key, other in (("rest_growth", "slip_growth"), ("slip_growth", "rest_growth")):
        if draft.given(f"{at}.{key}") and not draft.given(f"{at}.{other}"):
            draft.lacks(
                f"{at}.{other}",
                f"{key} needs this key; for a constant bond length leave out both keys",
            )
    printed = law.reading != "stretch" or has(law.law, "averaged")
    if law.order is not None and (law.order <= -1 or (law.order < 0 and not printed)):
        wanted = ">= 0 (reading 'stretch')" if not printed else "> -1 (reading 'report')"
        wanted = "> -1" if has(law.law, "averaged") else wanted
        draft.say(f"{at}.order", f"must be {wanted}, not {law.order}")
    if law.breakaway and law.reading == "report":
        draft.say(
            f"{at}.breakaway",
            "reading 'report' has no breakaway; use reading = 'stretch' or leave `breakaway` out",
        )
    if either(law.law) and law.stiffness is not None:
        _stretches(draft, at, contact)
    if law.static == 0 and law.stiffness is not None and takes(law.law, "stiffness"):
        draft.say(
            f"{at}.static", f"must be > 0 with law '{law.law}', whose springs need a slip force"
        )
    soft = (
        law.gives_way
        if isinstance(law, Interface)
        else contact.gives_way
        if contact is not None
        else ""
    )
    if law.static == 0 and soft:
        draft.say(f"{at}.static", f"must be > 0 with {soft}, because at static = 0 no point carries friction; raise "
                                  f"static or leave out {soft}")  # fmt: skip


def _stretches(draft: Draft, at: str, contact: Contact | None) -> None:
    """Say a stiffness beside a load that changes or is not given."""
    cause = changing_load(draft.tables) or climbed(draft.tables)
    if cause:
        draft.say(
            f"{at}.stiffness",
            f"{cause} changes the load, and the number of springs in contact changes with the "
            "load; give bond_length in place of stiffness",
        )
    elif contact is not None and contact.load is None and contact.approach is not None:
        draft.say(
            f"{at}.stiffness",
            "needs a known load, but [contact.approach] prescribes a distance; give "
            "bond_length in place of stiffness, or contact.load in place of "
            "[contact.approach]",
        )


def kinetic_unused(law: Friction) -> bool:
    """Whether a smaller kinetic coefficient stands where no bond ever changes its length."""
    weaker = law.kinetic is not None and law.static is not None and law.kinetic < law.static
    return weaker and has(law.law, "bonds") and law.rest_growth is None and law.slip_growth is None


def rest_speed_unused(law: Friction) -> bool:
    """Whether a floor under the speed stands where no bond ages at rest."""
    return law.rest_speed is not None and takes(law.law, "rest_speed") and law.rest_growth is None
