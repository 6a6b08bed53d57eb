"""Places where a rig slides, is watched and is driven, as nodes and directions of measured modes: "12:+x, 13:-x"."""

import re
from dataclasses import dataclass, field

import numpy as np

from ..core import ModalBasis, PatchfemError, frozen_array

AXES = ("x", "y", "z", "rx", "ry", "rz")
_PLACE = re.compile(r"(\d+):([+-]?)(r?[xyz])")


@dataclass(frozen=True, eq=False, slots=True)
class Shapes:
    """Measured modes, n of them.

    frequency: (n,) [Hz]; zeta: (n,); motion: (node, axis 0..5) -> (n,) for unit modal mass [kg^-1/2, rotations per m];
    notes: sentences for the user.
    """

    frequency: np.ndarray
    zeta: np.ndarray
    motion: dict
    notes: list = field(default_factory=list)

    def at(self, text: str, key: str) -> np.ndarray:
        """Motion (n,) of the modes, for unit modal mass, at a place such as "12:+x" or "12:+x, 13:-x".

        Several places are added with their signs, which makes a relative motion. key: key of the scene for messages.
        PatchfemError for a text that is no place and for a place that the file does not have.
        """
        total = np.zeros(self.frequency.size)
        for part in text.split(","):
            found = _PLACE.fullmatch(part.strip())
            if found is None:
                raise PatchfemError(
                    f"structure.{key}: '{text}' is not a node with a direction; write node:direction, "
                    'such as "12:+x", or "12:+x, 13:-x" for the motion of 12 relative to 13'
                )
            node, sign, axis = int(found[1]), -1.0 if found[2] == "-" else 1.0, AXES.index(found[3])
            if (node, axis) not in self.motion:
                raise PatchfemError(
                    f"structure.{key}: the file has no motion of {node}:{found[3]}; the file has "
                    f"{_listed(self.motion)}"
                )
            total += sign * self.motion[node, axis]
        return total


def _listed(motion) -> str:
    names = [f"{node}:{AXES[axis]}" for node, axis in sorted(motion)]
    return ", ".join(names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")


def basis(shapes: Shapes, mass: float, places: dict, forced: bool) -> ModalBasis:
    """ModalBasis of measured modes scaled to the modal mass `mass` [kg], z_i being motions like those of a block.

    places: slide_at and, where given, output_at [slide_at], force_at [output_at], normal_at, pitch_at, base_at
    [slide_at]: the place where the moving mass sits. A fixed-base mode phi of a rig whose mass m is all in one rigid
    block takes part in the base motion by phi^T M r = m phi(block); test data have no mass matrix, so this is what can
    be said, and the sum of base^2 tells how much of the block's mass the modes hold. PatchfemError where it is above
    one by more than 5 % (the mass or the place is wrong).
    """
    scale = np.sqrt(mass)
    rows = {key: scale * shapes.at(text, key) for key, text in places.items() if text is not None}
    for key in ("slide_at", "output_at"):
        if key in rows and not rows[key].any():
            raise PatchfemError(f"structure.{key}: no mode of the file moves '{places[key]}'")
    slide = rows["slide_at"]
    output = rows.get("output_at", slide)
    base = -rows.get("force_at", output) if forced else rows.get("base_at", slide)
    held = float(np.sum(base**2))
    if not forced and held > 1.05:  # beyond 5 % the mass or the place is wrong
        raise PatchfemError(
            f"structure.base_at: at this place the modes contain {held:.4g} times "
            "structure.moving_mass, but at most 1 is possible; lower structure.moving_mass, or give "
            "the place of the moving mass"
        )
    moved = {
        key: frozen_array(rows[f"{key}_at"]) for key in ("normal", "pitch") if f"{key}_at" in rows
    }
    order = np.argsort(shapes.frequency, kind="stable")
    sign = np.where((output if np.any(output) else slide)[order] < 0, -1.0, 1.0)
    pick = {
        key: frozen_array(row[order] * sign)
        for key, row in (("slide", slide), ("base", base), ("output", output))
    }
    moved = {key: frozen_array(row[order] * sign) for key, row in moved.items() if row.any()}
    names = tuple(f"mode {k + 1}" for k in range(order.size))
    return ModalBasis(
        names,
        frozen_array(2 * np.pi * shapes.frequency[order]),
        frozen_array(shapes.zeta[order]),
        pick["slide"],
        pick["base"],
        pick["output"],
        float(mass),
        **moved,
    )


def participation_note(basis: ModalBasis) -> list:
    """A sentence, in a list, where the modes of a file hold less than 80 % of the moving mass; else an empty list."""
    held = float(np.sum(basis.base**2))
    if held >= 0.8:
        return []
    return [
        f"the modes of structure.file contain {100 * held:.0f} % of structure.moving_mass at base_at; the base "
        "motion does not drive the rest of this mass"
    ]
