"""Do two patches fore and aft, of which a rocking block loads one as it frees the other, bring Table 1 nearer?

No: with the numbers of "spring and yaw" the score at 143 Hz goes from 0.075 to 0.081 as the friction acts 0 to 20 mm
below the middle of the block, that of the other frequencies from 0.164 to 0.165. What one pad loses the other takes.

Two interfaces of a rig of masses carry loads that are given once and for all, so the pads are one long pair of pieces,
relieved between its ends, under a mode that rocks them. Balance knows no such mode: each reading is marched from rest,
and nothing is fitted anew. Assumed: the size of the block (a radius of gyration of 40 mm) and of the pads.

Run: python studies/table_1/pads.py
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from fitting import known, training
from rungs import HERE, PADS, ROOT2, TABLE

from patchfem.campaigns.rows.asked import Question
from patchfem.campaigns.rows.cells import cells_of, scores
from patchfem.campaigns.rows.computed import Computed
from patchfem.scene.ranges import ranges
from patchfem.scene.scene import load

RADIUS = 40e-3  # m, of gyration: assumed, as in pads.toml
FREE = "friction.static=0.1..1.5", "structure.bonded.stiffness=0 N/m..2e7 N/m", "structure.mode.yaw.slide=0..0.5"


def answer(values, height: float, conditions, *sets: str) -> np.ndarray:
    """(2, c) accelerations read [m s-2] and displacements [m] at conditions (c, 2), friction acting at a height [m]
    below the middle of the block."""
    scene = load(HERE / "pads.toml", [f"structure.mode.rock.slide={height / RADIUS!r}", *sets])
    computed = Computed(Question(scene, ranges(FREE)[0], TABLE).asked(conditions))
    computed.warm = False
    return np.array(computed(values, range(len(conditions))))


def main(heights=PADS) -> dict:
    """Print and return height [m] -> {"fitted", "others"}: scores at 143 Hz and elsewhere with the numbers that
    "spring and yaw" fitted to 143 Hz."""
    cells, out = cells_of(TABLE), {}
    seen, values = training(cells, "143"), known()["spring and yaw", ROOT2, "143", ""]["values"]
    for height in heights:
        begin = time.process_time()
        logs = cells.logs(*answer(values, height, cells.conditions))
        out[height] = {"fitted": scores(cells, logs, seen), "others": scores(cells, logs, ~seen)}
        three = {name: " / ".join(f"{one[kind]:.3f}" for kind in ("all", "acceleration", "displacement"))
                 for name, one in out[height].items()}
        print(f"{1e3 * height:.0f} mm: 143 Hz {three['fitted']}, elsewhere {three['others']}; "
              f"{time.process_time() - begin:.0f} s", flush=True)
    return out


if __name__ == "__main__":
    main()
