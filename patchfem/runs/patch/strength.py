"""Yield strength of the pieces, and a lower bound of their von Mises stress.

In: a `PatchModel` and a pressure. Out: notes on the surfaces that yield.
"""

from math import sqrt
from typing import NamedTuple

from ...scene.keys.materials import MATERIALS

YIELDING_NEGLECTED = "the run is elastic and neglects yielding"


class Strength(NamedTuple):
    """Yield strength of a material, with the source of the number.

    - material: name of the material; "material" if it has none.
    - pressure: yield strength [Pa].
    - source: source of the number.
    """

    material: str
    pressure: float
    source: str

    @property
    def words(self) -> str:
        """Sentence on the yield strength and its source."""
        return f"the yield strength is {self.pressure / 1e6:.4g} MPa ({self.source})"


def yield_strength(material) -> Strength | None:
    """Return the yield strength of a Material from the scene or else from the material table.

    It is None if neither has it.
    """
    if material is None:
        return None
    if material.yield_ is not None:
        return Strength(material.name or "material", material.yield_, "given in the scene")
    listed = MATERIALS.get(material.name)
    if listed is None or listed.strength is None:
        return None
    if (material.young, material.poisson) != (listed.young, listed.poisson):
        return None  # A listed name with other elastic constants denotes another material.
    return Strength(material.name, listed.strength.strength, listed.strength.source[:-1])


def min_von_mises_ratio(poisson: float, plane: str) -> float:
    """Return the smallest ratio of von Mises stress to pressure at a frictionless surface.

    The minimum over the stress along the surface is taken, because the pressure alone does not
    determine this stress. It is sqrt(3)/2 (1 - 2 nu)/sqrt(1 - nu + nu^2) in plane strain and
    sqrt(3)/2 in plane stress.
    """
    if plane == "stress":
        return sqrt(3) / 2
    return sqrt(3) / 2 * (1 - 2 * poisson) / sqrt(1 - poisson + poisson**2)


def note_on_yielding_faces(patch_model, peak: float) -> dict[Strength, str]:
    """Return notes on the surface materials that yield under a given pressure.

    Parameters
    ----------
    patch_model : PatchModel
        Patch with the materials of both surfaces.
    peak : float
        Pressure [Pa] that is reached somewhere on the interface.

    Returns
    -------
    dict
        Notes by Strength.
    """
    notes = {}
    for side, piece in (("lower", patch_model.pieces.lower), ("upper", patch_model.pieces.upper)):
        face = piece.face_material
        strength = yield_strength(face)
        if strength is None or strength in notes:
            continue
        stress = min_von_mises_ratio(face.poisson, patch_model.pieces.plane) * peak
        if stress > strength.pressure:
            notes[strength] = (
                f"under the largest pressure the von Mises stress is at least {stress / 1e6:.4g} MPa at the face of "
                f"the {side} piece ({strength.material}); {strength.words}; {YIELDING_NEGLECTED}"
            )
    return notes
