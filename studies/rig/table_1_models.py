"""Two models at the conditions of the report's Table 1: a rigid Coulomb block, and the patch of rig.toml."""

import sys
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from rig_texts import TEXTS

from patchfem.core import G_N
from patchfem.inputs.measured import Row
from patchfem.runs import run as runner
from patchfem.scene import scene

HERE = Path(__file__).parent
MIL = 25.4e-6


@dataclass(frozen=True, slots=True)
class Answer:
    """Computed steady response: acceleration [g], displacement [mil], their errors, and how the run ended."""

    acceleration: float
    displacement: float
    acceleration_error: float
    displacement_error: float
    outcome: str


def answer(found) -> Answer:
    """Answer of one run."""
    a, d = (found.measures[k] for k in ("absolute_acceleration_peak", "relative_displacement_amplitude"))
    return Answer(a.value / G_N, d.value / MIL, (a.error or 0) / G_N, (d.error or 0) / MIL, str(found.outcome))


def drive(row: Row, cycles: float) -> list:
    """The --set strings of a measured condition."""
    return [f"drive.frequency={row.frequency} Hz", f"drive.acceleration={row.input / G_N:.12g} g",
            f"drive.cycles={cycles}"]


def coulomb(row: Row, cycles: float) -> Answer:
    """The rigid block with set-valued friction, exact."""
    return answer(runner.run(runner.plan(scene.loads(TEXTS["Coulomb"], sets=drive(row, cycles)))))


def patch(row: Row, cycles: float) -> Answer:
    """rig.toml at the condition of `row`."""
    return answer(runner.run(runner.plan(scene.load(HERE / "rig.toml", drive(row, cycles)))))


def compute(rows: list, model, cycles: float) -> dict:
    """(frequency, input) -> Answer, each condition once."""
    out = {}
    for row in rows:
        key = (row.frequency, row.input)
        if key not in out:
            out[key] = model(row, cycles)
    return out
