"""Initial conditions in the coordinates of a basis (report, 3.2: z = phi^T m^1/2 x)."""

import numpy as np

from ..core import ModalBasis, PatchfemError, Start, frozen_array


def at_rest(basis: ModalBasis) -> Start:
    """Start at rest in n coordinates: nothing is displaced and nothing moves."""
    zero = frozen_array(np.zeros(basis.omega.size))
    return Start(zero, zero)


def from_values(basis: ModalBasis, displacement=None, velocity=None) -> Start:
    """Start from displacements [m] and velocities [m/s] (p,) of the scene's own modes or masses; None: zeros.

    They are turned into the coordinates of the basis by its `shapes`. PatchfemError for another count than p.
    """
    return Start(
        *(frozen_array(_coordinates(basis, values)) for values in (displacement, velocity))
    )


def _coordinates(basis: ModalBasis, values) -> np.ndarray:
    n = basis.omega.size
    if values is None:
        return np.zeros(n)
    values, own = np.asarray(values, float), n if basis.shapes is None else len(basis.shapes)
    if values.shape != (own,):
        raise PatchfemError(
            f"structure.start: {values.size} values are given for {own} modes or masses; one value for "
            "each is needed"
        )
    if basis.shapes is None:
        return values
    return (
        np.linalg.lstsq(basis.shapes, values, rcond=None)[0]
        if own != n
        else np.linalg.solve(basis.shapes, values)
    )


def from_output_displacement(basis: ModalBasis, displacement: float) -> Start:
    """Start at rest with the output moved by `displacement` [m], in the shape that a static force at the output gives.

    One mode: it alone. Several: z_i proportional to output_i / omega_i^2; where rigid modes move the output, a force
    moves them alone, z_i proportional to output_i. PatchfemError where no mode moves the output.
    """
    rigid = (basis.omega == 0) & (basis.output != 0)
    shape = np.zeros(basis.omega.size)
    if rigid.any():
        shape[rigid] = basis.output[rigid]
    else:
        moving = basis.omega > 0
        shape[moving] = basis.output[moving] / basis.omega[moving] ** 2
    reach = float(shape @ basis.output)
    if reach == 0:
        raise PatchfemError(
            "structure: no mode moves the output point, so the structure cannot be released from a "
            "displacement of this point; give [structure.start]"
        )
    return Start(frozen_array(displacement / reach * shape), frozen_array(np.zeros(shape.size)))


def from_base_step(basis: ModalBasis, displacement: float) -> Start:
    """Start in the instant after the base has jumped by `displacement` X [m], z = -X base.

    What the base carries stays where it was.
    """
    return Start(frozen_array(-displacement * basis.base), frozen_array(np.zeros(basis.omega.size)))
