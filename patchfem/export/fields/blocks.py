"""Both pieces and their interface, or a face, as named blocks of cells with fields, and the table of fields."""

from typing import NamedTuple

import numpy as np

from ...runs.pieces import PieceFields, Pieces

# parts of a run in the order in which they are stored
STORED_PARTS = ("lower", "upper", "interface")
VTK_CELL_TYPES = np.array([0, 1, 3, 5, 9], np.uint8)  # cell type of VTK by number of nodes


class Field(NamedTuple):
    """How a field is stored.

    - unit: SI unit.
    - shape: shape of one value.
    - codes: meanings of its codes 0, 1, ...; empty for a field of numbers.
    """

    unit: str
    shape: tuple[int, ...] = ()
    codes: tuple[str, ...] = ()


VTK_FIELDS = {
    "displacement": Field("m", (3,)),
    "stress": Field("Pa", (6,)),  # xx, yy, zz, xy, yz, xz; tension is positive
    "von_mises": Field("Pa"),
    "stress_error": Field("1"),
    "material": Field("1", codes=("substrate", "coating")),
    "weight": Field("m2"),
    "normal_stress": Field("Pa"),
    "shear_stress": Field("Pa"),
    "gap": Field("m"),
    "slip": Field("m"),
    "holder_slide": Field("m"),
    "status": Field("1", codes=("open", "stick", "slip")),
    "worn_depth": Field("m"),
    "normal_bond_lower": Field("Pa"),
    "normal_bond_upper": Field("Pa"),
    "shear_bond_lower": Field("Pa"),
    "shear_bond_upper": Field("Pa"),
}


class Block(NamedTuple):
    """Mesh with fields.

    - points (n, 3): positions of the nodes [m].
    - cells (c, 2) or (c, 4): node numbers; a triangle has its last node twice.
    - point_data, cell_data: (f, n, ...) or (f, c, ...) by name of the field; f is 1 if it is the
      same in all frames.
    """

    points: np.ndarray
    cells: np.ndarray
    point_data: dict[str, np.ndarray]
    cell_data: dict[str, np.ndarray]

    def vtk_cells(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the cells in VTK form: node numbers, start (c + 1,) in them and type (c,) of each cell."""
        sizes = self.cells.shape[1] - (self.cells[:, -1] == self.cells[:, -2])
        is_corner = np.arange(self.cells.shape[1]) < sizes[:, None]
        starts = np.concatenate([[0], np.cumsum(sizes)])
        return self.cells[is_corner], starts, VTK_CELL_TYPES[sizes]


def make_blocks(pieces: Pieces) -> dict[str, Block]:
    """Return both pieces and their interface as blocks.

    The interface moves with the lower piece.
    """
    x = pieces.x
    fields = {"weight": pieces.weight[None]}
    fields |= pieces.interface
    segments = np.stack([np.arange(x.size - 1), np.arange(1, x.size)], axis=1)
    return {
        "lower": _piece_block(pieces.lower),
        "upper": _piece_block(pieces.upper),
        "interface": Block(_pad_components(x[:, None], 3), segments, _convert_fields(fields), {}),
    }


def make_face_blocks(result) -> dict[str, Block]:
    """Return the face of a run with [contact.area] as a block of quadrilaterals, one per cell, named "interface".

    The writer and the readers of both pieces take such cells, but not the image data of a regular grid.
    """
    patch = result.patch
    rows, columns = patch.shape
    pieces = patch.model.pieces
    x, y = np.meshgrid(
        np.linspace(-pieces.length / 2, pieces.length / 2, columns + 1),
        np.linspace(-pieces.width / 2, pieces.width / 2, rows + 1),
    )
    points = _pad_components(np.stack([x.ravel(), y.ravel()], axis=1), 3)
    first = np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)
    corners = first.ravel()[:, None] + np.array([0, 1, columns + 2, columns + 1])
    fields = {"weight": patch.pieces.interface.weight[None]}
    for name, values in result.fields.items():
        if name in VTK_FIELDS and np.shape(values)[1:] == patch.x.shape:
            fields[name] = values
    return {"interface": Block(points, corners, {}, _convert_fields(fields))}


def _piece_block(piece: PieceFields) -> Block:
    """Return the block of one piece."""
    cells = np.concatenate([block[:, [0, 1, 2, -1]] for block in piece.blocks])
    cell_data = {
        "stress": piece.stress,
        "von_mises": piece.von_mises,
        "stress_error": piece.stress_error,
        "material": piece.is_coating[None],
    }
    point_data = {"displacement": piece.displacement}
    return Block(
        _pad_components(piece.points, 3),
        cells,
        _convert_fields(point_data),
        _convert_fields(cell_data),
    )


def _pad_components(values: np.ndarray, count: int) -> np.ndarray:
    """Return values (..., k) with zeros for the other components (..., count)."""
    missing = (0, count - values.shape[-1])
    return np.pad(values, [*[(0, 0)] * (values.ndim - 1), missing])


def _convert_fields(data: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return fields as they are stored: codes, or numbers in single precision.

    The pressure and the areas of the points stay as they are, so that their sum is the load.
    """
    out = {}
    for name, values in data.items():
        field = VTK_FIELDS[name]
        if field.shape:
            values = _pad_components(values, *field.shape)
        if name not in ("normal_stress", "weight"):
            values = values.astype(np.int8 if field.codes else np.float32)
        out[name] = values
    return out
