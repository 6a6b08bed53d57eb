"""Reader of fields.vtkhdf, frame by frame."""

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from ...core import Missing, PatchfemError
from ..read_results import MAX_NUMBER, is_real, reading_errors, require_valid
from .blocks import NAMES, PARTS, Block, merge_blocks
from .vtkhdf import NAME

# Trailing dimensions of arrays with several values per point.
VALUE_SHAPES = {"displacement": (3,), "stress": (6,)}
BODY = {"PointData": ("displacement",), "CellData": ("material", "stress", "von_mises")}
LINE = {"PointData": ("displacement", "gap", "normal_stress"), "CellData": ()}
# Names of the arrays that a reader requires, by part and kind.
REQUIRED_ARRAYS = {
    "lower": BODY,
    "upper": BODY,
    "interface": LINE,
    "strips": {"PointData": (), "CellData": ()},
}
MAX_CELL_NODES = 4  # largest number of nodes per cell
# Ratio to the median interval between frames above which an interval separates the
# pressed state from the last cycle.
MIN_STEP_RATIO = 3.0


def last_consecutive_frames(times) -> tuple:
    """Return the indices of the last frames whose times (f,) [s] are consecutive.

    For a rig they are the frames of its last cycle, without the pressed state long before it; for a
    bench all frames of its slide.
    """
    steps = np.diff(times)
    breaks = np.flatnonzero(steps > MIN_STEP_RATIO * np.median(steps)) if steps.size else steps
    return tuple(range(int(breaks[-1]) + 1 if breaks.size else 0, len(times)))


@dataclass(frozen=True, eq=False, slots=True)
class Frame(Block):
    """Fields at one time: all mesh blocks, and the same merged into one mesh.

    Attributes
    ----------
    blocks : dict of Block
    units : dict
        Unit by name.
    time : float
        [s]
    number : int
        Number of the frame, from 0.
    """

    blocks: dict
    units: dict
    time: float
    number: int

    def cells(self, part: int) -> list:
        """Return the cells of a part as arrays (c, nodes), one per cell size.

        part: 0 lower piece, 1 upper piece, 2 interface.
        """
        is_in_part = self.cell_data["part"] == part
        size = np.diff(self.offsets)
        return [
            self.connectivity[self.offsets[:-1][is_in_part & (size == n)][:, None] + np.arange(n)]
            for n in np.unique(size[is_in_part])
        ]

    def interface(self) -> np.ndarray:
        """Return the indices (m,) of the interface points in order of x."""
        nodes = np.unique(np.concatenate([block.ravel() for block in self.cells(2)]))
        return nodes[np.argsort(self.points[nodes, 0], kind="stable")]


class Series:
    """Reader of the fields in a results folder, frame by frame, as a context manager.

    times: (f,) [s].

    Raises
    ------
    Missing
        If the folder has no fields.
    PatchfemError
        If `write_series` cannot have written the file.
    """

    def __init__(self, folder: Path):
        path = Path(folder) / NAME
        if not path.is_file():
            if not Path(folder).is_dir():
                raise Missing(f"{folder}: no such results folder")
            inside = sorted(Path(folder).glob(f"interfaces/*/{NAME}"))
            raise Missing(
                f"{folder}: it has no {NAME}; "
                + (
                    f"give one of its interfaces, such as {inside[0].parent}"
                    if inside
                    else "only a run with [contact] writes one"
                )
            )
        self.path = path
        try:
            self.file = h5py.File(path, "r")
        except OSError as error:
            raise PatchfemError(f"{path}: not a readable HDF5 file ({error})") from None
        try:
            with reading_errors(path, "fields of a patchfem run, frame by frame"):
                self._open()
        except PatchfemError:
            self.file.close()
            raise

    def _open(self) -> None:
        """Read and check the times, units and mesh blocks of the file."""
        self.root = self.file["VTKHDF"]
        if self.root.attrs["Type"] == b"UnstructuredGrid":
            raise PatchfemError(
                f"{self.path}: written by an older version of patchfem; run the scene again"
            )
        self.times = self.root["Steps/Values"][:]
        require_valid(
            self.times.ndim == 1
            and self.times.size
            and is_real(self.times)
            and np.isfinite(self.times).all(),
            "Steps/Values are not valid times",
        )
        texts = self.root["lower/FieldData/units"][:]
        self.units = dict(text.decode().rstrip("]").split(" [", 1) for text in texts)
        self.parts = [name for name in PARTS if name in NAMES or name in self.root]
        for name in self.parts:
            self._check_block(name, self.root[name])

    def _check_block(self, name: str, group) -> None:
        """Raise ValueError if the cells or arrays of a mesh block do not fit its points."""
        points, nodes, ends, types = (
            group[one][:] for one in ("Points", "Connectivity", "Offsets", "Types")
        )
        # Comparisons with NaN are false.
        require_valid(
            points.ndim == 2
            and points.shape[1] == 3
            and len(points)
            and is_real(points)
            and np.abs(points).max() < MAX_NUMBER,
            f"{name}/Points are not valid positions",
        )
        require_valid(
            all(
                one.ndim == 1 and one.size and one.dtype.kind in "iu"
                for one in (nodes, ends, types)
            ),
            f"{name}: the numbers that define the cells are not whole",
        )
        sizes = np.diff(ends.astype(np.int64))
        require_valid(
            len(sizes) == len(types)
            and ends[0] == 0
            and ends[-1] == len(nodes)
            and sizes.min() >= 2
            and sizes.max() <= MAX_CELL_NODES
            and nodes.min() >= 0
            and nodes.max() < len(points),
            f"{name}: the cells refer to points that are not in the file",
        )
        for kind, size in ("PointData", len(points)), ("CellData", len(types)):
            lacks = sorted(set(REQUIRED_ARRAYS[name][kind]) - set(group[kind]))
            require_valid(not lacks, f"{name}/{kind} lacks {', '.join(lacks)}")
            for one, rows in group[kind].items():
                first = group[f"Steps/{kind}Offsets/{one}"][:]
                require_valid(
                    rows.dtype.kind in "iuf" and rows.shape[1:] == VALUE_SHAPES.get(one, ()),
                    f"{name}/{kind}/{one} contains {rows.ndim}-dimensional {rows.dtype}",
                )
                require_valid(
                    first.shape == self.times.shape
                    and first.dtype.kind in "iu"
                    and first.min() >= 0
                    and first.max() + size <= len(rows),
                    f"{name}/{kind}/{one} has no values for the last frames",
                )

    def __enter__(self) -> "Series":
        return self

    def __exit__(self, *_) -> None:
        self.file.close()

    def __len__(self) -> int:
        return len(self.times)

    def frame(self, number: int = -1) -> Frame:
        """Read a frame by its number from 0; negative numbers count from the end.

        PatchfemError for a number that does not exist, and for a damaged file.
        """
        count = len(self)
        if not -count <= number < count:
            raise PatchfemError(
                f"--frame: there is no frame {number}; {self.path} has frames 0 to {count - 1}"
            )
        number %= count
        with reading_errors(self.path, f"frame {number}"):
            blocks = {name: self._block(self.root[name], number) for name in self.parts}
        merged = merge_blocks(blocks)
        return Frame(
            merged.points,
            merged.connectivity,
            merged.offsets,
            merged.types,
            merged.point_data,
            merged.cell_data,
            blocks,
            self.units | {"part": "1"},
            float(self.times[number]),
            number,
        )

    def names(self, block: str, kind: str) -> tuple:
        """Return the names of the point or cell arrays of a mesh block."""
        return tuple(self.root[block][kind])

    def stack(self, block: str, kind: str, name: str, numbers: list) -> np.ndarray:
        """Return an array of a mesh block in several frames (f, n, ...).

        Parameters
        ----------
        block : str
        kind : {"PointData", "CellData"}
        name : str
        numbers : list of int
            Numbers of the frames.
        """
        group = self.root[block]
        rows = group[f"{kind}/{name}"]
        size = len(group["Points" if kind == "PointData" else "Types"])
        first = group[f"Steps/{kind}Offsets/{name}"][:][numbers]
        if np.all(np.diff(first) == size):  # consecutive frames are read at once
            consecutive = rows[int(first[0]) : int(first[-1]) + size]
            return consecutive.reshape(len(numbers), size, *consecutive.shape[1:])
        return np.stack([rows[int(start) : int(start) + size] for start in first])

    def points(self, block: str) -> np.ndarray:
        """Return the point coordinates (n, 3) [m] of a mesh block."""
        return self.root[block]["Points"][:]

    def cells(self, block: str) -> tuple:
        """Return connectivity and offsets (c + 1,) of the cells of a mesh block."""
        return self.root[block]["Connectivity"][:], self.root[block]["Offsets"][:]

    @staticmethod
    def _block(group, number: int) -> Block:
        """Read the mesh block of a part in one frame."""
        data = [
            {name: _read_rows(group, kind, name, number, size) for name in group[kind]}
            for kind, size in (
                ("PointData", len(group["Points"])),
                ("CellData", len(group["Types"])),
            )
        ]
        return Block(
            group["Points"][:],
            group["Connectivity"][:],
            group["Offsets"][:],
            group["Types"][:],
            *data,
        )


def _read_rows(group, kind: str, name: str, number: int, size: int) -> np.ndarray:
    """Read the values of a field array in one frame."""
    first = int(group[f"Steps/{kind}Offsets/{name}"][number])
    return group[f"{kind}/{name}"][first : first + size]
