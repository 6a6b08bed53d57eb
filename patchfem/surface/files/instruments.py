"""Files of other instruments through SurfaceTopography, which reads them in a process of its own (`topography`).

The library takes seconds to import: one process reads all files of this one, and ends with it or after a minute without
a file.
"""

import atexit
import io
import json
import os
import subprocess
import sys
import tempfile
import threading
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
from .units import ASIDE

PYTHON = sys.executable
SECONDS = 60.0  # of CPU time for a file, which another program beside does not use up
WAIT = 600.0  # seconds for a file after which its process cannot be at work
REMEDY = "pip install 'patchfem[profiles]'"
ELSE = "export the surface as text or X3P"
_kept = {}  # what the process is for -> the process; one at most
_lock = threading.Lock()


def instrument(raw: Raw, units: tuple | None) -> Profile | Areal:
    """The surface in a file of another instrument; Missing without SurfaceTopography, PatchfemError for a file that it
    cannot read, that is too large, or that names no units where none are given."""
    if not raw.data:
        found, arrays = _read(raw.path, raw.path)
    else:  # it was packed
        with tempfile.TemporaryDirectory() as folder:
            inner = Path(folder) / f"surface{raw.suffix if raw.suffix.isascii() and len(raw.suffix) < 12 else ''}"
            inner.write_bytes(raw.data)
            found, arrays = _read(raw.path, inner)
    if not found["unit"]:
        along, up = lengths(raw, units)
        arrays = [*(one * along for one in arrays[:-1]), arrays[-1] * up]
    stated = "the file states the units of heights and length" if found["unit"] else GIVEN
    notes = (f"{raw.path}: read as {shown(found['format'])} by SurfaceTopography {shown(found['version'])}",)
    notes += (f"{raw.path}: {ASIDE}",) if found["unit"] and units else ()
    if len(arrays) == 3:
        return areal(raw.path, *arrays, stated, notes)
    trace = checked(raw.path, *arrays, None, (1.0, 1.0), stated)
    return replace(trace, notes=(*notes, *trace.notes))


def _read(path, file) -> tuple:
    """(what was found, arrays) of a file, by the process that is kept for it."""
    with _lock:
        found, arrays, ended = _asked(path, file)
        if ended == 0:  # it had just ended, idle
            found, arrays, ended = _asked(path, file)
    if ended == 3:
        raise Missing(f"{path}: a file in an instrument's own format; the package SurfaceTopography can read many such "
                      f"formats: {REMEDY}, or export the surface as text with the header `x [um],z [um]`")
    if ended == "late":
        raise PatchfemError(f"{path}: SurfaceTopography did not finish reading this file in {WAIT:g} s; {ELSE}")
    if ended == -24:  # SIGXCPU
        raise PatchfemError(f"{path}: SurfaceTopography did not finish reading this file in {SECONDS:g} s of CPU time; "
                            f"{ELSE}")
    if ended is not None:
        raise PatchfemError(f"{path}: SurfaceTopography failed to read this file; {ELSE}")
    if "error" in found:
        raise PatchfemError(f"{path}: SurfaceTopography cannot read this file ({reason(found['error'])}); {ELSE}")
    if len(arrays) not in (2, 3) or not all(one.size for one in arrays):
        raise PatchfemError(f"{path}: SurfaceTopography found no heights in this file; {ELSE}")
    return found, arrays


def _asked(path, file) -> tuple:
    """(what was found, arrays, None), or ({}, [], how the process ended) where it did."""
    try:
        process = _process()
    except (OSError, ValueError) as error:
        raise Missing(f"{path}: no process could be started to read this file ({error})") from None
    late = threading.Timer(WAIT, process.kill)
    late.start()
    try:
        process.stdin.write(json.dumps(str(Path(file).absolute())).encode() + b"\n")
        process.stdin.flush()
        found = json.loads(process.stdout.readline())
        arrays = [np.load(io.BytesIO(process.stdout.read(size)), allow_pickle=False) for size in found.pop("sizes")]
        return found, arrays, None
    except (*BROKEN, AttributeError, TypeError):
        ended = _end()
        return {}, [], ended if late.is_alive() else "late"
    finally:
        late.cancel()


def _process() -> subprocess.Popen:
    """The process that reads, started anew where it ended or where this one was forked."""
    purpose = os.getpid(), PYTHON, SECONDS
    process = _kept.get(purpose)
    if process is None or process.poll() is not None:
        _end()
        words = [PYTHON, "-P", str(Path(__file__).with_name("topography.py")), str(POINTS), str(SECONDS)]
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # each thread would take address space
        _kept[purpose] = process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                                    stderr=subprocess.DEVNULL, env=environment)
    return process


@atexit.register
def _end() -> int | None:
    """End the process that is kept; its exit code, None where there is none of this process."""
    ended = None
    for (owner, *_), process in _kept.items():
        for pipe in (process.stdin, process.stdout):
            try:
                pipe.close()
            except OSError:  # what was written to it was never read
                pass
        if owner == os.getpid():
            try:
                ended = process.wait(1.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
                ended = -9
    _kept.clear()
    return ended
