"""Solution of the static contact of a patch: condensed pieces, gap, and load or approach.

In: a `PatchModel` and its condensed pieces (`Pair`). Out: a `Patch` with pressure, gap and
compliance.
"""

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
from .approach import press_to_approach_with_rotation
from .condensed import Pair, condense

# ripples over the peak pressure on pieces whose nodes do not match, above which a note states them
RIPPLE = 1e-2


class Surface(NamedTuple):
    """Pressure and gap of an interface on the points of its solution.

    - x (n,): positions [m].
    - weight (n,): areas [m2].
    - sigma_n (n,): normal stress [Pa].
    - gap (n,): gap under load [m].
    - unloaded_gap: gap without load (n,), or (s, n) of strips [m].
    """

    x: np.ndarray
    weight: np.ndarray
    sigma_n: np.ndarray
    gap: np.ndarray
    unloaded_gap: np.ndarray


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True)
class Patch:
    """Solved patch; forces, areas and stiffnesses are those of all pairs together.

    - pair: condensed pieces.
    - pieces: compliance of pieces and skin; a smooth skin is linearised at the operating point.
    - giving (m, m): tangential compliance [m/N] by which the patch slips in part: that of the skin,
      of the pieces with [contact.shear], and of the spring of the holder, which is equal in all
      entries.
    - gap (m,): gap of the unloaded surfaces [m].
    - pressure: ContactState.
    - skin: StripsState with a single strip of a smooth skin, else None.
    - strips: StripsState of a patch in strips, whose means over the width are in `pressure`; else
      None.
    - tangential_ratio: k_t/k_n of the skin; None if it is rigid in shear.
    - skinned: whether a skin of asperities lies between the pieces.
    - jumps: positions [m] at which the gap has a step.
    - sharp: whether an end of the interface is a corner on a face that continues.
    - notes: sentences for the warnings.
    - seconds: CPU seconds by name.
    - sharper: static measures by name as (value, error) from the points of a profile; {} without
      them.
    - averaging: length [m] over which a profile in contact is averaged; None without a profile.
    - either: if a step of the gap is at a node, which belongs half to each side: (weight, Patch)
      with the whole node on the higher side, and the same on the lower side; else ().
    - fine: Surface on the points of a profile; None if the mesh is the finest solution.
    - stretches (k, 2): parts in contact on these points [m].
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
        """Surface on the nodes of the mesh."""
        return Surface(
            self.x, self.pieces.interface.weight, self.pressure.sigma_n, self.pressure.gap, self.gap
        )

    @property
    def x(self) -> np.ndarray:
        """Positions of the interface nodes (m,) [m]."""
        return self.pieces.interface.x

    @property
    def skin_share(self) -> np.ndarray | None:
        """Fraction (m,) [1] of the asperities in the compliance of each node; None for bare pieces."""
        if not self.skinned:
            return None
        bare = np.diag(self.pair.compliance.normal)
        if self.strips is None:
            return 1 - bare / np.diag(self.pieces.normal)
        stiff = self.strips.stiffness.max(axis=0) * self.pieces.interface.weight
        return 1 / (1 + bare * stiff)

    @property
    def active(self) -> np.ndarray:
        """Contact set (m,) of bool: the nodes that carry pressure."""
        return self.pressure.sigma_n > 0


def solve(patch_model, grid, upper_grid=None, fresh: bool = False) -> Patch:
    """Assemble and condense the pieces of a `PatchModel`, and solve the contact.

    Parameters
    ----------
    patch_model : PatchModel
    grid, upper_grid : TensorGrid or PieceMesh
        Meshes from `make_piece_meshes`; the upper one is None if the pieces are alike.
    fresh : bool
        Whether to ignore operators kept on disk.

    Raises
    ------
    PatchfemError
        As in `press_patch`, and by the contact solver.
    """
    return press_patch(patch_model, condense(patch_model, grid, upper_grid, fresh))


def press_patch(patch_model, pair: Pair, worn=None) -> Patch:
    """Solve the contact of a pair with the shapes, the load and the holder of a `PatchModel`.

    A pair serves any number of models.

    Parameters
    ----------
    patch_model : PatchModel
    pair : Pair
    worn : (m,) or (s, m), optional
        Depth [m] that wear has added to the gap, of strips (s, m).

    Raises
    ------
    PatchfemError
        If a profile does not fit the mesh.
    """
    x = pair.compliance.interface.x
    gap, notes, seconds = patch_model.gap.evaluate(x)
    gap = gap + pair.rise if worn is None else gap + pair.rise + worn
    rim = patch_model.gap.half_step_heights(x)
    out = _on(patch_model, pair, gap, notes, seconds)
    if (
        pair.joint is not None
        and pair.joint.ripple > RIPPLE
        and zigzags(out.x, out.pressure.sigma_n) > RIPPLE
    ):
        out = replace(out, notes=(*notes, f"contact.mesh: {pair.joint.reason}"))
    if not rim.any():
        return out
    # A contact set ends less than half a cell beyond its last node. The two sets, with and without
    # the node at the step, are weighted such that the mean end is the step.
    node = int(np.argmax(rim))
    bare = 1.0 if out.skin_share is None else 1 - float(out.skin_share[node])
    lean = bare * edges.edge_offset_fraction(
        1.0 if pair.row is None else pair.row / float(np.diff(x[node - 1 : node + 2]).min())
    )
    shifts = _shifts_at_step(node, gap if worn is None else gap - worn, rim, worn)
    return replace(
        out,
        either=tuple(
            (0.5 - side * lean, _on(patch_model, pair, gap + shift, notes, seconds))
            for side, shift in zip((-1, 1), shifts)
        ),
    )


def _shifts_at_step(node: int, gap, rim, worn) -> tuple:
    """Return the changes of the gap (m,) [m] for a step's node on its higher and lower side.

    The worn depth of the node belongs to a gap at half the height of the step. If the node carries
    pressure, it has worn like its neighbour on the higher side of the step, else like the one on
    the lower side.
    """
    if worn is None:
        return -rim, rim
    higher = node + 1
    lower = node - 1
    if np.mean(gap[..., lower]) < np.mean(gap[..., higher]):
        higher, lower = lower, higher
    shifts = []
    for side, neighbour in ((-1, higher), (1, lower)):
        shift = np.broadcast_to(side * rim, worn.shape).copy()
        shift[..., node] += worn[..., neighbour] - worn[..., node]
        shifts.append(shift)
    return tuple(shifts)


def zigzags(x, sigma) -> float:
    """Return the largest zigzag of pressures sigma (m,) [Pa] at x (m,) [m] over their peak.

    Three loaded nodes in sequence lie above, below and above the lines through their neighbours, or
    the other way round; the zigzag is half the smallest distance from these lines.
    """
    share = np.diff(x)[:-1] / (x[2:] - x[:-2])
    off = sigma[1:-1] - (1 - share) * sigma[:-2] - share * sigma[2:]
    three = np.stack([off[:-2], -off[1:-1], off[2:]])
    bears = np.min([sigma[k : sigma.size - 4 + k] for k in range(5)], axis=0, initial=np.inf) > 0
    alike = bears & ((three > 0).all(axis=0) | (three < 0).all(axis=0))
    return float(
        np.abs(three[:, alike]).min(axis=0).max(initial=0.0) / 2 / sigma.max(initial=1e-300)
    )


def _on(patch_model, pair: Pair, gap, notes: tuple, seconds: dict) -> Patch:
    """Solve the contact of a pair on the gap (m,) [m]."""
    begin = perf_counter()
    how = _choose_solver(patch_model)(patch_model, pair.compliance, gap)
    return as_patch(patch_model, pair, gap, notes, seconds | {"press": perf_counter() - begin}, how)


def as_patch(patch_model, pair: Pair, gap, notes: tuple, seconds: dict, how: tuple) -> Patch:
    """Return the Patch of a solved pair.

    Parameters
    ----------
    patch_model : PatchModel
    pair : Pair
    gap : (m,)
        Unloaded gap [m].
    notes : tuple
    seconds : dict
        CPU seconds by name.
    how : tuple
        Compliance with its skin, ContactState, skin, strips.
    """
    pieces, pressure, skin, strips = how
    giving = pieces.tangential
    if not patch_model.interface.has_shear:
        giving = frozen_array(giving - pair.compliance.tangential)
    if patch_model.loading.tangential_stiffness:
        giving = frozen_array(giving + 1 / patch_model.loading.tangential_stiffness)
    ratio = (
        patch_model.interface.skin.tangential_ratio
        if patch_model.interface.skin is not None
        else None
    )
    return Patch(
        pair,
        pieces,
        giving,
        frozen_array(gap),
        pressure,
        skin,
        strips,
        ratio,
        patch_model.interface.skin is not None,
        patch_model.gap.jumps,
        patch_model.has_singular_ends,
        notes,
        pair.seconds | seconds,
        averaging=patch_model.gap.averaging_length(pieces.interface.x, pressure.sigma_n > 0),
    )


def areas(patch_model, interface) -> np.ndarray:
    """Return the nodal areas (m,) [m2] of a `PatchModel` on an interface; (s, m) for strips."""
    if patch_model.interface.strips is None:
        return interface.weight
    count = patch_model.interface.strips.count
    return np.repeat(interface.weight[None] / count, count, axis=0)


def make_force_function(patch_model, pair: Pair):
    """Return a function that computes the contact forces on the worn faces of a `PatchModel`.

    It maps worn depth (m,) [m], which is added to the gap, and softening (m,) [m/N], which is added
    to the diagonal of the compliance, to forces (m,) [N]; all are (s, m) for strips. Everything
    that the calls have in common is computed once.

    Raises
    ------
    PatchfemError
        If a profile does not fit the mesh.
    """
    gap = patch_model.gap.evaluate(pair.compliance.interface.x).heights
    gap = gap + pair.rise
    bare = pair.compliance
    how = _choose_solver(patch_model)
    if patch_model.interface.strips is not None:
        return PressedStrips(patch_model, bare, gap)

    def press(worn, softening):
        """Return the contact forces (m,) [N] for worn depth (m,) [m] and softening (m,) [m/N]."""
        soft = replace(bare, normal=bare.normal + np.diag(softening)) if softening.any() else bare
        return how(patch_model, soft, gap + worn)[1].sigma_n * bare.interface.weight

    return press


@dataclass(eq=False, slots=True)
class PressedStrips:
    """Solver of the contact of worn strips, each solution started from the previous contact set.

    `begin` sets the contact set of the start, so that a run after an interruption gives the same
    bits.

    - patch_model: PatchModel.
    - bare: compliance of the pieces without skin.
    - gap (m,): unloaded gap [m].
    - warm_start: contact set and factors of the last solution.
    """

    patch_model: object
    bare: Compliance
    gap: np.ndarray
    warm_start: WarmStart = field(default_factory=WarmStart)

    def begin(self, force) -> None:
        """Start the next solution from the contact set of forces (s, m) [N]."""
        self.warm_start.contact_set = np.asarray(force) > 0

    def __call__(self, worn, softening) -> np.ndarray:
        """Return the contact forces (s, m) [N] for worn depth [m] and softening [m/N], (s, m) each."""
        how = _choose_solver(
            self.patch_model,
            partial(
                _solve_under_load,
                added=softening if softening.any() else None,
                warm_start=self.warm_start,
            ),
        )
        return how(self.patch_model, self.bare, self.gap + worn)[3].force


def _choose_solver(patch_model, under=None):
    """Return the function (patch_model, pieces, gap) that solves the contact of a `PatchModel`.

    It returns (Compliance with its skin, ContactState, skin, strips). under: function for a given
    load; None for `_solve_under_load`.
    """
    under = under or _solve_under_load
    if patch_model.loading.approach is None or not (
        patch_model.loading.can_rotate or patch_model.loading.rotational_stiffness > 0
    ):
        return under
    bare = (
        with_linear_skin
        if patch_model.interface.skin is not None and patch_model.interface.skin.law == "linear"
        else lambda skin, pieces: pieces
    )
    return lambda patch_model, pieces, gap: press_to_approach_with_rotation(
        patch_model, pieces, gap, under, bare(patch_model.interface.skin, pieces)
    )


def _solve_under_load(patch_model, pieces: Compliance, gap, added=None, warm_start=None) -> tuple:
    """Solve the contact under a load, or under an approach with fixed rotation.

    Returns (Compliance with its skin, ContactState, skin, strips). added, warm_start: parameters of
    `StripCompliance`.
    """
    strips = skin = None
    angle = patch_model.gap.angle
    moment = patch_model.loading.moment
    spring = patch_model.loading.rotational_stiffness
    if patch_model.interface.strips is not None:
        pieces, pressure, skin, strips = strip_press.press_strips_of_patch(
            patch_model, pieces, gap, (angle, moment, spring), added, warm_start
        )
    elif patch_model.interface.skin is not None and patch_model.interface.skin.law != "linear":
        pieces, pressure, skin = skin_press.press_through_asperities(
            patch_model, pieces, gap, angle, moment, spring
        )
    else:
        if patch_model.interface.skin is not None:
            pieces = with_linear_skin(patch_model.interface.skin, pieces)
        if patch_model.loading.approach is not None:
            pressure = press_to_approach(pieces, gap, patch_model.loading.approach, angle)
        else:
            pressure = press(pieces, gap, patch_model.loading.load, moment, angle, spring=spring)
    return pieces, pressure, skin, strips


def with_linear_skin(asperities, pieces: Compliance) -> Compliance:
    """Return the pieces in series with the diagonal compliance of a linear asperity layer.

    A skin without a tangential ratio is rigid in shear.
    """
    crush = 1 / (asperities.normal_stiffness * pieces.interface.weight)
    ratio = asperities.tangential_ratio
    tangential = (
        pieces.tangential + np.diag(crush / ratio) if ratio is not None else pieces.tangential
    )
    return Compliance(
        pieces.interface, frozen_array(pieces.normal + np.diag(crush)), frozen_array(tangential)
    )
