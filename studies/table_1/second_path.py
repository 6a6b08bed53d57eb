"""Does a second load path beside the contact explain Table 1, and does what is fitted at 143 Hz hold elsewhere?

In part. Four numbers fitted to the 13 readings at 143 Hz (0.062: accelerations 0.064, displacements 0.058) predict the
22 readings at 135, 150 and 155 Hz to 0.185, where "input times a constant" scores 0.235. That is won by the
displacements (0.279 against 0.497); the accelerations (0.156) are predicted worse than by the constant (0.111). The
score is the root mean square of ln(computed/measured). The four numbers are the friction, the stiffness and the damping
of the second path, and how far the friction lies off the axis; the factor of the accelerometer, 1.2375, is read off the
readings at 143 Hz and 4 g. A point in place of the patch, elastic over 0.243 um, does the same: 0.063, then 0.186.

Run: python studies/table_1/second_path.py [--starts N]
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from null_models import fit_null_model
from rungs import PREDICTED_ROWS, STUCK_READING, Rung
from study_run import Option, run_study

from patchfem.campaigns.fits.request import FitOptions, fit_measurement
from patchfem.campaigns.rows.cells import compute_rms_scores

FREE = (
    "friction.static=0.2..0.8",
    "structure.bonded.stiffness=1e6 N/m..1e7 N/m",
    "structure.bonded.damping=0 N s/m..5000 N s/m",
    "structure.mode.yaw.slide=0..0.3",
)


def fit_path(point: bool = False, starts: int = 8):
    """Return the numbers fitted to 143 Hz from random starts, as FittedKeys.

    `point` takes one elastic-plastic point in the place of the patch.
    """
    asked = Rung("second_path.toml", FREE, point=point).question(STUCK_READING)
    options = FitOptions(hold=(PREDICTED_ROWS,), starts=starts)
    return fit_measurement(asked.scene, asked.measured, asked.ranges, options)


def main(starts: int = 8) -> dict:
    """Print values and scores of the patch and of the point; return {name: {"fitted", "held_out", "values"}}."""
    out = {}
    print(f"{'':<8}{'':<12}{'acceleration':>14}{'displacement':>14}{'all':>8}")
    for name in ("patch", "point"):
        begin = time.process_time()
        found = fit_path(name == "point", starts)
        seconds = time.process_time() - begin
        cells = found.comparison.cells
        constant = fit_null_model(cells, "constant", ~found.held_out)[0]
        each = {
            "model": found.comparison.compute_scores(found),
            "constant": {
                "fitted": compute_rms_scores(cells, constant, ~found.held_out),
                "held_out": compute_rms_scores(cells, constant, found.held_out),
            },
        }
        for what, scored in each.items():
            for part in ("fitted", "held_out"):
                one = scored[part]
                print(
                    f"{name if what == 'model' else 'null':<8}{part.replace('_', ' '):<12}"
                    f"{one['acceleration']:>14.3f}{one['displacement']:>14.3f}{one['all']:>8.3f}"
                )
        print(
            "  "
            + ", ".join(
                f"{one.key} {value:.4g}" for one, value in zip(found.keys.ranges, found.fit.values)
            )
            + f"; {np.sum(found.fit.descent_rms < 1.01 * found.fit.rms)} of {starts} starts end here; {seconds:.0f} s"
        )
        out[name] = {**each["model"], "values": found.fit.values, "seconds": seconds}
    return out


if __name__ == "__main__":
    run_study(main, starts=Option(8, "random starts of the fit"))
