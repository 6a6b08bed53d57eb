"""Friction laws as smooth motions between events; one file each.

A law has three functions of plain numbers and arrays, which `table_kernels` compiles:

- `force_and_rates(p, memory, point, s, rates)` writes the rates of its states `s`, and returns `records.Friction`.
- `write_margins(p, memory, point, s, margins)` writes its `records.Margin`; they are infinite before. A margin is
  positive within the regime of the law, and relative to the scales of the point.
- `switch(p, memory, point, s, which)` changes the regime after a margin has vanished; it returns whether the run ends.

They may call functions of their module that HELPERS lists. `p` are the numbers of the law, `memory` is a row of
`records.Memory`. Within a regime force and rates must be smooth. A law needs no tangent, no solver and no error formula.
`RIGID` says whether it rests without displacement. A law of a table [friction] has `from_keys(friction, load, speed)`,
which returns its `records.LawNumbers` for a mean load [N] and an expected speed [m/s].

LAWS lists the modules; the number of a law is its place. LAW_OF_NAME gives the module for each `friction.law`, and
VARYING_LAW_OF_NAME that under a load that varies.
"""

from importlib import import_module

from ...core import PatchfemError
from ..records import LawNumbers

LAWS = (
    "coulomb",
    "tanh",
    "masing",
    "pressed_springs",
    "bouc_wen",
    "lugre",
    "bonds",
    "grooves",
    "smooth_grooves",
    "springs",
)
LAW_OF_NAME = {
    "coulomb": "coulomb",
    "convolution": "coulomb",
    "tanh": "tanh",
    "elastic-plastic": "masing",
    "iwan": "masing",
    "bouc-wen": "bouc_wen",
    "lugre": "lugre",
    "nonlocal": "bonds",
}
VARYING_LAW_OF_NAME = {
    "coulomb": "coulomb",
    "tanh": "tanh",
    "elastic-plastic": "pressed_springs",
}
MIN_LOAD = 1e-12  # load [N] in place of no load, to which a stiffness refers


def make_law(friction, load: float, speed: float, *, varies: bool = False) -> LawNumbers:
    """Return the law that the keys of a table [friction] define.

    Parameters
    ----------
    friction : table
        Keys in SI units.
    load : float
        Mean load [N].
    speed : float
        Expected peak speed [m/s], from which the rest speed of bonds follows.
    varies : bool
        Whether the load changes.

    Raises
    ------
    PatchfemError
        If the law does not exist under a load that varies.
    """
    table = VARYING_LAW_OF_NAME if varies else LAW_OF_NAME
    if friction.law not in table:
        raise PatchfemError(
            f"law '{friction.law}' under a normal load that varies is not computed from event to event; "
            f"use {', '.join(table)}",
            "friction.law",
        )
    return import_module(f"{__name__}.{table[friction.law]}").from_keys(
        friction, max(load, MIN_LOAD), speed
    )


def is_rigid(law: str) -> bool:
    """Return whether a law rests without displacement below its static friction."""
    return import_module(f"{__name__}.{law}").RIGID
