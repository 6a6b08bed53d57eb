"""Pictures of a trace, its Abbott curve, its spectrum and of an areal scan, as SVG text."""

import numpy as np

from ...scales import axis_unit
from ..drawing.pictures import BLUE, GREY, ORANGE, drawing, styled

POINTS = 1200  # pairs of lowest and highest height that a line shows
CURVE = 400  # points of a spectrum


def thinned(x, z, most: int = POINTS) -> tuple:
    """A line that looks the same: lowest and highest height of every few samples, in their order along x."""
    if z.size <= 2 * most:
        return x, z
    each = -(-z.size // most)
    count = z.size // each
    parts = z[:count * each].reshape(count, each)
    pair = np.sort(np.stack([parts.argmin(axis=1), parts.argmax(axis=1)], axis=1), axis=1)
    keep = np.append((pair + each * np.arange(count)[:, None]).ravel(), z.size - 1)
    return x[keep], z[keep]


@styled
def trace(primary, waviness):
    """Draw the levelled trace, and the waviness on it where there is one."""
    figure, (axis,) = drawing(1, 2.7)
    along, mm = axis_unit(primary.x, "m")
    up, um = axis_unit(primary.z, "m")
    x, z = thinned(primary.x, primary.z)
    axis.plot(x * mm, z * um, color=GREY if waviness is not None else BLUE, lw=0.7, label="levelled trace")
    if waviness is not None:
        x, z = thinned(waviness.x, waviness.z)
        axis.plot(x * mm, z * um, color=ORANGE, lw=1.6, label="waviness")
        axis.legend(loc="upper left", bbox_to_anchor=(0.0, 1.16), ncols=2)
    axis.set(xlabel=f"x [{along}]", ylabel=f"height [{up}]", xlim=(primary.x[0] * mm, primary.x[-1] * mm))
    return figure


@styled
def rough(roughness, ends: tuple, cutoff: float):
    """Draw the roughness profile with its sections of one cut-off [m]; ends [m] of the trace."""
    figure, (axis,) = drawing(1, 2.4)
    along, mm = axis_unit(ends, "m")
    up, um = axis_unit(roughness.z, "m")
    x, z = thinned(roughness.x, roughness.z)
    axis.plot(x * mm, z * um, color=BLUE, lw=0.7)
    if (roughness.x[-1] - roughness.x[0]) / cutoff < 60:
        for edge in np.arange(roughness.x[0], roughness.x[-1] + cutoff / 1e6, cutoff):
            axis.axvline(edge * mm, color=GREY, lw=0.7, ls=":")
    axis.set(xlabel=f"x [{along}]", ylabel=f"roughness [{up}]", xlim=(ends[0] * mm, ends[1] * mm))
    return figure


@styled
def statistics(abbott: tuple, core, spectrum, band: tuple, cutoff: float | None):
    """Draw the Abbott curve with the straight line of its core, and the spectrum with its 95 % band."""
    figure, (left, right) = drawing(2, 3.6)
    ratio, height = abbott
    up, um = axis_unit(height, "m")
    left.plot(100 * ratio, height * um, color=BLUE)
    if core is not None:
        left.plot([0, 100], [core.top * um, (core.top - core.core) * um], color=ORANGE, lw=1.2, ls="--")
        for name, at, level in (("Mr1", core.first, core.top), ("Mr2", core.second, core.top - core.core)):
            left.plot([100 * at], [level * um], "o", color=ORANGE, ms=5)
            left.annotate(f"{name} {100 * at:.1f} %", (100 * at, level * um), xytext=(6, 6 if name == "Mr1" else -14),
                          textcoords="offset points", fontsize=9, ha="left" if at < 0.8 else "right")
    left.set(xlabel="material ratio [%]", ylabel=f"height [{up}]", title="Abbott curve", xlim=(0, 100))
    _spectrum(right, spectrum, band, cutoff)
    return figure


def _spectrum(axis, spectrum, band: tuple, cutoff: float | None) -> None:
    axis.set(ylabel="density [um$^3$]", title="Power spectral density")
    if not spectrum.density.any():
        axis.text(0.5, 0.5, "the trace is flat", ha="center", transform=axis.transAxes)
        return
    name, scale = axis_unit([1 / spectrum.frequency[0] / 4], "m")
    low, high = spectrum.band()
    pick = np.unique(np.round(np.geomspace(1, spectrum.frequency.size, CURVE)).astype(int)) - 1
    waves = scale / spectrum.frequency[pick]
    shown = spectrum.density[pick] > 0
    cubic = 1e18  # um^3
    axis.fill_between(waves[shown], low[pick][shown] * cubic, high[pick][shown] * cubic, color=BLUE, alpha=0.2, lw=0,
                      label="95 % band")
    axis.loglog(waves[shown], spectrum.density[pick][shown] * cubic, color=BLUE, lw=1.0)
    ends = axis.get_xlim()
    if band[1] > 1 / spectrum.frequency[-1] and band[0] < 1 / spectrum.frequency[0]:
        axis.axvspan(band[0] * scale, band[1] * scale, color=GREY, alpha=0.18, lw=0, label="band of band_amplitude")
    if spectrum.dominant is not None:
        axis.axvline(spectrum.dominant * scale, color=ORANGE, lw=1.2, ls="--", label="dominant wavelength")
    if cutoff is not None:
        axis.axvline(cutoff * scale, color="0.3", lw=1.0, ls=":", label="cut-off")
    axis.set(xlabel=f"wavelength [{name}]", xlim=ends)
    axis.legend(loc="upper left", fontsize=8)


@styled
def scan(x, y, z):
    """Draw the heights z (m, n) [m] of a levelled scan over x (n,) and y (m,) [m], and how often each occurs."""
    figure, (left, right) = drawing(2, 3.8, width_ratios=(1.2, 1))
    along, mm = axis_unit(np.concatenate([x, y]), "m")
    up, um = axis_unit(z, "m")
    step = (max(1, z.shape[0] // 600), max(1, z.shape[1] // 600))
    known = z[~np.isnan(z)] * um
    low, high = np.quantile(known, (0.002, 0.998))
    mesh = left.pcolormesh(x[::step[1]] * mm, y[::step[0]] * mm, z[::step[0], ::step[1]] * um, cmap="viridis",
                           vmin=low, vmax=high, rasterized=True, shading="nearest")
    figure.colorbar(mesh, ax=left, label=f"height [{up}]", extend="both", fraction=0.05, pad=0.02)
    left.set(xlabel=f"x [{along}]", ylabel=f"y [{along}]", aspect="equal", title="Heights about the plane")
    left.grid(False)
    right.hist(known, bins=120, color=BLUE, weights=np.full(known.size, 100 / known.size))
    right.set(xlabel=f"height [{up}]", ylabel="share of the points [%]", title="Distribution of the heights")
    return figure
