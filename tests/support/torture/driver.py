"""All campaigns: their sizes, the functions of their trials, and the function that runs a trial."""

import os
import shutil
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from . import hostile, scenes
from .trial import Trial


class Campaign(NamedTuple):
    """Campaign of trials: their number, and the function of a trial."""

    size: int
    work: object


CAMPAIGNS = {
    "grammar": Campaign(7000, scenes.run_grammar_trial),  # scenes with wrong keys and values
    "bytes": Campaign(3000, scenes.run_bytes_trial),  # scenes with wrong bytes
    "hostile": Campaign(240, hostile.run_trial),  # files made to harm
}


def make_generator(name: str, seed: int, index: int) -> np.random.Generator:
    """Return the random generator of a trial, which depends only on its campaign, seed and index."""
    return np.random.default_rng([seed, index, zlib.crc32(name.encode())])


def run_trial(name: str, seed: int, index: int, folder: Path) -> None:
    """Run a trial in an empty folder; TrialFailure or another exception is a fault of the program."""
    place = folder / name
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    here = Path.cwd()
    os.chdir(place)
    try:
        CAMPAIGNS[name].work(Trial(make_generator(name, seed, index), place))
    finally:
        os.chdir(here)
