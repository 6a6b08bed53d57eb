"""Shape of both ends of a piece: sharp, chamfered or rounded."""

from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

# Largest slope at which the face of a rounded end belongs to the interface, a little below the largest one between two
# nodes that a mesh file may have (`checks.MAX_ROUNDED_SLOPE`)
MAX_INTERFACE_SLOPE = 0.097
# Slope (60 degrees) at which a rounded end leaves the circle and continues along its tangent
MAX_CIRCLE_SLOPE = sqrt(3)


@dataclass(frozen=True, slots=True)
class End:
    """Shape of both ends of the face of a piece.

    - ``kind``: "sharp", "chamfer" (45 degrees) or "radius" (a quarter circle, tangent to the face)
    - ``size``: extent [m] along the face and in depth, 0 for "sharp"
    """

    kind: str = "sharp"
    size: float = 0.0

    def half_contact_length(self, length: float) -> float:
        """Return half the length [m] of the face that can be in contact.

        A chamfer does not touch. A rounding touches up to the slope `MAX_INTERFACE_SLOPE`. `length` is that of the piece
        [m].
        """
        half_flat_length = length / 2 - self.size
        if self.kind != "radius":
            return half_flat_length
        return half_flat_length + self.size * MAX_INTERFACE_SLOPE / hypot(1, MAX_INTERFACE_SLOPE)

    def face_depth(self, x, length: float) -> np.ndarray:
        """Return the depth [m] of the end face below the flat face.

        At the distance s beyond the flat part the circle lies R - sqrt(R^2 - s^2) deep. It is
        followed to 60 degrees, then its tangent: the cells below a vertical face would have an
        angle of zero.

        Parameters
        ----------
        x : (k,) array_like
            Coordinate [m], 0 in the middle of the piece.
        length : float
            Length of the piece [m].

        Returns
        -------
        (k,) ndarray
            Depth [m], 0 on the flat face.
        """
        end_distance = np.maximum(np.abs(np.asarray(x, float)) - (length / 2 - self.size), 0.0)
        if self.kind == "chamfer":
            return end_distance
        if self.kind == "sharp":
            return np.zeros(end_distance.shape)
        circle_end = self.size * MAX_CIRCLE_SLOPE / hypot(1, MAX_CIRCLE_SLOPE)
        on_circle = np.minimum(end_distance, circle_end)
        cosine_part = np.sqrt(np.maximum(self.size**2 - on_circle**2, 0.0))
        circle = on_circle**2 / (self.size + cosine_part)
        return circle + MAX_CIRCLE_SLOPE * np.maximum(end_distance - circle_end, 0.0)


# End of a piece without chamfer or radius
SHARP_END = End()
