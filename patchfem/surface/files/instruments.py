"""Files of other instruments through SurfaceTopography, which reads them in a process of its own (`topography`)."""

import io
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...core import Missing, PatchfemError
from ..areal import Areal
from ..profile import Profile
from ..samples import GIVEN, checked
from .arrays import lengths
from .raster import areal
from .raw import BROKEN, POINTS, Raw, reason, shown

PYTHON = sys.executable
SECONDS = 60.0
REMEDY = "pip install 'patchfem[profiles]'"


def instrument(raw: Raw, units: tuple | None) -> Profile | Areal:
    """The surface in a file of another instrument; Missing without SurfaceTopography, PatchfemError for a file that it
    cannot read, that is too large, or that names no units where none are given."""
    if not raw.data:
        answer = _asked(raw.path, raw.path)
    else:  # it was packed
        with tempfile.TemporaryDirectory() as folder:
            inner = Path(folder) / f"surface{raw.suffix if raw.suffix.isascii() and len(raw.suffix) < 12 else ''}"
            inner.write_bytes(raw.data)
            answer = _asked(raw.path, inner)
    found, arrays = _understood(raw.path, answer)
    if not found["unit"]:
        along, up = lengths(raw, units)
        arrays = [*(one * along for one in arrays[:-1]), arrays[-1] * up]
    stated = "the file tells both units" if found["unit"] else GIVEN
    note = f"{raw.path}: read as {shown(found['format'])} by SurfaceTopography {shown(found['version'])}"
    if len(arrays) == 3:
        return areal(raw.path, *arrays, stated, (note,))
    trace = checked(raw.path, *arrays, None, (1.0, 1.0), stated)
    return replace(trace, notes=(note, *trace.notes))


def _asked(path, file) -> bytes:
    script = Path(__file__).with_name("topography.py")
    words = [PYTHON, "-P", str(script), str(Path(file).absolute()), str(POINTS)]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # each thread would take address space
    try:
        done = subprocess.run(words, capture_output=True, timeout=SECONDS, env=environment, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        raise PatchfemError(f"{path}: SurfaceTopography did not read it in {SECONDS:g} s; export the surface as text "
                            "or X3P") from None
    except (OSError, ValueError) as error:
        raise Missing(f"{path}: no process could be started to read it ({error})") from None
    if done.returncode == 3:
        raise Missing(f"{path}: a file of an instrument; SurfaceTopography reads many of them: {REMEDY}, or export "
                      "the surface as text with the header `x [um],z [um]`")
    if done.returncode:
        raise PatchfemError(f"{path}: SurfaceTopography failed on it; export the surface as text or X3P")
    return done.stdout


def _understood(path, answer: bytes) -> tuple:
    """(what was found, arrays) of the answer of the other process."""
    head, _, rest = answer.partition(b"\n")
    try:
        found = json.loads(head)
        if "error" in found:
            raise PatchfemError(f"{path}: SurfaceTopography cannot read it ({reason(found['error'])}); export the "
                                "surface as text or X3P")
        file, arrays = io.BytesIO(rest), []
        while file.tell() < len(rest):
            arrays.append(np.load(file, allow_pickle=False))
    except BROKEN:
        raise PatchfemError(f"{path}: SurfaceTopography failed on it; export the surface as text or X3P") from None
    if len(arrays) not in (2, 3) or not all(one.size for one in arrays):
        raise PatchfemError(f"{path}: SurfaceTopography found no heights in it; export the surface as text or X3P")
    return found, arrays

