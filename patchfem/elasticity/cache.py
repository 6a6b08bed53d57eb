"""Compliances of pieces and matrices of reference cells, kept on disk under a hash of what made them.

The key is a hash of the mesh, the layers and the source text that assembles and condenses. So neither a changed piece
nor a changed program ever meets an old compliance. Files are written whole and renamed; the folder is kept below a
size; a file that cannot be read is computed again.
"""

import hashlib
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np

from ..core import frozen_array
from ..disk import user_cache

MOST_BYTES = 512 * 2**20
PARTS = ("nn", "tt", "nt")


def folder() -> Path:
    """Folder of the kept compliances: patchfem/operators below PATCHFEM_CACHE, XDG_CACHE_HOME or ~/.cache."""
    return user_cache.cache_base() / "patchfem" / "operators"


GRID_SOURCE = (
    "elasticity.py",
    "plane_form.py",
    "tensor_stiffness.py",
    "condense.py",
    "grid_fronts.py",
)
REFERENCE_SOURCE = ("plane_form.py",)
MESH_SOURCE = ("elasticity.py", "plane_form.py", "dissect.py", "fronts.py", "substructure.py")


def key_of(x, depth, coating_rows: int, layers) -> str:
    """Content hash (32 hexadecimal digits) of one piece on a tensor grid.

    x: (nx,), depth: (ny,) [m]; coating_rows: rows of cells in the coating; layers: its Layers. The source texts that
    make the compliance take part.
    """
    return _hash(
        (np.asarray(x, np.float64), np.asarray(depth, np.float64)),
        (int(coating_rows),),
        layers,
        GRID_SOURCE,
    )


def key_of_mesh(mesh, layers) -> str:
    """Content hash of one piece of any mesh.

    mesh: mesh.anymesh.PieceMesh with points, cells and tags; layers: its Layers. Renumbered nodes make
    another key.
    """
    arrays = (
        np.asarray(mesh.points, np.float64),
        *(
            np.asarray(part, np.int64)
            for part in (mesh.triangles, mesh.quads, mesh.is_coating, mesh.interface, mesh.far)
        ),
    )
    return _hash(arrays, ("mesh",), layers, MESH_SOURCE)


def key_of_reference_cells() -> str:
    """Content hash of the matrices of `plane_form.rectangle_terms`: of the source text that computes them."""
    return _hash_of_source(hashlib.sha256(), REFERENCE_SOURCE)


def _hash(arrays, words: tuple, layers, source: tuple) -> str:
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(repr(array.shape).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(repr((words, layers.coating, layers.substrate, layers.plane)).encode())
    return _hash_of_source(digest, source)


def _hash_of_source(digest, source: tuple) -> str:
    here = Path(__file__).parent
    for name in source:
        digest.update((here / name).read_bytes())
    return digest.hexdigest()[:32]


def fetch(key: str, columns: int) -> tuple | None:
    """Return the compliances (nn, tt, nt) kept under `key`, or None if nothing usable is kept.

    Each is (columns, columns), read-only [m2/N].
    """
    return fetch_arrays(key, dict.fromkeys(PARTS, (columns, columns)))


def fetch_arrays(key: str, shapes: dict) -> tuple | None:
    """Return the finite, read-only arrays kept under `key`, or None; shapes: name -> shape of each array."""
    path = folder() / f"{key}.npz"
    if not path.is_file() or user_cache.refused(path.parent):
        return None
    try:
        with np.load(path, allow_pickle=False) as kept:
            arrays = tuple(frozen_array(kept[name]) for name in shapes)
        os.utime(path)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile, EOFError):
        return None
    for array, shape in zip(arrays, shapes.values(), strict=True):
        if array.shape != shape or not np.isfinite(array).all():
            return None
    return arrays


def keep(key: str, parts: tuple) -> None:
    """Keep the compliances (nn, tt, nt) [m2/N] under `key`; do nothing if the folder cannot be written."""
    keep_arrays(key, dict(zip(PARTS, parts, strict=True)))


def keep_arrays(key: str, arrays: dict) -> None:
    """Keep named arrays under `key`; do nothing if the folder cannot be written.

    The file is written whole and renamed. The files unused for longest are deleted beyond 512 MiB.
    """
    place, name = folder(), None
    if user_cache.refused(place):
        return
    try:
        handle, name = tempfile.mkstemp(dir=place, suffix=".partial")
        with os.fdopen(handle, "wb") as file:
            np.savez(file, **arrays)
        os.replace(name, place / f"{key}.npz")
        _trim(place)
    except OSError:
        if name is not None:
            Path(name).unlink(missing_ok=True)


def _trim(place: Path) -> None:
    """Delete the files unused for longest until the folder is below its size, and what killed writers left behind."""
    kept = sorted(
        (path for path in place.iterdir() if path.is_file()), key=lambda path: path.stat().st_mtime
    )
    total = sum(path.stat().st_size for path in kept)
    for path in kept[:-1]:
        if total <= MOST_BYTES:
            break
        total -= path.stat().st_size
        path.unlink(missing_ok=True)
