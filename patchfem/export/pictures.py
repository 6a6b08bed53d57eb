"""Static pictures of a run as SVG text, the same bytes for the same numbers."""

import io

import numpy as np

BLUE, ORANGE, GREY, GREEN = "#1f5f99", "#c8551b", "#8a8a8a", "#2e7d5b"
STYLE = {"svg.hashsalt": "patchfem", "svg.fonttype": "none", "font.family": "sans-serif", "font.size": 9,
         "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#e3e3e3",
         "axes.axisbelow": True, "figure.constrained_layout.use": True, "lines.linewidth": 1.4}


def _figure(columns: int = 1, height: float = 2.6):
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, height))
    FigureCanvasSVG(figure)
    return figure, figure.subplots(1, columns, squeeze=False)[0]


def _svg(figure) -> str:
    import matplotlib

    text = io.StringIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(text, format="svg", metadata={"Date": None})
    body = text.getvalue()
    return body[body.index("<svg"):]


def _styled(draw):
    def wrapped(*args, **kwargs):
        import matplotlib

        with matplotlib.rc_context(STYLE):
            return draw(*args, **kwargs)
    wrapped.__doc__ = draw.__doc__
    return wrapped


@_styled
def interface(x, fields: dict, friction: bool) -> str:
    """sigma_n(x) of the pressed state and, with friction, tau(x) in the frame of the largest resultant."""
    both = friction and "shear_stress" in fields
    figure, axes = _figure(2 if both else 1)
    axes[0].fill_between(x * 1e3, fields["normal_stress"][0] / 1e6, color=BLUE, alpha=0.15, lw=0)
    axes[0].plot(x * 1e3, fields["normal_stress"][0] / 1e6, color=BLUE)
    axes[0].set(xlabel="x [mm]", ylabel="normal stress [MPa]", title="Pressure on the interface")
    if both:
        tau = fields["shear_stress"]
        frame = int(np.argmax(np.abs(tau.sum(axis=1))))
        for k in range(1, len(tau)):
            axes[1].plot(x * 1e3, tau[k] / 1e6, color=GREY, lw=0.6, alpha=0.6)
        axes[1].plot(x * 1e3, tau[frame] / 1e6, color=ORANGE)
        axes[1].set(xlabel="x [mm]", ylabel="shear stress [MPa]",
                    title=f"Shear, largest at {fields['time'][frame] * 1e3:.3f} ms")
    used = np.flatnonzero(fields["normal_stress"][0] > 0)
    if used.size and used.size < 0.5 * x.size:
        pad = 0.15 * (x[used[-1]] - x[used[0]]) + (x[1] - x[0])
        for axis in axes:
            axis.set_xlim(max(x[0], x[used[0]] - pad) * 1e3, min(x[-1], x[used[-1]] + pad) * 1e3)
    return _svg(figure)


@_styled
def bodies(x, depth, mises, gap_scale: str = "") -> str:
    """Von Mises stress [Pa] of both pieces, pressed: mises (2, nx - 1, ny - 1) for the lower and the upper piece."""
    figure, (axis,) = _figure(1, 3.2)
    top = np.quantile(mises, 0.995) / 1e6
    for k, side in ((0, -1), (1, 1)):
        mesh = axis.pcolormesh(x * 1e3, side * depth * 1e3, mises[k].T / 1e6, cmap="viridis", vmin=0, vmax=top,
                               rasterized=True)
    axis.axhline(0, color="white", lw=0.8)
    axis.set(xlabel="x [mm]", ylabel="y [mm]", title="Von Mises stress of the pressed pieces [MPa]", aspect="equal")
    axis.grid(False)
    figure.colorbar(mesh, ax=axis, shrink=0.9)
    return _svg(figure)


@_styled
def loop(slide, force, title: str) -> str:
    """Friction force [N] against slide [m]."""
    figure, (axis,) = _figure(1, 3.0)
    axis.plot(slide * 1e6, force, color=BLUE, lw=1.0)
    axis.set(xlabel="slide [um]", ylabel="friction force [N]", title=title)
    return _svg(figure)


@_styled
def histories(time, displacement, window: dict | None) -> str:
    """The whole run and, for a rig, its last three cycles with input and response acceleration."""
    figure, axes = _figure(2 if window else 1, 3.0)
    axes[0].plot(time, displacement * 1e6, color=BLUE, lw=0.7)
    axes[0].set(xlabel="time [s]", ylabel="displacement [um]", title="Whole run")
    if window:
        t = (window["time"] - window["time"][0]) * 1e3
        axes[1].plot(t, window["acceleration"] / 9.80665, color=ORANGE, label="block, absolute")
        axes[1].plot(t, window["base"] / 9.80665, color=GREY, label="base")
        axes[1].set(xlabel="time [ms]", ylabel="acceleration [g]", title="Last cycles")
        axes[1].legend(frameon=False, fontsize=8, loc="upper center", ncols=2, bbox_to_anchor=(0.5, -0.22))
        twin = axes[1].twinx()
        twin.plot(t, window["displacement"] * 1e6, color=BLUE, lw=1.0)
        twin.set_ylabel("displacement [um]", color=BLUE)
        twin.grid(False)
    return _svg(figure)


@_styled
def measured(rows: list, frequency: float, level: float, acceleration, displacement) -> str:
    """Measured acceleration and displacement against input at one frequency, with the computed point.

    rows: objects of the measured table; acceleration, displacement: (value, error) computed, in SI.
    """
    figure, axes = _figure(2)
    near = [r for r in rows if abs(r.frequency - frequency) < 0.5]
    for axis, name, unit, scale, found in ((axes[0], "acceleration", "g", 9.80665, acceleration),
                                           (axes[1], "displacement", "mil", 25.4e-6, displacement)):
        for repeat, marker in ((False, "o"), (True, "s")):
            pick = [r for r in near if getattr(r, name) is not None and ("R" in r.flag) == repeat]
            if pick:
                axis.plot([r.input / 9.80665 for r in pick], [getattr(r, name) / scale for r in pick], marker,
                          color=GREY, ms=5, label="measured, repeat" if repeat else "measured")
        for r in near:
            if "U" in r.flag:
                axis.axvline(r.input / 9.80665, color=ORANGE, lw=0.8, ls=":", label="unstable")
        axis.errorbar([level / 9.80665], [found[0] / scale], yerr=[(found[1] or 0) / scale], fmt="D", color=BLUE,
                      ms=6, capsize=3, label="computed")
        axis.set(xlabel="input [g]", ylabel=f"{name} [{unit}]", title=f"{frequency:g} Hz")
        axis.set_ylim(bottom=0)
        axis.margins(x=0.08)
        axis.legend(frameon=False, fontsize=8)
    return _svg(figure)
