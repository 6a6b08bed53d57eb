"""Disk cache of the compliances of pieces and of the matrices of reference cells.

The name of a file is a hash of everything that its content depends on: mesh, materials and the
source text that computes it. So neither a changed piece nor a changed program reads an old
compliance. A file that cannot be read is computed again.
"""

import hashlib
import os
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np

from ..core import frozen_array
from ..disk import user_cache

# Total size [bytes] of the cache above which the least recently used files are deleted
MAX_FOLDER_BYTES = 512 * 2**20
# Source files that determine the matrices of the reference cells; their text is hashed into the
# cache key
REFERENCE_SOURCE_FILES = ("plane_form.py",)
# Source files that determine the compliance of every piece
COMMON_SOURCE_FILES = ("elasticity.py", "plane_form.py", "lapack.py")
# Source files that determine the compliance of a piece on a tensor grid
GRID_SOURCE_FILES = (*COMMON_SOURCE_FILES, "tensor_stiffness.py", "condense.py", "grid_fronts.py")
# Source files that determine the compliance of a piece on an unstructured mesh
MESH_SOURCE_FILES = (*COMMON_SOURCE_FILES, "dissect.py", "fronts.py", "substructure.py")


def cache_folder() -> Path:
    """Return the path of the disk cache, which need not exist.

    It is patchfem/operators below PATCHFEM_CACHE, XDG_CACHE_HOME or ~/.cache.
    """
    return user_cache.find_cache_base() / "patchfem" / "operators"


def grid_key(x, depth, coating_rows: int, layers) -> str:
    """Return the cache key of the compliance of a piece on a tensor grid.

    Parameters
    ----------
    x : (nx,) array_like [m]
    depth : (ny,) array_like [m]
    coating_rows : int
        Number of rows of cells in the coating.
    layers : Layers

    Returns
    -------
    str
        32 hexadecimal digits.
    """
    arrays = (np.asarray(x, np.float64), np.asarray(depth, np.float64))
    return _hash_piece(arrays, (int(coating_rows),), layers, GRID_SOURCE_FILES)


def mesh_key(mesh, layers) -> str:
    """Return the cache key of the compliance of a piece on an unstructured mesh (PieceMesh).

    The same mesh with its nodes numbered in another order has another key.
    """
    numbers = (mesh.triangles, mesh.quads, mesh.is_coating, mesh.interface, mesh.far)
    arrays = [np.asarray(mesh.points, np.float64)]
    arrays += [np.asarray(part, np.int64) for part in numbers]
    return _hash_piece(arrays, ("mesh",), layers, MESH_SOURCE_FILES)


def reference_cell_key() -> str:
    """Return the cache key of the reference-cell matrices of `plane_form.rectangle_terms`."""
    return _hash_source(hashlib.sha256(), REFERENCE_SOURCE_FILES)


def _hash_piece(arrays, words: tuple, layers, source: tuple) -> str:
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(repr(array.shape).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(repr((words, layers.coating, layers.substrate, layers.plane)).encode())
    return _hash_source(digest, source)


def _hash_source(digest, source: tuple) -> str:
    source_folder = Path(__file__).parent
    for name in source:
        digest.update((source_folder / name).read_bytes())
    return digest.hexdigest()[:32]


def load_arrays(key: str, shapes: dict) -> dict | None:
    """Read the arrays that the disk cache stores under a key.

    Parameters
    ----------
    key : str
    shapes : dict
        Shape of each array by its name.

    Returns
    -------
    dict or None
        Read-only arrays by their names. None if the folder cannot be trusted, or if an array is
        missing, has another shape or is not finite.
    """
    path = cache_folder() / f"{key}.npz"
    if not path.is_file() or user_cache.prepare_folder(path.parent):
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: frozen_array(file[name]) for name in shapes}
        os.utime(path)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile, EOFError):
        return None
    for name, shape in shapes.items():
        if arrays[name].shape != shape or not np.isfinite(arrays[name]).all():
            return None
    return arrays


def store_arrays(key: str, arrays: dict) -> None:
    """Store arrays under a key of the disk cache; do nothing if the cache is not writable."""
    if user_cache.prepare_folder(cache_folder()):
        return
    content = BytesIO()
    np.savez(content, **arrays)
    user_cache.write_cache_file(cache_folder() / f"{key}.npz", content.getvalue())
    _delete_oldest_files()


def _delete_oldest_files() -> None:
    """Delete the least recently used files until the disk cache is no larger than its limit.

    Temporary files that killed processes have left behind are deleted in the same way.
    """
    try:
        files = [path for path in cache_folder().iterdir() if path.is_file()]
        files.sort(key=lambda path: path.stat().st_mtime)
        total = sum(path.stat().st_size for path in files)
        for path in files[:-1]:
            if total <= MAX_FOLDER_BYTES:
                return
            total -= path.stat().st_size
            path.unlink(missing_ok=True)
    except OSError:
        return  # another process may have deleted a file in the meantime
