"""Fields of both pieces and their interface, frame by frame, for VTK and for the report."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from ...elasticity import coating_traction
from ...elasticity.elasticity import compute_displacement, von_mises
from ...elasticity.recovery import (
    Cells,
    Recovery,
    StressError,
    centre_stress,
    choose_rounding_step,
    estimate_error,
    fit_recovery,
    get_cells,
    make_points,
)
from ...mesh.grid import TensorGrid
from ...runs.results.result import patch_surface
from .blocks import build_blocks
from .strength import find_yielding
from .vtkhdf import write_series

UNITS = {
    "displacement": "m",
    "stress": "Pa",
    "von_mises": "Pa",
    "stress_error": "1",
    "material": "1",
    "normal_stress": "Pa",
    "shear_stress": "Pa",
    "gap": "m",
    "slip": "m",
    "status": "1",
    "worn_depth": "m",
} | {
    f"{name}_{side}": "Pa" for name in ("normal_bond", "shear_bond") for side in ("lower", "upper")
}

# Largest rounding error relative to the estimated error of the stress; it
# increases the total error by 3 %.
ROUNDING_FRACTION = 0.25
FRAMES_PER_PASS = 8  # number of frames that are processed together
# Smallest rounding step relative to the largest stress; such a step is
# invisible in any colour scale.
MIN_STEP_FRACTION = 2.0**-10
# Rounding step relative to the largest displacement; the discretization error is about 1e-4.
DISPLACEMENT_STEP_FRACTION = 2.0**-14


def write_fields(result, path: Path) -> dict:
    """Write the fields of both pieces and the interface to a file, frame by frame.

    Returns the pressed state for the picture of the report, after all wear; only tensor grids have
    it. A stress beyond the yield strength of a named material is added to the notes of the result.
    """
    patch = result.patch
    fields = result.fields
    times = fields["time"]
    interface = {k: v for k, v in fields.items() if k != "time" and not k.startswith("holder_")}
    loads = [_nodal_loads(patch, fields, side) for side in ("lower", "upper")]
    motions = _piece_displacements(patch, loads)
    meshes = [_mesh_and_stress(patch.pair.piece, patch.pair.grid)]
    meshes += (
        meshes
        if patch.pair.upper is patch.pair.piece
        else [_mesh_and_stress(patch.pair.upper, patch.pair.upper_grid)]
    )
    x = patch_surface(patch, fields).x
    low, high = (
        _collect_piece_fields(patch, fields, x, *piece_data)
        for piece_data in zip(("lower", "upper"), meshes, motions)
    )
    for one, other_body in ((low, high), (high, low)):
        one["stress_error"] = one["error"].relative_error(other_body["error"])[0]
    notes = result.extra.setdefault("notes", [])
    peak = result.measures.get("pressure_peak")
    min_peak = 0.0
    if peak is not None and peak.value is not None:
        min_peak = peak.value - (peak.error or 0.0)
    yield_notes = find_yielding(result.plan.model.patch, {"lower": low, "upper": high}, min_peak)
    faces = result.extra.get("yielding_faces", {})
    notes[:] = [text for text in notes if text not in faces.values()]
    notes += [text for text in (faces | yield_notes).values() if text not in notes]
    steps = {"lower": low["steps"], "upper": high["steps"]}
    write_series(
        path,
        build_blocks(low, high, x, interface, result.plan.model.patch.pieces.width),
        times,
        UNITS,
        steps,
    )
    for grid in (patch.pair.grid, patch.pair.upper_grid):
        if not (isinstance(grid, TensorGrid) and grid.is_rectangle):
            return {}
    shape = (patch.x.size - 1, -1)
    n_worn_states = result.extra.get("wear_shown", {"states": 0})["states"]
    return {
        "x": patch.x,
        "pressure": patch.pressure.sigma_n,
        "depth": (patch.pair.grid.depth, patch.pair.upper_grid.depth),
        "coating": (patch.pair.grid.coating_thickness, patch.pair.upper_grid.coating_thickness),
        "mises": [body["mises"][n_worn_states].reshape(shape) for body in (low, high)],
    }


def _nodal_loads(patch, fields: dict, side: str) -> tuple:
    """Return the loads (shear, normal) (1 + f, n) [N/m] on the nodes of a piece.

    The first row is the pressed state; the others are the shear of every frame.

    Parameters
    ----------
    patch : Patch
    fields : dict
    side : {"lower", "upper"}
    """
    sign, at = (-1.0, 0) if side == "lower" else (1.0, 1)
    force = patch.pieces.interface.weight / patch.pieces.interface.width
    tau = fields.get("shear_stress", np.zeros((len(fields["time"]), force.size)))
    shear = patch.pair.forces(np.concatenate([np.zeros((1, force.size)), -sign * tau * force]))[at]
    normal = np.zeros_like(shear)
    normal[0] = patch.pair.forces(patch.pressure.sigma_n * force)[at]
    if "holder_closing" in fields:  # the pressed state changes from frame to frame
        normal[1:] = patch.pair.forces((fields["normal_stress"] - patch.pressure.sigma_n) * force)[
            at
        ]
    return shear, normal


def _piece_displacements(patch, loads: list) -> list:
    """Return the displacements (1 + f, nodes, 2) of both pieces in all frames.

    Equal pieces share one factorisation.
    """
    pair = patch.pair
    if pair.upper is pair.piece:
        displacements = compute_displacement(
            pair.piece, *(np.concatenate(parts) for parts in zip(*loads))
        )
        return np.split(displacements, 2)
    pieces = (pair.piece, pair.upper)
    return [compute_displacement(piece, *load) for piece, load in zip(pieces, loads)]


@dataclass(frozen=True, eq=False, slots=True)
class _PieceFields:
    """Mesh of a piece with the operators that compute its fields.

    Attributes
    ----------
    interface : (m,) array
        Node numbers.
    stress : callable
        Displacements -> stresses of cells.
    cells, rules, recovery
        Cells, Gauss points and stress recovery, for the error estimate of the stress.
    """

    interface: np.ndarray
    stress: Callable
    cells: Cells
    rules: list
    recovery: Recovery


def _mesh_and_stress(piece, grid) -> _PieceFields:
    """Return the mesh, the stress and the stress recovery of a piece."""
    cells = get_cells(piece)
    return _PieceFields(
        grid.pressure_nodes,
        partial(centre_stress, cells),
        cells,
        make_points(cells, "gauss"),
        fit_recovery(cells),
    )


def _collect_piece_fields(patch, fields: dict, x, side: str, piece_fields: _PieceFields, u) -> dict:
    """Return the fields of a piece that are written to a file: mesh, displacement and stress in all frames.

    y points away from the interface.

    Parameters
    ----------
    patch : Patch
    fields : dict
    x : (k,) array
        Positions along the interface [m].
    side : {"lower", "upper"}
    piece_fields : _PieceFields
    u : (1 + f, n, 2) array
        From `_piece_displacements`; its first row is the pressed state.
    """
    lower = side == "lower"
    cells = piece_fields.cells
    frames = len(u) - 1
    sign = -1.0 if lower else 1.0
    out = {
        name: np.empty((frames, *shape), np.float32)
        for name, shape in {
            "displacement": cells.points.shape,
            "stress": (cells.is_coating.size, 4),
            "mises": cells.is_coating.shape,
        }.items()
    }
    errors = []
    largest = 0.0
    for first in range(0, frames, FRAMES_PER_PASS):
        frame_slice = slice(first, first + FRAMES_PER_PASS)
        motion = u[:1] + u[1:][frame_slice]
        stress = piece_fields.stress(motion)
        errors.append(estimate_error(piece_fields.recovery, motion, stress, piece_fields.rules))
        out["mises"][frame_slice] = von_mises(stress)
        out["stress"][frame_slice] = stress * [1.0, 1.0, 1.0, sign]
        largest = max(largest, float(np.abs(motion).max()))
        out["displacement"][frame_slice] = (
            motion * [1.0, sign]
            if lower
            else motion + _holder_motion(patch, fields, cells.points, frame_slice)
        )
    error = StressError(
        *(
            np.concatenate([getattr(frame_error, name) for frame_error in errors])
            for name in ("error", "energy")
        )
    )
    bond = coating_traction.interpolate_coating_traction(
        cells, coating_traction.compute_coating_traction(cells, u), x
    )
    bond = {name: rows[:1] + rows[1:] for name, rows in bond.items()}
    if bond:
        # Like the shear stress of the interface, it is positive along +x on the lower piece.
        bond["shear_bond"] *= -sign
    blocks = [block if not lower else block[:, ::-1] for block in cells.blocks]
    finest = min(
        choose_rounding_step(piece_fields.recovery, error, piece_fields.rules, ROUNDING_FRACTION),
        MIN_STEP_FRACTION * float(out["mises"].max(initial=0.0)),
    )
    return out | {
        "points": cells.points * [1.0, sign],
        "blocks": blocks,
        "interface": piece_fields.interface,
        "material": cells.is_coating,
        "error": error,
        "bond": bond,
        "steps": {
            "stress": finest,
            "von_mises": finest,
            "displacement": DISPLACEMENT_STEP_FRACTION * largest,
        },
    }


def _holder_motion(patch, fields: dict, points, frame_slice: slice) -> np.ndarray:
    """Return the motion (f, n, 2) [m] of points that move with the upper holder."""
    same = np.ones((len(fields["time"][frame_slice]), 1))
    rotation, closing, slide = (
        fields[f"holder_{name}"][frame_slice, None]
        if f"holder_{name}" in fields
        else constant * same
        for name, constant in (
            ("rotation", patch.pressure.rotation),
            ("closing", patch.pressure.approach),
            ("slide", 0.0),
        )
    )
    return np.stack([slide - rotation * points[:, 1], rotation * points[:, 0] - closing], axis=2)
