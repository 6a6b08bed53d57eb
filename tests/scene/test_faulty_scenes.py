"""Randomly changed scenes: each mistake names its place, and a scene without mistakes reads its own values again."""

import re

from faulty_scenes import make_faulty_scenes

from patchfem.scene import loads
from patchfem.scene.scene import SceneError

COUNT = 300


def test_always_changed_scene_is_refused_with_places_or_read_again():
    """A mistake names file, line or missing table, and key; a resolved scene gives the same values."""
    n_refused = 0
    for text in make_faulty_scenes(COUNT):
        try:
            scene = loads(text, "scene.toml")
        except SceneError as error:
            n_refused += 1
            assert all(
                re.match(r"scene\.toml(:\d+: \S+: |: missing \[|: \S+: )", one)
                for one in error.mistakes
            ), error.mistakes
            continue
        again = loads(scene.resolved(), "scene.toml")
        assert again.resolved() == scene.resolved(), text
    assert COUNT / 2 < n_refused < COUNT
