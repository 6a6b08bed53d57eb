"""Does a march forget a small push at the rate that the multipliers of its steady motion say?

Yes. Settled marches are pushed by 1e-5 of their amplitude along each coordinate and rate, and one map is fitted to what
becomes of the pushes from cycle to cycle. Largest multipliers of the steady motion and distance of the pushed one, at
1600 steps a cycle: elastic-plastic -.635 +- .167i (2.5e-3; 4e-2 at 400 steps, 7e-4 at 6400), bonds .464 (3e-3), a patch
of 41 elements on two modes .804 +- .562i, magnitude .981 (6e-5); of the three motions of the stiffened rig at 147.4 Hz
.900 (lower branch, 1.5e-3), 1.023 (6e-4: it leaves) and .949 (upper branch, 3e-3). Coulomb friction at 8 g, sliding:
.98133 and .94940, pushed runs from event to event agree to 5e-12. A march of Coulomb friction pushed by less than its
steps shows .98133 twice: it reverses at the end of the same step as before.

Run: python studies/steady/multipliers.py
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from pushes import exact, marched
from rig_texts import TEXTS

from patchfem.core import Start
from patchfem.dynamics.harmonic.balance import periodic_response
from patchfem.dynamics.harmonic.branch import branches
from patchfem.dynamics.harmonic.forces import Group
from patchfem.dynamics.harmonic.laws import Spring
from patchfem.model.model import build
from patchfem.runs import run as runner
from patchfem.runs.rig.interface import contact_model
from patchfem.runs.rig.numerics import choose
from patchfem.scene import scene

HERE = Path(__file__).parent
STIFFENED = (HERE / "stiffened.toml").read_text().replace(
    'waveform = "sweep"\nfrom = "138 Hz"\nto = "152 Hz"\nrate = "0.1 Hz/s"', 'frequency = "147.4 Hz"').replace(
    'duration = "140 s"', "cycles = 600")
CASES = {"Coulomb, 8 g": (TEXTS["Coulomb"], "8 g"), "elastic-plastic, 5 g": (TEXTS["elastic-plastic"], "5 g"),
         "bonds, 5 g": (TEXTS["bonds"], "5 g"), "patch of 41 elements, 5 g": (TEXTS["patch of 41 elements"], "5 g"),
         "stiffened, 147.4 Hz, 6 g": (STIFFENED, "6 g")}
STEPS, SETTLE, PUSH = 1600, 100, 1e-5


@dataclass(frozen=True, eq=False, slots=True)
class Row:
    """A case: multipliers of the steady motion, and those of pushed marches, the largest first."""

    case: str
    regime: str
    steady: np.ndarray
    march: np.ndarray

    @property
    def miss(self) -> float:
        """Distance of the largest ones, of a pair whichever is nearer."""
        return float(np.abs(self.steady - self.march[0]).min())


def rows_of(case: str, steps: int = STEPS, settle: int = SETTLE, cycles: int = 12) -> list:
    """Every steady motion of a case, and what pushed motions near it do."""
    text, level = CASES[case]
    sets = [f"drive.acceleration={level}"]
    model = build(scene.loads(text, sets=[*sets, "accuracy.method=march", f"accuracy.steps_per_cycle={steps}"]))
    if model.rig.cubic is not None:
        return _branches(model, case, steps, cycles)
    steady = runner.run(runner.plan(scene.loads(text, sets=[*sets, "accuracy.method=harmonic",
                                                                "accuracy.tolerance=1e-5"])), estimate=False)
    seen, size = steady.response, PUSH * steady.measures["relative_displacement_amplitude"].value
    start = Start(np.array(seen.modal[0]), np.array(seen.modal_rate[0]))
    found = exact(model, start, cycles, size) if model.friction.law == "coulomb" and model.patch is None else \
        marched(model, start, steps, settle, cycles, size)
    return [Row(case, steady.extra["regime"], steady.extra["multipliers"], found)]


def _branches(model, case: str, steps: int, cycles: int) -> list:
    """All motions at one frequency; from the one that is not stable the march is pushed before it has left it."""
    modes, drive = model.rig.modes, model.rig.drive
    group = Group(modes, [(0, contact_model(model, choose(model), None)), (modes.output, Spring(0.0, model.rig.cubic))])
    out = []
    for one in branches(modes, drive, group, 1e-5):
        seen = periodic_response(one, modes, drive, 200)
        start = Start(seen.modal[0].copy(), seen.modal_rate[0].copy())
        size = PUSH * one.amplitude(modes.output)
        out.append(Row(case, "stable" if one.stable else "unstable", one.multipliers,
                       marched(model, start, steps, 10, cycles, size)))
    return out


def main(cases=tuple(CASES), **how) -> list:
    """[Row], printed."""
    rows = [row for case in cases for row in rows_of(case, **how)]
    print(f"{'':26} {'steady motion':38} pushed march")
    for r in rows:
        words = ["  ".join(f"{v.real:+.5f}{v.imag:+.5f}i" for v in part[:2]) for part in (r.steady, r.march)]
        print(f"{r.case:26} {words[0]:38} {words[1]:38} {r.miss:.1e}  ({r.regime})")
    return rows


if __name__ == "__main__":
    main()
