"""Notes about stresses beyond the yield strength of a named material.

The model does not include plastic flow.
"""

import numpy as np

from ...formatting import format_length
from ...runs.patch.strength import (
    YIELDING_NEGLECTED,
    Strength,
    min_von_mises_ratio,
    yield_strength,
)

# Height of the region at the fixed far face that is left out, relative to the height of the piece;
# the stress there grows with mesh refinement.
FIXED_REGION_FRACTION = 0.2


def find_yielding(patch_model, bodies: dict, min_peak: float = 0.0) -> dict:
    """Find the materials whose von Mises stress exceeds their yield strength anywhere.

    The region near the fixed far face is left out, because the stress in its corners is unbounded
    for a rigid holder.

    Parameters
    ----------
    patch_model : PatchModel
    bodies : dict
        "lower" and "upper" -> {"points" (n, 2) [m], "blocks" of cells, "material" (c,) True for
        coating, "mises" (f, c) [Pa]}.
    min_peak : float
        Lower limit of the peak pressure [Pa]. A material of a face is left out if this pressure
        causes a larger stress than the mesh shows (`note_on_yielding_faces` writes its note).

    Returns
    -------
    dict
        Strength -> note.
    """
    places_by_strength = {}
    for side, body in bodies.items():
        piece = getattr(patch_model.pieces, side)
        centres = np.concatenate([body["points"][block].mean(axis=1) for block in body["blocks"]])
        is_free = (
            np.abs(centres[:, 1]) < (1 - FIXED_REGION_FRACTION) * np.abs(body["points"][:, 1]).max()
        )
        for coated, material in (
            (False, piece.substrate),
            (True, piece.coating.material if piece.coating else None),
        ):
            cells = np.flatnonzero((np.asarray(body["material"]) == coated) & is_free)
            strength = yield_strength(material)
            if strength is None or not cells.size:
                continue
            highest = body["mises"][:, cells].max(axis=0)
            cell = int(cells[np.argmax(highest)])
            stress_at_face = 0.0
            if min_peak and (coated or piece.coating is None):
                plane = patch_model.pieces.plane
                stress_at_face = min_von_mises_ratio(material.poisson, plane) * min_peak
            if highest.max() > max(strength.pressure, stress_at_face):
                places_by_strength.setdefault(strength, []).append(
                    (float(highest.max()), side, centres[cell])
                )
    return {
        strength: _yielding_note(
            strength, max(places, key=lambda one: one[0]), len({side for _, side, _ in places})
        )
        for strength, places in places_by_strength.items()
    }


def _yielding_note(strength: Strength, highest: tuple, pieces: int) -> str:
    """Return the note on a material that yields, with the highest stress and its position."""
    stress, side, (x, y) = highest
    both = "; the other piece exceeds its yield strength too" * (pieces > 1)
    return (
        f"the von Mises stress reaches {stress / 1e6:.4g} MPa in the {strength.material} of the {side} piece, at "
        f"x = {format_length(x)} and {format_length(abs(y))} from the interface; {strength.words}{both}; "
        f"{YIELDING_NEGLECTED}"
    )
