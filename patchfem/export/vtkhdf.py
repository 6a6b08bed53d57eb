"""fields.vtkhdf: a time series on one fixed unstructured grid, as VTK and ParaView (5.13 on) read it.

Both bodies and the interface are cells of one grid, told apart by the cell array `part` (0 lower piece, 1 upper piece,
2 interface). Interface quantities are point data and NaN inside the bodies. Units stand as attributes of the arrays and
in the field array `units`.
"""

from pathlib import Path

import h5py
import numpy as np

LINE, QUAD = 3, 9


def write_series(path: Path, points, quads, lines, times, point_data: dict, cell_data: dict, units: dict) -> None:
    """points (N, 3), quads (t, 4), lines (l, 2); times (f,); data: name -> (f or 1, N or cells, ...), 1 if constant.

    The file is written whole beside `path` and then renamed; written with an HDF5 version that VTK's reader knows.
    """
    path = Path(path)
    partial = path.with_name(path.name + ".partial")
    with h5py.File(partial, "w", libver=("earliest", "v110")) as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 2], dtype=np.int64)
        root.attrs.create("Type", np.bytes_("UnstructuredGrid"))
        cells = len(quads) + len(lines)
        connectivity = np.concatenate([np.ravel(quads), np.ravel(lines)]).astype(np.int64)
        sizes = np.concatenate([np.full(len(quads), 4), np.full(len(lines), 2)])
        root["NumberOfPoints"] = np.array([len(points)], np.int64)
        root["NumberOfCells"] = np.array([cells], np.int64)
        root["NumberOfConnectivityIds"] = np.array([connectivity.size], np.int64)
        root["Points"] = np.asarray(points, np.float64)
        root["Connectivity"] = connectivity
        root["Offsets"] = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        root["Types"] = np.concatenate([np.full(len(quads), QUAD), np.full(len(lines), LINE)]).astype(np.uint8)
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


def bodies(pair: dict, frames: int, lower, upper, stress_lower, stress_upper, mises_lower, mises_upper,
           interface: dict, ny: int) -> tuple:
    """Points, quads, lines, point data and cell data of a pair.

    pair: the dict of `mesh.files.pair_mesh`; lower, upper: (f, n, 2) displacements in x, y [m]; stress (f, t, 4) as
    xx, yy, zz, xy; interface: name -> (f, m). Node j*ny of a body lies on its interface.
    """
    half = len(pair["points"]) // 2
    top = np.arange(0, half, ny)
    points = np.concatenate([pair["points"], pair["points"][top]])
    points = np.column_stack([points, np.zeros(len(points))])
    lines = len(pair["points"]) + np.stack([np.arange(top.size - 1), np.arange(1, top.size)], axis=1)
    move = np.zeros((frames, len(points), 3), np.float32)
    move[:, :half, :2], move[:, half:2 * half, :2] = lower, upper
    move[:, 2 * half:, :2] = lower[:, top]
    point_data = {"displacement": move}
    for name, values in interface.items():
        full = np.full((frames, len(points)), np.nan, np.float32) if name != "status" else \
            np.full((frames, len(points)), -1, np.int8)
        for place in (top, top + half, 2 * half + np.arange(top.size)):
            full[:, place] = values
        point_data[name] = full
    cells = len(pair["quads"]) + len(lines)
    body = len(pair["quads"]) // 2
    stress = np.full((frames, cells, 6), np.nan, np.float32)
    mises = np.full((frames, cells), np.nan, np.float32)
    for start, s, v in ((0, stress_lower, mises_lower), (body, stress_upper, mises_upper)):
        stress[:, start:start + body, :4] = s
        stress[:, start:start + body, 4:] = 0
        mises[:, start:start + body] = v
    part = np.concatenate([np.zeros(body), np.ones(body), np.full(len(lines), 2)]).astype(np.int8)[None]
    material = np.concatenate([(pair["tags"] % 2 == 0), np.full(len(lines), -1)]).astype(np.int8)[None]
    return points, pair["quads"], lines, point_data, {"stress": stress, "von_mises": mises, "part": part,
                                                      "material": material}
