"""What does the rig scene look like on one picture? `rig.svg`, the picture of the README, drawn from a run.

Run: python studies/rig/picture.py
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from study_run import run_study

from patchfem.core import G_N
from patchfem.inputs import read_table
from patchfem.runs import run as runner
from patchfem.scene import scene

FOLDER = Path(__file__).parent


def main(path: Path = FOLDER / "rig.svg") -> Path:
    """Draw pressure, shear stress, loop and measured accelerations of rig.toml at 143 Hz; return the path of the file."""
    found = runner.run(runner.plan(scene.load(FOLDER / "rig.toml")), estimate=False)
    x = found.patch.x * 1e3
    fields = found.fields
    window = found.window
    rows = [
        r
        for r in read_table(FOLDER / "table1.csv")
        if abs(r.frequency - 143) < 0.5 and r.acceleration
    ]
    with drawing(path, (9.6, 2.7), 1, 4) as (_, (a, b, c, d)):
        a.fill_between(x, fields["normal_stress"][0] / 1e6, color=BLUE, alpha=0.3, lw=0)
        a.set(title="σn(x) [MPa]", xlabel="x [mm]", xlim=(-6.4, -3.2))
        for k in range(1, len(fields["shear_stress"])):
            b.plot(x, fields["shear_stress"][k] / 1e6, color=ORANGE, lw=0.8, alpha=0.7)
        b.set(title="τ(x), one cycle [MPa]", xlabel="x [mm]", xlim=(-6.4, -3.2))
        c.plot(window.slide * 1e6, window.force, color=BLUE, lw=0.8)
        c.set(title="friction force [N]", xlabel="slide [um]")
        d.plot(
            [r.input / G_N for r in rows],
            [r.acceleration / G_N for r in rows],
            "o",
            color=GREY,
            ms=4,
            label="Table 1",
        )
        peak = found.measures["absolute_acceleration_peak"].value / G_N
        d.plot([5], [peak], "D", color=BLUE, ms=5, label="computed")
        d.set(title="acceleration [g], 143 Hz", xlabel="input [g]", ylim=(0, 14))
        d.legend(frameon=False, fontsize=8.5)
    assert np.isfinite(peak)
    return path


if __name__ == "__main__":
    run_study(main)
