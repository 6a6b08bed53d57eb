"""Conversion of fields: a frame as .vtu, the series as .pvd, the interface as .csv.

The .vtu is inline XML with arrays in base64 of LZMA blocks; the numbers are those of fields.vtkhdf
to the last bit. A unit is in the information key UNITS_LABEL of its array, where VTK stores units,
and in the name of a field array, "unit of gap: m", which every reader shows. Codes are given in the
same form, as "code of material: coating" with the code as its value. These field arrays are
numbers, because meshio refuses files with field arrays of text. ParaView reads TimeValue.

LZMA after a difference of neighbouring points takes 0.4 of the bytes of zlib, in up to twice the
time; this compensates for base64 and for the mesh in every frame. VTK reads it from 8.2 on,
ParaView from 5.6 on.
"""

import base64
import lzma
import re
import shutil
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from ...core import PatchfemError
from ...disk.atomic_write import explain_write_error, is_partial_name, write_atomically, write_text
from .blocks import CODES, PARTS, Block
from .series import Frame, Series

BLOCK_BYTES = 1 << 20  # size of a block before compression [bytes]
# LZMA filter settings for values of four bytes.
PACKING = {
    "id": lzma.FILTER_LZMA2,
    "preset": 0,
    "lc": 0,
    "lp": 2,
    "pb": 2,
}
TYPES = {
    "f4": "Float32",
    "f8": "Float64",
    "i1": "Int8",
    "i4": "Int32",
    "i8": "Int64",
    "u1": "UInt8",
}
# File names of the frames of a .pvd file.
FRAME_FILE = re.compile(rf"frame_\d+(\.vtm|(_({'|'.join(PARTS)}))?\.vtu)")
ENDINGS = (".pvd", ".vtu", ".csv", ".vtkhdf")


def export_fields(folder: Path, out: Path, frame: int | None = None) -> str:
    """Convert the fields of a results folder to the format of a file suffix.

    Parameters
    ----------
    folder : Path
    out : Path
        .vtu and .csv contain one frame, .pvd and .vtkhdf the series.
    frame : int, optional
        Number of the frame; by default the last.

    Raises
    ------
    PatchfemError
        For another suffix, and for a frame that does not exist.
    Missing
        If there are no fields, or `out` cannot be written.
    """
    out = Path(out)
    if out.suffix not in ENDINGS:
        raise PatchfemError(
            f"{out}: fields are exported as {', '.join(ENDINGS)}, the motion with a script "
            "for ParaView as .py; histories and loops as .uff, .mat, .csv --histories"
        )
    if frame is not None and out.suffix in (".pvd", ".vtkhdf"):
        raise PatchfemError(
            f"--frame: {out.suffix} contains the whole series; use a .vtu or .csv for one frame"
        )
    with Series(folder) as series:
        return _write_format(series, out, -1 if frame is None else frame)


def _write_format(series: Series, out: Path, number: int) -> str:
    """Write a series of fields, or one frame of it, in the format of a file suffix."""
    if out.suffix == ".vtkhdf":
        if out.exists() and out.samefile(series.path):
            raise PatchfemError(f"{out}: this is the file to export; choose another name with -o")
        with write_atomically(out, series.path.stat().st_size) as partial:
            shutil.copyfile(series.path, partial)
        return f"{out}: {_format_frame_count(len(series))}"
    if out.suffix == ".pvd":
        return f"{out}: {_format_frame_count(write_pvd(out, series))} in {frames_folder(out).name}"
    frame = series.frame(number)
    if out.suffix == ".vtu":
        write_vtu(out, frame, frame.time, frame.units)
    else:
        write_csv(out, frame)
    last = len(series) - 1
    which = "the last" if frame.number == last else f"of 0 to {last}"
    return f"{out}: frame {frame.number} ({which}), {frame.time:.6g} s"


def _format_frame_count(count: int) -> str:
    """Return the number of frames with its noun."""
    return f"{count} frame{'s' * (count != 1)}"


def frames_folder(path: Path) -> Path:
    """Return the folder that contains the frames of a .pvd file."""
    return path.with_name(path.stem + "_frames")


def write_pvd(path: Path, series: Series, numbers=None, change=None) -> int:
    """Write a series of fields as .pvd with one file per frame; return the number of frames.

    A folder with the same stem contains a .vtm per frame, which names the blocks, and a .vtu per
    block. Frames of a longer series in this folder are removed.

    Parameters
    ----------
    path : Path
    series : Series
    numbers : sequence of int, optional
        Numbers of the frames; by default all.
    change : callable, optional
        Frame -> the Frame that is written.

    Raises
    ------
    PatchfemError
        If the folder contains other files.
    """
    folder = frames_folder(path)
    old_files = list(folder.iterdir()) if folder.is_dir() else []
    other_files = sorted(
        item.name
        for item in old_files
        if not FRAME_FILE.fullmatch(item.name) and not is_partial_name(item.name)
    )
    if other_files:
        raise PatchfemError(
            f"{folder}: contains files that are not frames of patchfem ({', '.join(other_files[:3])}); "
            "choose another -o"
        )
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise explain_write_error(error, folder, folder) from None
    lines = []
    written_names = set()
    numbers = range(len(series)) if numbers is None else numbers
    for number in numbers:
        item = series.frame(number)
        names = _write_vtm(folder, f"frame_{number:04d}", item if change is None else change(item))
        written_names.update(names)
        lines.append(
            f'<DataSet timestep="{item.time!r}" group="" part="0" '
            f"file={quoteattr(f'{folder.name}/{names[0]}')}/>"
        )
    _write_listing(path, "Collection", "0.1", lines)
    for item in old_files:
        if item.name not in written_names:
            item.unlink(missing_ok=True)
    return len(numbers)


def _write_vtm(folder: Path, stem: str, frame: Frame) -> list:
    """Write a frame as a .vtm file with a .vtu file per mesh block; return their names."""
    names = [f"{stem}_{name}.vtu" for name in frame.blocks]
    for name, block_data in zip(names, frame.blocks.values()):
        write_vtu(folder / name, block_data, frame.time, frame.units)
    _write_listing(
        folder / f"{stem}.vtm",
        "vtkMultiBlockDataSet",
        "1.0",
        [
            f'<DataSet index="{k}" name="{block}" file="{name}"/>'
            for k, (block, name) in enumerate(zip(frame.blocks, names))
        ],
    )
    return [f"{stem}.vtm", *names]


def _write_listing(path: Path, kind: str, version: str, lines: list) -> None:
    """Write a VTK file that lists other files."""
    text = "\n".join(
        [
            '<?xml version="1.0"?>',
            f'<VTKFile type="{kind}" version="{version}" byte_order="LittleEndian">',
            f"  <{kind}>",
            *("    " + line for line in lines),
            f"  </{kind}>",
            "</VTKFile>",
            "",
        ]
    )
    write_text(path, text)


def write_vtu(path: Path, frame: Block | Frame, time: float, units: dict) -> None:
    """Write a mesh block, or a merged frame, as a .vtu file.

    Parameters
    ----------
    path : Path
    frame : Block or Frame
    time : float
        [s]
    units : dict
        Unit by name.
    """
    count = len(frame.points)
    cells = len(frame.types)
    text = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkLZMADataCompressor">',
        "<UnstructuredGrid>",
        "<FieldData>",
        *(
            _array_xml(name, np.array([value]), unit, ' NumberOfTuples="1"')
            for name, value, unit in (
                ("TimeValue", time, "s"),
                *_field_meanings((*frame.point_data, *frame.cell_data), units),
            )
        ),
        "</FieldData>",
        f'<Piece NumberOfPoints="{count}" NumberOfCells="{cells}">',
    ]
    for kind, data in (("PointData", frame.point_data), ("CellData", frame.cell_data)):
        text += [
            f"<{kind}>",
            *(_array_xml(name, values, units.get(name)) for name, values in data.items()),
            f"</{kind}>",
        ]
    text += [
        "<Points>",
        _array_xml("Points", frame.points, "m"),
        "</Points>",
        "<Cells>",
        _array_xml("connectivity", frame.connectivity.astype(np.int64)),
        _array_xml("offsets", frame.offsets[1:].astype(np.int64)),
        _array_xml("types", frame.types.astype(np.uint8)),
        "</Cells>",
        "</Piece>",
        "</UnstructuredGrid>",
        "</VTKFile>",
        "",
    ]
    write_text(path, "\n".join(text), "ascii")


def _field_meanings(names: tuple, units: dict) -> list:
    """Return metadata arrays (name, value, None) with unit and codes of every field array."""
    return [(f"unit of {name}: {units.get(name, '1')}", 1.0, None) for name in names] + [
        (f"code of {name}: {meaning}", code, None)
        for name in names
        for code, meaning in CODES.get(name, {}).items()
    ]


def _array_xml(name: str, values, unit: str | None = None, attributes: str = "") -> str:
    """Return a field array as an XML element of VTK."""
    values = np.ascontiguousarray(values)
    kind = TYPES[values.dtype.newbyteorder("<").str[1:]]
    if values.ndim > 1:
        attributes += f' NumberOfComponents="{values.shape[1]}"'
    label = (
        ""
        if unit is None
        else f'<InformationKey name="UNITS_LABEL" location="vtkDataArray">{unit}</InformationKey>'
    )
    head = f'<DataArray type="{kind}" Name={quoteattr(name)}{attributes} format="binary">'
    return f"{head}\n{_compress_array(values)}\n{label}</DataArray>"


def _compress_array(values) -> str:
    """Return sizes and LZMA blocks of an array in base64, as in the XML formats of VTK."""
    raw = values.astype(values.dtype.newbyteorder("<")).tobytes()
    width = values.dtype.itemsize * (values.shape[1] if values.ndim > 1 else 1)
    filters = [{"id": lzma.FILTER_DELTA, "dist": min(width, 256)}, PACKING]
    blocks = [
        lzma.compress(raw[at : at + BLOCK_BYTES], lzma.FORMAT_XZ, lzma.CHECK_CRC32, filters=filters)
        for at in range(0, len(raw), BLOCK_BYTES)
    ]
    sizes = np.array([len(blocks), BLOCK_BYTES, len(raw) % BLOCK_BYTES, *map(len, blocks)], "<u8")
    return (base64.b64encode(sizes.tobytes()) + base64.b64encode(b"".join(blocks))).decode()


def write_csv(path: Path, frame: Frame) -> None:
    """Write the interface of a frame as CSV, with a row per node and a column per field.

    The values are in SI, with the unit in the header.
    """
    line = frame.blocks["interface"]
    nodes = np.argsort(line.points[:, 0], kind="stable")
    head = ["x [m]"]
    columns = [[repr(float(x)) for x in line.points[nodes, 0]]]
    for name, values in line.point_data.items():
        node_values = values[nodes]
        parts = (
            [(name, node_values)]
            if node_values.ndim == 1
            else [(f"{name}_{axis}", node_values[:, k]) for k, axis in enumerate("xyz")]
        )
        for label, part in parts:
            head.append(f"{label} [{frame.units.get(name, '1')}]")
            columns.append([str(value) for value in part])
    text = "\n".join([",".join(head), *map(",".join, zip(*columns)), ""])
    write_text(path, text)
