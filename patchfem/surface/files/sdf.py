"""Surface data files SDF of ISO 25178-71, in ASCII and in binary, and BCR-1.0 of the same layout. Lengths in metres.

A file is a header, NumProfiles profiles of NumPoints heights each, and a trailer. Missing: BAD or NaN in ASCII; in
binary NaN, the least value of a signed and the largest of an unsigned integer of two bytes or more.
"""

import struct

import numpy as np

from ...core import PatchfemError
from ...inputs.cells import NUMBER
from ..areal import Areal
from ..profile import Profile
from ..samples import METRES
from .raster import areal
from .raw import POINTS, Raw, shown

TYPES = ("<u1", "<u2", "<u4", "<f4", "<i1", "<i2", "<i4", "<f8")
_BINARY = struct.Struct("<8s10s12s12sHHddddBBB")
_NAMES = ("NumPoints", "NumProfiles", "Xscale", "Yscale", "Zscale", "Zresolution", "Compression", "DataType",
          "CheckType")
_NEEDED = _NAMES[:5]
_LINES = 200  # of an ASCII header


def sdf(raw: Raw) -> Profile | Areal:
    """The scan of an SDF file, the trace where it has one profile; PatchfemError names what is wrong in it."""
    header, data = (_ascii if raw.data[:1] == b"a" else _binary)(raw)
    count, rows = header["NumPoints"], header["NumProfiles"]
    z = np.reshape(data, (rows, count)) * header["Zscale"]
    notes = ()
    if header.get("CheckType"):
        notes = (f"{raw.path}: the checksum of the file (kind {header['CheckType']:g}) is not verified",)
    return areal(raw.path, np.arange(count) * header["Xscale"], np.arange(rows) * header["Yscale"], z, METRES, notes)


def _checked(raw: Raw, header: dict) -> dict:
    path = raw.path
    for name in _NEEDED:
        if name not in header:
            raise PatchfemError(f"{path}: the header lacks {name}; export the scan anew")
    for name in ("NumPoints", "NumProfiles"):
        if not 1 <= header[name] <= POINTS or header[name] != int(header[name]):
            raise PatchfemError(f"{path}: {name} = {header[name]:g}; a whole number >= 1 is needed")
        header[name] = int(header[name])
    if header["NumPoints"] * header["NumProfiles"] > POINTS:
        raise PatchfemError(f"{path}: {header['NumPoints']} x {header['NumProfiles']} heights, more than {POINTS:.0e}; "
                            "export a part of the scan")
    for name in ("Xscale", "Yscale", "Zscale"):
        one_row = name == "Yscale" and header["NumProfiles"] == 1  # means nothing there
        if not 0 < header[name] < np.inf and not one_row:
            raise PatchfemError(f"{path}: {name} = {header[name]:g}; a length > 0 m is needed")
    if header.get("Compression"):
        raise PatchfemError(f"{path}: the file is compressed; export the scan uncompressed")
    return header


def _binary(raw: Raw) -> tuple:
    if len(raw.data) < _BINARY.size:
        raise PatchfemError(f"{raw.path}: the header ends too early; export the scan anew")
    header = _checked(raw, dict(zip(_NAMES, _BINARY.unpack_from(raw.data)[4:])))
    if header["DataType"] >= len(TYPES):
        raise PatchfemError(f"{raw.path}: DataType = {header['DataType']}; a number from 0 to {len(TYPES) - 1} is "
                            "needed")
    kind = np.dtype(TYPES[header["DataType"]])
    count = header["NumPoints"] * header["NumProfiles"]
    if len(raw.data) - _BINARY.size < count * kind.itemsize:
        raise PatchfemError(f"{raw.path}: {len(raw.data) - _BINARY.size} bytes of heights, but {count} heights of type "
                            f"{kind.name} are needed; export the scan anew")
    data = np.frombuffer(raw.data, kind, count, _BINARY.size)
    z = data.astype(float)
    if kind.kind in "iu" and kind.itemsize > 1:
        ends = np.iinfo(kind)
        z[data == (ends.min if kind.kind == "i" else ends.max)] = np.nan
    elif kind.kind == "f":
        z[np.abs(data) >= np.finfo(kind).max] = np.nan
    return header, z


def _ascii(raw: Raw) -> tuple:
    head, star, rest = raw.data.partition(b"*")
    lines = head.decode("latin-1").splitlines()
    if not star or len(lines) > _LINES:
        raise PatchfemError(f"{raw.path}: the header does not end with *; export the scan anew")
    header = {}
    for number, line in enumerate(lines[1:], 2):
        name, _, value = (part.strip() for part in line.partition("="))
        known = next((one for one in _NAMES if one.lower() == name.lower()), None)
        if known and not NUMBER.fullmatch(value):
            raise PatchfemError(f"{raw.path}:{number}: {known} = '{shown(value)}': a number is needed")
        if known:
            header[known] = float(value)
    header = _checked(raw, header)
    count = header["NumPoints"] * header["NumProfiles"]
    words = rest.partition(b"*")[0].replace(b",", b" ").split(None, count)
    if len(words) != count:
        raise PatchfemError(f"{raw.path}: {'too many' if len(words) > count else len(words)} heights, but {count} are "
                            "needed; export the scan anew")
    try:
        z = np.array([np.nan if word.upper() == b"BAD" else float(word) for word in words])
    except ValueError as error:
        raise PatchfemError(f"{raw.path}: {shown(str(error))}; each height must be a number or BAD") from None
    return header, z
