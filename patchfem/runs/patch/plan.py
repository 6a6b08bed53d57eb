"""Sizes, stiffness and groups of a patch, before it is pressed."""

from math import sqrt

from ...model.model import Model
from ...model.patch import CHOSEN_POINTS, bars, block_shear

PRESSED, SQUARE = 0.15, 1.5e-6  # seconds of a patch, and per pair of nodes
NODE, PAIR, PACKAGES = 5.5e4, 133.0, 1.6e7  # bytes per node, per pair of nodes: flexibilities, factors; of packages
MOVING, FRAMES = 0.35, 2.5e7  # seconds and bytes of the frames of a patch whose contact moves


def sizes(asked) -> dict:
    """Sizes of a `PatchModel` by name: interface points, and about how many elastic unknowns."""
    points = CHOSEN_POINTS if asked.chosen else round(asked.length / asked.size) + 1
    return {"interface_points": points, "elastic_unknowns_about": int(points * 2 * 33)}


def effort(asked, still: bool, tolerance: float) -> tuple:
    """(seconds, bytes) of pressing a `PatchModel` and of its fields, besides the program itself; still: nothing moves.

    Measured over random patches: the square of the nodes, and what outlines, steps, unlike pieces and a mesh that has
    to follow the edge of the contact to a fine tolerance take besides.
    """
    points = sizes(asked)["interface_points"]
    seconds, size = PRESSED + SQUARE * points**2, PACKAGES + NODE * points + PAIR * points**2
    unlike = asked.lower != asked.upper
    if asked.outlined or asked.gap.jumps:
        seconds, size = seconds + 1.3, size + 1.2e8
    if asked.chosen and (asked.outlined or asked.gap.jumps):
        seconds, size = seconds + 0.7, size + 5e7
    ends = bool(asked.gap.shapes) or asked.offset or asked.line_moment
    if asked.chosen and ends and not still and tolerance < 2e-3:
        seconds, size = seconds + 2.5, size + 2.8e8
    return seconds + (0.0 if still else MOVING) + 0.3 * unlike, size + (0.0 if still else FRAMES)


def chain(asked) -> dict:
    """Links of the stiffness chain of a `PatchModel` by name [N/m], "rigid" where the scene names none."""
    out = {"holder": asked.slide_spring or "rigid", "pieces_shear": block_shear(asked) if asked.shear else "rigid",
           "asperities": "rigid"}
    if asked.skin is not None and asked.skin.tangential_ratio is not None:
        from .skin import mean_stiffness

        area = asked.length * asked.width * asked.pairs
        out["asperities"] = asked.skin.tangential_ratio * mean_stiffness(asked, asked.nominal_load / area) * area
    return out


def groups(model: Model) -> dict:
    """Dimensionless groups of a patch by name, and its slip length [m] where something rubs.

    tilt_over_first_opening: tilt over the one at which the edge of flat pieces lifts off, the pieces taken as bars.
    """
    out, asked = {}, model.patch
    load = asked.nominal_load
    if model.friction is not None:
        out["slip_length"] = model.friction.static * load / block_shear(asked)
    tilts = [abs(part.angle) for name, part in asked.gap.shapes if name == "tilt"]
    if tilts and load > 0:
        approach = load * bars(asked, lambda m: (1 - m.poisson**2) / m.young)
        out["tilt_over_first_opening"] = tilts[0] * asked.length / (2 * approach)
    return out


def verdict(found: dict) -> list:
    """Sentences on what the tilt group says: full contact, or about which part of it."""
    tilt = found.get("tilt_over_first_opening")
    if tilt is None:
        return []
    part = min(1.0, 1 / sqrt(tilt)) if tilt > 1 else 1.0
    return [f"tilt is {tilt:.3g} of the first-opening tilt: " +
            ("full contact" if tilt <= 1 else f"partial contact, roughly {100 * part:.0f} % or less")]
