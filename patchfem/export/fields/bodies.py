"""The bodies and their interface frame by frame: what a run writes for VTK and draws in its report."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...elasticity import coating_bond, elasticity
from ...elasticity.elasticity import Piece, von_mises
from ...elasticity.recovery import Cells, Recovery, cells_of, harmless_step, indicator, quadratures, recovery
from .blocks import blocks_of
from .vtkhdf import write_series

UNITS = {"displacement": "m", "stress": "Pa", "von_mises": "Pa", "stress_error": "1", "material": "1",
         "normal_stress": "Pa", "shear_stress": "Pa", "gap": "m", "slip": "m", "status": "1", "worn_depth": "m"} | {
    f"{name}_{side}": "Pa" for name in ("normal_bond", "shear_bond") for side in ("lower", "upper")}

SHARE = 0.25  # of the estimated error of the stress that rounding may add to it: sqrt(1 + 1/16) is 3 % more
FINEST = 2.0**-10  # of the largest value: a step of rounding that no scale of colours shows
DEFORMED = 2.0**-14  # of the largest displacement of a piece in its holder: its error in space is of the order of 1e-4


def write_fields(result, path: Path) -> dict:
    """Write both bodies and the interface of one pair, frame by frame.

    Returns the pressed state for the report's picture, after all wear; it is drawn for tensor grids only.
    """
    patch, fields = result.patch, result.fields
    times = fields["time"]
    interface = {k: v for k, v in fields.items() if k != "time" and not k.startswith("holder_")}
    loads = [_loads(patch, fields, side) for side in ("lower", "upper")]
    motions = _motions(patch, loads)
    insides = [_inside(patch.pair.piece, patch.pair.grid)]
    insides += insides if patch.pair.upper is patch.pair.piece else [_inside(patch.pair.upper, patch.pair.upper_grid)]
    low, high = (_body(patch, fields, *of) for of in zip(("lower", "upper"), insides, motions))
    for one, other in ((low, high), (high, low)):
        one["stress_error"] = one["error"].shares(other["error"])[0]
    steps = {"lower": low["steps"], "upper": high["steps"]}
    write_series(path, blocks_of(low, high, patch.x, interface), times, UNITS, steps)
    if not isinstance(patch.pair.piece, Piece):
        return {}
    shape, shown = (patch.x.size - 1, -1), result.extra.get("wear_shown", {"states": 0})["states"]
    return {"depth": (patch.pair.grid.depth, patch.pair.upper_grid.depth),
            "mises": [body["mises"][shown].reshape(shape) for body in (low, high)]}


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
    how = _solver(pair.piece).displacement
    if pair.upper is pair.piece:
        both = how(pair.piece, *(np.concatenate(parts) for parts in zip(*loads)))
        return np.split(both, 2)
    return [how(piece, *load) for piece, load in zip((pair.piece, pair.upper), loads)]


def _solver(piece):
    """The module that solves inside a piece, loaded where one is of its kind."""
    if isinstance(piece, Piece):
        return elasticity
    from ...elasticity import substructure

    return substructure


@dataclass(frozen=True, eq=False, slots=True)
class _Inside:
    """What the fields of a piece are made with, once for two pieces alike.

    points: (n, 2) [m] as x and depth; blocks: of cells; interface: (m,) node numbers; stress: cell stresses of motions.
    """

    points: np.ndarray
    blocks: list
    interface: np.ndarray
    stress: Callable
    cells: Cells
    rules: list
    found: Recovery


def _inside(piece, grid) -> _Inside:
    cells = cells_of(piece)
    if isinstance(piece, Piece):
        points, blocks, interface = cells.points, [piece.cells], np.arange(0, len(cells.points), grid.depth.size)
    else:
        points, blocks, interface = grid.points, list(cells.blocks), grid.interface
    how = _solver(piece).cell_stress
    return _Inside(points, blocks, interface, lambda u: how(piece, u)[0], cells, quadratures(cells), recovery(cells))


def _body(patch, fields: dict, side: str, inside: _Inside, u) -> dict:
    """One piece for the fields file: its mesh, displacement and stress in every frame, y away from the interface;
    u: of `_motions`, whose pressed state is that of the first frame."""
    lower = side == "lower"
    sign, cells, stress = -1.0 if lower else 1.0, inside.cells, inside.stress(u)
    u, stress = u[:1] + u[1:], stress[:1] + stress[1:]
    error = indicator(inside.found, u, stress, inside.rules)
    bond = coating_bond.at(cells, coating_bond.bond_line(cells, u, inside.rules), patch.x)
    if bond:
        bond["shear_bond"] *= -sign  # on the lower piece along +x, as the interface shear
    stress = stress * [1.0, 1.0, 1.0, sign]
    move = u * [1.0, sign]
    if not lower:
        move += _rigid(patch, fields, inside.points)
    blocks = [block if not lower else block[:, ::-1] for block in inside.blocks]
    mises = von_mises(stress)
    finest = min(harmless_step(inside.found, error, inside.rules, SHARE), FINEST * float(mises.max(initial=0.0)))
    steps = {"stress": finest, "von_mises": finest, "displacement": DEFORMED * float(np.abs(u).max(initial=0.0))}
    return {"points": inside.points * [1.0, sign], "blocks": blocks, "interface": inside.interface,
            "displacement": move, "material": cells.is_coating, "stress": stress, "mises": mises,
            "error": error, "bond": bond, "steps": steps}


def _rigid(patch, fields: dict, points) -> np.ndarray:
    """Motion (f, n, 2) [m] of the upper holder at the places (n, 2) [m]."""
    same = np.ones((len(fields["time"]), 1))
    rotation, closing, slide = (fields[f"holder_{name}"][:, None] if f"holder_{name}" in fields else constant * same
                                for name, constant in (("rotation", patch.pressure.rotation),
                                                       ("closing", patch.pressure.approach), ("slide", 0.0)))
    return np.stack([slide - rotation * points[:, 1], rotation * points[:, 0] - closing], axis=2)
