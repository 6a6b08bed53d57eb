"""Which law is accurate enough? `ladder.svg`: error of the force against the amplitude, for bonds of constant and of
growing length.

Run: python studies/friction_ladder/picture.py
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import ladder
from drawing import BLUE, GREY, ORANGE, drawing
from study_run import run_study

FOLDER = Path(__file__).parent
AMPLITUDES = 10.0 ** np.linspace(-1, 1.75, 12)
CURVES_WITHOUT_GROWTH = {
    "report p = 1": ("report", BLUE, "-"),
    "elastic-plastic": ("elastic-plastic", "#4f9bd9", "-"),
    "Coulomb": ("Coulomb", ORANGE, "-"),
    "tanh, best v_0": ("tanh, best speed", "#e0975f", "-"),
    "Bouc-Wen n = 2": ("Bouc-Wen, n = 2", GREY, "--"),
    "Iwan 20, virgin curve": ("Iwan 20, virgin curve", GREY, "-"),
    "Iwan 20, reversal curve": ("Iwan 20, reversals", GREY, ":"),
}
ON = {
    "report p = 1": ("report", BLUE, "-"),
    "LuGre": ("LuGre", "#4f9bd9", "--"),
    "constant eps_0, mu_s": ("constant, static", GREY, "--"),
    "constant eps_k, mu_k": ("constant, kinetic", GREY, "-"),
    "elastic-plastic, mu_k": ("elastic-plastic", "#4f9bd9", "-"),
    "Coulomb, mu_k": ("Coulomb", ORANGE, "-"),
}


def main(path: Path = FOLDER / "ladder.svg", amplitudes=AMPLITUDES) -> Path:
    """Draw the panels and return the path of the file."""
    rows = {
        (row.growth, row.rung, row.amplitude): row
        for a in amplitudes
        for row in ladder.constant(a, 200 if a < 1 else 400)
        + ladder.growing(a, 200 if a < 1 else 400)
    }
    with drawing(path, (6.4, 4.2), 1, 2, {"bbox_inches": "tight"}, sharey=True) as (_, panels):
        for axis, growth, curves, title in (
            (panels[0], "off", CURVES_WITHOUT_GROWTH, "constant bond length"),
            (panels[1], "on", ON, "growing bond length"),
        ):
            for rung, (text, colour, line) in curves.items():
                axis.loglog(
                    amplitudes,
                    [rows[growth, rung, a].top[1] for a in amplitudes],
                    line,
                    color=colour,
                    label=text,
                )
            axis.set(xlabel="amplitude [bond lengths]", title=title)
        panels[0].set(ylabel="rms force error [share of μs N]", ylim=(2e-4, 2))
        for axis in panels:
            axis.legend(
                fontsize=8.5,
                frameon=False,
                loc="upper center",
                bbox_to_anchor=(0.5, -0.18),
                ncols=2,
                columnspacing=0.8,
                handlelength=1.5,
            )
    return path


if __name__ == "__main__":
    run_study(main)
