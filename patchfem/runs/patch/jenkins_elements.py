"""Parallel Jenkins elements of a patch with partial slip, cached for all runs of the patch.

In: a solved `Patch`, coefficient of friction and bond length. Out: a JenkinsSet (`partial_slip.shear_modes`), or
`PatchElements`.
"""

from typing import NamedTuple

import numpy as np

from ...contact import cell_edges, cells, stiffness
from ...partial_slip import first_loading, shear_modes
from . import store
from .press import Patch


class PatchElements(NamedTuple):
    """Parallel Jenkins elements of a patch, or of a band of its face.

    - stiffness, yield_displacement (t,): [N/m] and [m].
    - jenkins_set: the elements with their nodes or cells; None for a band and for an unloaded patch.
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray
    jenkins_set: "shear_modes.JenkinsSet | None" = None


def elements(patch: Patch, static: float, length: float) -> "shear_modes.JenkinsSet":
    """Return the parallel Jenkins elements of a patch whose nodes yield at their friction limits.

    The limit of a node is the coefficient of friction times its normal force.

    Parameters
    ----------
    patch : Patch
        Solved patch.
    static : float
        Coefficient of static friction.
    length : float
        Length [m] of the bonds in series with the pieces; 0 for Coulomb's law.
    """

    def make():
        """Make the elements, which the cache keeps for all runs of the patch."""
        if patch.model.area is not None:
            return first_loading.make_cell_elements(*soften_cells(patch, static, length))
        limit = static * patch.normal_stress * patch.pieces.interface.weight
        return shear_modes.make_jenkins_set(patch.slip_compliance, limit, length)

    return store.get_or_compute(("elements", patch, static, length), make)


def soften_cells(
    patch: Patch, static: float, length: float
) -> "tuple[cells.CellCompliance, np.ndarray]":
    """Return the shear compliance of the cells of a face with the bonds of a law, and their friction limits (ny, nx) [Pa].

    Parameters
    ----------
    patch : Patch
        Pressed face.
    static : float
        Coefficient of friction.
    length : float
        Bond length [m], or 0.
    """
    limit = static * np.reshape(patch.normal_stress, patch.shape)
    return add_bonds(patch.slip_compliance, limit, length), limit


def make_elements(patch: Patch, static: float, length: float) -> PatchElements:
    """Return the parallel Jenkins elements of a patch; without load it has one element, which yields at once.

    Parameters
    ----------
    patch : Patch
        Solved patch.
    static : float
        Coefficient of static friction [1].
    length : float
        Length [m] of the bonds in series with the pieces; 0 for Coulomb's law.
    """
    if not (static > 0 and patch.pressure.load > 0):
        return PatchElements(np.ones(1), np.zeros(1))
    found = elements(patch, static, length)
    return PatchElements(found.stiffness, found.yield_displacement, found)


def add_bonds(
    compliance: "cells.CellCompliance", limit: np.ndarray, length: float
) -> "cells.CellCompliance":
    """Return the shear compliance of cells in series with the bonds of a law.

    Parameters
    ----------
    compliance : CellCompliance
        Shear compliance of the cells.
    limit : (ny, nx) ndarray
        Friction limits [Pa].
    length : float
        Displacement of the bonds [m] at which a cell reaches its limit; 0 for rigid friction.
    """
    if not length:
        return compliance
    return compliance.soften(np.divide(length, limit, out=np.zeros(limit.shape), where=limit > 0))


def compute_stick_stiffness(patch: Patch, factor: float = 1.0, bond_length: float = 0.0) -> float:
    """Compute the tangential stiffness [N/m] of a loaded patch of which no node slips.

    Parameters
    ----------
    patch : Patch
        Solved patch.
    factor : float
        Factor of the shear compliance.
    bond_length : float
        Length of the bonds over the coefficient of friction [m]: a node with the normal force F has the spring
        F/bond_length in series with the pieces.
    """
    if patch.model.area is not None:
        pressure = np.reshape(patch.normal_stress, patch.shape)
        compliance = add_bonds(patch.slip_compliance.scale(factor), pressure, bond_length)
        return cell_edges.compute_contact_stiffness(compliance, pressure > 0)
    force = patch.normal_stress * patch.pieces.interface.weight
    points = np.flatnonzero(force > 0)
    nodal = factor * patch.slip_compliance[np.ix_(points, points)]
    nodal += np.diag(bond_length / force[points])
    return stiffness.tangential_stiffness(nodal, np.ones(points.size, bool))
