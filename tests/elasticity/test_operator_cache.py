"""Stored compliances: read back bit for bit, never used for another piece, and replaced if damaged."""

import os
from dataclasses import replace

import numpy as np
import pytest
from limits import limit_file_size

from patchfem.elasticity import Layers, cache
from patchfem.mesh import PieceMesh

LAYERS = Layers((250e9, 0.24), (121e9, 0.32), "strain")
X, DEPTH = np.linspace(-1, 1, 7), np.linspace(0, 1, 4)
ARRAYS = {name: np.random.default_rng(k).uniform(size=(7, 7)) for k, name in enumerate("abc")}
SHAPES = dict.fromkeys(ARRAYS, (7, 7))


@pytest.fixture(autouse=True)
def cache_folder(tmp_path, monkeypatch):
    """Folder of the cache in a temporary directory."""
    monkeypatch.setenv("PATCHFEM_CACHE", str(tmp_path))
    return tmp_path / "patchfem" / "operators"


def test_exact_cached_arrays_round_trip():
    """Stored arrays are read back bit for bit and are read-only."""
    key = cache.grid_key(X, DEPTH, 1, LAYERS)
    assert cache.load_arrays(key, SHAPES) is None
    cache.store_arrays(key, ARRAYS)
    for name, loaded in cache.load_arrays(key, SHAPES).items():
        assert ARRAYS[name].tobytes() == loaded.tobytes() and not loaded.flags.writeable


def test_always_different_grid_has_different_key():
    """A change of nodes, rows, coating, material or plane changes the key of a grid."""
    keys = {
        cache.grid_key(X, DEPTH, 1, LAYERS),
        cache.grid_key(X * (1 + 1e-15), DEPTH, 1, LAYERS),
        cache.grid_key(X, DEPTH[:-1], 1, LAYERS),
        cache.grid_key(X, DEPTH, 2, LAYERS),
        cache.grid_key(X, DEPTH, 1, Layers((250e9, 0.25), (121e9, 0.32), "strain")),
        cache.grid_key(X, DEPTH, 1, Layers((250e9, 0.24), (121e9, 0.32), "stress")),
    }
    assert len(keys) == 6


def test_always_different_mesh_has_different_key():
    """A change of points, elements, coating, interface, far face or material changes the key of a mesh."""
    points = np.array([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], float)
    mesh = PieceMesh(
        points,
        np.array([[0, 1, 4], [0, 4, 3]]),
        np.array([[1, 2, 5, 4]]),
        np.array([True, False, False]),
        np.array([0, 1, 2]),
        np.array([3, 4, 5]),
    )
    changed_meshes = [
        replace(mesh, points=points + 1e-15),
        replace(mesh, triangles=mesh.triangles[::-1]),
        replace(mesh, quads=np.roll(mesh.quads, 1)),
        replace(mesh, is_coating=~mesh.is_coating),
        replace(mesh, interface=np.array([0, 1])),
        replace(mesh, far=np.array([3, 5])),
    ]
    keys = {cache.mesh_key(changed, LAYERS) for changed in (mesh, *changed_meshes)}
    keys |= {cache.mesh_key(mesh, Layers((250e9, 0.25), (121e9, 0.32), "strain"))}
    assert cache.mesh_key(replace(mesh), LAYERS) in keys and len(keys) == 8


def test_always_changed_source_code_has_different_key(tmp_path, monkeypatch):
    """A change of the source code that computes a compliance changes its key."""
    source_folder = cache.Path(cache.__file__).parent
    for name in {*cache.GRID_SOURCE_FILES, *cache.MESH_SOURCE_FILES}:
        (tmp_path / name).write_bytes((source_folder / name).read_bytes())
    monkeypatch.setattr(cache, "__file__", str(tmp_path / "cache.py"))
    keys = {cache.grid_key(X, DEPTH, 1, LAYERS)}
    for name in cache.GRID_SOURCE_FILES:
        (tmp_path / name).write_bytes(b"# changed")
        keys.add(cache.grid_key(X, DEPTH, 1, LAYERS))
    assert len(keys) == 1 + len(cache.GRID_SOURCE_FILES)


def test_refuses_damaged_cache_files(cache_folder):
    """Damaged files and files with other shapes or NaN are not used."""
    key = cache.grid_key(X, DEPTH, 1, LAYERS)
    cache.store_arrays(key, ARRAYS)
    path = cache_folder / f"{key}.npz"
    assert cache.load_arrays(key, dict.fromkeys(ARRAYS, (8, 8))) is None
    content = path.read_bytes()
    for damaged in (b"", content[: len(content) // 2], b"x" * 100, content[:-300] + b"\0" * 300):
        path.write_bytes(damaged)
        assert cache.load_arrays(key, SHAPES) is None
    cache.store_arrays(key, ARRAYS | {"a": np.full((7, 7), np.nan)})
    assert cache.load_arrays(key, SHAPES) is None


def test_always_cache_folder_stays_below_size_limit(cache_folder, monkeypatch):
    """The oldest files are deleted so that the folder stays below its size limit."""
    file_bytes = 3 * 49 * 8
    monkeypatch.setattr(cache, "MAX_FOLDER_BYTES", 4 * file_bytes)
    for k in range(8):
        cache.store_arrays(f"{k:032d}", ARRAYS)
        os.utime(cache_folder / f"{k:032d}.npz", (k, k))
    remaining = sorted(path.name for path in cache_folder.iterdir())
    assert 1 <= len(remaining) <= 4 and remaining[-1] == f"{7:032d}.npz"


def test_exact_unwritable_cache_folder_is_ignored(tmp_path, monkeypatch):
    """A cache folder that cannot be written is ignored."""
    blocked = tmp_path / "file"
    blocked.write_text("no folder", "utf-8")
    monkeypatch.setenv("PATCHFEM_CACHE", str(blocked))
    cache.store_arrays("k", ARRAYS)
    assert cache.load_arrays("k", SHAPES) is None


def test_always_full_or_shared_cache_folder_is_ignored(cache_folder):
    """A folder without free space or writable by other users is not used."""
    key = cache.grid_key(X, DEPTH, 1, LAYERS)
    with limit_file_size(500):
        cache.store_arrays(key, ARRAYS)
    # a truncated file would never be replaced
    assert cache.load_arrays(key, SHAPES) is None and list(cache_folder.iterdir()) == []
    cache.store_arrays(key, ARRAYS)
    assert cache.load_arrays(key, SHAPES) is not None
    cache_folder.chmod(0o777)  # any user could have written files there
    assert cache.load_arrays(key, SHAPES) is None
    cache.store_arrays(cache.grid_key(X, DEPTH, 2, LAYERS), ARRAYS)
    assert len(list(cache_folder.iterdir())) == 1
