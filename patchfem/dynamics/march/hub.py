"""The compiled loops by the contact that they meet: an instance of one text per contact and law.

`loop_kernels` runs with any contact, `contacts.element_kernels` and its solver with any law. A law passed to a compiled
function as an argument is never found on disk again, so `compiled.instance` writes the loop once per law instead.
"""

from functools import cache

from ... import compiled
from ..plant import Plant

HERE = "dynamics.march"
SOLVES = "dynamics.grooves.element_kernels",  # contacts of any law that solve their step themselves


@cache
def contact_of(kind: tuple):
    """The compiled contact of a ContactModel's kind (contact, law)."""
    contact, law = kind
    if not law:
        return compiled.load(contact)
    law = compiled.load(law)
    if contact in SOLVES:
        return compiled.instance(contact, {"law": law})
    solver = compiled.instance("dynamics.contacts.element_solve_kernels", {"law": law})
    return compiled.instance(contact, {"law": law, "solver": solver})


@cache
def loop_of(kind: tuple):
    """The loop of one interface with the contact of this kind: its `march` and `follow`."""
    return compiled.instance(f"{HERE}.loop_kernels", {"contact": contact_of(kind)})


def march(kind: tuple, *arguments) -> tuple:
    """`loop_kernels.march` with the contact of this kind: (steps done, status)."""
    return loop_of(kind).march(*arguments)


def follow_path(path, dt, kind, contact, work, goal, energies, forces) -> int:
    """`loop_kernels.follow` with the contact of this kind; work: nothing. The steps that failed."""
    return loop_of(kind).follow(path, float(dt), contact, float(goal), energies, forces)


__all__ = ["Plant", "contact_of", "follow_path", "loop_of", "march"]
