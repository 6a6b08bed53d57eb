"""Results folder to other files: a frame as .vtu, the series as .pvd with named blocks, the interface as .csv.

The .vtu is inline XML, arrays in base64 of LZMA blocks, the numbers those of fields.vtkhdf to the last bit. A unit
stands in the information key UNITS_LABEL of its array, where VTK keeps units, and where every reader shows it: in the
name of a field array, "unit of gap: m". Codes too, as "code of material: coating" with the code as its value. Both are
numbers because meshio refuses a file with field arrays of text. ParaView reads TimeValue.

LZMA behind a difference of neighbouring points takes 0.4 of the bytes of zlib, in up to twice the time; that makes good
what base64 and a mesh in every frame cost beside fields.vtkhdf. VTK reads it from 8.2 on, ParaView from 5.6.
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

BLOCK = 1 << 20  # bytes of a compressed block
# for numbers of four bytes
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
FRAME = re.compile(rf"frame_\d+(\.vtm|(_({'|'.join(PARTS)}))?\.vtu)")  # files of a .pvd
ENDINGS = (".pvd", ".vtu", ".csv", ".vtkhdf")


def export(folder: Path, out: Path, frame: int | None = None) -> str:
    """Write the fields of a results folder as the ending of `out` says; one line on what was written.

    .vtu and .csv hold one frame (the last, or `frame`), .pvd and .vtkhdf the series. PatchfemError for another ending
    and a frame that is not there, Missing where there are no fields or `out` cannot be written.
    """
    out = Path(out)
    if out.suffix not in ENDINGS:
        raise PatchfemError(
            f"{out}: fields are exported as {', '.join(ENDINGS)}, the last cycle with a script "
            "for ParaView as .py; histories and loops as .uff, .mat, .csv --histories"
        )
    if frame is not None and out.suffix in (".pvd", ".vtkhdf"):
        raise PatchfemError(
            f"--frame: {out.suffix} contains the whole series; use a .vtu or .csv for one frame"
        )
    with Series(folder) as series:
        return _export(series, out, -1 if frame is None else frame)


def _export(series: Series, out: Path, number: int) -> str:
    if out.suffix == ".vtkhdf":
        if out.exists() and out.samefile(series.path):
            raise PatchfemError(f"{out}: this is the file to export; choose another name with -o")
        with write_atomically(out, series.path.stat().st_size) as partial:
            shutil.copyfile(series.path, partial)
        return f"{out}: {_frames(len(series))}"
    if out.suffix == ".pvd":
        return f"{out}: {_frames(write_pvd(out, series))} in {frames_beside(out).name}"
    one = series.frame(number)
    if out.suffix == ".vtu":
        write_vtu(out, one, one.time, one.units)
    else:
        write_csv(out, one)
    last = len(series) - 1
    which = "the last" if one.number == last else f"of 0 to {last}"
    return f"{out}: frame {one.number} ({which}), {one.time:.6g} s"


def _frames(count: int) -> str:
    return f"{count} frame{'s' * (count != 1)}"


def frames_beside(path: Path) -> Path:
    """The folder of the frames of a .pvd."""
    return path.with_name(path.stem + "_frames")


def write_pvd(path: Path, series: Series, numbers=None, change=None) -> int:
    """Write the series as a .pvd, which any ParaView opens; returns the number of frames.

    numbers: of the frames written, all unless given; change: makes of a Frame the one that is written.
    In the folder beside it stand a .vtm per frame, which names the blocks, and a .vtu per block.
    Frames left there by a longer series are removed; PatchfemError where the folder holds anything else.
    """
    folder = frames_beside(path)
    old = list(folder.iterdir()) if folder.is_dir() else []
    strange = sorted(
        one.name for one in old if not FRAME.fullmatch(one.name) and not is_partial_name(one.name)
    )
    if strange:
        raise PatchfemError(
            f"{folder}: contains files that are not frames of patchfem ({', '.join(strange[:3])}); "
            "choose another -o"
        )
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise explain_write_error(error, folder, folder) from None
    lines, written = [], set()
    numbers = range(len(series)) if numbers is None else numbers
    for number in numbers:
        one = series.frame(number)
        names = _write_vtm(folder, f"frame_{number:04d}", one if change is None else change(one))
        written.update(names)
        lines.append(
            f'<DataSet timestep="{one.time!r}" group="" part="0" '
            f"file={quoteattr(f'{folder.name}/{names[0]}')}/>"
        )
    _listing(path, "Collection", "0.1", lines)
    for one in old:
        if one.name not in written:
            one.unlink(missing_ok=True)
    return len(numbers)


def _write_vtm(folder: Path, stem: str, frame: Frame) -> list:
    """Write a frame as a .vtm and a .vtu per block; the names of the files, the .vtm first."""
    names = [f"{stem}_{name}.vtu" for name in frame.blocks]
    for name, one in zip(names, frame.blocks.values()):
        write_vtu(folder / name, one, frame.time, frame.units)
    _listing(
        folder / f"{stem}.vtm",
        "vtkMultiBlockDataSet",
        "1.0",
        [
            f'<DataSet index="{k}" name="{block}" file="{name}"/>'
            for k, (block, name) in enumerate(zip(frame.blocks, names))
        ],
    )
    return [f"{stem}.vtm", *names]


def _listing(path: Path, kind: str, version: str, lines: list) -> None:
    """Write a file of VTK that lists other files."""
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
    """Write a block, or a whole frame as one mesh, at a time [s] with inline arrays; units: name -> unit."""
    count, cells = len(frame.points), len(frame.types)
    text = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkLZMADataCompressor">',
        "<UnstructuredGrid>",
        "<FieldData>",
        *(
            _array(name, np.array([value]), unit, ' NumberOfTuples="1"')
            for name, value, unit in (
                ("TimeValue", time, "s"),
                *_meanings((*frame.point_data, *frame.cell_data), units),
            )
        ),
        "</FieldData>",
        f'<Piece NumberOfPoints="{count}" NumberOfCells="{cells}">',
    ]
    for kind, data in (("PointData", frame.point_data), ("CellData", frame.cell_data)):
        text += [
            f"<{kind}>",
            *(_array(name, values, units.get(name)) for name, values in data.items()),
            f"</{kind}>",
        ]
    text += [
        "<Points>",
        _array("Points", frame.points, "m"),
        "</Points>",
        "<Cells>",
        _array("connectivity", frame.connectivity.astype(np.int64)),
        _array("offsets", frame.offsets[1:].astype(np.int64)),
        _array("types", frame.types.astype(np.uint8)),
        "</Cells>",
        "</Piece>",
        "</UnstructuredGrid>",
        "</VTKFile>",
        "",
    ]
    write_text(path, "\n".join(text), "ascii")


def _meanings(names: tuple, units: dict) -> list:
    """(Name, value, None) of the field arrays that say the unit of every array and its codes."""
    return [(f"unit of {name}: {units.get(name, '1')}", 1.0, None) for name in names] + [
        (f"code of {name}: {meaning}", code, None)
        for name in names
        for code, meaning in CODES.get(name, {}).items()
    ]


def _array(name: str, values, unit: str | None = None, more: str = "") -> str:
    values = np.ascontiguousarray(values)
    kind = TYPES[values.dtype.newbyteorder("<").str[1:]]
    if values.ndim > 1:
        more += f' NumberOfComponents="{values.shape[1]}"'
    label = (
        ""
        if unit is None
        else f'<InformationKey name="UNITS_LABEL" location="vtkDataArray">{unit}</InformationKey>'
    )
    head = f'<DataArray type="{kind}" Name={quoteattr(name)}{more} format="binary">'
    return f"{head}\n{_packed(values)}\n{label}</DataArray>"


def _packed(values) -> str:
    """Sizes and LZMA blocks of an array, each in base64, as VTK's XML formats hold compressed inline data."""
    raw = values.astype(values.dtype.newbyteorder("<")).tobytes()
    width = values.dtype.itemsize * (values.shape[1] if values.ndim > 1 else 1)
    filters = [{"id": lzma.FILTER_DELTA, "dist": min(width, 256)}, PACKING]
    blocks = [
        lzma.compress(raw[at : at + BLOCK], lzma.FORMAT_XZ, lzma.CHECK_CRC32, filters=filters)
        for at in range(0, len(raw), BLOCK)
    ]
    sizes = np.array([len(blocks), BLOCK, len(raw) % BLOCK, *map(len, blocks)], "<u8")
    return (base64.b64encode(sizes.tobytes()) + base64.b64encode(b"".join(blocks))).decode()


def write_csv(path: Path, frame: Frame) -> None:
    """Write the interface of one frame: a row per node by rising x, a column per field; SI, the unit in the header."""
    line = frame.blocks["interface"]
    nodes = np.argsort(line.points[:, 0], kind="stable")
    head, columns = ["x [m]"], [[repr(float(x)) for x in line.points[nodes, 0]]]
    for name, values in line.point_data.items():
        mine = values[nodes]
        parts = (
            [(name, mine)]
            if mine.ndim == 1
            else [(f"{name}_{axis}", mine[:, k]) for k, axis in enumerate("xyz")]
        )
        for label, part in parts:
            head.append(f"{label} [{frame.units.get(name, '1')}]")
            columns.append([str(value) for value in part])
    text = "\n".join([",".join(head), *map(",".join, zip(*columns)), ""])
    write_text(path, text)
