"""Single patches pressed by a holder, as records of nodal stresses."""

from typing import NamedTuple

import numpy as np

from patchfem.contact import Holders, press_patch
from patchfem.contact.press import Pressed
from patchfem.core import Compliance, Interface, Outcome


class PressedPatch(NamedTuple):
    """Pressed patch: pressures (m,) [Pa], gap (m,) [m], motion and loads of the holder."""

    sigma_n: np.ndarray
    gap: np.ndarray
    approach: float
    rotation: float
    load: float
    moment: float
    outcome: Outcome


def press_by_holder(pieces: Compliance, gap, holder: Holders, rotation=0.0) -> PressedPatch:
    """Press two bare pieces by a holder, with a rotation that the gap contains."""
    state = press_patch(pieces, gap, holder)
    load = float(state.force.sum())
    return PressedPatch(
        state.force / pieces.interface.weight,
        state.gap,
        state.approach,
        rotation + state.turn,
        load,
        float(state.force @ pieces.interface.x),
        Outcome.DONE if load > 0 else Outcome.NO_CONTACT,
    )


def press(pieces, gap, load, moment=np.nan, rotation=0.0, spring=0.0) -> PressedPatch:
    """Press two bare pieces under a load, and a moment about a free rotation."""
    holder = Holders(load, moment=np.nan if moment is None else moment, spring=spring)
    return press_by_holder(pieces, gap, holder, rotation)


def press_to_approach(pieces, gap, approach) -> PressedPatch:
    """Press two bare pieces to a prescribed approach."""
    return press_by_holder(pieces, gap, Holders(np.nan, approach))


def solve_forces(c, x, gap, target) -> Pressed:
    """Solve the contact problem of a patch that is given as NumPy arrays.

    Parameters
    ----------
    c : (m, m) ndarray
        Compliance [m/N].
    x, gap : (m,) ndarray
        Positions [m] and gap [m].
    target : (0,), (1,) or (2,) ndarray
        Nothing with the approach contained in the gap, load [N], or load and moment [N m].
    """
    pieces = Compliance(Interface(x, np.ones(x.size), 1.0), c, c)
    load, moment = np.append(target, [np.nan, np.nan])[:2]
    return press_patch(pieces, gap, Holders(load, np.nan if target.size else 0.0, moment))
