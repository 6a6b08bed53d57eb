"""Operators on disk: the same bits back, never for another piece, and damage is mended."""

import os

import numpy as np
import pytest

from patchfem.contact import cache
from patchfem.contact.elasticity import Layers

LAYERS = Layers((250e9, 0.24), (121e9, 0.32), "strain")
X, DEPTH = np.linspace(-1, 1, 7), np.linspace(0, 1, 4)
PARTS = tuple(np.random.default_rng(k).uniform(size=(7, 7)) for k in range(3))


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("PATCHFEM_CACHE", str(tmp_path))
    return tmp_path / "patchfem" / "operators"


def test_exact_the_same_bits_come_back():
    key = cache.key_of(X, DEPTH, 1, LAYERS)
    assert cache.fetch(key, 7) is None
    cache.keep(key, PARTS)
    for mine, kept in zip(PARTS, cache.fetch(key, 7)):
        assert mine.tobytes() == kept.tobytes() and not kept.flags.writeable


def test_always_another_piece_has_another_key():
    keys = {cache.key_of(X, DEPTH, 1, LAYERS), cache.key_of(X * (1 + 1e-15), DEPTH, 1, LAYERS),
            cache.key_of(X, DEPTH[:-1], 1, LAYERS), cache.key_of(X, DEPTH, 2, LAYERS),
            cache.key_of(X, DEPTH, 1, Layers((250e9, 0.25), (121e9, 0.32), "strain")),
            cache.key_of(X, DEPTH, 1, Layers((250e9, 0.24), (121e9, 0.32), "stress"))}
    assert len(keys) == 6


def test_refuses_damaged_and_foreign_files(place):
    key = cache.key_of(X, DEPTH, 1, LAYERS)
    cache.keep(key, PARTS)
    path = place / f"{key}.npz"
    assert cache.fetch(key, 8) is None
    content = path.read_bytes()
    for damaged in (b"", content[:len(content) // 2], b"x" * 100, content[:-300] + b"\0" * 300):
        path.write_bytes(damaged)
        assert cache.fetch(key, 7) is None
    cache.keep(key, (np.full((7, 7), np.nan), *PARTS[1:]))
    assert cache.fetch(key, 7) is None


def test_always_the_folder_stays_below_its_size(place, monkeypatch):
    one = 3 * 49 * 8
    monkeypatch.setattr(cache, "MOST_BYTES", 4 * one)
    for k in range(8):
        cache.keep(f"{k:032d}", PARTS)
        os.utime(place / f"{k:032d}.npz", (k, k))
    left = sorted(path.name for path in place.iterdir())
    assert 1 <= len(left) <= 4 and left[-1] == f"{7:032d}.npz"


def test_exact_an_unwritable_folder_is_no_error(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("no folder", "utf-8")
    monkeypatch.setenv("PATCHFEM_CACHE", str(blocked))
    cache.keep("k", PARTS)
    assert cache.fetch("k", 7) is None
