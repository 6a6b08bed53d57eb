"""Friction laws as smooth motions between events; one file each.

A law has three functions of plain numbers and arrays, which `table_kernels` compiles:

- `force_and_rates(p, memory, point, s, rates)` writes the rates of its states `s`, and returns `records.Friction`.
- `write_margins(p, memory, point, s, margins)` writes its `records.Margin`; they are infinite before. A margin is
  positive within the regime of the law, and relative to the scales of the point.
- `switch(p, memory, point, s, which)` changes the regime after a margin has vanished; it returns whether the run ends.

They may call functions of their module that HELPERS lists. `p` are the numbers of the law, `memory` is a row of
`records.Memory`. Within a regime force and rates must be smooth. A law needs no tangent, no solver and no error formula.
`RIGID` says whether it rests without displacement. A law of a table [friction] has `from_law(law, load)`, which returns
its `records.LawNumbers` from the law of `friction.laws` and a mean load [N]. In a motion of the opposite sign the states
have the opposite sign, or the factors that STATE_SIGNS lists, and `memory[FLAG]` has the factor FLAG_SIGN, 1 by default.

A law that stores energy has an entry in `stored_energy.ENERGY_OF_LAW`. LAWS lists the modules; the number of a law is its
place. LAW_OF_NAME gives the module for each `friction.law`, by default that of its name, and VARYING_LAW_OF_NAME that under
a load that varies.
"""

from collections.abc import Sequence
from importlib import import_module
from math import inf

from ... import effects
from ...core import MIN_LOAD, PatchfemError
from ..records import LawNumbers, Memory, State

_PACKAGE_LAWS = (
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
    "tanh": "tanh",
    "elastic-plastic": "masing",
    "iwan": "masing",
    "bouc-wen": "bouc_wen",
    "lugre": "lugre",
    "nonlocal": "bonds",
}
_OWN_LAWS = [
    name
    for name, law in effects.LAWS.items()
    if "harmonic" in law.supports.split() and name not in LAW_OF_NAME
]
LAW_OF_NAME |= dict(zip(_OWN_LAWS, _OWN_LAWS))
LAWS = (*_PACKAGE_LAWS, *_OWN_LAWS)
VARYING_LAW_OF_NAME = {
    "coulomb": "coulomb",
    "tanh": "tanh",
    "elastic-plastic": "pressed_springs",
}
# Columns of the memory that change their sign with the motion, besides the reversal points
ODD_MEMORY = (
    Memory.DIRECTION,
    Memory.FORCE,
    Memory.SLIP_RATE,
    Memory.PULL,
    Memory.ORIGIN,
    Memory.BEFORE,
)


def make_law(name: str, law, load: float, *, varies: bool = False) -> LawNumbers:
    """Return a friction law in the form of this engine.

    Parameters
    ----------
    name : str
        Name of the law, `friction.law`.
    law : friction law per newton of load, or friction.bonds.parameters.Bonds
        Law as `friction.record.make_law` returns it.
    load : float
        Mean load [N].
    varies : bool
        Whether the load changes.

    Raises
    ------
    PatchfemError
        If the law does not exist under a load that varies.
    """
    table = VARYING_LAW_OF_NAME if varies else LAW_OF_NAME
    if name not in table:
        raise PatchfemError(
            f"law '{name}' under a normal load that varies is not computed from event to event; "
            f"use {', '.join(table)}",
            "friction.law",
        )
    module = import_module(f"{__name__}.{table[name]}")
    load = max(load, MIN_LOAD)
    at_rest = inf if module.RIGID else 0.0
    stiffness = law.static * load / law.length if law.length else at_rest
    return module.from_law(law, load)._replace(stiffness=stiffness)


def is_rigid(law: str) -> bool:
    """Return whether a law rests without displacement below its static friction."""
    return import_module(f"{__name__}.{law}").RIGID


def mirror_state(state: State, n_modes: int, laws: Sequence[LawNumbers]) -> None:
    """Give a motion under constant loads the opposite sign.

    Parameters
    ----------
    state : State
        The motion, which is changed.
    n_modes : int
        Number of modal coordinates, which stand first in `state.y`, before their velocities.
    laws : sequence of LawNumbers
        Laws of the interfaces, whose states follow.
    """
    first = 2 * n_modes
    state.y[:first] *= -1
    for law, memory in zip(laws, state.memory):
        module = import_module(f"{__name__}.{law.law}")
        last = first + len(law.states)
        state.y[first:last] *= getattr(module, "STATE_SIGNS", -1.0)
        first = last
        memory[Memory.FLAG] *= getattr(module, "FLAG_SIGN", 1.0)
        memory[list(ODD_MEMORY)] *= -1
        memory[Memory.STACK :] *= -1
