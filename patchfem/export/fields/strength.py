"""Where the stress of a run is beyond the yield strength of a named material: what flows there is left out."""

import numpy as np

from ...core import say
from ...scene.keys.materials import MATERIALS, YIELD


def beyond_yield(asked, bodies: dict) -> list:
    """A note for each material whose von Mises stress is above its yield strength in some cell and frame.

    asked: the patch of a model; bodies: "lower" and "upper" -> {"points" (n, 2) [m], "blocks" of cells, "material"
    (c,) True for coating, "mises" (f, c) [Pa]}. Materials of a scene's own have no strength here, ceramics none.
    """
    found = {}
    for side, body in bodies.items():
        piece = getattr(asked, side)
        for coated, kind in ((False, piece.substrate), (True, piece.coating.material if piece.coating else None)):
            mine = np.flatnonzero(np.asarray(body["material"]) == coated)
            if kind is None or not mine.size or kind.name not in YIELD:
                continue
            if (kind.young, kind.poisson) != MATERIALS[kind.name][:2]:  # a name with constants of its own
                continue
            highest = body["mises"][:, mine].max(axis=0)
            cell = int(mine[np.argmax(highest)])
            if highest.max() > YIELD[kind.name].strength:
                found.setdefault(kind.name, []).append((float(highest.max()), side, _middle(body, cell)))
    return [_told(name, max(places), len(places)) for name, places in found.items()]


def _middle(body: dict, cell: int) -> np.ndarray:
    """Middle (x, y) [m] of a cell, counted through all blocks."""
    for block in body["blocks"]:
        if cell < len(block):
            return body["points"][block[cell]].mean(axis=0)
        cell -= len(block)
    raise IndexError(cell)


def _told(name: str, highest: tuple, pieces: int) -> str:
    stress, side, (x, y) = highest
    known = YIELD[name]
    both = ", which the other piece passes too" * (pieces > 1)
    return (f"the von Mises stress reaches {stress / 1e6:.4g} MPa in the {name} of the {side} piece, at x = {say(x)} "
            f"and {say(abs(y))} from the interface; the yield strength is {known.strength / 1e6:g} MPa "
            f"({known.source[:-1]}){both}; the run is elastic and leaves out what flows there")
