"""All campaigns: their sizes, the functions of their trials, the loop that runs them and the summary table."""

import gc
import shutil
import tempfile
import zlib
from collections.abc import Callable
from importlib import import_module
from itertools import count
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from .trial import Trial, capture, make_empty_folder, run_in_fork


class Campaign(NamedTuple):
    """Campaign of trials.

    size: number of trials; made: module and function of a trial; clock: seconds after which a trial
    is killed.
    """

    size: int
    made: str
    about: str
    clock: float = 600.0


CAMPAIGNS = {
    "grammar": Campaign(7000, "scenes.run_grammar_trial", "scenes with wrong keys and values"),
    "bytes": Campaign(3000, "scenes.run_bytes_trial", "scenes with wrong bytes"),
    "hostile": Campaign(240, "hostile.run_trial", "files made to harm"),
}
WARM = (  # Scenes that load the modules of most trials, so that a forked trial already has them.
    '[normal]\nload = "26 lbf"\n[friction]\nlaw = "tanh"\nstatic = 0.3\nreference_speed = "1 mm/s"\n[structure]\n'
    'moving_mass = "1 kg"\n[[structure.mode]]\nname = "m"\nfrequency = "143 Hz"\ndamping = 0.01\nslide = 1.0\n[drive]\n'
    'kind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 3\n[accuracy]\ntolerance = 1e-2\n',
    '[contact]\nlength = "12.7 mm"\nwidth = "12.7 mm"\nheight = "6.35 mm"\nload = "26 lbf"\nelement_size = "1 mm"\n'
    'substrate = "Ti-8Al-1Mo-1V"\n',
)


class CampaignResult(NamedTuple):
    """Result of a campaign; faults: (index, description)."""

    name: str
    tried: int
    faults: list
    seconds: float


def make_generator(name: str, seed: int, index: int) -> np.random.Generator:
    """Return the random generator of a trial, which depends only on its campaign, seed and index."""
    return np.random.default_rng([seed, index, zlib.crc32(name.encode())])


def run_campaigns(
    command: Callable, share: float, names: list, seed: int, only: int | None, say: Callable
) -> list:
    """Run campaigns and return a row for each.

    command: words -> exit code in this process; share: fraction of the trials of every campaign, at
    least one trial; names: of campaigns; only: the index of a single trial, None for all; say:
    called with each fault when it is found.
    """
    results = []
    with tempfile.TemporaryDirectory(prefix="torture") as folder:
        preload(command, Path(folder))
        for name in names:
            started = perf_counter()
            faults = []
            numbers = (
                [only] if only is not None else range(max(1, round(share * CAMPAIGNS[name].size)))
            )
            for index in numbers:
                text = run_trial(command, name, seed, index, Path(folder))
                if text:
                    faults.append((index, text))
                    say(
                        f"{name} {index}: {text}\n"
                        f"  again: python tests/support/torture --campaign {name} --seed {seed} --only {index}"
                    )
            results.append(CampaignResult(name, len(numbers), faults, perf_counter() - started))
    return results


def run_trial(command: Callable, name: str, seed: int, index: int, folder: Path) -> str:
    """Return the fault of a trial, empty if there is none.

    An apparent hang is repeated with the time that compilation may take; then the compiled code is
    cached, and the trial is repeated with the usual time.
    """
    campaign = CAMPAIGNS[name]
    module, function = campaign.made.split(".")
    work = getattr(import_module(f"{__package__}.{module}"), function)

    def attempt_trial(patience: float) -> str:
        """Run the trial with a factor on its time limits."""

        def make_trial(tell):
            """Return the trial with its random numbers and folder."""
            return Trial(
                make_generator(name, seed, index),
                make_empty_folder(folder / name),
                command,
                tell,
                patience,
            )

        return run_in_fork(work, make_trial, campaign.clock * patience)

    text = attempt_trial(1.0)
    if text.startswith("hang") and not attempt_trial(6.0).startswith("hang"):
        text = attempt_trial(1.0)
    return text


def preload(command: Callable, folder: Path) -> None:
    """Import in this process, before any fork, the modules that most trials would import."""
    import h5py  # noqa: F401

    for number, text in zip(count(), WARM):
        scene = folder / f"warm{number}.toml"
        scene.write_text(text, "utf-8")
        capture(command, ["run", str(scene), "-o", str(folder / f"warm{number}"), "--no-page"])
        shutil.rmtree(folder / f"warm{number}", ignore_errors=True)
    gc.collect()
    gc.freeze()


def format_table(rows: list) -> str:
    """Return the campaigns as lines: name, trials, failures, seconds."""
    width = max(len(row.name) for row in rows)
    lines = [f"{'campaign':<{width}}  {'tried':>6}  {'failed':>6}  {'seconds':>8}"]
    lines += [
        f"{row.name:<{width}}  {row.tried:>6}  {len(row.faults):>6}  {row.seconds:>8.1f}"
        for row in rows
    ]
    return "\n".join(lines)
