"""Does a march jump where the curve of steady motions folds?

Yes, and the slower the nearer. The axial mode of the rig at 6 g, its joint elastic-plastic (limit 4 g), on a flexure
that stiffens by 2e10 N/m3: the upper branch ends at 147.678 Hz, the lower at 146.451 Hz, between them are three
motions (balance to 1e-4; to 1e-3 the folds are up to 11 mHz off). Marches whose frequency sweeps up jump down at
148.03, 147.84 and 147.75 Hz for 0.4, 0.1 and 0.025 Hz/s, those that sweep down jump up at 146.03, 146.28 and 146.38 Hz:
always past the fold, late by a delay that goes as the rate to the power 2/3. Drawn back to no rate by it they jump at
147.685 and 146.444 Hz, 7 mHz from the folds. Before the jump the slowest follow their branches within 3e-4 (upper) and
6e-3 (lower). They start just outside the folds, at 146.2 and 148.0 Hz, the others at 145 and 149 Hz.

Run: python studies/steady/fold.py
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import steady_pictures
from fold_sweeps import HIGH_END, LOW_END, at_rest, curve, sweep
from study_run import run_study

FOLDER = Path(__file__).parent
RATES = (0.4, 0.1, 0.025)  # [Hz/s] sweep rates


def main(rates=RATES, path: Path | None = FOLDER / "fold.svg", **how) -> tuple:
    """Print and draw the curve and the sweeps, and return both."""
    steady = curve()
    print(
        f"folds at {steady.folds[0]:.4f} Hz (upper branch ends) and {steady.folds[1]:.4f} Hz (lower branch ends); "
        f"{len(steady.frequency)} points, amplitude up to {1e3 * steady.amplitude.max():.3f} mm"
    )
    sweeps = [sweep(steady, up, rate, **how) for rate in rates for up in (True, False)]
    for s in sweeps:
        fold = steady.folds[0 if s.up else 1]
        print(
            f"  {'up  ' if s.up else 'down'} {s.rate:6g} Hz/s jumps at {s.jump:.3f} Hz, {s.jump - fold:+.3f} Hz from "
            f"the fold; follows its branch within {s.miss:.1e}"
        )
    for up in (True, False):
        mine = [s for s in sweeps if s.up == up]
        if len(mine) > 1:
            print(f"  {'up  ' if up else 'down'} at no rate {at_rest(mine):.4f} Hz")
    if path is not None:
        steady_pictures.fold(steady, sweeps, path, (LOW_END, HIGH_END))
    return steady, sweeps


if __name__ == "__main__":
    run_study(main)
