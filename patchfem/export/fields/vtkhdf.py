"""Writer of fields.vtkhdf: a time series of three named blocks for VTK 9.4 to 9.7.

The blocks `lower`, `upper` and `interface` form a vtkMultiBlockDataSet. Units and the meanings of
codes are attributes of the arrays, and also in the field arrays `units` and `codes` of every block,
which VTK 9.6 and 9.7 ignore.

VTK 9.6 and 9.7 stay at the first time unless there is a group `Steps` next to the blocks; VTK 9.4
takes any such group for a block. Therefore `Steps` is also a complete but empty mesh that is not
part of the assembly.

The varying arrays of a series with more than MIN_COMPRESSED_BYTES bytes are compressed, component by component.
Their numbers are rounded, to a multiple of a step or to a number of bits, and every array states
the effect: at most `rounding_error` in its unit, or the fraction 2^-(significant_bits + 1) of each
value. A series of more than MIN_FRAMEWISE_BYTES bytes is written frame after frame: what a killed process leaves
(`.fields.*.vtkhdf`) contains every frame that `NSteps` counts.
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
# Version of the VTKHDF format; the writer needs nothing from later versions.
VERSION = np.array([2, 2], np.int64)
# Size of the varying arrays [bytes] above which they are compressed: from 9.6 MB to 2.8 MB
# in 0.06 s for the shipped rig.
MIN_COMPRESSED_BYTES = 1 << 22
# Size of the varying arrays [bytes] above which the file is written frame by frame.
MIN_FRAMEWISE_BYTES = 1 << 28
# Number of mantissa bits (of 23) that are kept, by array; the estimated error is accurate to
# about 10 %.
BITS = {"stress_error": 5}
# Number of mantissa bits that are kept of other arrays that have no rounding step: a relative
# error of 3e-5, far below the discretization error.
OTHER_BITS = 14
EMPTY = Block(
    np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(1, np.int64), np.zeros(0, np.uint8), {}, {}
)


def write_series(path: Path, blocks: dict, times, units: dict, steps: dict | None = None) -> None:
    """Write a series of fields on fixed meshes as VTKHDF.

    The file is written completely under another name and then renamed. Its HDF5 version is one that
    the reader of VTK knows.

    Parameters
    ----------
    path : Path
    blocks : dict of Block
        By name; data are (f or 1, n or c, ...), 1 if constant.
    times : (f,) array
        [s]
    units : dict
        Unit by name.
    steps : dict, optional
        Block -> array -> largest step [its unit] to which a compressed series may round the array.
    """
    path = Path(path)
    size = sum(
        values.nbytes
        for block in blocks.values()
        for data in (block.point_data, block.cell_data)
        for values in data.values()
    )
    large = size > MIN_FRAMEWISE_BYTES
    large_arrays = []
    packed = large or size > MIN_COMPRESSED_BYTES
    with (
        write_atomically(path, None if large else size) as partial,
        open_lossy(partial) as opened,
        h5py.File(opened, "w", libver=("earliest", "v110")) as file,
    ):
        root = _create_group(file, "VTKHDF")
        root.attrs["Version"] = VERSION
        root.attrs.create("Type", np.bytes_("MultiBlockDataSet"))
        text = _field_texts(blocks, units)
        assembly = _create_group(root, "Assembly")
        for name, one in blocks.items():
            rounding = (steps or {}).get(name, {}) if packed else None
            _write_block(
                _create_group(root, name),
                one,
                times,
                (units, text, large_arrays if large else None, rounding),
            )
            assembly[name] = h5py.SoftLink(f"/VTKHDF/{name}")
        all_steps = _create_steps(root, times)
        _write_mesh(all_steps, EMPTY)
        all_steps["Steps"] = root[next(iter(blocks))]["Steps"]
        if large_arrays:
            _write_frames(
                file,
                [all_steps, *(root[name]["Steps"] for name in blocks)],
                large_arrays,
                len(times),
            )


def _write_frames(file, steps: list, large_arrays: list, count: int) -> None:
    """Write field arrays frame by frame; count a frame only after it is safely on disk.

    VTK reads beyond its memory unless there are as many times as frames.

    Parameters
    ----------
    file : h5py.File
    steps : list
        Groups `Steps`.
    large_arrays : list
        (dataset, values (f, n, ...), rounding of one frame) of each array.
    count : int
        Number of frames.
    """
    times = [step["Values"][:] for step in steps]
    for number in range(count):
        _set_frame_count(steps, times, number)
        for frame_array in large_arrays:
            _write_frame(*frame_array, number)
        file.flush()
    _set_frame_count(steps, times, count)


def _write_frame(dataset, values, nearest, number: int) -> None:
    """Write one frame of a field array, with one HDF5 chunk per component.

    A chunk has the bytes of its numbers shuffled and deflated, as HDF5 does it. A chunk of zeros is
    left out, because readers get 0 for a missing chunk.

    Parameters
    ----------
    dataset : h5py.Dataset
    values : (f, n, ...) array
    nearest : callable
        Rounding.
    number : int
        Number of the frame.
    """
    size = values.shape[1]
    for place, part in enumerate(nearest(values[number]).reshape(size, -1).T):
        if part.any():
            # On shuffled bytes, run-length matching takes 3/4 of the time of the default strategy.
            packer = zlib.compressobj(1, strategy=zlib.Z_RLE)
            raw = np.ascontiguousarray(part).view(np.uint8).reshape(size, -1).T.tobytes()
            dataset.id.write_direct_chunk(
                (number * size, place)[: dataset.ndim], packer.compress(raw) + packer.flush()
            )


def _set_frame_count(steps: list, times: list, count: int) -> None:
    """Set the number of frames that readers of the file find."""
    for group, all_times in zip(steps, times):
        group.attrs["NSteps"] = np.int64(count)
        group["Values"].resize((count,))
        group["Values"][...] = all_times[:count]


def round_to_bits(values, bits: int) -> np.ndarray:
    """Return float32 values rounded to a number of bits after the leading one.

    The other bits are zeros, which compress well.

    Parameters
    ----------
    values : array
    bits : int
        0 < bits < 23; the relative error is at most 2^-(bits + 1). Infinities and NaN are kept.
    """
    raw = np.ascontiguousarray(values, np.float32).view(np.uint32)
    drop = np.uint32(23 - bits)
    half = np.uint32(1) << (drop - np.uint32(1))
    unit_bit = np.uint32(1)
    rounded = (raw + (half - unit_bit) + ((raw >> drop) & unit_bit)) >> drop << drop
    return np.where(np.isfinite(values), rounded.view(np.float32), values)


def round_to_step(values, step: float) -> np.ndarray:
    """Return float32 values rounded to the nearest multiple of `step`, a power of two.

    The error is at most half a step. Infinities, NaN and values too large to have fractions of a
    step are kept.
    """
    values = np.asarray(values, np.float32)
    step, steps_per_unit = np.float32(step), np.float32(1 / step)
    # Comparisons with NaN are false.
    if max(values.max(initial=0.0), -values.min(initial=0.0)) < step * np.float32(1 << 23):
        return np.rint(values * steps_per_unit) * step
    with np.errstate(over="ignore"):
        return np.where(
            np.abs(values) < step * np.float32(1 << 23),
            np.rint(values * steps_per_unit) * step,
            values,
        )


def _rounding_function(dataset, step: float, bits: int):
    """Return a function that rounds a field array, and record the rounding in the file.

    It rounds to the power of two at or below `step`, or to `bits` if the step is 0 or outside the range
    of float32.
    """
    if not 1e-30 < step < 1e30:
        dataset.attrs["significant_bits"] = bits
        return partial(round_to_bits, bits=bits)
    step = 2.0 ** math.floor(math.log2(step))
    dataset.attrs["rounding_error"] = step / 2
    return partial(round_to_step, step=step)


def _create_group(parent, name: str):
    """Create an HDF5 group that keeps the order of its entries."""
    return parent.create_group(name, track_order=True)


def _field_texts(blocks: dict, units: dict) -> dict:
    """Return the units of all arrays and the meanings of their codes as text arrays."""
    names = dict.fromkeys(
        name for block in blocks.values() for name in (*block.point_data, *block.cell_data)
    )
    return {
        "units": [f"{name} [{units.get(name, '1')}]" for name in names],
        "codes": [
            f"{name} {code} {meaning}"
            for name in names
            for code, meaning in CODES.get(name, {}).items()
        ],
    }


def _create_steps(group, times):
    """Create the VTKHDF group that contains the times."""
    steps = _create_group(group, "Steps")
    steps.attrs["NSteps"] = np.int64(len(times))
    steps.create_dataset("Values", data=np.asarray(times, np.float64), maxshape=(None,))
    return steps


def _write_field_data(group, steps, text: dict, count: int) -> None:
    """Write text arrays that are the same in all frames."""
    field = group["FieldData"]
    offsets = _create_group(steps, "FieldDataOffsets")
    sizes = _create_group(steps, "FieldDataSizes")
    for name, lines in text.items():
        if lines:
            field.create_dataset(name, data=lines, dtype=h5py.string_dtype("ascii"))
            offsets[name] = np.zeros(count, np.int64)
            sizes[name] = np.tile([1, len(lines)], (count, 1)).astype(np.int64)


def _write_mesh(group, block: Block) -> None:
    """Write points and cells of a mesh block."""
    group.attrs["Version"] = VERSION
    group.attrs.create("Type", np.bytes_("UnstructuredGrid"))
    group["NumberOfPoints"] = np.array([len(block.points)], np.int64)
    group["NumberOfCells"] = np.array([len(block.types)], np.int64)
    group["NumberOfConnectivityIds"] = np.array([block.connectivity.size], np.int64)
    group["Points"] = block.points
    group["Connectivity"] = block.connectivity
    group["Offsets"] = block.offsets
    group["Types"] = block.types
    for kind in ("PointData", "CellData", "FieldData"):
        _create_group(group, kind)


def _write_block(group, block: Block, times, settings: tuple) -> None:
    """Write a mesh block with its arrays.

    settings: units by name; the field arrays of text; the list for arrays that are written frame after
    frame, None if all are written at once; and the rounding steps by name, None if the
    arrays are not compressed.
    """
    units, text, large_arrays, rounding = settings
    _write_mesh(group, block)
    steps = _create_steps(group, times)
    count = len(times)
    for name in ("PartOffsets", "PointOffsets"):
        steps[name] = np.zeros(count, np.int64)
    steps["NumberOfParts"] = np.ones(count, np.int64)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((count, 1), np.int64)
    _write_arrays(group, steps, "PointData", block.point_data, (units, large_arrays, rounding))
    _write_arrays(group, steps, "CellData", block.cell_data, (units, large_arrays, rounding))
    _write_field_data(group, steps, text, count)


def _write_arrays(group, steps, kind: str, data: dict, settings: tuple) -> None:
    """Write the point and cell arrays of a mesh block."""
    (units, large_arrays, rounding), target, offsets = (
        settings,
        group[kind],
        _create_group(steps, f"{kind}Offsets"),
    )
    count = int(steps.attrs["NSteps"])
    for name, values in data.items():
        size = values.shape[1]
        if rounding is not None and values.dtype == np.float32 and len(values) == count:
            # Each chunk has a single component: neighbours in it are neighbours in space and
            # compress to three quarters of the size.
            dataset = target.create_dataset(
                name,
                (count * size, *values.shape[2:]),
                values.dtype,
                shuffle=True,
                chunks=(max(size, 1), *(1 for _ in values.shape[2:])),
                compression="gzip",
                compression_opts=1,
            )
            nearest = _rounding_function(
                dataset, rounding.get(name, 0.0), BITS.get(name, OTHER_BITS)
            )
            if large_arrays is None:
                for number in range(count):
                    _write_frame(dataset, values, nearest, number)
            else:
                large_arrays.append((dataset, values, nearest))
        else:
            dataset = target.create_dataset(name, data=values.reshape(-1, *values.shape[2:]))
        dataset.attrs["units"] = units.get(name, "1")
        if name in MEANINGS:
            dataset.attrs["long_name"] = MEANINGS[name]
        if name in CODES:
            dataset.attrs["flag_values"] = np.array(list(CODES[name]), np.int8)
            dataset.attrs["flag_meanings"] = " ".join(CODES[name].values())
        offsets[name] = (
            np.arange(count) if len(values) == count else np.zeros(count, np.int64)
        ) * size
