"""fields.vtkhdf: a time series of three named blocks on fixed meshes, as VTK 9.4 to 9.7 and their ParaViews read it.

The blocks `lower`, `upper` and `interface` are one vtkMultiBlockDataSet. Units, and the meanings of codes, stand as
attributes of the arrays and in the field arrays `units` and `codes` of every block, which VTK 9.6 and 9.7 pass over.

VTK 9.6 and 9.7 stay at the first time without `Steps` beside the blocks; 9.4 takes whatever stands there for a block.
So `Steps` is a whole mesh too, an empty one that the assembly leaves out.
"""

from pathlib import Path

import h5py
import numpy as np

from .blocks import CODES, Block

NAME = "fields.vtkhdf"
VERSION = np.array([2, 2], np.int64)  # of the format; later ones add nothing that stands here
EMPTY = Block(np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(1, np.int64), np.zeros(0, np.uint8), {}, {})


def write_series(path: Path, blocks: dict, times, units: dict) -> None:
    """Write a series of fields on fixed meshes.

    blocks: name -> Block whose data are (f or 1, n or c, ...), 1 if constant; times: (f,) [s]; units: name -> unit. The
    file is written whole beside `path` and then renamed; it is of an HDF5 version that VTK's reader knows.
    """
    path = Path(path)
    partial = path.with_name(path.name + ".partial")
    with h5py.File(partial, "w", libver=("earliest", "v110")) as file:
        root = _group(file, "VTKHDF")
        root.attrs["Version"] = VERSION
        root.attrs.create("Type", np.bytes_("MultiBlockDataSet"))
        text = _text(blocks, units)
        assembly = _group(root, "Assembly")
        for name, one in blocks.items():
            _block(_group(root, name), one, times, units, text)
            assembly[name] = h5py.SoftLink(f"/VTKHDF/{name}")
        steps = _steps(root, times)
        _mesh(steps, EMPTY)
        steps["Steps"] = root[next(iter(blocks))]["Steps"]
    partial.replace(path)


def _group(parent, name: str):
    return parent.create_group(name, track_order=True)


def _text(blocks: dict, units: dict) -> dict:
    """Field arrays of text: the units of all arrays, the meanings of their codes."""
    names = dict.fromkeys(name for one in blocks.values() for name in (*one.point_data, *one.cell_data))
    return {"units": [f"{name} [{units.get(name, '1')}]" for name in names],
            "codes": [f"{name} {code} {meaning}" for name in names for code, meaning in CODES.get(name, {}).items()]}


def _steps(group, times):
    steps = _group(group, "Steps")
    steps.attrs["NSteps"] = np.int64(len(times))
    steps["Values"] = np.asarray(times, np.float64)
    return steps


def _field_data(group, steps, text: dict, count: int) -> None:
    field = group["FieldData"]
    offsets, sizes = _group(steps, "FieldDataOffsets"), _group(steps, "FieldDataSizes")
    for name, lines in text.items():
        if lines:
            field.create_dataset(name, data=lines, dtype=h5py.string_dtype("ascii"))
            offsets[name] = np.zeros(count, np.int64)
            sizes[name] = np.tile([1, len(lines)], (count, 1)).astype(np.int64)


def _mesh(group, one: Block) -> None:
    group.attrs["Version"] = VERSION
    group.attrs.create("Type", np.bytes_("UnstructuredGrid"))
    group["NumberOfPoints"] = np.array([len(one.points)], np.int64)
    group["NumberOfCells"] = np.array([len(one.types)], np.int64)
    group["NumberOfConnectivityIds"] = np.array([one.connectivity.size], np.int64)
    group["Points"], group["Connectivity"] = one.points, one.connectivity
    group["Offsets"], group["Types"] = one.offsets, one.types
    for kind in ("PointData", "CellData", "FieldData"):
        _group(group, kind)


def _block(group, one: Block, times, units: dict, text: dict) -> None:
    _mesh(group, one)
    steps, count = _steps(group, times), len(times)
    for name in ("PartOffsets", "PointOffsets"):
        steps[name] = np.zeros(count, np.int64)
    steps["NumberOfParts"] = np.ones(count, np.int64)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((count, 1), np.int64)
    _arrays(group, steps, "PointData", one.point_data, units)
    _arrays(group, steps, "CellData", one.cell_data, units)
    _field_data(group, steps, text, count)


def _arrays(group, steps, kind: str, data: dict, units: dict) -> None:
    into, offsets = group[kind], _group(steps, f"{kind}Offsets")
    count = int(steps.attrs["NSteps"])
    for name, values in data.items():
        size = values.shape[1]
        # as it is: gzip saves a third of the bytes of a pressed pair and doubles the time of all its fields
        one = into.create_dataset(name, data=values.reshape(-1, *values.shape[2:]))
        one.attrs["units"] = units.get(name, "1")
        if name in CODES:
            one.attrs["flag_values"] = np.array(list(CODES[name]), np.int8)
            one.attrs["flag_meanings"] = " ".join(CODES[name].values())
        offsets[name] = (np.arange(count) if len(values) == count else np.zeros(count, np.int64)) * size
