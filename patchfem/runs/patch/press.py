"""The static patch of a scene: the pieces condensed to their interface, the gap between them, and what presses them."""

from dataclasses import dataclass, field, replace
from functools import partial
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...contact import edges
from ...contact.strip_compliance import WarmStart
from ...contact.unilateral import press, press_to_approach
from ...core import Compliance, ContactState, frozen_array
from . import skin as skin_press
from . import strips as strip_press
from .approach import closed_by
from .condensed import Pair, condensed

RIPPLE = 1e-2  # ripples over the pressure on pieces whose nodes do not match, above which a note states them


class Surface(NamedTuple):
    """Pressed interface on the points on which it was solved.

    x: (n,) places [m]; weight: (n,) areas [m2]; sigma_n: (n,) normal stress [Pa]; gap: (n,) gap [m] that remains under
    load; unloaded_gap: (n,) gap [m] without load, or (s, n) of strips.
    """

    x: np.ndarray
    weight: np.ndarray
    sigma_n: np.ndarray
    gap: np.ndarray
    unloaded_gap: np.ndarray


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True)
class Patch:
    """A solved patch; forces, areas and stiffnesses are of all pairs together.

    pieces: compliance of the pieces and of their skin, linearised at the operating point where the skin is smooth;
    giving: (m, m) [m/N] the tangential compliance that lets the patch slip in part: of the skin, of the pieces with
    [contact.shear], and of the holder's spring, which is the same on every entry; gap: (m,) [m] of the unloaded
    surfaces; skin: StripsState, of one strip, of a smooth skin, else None; strips: StripsState of a patch in strips,
    whose means over the width then stand in `pressure`, else None; tangential_ratio: k_t/k_n of the skin, None where it
    is rigid in shear; skinned: a skin of asperities lies between the pieces; jumps: places [m] where the gap steps;
    sharp: an end of the interface is a corner that meets a face which goes on; notes: sentences for the warnings;
    sharper: static measures by name as (value, error) that points of a trace gave in addition, {}
    without any; averaging [m]: the length that a profile is averaged over where it bears, None without one; either: a
    step of the gap ends at a node, half of which lies below it and half above: (weight, Patch) with the whole node
    below, and the same with it above; () without such a node. fine: the Surface on the points of a trace, None where
    the mesh is the finest solution; stretches: (k, 2) [m] parts in contact on these points.
    """

    pair: Pair
    pieces: Compliance
    giving: np.ndarray
    gap: np.ndarray
    pressure: ContactState
    skin: object
    strips: object
    tangential_ratio: float | None
    skinned: bool
    jumps: tuple
    sharp: bool
    notes: tuple
    seconds: dict
    sharper: dict = field(default_factory=dict)
    averaging: float | None = None
    either: tuple = ()
    fine: Surface | None = None
    stretches: np.ndarray | None = None

    @property
    def on_mesh(self) -> Surface:
        """Interface on the nodes of the mesh."""
        return Surface(
            self.x, self.pieces.interface.weight, self.pressure.sigma_n, self.pressure.gap, self.gap
        )

    @property
    def x(self) -> np.ndarray:
        """Places of the interface nodes (m,) [m]."""
        return self.pieces.interface.x

    @property
    def skin_share(self) -> np.ndarray | None:
        """Share (m,) [1] of the asperities in the compliance of each node, None of bare pieces."""
        if not self.skinned:
            return None
        bare = np.diag(self.pair.compliance.normal)
        if self.strips is None:
            return 1 - bare / np.diag(self.pieces.normal)
        stiff = self.strips.stiffness.max(axis=0) * self.pieces.interface.weight
        return 1 / (1 + bare * stiff)

    @property
    def active(self) -> np.ndarray:
        """Contact set (m,) bool: the nodes that carry."""
        return self.pressure.sigma_n > 0


def solve(asked, grid, upper_grid=None, fresh: bool = False) -> Patch:
    """Assemble, condense and press the pieces of a `PatchModel`.

    grid, upper_grid: meshes from `piece_meshes`, the upper None where it is alike; fresh: operators kept on disk are not
    used. Refusals as in `pressed` and of the contact.
    """
    return pressed(asked, condensed(asked, grid, upper_grid, fresh))


def pressed(asked, pair: Pair, worn=None) -> Patch:
    """The pair under the shapes, the load and the holder of a `PatchModel`; the pair serves any number of them.

    worn (m,) [m], of strips (s, m): depth that wear has added to the gap. PatchfemError where a profile does not fit
    the mesh.
    """
    x = pair.compliance.interface.x
    gap, notes, seconds = asked.gap.at(x)
    gap = gap + pair.rise if worn is None else gap + pair.rise + worn
    rim, out = asked.gap.half_step_heights(x), _on(asked, pair, gap, notes, seconds)
    if (
        pair.joint is not None
        and pair.joint.ripple > RIPPLE
        and zigzags(out.x, out.pressure.sigma_n) > RIPPLE
    ):
        out = replace(out, notes=(*notes, f"contact.mesh: {pair.joint.reason}"))
    if not rim.any():
        return out
    # a set ends half a cell less `behind` beyond its last node: the two ends lie about the step by these shares
    node = int(np.argmax(rim))
    bare = 1.0 if out.skin_share is None else 1 - float(out.skin_share[node])
    lean = bare * edges.edge_offset_fraction(
        1.0 if pair.row is None else pair.row / float(np.diff(x[node - 1 : node + 2]).min())
    )
    shifts = _shifts_at_step(node, gap if worn is None else gap - worn, rim, worn)
    return replace(
        out,
        either=tuple(
            (0.5 - side * lean, _on(asked, pair, gap + shift, notes, seconds))
            for side, shift in zip((-1, 1), shifts)
        ),
    )


def _shifts_at_step(node: int, gap, rim, worn) -> tuple:
    """Return what is added to the gap (m,) [m] where the node at a step bears, and where it does not.

    The worn depth of the node belongs to a gap in the middle of the step. A node that bears has worn as its neighbour
    on the higher side of the step, a node that does not bear as its neighbour on the lower side.
    """
    if worn is None:
        return -rim, rim
    higher, lower = node + 1, node - 1
    if np.mean(gap[..., lower]) < np.mean(gap[..., higher]):
        higher, lower = lower, higher
    shifts = []
    for side, neighbour in ((-1, higher), (1, lower)):
        shift = np.broadcast_to(side * rim, worn.shape).copy()
        shift[..., node] += worn[..., neighbour] - worn[..., node]
        shifts.append(shift)
    return tuple(shifts)


def zigzags(x, sigma) -> float:
    """Largest zigzag of pressures sigma (m,) [Pa] at x (m,) [m] over their peak: of three loaded nodes in turn above,
    below and above the line through their neighbours, or the other way round, half of the least distance."""
    share = np.diff(x)[:-1] / (x[2:] - x[:-2])
    off = sigma[1:-1] - (1 - share) * sigma[:-2] - share * sigma[2:]
    three = np.stack([off[:-2], -off[1:-1], off[2:]])
    bears = np.min([sigma[k : sigma.size - 4 + k] for k in range(5)], axis=0, initial=np.inf) > 0
    alike = bears & ((three > 0).all(axis=0) | (three < 0).all(axis=0))
    return float(
        np.abs(three[:, alike]).min(axis=0).max(initial=0.0) / 2 / sigma.max(initial=1e-300)
    )


def _on(asked, pair: Pair, gap, notes: tuple, seconds: dict) -> Patch:
    """The pair pressed on the gap (m,) [m]; notes and seconds of what made it."""
    begin = perf_counter()
    how = _how(asked)(asked, pair.compliance, gap)
    return as_patch(asked, pair, gap, notes, seconds | {"press": perf_counter() - begin}, how)


def as_patch(asked, pair: Pair, gap, notes: tuple, seconds: dict, how: tuple) -> Patch:
    """The Patch of a pair pressed on the gap (m,) [m]; how: (Compliance with its skin, Pressure, skin, strips)."""
    pieces, pressure, skin, strips = how
    giving = pieces.tangential
    if not asked.interface.has_shear:
        giving = frozen_array(giving - pair.compliance.tangential)
    if asked.loading.tangential_stiffness:
        giving = frozen_array(giving + 1 / asked.loading.tangential_stiffness)
    ratio = asked.interface.skin.tangential_ratio if asked.interface.skin is not None else None
    return Patch(
        pair,
        pieces,
        giving,
        frozen_array(gap),
        pressure,
        skin,
        strips,
        ratio,
        asked.interface.skin is not None,
        asked.gap.jumps,
        asked.has_singular_ends,
        notes,
        pair.seconds | seconds,
        averaging=asked.gap.averaging_length(pieces.interface.x, pressure.sigma_n > 0),
    )


def areas(asked, interface) -> np.ndarray:
    """Nodal areas (m,) [m2] of a `PatchModel` on an interface, of strips (s, m) those of each."""
    if asked.interface.strips is None:
        return interface.weight
    count = asked.interface.strips.count
    return np.repeat(interface.weight[None] / count, count, axis=0)


def presser(asked, pair: Pair):
    """A function of (worn (m,) [m], softening (m,) [m/N]) -> contact forces (m,) [N] of a `PatchModel`; of strips all
    three are (s, m).

    worn adds to the gap, softening to the diagonal of the compliance; what they share is made once. PatchfemError where
    a profile does not fit the mesh.
    """
    gap = asked.gap.at(pair.compliance.interface.x).heights
    gap, bare = gap + pair.rise, pair.compliance
    how = _how(asked)
    if asked.interface.strips is not None:
        return PressedStrips(asked, bare, gap)

    def press(worn, softening):
        soft = replace(bare, normal=bare.normal + np.diag(softening)) if softening.any() else bare
        return how(asked, soft, gap + worn)[1].sigma_n * bare.interface.weight

    return press


@dataclass(eq=False, slots=True)
class PressedStrips:
    """Pressing of worn strips, each one started from the contact set of the one before it.

    `begin` sets the contact set to start from, so that the same pressings give the same bits after an interruption.

    gap: (m,) [m]; warm_start: contact set and factors of the last pressing.
    """

    asked: object
    bare: Compliance
    gap: np.ndarray
    warm_start: WarmStart = field(default_factory=WarmStart)

    def begin(self, force) -> None:
        """Begin the next pressing from the contact set of forces (s, m) [N]."""
        self.warm_start.contact_set = np.asarray(force) > 0

    def __call__(self, worn, softening) -> np.ndarray:
        how = _how(
            self.asked,
            partial(
                _under,
                added=softening if softening.any() else None,
                warm_start=self.warm_start,
            ),
        )
        return how(self.asked, self.bare, self.gap + worn)[3].force


def _how(asked, under=None):
    """Function (asked, pieces, gap) -> (Compliance with its skin, Pressure, skin, strips) that presses the pair; under:
    that of a load, None for `_under`."""
    under = under or _under
    if asked.loading.approach is None or not (
        asked.loading.can_rotate or asked.loading.rotational_stiffness > 0
    ):
        return under
    bare = (
        with_linear_skin
        if asked.interface.skin is not None and asked.interface.skin.law == "linear"
        else lambda skin, pieces: pieces
    )
    return lambda asked, pieces, gap: closed_by(
        asked, pieces, gap, under, bare(asked.interface.skin, pieces)
    )


def _under(asked, pieces: Compliance, gap, added=None, warm_start=None) -> tuple:
    """The pair under its load, or under its approach with the rotation held: (Compliance with its skin, Pressure, skin,
    strips); added, warm_start: of `StripCompliance`."""
    strips = skin = None
    angle, moment, spring = (
        asked.gap.angle,
        asked.loading.moment,
        asked.loading.rotational_stiffness,
    )
    if asked.interface.strips is not None:
        pieces, pressure, skin, strips = strip_press.in_strips(
            asked, pieces, gap, (angle, moment, spring), added, warm_start
        )
    elif asked.interface.skin is not None and asked.interface.skin.law != "linear":
        pieces, pressure, skin = skin_press.behind_skin(asked, pieces, gap, angle, moment, spring)
    else:
        if asked.interface.skin is not None:
            pieces = with_linear_skin(asked.interface.skin, pieces)
        if asked.loading.approach is not None:
            pressure = press_to_approach(pieces, gap, asked.loading.approach, angle)
        else:
            pressure = press(pieces, gap, asked.loading.load, moment, angle, spring=spring)
    return pieces, pressure, skin, strips


def with_linear_skin(asperities, pieces: Compliance) -> Compliance:
    """The pieces with the diagonal compliance of a linear skin in series; a skin without a tangential ratio is rigid in
    shear."""
    crush = 1 / (asperities.normal_stiffness * pieces.interface.weight)
    ratio = asperities.tangential_ratio
    tangential = (
        pieces.tangential + np.diag(crush / ratio) if ratio is not None else pieces.tangential
    )
    return Compliance(
        pieces.interface, frozen_array(pieces.normal + np.diag(crush)), frozen_array(tangential)
    )
