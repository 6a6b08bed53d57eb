"""Operators on disk: the same bits back, never for another piece, and damage is mended."""

import os
from dataclasses import replace

import numpy as np
import pytest
from limits import limited

from patchfem.elasticity import Layers, cache
from patchfem.mesh import PieceMesh

LAYERS = Layers((250e9, 0.24), (121e9, 0.32), "strain")
X, DEPTH = np.linspace(-1, 1, 7), np.linspace(0, 1, 4)
PARTS = {name: np.random.default_rng(k).uniform(size=(7, 7)) for k, name in enumerate("abc")}
SHAPES = dict.fromkeys(PARTS, (7, 7))


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("PATCHFEM_CACHE", str(tmp_path))
    return tmp_path / "patchfem" / "operators"


def test_exact_the_same_bits_come_back():
    key = cache.grid_key(X, DEPTH, 1, LAYERS)
    assert cache.load_arrays(key, SHAPES) is None
    cache.store_arrays(key, PARTS)
    for name, kept in cache.load_arrays(key, SHAPES).items():
        assert PARTS[name].tobytes() == kept.tobytes() and not kept.flags.writeable


def test_always_another_piece_has_another_key():
    keys = {
        cache.grid_key(X, DEPTH, 1, LAYERS),
        cache.grid_key(X * (1 + 1e-15), DEPTH, 1, LAYERS),
        cache.grid_key(X, DEPTH[:-1], 1, LAYERS),
        cache.grid_key(X, DEPTH, 2, LAYERS),
        cache.grid_key(X, DEPTH, 1, Layers((250e9, 0.25), (121e9, 0.32), "strain")),
        cache.grid_key(X, DEPTH, 1, Layers((250e9, 0.24), (121e9, 0.32), "stress")),
    }
    assert len(keys) == 6


def test_always_another_mesh_has_another_key():
    points = np.array([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], float)
    mesh = PieceMesh(
        points,
        np.array([[0, 1, 4], [0, 4, 3]]),
        np.array([[1, 2, 5, 4]]),
        np.array([True, False, False]),
        np.array([0, 1, 2]),
        np.array([3, 4, 5]),
    )
    other = [
        replace(mesh, points=points + 1e-15),
        replace(mesh, triangles=mesh.triangles[::-1]),
        replace(mesh, quads=np.roll(mesh.quads, 1)),
        replace(mesh, is_coating=~mesh.is_coating),
        replace(mesh, interface=np.array([0, 1])),
        replace(mesh, far=np.array([3, 5])),
    ]
    keys = {cache.mesh_key(one, LAYERS) for one in (mesh, *other)}
    keys |= {cache.mesh_key(mesh, Layers((250e9, 0.25), (121e9, 0.32), "strain"))}
    assert cache.mesh_key(replace(mesh), LAYERS) in keys and len(keys) == 8


def test_always_a_changed_source_text_has_another_key(tmp_path, monkeypatch):
    here = cache.Path(cache.__file__).parent
    for name in {*cache.GRID_SOURCE_FILES, *cache.MESH_SOURCE_FILES}:
        (tmp_path / name).write_bytes((here / name).read_bytes())
    monkeypatch.setattr(cache, "__file__", str(tmp_path / "cache.py"))
    keys = {cache.grid_key(X, DEPTH, 1, LAYERS)}
    for name in cache.GRID_SOURCE_FILES:
        (tmp_path / name).write_bytes(b"# changed")
        keys.add(cache.grid_key(X, DEPTH, 1, LAYERS))
    assert len(keys) == 1 + len(cache.GRID_SOURCE_FILES)


def test_refuses_damaged_and_foreign_files(place):
    key = cache.grid_key(X, DEPTH, 1, LAYERS)
    cache.store_arrays(key, PARTS)
    path = place / f"{key}.npz"
    assert cache.load_arrays(key, dict.fromkeys(PARTS, (8, 8))) is None
    content = path.read_bytes()
    for damaged in (b"", content[: len(content) // 2], b"x" * 100, content[:-300] + b"\0" * 300):
        path.write_bytes(damaged)
        assert cache.load_arrays(key, SHAPES) is None
    cache.store_arrays(key, PARTS | {"a": np.full((7, 7), np.nan)})
    assert cache.load_arrays(key, SHAPES) is None


def test_always_the_folder_stays_below_its_size(place, monkeypatch):
    one = 3 * 49 * 8
    monkeypatch.setattr(cache, "MAX_FOLDER_BYTES", 4 * one)
    for k in range(8):
        cache.store_arrays(f"{k:032d}", PARTS)
        os.utime(place / f"{k:032d}.npz", (k, k))
    left = sorted(path.name for path in place.iterdir())
    assert 1 <= len(left) <= 4 and left[-1] == f"{7:032d}.npz"


def test_exact_an_unwritable_folder_is_no_error(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("no folder", "utf-8")
    monkeypatch.setenv("PATCHFEM_CACHE", str(blocked))
    cache.store_arrays("k", PARTS)
    assert cache.load_arrays("k", SHAPES) is None


def test_always_a_folder_without_room_or_of_others_is_done_without(place):
    key = cache.grid_key(X, DEPTH, 1, LAYERS)
    with limited(500):
        cache.store_arrays(key, PARTS)
    # a cut file would stay for ever
    assert cache.load_arrays(key, SHAPES) is None and list(place.iterdir()) == []
    cache.store_arrays(key, PARTS)
    assert cache.load_arrays(key, SHAPES) is not None
    place.chmod(0o777)  # anybody could have put numbers there
    assert cache.load_arrays(key, SHAPES) is None
    cache.store_arrays(cache.grid_key(X, DEPTH, 2, LAYERS), PARTS)
    assert len(list(place.iterdir())) == 1
