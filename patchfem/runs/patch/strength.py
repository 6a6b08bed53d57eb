"""Yield strength of the pieces, and a lower bound of the von Mises stress from the pressure.

In: a `PatchModel` and a pressure. Out: notes on the faces that yield.
"""

from math import sqrt
from typing import NamedTuple

from ...scene.keys.materials import MATERIALS

YIELDING_NEGLECTED = "the run is elastic and neglects yielding"


class Strength(NamedTuple):
    """Yield strength of a material, with the source of the number.

    - material: its name; "material" without a name.
    - pressure: strength [Pa].
    - source: source of the number.
    """

    material: str
    pressure: float
    source: str

    @property
    def words(self) -> str:
        """Return the strength and its source as text."""
        return f"the yield strength is {self.pressure / 1e6:.4g} MPa ({self.source})"


def yield_strength(material) -> Strength | None:
    """Return the yield strength of a Material from the scene, else from the material table.

    None if neither has it.
    """
    if material is None:
        return None
    if material.yield_ is not None:
        return Strength(material.name or "material", material.yield_, "given in the scene")
    known = MATERIALS.get(material.name)
    if known is None or known.strength is None:
        return None
    if (material.young, material.poisson) != (known.young, known.poisson):
        return None  # A known name with other elastic constants is a different material.
    return Strength(material.name, known.strength.strength, known.strength.source[:-1])


def min_stress_ratio(poisson: float, plane: str) -> float:
    """Return the smallest von Mises stress per normal stress at a frictionless surface [1].

    The stress along the face is not known from the pressure alone; the value is the minimum over it. In plane strain
    sqrt(3)/2 (1 - 2 nu)/sqrt(1 - nu + nu^2), in plane stress sqrt(3)/2.
    """
    if plane == "stress":
        return sqrt(3) / 2
    return sqrt(3) / 2 * (1 - 2 * poisson) / sqrt(1 - poisson + poisson**2)


def yielding_faces(patch_model, peak: float) -> dict:
    """Return notes on the surface materials that yield under a given pressure.

    Parameters
    ----------
    patch_model : PatchModel
    peak : float
        Pressure [Pa] that acts at least somewhere on the interface.

    Returns
    -------
    dict
        Notes by Strength.
    """
    notes = {}
    for side, piece in (("lower", patch_model.pieces.lower), ("upper", patch_model.pieces.upper)):
        face = piece.coating.material if piece.coating else piece.substrate
        known = yield_strength(face)
        if known is None or known in notes:
            continue
        stress = min_stress_ratio(face.poisson, patch_model.pieces.plane) * peak
        if stress > known.pressure:
            notes[known] = (
                f"under the largest pressure the von Mises stress is at least {stress / 1e6:.4g} MPa at the face of "
                f"the {side} piece ({known.material}); {known.words}; {YIELDING_NEGLECTED}"
            )
    return notes
