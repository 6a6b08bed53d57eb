"""Which rung is near enough, and for how much? `ladder.svg`: error in force against amplitude, without and with
growth, and against the cost of a step at 3 bond lengths.

Run: python studies/friction_ladder/picture.py
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import costs
import ladder
from drawing import drawing

from patchfem.export.drawing.pictures import BLUE, GREY, ORANGE

HERE = Path(__file__).parent
AMPLITUDES = 10.0 ** np.linspace(-1, 1.75, 12)
OFF = {"report p = 1": ("report", BLUE, "-"), "elastic-plastic": ("elastic-plastic", "#4f9bd9", "-"),
       "Coulomb": ("Coulomb", ORANGE, "-"), "tanh, best v_0": ("tanh, best speed", "#e0975f", "-"),
       "Bouc-Wen n = 2": ("Bouc-Wen, n = 2", GREY, "--"), "Iwan 20, virgin curve": ("Iwan 20, virgin curve", GREY, "-"),
       "Iwan 20, reversal curve": ("Iwan 20, reversals", GREY, ":")}
ON = {"report p = 1": ("report", BLUE, "-"), "LuGre": ("LuGre", "#4f9bd9", "--"),
      "constant eps_0, mu_s": ("constant, static", GREY, "--"),
      "constant eps_k, mu_k": ("constant, kinetic", GREY, "-"),
      "elastic-plastic, mu_k": ("elastic-plastic", "#4f9bd9", "-"), "Coulomb, mu_k": ("Coulomb", ORANGE, "-")}
PRICE = {("off", "report p = 1"): ("report, constant", "report", (-34, -11)),
         ("off", "elastic-plastic"): ("elastic-plastic", "elastic-plastic", (-64, -2)),
         ("off", "Coulomb"): ("Coulomb", "Coulomb", (5, -2)), ("off", "tanh, best v_0"): ("tanh", "tanh", (6, -2)),
         ("off", "Iwan 20, virgin curve"): ("Iwan 20", "Iwan 20, virgin curve", (6, -2)),
         ("off", "Iwan 20, reversal curve"): ("Iwan 20", "Iwan 20, reversals", (-72, -8)),
         ("off", "Bouc-Wen n = 2"): ("Bouc-Wen n = 2, Runge-Kutta", "Bouc-Wen", (5, -7)),
         ("on", "LuGre"): ("LuGre", "LuGre", (6, -6)),
         ("on", "constant eps_k, mu_k"): ("constant length (Dahl)", "constant, kinetic", (6, -2)),
         ("on", "report p = 1"): ("report, growing", "report, growing", (-44, 6))}


def main(path: Path = HERE / "ladder.svg", amplitudes=AMPLITUDES, times=None) -> Path:
    """Draw the panels; times: seconds per step of costs.compiled(), measured anew by default; the file written."""
    times = costs.compiled() if times is None else times
    rows = {(row.growth, row.rung, row.amplitude): row for a in (*amplitudes, 3.0)
            for row in ladder.constant(a, 200 if a < 1 else 400) + ladder.growing(a, 200 if a < 1 else 400)}
    with drawing(path, (9.6, 4.2), 1, 3, {"bbox_inches": "tight"}, sharey=True) as (_, panels):
        for axis, growth, curves, title in ((panels[0], "off", OFF, "constant bond length"),
                                            (panels[1], "on", ON, "growing bond length")):
            for rung, (text, colour, line) in curves.items():
                axis.loglog(amplitudes, [rows[growth, rung, a].top[1] for a in amplitudes], line, color=colour,
                            label=text)
            axis.set(xlabel="amplitude [bond lengths]", title=title)
        for (growth, rung), (name, text, place) in PRICE.items():
            error = rows[growth, rung, 3.0].top[1]
            panels[2].loglog(1e9 * times[name], error, "o" if growth == "off" else "D", ms=5,
                             color=BLUE if growth == "off" else ORANGE)
            panels[2].annotate(text, (1e9 * times[name], error), place, textcoords="offset points", fontsize=8)
        panels[2].set(xlabel="cost of a step [ns]", title="constant (●), growing (◆), A = 3", xlim=(0.05, 2e5))
        panels[0].set(ylabel="rms force error [share of μs N]", ylim=(2e-4, 2))
        for axis in panels[:2]:
            axis.legend(fontsize=8.5, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=2,
                        columnspacing=0.8, handlelength=1.5)
    return path


if __name__ == "__main__":
    main()
