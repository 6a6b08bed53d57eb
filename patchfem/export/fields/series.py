"""fields.vtkhdf read back, frame by frame."""

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from ...core import Missing, PatchfemError
from ..read_results import HUGE, numeric, readable, wanted
from .blocks import NAMES, PARTS, Block, joined
from .vtkhdf import NAME

TAILS = {"displacement": (3,), "stress": (6,)}  # of arrays with several values a place
BODY = {"PointData": ("displacement",), "CellData": ("material", "stress", "von_mises")}
LINE = {"PointData": ("displacement", "gap", "normal_stress"), "CellData": ()}
# what a reader relies on
LEAST = {
    "lower": BODY,
    "upper": BODY,
    "interface": LINE,
    "strips": {"PointData": (), "CellData": ()},
}
MOST = 4  # nodes of a cell
APART = 3.0  # of the usual step between frames: a longer one divides the pressed state from the last cycle


def moving(times) -> tuple:
    """Numbers of the frames that follow each other up to the end of the times (f,) [s].

    Of a rig these are the frames of its last cycle, without the pressed state long before them; of a bench all of its
    slide.
    """
    steps = np.diff(times)
    apart = np.flatnonzero(steps > APART * np.median(steps)) if steps.size else steps
    return tuple(range(int(apart[-1]) + 1 if apart.size else 0, len(times)))


@dataclass(frozen=True, eq=False, slots=True)
class Frame(Block):
    """One moment of a series: all of its blocks as one mesh, that of `joined`, and each of them.

    blocks: name -> Block; units: name -> unit; time [s]; number: from 0.
    """

    blocks: dict
    units: dict
    time: float
    number: int

    def cells(self, part: int) -> list:
        """The cells of a part as arrays (c, nodes), one per size; `part` 0 lower, 1 upper piece, 2 interface."""
        mine, size = self.cell_data["part"] == part, np.diff(self.offsets)
        return [
            self.connectivity[self.offsets[:-1][mine & (size == n)][:, None] + np.arange(n)]
            for n in np.unique(size[mine])
        ]

    def interface(self) -> np.ndarray:
        """Numbers of the points of the interface (m,), by rising x."""
        nodes = np.unique(np.concatenate([block.ravel() for block in self.cells(2)]))
        return nodes[np.argsort(self.points[nodes, 0], kind="stable")]


class Series:
    """The fields of a results folder, frame by frame, as written; a context that holds the file.

    times: (f,) [s]. Missing where the folder has no fields, PatchfemError for a file that is not one of `write_series`.
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
            with readable(path, "fields of a patchfem run, frame by frame"):
                self._open()
        except PatchfemError:
            self.file.close()
            raise

    def _open(self) -> None:
        self.root = self.file["VTKHDF"]
        if self.root.attrs["Type"] == b"UnstructuredGrid":
            raise PatchfemError(
                f"{self.path}: written by an older version of patchfem; run the scene again"
            )
        self.times = self.root["Steps/Values"][:]
        wanted(
            self.times.ndim == 1
            and self.times.size
            and numeric(self.times)
            and np.isfinite(self.times).all(),
            "Steps/Values are not valid times",
        )
        texts = self.root["lower/FieldData/units"][:]
        self.units = dict(text.decode().rstrip("]").split(" [", 1) for text in texts)
        self.parts = [name for name in PARTS if name in NAMES or name in self.root]
        for name in self.parts:
            self._looked(name, self.root[name])

    def _looked(self, name: str, group) -> None:
        """ValueError for a block whose cells or arrays are not those of its points in every frame."""
        points, nodes, ends, types = (
            group[one][:] for one in ("Points", "Connectivity", "Offsets", "Types")
        )
        # NaN is not below it
        wanted(
            points.ndim == 2
            and points.shape[1] == 3
            and len(points)
            and numeric(points)
            and np.abs(points).max() < HUGE,
            f"{name}/Points are not valid positions",
        )
        wanted(
            all(
                one.ndim == 1 and one.size and one.dtype.kind in "iu"
                for one in (nodes, ends, types)
            ),
            f"{name}: the numbers that define the cells are not whole",
        )
        sizes = np.diff(ends.astype(np.int64))
        wanted(
            len(sizes) == len(types)
            and ends[0] == 0
            and ends[-1] == len(nodes)
            and sizes.min() >= 2
            and sizes.max() <= MOST
            and nodes.min() >= 0
            and nodes.max() < len(points),
            f"{name}: the cells refer to points that are not in the file",
        )
        for kind, size in ("PointData", len(points)), ("CellData", len(types)):
            lacks = sorted(set(LEAST[name][kind]) - set(group[kind]))
            wanted(not lacks, f"{name}/{kind} lacks {', '.join(lacks)}")
            for one, rows in group[kind].items():
                first = group[f"Steps/{kind}Offsets/{one}"][:]
                wanted(
                    rows.dtype.kind in "iuf" and rows.shape[1:] == TAILS.get(one, ()),
                    f"{name}/{kind}/{one} contains {rows.ndim}-dimensional {rows.dtype}",
                )
                wanted(
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
        """The frame `number` from 0, counted from the end where it is negative.

        PatchfemError for a number that is not there and for a file that is damaged.
        """
        count = len(self)
        if not -count <= number < count:
            raise PatchfemError(
                f"--frame: there is no frame {number}; {self.path} has frames 0 to {count - 1}"
            )
        number %= count
        with readable(self.path, f"frame {number}"):
            blocks = {name: self._block(self.root[name], number) for name in self.parts}
        one = joined(blocks)
        return Frame(
            one.points,
            one.connectivity,
            one.offsets,
            one.types,
            one.point_data,
            one.cell_data,
            blocks,
            self.units | {"part": "1"},
            float(self.times[number]),
            number,
        )

    def names(self, block: str, kind: str) -> tuple:
        """Names of the arrays of a block; kind: "PointData" or "CellData"."""
        return tuple(self.root[block][kind])

    def stack(self, block: str, kind: str, name: str, numbers: list) -> np.ndarray:
        """One array of a block, on its points or its cells, in several frames: (f, n, ...)."""
        group = self.root[block]
        rows, size = (
            group[f"{kind}/{name}"],
            len(group["Points" if kind == "PointData" else "Types"]),
        )
        first = group[f"Steps/{kind}Offsets/{name}"][:][numbers]
        if np.all(np.diff(first) == size):  # one after the other: one read
            whole = rows[int(first[0]) : int(first[-1]) + size]
            return whole.reshape(len(numbers), size, *whole.shape[1:])
        return np.stack([rows[int(at) : int(at) + size] for at in first])

    def points(self, block: str) -> np.ndarray:
        """Points (n, 3) [m] of a block."""
        return self.root[block]["Points"][:]

    def cells(self, block: str) -> tuple:
        """Connectivity and offsets (c + 1,) of the cells of a block."""
        return self.root[block]["Connectivity"][:], self.root[block]["Offsets"][:]

    @staticmethod
    def _block(group, number: int) -> Block:
        data = [
            {name: _rows(group, kind, name, number, size) for name in group[kind]}
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


def _rows(group, kind: str, name: str, number: int, size: int) -> np.ndarray:
    first = int(group[f"Steps/{kind}Offsets/{name}"][number])
    return group[f"{kind}/{name}"][first : first + size]
