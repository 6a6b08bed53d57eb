"""Static pictures of a run as SVG text, the same bytes for the same numbers; units are chosen by magnitude."""

import io
import re
from functools import partial, wraps

import numpy as np

from ...scales import axis_unit

BLUE, ORANGE, GREY = "#1f5f99", "#c8551b", "#8a8a8a"
WIDTH = 9.6  # inches; the page stretches a picture to its text column
STYLE = {"svg.hashsalt": "patchfem", "svg.fonttype": "none", "font.family": "sans-serif", "font.size": 10,
         "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#e3e3e3",
         "axes.axisbelow": True, "axes.titlesize": 11, "axes.formatter.useoffset": False, "legend.frameon": False,
         "legend.fontsize": 9, "figure.constrained_layout.use": True, "lines.linewidth": 1.4}
SPARSE = 20  # kept samples per cycle below which a line through them would not be the motion
DOTS, BANDS = 800, 1500


def envelope(time, value, period: float) -> tuple:
    """Middle, lowest and highest value of the samples of each cycle; a cycle without samples is a gap of NaN.

    time, value: (k,), ascending. Cycles are put together where there are more than a picture can show.
    """
    many = int(np.ceil(max(1.0, (time[-1] - time[0]) / period / BANDS)))
    number = np.floor(time / (many * period) + 1e-9).astype(int)
    count = number[-1] + 1
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, number, value)
    np.maximum.at(high, number, value)
    empty = low > high
    low[empty] = high[empty] = np.nan
    return (np.arange(count) + 0.5) * many * period, low, high


def whole_from(time, period: float, window_start: float) -> float:
    """Time [s] from which the kept samples show the motion itself: every later cycle holds at least SPARSE of them.

    The last window is always kept whole, so the answer is never later than its start.
    """
    counts = np.bincount(np.floor(time / period + 1e-9).astype(int))[:-1]
    thin = np.flatnonzero(counts < SPARSE)
    return min((thin[-1] + 1) * period, window_start) if thin.size else float(time[0])


def drawing(columns: int = 1, height: float = 3.2, onto=None, **layout):
    """An empty Figure of the page's width with `columns` axes side by side: (figure, axes).

    height [inch]; onto: matplotlib Axes that stand in place of all of them; layout: passed on to `subplots`.
    """
    if onto is not None:
        return onto.figure, [onto]
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height))
    FigureCanvasSVG(figure)
    axes = figure.subplots(1, columns, squeeze=False, **layout)[0]
    if columns > 1:
        for axis in axes:
            axis.locator_params(axis="x", nbins=6)
    return figure, axes


def _svg(figure) -> str:
    """The drawing alone, without date, creator or any address but those of the XML namespaces."""
    import matplotlib

    text = io.StringIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(text, format="svg", dpi=180, metadata={"Date": None})
    body = text.getvalue()
    return re.sub(r"\s*<metadata>.*?</metadata>", "", body[body.index("<svg"):], flags=re.DOTALL)


def styled(draw):
    """Turn a function that draws a Figure into one that answers with its SVG text.

    Its `figure` gives the Figure itself, which a notebook shows, as each of its axes, as the same SVG.
    """
    @wraps(draw)
    def figure(*args, **kwargs):
        import matplotlib

        with matplotlib.rc_context(STYLE):
            drawn = draw(*args, **kwargs)
        if kwargs.get("onto") is None:  # else the picture is its owner's
            for shown in (drawn, *drawn.axes):
                shown._repr_svg_ = partial(_svg, drawn)
        return drawn

    @wraps(draw)
    def svg(*args, **kwargs) -> str:
        return _svg(figure(*args, **kwargs))
    svg.figure = figure
    return svg


def part_in_contact(x, sigma) -> tuple | None:
    """Ends (first, last) x [m] of the part to show where less than half the length is pressed, None where all is worth
    showing."""
    used = np.flatnonzero(sigma > 0)
    if not used.size or used.size >= 0.5 * x.size:
        return None
    pad = 0.15 * (x[used[-1]] - x[used[0]]) + (x[1] - x[0])
    return max(x[0], x[used[0]] - pad), min(x[-1], x[used[-1]] + pad)


@styled
def interface(x, fields: dict, onto=None):
    """Draw sigma_n(x) of the pressed state and, where some shear acts, tau(x) with the frame of the largest
    resultant; onto Axes the first alone."""
    sigma, tau = fields["normal_stress"][0], fields.get("shear_stress")
    both = onto is None and tau is not None and bool(np.any(tau))
    figure, axes = drawing(2 if both else 1, 3.2, onto)
    part = part_in_contact(x, sigma) or (x[0], x[-1])
    along, mm = axis_unit(part, "m")
    unit, scale = axis_unit(sigma, "Pa")
    axes[0].fill_between(x * mm, sigma * scale, color=BLUE, alpha=0.15, lw=0)
    axes[0].plot(x * mm, sigma * scale, color=BLUE)
    axes[0].set(ylabel=f"normal stress [{unit}]", title="Pressure on the interface")
    if both:
        unit, scale = axis_unit(tau, "Pa")
        frame = int(np.argmax(np.abs(tau @ np.gradient(x))))
        for k in range(1, len(tau)):
            axes[1].plot(x * mm, tau[k] * scale, color=GREY, lw=0.6, alpha=0.6)
        axes[1].plot(x * mm, tau[frame] * scale, color=ORANGE)
        name, per = axis_unit(fields["time"], "s")
        axes[1].set(ylabel=f"shear stress [{unit}]",
                    title=f"Shear stress, largest resultant {fields['time'][frame] * per:.4g} {name} into the motion")
    for axis in axes:
        axis.set(xlabel=f"x [{along}]", xlim=(part[0] * mm, part[1] * mm))
    return figure


def closer(x, depth, sigma, ratio: float) -> tuple:
    """Part (left, right, height) [m] of both pieces that shows the contact, right - left = 2 height ratio.

    x: (m,) and depth: (ny,) [m] of the mesh; sigma: (m,) [Pa], somewhere > 0; ratio: width of the picture over its
    height.
    """
    used = np.flatnonzero(sigma > 0)
    first, last, length = x[used[0]], x[used[-1]], x[-1] - x[0]
    width = min(1.6 * (last - first) + 2 * (x[1] - x[0]), 0.4 * length)
    middle = (first + last) / 2
    if last - first > width:
        middle = x[np.flatnonzero(sigma >= (1 - 1e-6) * sigma.max())[0]]
    height = min(width / ratio / 2, depth[-1])
    left = min(max(middle - width / 2, x[0]), x[-1] - width)
    return left, left + width, height


@styled
def bodies(x, depths, mises, sigma):
    """Von Mises stress [Pa] of both pieces, pressed: the whole pair, and closer where sigma (m,) [Pa] is not zero.

    depths, mises: (ny,) rows and (nx - 1, ny - 1) cells of the lower and of the upper piece; colours end at all but the
    sharpest cells.
    """
    tall, depth = 3.7, max(depths, key=lambda rows: rows[-1])
    wide = min(max(tall * (x[-1] - x[0]) / (2 * depth[-1]), 1.5), 4.2)
    rest = WIDTH - wide - 2.3
    figure, axes = drawing(2, tall + 0.7, width_ratios=(wide, rest))
    box = closer(x, depth, sigma, rest / tall)
    (unit, scale), top = axis_unit(np.concatenate([np.ravel(part) for part in mises]), "Pa"), 0.0
    for axis, (left, right, height) in zip(axes[::-1], (box, (x[0], x[-1], depth[-1]))):
        name, size = axis_unit((left, right, height), "m")
        i = slice(max(np.searchsorted(x, left, "right") - 1, 0), np.searchsorted(x, right) + 1)
        rows = [part[:np.searchsorted(part, height) + 1] for part in depths]
        cells = [part[i.start:i.stop - 1, :row.size - 1] * scale for part, row in zip(mises, rows)]
        # the framed part comes first and sets the colours
        top = top or float(np.quantile(np.concatenate([part.ravel() for part in cells]), 0.998))
        for k, side in ((0, -1), (1, 1)):
            mesh = axis.pcolormesh(x[i] * size, side * rows[k] * size, cells[k].T, cmap="viridis", vmin=0, vmax=top,
                                   rasterized=True)
        axis.axhline(0, color="white", lw=0.6)
        axis.set(xlabel=f"x [{name}]", ylabel=f"y [{name}]", aspect="equal", xlim=(left * size, right * size),
                 ylim=(-height * size, height * size))
        axis.grid(False)
    size = axis_unit((x[0], x[-1], depth[-1]), "m")[1]
    left, right, height = box
    axes[0].plot(np.array([left, right, right, left, left]) * size,
                 np.array([-1, -1, 1, 1, -1]) * height * size, color=ORANGE, lw=1.0)
    axes[0].set_title("Von Mises stress")
    axes[1].set_title("The framed part")
    figure.colorbar(mesh, ax=list(axes), label=unit, extend="max", fraction=0.05, pad=0.02)
    return figure


@styled
def loop(slide, force, title: str, measured: tuple | None = None, onto=None):
    """Draw the friction force (k,) [N] against the slide (k,) [m], with a title, over a measured pair (m,) of both."""
    figure, (axis,) = drawing(1, 3.6, onto)
    along, um = axis_unit(slide, "m")
    up, scale = axis_unit(force, "N")
    if measured is not None:
        axis.plot(measured[0] * um, measured[1] * scale, ".", color=GREY, ms=3, mew=0, label="measured")
        axis.legend(frameon=False)
    axis.plot(slide * um, force * scale, color=BLUE, lw=1.0)
    axis.set(xlabel=f"slide [{along}]", ylabel=f"friction force [{up}]", title=title)
    return figure


@styled
def histories(history: dict, window: dict | None, period: float | None, title: str = "Last cycles",
              joined: bool = False, onto=None):
    """The whole run beside its last cycles (a rig) or beside its friction force (a bench); onto Axes the first alone.

    history: time, displacement, force; window: the last cycles alone, with base and block acceleration;
    period [s] of the drive, None where every sample was kept; joined: what was kept before is a line, not a band per
    cycle. `measured` in history: times [s] and forces [N] read.
    """
    forced = onto is None and window is None and bool(np.any(history["force"]))
    figure, axes = drawing(2 if window or forced else 1, 3.6, onto)
    name, per = axis_unit(history["time"], "s")
    start = window["time"][0] if window else 0.0
    _whole_run(axes[0], history, None if joined else period, per, start)
    axes[0].set(xlabel=f"time [{name}]", title="Whole run")
    if forced:
        up, scale = axis_unit(history["force"], "N")
        if "measured" in history:
            time, force = history["measured"]
            axes[1].plot(time * per, force * scale, ".", color=GREY, ms=3, mew=0, label="measured")
            axes[1].legend(frameon=False)
        axes[1].plot(history["time"] * per, history["force"] * scale, color=ORANGE, lw=1.0)
        axes[1].set(xlabel=f"time [{name}]", ylabel=f"friction force [{up}]", title="Friction force")
    if window and onto is None:
        _last_cycles(axes[1], window, title)
    return figure


def _whole_run(axis, history, period, per, window_start) -> None:
    time, value = history["time"], history["displacement"]
    unit, scale = axis_unit(value, "m")
    axis.set_ylabel(f"displacement [{unit}]")
    begin = whole_from(time, period, window_start) if period else time[0]
    late = time >= begin
    if not late.all():
        middle, low, high = envelope(time[~late], value[~late], period)
        axis.fill_between(middle * per, low * scale, high * scale, color=BLUE, alpha=0.22, lw=0)
        if (~late).sum() <= DOTS:
            axis.plot(time[~late] * per, value[~late] * scale, ".", color=BLUE, ms=2.0, mew=0)
    axis.plot(time[late] * per, value[late] * scale, color=BLUE, lw=0.7)


def _last_cycles(axis, window: dict, title: str) -> None:
    """Accelerations on the left axis, displacement on the right one, both axes in the colours of their curves."""
    name, per = axis_unit(window["time"] - window["time"][0], "s")
    unit, scale = axis_unit(window["displacement"], "m")
    t = (window["time"] - window["time"][0]) * per
    twin = axis.twinx()
    lines = [*axis.plot(t, window["acceleration"] / 9.80665, color=ORANGE, label="block acceleration (left)"),
             *axis.plot(t, window["base"] / 9.80665, color=ORANGE, lw=1.0, ls="--", label="base acceleration (left)"),
             *twin.plot(t, window["displacement"] * scale, color=BLUE, lw=1.2, label="displacement (right)")]
    axis.set(xlabel=f"time [{name}]", title=title)
    axis.set_ylabel("acceleration [g]", color=ORANGE)
    twin.set_ylabel(f"displacement [{unit}]", color=BLUE)
    twin.spines["right"].set_visible(True)
    twin.grid(False)
    for one, side, colour in ((axis, "left", ORANGE), (twin, "right", BLUE)):
        one.tick_params(axis="y", colors=colour)
        twin.spines[side].set_color(colour)
        one.spines[side].set_color(colour)
        low, high = one.dataLim.intervaly
        if low < 0 < high:  # zero at mid-height on both sides
            one.set_ylim(-1.08 * max(-low, high), 1.08 * max(-low, high))
    axis.legend(handles=lines, loc="upper center", ncols=2, bbox_to_anchor=(0.5, -0.17))


@styled
def measured(rows: list, frequency: float, level: float, acceleration, displacement):
    """Measured acceleration and displacement against input at one frequency, with the computed point.

    rows: objects of the measured table; acceleration, displacement: (value, error) computed, in SI, or None.
    """
    figure, axes = drawing(2, 3.6)
    near = [r for r in rows if abs(r.frequency - frequency) < 0.5]
    legend = {}
    for axis, name, unit, scale, found in ((axes[0], "acceleration", "g", 9.80665, acceleration),
                                           (axes[1], "displacement", "mil", 25.4e-6, displacement)):
        read = [r for r in near if getattr(r, name) is not None]
        for repeat, marker in ((False, "o"), (True, "s")):
            pick = [r for r in read if ("R" in r.flag) == repeat]
            if pick:
                text = "measured, repeat run" if repeat else "measured"
                legend[text], = axis.plot([r.input / 9.80665 for r in pick], [getattr(r, name) / scale for r in pick],
                                          marker, color=GREY, ms=6, ls="none")
        for place in sorted({r.input / 9.80665 for r in near if "U" in r.flag}):
            legend["unstable in the test"] = axis.axvline(place, color=ORANGE, lw=1.2, ls=":")
        if found is not None:
            legend["computed"] = axis.errorbar([level / 9.80665], [found[0] / scale], yerr=[(found[1] or 0) / scale],
                                               fmt="D", color=BLUE, ms=6, capsize=3)
        word = "" if read else ", not measured"
        axis.set(xlabel="input [g]", ylabel=f"{name} [{unit}]",
                 title=f"{name.capitalize()} at {frequency:g} Hz{word}")
        axis.margins(x=0.08, y=0.1)
        axis.set_ylim(bottom=0)
    figure.legend(list(legend.values()), list(legend), loc="outside lower center", ncols=max(1, len(legend)))
    return figure
