"""The gap between the unloaded pieces: the sum of the shapes that a scene names."""

from time import perf_counter

import numpy as np

from ..contact.gaps import crown, step, tilt
from ..core import PatchfemError

SHAPES = {"tilt": lambda x, part: tilt(x, part.angle), "crown": lambda x, part: crown(x, part.radius),
          "step": lambda x, part: step(x, part.height, part.at)}


def gap_of(scene, x) -> tuple:
    """((m,) gap of the unloaded surfaces [m], notes, seconds by shape): the sum of what the scene names."""
    gap, seconds, notes = np.zeros(x.size), {}, ()
    for name, shape in SHAPES.items():
        part = getattr(scene.contact, name)
        if part is not None:
            begin = perf_counter()
            gap = gap + shape(x, part)
            seconds[name] = perf_counter() - begin
    if scene.contact.profile is not None:
        from .profile import profile_gap

        begin = perf_counter()
        heights, notes = profile_gap(scene, x)
        gap = gap + heights
        seconds["profile"] = perf_counter() - begin
    return gap, notes, seconds


def shape_side(contact) -> str:
    """The piece that carries the shapes, and with them the pressure; PatchfemError when they disagree."""
    sides = {part.on for part in (contact.tilt, contact.crown, contact.step, contact.profile) if part is not None}
    if len(sides) > 1:
        raise PatchfemError("contact: the shapes lie on different pieces (key `on`); not yet built: put all on one")
    return sides.pop() if sides else "upper"
