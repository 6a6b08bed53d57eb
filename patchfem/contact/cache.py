"""Condensed interface operators kept on disk, found again by the content that made them.

The key is a hash of columns, rows, layers and of the source text that assembles and condenses, so neither a changed
piece nor a changed program ever meets an old operator. Files are written whole and renamed; the folder is kept below a
size; a file that cannot be read is made again.
"""

import hashlib
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np

from ..core import frozen_array

MOST_BYTES = 512 * 2**20
PARTS = ("nn", "tt", "nt")


def folder() -> Path:
    """Where operators are kept: below PATCHFEM_CACHE, XDG_CACHE_HOME or ~/.cache."""
    base = os.environ.get("PATCHFEM_CACHE") or os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "patchfem" / "operators"


def key_of(x, depth, coating_rows: int, layers) -> str:
    """Content hash of one piece: x (nx,), depth (ny,) [m], rows of coating, its Layers."""
    digest = hashlib.sha256()
    for array in (x, depth):
        digest.update(np.ascontiguousarray(array, np.float64).tobytes())
    digest.update(repr((int(coating_rows), layers.coating, layers.substrate, layers.plane)).encode())
    here = Path(__file__).parent
    for name in ("elasticity.py", "condense.py"):
        digest.update((here / name).read_bytes())
    return digest.hexdigest()[:32]


def fetch(key: str, columns: int) -> tuple | None:
    """(nn, tt, nt), each (columns, columns) read-only [m2/N], or None where nothing usable is kept."""
    path = folder() / f"{key}.npz"
    try:
        with np.load(path, allow_pickle=False) as kept:
            parts = tuple(frozen_array(kept[name]) for name in PARTS)
        os.utime(path)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile, EOFError):
        return None
    good = all(part.shape == (columns, columns) and np.isfinite(part).all() for part in parts)
    return parts if good else None


def keep(key: str, parts: tuple) -> None:
    """Keep (nn, tt, nt) under `key`; silently does nothing where the folder cannot be written."""
    place = folder()
    try:
        place.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=place, suffix=".partial")
        with os.fdopen(handle, "wb") as file:
            np.savez(file, **dict(zip(PARTS, parts)))
        os.replace(name, place / f"{key}.npz")
        _trim(place)
    except OSError:
        return


def _trim(place: Path) -> None:
    """Delete what was used longest ago until the folder is below its size, and leftovers of killed writers."""
    kept = sorted((path for path in place.iterdir() if path.is_file()), key=lambda path: path.stat().st_mtime)
    total = sum(path.stat().st_size for path in kept)
    for path in kept[:-1]:
        if total <= MOST_BYTES:
            break
        total -= path.stat().st_size
        path.unlink(missing_ok=True)
