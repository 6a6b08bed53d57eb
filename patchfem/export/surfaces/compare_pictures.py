"""Pictures of two traces before and after: laid over each other, their difference, spectra, Abbott curves, pressure."""

import numpy as np

from ...scales import axis_unit
from ...surface.profile import even, level
from ..drawing.pictures import BLUE, GREY, ORANGE, drawing, styled
from .pictures import thinned

CURVE = 400
FINE = 400  # samples that the closer view shows, at least


@styled
def overlay(x, first, second, rest, where: tuple):
    """Draw both traces (n,) [m] over x (n,) [m], the second laid on the first, and between them what wore off.

    rest (n,) [m]: depth; where: (from, to) [m] of the closer view on the right.
    """
    figure, (left, right) = drawing(2, 3.4, width_ratios=(1.5, 1))
    along, mm = axis_unit(x, "m")
    up, um = axis_unit(np.concatenate([first, second]), "m")
    for axis in (left, right):
        for z, colour, name in ((first, GREY, "before"), (second, BLUE, "after")):
            a, b = thinned(x, z)
            axis.plot(a * mm, b * um, color=colour, lw=1.0, label=name)
        if rest is not None:
            axis.fill_between(x * mm, first * um, second * um, where=rest > 0, color=ORANGE, alpha=0.35, lw=0,
                              label="worn off")
        axis.set(xlabel=f"x of the trace after [{along}]")
    left.set(ylabel=f"height [{up}]", xlim=(x[0] * mm, x[-1] * mm), title="Both traces")
    right.set(xlim=(where[0] * mm, where[1] * mm), title="A part of them")
    inside = (x >= where[0]) & (x <= where[1])
    both = np.concatenate([first[inside], second[inside]]) * um
    right.set_ylim(both.min() - 0.1 * np.ptp(both), both.max() + 0.15 * np.ptp(both))
    left.legend(loc="upper left", ncols=3, bbox_to_anchor=(0.0, -0.16))
    return figure


@styled
def apart(before, after):
    """Draw both traces for themselves, one above the other: their places have nothing in common."""
    figure, (axis,) = drawing(1, 3.4)
    flat = [level(even(one)) for one in (before, after)]
    along, mm = axis_unit(np.concatenate([one.x - one.x[0] for one in flat]), "m")
    up, um = axis_unit(np.concatenate([one.z for one in flat]), "m")
    lift = np.ptp(flat[1].z) / 2 + np.ptp(flat[0].z) / 2
    for one, colour, name, by in ((flat[0], GREY, "before", 1.1 * lift), (flat[1], BLUE, "after", 0.0)):
        x, z = thinned(one.x - one.x[0], one.z)
        axis.plot(x * mm, (z + by) * um, color=colour, lw=0.8, label=name)
    axis.set(xlabel=f"along the trace [{along}]", ylabel=f"height, shifted [{up}]")
    axis.legend(loc="upper left", ncols=2, bbox_to_anchor=(0.0, 1.14))
    return figure


@styled
def difference(x, rest, used, noise: float | None, ends: tuple | None):
    """Draw the depth (n,) [m] of the trace after below its reference, and the unworn heights that carry it."""
    figure, (axis,) = drawing(1, 2.5)
    along, mm = axis_unit(x, "m")
    up, um = axis_unit(rest, "m")
    a, b = thinned(x, rest)
    axis.plot(a * mm, b * um, color=ORANGE, lw=1.0, label="depth of the trace after")
    if used is not None:
        axis.plot(x[used] * mm, rest[used] * um, ".", color=BLUE, ms=2.5, label="unworn: carries the registration")
    if ends is not None:
        axis.axvspan(ends[0] * mm, ends[1] * mm, color=GREY, alpha=0.15, lw=0, label="track")
    axis.axhline(0.0, color="0.3", lw=0.8)
    axis.invert_yaxis()
    axis.set(xlabel=f"x of the trace after [{along}]", ylabel=f"worn depth [{up}]", xlim=(x[0] * mm, x[-1] * mm))
    axis.legend(loc="lower left", fontsize=8)
    return figure


@styled
def statistics(curves: tuple, spectra: tuple, band: tuple):
    """Draw the Abbott curves ((ratio, height) each) and the spectra with their 95 % bands, before and after."""
    figure, (left, right) = drawing(2, 3.6)
    up, um = axis_unit(np.concatenate([height for _, height in curves]), "m")
    for (ratio, height), colour, name in zip(curves, (GREY, BLUE), ("before", "after")):
        left.plot(100 * ratio, height * um, color=colour, label=name)
    left.set(xlabel="material ratio [%]", ylabel=f"height [{up}]", title="Abbott curves", xlim=(0, 100))
    left.legend()
    unit, scale = axis_unit([1 / spectra[0].frequency[0] / 4], "m")
    for found, colour, name in zip(spectra, (GREY, BLUE), ("before", "after")):
        low, high = found.band()
        pick = np.unique(np.round(np.geomspace(1, found.frequency.size, CURVE)).astype(int)) - 1
        pick = pick[found.density[pick] > 0]
        right.fill_between(scale / found.frequency[pick], low[pick] * 1e18, high[pick] * 1e18, color=colour,
                           alpha=0.22, lw=0)
        right.loglog(scale / found.frequency[pick], found.density[pick] * 1e18, color=colour, label=name)
    right.axvspan(band[0] * scale, band[1] * scale, color=ORANGE, alpha=0.12, lw=0, label="band of the amplitude ratio")
    right.set(xlabel=f"wavelength [{unit}]", ylabel="density [um$^3$]", title="Power spectral density, 95 % bands")
    right.legend(loc="upper left", fontsize=8)
    return figure


@styled
def pressures(sides: list):
    """Draw the normal stress of the patch with each surface; sides: (x (n,) [m], stress (n,) [Pa], name)."""
    figure, axes = drawing(len(sides), 2.9, sharey=True)
    along, mm = axis_unit(sides[0][0], "m")
    unit, scale = axis_unit(np.concatenate([stress for _, stress, _ in sides]), "Pa")
    for axis, (x, stress, name) in zip(axes, sides):
        colour = GREY if name == "before" else BLUE
        axis.fill_between(x * mm, stress * scale, color=colour, alpha=0.25, lw=0)
        axis.plot(x * mm, stress * scale, color=colour, lw=0.9)
        axis.set(xlabel=f"x [{along}]", title=f"Pressure with the surface {name}", xlim=(x[0] * mm, x[-1] * mm))
    axes[0].set(ylabel=f"normal stress [{unit}]")
    return figure
