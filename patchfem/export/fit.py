"""A fitted loop on paper: the rows as a table, measured and fitted as a picture, the answer as lines of text."""

from pathlib import Path

import numpy as np

from ..disk import whole
from ..scales import SPOKEN, axis_unit, fitting, plain, rounded, short
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
    whole.write_rows(path, [head, *([*map(repr, values), int(out)] for *values, out in
                                    zip(*(column.tolist() for column in columns), held.tolist()))])


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
    rest.set(xlabel="row", ylabel=f"fitted - measured [{up}]", title="Residual")
    loop.legend(loc="center", frameon=False)
    return figure


def lines_of(answer: dict) -> list:
    """The answer of a fit as lines of text: one per value with its interval, then what is left over.

    answer: the object of fit.json.
    """
    out = [f"{answer['outcome']}: {answer['rows']} rows of {answer['measured']}, {answer['evaluations']} evaluations"]
    offsets = {f"offset of the {name}": one for name, one in answer["offsets"].items()}
    for key, one in (answer["values"] | offsets).items():
        out.append(line_of(f"{key:<26}", one))
    share = answer["rms"] / answer["peak"]
    out.append(f"  rms of the residual   {short(answer['rms'], answer['unit'], 4)}, {plain(share, 2)} of the peak")
    if answer["held"] is not None:
        held = answer["held"]
        out.append(f"  rms of held-out rows   {short(held['rms'], answer['unit'], 4)} ({held['rows']} rows)")
    return out


def line_of(name: str, one: dict) -> str:
    """A fitted value with its interval in the unit that people read; one: its object in fit.json."""
    value, unit, ends = told_of(one)
    bound = f", at its {one['at_bound']} bound" if one["at_bound"] else ""
    bar = "not determined" if not ends else f"95 % in [{', '.join(ends)}] by the " + \
        ("profile" if one["method"] == "profile" else "linearised problem")
    return f"  {name} {f'{value} {unit}'.strip()}   {bar}{bound}"


def told_of(one: dict) -> tuple:
    """(value, unit, ends of its interval or none) of a fitted value in the unit that people read; one: as above."""
    unit, scale = fitting(one["value"], SPOKEN.get(one["unit"], one["unit"]))
    ends = one.get("interval")
    half = None if ends is None else scale * (ends[1] - ends[0]) / 2
    value, *ends = (rounded(number * scale, half)[0] for number in (one["value"], *(ends or ())))
    return value, unit, ends
