"""Both pieces and their interface as three named blocks of cells with fields and codes."""

from dataclasses import dataclass

import numpy as np

# Codes of the cell types of VTK.
LINE = 3
TRIANGLE = 5
QUAD = 9
NAMES = ("lower", "upper", "interface")
# Parts of the mesh in the order of their codes in `part`; strips exist only
# in a patch that wears in strips.
PARTS = (
    *NAMES,
    "strips",
)
MEANINGS = {
    "stress_error": "contribution of a cell to the estimated error of the stress (Zienkiewicz-Zhu): "
    "sqrt(e/E), where e is the strain energy of the difference between recovered and computed "
    "stress in the cell, and E is the strain energy of both pieces; the squares of all cells "
    "add up to the square of the total error; large values show where the mesh is too coarse; "
    "the total error is only an estimate, not a bound on the error of the stress",
    "status": "contact status: 0 open, 1 stick, 2 slip (FILES.md defines slip)",
}
CODES = {
    "part": dict(enumerate(PARTS)),
    "material": {0: "substrate", 1: "coating"},
    "status": {0: "open", 1: "stick", 2: "slip"},
}


@dataclass(frozen=True, eq=False, slots=True)
class Block:
    """Mesh of one part (a piece, the interface or the strips) with its fields.

    Attributes
    ----------
    points : (n, 3) array
        [m]
    connectivity, offsets, types : array
        Cells in VTK form; offsets has (c + 1,) entries, types (c,).
    point_data, cell_data : dict
        Name -> (n or c, ...) at one time, or (f or 1, n or c, ...) of a series, 1 if constant.
    """

    points: np.ndarray
    connectivity: np.ndarray
    offsets: np.ndarray
    types: np.ndarray
    point_data: dict
    cell_data: dict


def make_block(points, cells: list, point_data: dict, cell_data: dict) -> Block:
    """Return a mesh block with given points and cells.

    Parameters
    ----------
    points : (n, 2) array
        [m]
    cells : list of (c, 2 to 4) arrays
        Node numbers of segments, triangles or quadrilaterals.
    point_data, cell_data : dict
    """
    sizes = np.concatenate([np.full(len(cell), cell.shape[1]) for cell in cells])
    return Block(
        np.column_stack([points, np.zeros(len(points))]),
        np.concatenate([np.ravel(cell) for cell in cells]).astype(np.int64),
        np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        np.array([0, 0, LINE, TRIANGLE, QUAD], np.uint8)[sizes],
        point_data,
        cell_data,
    )


def build_blocks(lower: dict, upper: dict, x, interface: dict, width: float = 0.0) -> dict:
    """Return the mesh blocks of both pieces and their interface as a dict.

    The interface moves with the lower piece.

    Parameters
    ----------
    lower, upper : dict
        "points" (n, 2) [m]; "blocks" of cells numbered from 0; "material" (t,) of all cells;
        "interface" (m,) node numbers in order of x; "displacement" (f, n, 2) [m]; "stress" (f, t,
        4) as xx, yy, zz, xy [Pa]; "mises" (f, t) [Pa]; "stress_error" (f, t) [1]; "bond" name ->
        (f, k), stress below its coating at x, {} without a coating.
    x : (k,) array
        Positions along the interface [m].
    interface : dict
        Name -> (f, k), or (f, s, k) for strips; the block `interface` then has the mean over the
        width, and a block `strips` has all of them.
    width : float
        [m]

    Returns
    -------
    dict of Block
    """
    line = lower["interface"]
    node_x = lower["points"][line, 0]
    move = np.zeros((len(lower["displacement"]), len(x), 3), np.float32)
    for axis in (0, 1):
        move[..., axis] = [
            np.interp(x, node_x, row) for row in lower["displacement"][:, line, axis]
        ]
    areal = {
        name: np.asarray(rows, np.float32) for name, rows in interface.items() if np.ndim(rows) == 3
    }
    means = {name: rows.mean(axis=1) if name in areal else rows for name, rows in interface.items()}
    fields = {"displacement": move} | {
        name: np.asarray(rows, np.int8 if name in CODES else np.float32)
        for name, rows in means.items()
    }
    for side, body in (("lower", lower), ("upper", upper)):
        fields |= {
            f"{name}_{side}": np.asarray(rows, np.float32) for name, rows in body["bond"].items()
        }
    ends = np.stack([np.arange(len(x) - 1), np.arange(1, len(x))], axis=1)
    return {
        "lower": _piece_block(lower),
        "upper": _piece_block(upper),
        "interface": make_block(np.column_stack([x, np.zeros(len(x))]), [ends], fields, {}),
    } | ({"strips": _strips_block(x, width, areal)} if areal else {})


def _strips_block(x, width: float, areal: dict) -> Block:
    """Return a mesh block of strips side by side in the plane of the interface.

    The values (f, s, k) of a strip are constant from edge to edge; the width is along z.
    """
    count, k = next(iter(areal.values())).shape[1:]
    edges = np.linspace(-width / 2, width / 2, count + 1)
    sides = np.stack([edges[:-1], edges[1:]], axis=1).ravel()  # the edges of all strips, in pairs
    low = (np.arange(count)[:, None] * 2 * k + np.arange(k - 1)).ravel()
    block = make_block(
        np.column_stack([np.tile(x, 2 * count), np.zeros(2 * count * k)]),
        [np.stack([low, low + 1, low + k + 1, low + k], axis=1)],
        {name: np.repeat(rows, 2, axis=1).reshape(len(rows), -1) for name, rows in areal.items()},
        {},
    )
    block.points[:, 2] = np.repeat(sides, k)
    return block


def _piece_block(body: dict) -> Block:
    """Return the mesh block of one piece."""
    frames = len(body["displacement"])
    cells = len(body["material"])
    move = np.zeros((frames, len(body["points"]), 3), np.float32)
    move[..., :2] = body["displacement"]
    stress = np.zeros((frames, cells, 6), np.float32)
    stress[..., :4] = body["stress"]
    return make_block(
        body["points"],
        body["blocks"],
        {"displacement": move},
        {
            "stress": stress,
            "von_mises": np.asarray(body["mises"], np.float32),
            "stress_error": np.asarray(body["stress_error"], np.float32),
            "material": np.asarray(body["material"], np.int8)[None],
        },
    )


def merge_blocks(blocks: dict) -> Block:
    """Merge the mesh blocks of one frame into one, with a cell array of part codes.

    Values that a block does not have are NaN, or -1 for codes.
    """
    first = np.cumsum([0, *(len(block.points) for block in blocks.values())])
    ends = np.cumsum([0, *(block.connectivity.size for block in blocks.values())])
    all_of = list(blocks.values())
    part = np.repeat(
        np.array([PARTS.index(name) for name in blocks], np.int8),
        [len(piece.types) for piece in all_of],
    )
    return Block(
        np.concatenate([piece.points for piece in all_of]),
        np.concatenate([piece.connectivity + start for piece, start in zip(all_of, first)]),
        np.concatenate([[0], *(piece.offsets[1:] + start for piece, start in zip(all_of, ends))]),
        np.concatenate([piece.types for piece in all_of]),
        _concatenate_arrays(
            [piece.point_data for piece in all_of], [len(piece.points) for piece in all_of]
        ),
        _concatenate_arrays(
            [piece.cell_data for piece in all_of], [len(piece.types) for piece in all_of]
        )
        | {"part": part},
    )


def _concatenate_arrays(parts: list, sizes: list) -> dict:
    """Concatenate the arrays of several blocks; fill them with NaN or -1 in blocks that lack an array."""
    out = {}
    for name in dict.fromkeys(name for part in parts for name in part):
        like = next(part[name] for part in parts if name in part)
        hole = np.nan if like.dtype.kind == "f" else -1
        out[name] = np.concatenate(
            [
                part[name] if name in part else np.full((size, *like.shape[1:]), hole, like.dtype)
                for part, size in zip(parts, sizes)
            ]
        )
    return out
