"""Picture of a patch as it wears: pressure and worn depth along it, and its measures over the cycles."""

import numpy as np

from ...scales import axis_unit
from .pictures import BLUE, GREY, ORANGE, drawing, styled

SHOWN = 6  # profiles along the patch
MEASURES = {"pressure_peak": ("peak pressure", BLUE, "-"), "contact_fraction": ("contact fraction", ORANGE, "-"),
            "normal_stiffness": ("normal stiffness", "#3f7d4e", "--"), "loop_area": ("loop area", "#7a4f9a", "--"),
            "relative_displacement_amplitude": ("amplitude", "#8c6a00", ":")}


@styled
def wear(x, cycles, pressure, depth, history: dict):
    """Draw pressure and worn depth over x at some of the cycles, and how measures change from their first value.

    x (m,) [m]; cycles (k,) of the profiles, pressure (k, m) [Pa] and depth (k, m) [m] at them; history: name -> (j,)
    with `cycle`.
    """
    figure, axes = drawing(3, 3.4)
    along, mm = axis_unit(x, "m")
    pick = np.unique(np.linspace(0, len(cycles) - 1, SHOWN).round().astype(int))
    for place, (values, unit, title) in enumerate(((pressure, "Pa", "Pressure"), (depth, "m", "Worn depth"))):
        name, scale = axis_unit(values, unit)
        for number, k in enumerate(pick):
            share = number / max(len(pick) - 1, 1)
            colour = GREY if number == 0 else (0.75 - 0.63 * share, 0.85 - 0.48 * share, 0.95 - 0.35 * share)
            label = "new" if cycles[k] == 0 else f"{cycles[k]:,.0f}".replace(",", "\u202f")
            axes[place].plot(x * mm, values[k] * scale, color=colour, lw=1.2, label=label)
        axes[place].set(xlabel=f"x [{along}]", ylabel=f"[{name}]", title=title)
    top = float(np.max(pressure[-1])) * axis_unit(pressure, "Pa")[1]
    axes[0].set_ylim(0, min(2.5 * top, axes[0].get_ylim()[1]))
    axes[1].legend(title="cycles", fontsize=7, title_fontsize=7)
    for measure, (text, colour, line) in MEASURES.items():
        values = history.get(measure)
        if values is not None and values[0]:
            axes[2].plot(history["cycle"], values / values[0], line, color=colour, label=text)
    axes[2].locator_params(axis="x", nbins=4)
    axes[2].set(xlabel="cycles", ylabel="over its first value", title="Over the cycles")
    axes[2].axhline(1.0, color=GREY, lw=0.6)
    axes[2].legend(fontsize=7)
    return figure
