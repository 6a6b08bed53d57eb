"""Measured modes at nodes of a rig, with directions such as "12:+x" or "12:+x, 13:-x"."""

import re
from dataclasses import field

import numpy as np

from ..core import ModalBasis, PatchfemError, array_dataclass
from ..inputs.damage import list_some
from ..inputs.universal import DIRECTION_NAMES
from .modes import make_basis

Motions = dict[tuple[int, int], np.ndarray]  # motions (n,) of the modes by (node, axis 0 to 5)


@array_dataclass
class MeasuredModes:
    """Natural modes from a measurement, with their shapes at nodes and directions.

    - frequency: natural frequencies (n,) [Hz].
    - zeta: damping ratios (n,).
    - motion: motions (n,) of each (node, axis 0 to 5), of unit modal mass [kg^-1/2; rotations: per m].
    - notes: sentences for the user.
    """

    frequency: np.ndarray
    zeta: np.ndarray
    motion: Motions
    notes: list[str] = field(default_factory=list)

    def motion_at(self, text: str, key: str) -> np.ndarray:
        """Return the displacement of each mode at a node and direction such as "12:+x".

        Parameters
        ----------
        text : str
            A node with a direction such as ``"12:+x"``. Several are added with their signs: ``"12:+x,
            13:-x"`` is a relative motion.
        key : str
            Key of [structure] for messages.

        Returns
        -------
        (n,) ndarray
            Motion of each mode, of unit modal mass.

        Raises
        ------
        PatchfemError
            If the text names no node and direction, or one that the file does not contain.
        """

        # Sum of the motions at all directions that the text names, with their signs
        total = np.zeros(self.frequency.size)
        for part in text.split(","):
            # Such as "12:+x"
            match = re.fullmatch(r"(\d+):([+-]?)(r?[xyz])", part.strip())
            if match is None:
                raise PatchfemError(
                    f"'{text}' is not a node with a direction; write node:direction, such as "
                    '"12:+x", or "12:+x, 13:-x" for the motion of 12 relative to 13',
                    f"structure.{key}",
                )
            node = int(match[1])
            axis = DIRECTION_NAMES.index(match[3])
            if (node, axis) not in self.motion:
                raise PatchfemError(
                    f"the file has no motion of {node}:{match[3]}; the file has "
                    f"{_list_directions(self.motion)}",
                    f"structure.{key}",
                )
            sign = -1.0 if match[2] == "-" else 1.0
            total += sign * self.motion[node, axis]
        return total


def _list_directions(motion: Motions) -> str:
    """Return the first nodes and directions of the shapes in a file as text, such as "3:x, 7:y".

    `motion` has the keys (node, axis).
    """
    return list_some([f"{node}:{DIRECTION_NAMES[axis]}" for node, axis in sorted(motion)])


def build_basis(
    shapes: MeasuredModes, mass: float, places: dict[str, str | None], *, is_forced: bool
) -> ModalBasis:
    """Build the modal basis from measured modes.

    A fixed-base mode phi of a rig whose moving mass m is all in one rigid block participates in the base
    motion by phi^T M r = m phi(block). Modal tests give no mass matrix, so base_at must be that block.
    The sum of base^2 is the fraction of the moving mass that the modes contain.

    Parameters
    ----------
    shapes : MeasuredModes
        Modes with their motions at the nodes of the file.
    mass : float
        Modal mass [kg] to which the modes are scaled; their coordinates are motions like those of a
        block of this mass.
    places : dict
        Node and direction of each key, or None: slide_at, and optionally output_at (default: slide_at), force_at
        (output_at), base_at (slide_at), normal_at and pitch_at.
    is_forced : bool
        Whether a force drives the rig, and not its base.

    Returns
    -------
    ModalBasis

    Raises
    ------
    PatchfemError
        If no mode moves the slide or the output, or if the modes contain more than the moving mass.
    """
    rows = {}
    for key, text in places.items():
        if text is not None:
            rows[key] = np.sqrt(mass) * shapes.motion_at(text, key)
            if key in ("slide_at", "output_at") and not rows[key].any():
                raise PatchfemError(f"no mode of the file moves '{text}'", f"structure.{key}")

    # Places that are not given are those of the slide and the output.
    slide = rows["slide_at"]
    output = rows.get("output_at", slide)
    base = -rows.get("force_at", output) if is_forced else rows.get("base_at", slide)
    mass_fraction = float(np.sum(base**2))
    # A larger mass shows that the mass or the node of the base motion is wrong
    if not is_forced and mass_fraction > 1.05:
        raise PatchfemError(
            f"at this place the modes contain {mass_fraction:.4g} times structure.moving_mass, but at "
            "most 1 is possible; lower structure.moving_mass, or give the place of the moving mass",
            "structure.base_at",
        )

    # Modes are sorted by frequency, and move the output in the positive direction.
    order = np.argsort(shapes.frequency, kind="stable")
    sign = np.where(output[order] < 0, -1.0, 1.0)
    motions = {"slide": slide, "base": base, "output": output}
    motions |= {key: rows.get(f"{key}_at") for key in ("normal", "pitch")}
    return make_basis(
        tuple(f"mode {k + 1}" for k in range(order.size)),
        mass,
        omega=2 * np.pi * shapes.frequency[order],
        zeta=shapes.zeta[order],
        **{key: row[order] * sign for key, row in motions.items() if row is not None},
    )


def note_missing_mass(basis: ModalBasis) -> list[str]:
    """Return a note if the modes of a basis represent too small a part of the moving mass, else [].

    The squares of `basis.base`, the participations of the base, add up to the fraction of the mass that they move [1].
    """
    mass_fraction = float(np.sum(basis.base**2))
    if mass_fraction >= 0.8:
        return []
    return [
        f"the modes of structure.file contain {100 * mass_fraction:.0f} % of structure.moving_mass at base_at; the base "
        "motion does not drive the rest of this mass; add the modes that move it"
    ]
