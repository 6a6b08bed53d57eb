"""Motions of one mode under a sine side by side, handed to compiled code; `waves` says which may move so."""

from functools import cache

import numpy as np

from ... import compiled
from .lane_step import LANES, SIZE, TERMS, step_of

HERE = "dynamics.smooth"
# read off their texts, for the modules would bring the compiler into every run
NUMBERS = compiled.kernels(f"{HERE}.aim_kernels").NUMBERS
ROWS = compiled.kernels(f"{HERE}.crest_kernels").ROWS
CREEP = compiled.kernels(f"{HERE}.creep_kernels")


@cache
def parts_of(law: str, say=None) -> dict:
    """The compiled modules for the law of a module, by the name under which others import them."""
    law = compiled.load(law, say)
    steps = compiled.instance(f"{HERE}.step_kernels", {"law": law})
    watching = compiled.instance(f"{HERE}.watch_kernels", {"law": law, "steps": steps})
    loop = compiled.instance(f"{HERE}.loop_kernels", {"law": law, "steps": steps, "watching": watching})
    return {"law": law, "steps": steps, "watching": watching, "loop": loop}


def loops_of(law: str, say=None):
    """The compiled loops for the law of this module; say: told before they are compiled."""
    return parts_of(law, say)["loop"]


@cache
def lanes_of(law: str):
    """The compiled loop over motions side by side for the law of this module."""
    parts = parts_of(law)
    polynomial = compiled.instance(f"{HERE}.polynomial_kernels", {"steps": parts["steps"]})
    reading = compiled.instance(f"{HERE}.watch_kernels", {"law": parts["law"], "steps": polynomial})
    own = {"stepping": step_of(parts["law"]), "polynomial": polynomial, "reading": reading}
    own["creep"] = compiled.instance(f"{HERE}.creep_kernels", {"law": parts["law"]})
    own["crests"] = compiled.instance(f"{HERE}.crest_kernels", {"steps": polynomial, "reading": reading})
    return compiled.instance(f"{HERE}.lane_kernels", parts | own)


def advance(law: str, many, kept, until, tolerance) -> np.ndarray:
    """Move n motions on to the times `until` (n,) [s]: codes (n,) of how they ended, as `loop_kernels` has them.

    many, kept: Moving and Kept with one more dimension of n in front, but for damping, work, room and table;
    tolerance (n,): of a step, relative. What kept asks for is read on the way.
    """
    codes = np.zeros(len(until), np.int64)
    room = (np.zeros(SIZE), np.zeros((LANES, NUMBERS)), np.zeros((ROWS, TERMS + 2)),
            np.zeros((CREEP.ROOM, CREEP.NODES)))
    lanes_of(law).advance(many, kept, *room, until, tolerance, codes)
    return codes


def stacked(parts, shared: tuple):
    """A Moving or Kept of one motion as one of many, in the same memory; shared: names of what all have together."""
    return parts._replace(**{name: array[None] for name, array in parts._asdict().items() if name not in shared})


OF_MOVING, OF_KEPT = ("damping", "work"), ("room", "table")
