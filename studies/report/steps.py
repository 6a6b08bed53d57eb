"""Raised step by step, what does the rig's recorder show, and would another factor of the gauge explain its readings?

DRAFT

Run: python studies/report/steps.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import drawing
from figure_27 import POINT
from modal_test import marched
from told import told

from patchfem.campaigns.rows.asked import Question
from patchfem.campaigns.rows.fit import RowsOptions, Search, fit_rows
from patchfem.export.drawing.pictures import BLUE, GREY, ORANGE
from patchfem.inputs.measured import read_table
from patchfem.scene.ranges import ranges
from patchfem.scene.scene import loads

HERE = Path(__file__).parent
QUESTION, ANSWER = told(__doc__)
REPRODUCED = ""
G, MIL = 9.80665, 25.4e-6
SCENE, TABLE = HERE.parent / "table_1" / "second_path.toml", HERE.parent / "rig" / "table1.csv"
LEVELS, EACH = {135.0: (4, 5, 6, 7), 143.0: (4, 5, 6, 7, 8)}, 60  # report, Table 1 [g]; cycles of each, assumed
FREE = ("friction.static=0.2..0.8", "structure.bonded.stiffness=0 N/m..1e7 N/m", "structure.mode.yaw.slide=0..0.3")
GAUGE = "measured.displacement_gain=0.3..3"
READING = ("structure.bonded.damping=0 N s/m", "measured.reading=fundamental",
           "measured.acceleration_gain=1.4142135623730951")
HOLD, STARTS, SEED = "frequency=135 Hz,150 Hz,155 Hz", 8, 3  # the recipe: fitted to 143 Hz, 135 Hz is predicted


class Step(NamedTuple):
    """The last cycles of one level: frequency [Hz]; level [g]; largest acceleration [g]; gauge [V], half peak to peak;
    both as read, None where nothing was; unstable: flagged U."""

    frequency: float
    level: float
    acceleration: float
    gauge: float
    read: tuple
    unstable: bool


def text() -> str:
    """The rig beside its second path, on one point of contact."""
    whole = SCENE.read_text("utf-8")
    return POINT + whole[whole.index("static ="):]


def raised(frequency: float):
    """Every sample of the series of levels at a frequency [Hz], the state carried over."""
    scene = text()
    scene = scene[:scene.index("[drive]")] + f"""[drive]
kind = "base"
waveform = "levels"
frequency = "{frequency} Hz"
levels = [{", ".join(f'"{level} g"' for level in LEVELS[frequency])}]
cycles = {EACH}
"""
    return marched(scene, steps=200, seconds=EACH * len(LEVELS[frequency]) / frequency)


def steps(frequency: float, seen) -> list:
    """[Step] of the last ten cycles of every level."""
    rows = {row.input / G: row for row in read_table(TABLE) if row.frequency == frequency and "R" not in row.flag}
    out = []
    for k, level in enumerate(LEVELS[frequency]):
        last = (seen.time * frequency > EACH * (k + 1) - 10) & (seen.time * frequency <= EACH * (k + 1))
        row = next(row for value, row in rows.items() if abs(value - level) < 1e-6)
        read = tuple(None if value is None else value / unit for value, unit in ((row.acceleration, G),
                                                                                (row.displacement, MIL)))
        out.append(Step(frequency, level, np.abs(seen.acceleration[last]).max() / G,
                        np.ptp(seen.output[last]) / 2 / MIL, read, "U" in row.flag))
    return out


def fitted(gauge: bool):
    """Spring and yaw fitted to 143 Hz, with or without a free factor of the gauge: `FittedRows`."""
    scene = loads(text(), SCENE, READING)
    wanted, wrong = ranges((*FREE, *((GAUGE,) if gauge else ())))
    assert not wrong
    return fit_rows(Question(scene, wanted, TABLE), RowsOptions((HOLD,), how=Search(STARTS, SEED, "bound")))


if __name__ == "__main__":
    import time as T
    t = T.process_time()
    for f in LEVELS:
        for one in steps(f, raised(f)):
            print(one)
    print(T.process_time() - t)
