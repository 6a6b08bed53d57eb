"""From the keys of [friction] to the law object: the record in `effects` names the module of every law."""

from importlib import import_module

from ..effects import LAWS


def law_from(friction, load: float = 1.0):
    """The law object of a [friction] table, for laws that need no other numbers than its keys.

    friction: the table in SI units; load [N] on the whole contact, to which a stiffness in the table refers. See
    `protocol` for what the object can do.
    """
    return import_module(LAWS[friction.law].module).from_keys(friction, load)


def loop_from(friction, load: float, slide: float) -> tuple | None:
    """(force at the turns [N], area [J]) of the steady loop of a law under a load [N] at an amplitude of its slide [m],
    of laws that know it in closed form, else None."""
    known = getattr(import_module(LAWS[friction.law].module), "loop_from_keys", None)
    return None if known is None else known(friction, load, slide)
