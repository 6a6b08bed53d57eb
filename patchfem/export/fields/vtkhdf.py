"""fields.vtkhdf: named blocks on fixed meshes with fields over time, written and read by h5py.

The file is a vtkMultiBlockDataSet of the format VTKHDF 2.2, which VTK 9.4 and ParaView 5.13 read.
Units are attributes of the arrays.
"""

from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from ...core import Missing, PatchfemError
from ...disk.atomic_write import open_lossy, write_atomically
from ...runs.pieces import (
    PieceFields,
    PieceFrames,
    add_yielding_notes,
    compute_pieces,
    number_distinct_frames,
)
from ..rows import VARIABLES

VTK_CELL_TYPES = np.array([0, 1, 3, 5, 9], np.uint8)  # cell type of VTK by number of nodes
VTKHDF_FILE = "fields.vtkhdf"  # name of the file in a results folder
# Version of the format VTKHDF
VTKHDF_VERSION = np.array([2, 2])
# Fields that every file has, by part.
REQUIRED_FIELDS = {
    "lower": {"displacement", "von_mises"},
    "upper": {"displacement", "von_mises"},
    "interface": {"displacement", "gap", "holder_slide", "normal_stress"},
}
# Rows of all fields by name, and the shape of a value of the fields with components
VTK_FIELDS = VARIABLES["field"]
FIELD_SHAPES = {"displacement": (3,), "stress": (6,)}
# Fields of the cells of a face, which is the only part of its file
REQUIRED_FACE_FIELDS = {"gap", "normal_stress", "weight"}


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


def make_blocks(pieces: PieceFrames) -> dict[str, Block]:
    """Return the meshes of both pieces and of their interface, with their fields, as blocks for a VTKHDF file.

    The interface is a line of segments whose displacement is that of the face of the lower piece.

    Parameters
    ----------
    pieces : PieceFrames
        Displacement, stress and interface fields in f frames, in SI units.

    Returns
    -------
    dict of str to Block
        Blocks `lower`, `upper` and `interface`.
    """
    x = pieces.x
    fields = {"weight": pieces.weight[None]}
    fields |= pieces.interface
    segments = np.stack([np.arange(x.size - 1), np.arange(1, x.size)], axis=1)
    return {
        "lower": _make_piece_block(pieces.lower),
        "upper": _make_piece_block(pieces.upper),
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


def _make_piece_block(piece: PieceFields) -> Block:
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
        if field.dims:
            values = _pad_components(values, *FIELD_SHAPES[name])
        if name not in ("normal_stress", "weight"):
            values = values.astype(np.int8 if field.meanings else np.float32)
        out[name] = values
    return out


class Frames(NamedTuple):
    """Fields of both pieces and their interface, or of a face, in all frames of a file.

    - path: the file.
    - times (f,): [s].
    - blocks: `lower`, `upper` and `interface`; only the last one of a face.
    """

    path: Path
    times: np.ndarray
    blocks: dict[str, Block]

    @property
    def is_face(self) -> bool:
        """Whether the fields are those of a face."""
        return len(self.blocks) == 1


def collect_frames(result, *, with_notes: bool = False) -> Frames:
    """Compute the fields of a run with a patch in all of its frames.

    Parameters
    ----------
    result : Result
        Result of the run.
    with_notes : bool
        Whether the result receives a note on each material that yields inside a piece.

    Returns
    -------
    Frames
        Without a file: its path is empty.
    """
    if result.patch.model.area is not None:
        return Frames(Path(), result.fields["time"], make_face_blocks(result))
    pieces = compute_pieces(result)
    if with_notes:
        add_yielding_notes(result, pieces)
    return Frames(Path(), pieces.time, make_blocks(pieces))


def write_fields(result, path: Path) -> None:
    """Write the fields of a run to a VTKHDF file, the format that ParaView opens.

    Parameters
    ----------
    result : Result
        Result of a run with a patch; it receives a note on each material that yields inside a piece.
    path : Path
        File to write.
    """
    frames = collect_frames(result, with_notes=True)
    write_blocks(path, frames.blocks, frames.times)


def write_blocks(path: Path, blocks: dict[str, Block], times: np.ndarray) -> None:
    """Write blocks to a VTKHDF file, which gets its name when it is complete.

    Parameters
    ----------
    path : Path
        File to write.
    blocks : dict of str to Block
        Parts and their fields.
    times : (f,) array
        Times of the frames [s].
    """
    with (
        write_atomically(Path(path)) as partial,
        open_lossy(partial) as opened,
        h5py.File(opened, "w", libver=("earliest", "v110")) as file,
    ):
        root = _create_group(file, "VTKHDF")
        root.attrs["Version"] = VTKHDF_VERSION
        root.attrs["Type"] = np.bytes_("MultiBlockDataSet")
        assembly = _create_group(root, "Assembly")
        for name, block in blocks.items():
            _write_block(_create_group(root, name), block, times)
            assembly[name] = h5py.SoftLink(f"/VTKHDF/{name}")
        # VTK 9.6 stays at the first time without a group of steps beside the blocks, and VTK 9.4
        # takes such a group for one more block; therefore it is also an empty mesh.
        empty = Block(np.zeros((0, 3)), np.zeros((0, 4), int), {}, {})
        steps = _create_group(root, "Steps")
        _write_block(steps, empty, times)
        steps.attrs["NSteps"] = len(times)
        steps["Values"] = times


def _create_group(parent, name: str) -> h5py.Group:
    """Create a group that keeps the order of its entries, as VTK requires."""
    return parent.create_group(name, track_order=True)


def _write_block(group, block: Block, times) -> None:
    """Write a block of all frames into an HDF5 group, in the form of VTKHDF.

    It consists of the mesh, the fields with their different frames below each other, and the offset of each frame in every
    field. `times` (f,) [s] are those of the frames.
    """
    connectivity, starts, types = block.vtk_cells()
    group.attrs["Version"] = VTKHDF_VERSION
    group.attrs["Type"] = np.bytes_("UnstructuredGrid")
    group["NumberOfPoints"] = [len(block.points)]
    group["NumberOfCells"] = [len(types)]
    group["NumberOfConnectivityIds"] = [connectivity.size]
    _write_array(group, "Points", block.points)
    _write_array(group, "Connectivity", connectivity.astype(np.int64))
    _write_array(group, "Offsets", starts.astype(np.int64))
    _write_array(group, "Types", types)

    # The mesh is that of the first frame in all of them.
    count = len(times)
    steps = _create_group(group, "Steps")
    steps.attrs["NSteps"] = count
    steps["Values"] = np.asarray(times, float)
    steps["NumberOfParts"] = np.ones(count, int)
    for name in ("PartOffsets", "PointOffsets"):
        steps[name] = np.zeros(count, int)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((count, 1), int)

    for kind, data in (("PointData", block.point_data), ("CellData", block.cell_data)):
        arrays = _create_group(group, kind)
        offsets = _create_group(steps, f"{kind}Offsets")
        for name, values in data.items():
            # Equal frames, such as those of full slip, are stored once and have the same offset.
            number = number_distinct_frames(values)
            _write_field(arrays, name, values[np.unique(number, return_index=True)[1]])
            offsets[name] = values.shape[1] * np.broadcast_to(number, count)


def _write_array(group, name: str, values: np.ndarray, chunks=True) -> h5py.Dataset:
    """Write an array into an HDF5 group, compressed unless it is empty.

    `chunks` is the shape of a chunk, or True to let h5py choose it.
    """
    packing = {"chunks": chunks, "shuffle": True, "compression": "gzip", "compression_opts": 1}
    return group.create_dataset(name, data=values, **(packing if values.size else {}))


def _write_field(group, name: str, values: np.ndarray) -> None:
    """Write a field of f frames and n points or cells, (f, n, ...), with its unit and the meaning of its codes.

    `group` is the h5py group of the fields of a block. `name` is that of the field in `VTK_FIELDS`, whose values are in SI
    units. A chunk is one component in one frame: neighbours in it are neighbours in space, which compresses well.
    """
    field = VTK_FIELDS[name]
    flat = values.reshape(-1, *values.shape[2:])
    chunks = (values.shape[1], *(1 for _ in values.shape[2:]))
    dataset = _write_array(group, name, flat, chunks)
    dataset.attrs["units"] = field.unit
    if field.meanings:
        dataset.attrs["flag_values"] = np.arange(len(field.meanings), dtype=np.int8)
        dataset.attrs["flag_meanings"] = " ".join(field.meanings)


def find_fields(folder: Path) -> Path:
    """Return the file of fields in a results folder.

    Raises
    ------
    Missing
        If there is no such folder, or it has no fields.
    """
    path = Path(folder) / VTKHDF_FILE
    if path.is_file():
        return path
    if not path.parent.is_dir():
        raise Missing(f"{folder}: no such results folder")
    inside = sorted(path.parent.glob(f"interfaces/*/{VTKHDF_FILE}"))
    advice = "only a run with [contact] writes one"
    if inside:
        advice = f"give one of its interfaces, such as {inside[0].parent}"
    raise Missing(f"{folder}: it has no {VTKHDF_FILE}; {advice}")


def read_frames(path: Path, names: set[str] | None = None) -> Frames:
    """Read the fields of these names from a file, by default all of them.

    Raises PatchfemError if it is damaged, or was written by an older version.
    """
    try:
        with h5py.File(path, "r") as file:
            root = file["VTKHDF"]
            times = root["Steps/Values"][:]
            is_face = not REQUIRED_FACE_FIELDS - {*root["interface/CellData"]}
            # Parts of a run in the order in which they are stored
            parts = ("interface",) if is_face else ("lower", "upper", "interface")
            for part in parts:
                required = REQUIRED_FACE_FIELDS if is_face else REQUIRED_FIELDS[part]
                missing = required - {*root[part]["PointData"], *root[part]["CellData"]}
                if missing:
                    raise ValueError(f"{part} has no {', '.join(sorted(missing))}")
            blocks = {part: _read_block(root[part], len(times), names) for part in parts}
    except Exception as fault:  # a damaged file can raise exceptions of many classes
        reason = " ".join(str(fault).split())[:200] or type(fault).__name__
        raise PatchfemError(
            f"{path}: not the fields of a run of this version of patchfem ({reason}); run the scene again"
        ) from None
    return Frames(Path(path), times, blocks)


def _read_block(group, count: int, names: set[str] | None) -> Block:
    """Read the mesh of a block and its fields of these names in `count` frames; None stands for all fields."""
    points = group["Points"][:].reshape(-1, 3)
    first, last = group["Offsets"][:-1], group["Offsets"][1:] - 1
    n_corners = 2 if (last - first).max() == 1 else 4
    corners = np.minimum(first[:, None] + np.arange(n_corners), last[:, None])
    cells = group["Connectivity"][:][corners]
    if not 0 <= cells.min() <= cells.max() < len(points):
        raise ValueError("a cell has a node that does not exist")
    data = []
    for kind, size in (("PointData", len(points)), ("CellData", len(cells))):
        fields = group[kind]
        offsets = group[f"Steps/{kind}Offsets"]
        wanted = [name for name in fields if names is None or name in names]
        data.append(
            {name: _read_field(fields[name], offsets[name][:], size, count) for name in wanted}
        )
    return Block(points, cells, *data)


def _read_field(rows, offsets: np.ndarray, size: int, count: int) -> np.ndarray:
    """Read a field (f, size, ...) in f = `count` frames.

    `rows` is the HDF5 dataset of the different frames below each other, `offsets` (f,) the first row of each frame, and
    `size` the number of points or cells in a frame.
    """
    name = rows.name.rpartition("/")[2]
    if len(offsets) != count:
        raise ValueError(f"{name} has {len(offsets)} frames")
    return rows[:].reshape(-1, size, *FIELD_SHAPES.get(name, ()))[offsets // size]
