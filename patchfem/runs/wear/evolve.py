"""Wear of a patch over many cycles: a loop of pressing, moving and wearing, in jumps of many cycles each.

In: a model with [wear], its solved patch and the same patch on coarser meshes. Out: `WornPatch`.
The state is saved after every jump. A run that continues from a saved state gives bitwise the same
results as an uninterrupted run.
"""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, array_dataclass, frozen_array
from ...model import layer_heights
from ...model.patch import PatchPiece
from ...model.wear import interpolate_nodes
from ...time_steps.checkpoint import RETRY_ADVICE, read_state, write_state
from ...wear import rough_layer
from ...wear.depth import Press, wear_rates
from ...wear.jumps import (
    LastJump,
    WearProblem,
    WearState,
    make_initial_wear_state,
    replay_jumps,
    take_jump,
)
from ..patch import area
from ..patch.measures import with_static_measures
from ..patch.press import (
    Patch,
    Patches,
    make_contact_force_function,
    solve_patch_contact,
)
from ..patch.values import compute_static_values
from ..results.patch_rows import Values
from .slip import (
    CycleSlip,
    bands_slide_independently,
    choose_frame_count,
    compute_cycle_slip,
    slips_uniformly,
)

# Largest remaining fraction of the coating thickness at which the coating counts as worn through.
WORN_THROUGH_FRACTION = 1e-6


class WearMoment(NamedTuple):
    """Contact, slip path and measures of a worn patch after a number of cycles.

    - cycle: number of cycles.
    - depth: worn depth (m,) [m].
    - used: slip path per cycle (m,) [m] in the last jump.
    - pressure, gap (m,): pressure [Pa] and gap under load [m].
    - miss: relative error of the slip path due to the finite number of frames.
    - values: measures of the patch and of the motion by name.
    """

    cycle: float
    depth: np.ndarray
    used: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    miss: float
    values: dict[str, float]


@array_dataclass
class WornPatch:
    """Worn patch with its wear history, on the finest mesh and on coarser meshes.

    - patch, coarse: worn patch, and those on coarser meshes (None for a missing one).
    - state: final state; None if nothing was worn.
    - moments: WearMoment before any wear and after each jump.
    - depths: worn depths (k,) [m] on the nodes of each coarser mesh.
    - seconds: CPU seconds.
    - stopped: reason why the computation ended early; "" if it did not.
    - layer: rough layer that wears, None without one.
    """

    patch: Patch
    coarse: Patches
    state: WearState
    moments: tuple[WearMoment, ...]
    depths: tuple[np.ndarray, ...]
    seconds: float
    stopped: str
    layer: "rough_layer.RoughLayer | None" = None


# State of the wear after the last jump, and the history of all jumps
History = tuple[WearState, tuple[WearMoment, ...]]


class _UnboundedMotion(Exception):
    """Signal that the motion of a worn rig grows without bound, so that no cycle repeats and the wear ends."""


class _Wear:
    """Contact, motion and wear of a patch.

    A motion that does not depend on the wear is computed once, on the unworn patch. A run that
    continues from a saved state then gives bitwise the same results.

    Parameters
    ----------
    model : Model
        Unworn model with [wear].
    patch : Patch
        Unworn patch, solved on its finest mesh.
    """

    def __init__(self, model, patch):
        self.model = model
        self.patch = patch
        self.layer = find_rough_layer(model, patch)
        self.problem = WearProblem(
            _make_force_function(patch, self.layer),
            self.move,
            patch.pieces.interface.weight,
            model.wear.coefficient,
            model.wear.cycles,
        )
        self.is_same_motion = (
            model.grooves is None
            and model.wear.friction is None
            and not bands_slide_independently(model)
            and slips_uniformly(model)
        )
        self.last: CycleSlip | None = None

    def move(self, worn) -> np.ndarray:
        """Return the slip path (m,) [m] per cycle at a worn depth [m]."""
        if self.last is None or not self.is_same_motion:
            worn = np.zeros_like(worn) if self.is_same_motion else worn
            patch = self.press(self.patch, worn)
            n_frames = choose_frame_count(self.model.accuracy.tolerance)
            slip = compute_cycle_slip(make_worn_model(self.model, patch, worn), patch, n_frames)
            if slip.outcome is not None:
                raise _UnboundedMotion(slip.outcome.sentence)
            self.last = slip
        return self.last.path

    def press(self, patch, worn) -> Patch:
        """Return an unworn patch, pressed with a worn depth (m,) [m] and the layer that wears."""
        return solve_worn(patch, worn, self.layer)

    def start(self) -> WearState:
        """Return the state before the first jump, which has the worn depth of an earlier run.

        Raises
        ------
        PatchfemError
            If the earlier run had other surfaces, or wore through a coating.
        """
        earlier_run = self.model.wear.start
        axes = _list_axes(self.patch)
        if earlier_run is not None:
            earlier_run.require_same_surfaces(axes, self.patch.unloaded_gap)
        depth = self.model.wear.compute_earlier_depth(axes, self.problem.area)
        if (coating := find_worn_through_coating(self.model, depth)) is not None:
            raise PatchfemError(
                f"{earlier_run.path}: in that run the coating of the {coating.name} piece was worn through; choose a "
                "run in which this coating was not worn through",
                "wear.start",
            )
        return make_initial_wear_state(self.problem, depth)

    def jump(self, state: WearState) -> WearState:
        """Return the state of wear after the next jump of cycles; the jump ends early if a coating is worn through."""

        def jump_to(cycle: float) -> WearState:
            """Compute the state after a jump that ends at a given cycle or earlier."""
            wear = self.model.wear
            return take_jump(
                self.problem, state, self.model.accuracy.tolerance, wear.jumps, until=cycle
            )

        def find_excess(cycle: float) -> float:
            """Return the worn fraction of the coating that is most worn after a jump to a cycle, minus 1."""
            end = state if cycle == state.cycle else jump_to(cycle)
            return max(list_worn_pieces(self.model, end.depth)).fraction - 1

        end = jump_to(self.find_next_table_row(state))
        if max(list_worn_pieces(self.model, end.depth)).fraction <= 1 + WORN_THROUGH_FRACTION:
            return end

        # scipy.optimize takes half a second to import, and most runs never wear a coating through.
        from scipy.optimize import brentq

        # The wear rate changes little within a jump, so that the worn fraction is exact to WORN_THROUGH_FRACTION.
        xtol = 0.1 * WORN_THROUGH_FRACTION * (end.cycle - state.cycle)
        return jump_to(brentq(find_excess, state.cycle, end.cycle, xtol=xtol))

    def find_next_table_row(self, state: WearState) -> float:
        """Return the last cycle that a jump may reach without skipping a row of the friction table; inf without one.

        At this cycle, with the present wear rate, the mean worn depth reaches the next row of the
        table; or the row after it, if the next row is nearer than a tenth of their distance. A longer
        jump would skip the values of a row.
        """
        wear = self.model.wear
        depth = compute_mean_worn_depth(self.patch, state.depth)
        rates = wear_rates(wear.coefficient, state.path, self.problem.area) * state.force
        rate = compute_mean_worn_depth(self.patch, rates)
        rows = []
        if wear.friction is not None and not wear.jumps and rate > 0:
            rows = [row for row in wear.friction.depth if row > depth]
        if not rows:
            return np.inf
        # Smallest distance to the next row of the friction table, relative to the row spacing, at
        # which a jump ends at this row.
        is_near = len(rows) > 1 and rows[0] - depth < 0.1 * (rows[1] - rows[0])
        return state.cycle + (rows[is_near] - depth) / rate

    def record(self, patch, state: WearState) -> WearMoment:
        """Return contact, slip path and measures of the patch, solved with the worn depth of a state, as a WearMoment."""
        worn = make_worn_model(self.model, patch, state.depth)
        values = compute_values(patch) | self.last.values
        values |= compute_worn_values(patch, state.depth, self.layer)

        # Wear changes the grooves and, by a table, the friction law.
        if self.model.grooves is not None:
            values["groove_amplitude"] = 0.0 if worn.grooves is None else worn.grooves.amplitude
        if self.model.wear.friction is not None:
            values["static_coefficient"] = worn.friction.static
            if worn.friction.bond_length is not None:
                values["bond_length"] = worn.friction.bond_length
        pressed = patch.pressure
        fields = (state.depth, state.jump.path, pressed.sigma_n, pressed.gap)
        return WearMoment(state.cycle, *fields, self.last.error, values)

    def replay(self, mesh, moments) -> tuple[Patch, np.ndarray]:
        """Repeat the jumps of the run on the unworn patch of another mesh; return the worn patch and its depth [m].

        The slip paths of the `moments` are interpolated.
        """
        areas = mesh.pieces.interface.weight
        axes = _list_axes(mesh)
        jumps = []
        for before, after in pairwise(moments):
            path = interpolate_nodes(_list_axes(self.patch), after.used, axes)
            jumps.append((after.cycle - before.cycle, path))
        wear = self.model.wear
        depth = wear.compute_earlier_depth(axes, areas)
        press = _make_force_function(mesh, self.layer)
        depth = replay_jumps(press, areas, wear.coefficient, jumps, depth)
        return self.press(mesh, frozen_array(depth)), depth


def compute_mean_worn_depth(patch, depth) -> float:
    """Return the mean worn depth [m] of a patch, i.e. worn volume divided by area.

    `depth` [m] is the worn depth (m,).
    """
    weight = patch.pieces.interface.weight
    return float(depth @ weight / weight.sum())


def make_worn_model(model, patch, depth):
    """Return the model with the grooves and the friction law at the mean worn depth.

    It is unchanged if neither depends on wear.

    Parameters
    ----------
    model : Model
        Unworn model with [wear].
    patch : Patch
        Patch on whose nodes the depth is given.
    depth : (m,)
        Worn depth [m].
    """
    wear = model.wear
    mean_depth = compute_mean_worn_depth(patch, depth)
    if model.grooves is not None:
        model = replace(model, grooves=model.grooves.after_wear(mean_depth, wear.upper_share))
    if wear.friction is None:
        return model

    # The friction of a rig is also that of its interface.
    law = wear.friction.compute_worn_law(model.friction, mean_depth)
    return replace(model, friction=law, rig=model.rig and model.rig.with_law(law))


def compute_wear(
    model, patch, coarse, progress=None, initial: "History | None" = None, store=None
) -> WornPatch:
    """Compute the wear of a patch over all cycles of a model with [wear], in jumps over many cycles.

    Parameters
    ----------
    model : Model
        Unworn model with [wear].
    patch : Patch
        Unworn patch, solved on its finest mesh.
    coarse : sequence of Patch or None
        The unworn patch solved on two coarser meshes, on which the same jumps are repeated to estimate the error; None for
        a mesh that does not exist.
    progress : callable, optional
        Called with the completed fraction of the cycles.
    initial : tuple, optional
        WearState (worn depth, cycle, length of the next jump) and tuple of WearMoments, with which an interrupted run goes
        on.
    store : callable, optional
        Called with WearState and WearMoments after each jump, to save them.

    Returns
    -------
    WornPatch
    """
    clock = process_time()
    n_cycles = model.wear.cycles
    wear = _Wear(model, patch)
    state, moments = initial or (None, ())

    # A motion without bound has no slip path, so that no wear is computed for it.
    stop_reason = ""
    try:
        if state is None:
            state = wear.start()
            if model.wear.start is not None:
                patch = wear.press(patch, frozen_array(state.depth))
            moments = (wear.record(patch, state),)
        else:
            patch = wear.press(patch, frozen_array(state.depth))

        # Press, move and wear, jump by jump
        while state.cycle < n_cycles and find_worn_through_coating(model, state.depth) is None:
            state = wear.jump(state)
            patch = wear.press(patch, frozen_array(state.depth))
            moments = (*moments, wear.record(patch, state))
            if store is not None:
                store(state, moments)
            if progress is not None:
                progress(state.cycle / n_cycles)
    except _UnboundedMotion as reason:
        stop_reason = f"nothing was worn: {reason}"
        if state is not None:
            stop_reason = (
                f"wear was computed only up to cycle {state.cycle:.6g} of {n_cycles:.6g}: {reason}"
            )

    # The jumps are repeated on coarser meshes for the errors. Without any jump, this adds the wear of an earlier run.
    meshes = [mesh for mesh in coarse if mesh is not None]
    replayed = [wear.replay(mesh, moments) for mesh in meshes]
    worn = (*(worn for worn, _ in replayed), *[None] * (len(coarse) - len(meshes)))
    add_measures = area.with_face_measures if model.patch.area else with_static_measures
    patch, *worn = add_measures((patch, *worn), model.accuracy.tolerance)
    depths = tuple(depth for _, depth in replayed)
    seconds = process_time() - clock
    return WornPatch(patch, tuple(worn), state, moments, depths, seconds, stop_reason, wear.layer)


class WornPiece(NamedTuple):
    """Part of the wear that one piece of a patch has.

    - fraction: worn fraction of the thickness of its coating at the deepest point; 0 without a coating.
    - name: "upper" or "lower".
    - depth: largest depth that is worn off it [m].
    - piece: the piece.
    """

    fraction: float
    name: str
    depth: float
    piece: PatchPiece


def list_worn_pieces(model, depth) -> list[WornPiece]:
    """Return both pieces, each with its part of the largest worn depth [m], which the scene divides among them.

    `depth` (m,) [m] is the worn depth of both together.
    """
    largest = float(depth.max(initial=0.0))
    share = model.wear.upper_share
    worn = []
    for name, own_share in (("upper", share), ("lower", 1 - share)):
        piece = getattr(model.patch.pieces, name)
        own_depth = own_share * largest
        fraction = own_depth / piece.thickness if piece.coating is not None else 0.0
        worn.append(WornPiece(fraction, name, own_depth, piece))
    return worn


def find_worn_through_coating(model, depth) -> WornPiece | None:
    """Return the piece whose coating is worn through at a worn depth, or None if there is none.

    `depth` [m] is the worn depth of both pieces together (m,).
    """
    most_worn = max(list_worn_pieces(model, depth))
    return most_worn if most_worn.fraction >= 1 - WORN_THROUGH_FRACTION else None


def _list_axes(patch) -> tuple[np.ndarray, ...]:
    """Return the positions [m] of the nodes of a patch, (x,), or of the rows and columns of cells of a face, (y, x)."""
    cells = patch.pieces.normal
    return (patch.x,) if patch.model.area is None else (cells.y, cells.x)


def solve_worn(patch, worn, layer: "rough_layer.RoughLayer | None" = None):
    """Solve the contact of a patch again on its mesh or cells, with a worn depth (m,) [m] added to its unworn gap.

    Tops of a rough layer that wears lose more height than this depth, so that the gap under load opens further; the
    unloaded gap remains that of the mean surfaces.

    Parameters
    ----------
    patch : Patch
        Patch on its mesh or cells.
    worn : (m,) array
        Depth [m] worn off both pieces.
    layer : RoughLayer, optional
        Layer that wears.
    """
    opening = worn if layer is None else frozen_array(layer.measure_opening(worn))
    if patch.model.area is not None:
        pressed = area.press_worn(patch, opening)
    else:
        pressed = solve_patch_contact(patch.model, patch.pair, opening, coarse=patch)
    if layer is None:
        return pressed
    return replace(pressed, unloaded_gap=frozen_array(pressed.unloaded_gap - opening + worn))


def find_rough_layer(model, patch) -> "rough_layer.RoughLayer | None":
    """Return the rough layer of a patch that wears, with the tops that the load has pressed flat; None without one.

    Parameters
    ----------
    model : Model
        Unworn model with [wear].
    patch : Patch
        Unworn patch.
    """
    skin = model.patch.interface.skin
    if skin is None or skin.hardness is None:
        return None
    pressure = patch.normal_stress
    force = pressure * patch.pieces.interface.weight
    is_upper = model.patch.gap.side == "upper"
    share = model.wear.upper_share if is_upper else 1 - model.wear.upper_share
    mean_pressure = float(force @ pressure / force.sum()) if force.any() else 0.0
    heights = layer_heights.read_layer_heights(model.patch)
    return rough_layer.make_rough_layer(heights, skin.hardness, mean_pressure, share)


def compute_values(patch) -> Values:
    """Return the values of all static measures of a patch by name, in SI units."""
    if patch.model.area is not None:
        return area.compute_face_values(patch)
    return compute_static_values(patch)


def _make_force_function(patch, layer: "rough_layer.RoughLayer | None") -> Press:
    """Return the contact forces [N] of a patch as a function of worn depth and softening; `layer` is one that wears."""
    if patch.model.area is not None:
        press = area.make_force_function(patch)
    else:
        press = make_contact_force_function(patch.model, patch.pair)
    return press if layer is None else rough_layer.make_rough_press(press, layer)


def compute_worn_values(patch, depth, layer: "rough_layer.RoughLayer | None" = None) -> Values:
    """Return worn volume, worn depth, and what a rough layer has lost, by the names of their measures, in SI units.

    Parameters
    ----------
    patch : Patch
        Worn patch.
    depth : (m,) array
        Worn depth [m] at its nodes.
    layer : RoughLayer, optional
        Layer that wears.
    """
    weight = patch.pieces.interface.weight
    values = {
        "worn_volume": float(np.vdot(depth, weight)),
        "worn_depth_max": float(depth.max(initial=0.0)),
    }
    if layer is not None:
        pressure = patch.normal_stress
        touching = layer.measure_touching_part(depth, pressure) * (pressure > 0)
        values |= {
            "worn_depth_mean": compute_mean_worn_depth(patch, depth),
            "worn_top_height": float(layer.measure_lost_height(depth).max(initial=0.0)),
            "touching_fraction": float(touching @ weight / weight.sum()),
        }
    return values


def save_wear_state(
    path: Path, key: str, state: WearState, moments: tuple[WearMoment, ...]
) -> None:
    """Write a wear state and its history to a file, which is replaced atomically.

    Parameters
    ----------
    path : Path
        File of the saved state.
    key : str
        Hash of scene and version.
    state : WearState
        State after the last jump.
    moments : tuple of WearMoment
        States after each jump so far.
    """
    rows = [(*moment[:-1], list(moment.values.items())) for moment in moments]
    write_state(path, key, ([getattr(state, name) for name in WearState.__slots__], rows))


def load_wear_state(path: Path, key: str) -> History:
    """Read a wear state and its history from a file.

    Raises
    ------
    PatchfemError
        If the state belongs to another scene or cannot be read.
    """
    if not path.is_file():
        raise make_missing_state_error(path)
    (*fields, jump), rows = read_state(path, key)
    moments = (WearMoment(*fields_of_moment, dict(values)) for *fields_of_moment, values in rows)
    return WearState(*fields, LastJump(*jump)), tuple(moments)


def make_missing_state_error(path: Path) -> PatchfemError:
    """Return the exception for a run folder that has no saved state.

    `path` is that of the missing file.
    """
    return PatchfemError(
        f"{path.parent.name.removesuffix('.partial')}: this folder contains no interrupted run; {RETRY_ADVICE}"
    )
