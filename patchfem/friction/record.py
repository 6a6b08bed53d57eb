"""From the keys of [friction] to the law object: the record in `effects` names the module of every law."""

from importlib import import_module
from math import inf

from ..effects import LAWS, law_has_trait


def law_from(friction, load: float = 1.0):
    """The law object of a [friction] table, for laws that need no other numbers than its keys.

    friction: the table in SI units; load [N] on the whole contact, to which a stiffness in the table refers. See
    `protocol` for what the object can do.
    """
    return import_module(LAWS[friction.law].module).from_keys(friction, load)


def held_stiffness(friction, load: float) -> float:
    """Tangential stiffness [N/m] of a law under a load [N] while nothing slips: infinite where it sticks rigidly, 0
    where it creeps."""
    if law_has_trait(friction.law, "creeps"):
        return 0.0
    if law_has_trait(friction.law, "bonds"):
        return friction.static * load / friction.bond_length
    if law_has_trait(friction.law, "averaged"):
        return inf
    one = law_from(friction, load).element(load)
    return one.limit / one.length if one.length else inf


def loop_from(friction, load: float, slide: float) -> tuple | None:
    """(force at the turns [N], area [J]) of the steady loop of a law under a load [N] at an amplitude of its slide [m],
    of laws that know it in closed form, else None."""
    known = getattr(import_module(LAWS[friction.law].module), "loop_from_keys", None)
    return None if known is None else known(friction, load, slide)
