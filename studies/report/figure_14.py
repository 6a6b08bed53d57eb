"""What does Figure 14 of the report show?

The figure shows the weight of a bond across the path, W(eta/rho) of equation 2.15. The weight is a normal density:
0.3989 on the path, 0.2420 at a distance rho from the path and 0.0540 at 2 rho. 68.3 and 95.4 % of a bond's total weight
lie within the distances rho and 2 rho of the path.

Over eta its area is rho, which 2.16 divides out, so where the pressure does not change across the path rho drops out
of the law: only a pad narrower than a few rho or roughness finer than rho can show it. Of the print only the caption
could be read.

Run: python studies/report/figure_14.py
"""

import sys
from pathlib import Path

import numpy as np
from scipy.integrate import quad

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, drawing
from friction_forms import weight_across
from study_run import run_study
from study_text import read_answer

FOLDER = Path(__file__).parent
ANSWER = read_answer(__doc__)
VERDICT = (
    "in part: the equation and the shape of the curve are reproduced. The axes in the print could not "
    "be read"
)


def main(path: Path | None = FOLDER / "figure_14.svg") -> list:
    """Return (eta/rho, W, fraction of the area within) at 0, 1, 2 and infinity."""
    rows = [
        (y, float(weight_across(y)), quad(weight_across, -y, y)[0]) for y in (0.0, 1.0, 2.0, np.inf)
    ]
    for y, weight, share in rows:
        print(f"eta/rho = {y:3g}: W = {weight:.4f}, {100 * share:.2f} % within")
    if path is not None:
        y = np.linspace(-4, 4, 401)
        with drawing(path, (6.0, 3.4)) as (_, axis):
            axis.plot(y, weight_across(y), color=BLUE)
            axis.set(
                xlabel="η/ρ",
                ylabel="W",
                xlim=(-4, 4),
                ylim=(0, 0.45),
                title="Weight across the path (2.15)",
            )
    print(ANSWER)
    return rows


if __name__ == "__main__":
    run_study(main)
