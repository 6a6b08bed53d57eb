"""From the keys of [friction] to the law object: the record in `effects` names the module of every law."""

from importlib import import_module

from ..effects import LAWS


def law_from(friction, load: float = 1.0):
    """The law object of a [friction] table, of laws that have no other numbers than its keys; load [N] on the whole
    contact, of which a stiffness in the table is. See `protocol` for what it can do."""
    return import_module(LAWS[friction.law].module).from_keys(friction, load)
