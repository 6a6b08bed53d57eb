"""How far does a block creep under a dither? `drift.svg`: drift per cycle about half the limit against the dither (line:
closed form; dashed: growing bond length), and loop area against amplitude.

Run: python studies/drift/picture.py
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, drawing
from drift_laws import LENGTH, PERIOD, ladder, make_bonds
from force_control import OutOfReach, drift
from friction_forms import dither_drift, stretch_loop
from study_run import run_study

FOLDER = Path(__file__).parent
MARCHED_SWINGS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)


def growing(swing: float) -> float:
    """Return the drift per cycle [bond lengths] at a force of .5 +- swing with growing bonds.

    NaN if the block slides away.
    """
    engine = make_bonds(ladder.bonds(**ladder.GROWTH))
    try:
        return (
            drift(engine, (0.5 + swing, 0.5 - swing), (1.0, 1.0), 4, period=PERIOD, length=LENGTH)
            / LENGTH
        )
    except OutOfReach:
        return np.nan


def main(path: Path = FOLDER / "drift.svg", marched=MARCHED_SWINGS) -> Path:
    """Draw both panels, and return the path of the file."""
    swing = np.linspace(0, 0.4, 401)
    amplitude = 10.0 ** np.linspace(-1, 1.5, 200)
    with drawing(path, (9.6, 3.4), 1, 2) as (_, (left, right)):
        left.plot(
            swing, [dither_drift(0.5 - s, 0.5 + s) for s in swing], color=BLUE, label="closed form"
        )
        left.plot(
            marched,
            [growing(s) for s in marched],
            "o--",
            ms=3,
            lw=0.8,
            color=BLUE,
            label="marched, growing bonds",
        )
        right.semilogx(
            amplitude, stretch_loop(amplitude, 1.0)[0] / (4 * amplitude), color=BLUE, label="p = 1"
        )
        right.semilogx(
            amplitude,
            np.maximum(amplitude - 1, 0) / amplitude,
            ":",
            color=GREY,
            label="elastic-plastic",
        )
        left.set(
            xlabel="dither about half the limit [share of μs N]",
            ylabel="drift per cycle [bond lengths]",
            xlim=(0, 0.4),
            ylim=(-0.03, 1.6),
        )
        right.set(xlabel="amplitude [bond lengths]", ylabel="loop area / 4 A μs N", ylim=(0, 1))
        left.legend()
        right.legend()
    return path


if __name__ == "__main__":
    run_study(main)
