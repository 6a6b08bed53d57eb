"""Patches with asperity layers between two bodies."""

from dataclasses import replace

import numpy as np

from patchfem.contact import ExponentialAsperities, Holders, press_patch
from patchfem.core import Compliance, Interface


def press_layer(c, x, weight, gap, asperities=None, load=np.nan, **holder):
    """Return the state of a patch with a compliance (m, m) [m/N] that one of the `Holders` presses.

    `asperities` is a smooth law, or the stiffness [Pa/m] of a linear one.
    """
    if isinstance(asperities, float):
        c = c + np.diag(1 / (asperities * weight))
        asperities = None
    pieces = Compliance(Interface(x, np.asarray(weight), 1.0), c, c)
    return press_patch(pieces, gap, Holders(load, **holder), asperities)


def stretch_law(law, factor: float):
    """Return the law P(s/factor), which belongs to fewer peaks with wider height distribution."""
    if isinstance(law, ExponentialAsperities):
        return replace(law, u0=law.u0 * factor)
    return replace(law, deviation=law.deviation * factor, density=law.density * factor**-1.5)
