"""What does Figure 13 of the report show?

The figure shows the weight of a bond along the path, phi(R/eps) of equation 2.14, for several orders p. The area under
each curve is 1, so p changes where along the path the force builds up, but not the friction in steady sliding. For p =
0 the weight falls from 1. For p = 1 and p = 2 the weight first rises from 0. The weight has its maximum after a path of
p bond lengths, at R = p eps: 0.3679 for p = 1 and 0.2707 for p = 2.

p = -0.5 is infinite at the start. Nine tenths of the force are gone after R/eps = 1.35, 2.30, 3.89 and 5.32. Of the
print only the caption could be read, neither axes nor the values of p: these p span the kinds of curve that 2.14 has.

Run: python studies/report/figure_13.py
"""

import sys
from pathlib import Path

import numpy as np
from scipy.special import gammaincinv

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from friction_forms import weight_along
from study_run import run_study
from study_text import read_answer

FOLDER = Path(__file__).parent
ANSWER = read_answer(__doc__)
VERDICT = (
    "in part: the equation and the shape of the curves are reproduced. The axes and the values of p in the "
    "print could not be read"
)
ORDERS = (-0.5, 0.0, 1.0, 2.0)
COLOURS = (GREY, ORANGE, BLUE, "#4f9bd9")


def main(path: Path | None = FOLDER / "figure_13.svg") -> list:
    """Return a dict for each p.

    It has the weight at 0, position and size of the maximum, and the R/eps beyond which a tenth of
    the area lies.
    """
    x = np.linspace(0, 8, 1601)
    rows = []
    for p in ORDERS:
        top = float(x[np.argmax(weight_along(x, p))])
        rows.append(
            {
                "order": p,
                "start": float(weight_along(0.0, p)),
                "top_at": top,
                "top": float(weight_along(top, p)),
                "nine_tenths": float(gammaincinv(p + 1, 0.9)),
            }
        )
        print(
            f"p = {p:4.1f}: phi(0) = {rows[-1]['start']:.4g}, largest {rows[-1]['top']:.4f} at R/eps = {top:.3f}, "
            f"nine tenths within R/eps = {rows[-1]['nine_tenths']:.3f}"
        )
    if path is not None:
        draw(path, x)
    print(ANSWER)
    return rows


def draw(path: Path, x) -> None:
    """Draw the figure as SVG."""
    with drawing(path, (6.0, 3.4)) as (_, axis):
        for p, colour in zip(ORDERS, COLOURS):
            shown = x[1:] if p < 0 else x
            axis.plot(shown, weight_along(shown, p), color=colour, label=f"p = {p:g}")
        axis.set(
            xlabel="R/ε",
            ylabel="φ",
            xlim=(0, 8),
            ylim=(0, 1.2),
            title="Weight along the path (2.14)",
        )
        axis.legend()


if __name__ == "__main__":
    run_study(main)
