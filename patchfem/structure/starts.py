"""Initial conditions in the coordinates of a modal basis (report, 3.2: z = phi^T m^1/2 x)."""

import numpy as np

from ..core import InitialState, ModalBasis, PatchfemError, frozen_array


def start_at_rest(basis: ModalBasis, z=0.0) -> InitialState:
    """Return the initial state of a modal basis at rest with the coordinates z (n,) [m]."""
    zero = np.zeros_like(basis.omega)
    return InitialState(frozen_array(zero + z), frozen_array(zero))


def start_from_values(basis: ModalBasis, displacement=None, velocity=None) -> InitialState:
    """Convert initial values for the named modes or masses into the coordinates of a basis.

    Parameters
    ----------
    basis : ModalBasis
        Modes of the rig.
    displacement, velocity : (p,) array_like, optional
        Displacements [m] and velocities [m/s]; default: zeros.

    Returns
    -------
    InitialState

    Raises
    ------
    PatchfemError
        If the number of values is not that of the modes or masses.
    """
    z = _convert_to_coordinates(basis, displacement)
    v = _convert_to_coordinates(basis, velocity)
    return InitialState(frozen_array(z), frozen_array(v))


def _convert_to_coordinates(basis: ModalBasis, values) -> np.ndarray:
    """Return the coordinates (n,) in a basis for values (p,) that are prescribed for its modes or masses."""
    n = basis.omega.size
    if values is None:
        return np.zeros(n)
    values = np.asarray(values, float)
    n_named = n if basis.shapes is None else len(basis.shapes)
    if values.shape != (n_named,):
        raise PatchfemError(
            f"{values.size} values are given for {n_named} modes or masses; one value for each is needed",
            "structure.start",
        )
    if basis.shapes is None:
        return values
    return np.linalg.lstsq(basis.shapes, values, rcond=None)[0]


def start_from_output_displacement(basis: ModalBasis, displacement: float) -> InitialState:
    """Return the state at rest in which a static force displaces the output by `displacement` [m].

    The force acts there. The coordinates of the modal `basis` are proportional to output_i / omega_i^2. If rigid modes
    move the output, a force moves only these, in proportion to output_i.

    Raises
    ------
    PatchfemError
        If no mode moves the output.
    """
    is_rigid = (basis.omega == 0) & (basis.output != 0)
    if is_rigid.any():
        shape = np.where(is_rigid, basis.output, 0.0)
    else:
        none = np.zeros_like(basis.omega)
        shape = np.divide(basis.output, basis.omega**2, out=none, where=basis.omega > 0)
    output = float(shape @ basis.output)
    if output == 0:
        raise PatchfemError(
            "no mode moves the output point, so the structure cannot be released from a displacement "
            "of this point; give [structure.start]",
            "structure",
        )
    return start_at_rest(basis, displacement / output * shape)


def start_from_base_step(basis: ModalBasis, displacement: float) -> InitialState:
    """Return the initial state right after the base has jumped by a displacement X [m]: z = -X base.

    The masses have not moved yet, and displacements are relative to the base.

    z are the coordinates of the modal `basis` [m], and base their participations in the motion of the base.
    """
    return start_at_rest(basis, -displacement * basis.base)
