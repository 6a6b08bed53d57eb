"""A fitted loop on paper: the rows as a table, measured and fitted as a picture, the answer as lines of text."""

import csv
from pathlib import Path

import numpy as np

from ..disk.whole import whole
from ..scales import axis_unit
from .drawing.pictures import BLUE, GREY, ORANGE, drawing, styled

LABEL = {"force": ("force", "N"), "friction_ratio": ("friction ratio", "1")}


def write_rows(path: Path, time, displacement, measured, model, held, quantity: str) -> None:
    """Write a CSV in SI that `fit` reads back.

    Its columns are time (where there is one), displacement and the measured reading, then fitted and held without a
    unit.
    """
    unit = "[N]" if quantity == "force" else "[1]"
    head = [*([] if time is None else ["time [s]"]), "displacement [m]", f"{quantity} {unit}", "fitted", "held"]
    columns = [*([] if time is None else [time]), displacement, measured, model]
    with whole(path) as partial, open(partial, "w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(head)
        for *values, out in zip(*(column.tolist() for column in columns), held.tolist()):
            rows.writerow([*(repr(value) for value in values), int(out)])


@styled
def draw(displacement, measured, model, held, quantity: str):
    """Draw measured and fitted reading against displacement, and what is left over along the rows, as SVG text.

    displacement: (k,) [m]; measured, model: (k,) [N] or [1] by `quantity`; held: (k,) bool, rows that were only
    predicted.
    """
    figure, (loop, rest) = drawing(2, 3.6)
    name, unit = LABEL[quantity]
    along, size = axis_unit(displacement, "m")
    up, scale = axis_unit(measured, "N") if unit == "N" else ("1", 1.0)
    for rows, colour, text in ((~held, GREY, "measured"), (held, ORANGE, "measured, held out")):
        if rows.any():
            loop.plot(displacement[rows] * size, measured[rows] * scale, ".", color=colour, ms=3.5, mew=0, label=text)
            number = np.arange(measured.size)
            rest.plot(number[rows], (model - measured)[rows] * scale, ".", color=colour, ms=3.5, mew=0)
    loop.plot(displacement * size, model * scale, color=BLUE, lw=1.0, label="fitted")
    loop.set(xlabel=f"slide [{along}]", ylabel=f"{name} [{up}]", title="Measured and fitted")
    rest.axhline(0, color="0.4", lw=0.8)
    rest.set(xlabel="row", ylabel=f"fitted - measured [{up}]", title="What is left over")
    loop.legend(loc="center", frameon=False)
    return figure


def lines_of(answer: dict) -> list:
    """The answer of a fit as lines of text: one per value with its interval, then what is left over.

    answer: the object of fit.json.
    """
    out = [f"{answer['outcome']}: {answer['rows']} rows of {answer['measured']}, {answer['evaluations']} evaluations"]
    offsets = {f"offset of the {name}": one for name, one in answer["offsets"].items()}
    for key, one in (answer["values"] | offsets).items():
        unit = "" if one["unit"] == "1" else f" {one['unit']}"
        if one["interval"] is None:
            bar = "not determined"
        else:
            bar = f"95 % in [{one['interval'][0]:.6g}, {one['interval'][1]:.6g}] by the " + \
                ("profile" if one["method"] == "profile" else "linearised problem")
        bound = f", at its {one['at_bound']} bound" if one["at_bound"] else ""
        out.append(f"  {key:<26} {one['value']:.6g}{unit}   {bar}{bound}")
    unit = "" if answer["unit"] == "1" else f" {answer['unit']}"
    share = answer["rms"] / answer["peak"]
    out.append(f"  rms of what is left over   {answer['rms']:.4g}{unit}, {share:.2g} of the peak")
    if answer["held"] is not None:
        out.append(f"  rms of the rows held out   {answer['held']['rms']:.4g}{unit} ({answer['held']['rows']} rows)")
    return out
