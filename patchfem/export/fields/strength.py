"""Where the stress of a run is beyond the yield strength of a named material: what flows there is left out."""

import numpy as np

from ...core import say
from ...scene.keys.materials import MATERIALS, YIELD

HELD = 0.2  # of a piece's height beside its held far face: nearer, stress grows as elements shrink (test_strength)


def beyond_yield(asked, bodies: dict) -> list:
    """A note for each material whose von Mises stress is above its yield strength in some cell and frame.

    asked: the patch of a model; bodies: "lower" and "upper" -> {"points" (n, 2) [m], "blocks" of cells, "material"
    (c,) True for coating, "mises" (f, c) [Pa]}. Materials of a scene's own have no strength here, ceramics none. What
    lies beside the held far face is left out: the stress in its corners is that of a rigid hold, without bound.
    """
    found = {}
    for side, body in bodies.items():
        piece = getattr(asked, side)
        middle = np.concatenate([body["points"][block].mean(axis=1) for block in body["blocks"]])
        free = np.abs(middle[:, 1]) < (1 - HELD) * np.abs(body["points"][:, 1]).max()
        for coated, kind in ((False, piece.substrate), (True, piece.coating.material if piece.coating else None)):
            mine = np.flatnonzero((np.asarray(body["material"]) == coated) & free)
            if kind is None or not mine.size or kind.name not in YIELD:
                continue
            if (kind.young, kind.poisson) != MATERIALS[kind.name][:2]:  # a name with constants of its own
                continue
            highest = body["mises"][:, mine].max(axis=0)
            cell = int(mine[np.argmax(highest)])
            if highest.max() > YIELD[kind.name].strength:
                found.setdefault(kind.name, []).append((float(highest.max()), side, middle[cell]))
    return [_told(name, max(places, key=lambda one: one[0]), len({side for _, side, _ in places}))
            for name, places in found.items()]


def _told(name: str, highest: tuple, pieces: int) -> str:
    stress, side, (x, y) = highest
    known = YIELD[name]
    both = "; the other piece exceeds its yield strength too" * (pieces > 1)
    return (f"the von Mises stress reaches {stress / 1e6:.4g} MPa in the {name} of the {side} piece, at x = {say(x)} "
            f"and {say(abs(y))} from the interface; the yield strength is {known.strength / 1e6:g} MPa "
            f"({known.source[:-1]}){both}; the run is elastic and neglects yielding")
