"""The averaged law on a patch: along a prescribed slide, and as the constant limit of a rigid block on a rig."""

import numpy as np

from ...core import PatchfemError
from ...effects import import_effect, law_has_trait, not_supported_message

ALIKE = 1e-9  # relative difference of the limits forward and backward that counts as none


def _law():
    return import_effect("friction.law=convolution")


def law_on(model, patch):
    """The law of a bench scene; patch None for [normal]."""
    f, law = model.friction, _law()
    if patch is None:
        return law.Convolution(f.static, f.bond_length, f.order)

    pattern = patch.pressure.sigma_n if model.side == "lower" else None
    return law.Convolution(f.static, f.bond_length, f.order, patch.x, pattern)


def limit_share(model, patch) -> float:
    """Limit force of a rigid block over mu_s N [1]: below 1 for the averaged law on a patch, else 1.

    PatchfemError where it differs between the two ways of the slide.
    """
    f = model.friction
    if patch is None or not law_has_trait(f.law, "averaged"):
        return 1.0
    weight, sigma = patch.pieces.interface.weight, patch.pressure.sigma_n
    forward, back = _law().limits(patch.x, sigma, weight, f.bond_length, f.order)
    if abs(forward - back) > ALIKE * max(forward, back):
        raise PatchfemError(
            not_supported_message(
                f"law '{f.law}' with a pressure that is not symmetric (slip force {forward * f.static:.6g} N forward, "
                f"{back * f.static:.6g} N back)",
                "make the patch symmetric, or prescribe the slide with a table [slide]",
            ),
            "friction.law",
        )
    return (forward + back) / 2 / patch.pressure.load


def limit_tractions(model, patch, force) -> np.ndarray:
    """Tractions (f, m) [Pa] of resultants force (f,) [N] of a rigid block: the averaged pressure of their way."""
    f, x = model.friction, patch.x
    sigma, weight = patch.pressure.sigma_n, patch.pieces.interface.weight
    average = _law().average
    shape = [
        np.where(sigma > 0, average(x, x, sigma, way, f.bond_length, f.order), 0.0)
        for way in (1.0, -1.0)
    ]
    one = [part / max(weight @ part, 1e-300) for part in shape]
    return np.array([value * one[0 if value >= 0 else 1] for value in force])
