"""The gap between the unloaded pieces: the sum of the shapes that a scene names.

A shape is a table of [contact] and the function of the same name in `contact.gaps`, whose arguments are the places x
and the keys of that table; `effects.SHAPES` lists them.
"""

from dataclasses import dataclass
from math import inf
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ..contact import gaps
from ..effects import SHAPES
from ..scene.keys.contact import Contact
from . import profile as profile_gaps

DEFAULT_CELLS = 200  # number of cells along the interface of an even mesh


class ProfileLengths(NamedTuple):
    """Lengths over which a profile is averaged.

    Attributes
    ----------
    average : float or None
        Averaging length [m]; None for the cells of the mesh, down to the spacing of the file.
    limit : float or None
        Cell length [m] than which a large part of the heights may not be finer: 0 for that of the
        mesh, None for no limit.
    """

    average: float | None
    limit: float | None


@dataclass(frozen=True, eq=False, slots=True)
class Gap:
    """The shapes that open the gap between the pieces.

    shapes: (name, keys of its table) each; profile: path of measured heights or None; average [m]: the length over
    which these heights are averaged, None: the cells of the mesh, down to the spacing of the file; limit [m]: cells
    that too much of the heights may not be finer than, 0: those of the mesh, None: all may; rough: asperities stand
    for what is finer; side: the piece that carries the shapes, "upper" or "lower"; material: peaks of the profile are
    material.
    """

    shapes: tuple
    profile: Path | None
    average: float | None
    limit: float | None
    rough: bool
    side: str
    material: bool = False

    @property
    def angle(self) -> float:
        """Angle [rad] at which a tilted upper piece is held."""
        return next((angle for part, angle in self._stated("angle") if part.on == "upper"), 0.0)

    @property
    def tilt(self) -> float | None:
        """Size of the angle [rad] between the pieces, whichever is turned, None where none is."""
        return next((abs(angle) for _, angle in self._stated("angle")), None)

    @property
    def jumps(self) -> tuple:
        """Places [m] where the gap jumps, at the edge of a step."""
        return tuple(place for _, (place, _) in self._stated("edge"))

    @property
    def wave(self) -> float:
        """Length [m] of the shortest wave of the shapes, which the cells have to show; infinite without one."""
        return min((wave for _, wave in self._stated("wave")), default=inf)

    def _stated(self, what: str) -> list:
        """(keys of the table, what the shape states of it) of every shape that states `what`, of `gaps.Stated`."""
        known = [(part, getattr(gaps.STATED.get(name), what, None)) for name, part in self.shapes]
        return [(part, of(part)) for part, of in known if of is not None]

    def averaging(self, x, loaded) -> float | None:
        """Length [m] that the profile is averaged over where nodes x (m,) [m] are `loaded` (m,) bool: the longest cell
        beside one of them, or what the scene or the file allows at least; None without a profile."""
        if self.profile is None:
            return None

        beside = loaded[1:] | loaded[:-1]
        longest = np.diff(x)[beside].max(initial=0.0) or np.diff(x).max()
        return float(max(longest, self.average or profile_gaps.spacing_of(self.profile)))

    def rim(self, x) -> np.ndarray:
        """Half the height of the steps whose edge is a node, (m,) [m] at x (m,) [m]; 0 elsewhere."""
        return sum(
            (
                np.where(x == place, abs(height) / 2, 0.0)
                for _, (place, height) in self._stated("edge")
            ),
            np.zeros(x.size),
        )

    def at(self, x) -> tuple:
        """Gap of the unloaded surfaces (m,) [m] at x (m,) [m], with notes for the user and seconds by shape; of shapes
        with n numbers in place of one (m, n) at x (m, 1)."""
        gap, seconds, notes = np.zeros(x.shape), {}, ()
        for name, part in self.shapes:
            begin = perf_counter()
            keys = {key: value for key, value in part if key != "on"}
            gap = gap + getattr(gaps, name)(x, **keys)
            seconds[name] = perf_counter() - begin
        if self.profile is not None:
            begin = perf_counter()
            heights, notes = profile_gaps.profile_gap(
                self.profile, x, (self.average, self.limit), self.rough, self.material
            )
            gap = gap + heights
            seconds["profile"] = perf_counter() - begin
        return gap, notes, seconds


def build_gap(contact: Contact, lengths: tuple, beside) -> Gap:
    """The shapes of [contact].

    lengths: average and limit [m] of a profile; beside(name) -> path of a file.
    """
    shapes = tuple((name, part) for name, part in contact.shapes.items() if name in SHAPES)
    profile = contact.profile
    return Gap(
        shapes,
        beside(profile.file) if profile is not None else None,
        *lengths,
        contact.asperities is not None,
        shape_side(contact),
        profile is not None and profile.heights == "surface",
    )


def shape_side(contact: Contact) -> str:
    """The piece that carries the shapes, and with them the pressure; "upper" where both do, which only a static patch
    takes."""
    return "lower" if {part.on for part in contact.shapes.values()} == {"lower"} else "upper"
