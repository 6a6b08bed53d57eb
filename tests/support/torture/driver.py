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

from .trial import Trial, alone, captured, emptied


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
    "grammar": Campaign(7000, "scenes.by_grammar", "scenes with wrong keys and values"),
    "bytes": Campaign(3000, "scenes.by_bytes", "scenes with wrong bytes"),
    "words": Campaign(1000, "words.lines", "command lines with odd words"),
    "profiles": Campaign(1000, "tables.profiles", "traces of a surface"),
    "signals": Campaign(1000, "tables.signals", "recorded drives"),
    "paths": Campaign(1000, "tables.paths", "recorded slides"),
    "rows": Campaign(1000, "tables.rows", "measured rows"),
    "loops": Campaign(1000, "tables.loops", "friction loops"),
    "universal": Campaign(1000, "tables.universal", "universal files"),
    "energy": Campaign(1000, "physics.energy", "books of energy of laws and engines"),
    "hostile": Campaign(240, "hostile.files", "files made to harm, twelve kinds"),
    "memory": Campaign(50, "processes.memory", "limits of memory"),
    "determinism": Campaign(20, "processes.determinism", "runs again, more threads"),
}
WARM = (  # Scenes that load the modules of most trials, so that a forked trial already has them.
    '[normal]\nload = "26 lbf"\n[friction]\nlaw = "tanh"\nstatic = 0.3\nreference_speed = "1 mm/s"\n[structure]\n'
    'moving_mass = "1 kg"\n[[structure.mode]]\nname = "m"\nfrequency = "143 Hz"\ndamping = 0.01\nslide = 1.0\n[drive]\n'
    'kind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 3\n[accuracy]\ntolerance = 1e-2\n',
    '[contact]\nlength = "12.7 mm"\nwidth = "12.7 mm"\nheight = "6.35 mm"\nload = "26 lbf"\nelement_size = "1 mm"\n'
    'substrate = "Ti-8Al-1Mo-1V"\n',
)


class Row(NamedTuple):
    """Result of a campaign; faults: (index, description)."""

    name: str
    tried: int
    faults: list
    seconds: float


def random_numbers(name: str, seed: int, index: int) -> np.random.Generator:
    """Return the random generator of a trial, which depends only on its campaign, seed and index."""
    return np.random.default_rng([seed, index, zlib.crc32(name.encode())])


def torture(
    command: Callable, share: float, names: list, seed: int, only: int | None, say: Callable
) -> list:
    """Run campaigns and return a row for each.

    command: words -> exit code in this process; share: fraction of the trials of every campaign, at
    least one trial; names: of campaigns; only: the index of a single trial, None for all; say:
    called with each fault when it is found.
    """
    out = []
    with tempfile.TemporaryDirectory(prefix="torture") as place:
        warm(command, Path(place))
        for name in names:
            begin = perf_counter()
            faults = []
            numbers = (
                [only] if only is not None else range(max(1, round(share * CAMPAIGNS[name].size)))
            )
            for index in numbers:
                text = tried(command, name, seed, index, Path(place))
                if text:
                    faults.append((index, text))
                    say(
                        f"{name} {index}: {text}\n"
                        f"  again: python tests/support/torture --campaign {name} --seed {seed} --only {index}"
                    )
            out.append(Row(name, len(numbers), faults, perf_counter() - begin))
    return out


def tried(command: Callable, name: str, seed: int, index: int, place: Path) -> str:
    """Return the fault of a trial, empty if there is none.

    An apparent hang is repeated with the time that compilation may take; then the compiled code is
    cached, and the trial is repeated with the usual time.
    """
    campaign = CAMPAIGNS[name]
    module, function = campaign.made.split(".")
    work = getattr(import_module(f"{__package__}.{module}"), function)

    def attempt(patience: float) -> str:
        """Run the trial with a factor on its time limits."""

        def trial(tell):
            """Return the trial with its random numbers and folder."""
            return Trial(
                random_numbers(name, seed, index), emptied(place / name), command, tell, patience
            )

        return alone(work, trial, campaign.clock * patience)

    text = attempt(1.0)
    if text.startswith("hang") and not attempt(6.0).startswith("hang"):
        text = attempt(1.0)
    return text


def warm(command: Callable, place: Path) -> None:
    """Import in this process, before any fork, the modules that most trials would import."""
    import h5py  # noqa: F401

    for number, text in zip(count(), WARM):
        scene = place / f"warm{number}.toml"
        scene.write_text(text, "utf-8")
        captured(command, ["run", str(scene), "-o", str(place / f"warm{number}"), "--no-page"])
        shutil.rmtree(place / f"warm{number}", ignore_errors=True)
    gc.collect()
    gc.freeze()


def table(rows: list) -> str:
    """Return the campaigns as lines: name, trials, failures, seconds."""
    width = max(len(row.name) for row in rows)
    lines = [f"{'campaign':<{width}}  {'tried':>6}  {'failed':>6}  {'seconds':>8}"]
    lines += [
        f"{row.name:<{width}}  {row.tried:>6}  {len(row.faults):>6}  {row.seconds:>8.1f}"
        for row in rows
    ]
    return "\n".join(lines)
