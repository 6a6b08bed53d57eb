"""fields.vtkhdf: a time series on one fixed unstructured grid, as VTK and ParaView (5.13 on) read it, out and back in.

Both bodies and the interface are cells of one grid, told apart by the cell array `part` (0 lower piece, 1 upper piece,
2 interface). Interface quantities are point data and NaN inside the bodies. Units stand as attributes of the arrays and
in the field array `units`.
"""

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from ...core import Missing, PatchfemError

NAME = "fields.vtkhdf"
LINE, TRIANGLE, QUAD = 3, 5, 9


def write_series(path: Path, points, blocks, times, point_data: dict, cell_data: dict, units: dict) -> None:
    """Write a series of fields on one fixed grid.

    points: (N, 3); blocks: (t, 2 to 4) node numbers of lines, triangles or quads, one array after the other; times:
    (f,); data: name -> (f or 1, N or cells, ...), 1 if constant. The file is written whole beside `path` and then
    renamed; it is of an HDF5 version that VTK's reader knows.
    """
    path = Path(path)
    partial = path.with_name(path.name + ".partial")
    with h5py.File(partial, "w", libver=("earliest", "v110")) as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 2], dtype=np.int64)
        root.attrs.create("Type", np.bytes_("UnstructuredGrid"))
        cells = sum(len(block) for block in blocks)
        connectivity = np.concatenate([np.ravel(block) for block in blocks]).astype(np.int64)
        sizes = np.concatenate([np.full(len(block), block.shape[1]) for block in blocks])
        root["NumberOfPoints"] = np.array([len(points)], np.int64)
        root["NumberOfCells"] = np.array([cells], np.int64)
        root["NumberOfConnectivityIds"] = np.array([connectivity.size], np.int64)
        root["Points"] = np.asarray(points, np.float64)
        root["Connectivity"] = connectivity
        root["Offsets"] = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        root["Types"] = np.array([0, 0, LINE, TRIANGLE, QUAD], np.uint8)[sizes]
        steps = root.create_group("Steps")
        count = len(times)
        steps.attrs["NSteps"] = np.int64(count)
        steps["Values"] = np.asarray(times, np.float64)
        for name in ("PartOffsets", "PointOffsets"):
            steps[name] = np.zeros(count, np.int64)
        steps["NumberOfParts"] = np.ones(count, np.int64)
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            steps[name] = np.zeros((count, 1), np.int64)
        _arrays(root, steps, "PointData", point_data, count, units)
        _arrays(root, steps, "CellData", cell_data, count, units)
        field = root.create_group("FieldData")
        text = [f"{name} [{unit}]" for name, unit in units.items()]
        field.create_dataset("units", data=text, dtype=h5py.string_dtype("ascii"))
        for name, values in (("FieldDataOffsets", np.zeros(count, np.int64)),
                             ("FieldDataSizes", np.tile([1, len(text)], (count, 1)).astype(np.int64))):
            steps.create_group(name)["units"] = values
    partial.replace(path)


def _arrays(root, steps, kind: str, data: dict, count: int, units: dict) -> None:
    group, offsets = root.create_group(kind), steps.create_group(f"{kind}Offsets")
    for name, values in data.items():
        values = np.asarray(values)
        size = values.shape[1]
        flat = values.reshape(-1, *values.shape[2:])
        one = group.create_dataset(name, data=flat, compression="gzip", compression_opts=1, shuffle=True,
                                   chunks=(min(size, len(flat)), *flat.shape[1:]))
        one.attrs["units"] = units.get(name, "1")
        offsets[name] = (np.arange(count) if len(values) == count else np.zeros(count, np.int64)) * size


def bodies(lower: dict, upper: dict, interface: dict, above: dict | None = None) -> tuple:
    """Points, blocks of cells, point data and cell data of a pair.

    lower, upper: "points" (n, 2), "blocks" of cells numbered from 0, "material" (t,) of all of them, "interface" (m,)
    node numbers, "displacement" (f, n, 2) [m], "stress" (f, t, 4) as xx, yy, zz, xy [Pa], "mises" (f, t) [Pa],
    "stress_error" (f, t) [1], "bond" name -> (f, m) of the lower boundary of its coating, {} without one; interface:
    name -> (f, m); above: the same at the nodes of the upper piece where they differ. Bond-line stress stands at the
    same x of the interface: the piece's own at its nodes, that of the lower piece (or the only coated one) between.
    """
    low, high = lower["interface"], upper["interface"]
    first, last = len(lower["points"]), len(lower["points"]) + len(upper["points"])
    points = np.concatenate([lower["points"], upper["points"], lower["points"][low]])
    points = np.column_stack([points, np.zeros(len(points))])
    lines = last + np.stack([np.arange(low.size - 1), np.arange(1, low.size)], axis=1)
    frames = len(lower["displacement"])
    move = np.zeros((frames, len(points), 3), np.float32)
    move[:, :first, :2], move[:, first:last, :2] = lower["displacement"], upper["displacement"]
    move[:, last:, :2] = lower["displacement"][:, low]
    point_data = {"displacement": move}
    for name, values in interface.items():
        full = np.full((frames, len(points)), np.nan, np.float32) if name != "status" else \
            np.full((frames, len(points)), -1, np.int8)
        full[:, low] = full[:, last + np.arange(low.size)] = values
        full[:, high + first] = values if above is None else above[name]
        point_data[name] = full
    for name in dict.fromkeys([*lower["bond"], *upper["bond"]]):
        full = np.full((frames, len(points)), np.nan, np.float32)
        for place, part in ((last + np.arange(low.size), upper), (last + np.arange(low.size), lower), (low, lower),
                            (high + first, upper)):
            if name in part["bond"] and part["bond"][name].shape[-1] == place.size:
                full[:, place] = part["bond"][name]
        point_data[name] = full
    body, both = len(lower["material"]), len(lower["material"]) + len(upper["material"])
    cells = both + len(lines)
    stress = np.full((frames, cells, 6), np.nan, np.float32)
    mises, error = (np.full((frames, cells), np.nan, np.float32) for _ in range(2))
    for rows, part in ((slice(0, body), lower), (slice(body, both), upper)):
        stress[:, rows, :4], stress[:, rows, 4:], mises[:, rows] = part["stress"], 0, part["mises"]
        error[:, rows] = part["stress_error"]
    part = np.concatenate([np.zeros(body), np.ones(both - body), np.full(len(lines), 2)]).astype(np.int8)[None]
    material = np.concatenate([lower["material"], upper["material"], np.full(len(lines), -1)]).astype(np.int8)[None]
    blocks = [*lower["blocks"], *(block + first for block in upper["blocks"]), lines]
    return points, blocks, point_data, {"stress": stress, "von_mises": mises, "stress_error": error, "part": part,
                                        "material": material}


@dataclass(frozen=True, eq=False, slots=True)
class Frame:
    """One moment of a series.

    points: (N, 3) [m]; connectivity, offsets (cells + 1,), types: as VTK has them; point_data, cell_data: name -> (N or
    cells, ...); units: name -> unit; time [s]; number: from 0.
    """

    points: np.ndarray
    connectivity: np.ndarray
    offsets: np.ndarray
    types: np.ndarray
    point_data: dict
    cell_data: dict
    units: dict
    time: float
    number: int

    def cells(self, part: int) -> list:
        """The cells of a part as arrays (c, nodes), one per size; `part` 0 lower, 1 upper piece, 2 interface."""
        mine, size = self.cell_data["part"] == part, np.diff(self.offsets)
        return [self.connectivity[self.offsets[:-1][mine & (size == n)][:, None] + np.arange(n)]
                for n in np.unique(size[mine])]

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
            raise Missing(f"{folder}: it has no {NAME}; only a run with [contact] writes one")
        self.path = path
        try:
            self.file = h5py.File(path, "r")
        except OSError as error:
            raise PatchfemError(f"{path}: not a readable HDF5 file ({error})") from None
        try:
            self.root = self.file["VTKHDF"]
            self.times = self.root["Steps/Values"][:]
            self.units = dict(text.decode().rstrip("]").split(" [", 1) for text in self.root["FieldData/units"][:])
        except (KeyError, ValueError) as error:
            self.file.close()
            raise PatchfemError(f"{path}: not a series of fields of patchfem ({error})") from None

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
            raise PatchfemError(f"--frame: {number} is not there, {self.path} has frames 0 to {count - 1}")
        number %= count
        root = self.root
        try:
            data = [{name: self._rows(kind, name, number, size) for name in root[kind]} for kind, size in (
                ("PointData", len(root["Points"])), ("CellData", len(root["Types"])))]
            return Frame(root["Points"][:], root["Connectivity"][:], root["Offsets"][:], root["Types"][:], *data,
                         self.units, float(self.times[number]), number)
        except (KeyError, OSError) as error:
            raise PatchfemError(f"{self.path}: frame {number} cannot be read ({error})") from None

    def _rows(self, kind: str, name: str, number: int, size: int) -> np.ndarray:
        first = int(self.root[f"Steps/{kind}Offsets/{name}"][number])
        return self.root[f"{kind}/{name}"][first:first + size]
