"""Is the steady motion that is found directly the one that a march ends in?

Yes. The rig at 5 g, 40 frequencies from 115.5 to 174 Hz, marched for 600 cycles from rest at 1600 steps each.
Elastic-plastic elements (map of their yields): amplitudes differ by at most 9.1e-5, and by 5.1e-4 for a patch of 41
elements on two modes, loop areas by 9.5e-5 and 7.5e-4, which is what the march misses. Bonds (harmonic balance to
1e-4): 6.1e-5 and 6.3e-5. Coulomb friction (shooting on the
map of events, one mode and two, sliding or with two stops a cycle) against 2000 cycles from event to event: at most
1.1e-11 in amplitude, acceleration and loop.

The march of Coulomb friction finds stops and reversals inside its steps: amplitudes differ by at most 3.1e-7 (one mode)
and 2.5e-5 (two), accelerations by 2.2e-6 and 3.8e-4. At 129 Hz, where the slide reverses without a stop, its amplitude
is off by 8.3e-6, 3.1e-7 and 3.4e-9 at 400, 1600 and 6400 steps.

Run: python studies/steady/against_march.py [--full]      (5 of the frequencies; --full: all, and the picture)
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import steady_pictures
from rig_texts import TEXTS

from patchfem.runs import run as runner
from patchfem.scene import scene

FOLDER = Path(__file__).parent
NAMES = tuple(TEXTS)
FREQUENCIES = np.linspace(115.5, 174.0, 40)  # [Hz] in steps of 1.5, including 144
MEASURES = ("relative_displacement_amplitude", "absolute_acceleration_peak", "loop_area")
STEPS = 1600  # steps per cycle of the march
CYCLES = 600  # cycles of the march
LONG = 2000  # cycles of the exact run


@dataclass(frozen=True, eq=False, slots=True)
class Row:
    """Contact at one frequency [Hz].

    Contains MEASURES by the direct method, by time stepping and, for Coulomb's law, by a long exact
    run; regime and largest multiplier of the steady motion.
    """

    contact: str
    frequency: float
    steady: dict
    march: dict
    run: dict | None
    regime: str
    multiplier: float

    def miss(self, name: str, other: str = "march") -> float:
        """Return the relative difference of a measure from that of the steady motion; 0 if nothing slips in either."""
        found = getattr(self, other)[name]
        truth = self.steady[name]
        return abs(found - truth) / abs(truth) if truth else abs(found)


def solve(contact: str, frequency: float, **accuracy):
    """Return the Result of a contact at a frequency [Hz]; accuracy: keys of the table, and `cycles` of the drive."""
    sets = [f"drive.frequency={frequency} Hz", f"drive.cycles={accuracy.pop('cycles', CYCLES)}"]
    sets += [f"accuracy.{key}={value}" for key, value in accuracy.items()]
    return runner.run(runner.plan(scene.loads(TEXTS[contact], sets=sets)), estimate=False)


def _kept(found) -> dict:
    return {name: found.measures[name].value for name in MEASURES}


def row(
    contact: str, frequency: float, steps: int = STEPS, cycles: float = CYCLES, long: float = LONG
) -> Row:
    """Return the results of both methods at one frequency."""
    steady = solve(contact, frequency, method="harmonic", tolerance=1e-4)
    march = solve(contact, frequency, method="march", steps_per_cycle=steps, cycles=cycles)
    run = (
        _kept(solve(contact, frequency, method="exact", cycles=long))
        if contact.startswith("Coulomb")
        else None
    )
    worst = float(np.abs(steady.extra["multipliers"]).max(initial=0.0))
    return Row(contact, frequency, _kept(steady), _kept(march), run, steady.extra["regime"], worst)


def compute(names=NAMES, frequencies=FREQUENCIES, **how) -> dict:
    """Return {contact: [Row]}."""
    return {name: [row(name, float(f), **how) for f in frequencies] for name in names}


def main(
    names=NAMES, frequencies=FREQUENCIES, path: Path | None = FOLDER / "against_march.svg", **how
) -> dict:
    """Print, draw and return {contact: [Row]}."""
    table = compute(names, frequencies, **how)
    for name, rows in table.items():
        regimes = list(dict.fromkeys(r.regime for r in rows))
        print(
            f"{name}, 5 g at {len(rows)} frequencies from {rows[0].frequency:g} to {rows[-1].frequency:g} Hz: "
            f"{', '.join(regimes)}"
        )
        for other in ("march", "run") if rows[0].run is not None else ("march",):
            for measure in MEASURES:
                misses = np.array([r.miss(measure, other) for r in rows])
                k = int(misses.argmax())
                print(
                    f"  {other:6}{measure:34} median {np.median(misses):7.1e}  largest {misses[k]:7.1e} at "
                    f"{rows[k].frequency:g} Hz ({rows[k].regime}, multiplier {rows[k].multiplier:.3f}, "
                    f"{1e6 * rows[k].steady[MEASURES[0]]:.1f} um)"
                )
    if path is not None:
        steady_pictures.against_march(table, MEASURES[0], path)
    return table


if __name__ == "__main__":
    if "--full" in sys.argv[1:]:
        main()
    else:
        main(frequencies=FREQUENCIES[3::8], path=None)
