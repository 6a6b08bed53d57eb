"""fields.vtkhdf: a time series of three named blocks on fixed meshes, as VTK 9.4 to 9.7 and their ParaViews read it.

The blocks `lower`, `upper` and `interface` are one vtkMultiBlockDataSet. Units, and the meanings of codes, stand as
attributes of the arrays and in the field arrays `units` and `codes` of every block, which VTK 9.6 and 9.7 pass over.

VTK 9.6 and 9.7 stay at the first time without `Steps` beside the blocks; 9.4 takes whatever stands there for a block.
So `Steps` is a whole mesh too, an empty one that the assembly leaves out.

The changing arrays of a series of more than PACKED bytes are packed, component by component. Their numbers are rounded,
to a multiple of a step or to so many bits, and every array says what that changes: at most `rounding_error` in its
unit, or the share 2^-(significant_bits + 1) of each value. A series of more than LARGE bytes is written frame after
frame as well: what a killed process leaves (`.fields.*.vtkhdf`) holds every frame that its `NSteps` count.
"""

import math
import zlib
from functools import partial
from pathlib import Path

import h5py
import numpy as np

from ...disk.atomic_write import open_lossy, write_atomically
from .blocks import CODES, MEANINGS, Block

NAME = "fields.vtkhdf"
VERSION = np.array([2, 2], np.int64)  # of the format; later ones add nothing that stands here
PACKED = 1 << 22  # bytes of all arrays: the shipped rig keeps 2.8 of 9.6 MB for .06 s more
LARGE = 1 << 28  # bytes of all arrays
# kept of 23 behind the leading one, where packed: an estimate is good to some 10 %
BITS = {"stress_error": 5}
# of every other array without a step: 3e-5 of a value, far below what the elements err by
MOST_BITS = 14
EMPTY = Block(
    np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(1, np.int64), np.zeros(0, np.uint8), {}, {}
)


def write_series(path: Path, blocks: dict, times, units: dict, steps: dict | None = None) -> None:
    """Write a series of fields on fixed meshes.

    blocks: name -> Block whose data are (f or 1, n or c, ...), 1 if constant; times: (f,) [s]; units: name -> unit;
    steps: block -> array -> largest step [its unit] that a packed series may round it to. The file is written whole
    beside `path` and then renamed; it is of an HDF5 version that VTK's reader knows.
    """
    path = Path(path)
    size = sum(
        values.nbytes
        for one in blocks.values()
        for data in (one.point_data, one.cell_data)
        for values in data.values()
    )
    large, later = size > LARGE, []
    packed = large or size > PACKED
    with (
        write_atomically(path, None if large else size) as partial,
        open_lossy(partial) as kept,
        h5py.File(kept, "w", libver=("earliest", "v110")) as file,
    ):
        root = _group(file, "VTKHDF")
        root.attrs["Version"] = VERSION
        root.attrs.create("Type", np.bytes_("MultiBlockDataSet"))
        text = _text(blocks, units)
        assembly = _group(root, "Assembly")
        for name, one in blocks.items():
            rounding = (steps or {}).get(name, {}) if packed else None
            _block(
                _group(root, name), one, times, (units, text, later if large else None, rounding)
            )
            assembly[name] = h5py.SoftLink(f"/VTKHDF/{name}")
        all_steps = _steps(root, times)
        _mesh(all_steps, EMPTY)
        all_steps["Steps"] = root[next(iter(blocks))]["Steps"]
        if later:
            _frames(file, [all_steps, *(root[name]["Steps"] for name in blocks)], later, len(times))


def _frames(file, steps: list, later: list, count: int) -> None:
    """Write the arrays that wait, [(dataset, (f, n, ...), rounding of one frame)], frame after frame, each on the disk
    before it counts.

    steps: the groups `Steps`, whose times are as many as their frames: VTK reads over the end of its memory otherwise.
    """
    times = [one["Values"][:] for one in steps]
    for number in range(count):
        _counted(steps, times, number)
        for one in later:
            _frame(*one, number)
        file.flush()
    _counted(steps, times, count)


def _frame(dataset, values, nearest, number: int) -> None:
    """Write a frame, a chunk for each component (the bytes of its numbers side by side, then deflated, as HDF5 does it)
    but for those that are 0, which a reader is given for a chunk that is not there."""
    size = values.shape[1]
    for place, part in enumerate(nearest(values[number]).reshape(size, -1).T):
        if part.any():
            # behind the shuffle 3/4 of the time of all matches
            packer = zlib.compressobj(1, strategy=zlib.Z_RLE)
            raw = np.ascontiguousarray(part).view(np.uint8).reshape(size, -1).T.tobytes()
            dataset.id.write_direct_chunk(
                (number * size, place)[: dataset.ndim], packer.compress(raw) + packer.flush()
            )


def _counted(steps: list, times: list, count: int) -> None:
    for one, all_times in zip(steps, times):
        one.attrs["NSteps"] = np.int64(count)
        one["Values"].resize((count,))
        one["Values"][...] = all_times[:count]


def rounded(values, bits: int) -> np.ndarray:
    """float32 values with so many bits kept behind the leading one, rounded to nearest; the rest are zeros, which pack.

    bits: 0 < bits < 23; the relative error is at most 2^-(bits + 1), infinities and NaN stay.
    """
    raw, drop = np.ascontiguousarray(values, np.float32).view(np.uint32), np.uint32(23 - bits)
    half, one = np.uint32(1) << (drop - np.uint32(1)), np.uint32(1)
    near = (raw + (half - one) + ((raw >> drop) & one)) >> drop << drop
    return np.where(np.isfinite(values), near.view(np.float32), values)


def stepped(values, step: float) -> np.ndarray:
    """float32 values rounded to the nearest multiple of `step`, a power of two: off by half a step at most.

    Infinities, NaN and what is too large to have parts of a step stay.
    """
    values = np.asarray(values, np.float32)
    step, each = np.float32(step), np.float32(1 / step)
    # without a NaN
    if max(values.max(initial=0.0), -values.min(initial=0.0)) < step * np.float32(1 << 23):
        return np.rint(values * each) * step
    with np.errstate(over="ignore"):
        return np.where(
            np.abs(values) < step * np.float32(1 << 23), np.rint(values * each) * step, values
        )


def _nearest(dataset, step: float, bits: int):
    """The rounding of an array, said in its attributes: to the power of two at or below `step`, to `bits` where that is
    0 or beyond what float32 is divided by."""
    if not 1e-30 < step < 1e30:
        dataset.attrs["significant_bits"] = bits
        return partial(rounded, bits=bits)
    step = 2.0 ** math.floor(math.log2(step))
    dataset.attrs["rounding_error"] = step / 2
    return partial(stepped, step=step)


def _group(parent, name: str):
    return parent.create_group(name, track_order=True)


def _text(blocks: dict, units: dict) -> dict:
    """Field arrays of text: the units of all arrays, the meanings of their codes."""
    names = dict.fromkeys(
        name for one in blocks.values() for name in (*one.point_data, *one.cell_data)
    )
    return {
        "units": [f"{name} [{units.get(name, '1')}]" for name in names],
        "codes": [
            f"{name} {code} {meaning}"
            for name in names
            for code, meaning in CODES.get(name, {}).items()
        ],
    }


def _steps(group, times):
    steps = _group(group, "Steps")
    steps.attrs["NSteps"] = np.int64(len(times))
    steps.create_dataset("Values", data=np.asarray(times, np.float64), maxshape=(None,))
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


def _block(group, one: Block, times, about: tuple) -> None:
    """about: units by name, the field arrays of text, the list that takes what is written frame after frame, None where
    all is written at once, and the steps of rounding by name, None where nothing is packed."""
    units, text, later, rounding = about
    _mesh(group, one)
    steps, count = _steps(group, times), len(times)
    for name in ("PartOffsets", "PointOffsets"):
        steps[name] = np.zeros(count, np.int64)
    steps["NumberOfParts"] = np.ones(count, np.int64)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((count, 1), np.int64)
    _arrays(group, steps, "PointData", one.point_data, (units, later, rounding))
    _arrays(group, steps, "CellData", one.cell_data, (units, later, rounding))
    _field_data(group, steps, text, count)


def _arrays(group, steps, kind: str, data: dict, about: tuple) -> None:
    (units, later, rounding), into, offsets = about, group[kind], _group(steps, f"{kind}Offsets")
    count = int(steps.attrs["NSteps"])
    for name, values in data.items():
        size = values.shape[1]
        if rounding is not None and values.dtype == np.float32 and len(values) == count:
            # a chunk holds one component: neighbours in it are neighbours in space, which pack to three quarters
            one = into.create_dataset(
                name,
                (count * size, *values.shape[2:]),
                values.dtype,
                shuffle=True,
                chunks=(max(size, 1), *(1 for _ in values.shape[2:])),
                compression="gzip",
                compression_opts=1,
            )
            nearest = _nearest(one, rounding.get(name, 0.0), BITS.get(name, MOST_BITS))
            if later is None:
                for number in range(count):
                    _frame(one, values, nearest, number)
            else:
                later.append((one, values, nearest))
        else:
            one = into.create_dataset(name, data=values.reshape(-1, *values.shape[2:]))
        one.attrs["units"] = units.get(name, "1")
        if name in MEANINGS:
            one.attrs["long_name"] = MEANINGS[name]
        if name in CODES:
            one.attrs["flag_values"] = np.array(list(CODES[name]), np.int8)
            one.attrs["flag_meanings"] = " ".join(CODES[name].values())
        offsets[name] = (
            np.arange(count) if len(values) == count else np.zeros(count, np.int64)
        ) * size
