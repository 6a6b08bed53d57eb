"""Figures of surfaces: a trace, its Abbott curve and spectrum, a scan; traces before and after, and their pressure."""

import numpy as np

from ...scales import axis_unit
from ...surface.profile import level
from ...surface.roughness.filter import even
from ..drawing.charts import axis, chart, line, mark
from ..drawing.pictures import BLUE, draw, drawing, styled

POINTS, CURVE = 2400, 400  # of a line and of a spectrum
BINS = 120  # of a histogram
FINE = 400  # samples that the closer view shows, at least
SIDES = (("soft", "before"), ("accent", "after"))
VOLUME = 1e18  # um^3


def trace(primary, waviness) -> str:
    """The levelled trace, and the waviness on it where there is one."""
    (along, mm), (up, um) = axis_unit(primary.x, "m"), axis_unit(primary.z, "m")
    marks = [line(primary.x * mm, primary.z * um, "accent", most=POINTS, width=0.7)]
    if waviness is not None:
        marks = [marks[0] | {"colour": "soft", "name": "levelled trace"},
                 line(waviness.x * mm, waviness.z * um, "warm", "waviness", most=POINTS, width=1.6)]
    return draw([chart("", _place("x", along, primary.x * mm), axis("height", up), marks)], height=2.7)


def rough(roughness, ends: tuple, cutoff: float) -> str:
    """The roughness profile with its sections of one cut-off [m]; ends [m] of the trace."""
    (along, mm), (up, um) = axis_unit(ends, "m"), axis_unit(roughness.z, "m")
    marks, count = [line(roughness.x * mm, roughness.z * um, "accent", most=POINTS, width=0.7)], \
        (roughness.x[-1] - roughness.x[0]) / cutoff
    if count < 60:
        marks += [mark("rule", "soft", x=(roughness.x[0] + k * cutoff) * mm, dash="dotted")
                  for k in range(int(count + 1e-6) + 1)]
    return draw([chart("", _place("x", along, np.array(ends) * mm), axis("roughness", up), marks)], height=2.4)


def bearing(abbott: tuple, core, names: tuple = ("Mr1", "Mr2")) -> dict:
    """The Abbott curve with the straight line of its core; names: of the material ratios where the core ends."""
    (ratio, height), (up, um) = abbott, axis_unit(abbott[1], "m")
    marks = [line(100 * ratio, height * um, "accent")]
    if core is not None:
        low = core.top - core.core
        marks.append(line([0, 100], [core.top * um, low * um], "warm", width=1.2, dash="dashed"))
        marks += [mark("dots", "warm", f"{name} {100 * at:.1f} %", x=[100 * at], y=[height * um], shape=shape)
                  for name, at, height, shape in zip(names, (core.first, core.second), (core.top, low),
                                                     ("circle", "square"))]
    return chart("Abbott curve", _place("material ratio", "%", [0, 100]), axis("height", up), marks)


def statistics(abbott: tuple, core, spectrum, band: tuple, cutoff: float | None) -> str:
    """The Abbott curve with the straight line of its core, and the spectrum with its 95 % band."""
    left, title = bearing(abbott, core), "Power spectral density"
    if not spectrum.density.any():
        return draw([left, chart(f"{title}: the trace is flat", axis("wavelength"), axis("density"), [])])
    name, scale = _wave(spectrum)
    marks = _density(spectrum, scale, "accent", "95 % band", "")
    ends = marks[-1]["x"]
    if band[1] > 1 / spectrum.frequency[-1] and band[0] < 1 / spectrum.frequency[0]:
        marks.append(mark("span", "soft", "wavelengths of band_amplitude", left=band[0] * scale, right=band[1] * scale))
    if spectrum.dominant is not None:
        marks.append(mark("rule", "warm", "dominant wavelength", x=spectrum.dominant * scale, dash="dashed"))
    if cutoff is not None:
        marks.append(mark("rule", "#4d4d4d", "cut-off", x=cutoff * scale, dash="dotted"))
    waves = axis("wavelength", name, True) | {"range": [ends.min(), ends.max()]}
    return draw([left, chart(title, waves, axis("density", "um$^3$", True), marks)])


def _place(label: str, unit: str, x) -> dict:
    """The axis of places x, all of which are shown."""
    return axis(label, unit) | {"range": [x[0], x[-1]]}


def _wave(spectrum) -> tuple:
    return axis_unit([1 / spectrum.frequency[0] / 4], "m")


def _density(spectrum, scale: float, colour: str, band: str, name: str) -> list:
    """A spectrum over the wavelength with its 95 % band."""
    low, high = spectrum.band()
    pick = np.unique(np.round(np.geomspace(1, spectrum.frequency.size, CURVE)).astype(int)) - 1
    pick = pick[spectrum.density[pick] > 0]
    waves = scale / spectrum.frequency[pick]
    return [mark("band", colour, band, x=waves, low=low[pick] * VOLUME, high=high[pick] * VOLUME),
            line(waves, spectrum.density[pick] * VOLUME, colour, name, width=1.0)]


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
    left.set(xlabel=f"x [{along}]", ylabel=f"y [{along}]", aspect="equal", title="Heights")
    left.grid(False)
    right.hist(known, bins=120, color=BLUE, weights=np.full(known.size, 100 / known.size))
    right.set(xlabel=f"height [{up}]", ylabel="share of the points [%]", title="Distribution of the heights")
    return figure


@styled
def maps(x, y, heights: tuple):
    """Draw the scan before, the scan after laid on it and the worn depth, (m, n) [m] each, over x (n,), y (m,) [m]."""
    figure, panels = drawing(3, float(np.clip(0.8 + 2.6 * np.ptp(y) / np.ptp(x), 1.6, 6.0)))
    along, mm = axis_unit(np.concatenate([x - x[0], y - y[0]]), "m")
    known = heights[0][~np.isnan(heights[0])]
    ends = np.quantile(known, (0.002, 0.998))
    reach = np.nanquantile(np.abs(heights[2]), 0.998)
    step = tuple(max(1, count // 400) for count in heights[0].shape)
    for panel, z, title, (low, high), colours in zip(
            panels, heights, ("before", "after", "worn depth"), (ends, ends, (-reach, reach)),
            ("viridis", "viridis", "RdBu_r")):
        up, um = axis_unit([low, high], "m")
        mesh = panel.pcolormesh(x[::step[1]] * mm, y[::step[0]] * mm, z[::step[0], ::step[1]] * um, cmap=colours,
                                vmin=low * um, vmax=high * um, rasterized=True, shading="nearest")
        name = "depth" if title == "worn depth" else "height"
        figure.colorbar(mesh, ax=panel, label=f"{name} [{up}]", extend="both", fraction=0.05, pad=0.02)
        panel.set(xlabel=f"x [{along}]", ylabel=f"y [{along}]", aspect="equal", title=title)
        panel.grid(False)
    return figure


def both_heights(heights: tuple, curves: tuple) -> str:
    """How often heights (k,) [m] before and after occur, and their Abbott curves ((ratio, height) each)."""
    both = np.concatenate(heights)
    up, um = axis_unit(both, "m")
    edges = np.linspace(*np.quantile(both, (0.001, 0.999)), BINS + 1)
    shares = [np.histogram(z, edges)[0] * 100 / z.size for z in heights]
    bars = [line((edges[:-1] + edges[1:]) / 2 * um, share, *side, width=1.2) for share, side in zip(shares, SIDES)]
    lines = [line(100 * ratio, height * um, *side) for (ratio, height), side in zip(curves, SIDES)]
    return draw([chart("Heights", axis("height", up), axis("share of the points", "%"), bars),
                 chart("Abbott curves", _place("material ratio", "%", [0, 100]), axis("height", up), lines)])


def mean_section(track, start: float, end: float) -> str:
    """The mean section of a track, its scatter, and where the track begins and ends [m]."""
    there = np.isfinite(track.section)
    x, depth, spread = track.across[there], track.section[there], track.spread[there]
    (along, mm), (up, um) = axis_unit(x, "m"), axis_unit(depth, "m")
    marks = [mark("band", "soft", "scatter of the sections", x=x * mm, low=(depth - spread) * um,
                  high=(depth + spread) * um), line(x * mm, depth * um, "warm", "mean", most=POINTS, width=1.2),
             line(x[[0, -1]] * mm, [0.0, 0.0], "#4d4d4d", width=0.8),
             *(mark("rule", "#4d4d4d", x=place * mm, dash="dotted") for place in (start, end))]
    low, high = float((depth - spread).min()), float((depth + spread).max())
    room = 0.05 * (high - low)
    return draw([chart("", _place("across the track", along, x * mm),
                       axis("worn depth", up) | {"range": [(high + room) * um, (low - room) * um]}, marks)], height=2.7)


def overlay(x, first, second, rest, where: tuple) -> str:
    """Both traces (n,) [m] over x (n,) [m], the second laid on the first, and between them what wore off.

    rest (n,) [m]: depth; where: (from, to) [m] of the closer view on the right.
    """
    (along, mm), (up, um) = axis_unit(x, "m"), axis_unit(np.concatenate([first, second]), "m")
    marks = [line(x * mm, z * um, colour, name, most=POINTS, width=1.0)
             for z, (colour, name) in zip((first, second), SIDES)]
    marks.append(mark("band", "warm", "worn off", x=x * mm, low=np.where(rest > 0, second, np.nan) * um,
                      high=first * um))
    inside = (x >= where[0]) & (x <= where[1])
    both = np.concatenate([first[inside], second[inside]]) * um
    label, up = "x of the second trace", axis("height", up)
    ends = [both.min() - 0.1 * np.ptp(both), both.max() + 0.15 * np.ptp(both)]
    return draw([chart("Both traces", _place(label, along, x * mm), up, marks),
                 chart("A part of them", _place(label, along, np.array(where) * mm), up | {"range": ends}, marks)],
                height=3.4)


def apart(before, after) -> str:
    """Both traces for themselves, one above the other: their places have nothing in common."""
    flat = [level(even(one)) for one in (before, after)]
    along, mm = axis_unit(np.concatenate([one.x - one.x[0] for one in flat]), "m")
    up, um = axis_unit(np.concatenate([one.z for one in flat]), "m")
    lift = 1.1 * (np.ptp(flat[1].z) / 2 + np.ptp(flat[0].z) / 2)
    marks = [line((one.x - one.x[0]) * mm, (one.z + by) * um, colour, name, most=POINTS, width=0.8)
             for one, by, (colour, name) in zip(flat, (lift, 0.0), SIDES)]
    return draw([chart("", axis("along the trace", along), axis("height, shifted", up), marks)], height=3.4)


def difference(x, rest, used, noise: float | None, ends: tuple | None) -> str:
    """The depth (n,) [m] of the trace after below its reference, and the unworn heights that carry it."""
    (along, mm), (up, um) = axis_unit(x, "m"), axis_unit(rest, "m")
    marks = [line(x * mm, rest * um, "warm", "depth of the second trace", most=POINTS, width=1.0),
             line(x[[0, -1]] * mm, [0.0, 0.0], "#4d4d4d", width=0.8)]
    if used is not None:
        marks.append(mark("dots", "accent", "unworn heights, used for the alignment", x=x[used] * mm, y=rest[used] * um,
                          size=1.5))
    if ends is not None:
        marks.append(mark("span", "soft", "track", left=ends[0] * mm, right=ends[1] * mm))
    room = 0.05 * np.ptp(rest)
    down = axis("worn depth", up) | {"range": [(rest.max() + room) * um, (rest.min() - room) * um]}
    return draw([chart("", _place("x of the second trace", along, x * mm), down, marks)], height=2.5)


def both_statistics(curves: tuple, spectra: tuple, band: tuple) -> str:
    """The Abbott curves ((ratio, height) each) and the spectra with their 95 % bands, before and after."""
    up, um = axis_unit(np.concatenate([height for _, height in curves]), "m")
    lines = [line(100 * ratio, height * um, *side) for (ratio, height), side in zip(curves, SIDES)]
    unit, scale = _wave(spectra[0])
    marks = [one for found, (colour, name) in zip(spectra, SIDES)
             for one in _density(found, scale, colour, "", name)]
    marks.append(mark("span", "warm", "band of the amplitude ratio", left=band[0] * scale, right=band[1] * scale))
    return draw([chart("Abbott curves", _place("material ratio", "%", [0, 100]), axis("height", up), lines),
                 chart("Power spectral density, 95 % bands", axis("wavelength", unit, True),
                       axis("density", "um$^3$", True), marks)])


def crossed(parts: list, directions: list) -> str:
    """Spectra along x and y before and after in one chart, and the ratios x over y with their intervals; directions:
    (when, amplitude ratio, slope ratio) each."""
    made, unit, scale = [], *_wave(parts[0].sizes[0].spectrum)
    for one, colour in zip(parts, ("accent", "warm")):
        for found, when, dash in zip((each.spectrum for each in one.sizes), ("before", "after"), ("dashed", "solid")):
            *_, curve = _density(found, scale, colour, "", f"{one.direction} {when}")
            made.append(curve | {"dash": dash})
    marks, places = [line([0.5, 2 * len(directions) + 0.5], [1.0, 1.0], "#4d4d4d", width=0.8)], []
    for row, name in enumerate(("amplitude", "slope")):
        for when, *ratios in directions:
            one, place = ratios[row], len(places) + 1
            places.append((place, f"{name}\n{when}"))
            if one.value is not None:
                marks += [line([place, place], [one.low, one.high], "accent"),
                          mark("dots", "accent", x=[place], y=[one.value])]
    ratio = axis("") | {"range": [0.5, len(places) + 0.5], "ticks": places}
    return draw([chart("Power spectral density", axis("wavelength", unit, True), axis("density", "um$^3$", True), made),
                 chart("x over y", ratio, axis("ratio"), marks)])


def each_and_mean(panels: list) -> str:
    """Numbers of pairs with their intervals, and their mean; panels: (title, [(line of the pair, quantity)], mean)
    each."""
    made = []
    for title, each, mean in panels:
        known = [(k, one) for k, one in each if one.value is not None]
        ends = [end for _, one in known for end in (one.low, one.high) if end is not None]
        unit, scale = axis_unit(ends, mean.unit) if mean.unit != "1" else ("", 1.0)
        wide = np.array([each[0][0] - 0.5, each[-1][0] + 0.5])
        marks = [mark("band", "soft", "mean", x=wide, low=np.full(2, mean.low * scale),
                      high=np.full(2, mean.high * scale)), line(wide, np.full(2, mean.value * scale), "soft")]
        marks += [line([k, k], [one.low * scale, one.high * scale], "accent", width=1.0) for k, one in known
                  if one.high is not None]
        marks.append(mark("dots", "accent", "each pair", x=np.array([k for k, _ in known], float),
                          y=np.array([one.value * scale for _, one in known]), size=4.0))
        made.append(chart(title, axis("line number in the table") | {"range": wide}, axis("", unit), marks))
    return draw(made, height=2.7)


def pressures(sides: list) -> str:
    """The normal stress of the patch with each surface; sides: (x (n,) [m], stress (n,) [Pa], name)."""
    along, mm = axis_unit(sides[0][0], "m")
    unit, scale = axis_unit(np.concatenate([stress for _, stress, _ in sides]), "Pa")
    top, made = 1.05 * max(float(stress.max()) for _, stress, _ in sides) * scale, []
    for x, stress, name in sides:
        colour = dict(map(reversed, SIDES))[name]
        made.append(chart(f"Pressure with the surface {name}", _place("x", along, x * mm), axis(
            "normal stress", unit) | {"range": [0.0, top]}, [
                mark("band", colour, x=x * mm, low=0 * x, high=stress * scale),
                line(x * mm, stress * scale, colour, width=0.9)]))
    return draw(made, height=2.9)
