"""Pictures of measured surfaces, before and after wear."""

from typing import NamedTuple

import numpy as np

from ...formatting import choose_axis_unit
from ...surface.profile import level, resample_evenly
from ...surface.quantity import Quantity
from ...surface.roughness.parameters import Heights, abbott_curve
from ...surface.roughness.spectrum import Spectrum
from ..drawing.charts import make_axis, make_chart, make_line, make_mark
from ..drawing.pictures import BLUE, draw_charts, make_figure, returns_svg

MAX_POINTS = 2400  # largest number of points of a line, eight per pixel column of the page
# Largest number of points of a spectrum, evenly spaced on the logarithmic axis.
MAX_SPECTRUM_POINTS = 400
N_BINS = 120  # number of bins of a histogram
MAX_PIXELS = 400  # largest number of heights of a map along each axis, as many as the page can show
MIN_DETAIL_SAMPLES = 400  # smallest number of samples in the enlarged part, both traces together
# Number of sections of a roughness profile at which their limits are not drawn any more.
MAX_SECTION_RULES = 60
COLOUR_QUANTILES = (0.002, 0.998)  # quantiles of the heights at the ends of the colour scale
UM3_PER_M3 = 1e18  # number of cubic micrometres in a cubic metre
GREY = "#4d4d4d"
SIDES = (("soft", "before"), ("accent", "after"))


class Picture(NamedTuple):
    """Picture of a page as SVG, with its caption and its alternative text."""

    svg: str
    caption: str
    alternative: str


def draw_trace(primary, waviness) -> str:
    """Draw a levelled trace and, if there is one, its waviness."""
    along, mm = choose_axis_unit(primary.x, "m")
    up, um = choose_axis_unit(primary.z, "m")
    if waviness is None:
        marks = [
            make_line(primary.x * mm, primary.z * um, "accent", max_points=MAX_POINTS, width=0.7)
        ]
    else:
        marks = [
            make_line(
                primary.x * mm,
                primary.z * um,
                "soft",
                "levelled trace",
                max_points=MAX_POINTS,
                width=0.7,
            ),
            make_line(
                waviness.x * mm,
                waviness.z * um,
                "warm",
                "waviness",
                max_points=MAX_POINTS,
                width=1.6,
            ),
        ]
    return draw_charts(
        [make_chart("", _full_axis("x", along, primary.x * mm), make_axis("height", up), marks)],
        height=2.7,
    )


def draw_roughness(roughness, ends: tuple, cutoff: float) -> str:
    """Draw a roughness profile with its sections.

    Parameters
    ----------
    roughness : Profile
    ends : tuple [m]
        First and last position of the trace.
    cutoff : float [m]
        Length of a section.

    Returns
    -------
    str
        The picture as SVG.
    """
    along, mm = choose_axis_unit(ends, "m")
    up, um = choose_axis_unit(roughness.z, "m")
    marks = [
        make_line(roughness.x * mm, roughness.z * um, "accent", max_points=MAX_POINTS, width=0.7)
    ]
    count = roughness.length / cutoff
    if count < MAX_SECTION_RULES:
        places = roughness.x[0] + cutoff * np.arange(int(count + 1e-6) + 1)
        marks += [make_mark("rule", "soft", x=place * mm, dash="dotted") for place in places]
    return draw_charts(
        [
            make_chart(
                "", _full_axis("x", along, np.array(ends) * mm), make_axis("roughness", up), marks
            )
        ],
        height=2.4,
    )


def abbott_core_chart(heights: Heights, names: tuple = ("Mr1", "Mr2")) -> dict:
    """Chart an Abbott curve with the straight line of its core.

    names: names of the two material ratios at the ends of the core.
    """
    ratio, height = abbott_curve(heights)
    core = heights.core
    up, um = choose_axis_unit(height, "m")
    marks = [make_line(100 * ratio, height * um, "accent")]
    if core is not None:
        bottom = core.top - core.height
        marks.append(
            make_line([0, 100], [core.top * um, bottom * um], "warm", width=1.2, dash="dashed")
        )
        ends = ((core.first_ratio, core.top, "circle"), (core.second_ratio, bottom, "square"))
        for name, (place, level_of_end, shape) in zip(names, ends):
            label = f"{name} {100 * place:.1f} %"
            marks.append(
                make_mark(
                    "dots", "warm", label, x=[100 * place], y=[level_of_end * um], shape=shape
                )
            )
    return make_chart(
        "Abbott curve", _full_axis("material ratio", "%", [0, 100]), make_axis("height", up), marks
    )


def draw_statistics(heights: Heights, spectrum: Spectrum, band: tuple, cutoff: float | None) -> str:
    """Draw an Abbott curve with its core, and a spectrum with its 95 % band.

    Parameters
    ----------
    heights : Heights
    spectrum : Spectrum
    band : tuple [m]
        Wavelengths that are marked.
    cutoff : float or None [m]
        Cut-off that is marked.

    Returns
    -------
    str
        The picture as SVG.
    """
    left = abbott_core_chart(heights)
    title = "Power spectral density"
    if not spectrum.density.any():
        return draw_charts(
            [
                left,
                make_chart(
                    f"{title}: the trace is flat", make_axis("wavelength"), make_axis("density"), []
                ),
            ]
        )
    name, scale = _wavelength_unit(spectrum)
    marks = _density_marks(spectrum, scale, "accent", band="95 % band")
    waves = marks[-1]["x"]
    if band[1] > 1 / spectrum.frequency[-1] and band[0] < 1 / spectrum.frequency[0]:
        marks.append(
            make_mark(
                "span",
                "soft",
                "wavelengths of band_amplitude",
                left=band[0] * scale,
                right=band[1] * scale,
            )
        )
    if spectrum.dominant_wavelength is not None:
        marks.append(
            make_mark(
                "rule",
                "warm",
                "dominant wavelength",
                x=spectrum.dominant_wavelength * scale,
                dash="dashed",
            )
        )
    if cutoff is not None:
        marks.append(make_mark("rule", GREY, "cut-off", x=cutoff * scale, dash="dotted"))
    wavelength = make_axis("wavelength", name, True) | {"range": [waves.min(), waves.max()]}
    return draw_charts(
        [left, make_chart(title, wavelength, make_axis("density", "um$^3$", True), marks)]
    )


def _full_axis(label: str, unit: str, x) -> dict:
    """Return a chart axis that extends from the first to the last position."""
    return make_axis(label, unit) | {"range": [x[0], x[-1]]}


def depth_axis(unit: str, depth, scale: float) -> dict:
    """Return an axis of depths that points down.

    Parameters
    ----------
    unit : str
    depth : sequence of float [m]
        Depths that the axis covers.
    scale : float
        From metres to the unit.
    """
    margin = 0.05 * float(np.ptp(depth))
    return make_axis("worn depth", unit) | {
        "range": [(np.max(depth) + margin) * scale, (np.min(depth) - margin) * scale]
    }


def _wavelength_unit(spectrum: Spectrum) -> tuple:
    """Return the unit of wavelengths of a spectrum and its scale."""
    return choose_axis_unit([1 / spectrum.frequency[0] / 4], "m")


def _density_marks(
    spectrum: Spectrum, scale: float, colour: str, name: str = "", band: str = ""
) -> list:
    """Return the chart marks of a spectrum as a function of wavelength, and of its 95 % band."""
    low, high = spectrum.band()
    shown = np.geomspace(1, spectrum.frequency.size, MAX_SPECTRUM_POINTS)
    shown = np.unique(np.round(shown).astype(int)) - 1
    shown = shown[spectrum.density[shown] > 0]
    waves = scale / spectrum.frequency[shown]
    return [
        make_mark(
            "band",
            colour,
            band,
            x=waves,
            low=low[shown] * UM3_PER_M3,
            high=high[shown] * UM3_PER_M3,
        ),
        make_line(waves, spectrum.density[shown] * UM3_PER_M3, colour, name, width=1.0),
    ]


@returns_svg
def draw_scan(x, y, z):
    """Draw the heights of a levelled scan and their distribution.

    Parameters
    ----------
    x, y : (n,), (m,) arrays [m]
    z : (m, n) array [m]

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure, (left, right) = make_figure(2, 3.8, width_ratios=(1.2, 1))
    finite_heights = z[~np.isnan(z)]
    _draw_map(figure, left, (x, y, z), np.quantile(finite_heights, COLOUR_QUANTILES), "viridis")
    left.set(title="Heights")
    up, um = choose_axis_unit(z, "m")
    right.hist(
        finite_heights * um,
        bins=N_BINS,
        color=BLUE,
        weights=np.full(finite_heights.size, 100 / finite_heights.size),
    )
    right.set(
        xlabel=f"height [{up}]",
        ylabel="share of the points [%]",
        title="Distribution of the heights",
    )
    return figure


@returns_svg
def draw_maps(x, y, heights: tuple):
    """Draw the scan before, the scan after and the worn depth side by side.

    Parameters
    ----------
    x, y : (n,), (m,) arrays [m]
    heights : three (m, n) arrays [m]

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure, panels = make_figure(3, float(np.clip(0.8 + 2.6 * np.ptp(y) / np.ptp(x), 1.6, 6.0)))
    before, after, depth = heights
    ends = np.quantile(before[~np.isnan(before)], COLOUR_QUANTILES)
    _draw_map(figure, panels[0], (x, y, before), ends, "viridis")
    _draw_map(figure, panels[1], (x, y, after), ends, "viridis")
    max_depth = np.nanquantile(np.abs(depth), COLOUR_QUANTILES[1])
    _draw_map(figure, panels[2], (x, y, depth), (-max_depth, max_depth), "RdBu_r", name="depth")
    for panel, title in zip(panels, ("before", "after", "worn depth")):
        panel.set(title=title)
    return figure


def _draw_map(figure, panel, scan: tuple, ends: tuple, colours: str, name: str = "height") -> None:
    """Draw the heights of a scan as a coloured map on matplotlib Axes.

    `scan` is (x, y, z) [m], and `ends` [m] are the heights at the ends of the colour scale.
    """
    x, y, z = scan
    along, mm = choose_axis_unit(np.concatenate([x, y]), "m")
    up, um = choose_axis_unit(ends, "m")
    rows, columns = (slice(None, None, max(1, count // MAX_PIXELS)) for count in z.shape)
    mesh = panel.pcolormesh(
        x[columns] * mm,
        y[rows] * mm,
        z[rows, columns] * um,
        cmap=colours,
        vmin=ends[0] * um,
        vmax=ends[1] * um,
        rasterized=True,
        shading="nearest",
    )
    figure.colorbar(mesh, ax=panel, label=f"{name} [{up}]", extend="both", fraction=0.05, pad=0.02)
    panel.set(xlabel=f"x [{along}]", ylabel=f"y [{along}]", aspect="equal")
    panel.grid(False)


def draw_both_heights(heights: tuple) -> str:
    """Draw the distributions and the Abbott curves of the heights (k,) [m] before and after."""
    all_heights = np.concatenate(heights)
    up, um = choose_axis_unit(all_heights, "m")
    edges = np.linspace(*np.quantile(all_heights, (0.001, 0.999)), N_BINS + 1)
    middles = (edges[:-1] + edges[1:]) / 2 * um
    bars = []
    for z, (colour, name) in zip(heights, SIDES):
        percent = np.histogram(z, edges)[0] * 100 / z.size
        bars.append(make_line(middles, percent, colour, name, width=1.2))
    return draw_charts(
        [
            make_chart(
                "Heights", make_axis("height", up), make_axis("share of the points", "%"), bars
            ),
            _abbott_chart(heights),
        ]
    )


def _abbott_chart(heights: tuple) -> dict:
    """Chart the Abbott curves of heights (k,) [m] before and after."""
    curves = [abbott_curve(Heights(z, 1.0)) for z in heights]
    up, um = choose_axis_unit(np.concatenate([height for _, height in curves]), "m")
    lines = []
    for (ratio, height), (colour, name) in zip(curves, SIDES):
        lines.append(make_line(100 * ratio, height * um, colour, name))
    return make_chart(
        "Abbott curves", _full_axis("material ratio", "%", [0, 100]), make_axis("height", up), lines
    )


def draw_mean_section(track, start: float, end: float) -> str:
    """Draw the mean cross-section of a track with its scatter.

    Parameters
    ----------
    track : ScanTrack
        With `across`, `section` and `spread` (n,) [m].
    start, end : float [m]
        Where the track begins and ends.

    Returns
    -------
    str
        The picture as SVG.
    """
    is_finite = np.isfinite(track.section)
    x = track.across[is_finite]
    depth = track.section[is_finite]
    spread = track.spread[is_finite]
    along, mm = choose_axis_unit(x, "m")
    up, um = choose_axis_unit(depth, "m")
    low = depth - spread
    high = depth + spread
    marks = [
        make_mark(
            "band", "soft", "scatter of the sections", x=x * mm, low=low * um, high=high * um
        ),
        make_line(x * mm, depth * um, "warm", "mean", max_points=MAX_POINTS, width=1.2),
        make_line(x[[0, -1]] * mm, [0.0, 0.0], GREY, width=0.8),
    ]
    marks += [make_mark("rule", GREY, x=place * mm, dash="dotted") for place in (start, end)]
    down = depth_axis(up, [low.min(), high.max()], um)
    return draw_charts(
        [make_chart("", _full_axis("across the track", along, x * mm), down, marks)], height=2.7
    )


def draw_aligned(x, first, second, worn_depth) -> str:
    """Draw two aligned traces, and an enlarged view of the largest wear.

    Parameters
    ----------
    x : (n,) array [m]
    first, second : (n,) arrays [m]
        Heights before and after.
    worn_depth : (n,) array [m]
        Worn depth, 0 where nothing wore off.

    Returns
    -------
    str
        The picture as SVG.
    """
    along, mm = choose_axis_unit(x, "m")
    up, um = choose_axis_unit(np.concatenate([first, second]), "m")
    marks = []
    for z, (colour, name) in zip((first, second), SIDES):
        marks.append(make_line(x * mm, z * um, colour, name, max_points=MAX_POINTS, width=1.0))
    bottom = np.where(worn_depth > 0, second, np.nan)
    marks.append(make_mark("band", "warm", "worn off", x=x * mm, low=bottom * um, high=first * um))
    ends = _detail_ends(x, worn_depth)
    inside = (x >= ends[0]) & (x <= ends[1])
    detail = np.concatenate([first[inside], second[inside]]) * um
    height_range = np.ptp(detail)
    label = "x of the second trace"
    height = make_axis("height", up)
    detail_height = height | {
        "range": [detail.min() - 0.1 * height_range, detail.max() + 0.15 * height_range]
    }
    traces_chart = make_chart("Both traces", _full_axis(label, along, x * mm), height, marks)
    detail_chart = make_chart(
        "A part of them", _full_axis(label, along, ends * mm), detail_height, marks
    )
    return draw_charts([traces_chart, detail_chart], height=3.4)


def _detail_ends(x, worn_depth) -> np.ndarray:
    """Choose the ends [m] of the enlarged part: a sixth of the traces around the largest wear."""
    half = max((x[-1] - x[0]) / 12, MIN_DETAIL_SAMPLES / 4 * (x[1] - x[0]))
    half = min(half, (x[-1] - x[0]) / 2)
    centre = float(np.clip(x[int(np.argmax(worn_depth))], x[0] + half, x[-1] - half))
    return np.array([centre - half, centre + half])


def draw_separate(before, after) -> str:
    """Draw two traces that have no part in common, one above the other."""
    flat = [level(resample_evenly(profile)) for profile in (before, after)]
    along, mm = choose_axis_unit(
        np.concatenate([profile.x - profile.x[0] for profile in flat]), "m"
    )
    up, um = choose_axis_unit(np.concatenate([profile.z for profile in flat]), "m")
    lift = 1.1 * (np.ptp(flat[1].z) / 2 + np.ptp(flat[0].z) / 2)
    marks = []
    for profile, shift, (colour, name) in zip(flat, (lift, 0.0), SIDES):
        x = (profile.x - profile.x[0]) * mm
        marks.append(
            make_line(x, (profile.z + shift) * um, colour, name, max_points=MAX_POINTS, width=0.8)
        )
    return draw_charts(
        [
            make_chart(
                "", make_axis("along the trace", along), make_axis("height, shifted", up), marks
            )
        ],
        height=3.4,
    )


def draw_depth(x, depth, used=None, ends: tuple | None = None) -> str:
    """Draw the depth of the second trace below its reference.

    Parameters
    ----------
    x, depth : (n,) arrays [m]
    used : (n,) bool array, optional
        Unworn heights that the alignment used.
    ends : tuple, optional
        Where the track begins and ends [m].

    Returns
    -------
    str
        The picture as SVG.
    """
    along, mm = choose_axis_unit(x, "m")
    up, um = choose_axis_unit(depth, "m")
    marks = [
        make_line(
            x * mm,
            depth * um,
            "warm",
            "depth of the second trace",
            max_points=MAX_POINTS,
            width=1.0,
        ),
        make_line(x[[0, -1]] * mm, [0.0, 0.0], GREY, width=0.8),
    ]
    if used is not None:
        name = "unworn heights, used for the alignment"
        marks.append(
            make_mark("dots", "accent", name, x=x[used] * mm, y=depth[used] * um, size=1.5)
        )
    if ends is not None:
        marks.append(make_mark("span", "soft", "track", left=ends[0] * mm, right=ends[1] * mm))
    place = _full_axis("x of the second trace", along, x * mm)
    return draw_charts([make_chart("", place, depth_axis(up, depth, um), marks)], height=2.5)


def draw_both_statistics(heights: tuple, spectra: tuple, band: tuple) -> str:
    """Draw the Abbott curves and the spectra with their 95 % bands, before and after.

    Parameters
    ----------
    heights : two (k,) arrays [m]
    spectra : two Spectrum
    band : tuple [m]
        Wavelengths of the amplitude ratio.

    Returns
    -------
    str
        The picture as SVG.
    """
    unit, scale = _wavelength_unit(spectra[0])
    marks = []
    for spectrum, (colour, name) in zip(spectra, SIDES):
        marks += _density_marks(spectrum, scale, colour, name)
    marks.append(
        make_mark(
            "span",
            "warm",
            "band of the amplitude ratio",
            left=band[0] * scale,
            right=band[1] * scale,
        )
    )
    density = make_axis("density", "um$^3$", True)
    right = make_chart(
        "Power spectral density, 95 % bands", make_axis("wavelength", unit, True), density, marks
    )
    return draw_charts([_abbott_chart(heights), right])


def draw_directions(parts: list, directions: list) -> str:
    """Draw the spectra along x and y, and the ratios of x to y with their intervals.

    directions: (when, amplitude ratio, slope ratio) each.
    """
    unit, scale = _wavelength_unit(parts[0].ratios.sizes[0].spectrum)
    curves = []
    for part, colour in zip(parts, ("accent", "warm")):
        for size, when, dash in zip(part.ratios.sizes, ("before", "after"), ("dashed", "solid")):
            *_, curve = _density_marks(size.spectrum, scale, colour, f"{part.direction} {when}")
            curves.append(curve | {"dash": dash})
    bars = [(f"amplitude\n{when}", amplitude) for when, amplitude, _ in directions]
    bars += [(f"slope\n{when}", slope) for when, _, slope in directions]
    marks = [make_line([0.5, len(bars) + 0.5], [1.0, 1.0], GREY, width=0.8)]
    for place, (_, ratio) in enumerate(bars, 1):
        if ratio.value is not None:
            marks.append(make_line([place, place], [ratio.low, ratio.high], "accent"))
            marks.append(make_mark("dots", "accent", x=[place], y=[ratio.value]))
    ticks = [(place, label) for place, (label, _) in enumerate(bars, 1)]
    places = make_axis("") | {"range": [0.5, len(bars) + 0.5], "ticks": ticks}
    density = make_axis("density", "um$^3$", True)
    left = make_chart(
        "Power spectral density", make_axis("wavelength", unit, True), density, curves
    )
    return draw_charts([left, make_chart("x over y", places, make_axis("ratio"), marks)])


class PairsPanel(NamedTuple):
    """Quantity of each pair by the line of the pair in its table, and the mean over the pairs."""

    title: str
    values: dict
    mean: Quantity


def draw_pairs(panels: list) -> str:
    """Draw the quantities of all pairs with intervals and means; panels: list of PairsPanel."""
    charts = []
    for panel in panels:
        mean = panel.mean
        known_values = {
            number: value for number, value in panel.values.items() if value.value is not None
        }
        bounds = []
        for value in known_values.values():
            bounds += [bound for bound in (value.low, value.high) if bound is not None]
        unit, scale = ("", 1.0) if mean.unit == "1" else choose_axis_unit(bounds, mean.unit)
        ends = np.array([min(panel.values) - 0.5, max(panel.values) + 0.5])
        low, middle, high = (
            np.full(2, value * scale) for value in (mean.low, mean.value, mean.high)
        )
        marks = [
            make_mark("band", "soft", "mean", x=ends, low=low, high=high),
            make_line(ends, middle, "soft"),
        ]
        for number, value in known_values.items():
            if value.high is not None:
                bar = [value.low * scale, value.high * scale]
                marks.append(make_line([number, number], bar, "accent", width=1.0))
        heights = np.array([value.value * scale for value in known_values.values()])
        marks.append(
            make_mark(
                "dots",
                "accent",
                "each pair",
                x=np.array([*known_values], float),
                y=heights,
                size=4.0,
            )
        )
        place = make_axis("line number in the table") | {"range": ends}
        charts.append(make_chart(panel.title, place, make_axis("", unit), marks))
    return draw_charts(charts, height=2.7)


class PressedSide(NamedTuple):
    """Normal stress (n,) [Pa] over x (n,) [m] with the surface "before" or "after"."""

    x: np.ndarray
    stress: np.ndarray
    name: str


def draw_pressures(sides: list) -> str:
    """Draw the normal stress of the patch with each surface; sides: list of PressedSide."""
    along, mm = choose_axis_unit(sides[0].x, "m")
    unit, scale = choose_axis_unit(np.concatenate([side.stress for side in sides]), "Pa")
    max_stress = 1.05 * max(float(side.stress.max()) for side in sides) * scale
    colours = {name: colour for colour, name in SIDES}
    charts = []
    for side in sides:
        x = side.x * mm
        stress = side.stress * scale
        colour = colours[side.name]
        marks = [
            make_mark("band", colour, x=x, low=0 * x, high=stress),
            make_line(x, stress, colour, width=0.9),
        ]
        up = make_axis("normal stress", unit) | {"range": [0.0, max_stress]}
        charts.append(
            make_chart(
                f"Pressure with the surface {side.name}", _full_axis("x", along, x), up, marks
            )
        )
    return draw_charts(charts, height=2.9)
