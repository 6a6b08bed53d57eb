"""fields.vtkhdf: a time series on one fixed unstructured grid, as VTK and ParaView (5.13 on) read it.

Both bodies and the interface are cells of one grid, told apart by the cell array `part` (0 lower piece, 1 upper piece,
2 interface). Interface quantities are point data and NaN inside the bodies. Units stand as attributes of the arrays and
in the field array `units`.
"""

from pathlib import Path

import h5py
import numpy as np

LINE, TRIANGLE, QUAD = 3, 5, 9


def write_series(path: Path, points, blocks, times, point_data: dict, cell_data: dict, units: dict) -> None:
    """points (N, 3); blocks: (t, 2 to 4) node numbers of lines, triangles or quads, one array after the other; times
    (f,); data: name -> (f or 1, N or cells, ...), 1 if constant.

    The file is written whole beside `path` and then renamed; written with an HDF5 version that VTK's reader knows.
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


def bodies(lower: dict, upper: dict, interface: dict) -> tuple:
    """Points, blocks of cells, point data and cell data of a pair.

    lower, upper: "points" (n, 2), "blocks" of cells numbered from 0, "material" (t,) of all of them, "interface" (m,)
    node numbers, "displacement" (f, n, 2) [m], "stress" (f, t, 4) as xx, yy, zz, xy [Pa], "mises" (f, t) [Pa];
    interface: name -> (f, m).
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
        for place in (low, high + first, last + np.arange(low.size)):
            full[:, place] = values
        point_data[name] = full
    body, both = len(lower["material"]), len(lower["material"]) + len(upper["material"])
    cells = both + len(lines)
    stress = np.full((frames, cells, 6), np.nan, np.float32)
    mises = np.full((frames, cells), np.nan, np.float32)
    for rows, part in ((slice(0, body), lower), (slice(body, both), upper)):
        stress[:, rows, :4], stress[:, rows, 4:], mises[:, rows] = part["stress"], 0, part["mises"]
    part = np.concatenate([np.zeros(body), np.ones(both - body), np.full(len(lines), 2)]).astype(np.int8)[None]
    material = np.concatenate([lower["material"], upper["material"], np.full(len(lines), -1)]).astype(np.int8)[None]
    blocks = [*lower["blocks"], *(block + first for block in upper["blocks"]), lines]
    return points, blocks, point_data, {"stress": stress, "von_mises": mises, "part": part, "material": material}
