"""Print the mistakes of 1000 randomly changed scenes as JSON, to compare two releases.

Run it with each release: `PYTHONPATH=tests/support python tests/support/faulty_scenes.py > now.json`. A row holds the text
of a scene and the lines of its mistakes; a scene without mistakes has none.
"""

import json
import sys

import numpy as np
from torture import grammar, scenes
from torture.toml import to_toml
from torture.trial import Trial

from patchfem import SceneError
from patchfem.scene import loads

SEED = 98790002
COUNT = 1000


def list_mistakes(text: str) -> list[str]:
    """Return the mistakes for which a scene is refused."""
    try:
        loads(text, "scene.toml")
    except SceneError as error:
        return error.mistakes
    return []


def draw_texts() -> list[str]:
    """Return the texts of scenes with one to three random changes."""
    trial = Trial(np.random.default_rng(SEED), None, None, None)
    texts = []
    for _ in range(COUNT):
        tables = grammar.draw_scene(trial)
        for _ in range(trial.draw(1, 1, 2, 3)):
            scenes.mutate_scene(trial, tables)
        texts.append(to_toml(tables).encode("utf-8", "replace").decode())
    return texts


if __name__ == "__main__":
    json.dump(
        [{"text": text, "mistakes": list_mistakes(text)} for text in draw_texts()], sys.stdout
    )
