"""The law object that a bench steps: one per value of friction.law."""

from ...effects import has
from ...model.law import bonds_of


def law_for(scene, patch=None):
    """The NumPy law object of a bench; only an averaged law looks at the patch."""
    f = scene.friction
    if has(f.law, "averaged"):
        from .averaged import law_on

        return law_on(scene, patch)
    if not has(f.law, "bonds"):
        from ...friction.record import law_from

        return law_from(f, patch.pressure.load if patch is not None else scene.normal.load)
    from ...friction.bonds.quadrature import Quadrature
    from ...friction.bonds.recursion import Recursion

    law = bonds_of(scene)
    engine = scene.accuracy.quadrature
    if engine == "recursion" or (engine == "auto" and law.reading == "stretch" and law.order == 1):
        return Recursion(law)
    if engine == "direct":
        return Quadrature(law, 0.0)
    tail = scene.accuracy.tail if scene.accuracy.tail is not None else 1e-3 * scene.accuracy.tolerance
    return Quadrature(law, tail)
