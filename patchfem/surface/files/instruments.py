"""Files in formats of instruments, read with SurfaceTopography in a separate process.

Importing the library takes two seconds for each file.
"""

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
from ..samples import GIVEN_UNITS_NOTE, make_trace
from .arrays import length_factors
from .raster import make_scan_from_matrix
from .raw import MAX_POINTS, UNPACK_ERRORS, RawFile, shorten, shorten_reason
from .units import UNITS_IGNORED

PYTHON = sys.executable
# CPU time to read a file, in seconds, which does not depend on the load of the machine.
MAX_CPU_SECONDS = 60.0
# Elapsed time to read a file, in seconds; ten times the CPU time leaves room for other processes.
MAX_SECONDS = 600.0
EXIT_NO_LIBRARY = 3  # exit code of the script if SurfaceTopography is not installed
CPU_LIMIT_SIGNAL = -24  # exit code of a process that exceeded its CPU time (SIGXCPU)


def read_instrument(raw: RawFile, units: tuple | None) -> Profile | Areal:
    """Read a file in an instrument format with the package SurfaceTopography.

    Raises Missing without SurfaceTopography, and PatchfemError if it cannot read the file, if the
    file is too large, or if neither the file nor the caller states the units.
    """
    if raw.data:  # the file was packed
        suffix = raw.suffix if raw.suffix.isascii() and len(raw.suffix) < 12 else ""
        with tempfile.TemporaryDirectory() as folder:
            unpacked = Path(folder) / f"surface{suffix}"
            unpacked.write_bytes(raw.data)
            content = _run_script(raw.path, unpacked)
    else:
        content = _run_script(raw.path, raw.path)
    about = json.loads(str(content["about"]))
    arrays = [content[name] for name in ("x", "y", "z") if name in content]
    stated = "the file states the units of heights and length"
    if not about["unit"]:
        factors = length_factors(raw, units)
        arrays = [
            *(values * factors.lateral for values in arrays[:-1]),
            arrays[-1] * factors.height,
        ]
        stated = GIVEN_UNITS_NOTE
    library = f"SurfaceTopography {shorten(about['version'])}"
    notes = (f"{raw.path}: read as {shorten(about['format'])} by {library}",)
    if about["unit"] and units:
        notes += (f"{raw.path}: {UNITS_IGNORED}",)
    if len(arrays) == 3:
        return make_scan_from_matrix(raw.path, *arrays, stated, notes)
    trace = make_trace(raw.path, *arrays, None, (1.0, 1.0), stated)
    return replace(trace, notes=(*notes, *trace.notes))


def _run_script(path, file: Path) -> dict:
    """Read a file with SurfaceTopography in a separate process and return its arrays."""
    script = Path(__file__).with_name("topography.py")
    arguments = map(str, (script, file.absolute(), MAX_POINTS, MAX_CPU_SECONDS))
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # each thread takes address space
    try:
        process = subprocess.run(
            [PYTHON, "-P", *arguments],
            capture_output=True,
            timeout=MAX_SECONDS,
            env=environment,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise _make_refusal(
            path, f"did not finish reading this file in {MAX_SECONDS:g} s"
        ) from None
    except (OSError, ValueError) as error:
        raise Missing(f"{path}: no process could be started to read this file ({error})") from None
    if process.returncode == EXIT_NO_LIBRARY:
        raise Missing(
            f"{path}: a file in an instrument's own format; the package SurfaceTopography can read "
            "many such formats: pip install 'patchfem[profiles]', or export the surface as text "
            "with the header `x [um],z [um]`"
        )
    if process.returncode == CPU_LIMIT_SIGNAL:
        raise _make_refusal(
            path, f"did not finish reading this file in {MAX_CPU_SECONDS:g} s of CPU time"
        )
    try:
        content = dict(np.load(io.BytesIO(process.stdout), allow_pickle=False))
    except UNPACK_ERRORS:
        raise _make_refusal(path, "failed to read this file") from None
    if "error" in content:
        raise _make_refusal(path, f"cannot read this file ({shorten_reason(content['error'])})")
    if "z" not in content or not all(values.size for values in content.values()):
        raise _make_refusal(path, "found no heights in this file")
    return content


def _make_refusal(path, reason: str) -> PatchfemError:
    return PatchfemError(f"{path}: SurfaceTopography {reason}; export the surface as text or X3P")
