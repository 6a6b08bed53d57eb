"""Both ends of one piece: sharp, chamfered or rounded, and how far the face between them can touch."""

from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

# slope of a rounded end up to which its face is part of the interface, as in `rounded`
GENTLE = 0.097
STEEPEST = sqrt(3)  # slope (60 degrees) beyond which a rounded end goes on along its tangent


@dataclass(frozen=True, slots=True)
class End:
    """The shape of both ends of a piece.

    kind: "sharp", "chamfer" (45 degrees) or "radius" (a quarter of a circle, tangent to the face); size [m] along the
    face and in depth, 0 for "sharp".
    """

    kind: str = "sharp"
    size: float = 0.0

    def bearing(self, length: float) -> float:
        """Half the length [m] of the face that can touch, of a piece of `length` [m].

        A chamfer does not touch; of a rounding the part whose slope is at most GENTLE does.
        """
        return (
            length / 2
            - self.size
            + (self.size * GENTLE / hypot(1, GENTLE) if self.kind == "radius" else 0.0)
        )

    def drop(self, x, length: float) -> np.ndarray:
        """Depth (k,) [m] of the face below its flat at x (k,) [m], 0 in the middle of a piece of `length` [m].

        The circle R - sqrt(R^2 - s^2), s the distance past its start, is followed to 60 degrees, then its tangent: a
        face that stood upright at the end would leave the cells below it no angle.
        """
        past = np.maximum(np.abs(np.asarray(x, float)) - (length / 2 - self.size), 0.0)
        if self.kind != "radius":
            return past if self.kind == "chamfer" else np.zeros(past.shape)
        last = self.size * STEEPEST / hypot(1, STEEPEST)
        round_ = np.minimum(past, last)
        circle = round_**2 / (self.size + np.sqrt(np.maximum(self.size**2 - round_**2, 0.0)))
        return circle + STEEPEST * np.maximum(past - last, 0.0)

    def depth(self, length: float) -> float:
        """Depth [m] of the face at the end of a piece of `length` [m]."""
        return float(self.drop(length / 2, length))


SHARP = End()
