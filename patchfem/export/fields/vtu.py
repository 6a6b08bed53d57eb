"""Results folder to other files: a frame as .vtu, the series as .pvd with a .vtu per frame, the interface as .csv.

The .vtu is inline XML, arrays in base64 of zlib blocks, the numbers those of fields.vtkhdf to the last bit. A unit
stands in the information key UNITS_LABEL of its array, where VTK keeps units; ParaView reads TimeValue.
"""

import base64
import os
import shutil
import zlib
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from ...core import Missing, PatchfemError
from .vtkhdf import Frame, Series

BLOCK = 1 << 20  # bytes of a compressed block
TYPES = {"f4": "Float32", "f8": "Float64", "i1": "Int8", "i4": "Int32", "i8": "Int64", "u1": "UInt8"}
ENDINGS = (".pvd", ".vtu", ".csv", ".vtkhdf")
LATER = {".uff": "UFF58", ".uf": "UFF58", ".unv": "UFF58", ".58": "UFF58", ".mat": ".mat"}


def export(folder: Path, out: Path, frame: int | None = None) -> str:
    """Write the fields of a results folder as the ending of `out` says; one line on what was written.

    .vtu and .csv hold one frame (the last, or `frame`), .pvd and .vtkhdf the series. PatchfemError for another ending
    and a frame that is not there, Missing where there are no fields or `out` cannot be written.
    """
    out = Path(out)
    if out.suffix in LATER:
        raise PatchfemError(f"{out}: export of {LATER[out.suffix]} is not yet built; built are {', '.join(ENDINGS)}")
    if out.suffix not in ENDINGS:
        raise PatchfemError(f"{out}: fields are exported as {', '.join(ENDINGS)}")
    if frame is not None and out.suffix in (".pvd", ".vtkhdf"):
        raise PatchfemError(f"--frame: {out.suffix} holds the whole series; name a .vtu or .csv for one frame")
    with Series(folder) as series:
        try:
            return _export(series, out, -1 if frame is None else frame)
        except OSError as error:
            raise Missing(f"{out}: cannot be written ({error.strerror or error})") from None


def _export(series: Series, out: Path, number: int) -> str:
    if out.suffix == ".vtkhdf":
        if out.exists() and out.samefile(series.path):
            raise PatchfemError(f"{out}: is the file that is exported; name another -o")
        _whole(out, lambda partial: shutil.copyfile(series.path, partial))
        return f"{out}: {len(series)} frames"
    if out.suffix == ".pvd":
        return f"{out}: {write_pvd(out, series)} frames in {frames_beside(out).name}"
    one = series.frame(number)
    (write_vtu if out.suffix == ".vtu" else write_csv)(out, one)
    return f"{out}: frame {one.number} of {len(series)}, {one.time:.6g} s"


def _whole(path: Path, write) -> None:
    """Write beside `path` and rename, so that an older file is replaced only by a whole one."""
    partial = path.with_name(path.name + ".partial")
    try:
        write(partial)
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def frames_beside(path: Path) -> Path:
    """The folder of the frames of a .pvd."""
    return path.with_name(path.stem + "_frames")


def write_pvd(path: Path, series: Series) -> int:
    """Write the series as a .pvd and one .vtu per frame in the folder beside it; returns the number of frames.

    Frames left there by a longer series are removed; PatchfemError where the folder holds anything else.
    """
    folder = frames_beside(path)
    old = list(folder.iterdir()) if folder.is_dir() else []
    strange = sorted(one.name for one in old if not _ours(one.name.removesuffix(".partial")))
    if strange:
        raise PatchfemError(f"{folder}: holds files that are not frames of patchfem ({', '.join(strange[:3])}); "
                            "name another -o")
    folder.mkdir(exist_ok=True)
    names = [f"frame_{number:04d}.vtu" for number in range(len(series))]
    for number, name in enumerate(names):
        write_vtu(folder / name, series.frame(number))
    files = [quoteattr(f"{folder.name}/{name}") for name in names]
    lines = [f'    <DataSet timestep="{float(time)!r}" group="" part="0" file={file}/>'
             for time, file in zip(series.times, files)]
    text = "\n".join(['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">',
                      "  <Collection>", *lines, "  </Collection>", "</VTKFile>", ""])
    _whole(path, lambda partial: partial.write_text(text, "utf-8"))
    for one in old:
        if one.name not in names:
            one.unlink()
    return len(names)


def _ours(name: str) -> bool:
    return name.startswith("frame_") and name.endswith(".vtu") and name[6:-4].isdigit()


def write_vtu(path: Path, frame: Frame) -> None:
    """One frame as an unstructured grid of VTK with inline arrays."""
    count, cells = len(frame.points), len(frame.types)
    text = ['<?xml version="1.0"?>',
            '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
            'compressor="vtkZLibDataCompressor">', "<UnstructuredGrid>", "<FieldData>",
            _array("TimeValue", np.array([frame.time]), "s", ' NumberOfTuples="1"'), "</FieldData>",
            f'<Piece NumberOfPoints="{count}" NumberOfCells="{cells}">']
    for kind, data in (("PointData", frame.point_data), ("CellData", frame.cell_data)):
        text += [f"<{kind}>", *(_array(name, values, frame.units.get(name)) for name, values in data.items()),
                 f"</{kind}>"]
    text += ["<Points>", _array("Points", frame.points, "m"), "</Points>", "<Cells>",
             _array("connectivity", frame.connectivity.astype(np.int64)),
             _array("offsets", frame.offsets[1:].astype(np.int64)), _array("types", frame.types.astype(np.uint8)),
             "</Cells>", "</Piece>", "</UnstructuredGrid>", "</VTKFile>", ""]
    _whole(path, lambda partial: partial.write_text("\n".join(text), "ascii"))


def _array(name: str, values, unit: str | None = None, more: str = "") -> str:
    values = np.ascontiguousarray(values)
    kind = TYPES[values.dtype.newbyteorder("<").str[1:]]
    if values.ndim > 1:
        more += f' NumberOfComponents="{values.shape[1]}"'
    label = "" if unit is None else \
        f'<InformationKey name="UNITS_LABEL" location="vtkDataArray">{unit}</InformationKey>'
    head = f'<DataArray type="{kind}" Name={quoteattr(name)}{more} format="binary">'
    return f"{head}\n{_packed(values)}\n{label}</DataArray>"


def _packed(values) -> str:
    """Sizes and zlib blocks of an array, each in base64, as VTK's XML formats hold compressed inline data."""
    raw = values.astype(values.dtype.newbyteorder("<")).tobytes()
    blocks = [zlib.compress(raw[at:at + BLOCK], 1) for at in range(0, len(raw), BLOCK)]
    sizes = np.array([len(blocks), BLOCK, len(raw) % BLOCK, *map(len, blocks)], "<u8")
    return (base64.b64encode(sizes.tobytes()) + base64.b64encode(b"".join(blocks))).decode()


def write_csv(path: Path, frame: Frame) -> None:
    """Write the interface of one frame: a row per node by rising x, a column per field; SI, the unit in the header."""
    nodes = frame.interface()
    head, columns = ["x [m]"], [[repr(float(x)) for x in frame.points[nodes, 0]]]
    for name, values in frame.point_data.items():
        mine = values[nodes]
        parts = [(name, mine)] if mine.ndim == 1 else [(f"{name}_{axis}", mine[:, k]) for k, axis in enumerate("xyz")]
        for label, part in parts:
            head.append(f"{label} [{frame.units.get(name, '1')}]")
            columns.append([str(value) for value in part])
    text = "\n".join([",".join(head), *map(",".join, zip(*columns)), ""])
    _whole(path, lambda partial: partial.write_text(text, "utf-8"))
