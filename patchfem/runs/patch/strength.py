"""Yield strength of the pieces, and a lower bound of the von Mises stress that follows from the pressure alone."""

from math import sqrt
from typing import NamedTuple

from ...scene.keys.materials import MATERIALS, YIELD

NEGLECTED = "the run is elastic and neglects yielding"


class Strength(NamedTuple):
    """Yield strength of a material.

    material: its name, "material" without one; pressure: strength [Pa]; source: where the number comes from.
    """

    material: str
    pressure: float
    source: str

    @property
    def words(self) -> str:
        """The strength with its source, as a clause."""
        return f"the yield strength is {self.pressure / 1e6:.4g} MPa ({self.source})"


def strength_of(material) -> Strength | None:
    """Find the yield strength of a Material: that of the scene before that of the table; None without one."""
    if material is None:
        return None
    if material.yield_ is not None:
        return Strength(material.name or "material", material.yield_, "given in the scene")
    if (
        material.name not in YIELD
        or (material.young, material.poisson) != MATERIALS[material.name][:2]
    ):
        return None  # a name with constants of its own is another material
    known = YIELD[material.name]
    return Strength(material.name, known.strength, known.source[:-1])


def min_stress_ratio(poisson: float, plane: str) -> float:
    """Compute the smallest von Mises stress per unit of normal stress at a frictionless face.

    The stress along the face is not known from the pressure alone; the value is the minimum over it. In plane strain
    sqrt(3)/2 (1 - 2 nu)/sqrt(1 - nu + nu^2), in plane stress sqrt(3)/2.
    """
    if plane == "stress":
        return sqrt(3) / 2
    return sqrt(3) / 2 * (1 - 2 * poisson) / sqrt(1 - poisson + poisson**2)


def yielding_faces(asked, peak: float) -> dict:
    """Find the faces that a pressure makes yield: Strength -> note.

    Parameters
    ----------
    asked : PatchModel
    peak : float
        Pressure [Pa] that the interface bears at least somewhere.
    """
    notes = {}
    for side, piece in (("lower", asked.pieces.lower), ("upper", asked.pieces.upper)):
        face = piece.coating.material if piece.coating else piece.substrate
        known = strength_of(face)
        if known is None or known in notes:
            continue
        stress = min_stress_ratio(face.poisson, asked.pieces.plane) * peak
        if stress > known.pressure:
            notes[known] = (
                f"under the largest pressure the von Mises stress is at least {stress / 1e6:.4g} MPa at the face of "
                f"the {side} piece ({known.material}); {known.words}; {NEGLECTED}"
            )
    return notes
