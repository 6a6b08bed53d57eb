"""The bodies and their interface frame by frame: what a run writes for VTK and draws in its report."""

from pathlib import Path

import numpy as np

from ...elasticity import coating_bond, elasticity, substructure
from ...elasticity.elasticity import Piece, von_mises
from ...elasticity.recovery import cells_of, indicator, recovery
from .vtkhdf import bodies, write_series


def write_fields(result, path: Path) -> dict:
    """Write both bodies and the interface of one pair, frame by frame.

    Returns the pressed state for the report's picture, after all wear; it is drawn for tensor grids only.
    """
    patch, fields = result.patch, result.fields
    times = fields["time"]
    interface = {k: v for k, v in fields.items() if k != "time" and not k.startswith("holder_")}
    loads = [_loads(patch, fields, side) for side in ("lower", "upper")]
    low, high = (_body(patch, fields, side, motion) for side, motion in zip(("lower", "upper"), _motions(patch, loads)))
    for one, other in ((low, high), (high, low)):
        one["stress_error"] = one["error"].shares(other["error"])[0]
    joined = [interface] if patch.pair.joint is None else \
        [_moved(interface, patch.x, body.x) for body in (patch.pair.grid, patch.pair.upper_grid)]
    points, blocks, point_data, cell_data = bodies(low, high, *joined)
    units = {"displacement": "m", "stress": "Pa", "von_mises": "Pa", "part": "1", "material": "1",
             "normal_stress": "Pa", "shear_stress": "Pa", "gap": "m", "slip": "m", "status": "1", "worn_depth": "m",
             "stress_error": "1", "normal_bond": "Pa", "shear_bond": "Pa"}
    used = {k: v for k, v in units.items() if k in point_data or k in cell_data}
    write_series(path, points, blocks, times, point_data, cell_data, used)
    if not isinstance(patch.pair.piece, Piece):
        return {}
    shape, shown = (patch.x.size - 1, -1), result.extra.get("wear_shown", {"states": 0})["states"]
    return {"depth": (patch.pair.grid.depth, patch.pair.upper_grid.depth),
            "mises": [body["mises"][shown].reshape(shape) for body in (low, high)]}


def _moved(interface: dict, x, nodes) -> dict:
    """Fields (f, m) at x read off at the nodes of a piece; a status is that of the nearest point."""
    nearest = np.abs(np.subtract.outer(nodes, x)).argmin(axis=1)
    return {name: rows[:, nearest] if name == "status" else np.array([np.interp(nodes, x, row) for row in rows])
            for name, rows in interface.items()}


def _loads(patch, fields: dict, side: str) -> tuple:
    """Loads (shear, normal) (1 + f, n) [N/m] on the nodes of a piece: the pressed state, then the shear of every
    frame."""
    sign, at = (-1.0, 0) if side == "lower" else (1.0, 1)
    force = patch.pieces.interface.weight / patch.pieces.interface.width
    tau = fields.get("shear_stress", np.zeros((len(fields["time"]), force.size)))
    shear = patch.pair.forces(np.concatenate([np.zeros((1, force.size)), -sign * tau * force]))[at]
    normal = np.zeros_like(shear)
    normal[0] = patch.pair.forces(patch.pressure.sigma_n * force)[at]
    if "holder_closing" in fields:  # the pressed state changes from frame to frame
        normal[1:] = patch.pair.forces((fields["normal_stress"] - patch.pressure.sigma_n) * force)[at]
    return shear, normal


def _motions(patch, loads: list) -> list:
    """Displacements (1 + f, nodes, 2) of both pieces; alike ones share one factorisation."""
    pair = patch.pair
    how = elasticity.displacement if isinstance(pair.piece, elasticity.Piece) else substructure.displacement
    if pair.upper is pair.piece:
        both = how(pair.piece, *(np.concatenate(parts) for parts in zip(*loads)))
        return np.split(both, 2)
    return [how(piece, *load) for piece, load in zip((pair.piece, pair.upper), loads)]


def _body(patch, fields: dict, side: str, u) -> dict:
    """One piece for the fields file: its mesh, displacement and stress in every frame, y away from the interface;
    u: of `_motions`."""
    lower = side == "lower"
    piece, grid = (patch.pair.piece, patch.pair.grid) if lower else (patch.pair.upper, patch.pair.upper_grid)
    sign = -1.0 if lower else 1.0
    points, blocks, interface, stress = _inside(piece, grid, u)
    u, stress, cells = u[:1] + u[1:], stress[:1] + stress[1:], cells_of(piece)
    error = indicator(recovery(cells), u, stress)
    bonded = coating_bond.at(cells, coating_bond.bond_line(cells, u), grid.x)
    if bonded:
        bonded["shear_bond"] *= -sign  # on the lower piece along +x, as the interface shear
    move, stress = u * [1.0, sign], stress * np.array([1.0, 1.0, 1.0, sign])
    if not lower:
        same = np.ones((len(move), 1))
        rotation = patch.pressure.rotation * same if "holder_rotation" not in fields else \
            fields["holder_rotation"][:, None]
        closing = patch.pressure.approach * same if "holder_closing" not in fields else \
            fields["holder_closing"][:, None]
        slide = fields["holder_slide"][:, None] if "holder_slide" in fields else 0.0
        move[..., 0] += slide - rotation * points[:, 1]
        move[..., 1] += rotation * points[:, 0] - closing
    blocks = [block if not lower else block[:, ::-1] for block in blocks]
    return {"points": points * [1.0, sign], "blocks": blocks, "interface": interface, "displacement": move,
            "material": grid.is_coating if hasattr(grid, "is_coating") else piece.is_coating, "stress": stress,
            "mises": von_mises(stress), "error": error, "bond": bonded}


def _inside(piece, grid, u) -> tuple:
    """Inside of a piece displaced by u: (points (n, 2) as x and depth, blocks of cells, interface nodes, cell
    stress)."""
    if isinstance(piece, elasticity.Piece):
        rows = grid.depth.size
        points = np.stack([np.repeat(grid.x, rows), np.tile(grid.depth, grid.x.size)], axis=1)
        return points, [piece.cells], np.arange(0, len(points), rows), elasticity.cell_stress(piece, u)[0]

    blocks = [block for block in (grid.triangles, grid.quads) if len(block)]
    return grid.points, blocks, grid.interface, substructure.cell_stress(piece, u)[0]
