"""Compiled loops of the march: one for each combination of contact, laws and type of load.

`loop_kernels` runs with any contact, `interfaces.element_kernels` and its solver with any law. A law passed to a compiled
function as an argument cannot be cached on disk, so `compiled.instantiate` writes the loop once per law instead.
"""

from functools import cache

from ... import compiled
from ..interfaces.dispatch import COULOMB_LAW, load_law

PACKAGE = "dynamics.march"
# Module of the contact of bond lists that are coupled by shear modes.
SHEARED_LISTS_MODULE = "dynamics.interfaces.shear_list_kernels"
# Types of load: constant, varying resultant on the interface, varying load on each point.
CONSTANT_LOAD = ""
COMMON_LOAD = "whole"
POINT_LOADS = "points"


@cache
def load_contact(kind: tuple):
    """Load the compiled functions for a kind of contact (contact module, law module)."""
    contact, law = kind
    if contact == SHEARED_LISTS_MODULE:
        return compiled.instantiate(
            contact,
            {
                "solver": compiled.instantiate(
                    "dynamics.interfaces.shear_solve_kernels",
                    {"law": compiled.load("dynamics.interfaces.shear_lists_kernels")},
                )
            },
        )
    if not law:
        return compiled.load(contact)
    law = compiled.load(law)
    solver = compiled.instantiate("dynamics.interfaces.element_solve_kernels", {"law": law})
    return compiled.instantiate(contact, {"law": law, "solver": solver})


@cache
def load_loop(
    kind: tuple,
    laws: tuple = (),
    load: str = CONSTANT_LOAD,
    *,
    has_contact: bool = True,
    is_coupled: bool = False,
):
    """Load the compiled loop of a march, which has the functions `march` and `follow`.

    Parameters
    ----------
    kind : tuple of str
        Modules of the contact and of its law.
    laws : tuple of str
        Modules of the laws of the elements.
    load : str
        CONSTANT_LOAD, COMMON_LOAD or POINT_LOADS.
    has_contact : bool
        Whether there is a contact.
    is_coupled : bool
        Whether there is more than one element or contact.

    Returns
    -------
    KernelModule
    """
    contact = load_contact(kind)
    named = {}
    flags = {
        "HAS_ELEMENTS": bool(laws),
        "HAS_STOPS": COULOMB_LAW in laws,
        "HAS_SLOPES": {*laws} > {COULOMB_LAW} or COULOMB_LAW not in laws,
        "HAS_CONTACT": has_contact,
        "IS_COUPLED": is_coupled,
        "LOAD_VARIES": load != CONSTANT_LOAD,
        "HAS_POINTS": load == POINT_LOADS,
        "HAS_LISTS": kind[0] == SHEARED_LISTS_MODULE,
    }
    text = '"""Parts of a loop, written by patchfem.dynamics.march.instances."""\n\n' + "".join(
        f"{name} = {value}\n" for name, value in flags.items()
    )
    parts = compiled.write_kernel_module(
        f"{PACKAGE}.parts_{compiled.hash_text(text)}_kernels", text
    )
    if laws:
        law = load_law(laws)
        named["coupling"] = compiled.instantiate(
            f"{PACKAGE}.faces_kernels",
            {
                "law": law,
                "contact": contact,
                "parts": parts,
                "solver": compiled.instantiate(
                    "dynamics.interfaces.element_solve_kernels", {"law": law}
                ),
                "together": compiled.instantiate(f"{PACKAGE}.together_kernels", {"law": law}),
            },
        )
    if load != CONSTANT_LOAD:
        named["pressing"] = compiled.instantiate(
            f"{PACKAGE}.pressing_kernels", {"contact": contact, "parts": parts} | named
        )
    return compiled.instantiate(
        f"{PACKAGE}.loop_kernels", {"contact": contact, "parts": parts} | named
    )


def march(model, *arguments) -> tuple:
    """March a model by its compiled loop; return the number of completed steps and a status code.

    The loop is `march` of `loop_kernels`, compiled for the contact and the laws of the model. With the environment variable
    NUMBA_DISABLE_JIT=1 the same source runs in Python.

    Parameters
    ----------
    model : ContactModel, joints.JointsModel or varying_load.VaryingLoadModel
    *arguments
        Those of the loop.

    Returns
    -------
    n_steps : int
    status : int
        Value of `MarchStatus`.
    """
    has_contact = not model.joints or getattr(model, "patch", None) is not None
    loop = load_loop(
        model.kind,
        model.laws,
        model.loading,
        has_contact=has_contact,
        # Several laws of elements are combined in one loop.
        is_coupled=len(model.joints) + has_contact > 1 or len(model.laws) > 1,
    )
    return loop.march(*arguments)


def follow_path(path, dt, kind, contact, goal, energies, forces) -> int:
    """Move a contact along a prescribed path of relative displacement by its compiled loop.

    Parameters
    ----------
    path : (k,) array
        Slides [m].
    dt : float
        Length of a step [s].
    kind : tuple of str
        Modules of the contact and of its law.
    contact : tuple
        Arrays of a contact.
    goal : float
        Residual of a step relative to the friction limit.
    energies : (k, 2) array
        See `loop_kernels.follow`; output.
    forces : (k, 3) array
        See `loop_kernels.follow`; output.

    Returns
    -------
    int
        Number of steps that failed.
    """
    return load_loop(kind).follow(path, float(dt), contact, float(goal), energies, forces)
