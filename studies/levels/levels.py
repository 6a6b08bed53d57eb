"""The report's procedure, the level raised and lowered in steps at one frequency: where does slip begin, and where does
the motion jump?

The rig of studies/rig at 143 Hz, 3 to 5 g and back in steps of .25 g, 200 cycles each, state carried over; mu N/m =
4.00 g, measured onset 3.8 to 4.2 g. Onset by bisection (slip of a thousandth of a bond length): 4.002 g for a Coulomb
block, which is mu N/m, 4.018 g for an elastic-plastic one and 3.876 g for the tilted patch of it. Laws that slip from
the start have none: the Coulomb patch slips at its edge from .87 g, bonds are damaged at any level (.18 g). What a
gauge of .01 mil sees is another matter: slip from 4.17 to 4.23 g for all without bonds, the measured onset or just
above it; with bonds of 1 um from below 3 g, and .11 (point) and .09 mil (patch) of motion at 4 g, where .08 was read.

None of these jumps, and raised or lowered they give the same to 3e-3 mil. Nor does the stiffened rig at 143 Hz. At
147 Hz, right of its resonance, it does: raised it jumps between 6.25 and 6.375 g, lowered between 6 and 5.875 g, the
folds of its steady motions are at 6.263 and 5.920 g, and 39 mil lie between both ways.

Run: python studies/levels/levels.py
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import drawing
from level_rows import CASES, FLOOR, MIL, solve

from patchfem.export.drawing.pictures import BLUE, GREY, ORANGE

HERE = Path(__file__).parent
MEASURED = (3.8, 4.2)  # onset on the rig [g]


def picture(rows: list, path: Path = HERE / "levels.svg") -> Path:
    """Slip over the level, raised and lowered."""
    with drawing(path, (9.6, 5.4), 2, 4) as (figure, axes):
        axes = axes.ravel()
        for axis, r in zip(axes, rows):
            top = int(r.levels.argmax())
            slip = np.maximum(r.slip, 1e-9) / MIL
            axis.semilogy(r.levels[:top + 1], slip[:top + 1], "^-", color=BLUE, ms=3.5, lw=1, label="raised")
            axis.semilogy(r.levels[top:], slip[top:], "v-", color=ORANGE, ms=3.5, lw=1, label="lowered")
            if r.folds:
                for fold in r.folds:
                    axis.axvline(fold, color=GREY, lw=0.8, ls=":", label="fold")
            else:
                axis.axvspan(*MEASURED, color="#dddddd", zorder=0, label="onset on the rig")
                axis.axvline(r.limit, color=GREY, lw=0.8, ls="--", label="μ N/m")
            axis.axhline(FLOOR, color=GREY, lw=0.6, label="least that Table 1 reads")
            axis.set_title(r.case, fontsize=10)
        for axis in axes[4:]:
            axis.set_xlabel("level [g]")
        for axis in axes[::4]:
            axis.set_ylabel("slip [mil]")
        named = {text: line for axis in axes for line, text in zip(*axis.get_legend_handles_labels())}
        figure.legend(named.values(), named.keys(), loc="outside upper center", ncols=6, fontsize=9)
    return path


def main(cases=tuple(CASES), path: Path | None = HERE / "levels.svg", **how) -> list:
    """[Row], printed and drawn."""
    rows = [solve(case, **how) for case in cases]
    print(f"measured onset {MEASURED[0]} to {MEASURED[1]} g")
    for r in rows:
        onset = "never stuck" if r.onset is None else f"onset {r.onset[0]:.3f} g"
        print(f"{r.case:24} mu N/m {r.limit:.3f} g  {onset:16} seen from {r.seen:.2f} g  largest step up "
              f"x{r.jumps[0][2]:.3g} from {r.jumps[0][0]:g} to {r.jumps[0][1]:g} g, down /{r.jumps[1][2]:.3g} from "
              f"{r.jumps[1][0]:g} to {r.jumps[1][1]:g} g  "
              f"hysteresis {r.hysteresis / MIL:.2g} mil"
              + ("  folds " + ", ".join(f"{f:.3f}" for f in r.folds) if r.folds else ""))
    if path is not None:
        picture(rows, path)
    return rows


if __name__ == "__main__":
    main()
