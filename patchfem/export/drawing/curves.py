"""Pictures and tables of steady motions over frequency or level, and of the report's procedure of levels."""

from itertools import pairwise

import numpy as np

from ...scales import axis_unit, wide_scale
from .pictures import BLUE, GREY, ORANGE, drawing, styled

G = 9.80665
STYLES = {"stable": "-", "stuck": "-", "unstable": "--", "unbounded": ":"}
COLOURS = (BLUE, ORANGE, "#3f7d4e", "#7a4f9a", "#8c6a00", "#b03a6a")
MARKED = 40  # points of a curve up to which each is marked


def spans(curve: dict) -> list:
    """Stretches [(regime, first, last + 1)] of neighbouring points of a curve of steady motions that share a regime."""
    regime = np.asarray(curve["regime"], str)
    edges = [0, *(np.flatnonzero(regime[1:] != regime[:-1]) + 1), regime.size]
    return [(str(regime[a]), int(a), int(b)) for a, b in pairwise(edges)]


def axis_of(curve: dict) -> tuple:
    """Horizontal axis of a curve: (values along it, their name, unit)."""
    if np.ptp(curve["frequency"]) > 0:
        return np.asarray(curve["frequency"]), "drive frequency", "Hz"
    return np.asarray(curve["level"]) / G, "drive level", "g"


def regime(steady: dict | None) -> str:
    """A sentence on the regime and the stability of the steady motion, empty where it is not known."""
    if steady is None:
        return ""
    size = steady["multiplier"]
    text = f" Regime: {steady['regime']}; largest Floquet multiplier {size:.4g}"
    if steady["regime"] in ("stuck", "unbounded") or size == 0:
        return text + "."
    return text + (", so a disturbance dies out." if size < 1 else ", so a disturbance does not die out.")


def caption(found: dict) -> str:
    """Caption of the picture of a curve of steady motions: what it shows, its regimes, folds and gaps."""
    what, parts = axis_of(found)[1], [regime for regime, _, _ in spans(found)]
    count, folds = np.asarray(found["amplitude"]).size, len(found.get("folds", ()))
    text = f"Half peak-to-peak of the steady motion over the {what}, {count} points; "
    text += "colour and line tell the regime: " + ", ".join(dict.fromkeys(parts)) + "."
    if folds:
        text += f" The curve turns back at {folds} fold{'s' if folds > 1 else ''}."
    return text + (" Shaded: no bounded motion." if not np.all(np.isfinite(found["amplitude"])) else "")


@styled
def curve(found: dict, onto=None):
    """Draw the amplitude of the steady motion over frequency or level.

    The regime is shown by colour and line: stable motions whole, unstable ones broken; folds are marked. Where the
    curve has accelerations the largest one and its first harmonic stand beside it, but not onto Axes.
    """
    along, what, unit = axis_of(found)
    name, scale = axis_unit(found["amplitude"], "m")
    value = np.asarray(found["amplitude"]) * scale
    figure, (axis, *beside) = drawing(2 if "acceleration_peak" in found else 1, 3.8, onto)
    parts = spans(found)
    colours = dict(zip(dict.fromkeys(part[0] for part in parts), COLOURS * 9))
    for regime, first, last in parts:
        stop = min(last + 1, along.size)  # on to the next part, so that the line is whole
        seen = regime not in axis.get_legend_handles_labels()[1]
        style = "--" if "unstable" in regime else STYLES.get(regime, "-")
        axis.plot(along[first:stop], value[first:stop], style, color=colours[regime],
                  marker="o" if along.size <= MARKED else None, ms=3, label=regime if seen else None)
    _gaps(axis, along, value)
    for k, at in enumerate(found.get("folds", ())):
        place = at if unit == "Hz" else at / G
        axis.axvline(place, color=GREY, lw=0.9, ls="-.", label="fold" if k == 0 else None)
    axis.set(xlabel=f"{what} [{unit}]", ylabel=f"half peak-to-peak [{name}]", title="Steady motion at the output")
    axis.set_ylim(bottom=0)
    axis.legend()
    for other in beside:
        lines = ("peak", "-", BLUE, "largest"), ("fundamental", "--", ORANGE, "first harmonic")
        for key, style, colour, text in lines:
            other.plot(along, np.asarray(found[f"acceleration_{key}"]) / G, style, color=colour, label=text)
        other.set(xlabel=f"{what} [{unit}]", ylabel="acceleration [g]", title="Its absolute acceleration")
        other.set_ylim(bottom=0)
        other.legend()
    return figure


def _gaps(axis, along, value) -> None:
    """Shade where no bounded motion exists."""
    lost = ~np.isfinite(value)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], lost, [False]]).astype(int)))
    for first, last in edges.reshape(-1, 2):
        axis.axvspan(along[max(first - 1, 0)], along[min(last, along.size - 1)], color=GREY, alpha=0.12, lw=0)


@styled
def levels(rows: list, onto=None):
    """Draw the amplitude after every level, in the order of the test, with arrows upwards and downwards.

    rows: dicts with drive [m s-2], or [N] where "unit" says so, stuck, values and errors by name, as in result.nc.
    """
    forced = rows[0].get("unit") == "N"
    drive = np.array([row["drive"] for row in rows]) / (1.0 if forced else G)
    amplitude = np.array([row["values"]["relative_displacement_amplitude"] for row in rows])
    name, scale = axis_unit(amplitude, "m")
    error = np.array([row["errors"].get("relative_displacement_amplitude", 0.0) for row in rows]) * scale
    held = np.array([row["stuck"] for row in rows])
    figure, (axis,) = drawing(1, 3.6, onto)
    y, seen, log = amplitude * scale, set(), wide_scale(amplitude)
    for k in range(len(rows) - 1):
        if log and not (y[k] > 0 and y[k + 1] > 0):  # a level without any motion has no place on a logarithmic axis
            continue
        up = drive[k + 1] >= drive[k]
        colour = BLUE if up else ORANGE
        axis.plot(drive[k:k + 2], y[k:k + 2], "-" if up else "--", color=colour,
                  label=None if up in seen else "raised" if up else "lowered")
        seen.add(up)
        ends = [((1 - s) * drive[k] + s * drive[k + 1],
                 y[k]**(1 - s) * y[k + 1]**s if log else (1 - s) * y[k] + s * y[k + 1]) for s in (0.45, 0.58)]
        axis.annotate("", xy=ends[1], xytext=ends[0], arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.2})
    for which, fill, text in ((~held, GREY, "slips"), (held, "white", "stuck")):
        if which.any():
            axis.errorbar(drive[which], y[which], yerr=error[which], fmt="o", color=GREY, mfc=fill, ms=5, capsize=2,
                          label=text)
    axis.set(xlabel="force [N]" if forced else "base acceleration [g]", ylabel=f"half peak-to-peak [{name}]",
             title="Level by level")
    if log:
        axis.set_yscale("log")
    else:
        axis.set_ylim(bottom=0)
    axis.legend()
    return figure
