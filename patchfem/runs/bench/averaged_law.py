"""Friction law with a spatially averaged pressure, for a bench run or a rigidly sliding block.

In: a model with law 'convolution' and its Patch with the static contact solution. Out: the averaged pressure, the ratio
of the slip force to mu_s N, and nodal tractions.
"""

import numpy as np

from ...core import PatchfemError
from ...effects import describe_unsupported, import_effect, law_has_trait

# Largest relative difference between the slip forces forward and backward that counts as zero.
EQUAL_FRICTION_LIMITS_TOL = 1e-9


def _import_averaged_law():
    """Import the module of the averaged friction law, which is loaded only if a scene needs it."""
    return import_effect("friction.law=convolution")


def find_tractions(model, patch, direction: float, offset: float = 0.0) -> np.ndarray:
    """Return the averaged pressure (m,) [Pa] at the loaded nodes of the upper piece, or 0 at open nodes.

    The law averages the pressure over the part of the surface that the node has just passed, that is, behind it in the
    direction of the motion.

    Parameters
    ----------
    model : Model
        Model with a law whose pressure is averaged along the motion.
    patch : Patch
        Solved patch, whose pressure is averaged.
    direction : float
        Sign of the motion.
    offset : float
        Displacement [m] of the upper piece over the pressure, which ends where the lower piece does.
    """
    friction = model.friction
    x = patch.x
    sigma = patch.pressure.sigma_n
    average = _import_averaged_law().average_pressure(
        x + offset, x, sigma, direction, friction.bond_length, friction.order
    )
    return np.where(np.interp(x + offset, x, sigma, left=0.0, right=0.0) > 0, average, 0.0)


def slip_force_ratio(model, patch) -> float:
    """Return the ratio of the force at which a rigid block slips to static coefficient times load.

    It is 1 unless the law averages the pressure along the slide, as the law 'convolution' does.

    Raises
    ------
    PatchfemError
        If the slip force differs between the two directions of sliding.
    """
    f = model.friction
    if patch is None or not law_has_trait(f.law, "averaged"):
        return 1.0
    weight = patch.pieces.interface.weight
    sigma = patch.pressure.sigma_n
    forward, back = _import_averaged_law().sliding_limits(
        patch.x, sigma, weight, f.bond_length, f.order
    )
    if abs(forward - back) > EQUAL_FRICTION_LIMITS_TOL * max(forward, back):
        raise PatchfemError(
            describe_unsupported(
                f"law '{f.law}' with a pressure that is not symmetric (slip force {forward * f.static:.6g} N forward, "
                f"{back * f.static:.6g} N back)",
                "make the patch symmetric, or prescribe the slide with a table [slide]",
            ),
            "friction.law",
        )
    return (forward + back) / 2 / patch.pressure.load


def distribute_slip_force(model, patch, forces, offsets) -> np.ndarray:
    """Distribute the friction force of a slipping rigid block over its nodes.

    The tractions are proportional to the pressure averaged in the direction of the force.

    Parameters
    ----------
    model : Model
        Model with a law whose pressure is averaged along the motion.
    patch : Patch
        Solved patch, which gives nodes and pressure.
    forces, offsets : (f,)
        Resultant forces [N], and displacements [m] of the upper piece over the pressure.

    Returns
    -------
    (f, m)
        Tractions [Pa].
    """
    tractions = np.zeros((len(forces), patch.x.size))
    for row, force, offset in zip(tractions, forces, offsets):
        traction = find_tractions(model, patch, 1.0 if force >= 0 else -1.0, offset)
        row += force * traction / max(patch.pieces.interface.weight @ traction, 1e-300)
    return tractions
