"""Friction law averaged over a patch, for a prescribed displacement or a sliding block.

In: a model with law 'convolution' and its pressed patch. Out: the law object, the limit force
over mu_s N, and tractions.
"""

import numpy as np

from ...core import PatchfemError
from ...effects import describe_unsupported, import_effect, law_has_trait

# Largest relative difference of the limit forces in both directions that counts as zero.
EQUAL_LIMITS_TOL = 1e-9


def _averaged_law_module():
    """Return the module of the averaged friction law, imported on first use."""
    return import_effect("friction.law=convolution")


def make_averaged_law(model, patch):
    """Return the averaged friction law of a model on its patch.

    patch: None under [normal].
    """
    f = model.friction
    law = _averaged_law_module()
    if patch is None:
        return law.Convolution(f.static, f.bond_length, f.order)

    pattern = patch.pressure.sigma_n if model.side == "lower" else None
    return law.Convolution(f.static, f.bond_length, f.order, patch.x, pattern)


def rigid_limit_ratio(model, patch) -> float:
    """Return the ratio of the friction limit of a rigid block to static coefficient x load [1].

    Raises
    ------
    PatchfemError
        If the limit differs between the two directions of sliding.
    """
    f = model.friction
    if patch is None or not law_has_trait(f.law, "averaged"):
        return 1.0
    weight = patch.pieces.interface.weight
    sigma = patch.pressure.sigma_n
    forward, back = _averaged_law_module().sliding_limits(
        patch.x, sigma, weight, f.bond_length, f.order
    )
    if abs(forward - back) > EQUAL_LIMITS_TOL * max(forward, back):
        raise PatchfemError(
            describe_unsupported(
                f"law '{f.law}' with a pressure that is not symmetric (slip force {forward * f.static:.6g} N forward, "
                f"{back * f.static:.6g} N back)",
                "make the patch symmetric, or prescribe the slide with a table [slide]",
            ),
            "friction.law",
        )
    return (forward + back) / 2 / patch.pressure.load


def limit_tractions(model, patch, force) -> np.ndarray:
    """Distribute the friction force of a fully slipping rigid block over its nodes as tractions.

    The tractions are proportional to the averaged pressure in the direction of the force.

    Parameters
    ----------
    model : Model
    patch : Patch
    force : (f,)
        Resultant forces [N].

    Returns
    -------
    (f, m)
        Tractions [Pa].
    """
    friction = model.friction
    x = patch.x
    sigma = patch.pressure.sigma_n
    weight = patch.pieces.interface.weight
    unit_tractions = []
    for direction in (1.0, -1.0):
        average = _averaged_law_module().average_pressure(
            x, x, sigma, direction, friction.bond_length, friction.order
        )
        traction = np.where(sigma > 0, average, 0.0)
        unit_tractions.append(traction / max(weight @ traction, 1e-300))
    return np.array([value * unit_tractions[0 if value >= 0 else 1] for value in force])
