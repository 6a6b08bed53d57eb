"""Traction and slip at the nodes of a patch in given states of its Jenkins elements."""

from typing import NamedTuple

import numpy as np


class ShearFields(NamedTuple):
    """Fields at m nodes in f states.

    - traction (f, m): shear traction [Pa].
    - local_slip (f, m): irreversible slip [m].
    """

    traction: np.ndarray
    local_slip: np.ndarray


def compute_element_fields(patch, elements, states, length: float) -> ShearFields:
    """Compute traction and slip at the nodes of a patch from the states of its Jenkins elements.

    Parameters
    ----------
    patch : Patch
        The pressed patch.
    elements : JenkinsSet
        Elements that are equivalent to its t yielding nodes.
    states : sequence
        f pairs of relative displacement [m] and stretches (t,) [m] of the elements.
    length : float
        Length of the elastic-plastic law [m], 0 for Coulomb's law.

    Returns
    -------
    ShearFields
    """
    weight = patch.pieces.interface.weight
    traction = np.zeros((len(states), patch.x.size))
    local_slip = np.zeros_like(traction)
    for i, (rel_disp, stretch) in enumerate(states):
        force = np.zeros(patch.x.size)
        force[elements.points] = elements.force_matrix @ stretch
        traction[i] = force / weight
        local_slip[i] = rel_disp - patch.slip_compliance @ force
        local_slip[i, elements.points] -= length * force[elements.points] / elements.limit
    return ShearFields(traction, local_slip)
