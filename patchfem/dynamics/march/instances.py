"""The compiled loops by the faces that they meet: an instance of one text per contact, laws and load.

`loop_kernels` runs with any contact, `contacts.element_kernels` and its solver with any law. A law passed to a compiled
function as an argument is never found on disk again, so `compiled.instance` writes the loop once per law instead.
"""

from functools import cache

from ... import compiled
from ..interfaces.dispatch import COULOMB, law_of

HERE = "dynamics.march"
SHEARED_LISTS = "dynamics.interfaces.shear_list_kernels"  # lists of bonds behind shear modes
# loads: that stays; that changes, borne as a whole or point by point
STEADY, WHOLE, POINTS = (
    "",
    "whole",
    "points",
)


@cache
def contact_of(kind: tuple):
    """The compiled contact of a ContactModel's kind (contact, law)."""
    contact, law = kind
    if contact == SHEARED_LISTS:
        return compiled.instance(
            contact,
            {
                "solver": compiled.instance(
                    "dynamics.interfaces.shear_solve_kernels",
                    {"law": compiled.load("dynamics.interfaces.shear_lists_kernels")},
                )
            },
        )
    if not law:
        return compiled.load(contact)
    law = compiled.load(law)
    solver = compiled.instance("dynamics.interfaces.element_solve_kernels", {"law": law})
    return compiled.instance(contact, {"law": law, "solver": solver})


@cache
def loop_of(
    kind: tuple,
    laws: tuple = (),
    load: str = STEADY,
    there: bool = True,
    several: bool = False,
    plane: bool = False,
):
    """The loop of a rig: its `march` and `follow`. kind: of the contact; laws: modules of the elements beside it or in
    its place; load: STEADY, WHOLE or POINTS; there: whether the contact is; several: whether more than one rub; plane:
    whether any slides in a plane."""
    contact = contact_of(kind)
    named = {}
    flags = {
        "MANY": bool(laws),
        "STOPS": COULOMB in laws,
        "SMOOTH": {*laws} > {COULOMB} or COULOMB not in laws,
        "THERE": there,
        "SEVERAL": several,
        "PLANE": plane,
        "PRESSED": load != STEADY,
        "POINTED": load == POINTS,
        "LISTED": kind[0] == SHEARED_LISTS,
    }
    text = '"""Parts of a loop, written by patchfem.dynamics.march.instances."""\n\n' + "".join(
        f"{name} = {value}\n" for name, value in flags.items()
    )
    parts = compiled.written(f"{HERE}.parts_{compiled.digest(text)}_kernels", text)
    if laws:
        law = law_of(laws)
        named["faces"] = compiled.instance(
            f"{HERE}.faces_kernels",
            {
                "law": law,
                "contact": contact,
                "parts": parts,
                "solver": compiled.instance(
                    "dynamics.interfaces.element_solve_kernels", {"law": law}
                ),
                "together": compiled.instance(
                    f"{HERE}.together_kernels", {"law": law, "parts": parts}
                ),
            },
        )
    if load != STEADY:
        named["pressing"] = compiled.instance(
            f"{HERE}.pressing_kernels", {"contact": contact, "parts": parts} | named
        )
    return compiled.instance(f"{HERE}.loop_kernels", {"contact": contact, "parts": parts} | named)


def march(model, *arguments) -> tuple:
    """`loop_kernels.march` with the faces of a model: (steps done, status)."""
    there = not model.joints or getattr(model, "patch", None) is not None
    # a loop of several laws is one text
    several = len(model.joints) + there > 1 or len(model.laws) > 1
    plane = any(one.mate for one in model.joints)
    return loop_of(model.kind, model.laws, model.loading, there, several, plane).march(*arguments)


def follow_path(path, dt, kind, contact, goal, energies, forces) -> int:
    """Drive a contact of this kind along a prescribed path: `loop_kernels.follow`. Number of steps that failed.

    path (k,) [m] at steps of dt [s]; goal: relative residual of a step; energies and forces are filled.
    """
    return loop_of(kind).follow(path, float(dt), contact, float(goal), energies, forces)
