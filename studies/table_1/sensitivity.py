"""What do the values that the report does not give change in the scores of the patch beside a spring and a damper?

Little: the score at 143 Hz stays between 0.060 and 0.066, that of the others between 0.181 and 0.189, over pieces of 10
to 15 mm by 4 to 9 mm, tilts of 0.01 to 0.3 mrad, yaw dampings of 0.001 to 0.01 and factors of 1.2 to 1.275.

That rung alone has pieces beside a second path; its numbers are taken over from the ladder before, whose headline it
was. The headline now, spring and yaw, is one point: of these values it knows the damping of its yaw mode alone.

One at a time each is put at the ends of what it may be, and the four numbers are fitted to 143 Hz again from where they
stood. Then all are drawn together with the four numbers kept, for Sobol's indices of the two scores.

Run: python studies/table_1/sensitivity.py [draws]      (8; the indices in README.md are of 32)
"""

import json
import sys
from pathlib import Path

import numpy as np
from scipy.stats import sobol_indices, uniform

sys.path.insert(0, str(Path(__file__).parent))
from fitting import training
from rungs import HERE, RUNGS, STUCK, TABLE

from patchfem.campaigns.rows.asked import Question
from patchfem.campaigns.rows.cells import cells_of, scores
from patchfem.campaigns.rows.computed import Computed
from patchfem.campaigns.rows.search import residual_of
from patchfem.core import PatchfemError
from patchfem.identify.least_squares import fit
from patchfem.scene.ranges import ranges

RUNG, READING = "second path, patch", STUCK
ASSUMED = {  # key -> the ends of what it may be
    "contact.length": ("10 mm", "15 mm"), "contact.width": ("10 mm", "15 mm"), "contact.height": ("4 mm", "9 mm"),
    "contact.tilt.angle": ("0.01 mrad", "0.3 mrad"), "structure.mode.yaw.damping": ("0.001", "0.01"),
    "measured.acceleration_gain": ("1.2", "1.275")}


def headline(scores_file: Path = HERE / "scores.json") -> np.ndarray:
    """The four numbers fitted to 143 Hz."""
    return next(np.array(row["values"]) for row in json.loads(scores_file.read_text("utf-8"))
                if (row["rung"], row["reading"], row["protocol"], row["placebo"]) == (RUNG, READING, "143", ""))


def one_at_a_time(values, assumed=ASSUMED) -> list:
    """Rows {"key", "value", "values", "fitted", "held_out"}: the scores of all readings after a new fit to 143 Hz from
    `values` (4,), the first row with nothing changed."""
    cells, out = cells_of(TABLE), []
    seen = training(cells, "143")
    for key, value in [("", ""), *((key, end) for key, ends in assumed.items() for end in ends)]:
        question = RUNGS[RUNG].question(READING, *([f"{key}={value}"] if key else []))
        computed = Computed(question.asked(cells.conditions))
        found = fit(residual_of(cells, computed, seen, "bound"), [one.low for one in question.wanted],
                    [one.high for one in question.wanted], start=values, starts=1, bars="")
        computed.forget()
        logs = cells.logs(*computed(found.values, range(len(cells.conditions))))
        out.append({"key": key, "value": value, "values": found.values.tolist(), "fitted": scores(cells, logs, seen),
                    "held_out": scores(cells, logs, ~seen)})
    return out


def indices(values, draws: int, assumed=ASSUMED) -> dict:
    """Sobol's indices of the scores (fitted, held out) to the assumed values, drawn evenly between their ends, the four
    numbers kept: {"first" (2, d), "total" (2, d), "spread" (2,)}, standard deviations of the two scores."""
    cells, kept = cells_of(TABLE), RUNGS[RUNG].question(READING)
    wanted = ranges([f"{key}={low}..{high}" for key, (low, high) in assumed.items()])[0]
    sets = [one.assigned(value) for one, value in zip(kept.wanted, values)]
    scene = RUNGS[RUNG].text(READING, *sets)
    computed = Computed(Question(scene, wanted, TABLE).asked(cells.conditions))
    seen, every = training(cells, "143"), range(len(cells.conditions))

    def both(draw) -> np.ndarray:
        out = np.empty((2, draw.shape[1]))
        for k, one in enumerate(draw.T):
            computed.forget()
            try:
                logs = cells.logs(*computed(one, every))
            except PatchfemError as error:
                raise ValueError(f"{dict(zip(assumed, one))}: {error}") from None
            out[:, k] = [scores(cells, logs, which)["all"] for which in (seen, ~seen)]
        return out

    drawn = []

    def kept_both(draw):
        drawn.append(both(draw))
        return drawn[-1]

    found = sobol_indices(func=kept_both, n=draws, rng=0,
                          dists=[uniform(one.low, one.high - one.low) for one in wanted])
    return {"first": found.first_order, "total": found.total_order, "spread": np.hstack(drawn).std(axis=1)}


def main(draws: int = 32) -> tuple:
    """Print both tables; returns (rows of one_at_a_time, indices)."""
    values = headline()
    rows, shares = one_at_a_time(values), indices(values, draws)
    for row in rows:
        print(f"{row['key'] + ' ' + row['value']:<40} fitted {row['fitted']['all']:.3f}  held out "
              f"{row['held_out']['all']:.3f} ({row['held_out']['acceleration']:.3f}, "
              f"{row['held_out']['displacement']:.3f})  " + " ".join(f"{one:.4g}" for one in row["values"]), flush=True)
    for k, name in enumerate(("fitted", "held out")):
        print(f"{name}: spread {shares['spread'][k]:.4f}; total " + ", ".join(
            f"{key} {share:.2f}" for key, share in zip(ASSUMED, shares["total"][k])))
    return rows, shares


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 8)
