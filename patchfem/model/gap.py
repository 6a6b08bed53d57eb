"""Gap between the unloaded pieces: the sum of the shapes that a scene names.

A shape is a table of [contact] and the function of the same name in `contact.gaps`, whose arguments are
the coordinate x and the keys of the table; `effects.GAP_SHAPES` lists them.
"""

from math import inf
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from .. import contact
from ..core import array_dataclass
from ..effects import GAP_SHAPES
from ..scene.keys.contact import Contact
from ..scene.keys.types import Table
from . import profile as profiles

N_DEFAULT_CELLS = 200  # number of cells along the interface in a uniform mesh


NamedShape = tuple[str, Table]  # name of a shape, and its table in the scene


class ProfileLengths(NamedTuple):
    """Lengths over which a profile is averaged.

    - average: averaging length [m]; None for the cells of the mesh, down to the spacing of the
      file.
    - limit: cell length [m]; a large fraction of the heights must not be finer; 0 stands for
      the cells of the mesh, None for no limit.
    """

    average: float | None
    limit: float | None


class ShapedGap(NamedTuple):
    """Gap between the unloaded pieces at given positions.

    - heights: gap [m] at each node.
    - notes: sentences for the user.
    - seconds: time [s] that each shape took.
    """

    heights: np.ndarray
    notes: tuple[str, ...]
    seconds: dict[str, float]

    def add_profile(self, heights, notes: tuple[str, ...], seconds: float) -> "ShapedGap":
        """Return the gap with the heights of a profile.

        Parameters
        ----------
        heights : array
            Heights [m] at the nodes.
        notes : tuple of str
            Sentences on the profile.
        seconds : float
            Its computing time [s].
        """
        return ShapedGap(self.heights + heights, notes, self.seconds | {"profile": seconds})


@array_dataclass
class Gap:
    """Shapes that together form the gap between the pieces.

    - shapes: pairs of the name of a shape and the keys of its table.
    - profile: file of measured heights.
    - average, limit: lengths [m] of `ProfileLengths`.
    - is_rough: whether asperities represent the waves that are finer than `average`.
    - side: piece that carries the shapes, ``"upper"`` or ``"lower"``.
    - material: whether the heights of the profile are those of a surface, so that a peak closes the
      gap.
    - file: name of the profile in the scene.
    """

    shapes: tuple[NamedShape, ...]
    profile: Path | None
    average: float | None
    limit: float | None
    is_rough: bool
    side: str
    material: bool = False
    file: str = ""

    @property
    def is_split(self) -> bool:
        """Whether asperities represent the short waves of a measured profile, so that worn depths are means over them."""
        return self.is_rough and self.profile is not None

    @property
    def angle(self) -> float:
        """Prescribed angle [rad] of the upper piece."""
        return next((angle for keys, angle in self._values("angle") if keys.on == "upper"), 0.0)

    @property
    def roll(self) -> float:
        """Prescribed angle [rad] of the upper piece about x."""
        angles = (keys.roll for keys, _ in self._values("angle") if keys.on == "upper")
        return next(angles, 0.0) or 0.0

    @property
    def tilt(self) -> float | None:
        """Absolute angle [rad] between the pieces, or None if they are not tilted."""
        return next((abs(angle) for _, angle in self._values("angle")), None)

    @property
    def step_edges(self) -> tuple[float, ...]:
        """Coordinates x [m] of the edges of steps, at which the gap is discontinuous."""
        return tuple(x for _, (x, _) in self._values("edge"))

    @property
    def wave(self) -> float:
        """Shortest wavelength [m] of the wavy shapes, or inf if there are none.

        The cells of the mesh have to resolve it.
        """
        return min((wave for _, wave in self._values("wave")), default=inf)

    def _values(self, quantity: str) -> list[tuple[Table, Any]]:
        """Return (table of the shape, value) for every shape of the gap that has a property.

        `quantity` names the property, such as "edge". Its value is what the function of this name in `gaps` returns.
        """
        pairs = []
        for name, keys in self.shapes:
            evaluate = getattr(contact.gaps.SHAPE_PROPERTIES.get(name), quantity, None)
            if evaluate is not None:
                pairs.append((keys, evaluate(keys)))
        return pairs

    def averaging_length(self, x, loaded_nodes) -> float | None:
        """Return the length [m] over which the profile is averaged in the contact.

        Parameters
        ----------
        x : (m,) ndarray
            Coordinates of the nodes [m].
        loaded_nodes : (m,) ndarray of bool
            Whether a node carries pressure.

        Returns
        -------
        float or None
            The longest cell next to a loaded node, but at least `average` or the spacing of the
            file; None without a profile.
        """
        if self.profile is None:
            return None
        longest = longest_loaded_cell(x, loaded_nodes)
        return float(max(longest, self.average or profiles.find_sample_spacing(self.profile)))

    def evaluate(self, x) -> ShapedGap:
        """Return the gap between the unloaded pieces.

        `x` [m] is (m,), or (m, 1) if numbers of the shapes are arrays (n,); then the gap is (m, n).

        Returns
        -------
        ShapedGap
            Gap [m], notes on the profile and computing time [s] of each shape.
        """
        shaped = self.add_up_shapes(x)
        if self.profile is None:
            return shaped
        begin = process_time()
        heights, notes = profiles.compute_profile_gap(
            self.profile,
            x,
            ProfileLengths(self.average, self.limit),
            float(x[-1] - x[0]) / N_DEFAULT_CELLS,
            is_rough=self.is_rough,
            is_material=self.material,
        )
        return shaped.add_profile(heights, notes, process_time() - begin)

    def add_up_shapes(self, x, **y) -> ShapedGap:
        """Return the gap of the shapes in closed form, without a profile, at positions x [m], and y [m] if it is given."""
        gap = np.zeros(np.broadcast_shapes(x.shape, *(places.shape for places in y.values())))
        seconds = {}
        for name, shape_keys in self.shapes:
            begin = process_time()
            keys = {key: value for key, value in shape_keys if key != "on"}
            gap = gap + getattr(contact.gaps, name)(x, **keys, **y)
            seconds[name] = process_time() - begin
        return ShapedGap(gap, (), seconds)


def longest_loaded_cell(x, loaded_nodes) -> float:
    """Return the length [m] of the longest cell next to a node that carries pressure.

    Without such nodes it is that of the longest cell.

    x (m,) [m] are the ascending nodes, and `loaded_nodes` (m,) of bool tells which of them carry pressure.
    """
    beside = loaded_nodes[1:] | loaded_nodes[:-1]
    return float(np.diff(x)[beside].max(initial=0.0) or np.diff(x).max())


def list_gap_shapes(contact: Contact) -> tuple[NamedShape, ...]:
    """Return (name, table) of each shape in a table [contact] that contributes to the gap."""
    return tuple((name, keys) for name, keys in contact.shapes.items() if name in GAP_SHAPES)


def find_shape_side(contact: Contact) -> str:
    """Return the piece, "lower" or "upper", that carries the gap shapes of a table [contact].

    It is "upper" if both or none carry shapes.
    """
    sides = {keys.on for keys in contact.shapes.values()}
    return "lower" if sides == {"lower"} else "upper"
