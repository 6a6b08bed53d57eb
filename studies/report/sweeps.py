"""Would frequency sweeps from 130 to 160 Hz, at levels below 5 g, have shown that slip begins at the same level at all
frequencies, as the report says?

Yes. In each of three models the acceleration becomes distorted at nearly the same level at all frequencies. The report
says the same of the rig and gives the level 4 g. The level is 4.39 to 4.40 g in the model of a rigid block, which
begins to slip at 4.14 g. From 136 Hz on, the level is 4.19 to 4.38 g in the model with grooves (slip from 4.20 g), and
4.24 to 4.37 g in the model with a second load path (slip from 3.95 g).

The level of slip is that of the friction over the mass, whatever the frequency, because the friction rides with the
base; what changes with frequency is how much the block moves then. Sweeps of 15 Hz/s (assumed), in stretches of ten
cycles; distorted is a third harmonic above 3 % of the first. What such a sweep would also have shown, and the report
says nothing of: below 135 Hz yaw, at 129 Hz, turns the block that its friction still holds, and a gauge off the contact
reads 0.67 mil at 3 g where it reads 0.19 at most above 140 Hz; there slip begins at 4.0 g. At 4.75 g a rigid block
shows less than the input, 0.92 to 0.96 of it, one in grooves 1.32 to 1.60 times: Table 1 has 1.2 to 1.7 times at 5 g.

Run: python studies/report/sweeps.py
"""

import sys
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from modal_test import march_samples
from study_run import run_study
from study_text import read_answer

import patchfem as pf

FOLDER = Path(__file__).parent
ANSWER = read_answer(__doc__)
VERDICT = ""
G = 9.80665  # [m/s^2] standard gravity
MIL = 25.4e-6  # [m] one thousandth of an inch
DISTORTION_LIMIT = (
    0.03  # third harmonic / first harmonic above which the acceleration counts as distorted
)
START_FREQUENCY = 130.0  # [Hz] at which the sweep begins
END_FREQUENCY = 160.0  # [Hz] at which the sweep ends
RATE = 15.0  # [Hz/s] of the sweep
LEVELS = (3.0, 3.8, 4.0, 4.1, 4.2, 4.3, 4.4, 4.5, 4.75)  # [g] levels below 5 g, report, 4.C
SHOWN_LEVELS = (3.0, 4.2, 4.4, 4.75)
MODELS = {
    "rigid block": "block.toml",
    "grooves": "grooved.toml",
    "second path": "../table_1/second_path.toml",
}


class Swept(NamedTuple):
    """Frequency sweep of a model at a level [g].

    Contains for every ten cycles (k,) the middle frequency [Hz], largest acceleration [g], half the
    peak-to-peak displacement [mil] and third over first harmonic of the acceleration.
    """

    model: str
    level: float
    frequency: np.ndarray
    acceleration: np.ndarray
    displacement: np.ndarray
    distortion: np.ndarray


def scene(model: str) -> str:
    """Return the scene text of a rig whose base is swept in frequency.

    Coulomb friction over grooves is computed from event to event, which is the default method of that scene.
    """
    text = (FOLDER / MODELS[model]).read_text("utf-8")
    text = "\n".join(
        line
        for line in text[: text.index("[drive]")].splitlines()
        if not line.startswith(("lifted_mass", "travel"))
    )
    return f"""{text}
[drive]
kind = "base"
waveform = "sweep"
from = "{START_FREQUENCY} Hz"
to = "{END_FREQUENCY} Hz"
rate = "{RATE} Hz/s"
acceleration = "4 g"
"""


def sweep_level(model: str, level: float) -> Swept:
    """Run the sweep at a level [g] and divide it into ranges of ten cycles."""
    text = scene(model).replace('"4 g"', f'"{level} g"')
    if model == "grooves":
        seen = pf.run(text).response
    else:
        seen = march_samples(text + '[accuracy]\nmethod = "march"\n', steps=200)
    turns = START_FREQUENCY * seen.time + RATE * seen.time**2 / 2

    # The harmonics of ten cycles need samples at equal steps of the phase.
    even = np.arange(0, turns[-1], 1 / 64)
    felt = np.interp(even, turns, seen.acceleration)
    felt = felt[: felt.size // 640 * 640].reshape(-1, 640)
    lines = np.abs(np.fft.rfft(felt, axis=1))

    # The largest values are those of the samples themselves, which contain the reversals.
    first = np.searchsorted(turns, 10.0 * np.arange(len(felt) + 1))
    ranges = [slice(low, high) for low, high in pairwise(first)]
    middle = (np.arange(len(felt)) + 0.5) * 10
    return Swept(
        model,
        level,
        np.sqrt(START_FREQUENCY**2 + 2 * RATE * middle),
        np.array([np.abs(seen.acceleration[cycles]).max() for cycles in ranges]) / G,
        np.array([np.ptp(seen.output[cycles]) for cycles in ranges]) / 2 / MIL,
        lines[:, 30] / lines[:, 10],
    )


def critical(sweeps: list) -> np.ndarray:
    """Return the levels [g] (k,) at which the waveform becomes distorted, at the frequencies of the sweeps.

    The sweeps of one model rise in level; between two of them the logarithm of the distortion is interpolated.
    """
    logs = np.log(np.maximum([sweep.distortion for sweep in sweeps], 1e-6) / DISTORTION_LIMIT)
    first = np.argmax(logs > 0, axis=0)
    k = np.arange(logs.shape[1])
    low = logs[first - 1, k]
    high = logs[first, k]
    levels = np.array([sweep.level for sweep in sweeps])
    return levels[first - 1] + (levels[first] - levels[first - 1]) * low / (low - high)


def picture(sweeps: list, path: Path) -> Path:
    """Plot acceleration over input and the distortion, a column for each model."""
    colours = dict(zip(SHOWN_LEVELS, ("black", GREY, BLUE, ORANGE)))
    with drawing(path, (10.4, 5.6), 2, 3, sharex=True, sharey="row") as (_, axes):
        for column, model in enumerate(MODELS):
            size, wave = axes[:, column]
            for one in sweeps:
                if one.model != model or one.level not in SHOWN_LEVELS:
                    continue
                size.plot(
                    one.frequency,
                    one.acceleration / one.level,
                    color=colours[one.level],
                    lw=1.2,
                    label=f"{one.level:g} g",
                )
                wave.semilogy(
                    one.frequency,
                    np.maximum(one.distortion, 1e-4),
                    color=colours[one.level],
                    lw=1.2,
                )
            wave.axhline(DISTORTION_LIMIT, color=GREY, lw=0.8, ls="--")
            size.set(title=model, ylim=(0.7, 1.7))
            wave.set(
                xlabel="frequency [Hz]", xlim=(START_FREQUENCY, END_FREQUENCY), ylim=(1e-4, 0.5)
            )
        axes[0, 0].set_ylabel("peak acceleration / input")
        axes[1, 0].set_ylabel("third / first harmonic")
        axes[0, 0].legend(loc="upper left", ncols=2, fontsize=9)
        axes[1, 0].text(131, 0.017, "above: seen as distorted", color=GREY, fontsize=9)
    return path


def main(path: Path | None = FOLDER / "sweeps.svg", models=tuple(MODELS)) -> list:
    """Print, draw and return the sweeps."""
    sweeps = [sweep_level(model, level) for model in models for level in LEVELS]
    for model in models:
        mine = [sweep for sweep in sweeps if sweep.model == model]
        level = critical(mine)
        still = mine[0]
        above = level[still.frequency > 136]
        low, high = (
            still.displacement[part].max()
            for part in (still.frequency < 135, still.frequency > 140)
        )
        print(
            f"{model:12} distorted from {level.min():.2f} to {level.max():.2f} g on, above 136 Hz {above.min():.2f} "
            f"to {above.max():.2f} g; before, at {still.level:g} g, the gauge sees {low:.2f} mil below 135 Hz, "
            f"{high:.2f} mil above 140 Hz"
        )
    if path is not None:
        picture(sweeps, path)
    print(ANSWER)
    return sweeps


if __name__ == "__main__":
    run_study(main)
