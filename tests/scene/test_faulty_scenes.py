"""Randomly changed scenes: each mistake names its place, and a scene without mistakes reads its own values again."""

import re
from pathlib import Path

import numpy as np
from command_line import read_json
from torture import scenes
from torture.toml import to_toml
from torture.trial import Trial

from patchfem.scene import loads
from patchfem.scene.scene import SceneError

COUNT = 300
PLACE = re.compile(r"scene\.toml(:\d+: \S+: |: missing \[|: \S+: |: )")


def test_always_changed_scene_is_refused_with_places_or_read_again():
    """A mistake names file, line or missing table, and key; a resolved scene gives the same values."""
    trial = Trial(np.random.default_rng(81))
    n_refused = 0
    for _ in range(COUNT):
        tables = scenes.draw_scene(trial)
        for _ in range(trial.draw(0, 1, 1, 1, 2)):
            scenes.mutate_scene(trial, tables)
        text = to_toml(tables).encode("utf-8", "replace").decode()
        try:
            scene = loads(text, "scene.toml")
        except SceneError as error:
            n_refused += 1
            assert all(map(PLACE.match, error.mistakes)), error.mistakes
            continue
        again = loads(scene.resolved(), "scene.toml")
        assert again.resolved() == scene.resolved(), text
    assert COUNT / 2 < n_refused < COUNT


def list_places(text: str) -> set:
    """Return file, line and key of each mistake for which a scene is refused."""
    try:
        loads(text, "scene.toml")
    except SceneError as error:
        return {": ".join(mistake.split(": ")[:2]) for mistake in error.mistakes}
    return set()


def test_always_scene_refused_by_release_1_5_is_refused_at_the_same_places():
    """Each of 319 recorded scenes is refused with file, line and key of every mistake that 1.5 named.

    Since 1.11 the method of levels by harmonic balance is one of them, and since 1.15 the key `accuracy.harmonics`. Wear
    with method `harmonic`, and laws with effects that 1.5 refused, run since 3.0.
    """
    rows = read_json(Path(__file__).with_name("faulty_scenes.json"))
    assert len(rows) == 319
    for row in rows:
        assert list_places(row["text"]) == set(row["places"]), row["text"]
