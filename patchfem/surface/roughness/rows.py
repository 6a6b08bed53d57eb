"""Parameters of traces and scans as rows of one table: a new parameter is a new row.

The same functions serve the primary profile, whose names begin with P, and the roughness profile,
whose names begin with R.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .areal import aspect_ratio, autocorrelation_length, developed_area_ratio, rms_gradient
from .parameters import (
    Heights,
    kurtosis,
    material_volume,
    mean_absolute,
    mean_element_height,
    mean_over_sections,
    mean_spacing,
    peak_to_valley,
    rms_slope,
    root_mean_square,
    skewness,
    total_height,
    void_volume,
)
from .spectrum import estimate_spectrum

PEAK_RATIO = 0.1  # material ratio above which the material belongs to the peaks (ISO 25178-3)
VALLEY_RATIO = 0.8  # material ratio below which the void belongs to the valleys (ISO 25178-3)


class Parameter(NamedTuple):
    """Definition of a roughness parameter of a trace or a scan.

    compute: function of `Heights`, or of a scan's `Surface`; None if it needs more. kind of its
    interval (`intervals`): "power", "slope" and "band" by degrees of freedom of the spectrum,
    "ratio", "shift", "fraction", "wave" and "extreme" by simulated traces, "" for none.
    """

    name: str
    unit: str
    text: str
    compute: Callable | None
    kind: str = ""


def _read_core(field: str) -> Callable:
    return lambda heights: None if heights.core is None else getattr(heights.core, field)


def _highest_peak(heights: Heights) -> float | None:
    return mean_over_sections(heights, lambda z: z.max(axis=1))


def _deepest_valley(heights: Heights) -> float | None:
    return mean_over_sections(heights, lambda z: -z.min(axis=1))


def _mean_of_five_parts(heights: Heights) -> float:
    edges = np.linspace(0, heights.z.size, 6).astype(int)
    return float(np.mean([np.ptp(heights.z[low:high]) for low, high in pairwise(edges)]))


_BASE = (  # names without the letter of their profile
    Parameter("a", "m", "mean of the absolute heights about the mean line", mean_absolute, "ratio"),
    Parameter(
        "q", "m", "root mean square of the heights about the mean line", root_mean_square, "power"
    ),
    Parameter("p", "m", "height of the highest peak above the mean line", _highest_peak, "ratio"),
    Parameter(
        "v", "m", "depth of the deepest valley below the mean line", _deepest_valley, "ratio"
    ),
    Parameter(
        "z", "m", "height from the deepest valley to the highest peak", peak_to_valley, "ratio"
    ),
    Parameter(
        "t",
        "m",
        "height from the deepest valley to the highest peak of the whole trace",
        total_height,
        "extreme",
    ),
    Parameter(
        "sk",
        "1",
        "skewness: mean cube of the heights over the cube of their root mean square",
        skewness,
        "shift",
    ),
    Parameter(
        "ku",
        "1",
        "kurtosis: mean fourth power of the heights over the fourth power of their root mean "
        "square, 3 for a Gaussian surface",
        kurtosis,
        "ratio",
    ),
    Parameter(
        "Sm",
        "m",
        "mean length of a hill together with the neighbouring dale; hills and dales lower than 10 "
        "% of the height from the deepest valley to the highest peak do not count; if a cut-off is "
        "given, hills and dales narrower than 1 % of the cut-off do not count either",
        mean_spacing,
        "ratio",
    ),
    Parameter(
        "dq",
        "1",
        "root mean square of the slope between neighbouring samples (two points)",
        rms_slope,
        "slope",
    ),
    Parameter(
        "k",
        "m",
        "core height: drop, from 0 to 100 %, of the straight line through the flattest 40 % of the "
        "Abbott curve",
        _read_core("height"),
        "ratio",
    ),
    Parameter(
        "pk",
        "m",
        "reduced peak height: height of a triangle on the base Mr1 with the area of the peaks "
        "above the core",
        _read_core("peak_height"),
        "ratio",
    ),
    Parameter(
        "vk",
        "m",
        "reduced valley depth: height of a triangle on the base 1 - Mr2 with the area of the "
        "valleys below the core",
        _read_core("valley_depth"),
        "ratio",
    ),
    Parameter(
        "Mr1",
        "1",
        "fraction of the length of the trace where the surface lies above the core",
        _read_core("first_ratio"),
        "fraction",
    ),
    Parameter(
        "Mr2",
        "1",
        "fraction of the length of the trace where the surface lies above the bottom of the core",
        _read_core("second_ratio"),
        "fraction",
    ),
    Parameter(
        "c",
        "m",
        "mean height difference between a hill and the neighbouring dale, for the hills and dales "
        "that count for the mean spacing",
        mean_element_height,
        "ratio",
    ),
)


def _name_primary(row: Parameter) -> Parameter:
    """Return the definition of a parameter for the primary profile."""
    kind = "extreme" if row.name in ("p", "v") else row.kind
    return row._replace(name=f"P{row.name}", text=f"{row.text}, of the levelled trace", kind=kind)


def _name_roughness(row: Parameter) -> Parameter:
    """Return the definition of a parameter for the roughness profile."""
    mean = ", mean over the sections of one cut-off" if row.name in ("p", "v", "z") else ""
    name = row.name if row.name.startswith("Mr") else f"R{row.name}"
    return row._replace(name=name, text=f"{row.text}{mean}, of the roughness profile")


PRIMARY = tuple(_name_primary(row) for row in _BASE if row.name != "z")
ROUGH = tuple(_name_roughness(row) for row in _BASE)
WAVES = (
    Parameter(
        "dominant_wavelength",
        "m",
        "wavelength of the octave with the largest mean square height, of the levelled trace",
        lambda heights: estimate_spectrum(heights.z, heights.step).dominant_wavelength,
        "wave",
    ),
    Parameter(
        "band_amplitude",
        "m",
        "amplitude of a sine with the same mean square as the waves of the band, of the levelled "
        "trace",
        None,
        "band",
    ),
)
WINDOW = (
    Parameter(
        "RzDin",
        "m",
        "height from the deepest valley to the highest peak, mean over five equal parts of the "
        "window (DIN 4768), of the levelled trace",
        _mean_of_five_parts,
        "ratio",
    ),
    Parameter(
        "MaxDev",
        "m",
        "largest distance from the mean line to either side, of the levelled trace",
        lambda heights: float(np.abs(heights.z).max()),
        "extreme",
    ),
    Parameter(
        "ASH",
        "m",
        "average step height: height of the last sample of the window minus the height of the "
        "first, before levelling",
        None,
    ),
)


def _make_distribution_row(name: str, unit: str, text: str, compute: Callable) -> Parameter:
    """Return the definition of an areal parameter that depends on the heights alone."""
    return Parameter(name, unit, text, lambda surface: compute(surface.heights))


AREAL = (
    _make_distribution_row(
        "Sa", "m", "mean of the absolute heights about the reference surface", mean_absolute
    ),
    _make_distribution_row(
        "Sq", "m", "root mean square of the heights about the reference surface", root_mean_square
    ),
    _make_distribution_row("Ssk", "1", "skewness: mean cube of the heights over Sq^3", skewness),
    _make_distribution_row(
        "Sku",
        "1",
        "kurtosis: mean fourth power of the heights over Sq^4, 3 for a Gaussian surface",
        kurtosis,
    ),
    _make_distribution_row(
        "Sp", "m", "height of the highest point above the reference surface", _highest_peak
    ),
    _make_distribution_row(
        "Sv", "m", "depth of the lowest point below the reference surface", _deepest_valley
    ),
    _make_distribution_row("Sz", "m", "height from the lowest to the highest point", total_height),
    Parameter(
        "Sdq",
        "1",
        "root mean square gradient, from the slopes between neighbouring points along x and along "
        "y",
        rms_gradient,
    ),
    Parameter(
        "Sdr",
        "1",
        "developed area divided by projected area, minus one; the area of a cell of four points is "
        "the mean over the two ways to split the cell into triangles",
        developed_area_ratio,
    ),
    Parameter(
        "Sal",
        "m",
        "autocorrelation length: shortest distance at which the autocorrelation falls to 0.2",
        autocorrelation_length,
    ),
    Parameter(
        "Str",
        "1",
        "texture aspect ratio: Sal divided by the longest distance at which the autocorrelation "
        "falls to 0.2; 1 if isotropic",
        aspect_ratio,
    ),
    _make_distribution_row(
        "Sk",
        "m",
        "core height: drop, from 0 to 100 %, of the least-squares line through the flattest 40 % "
        "of the Abbott curve",
        _read_core("height"),
    ),
    _make_distribution_row(
        "Spk",
        "m",
        "reduced peak height: height of a triangle on the base Smr1 with the volume of the peaks "
        "above the core",
        _read_core("peak_height"),
    ),
    _make_distribution_row(
        "Svk",
        "m",
        "reduced valley depth: height of a triangle on the base 1 - Smr2 with the volume of the "
        "valleys below the core",
        _read_core("valley_depth"),
    ),
    _make_distribution_row(
        "Smr1",
        "1",
        "fraction of the area where the surface lies above the core",
        _read_core("first_ratio"),
    ),
    _make_distribution_row(
        "Smr2",
        "1",
        "fraction of the area where the surface lies above the bottom of the core",
        _read_core("second_ratio"),
    ),
    _make_distribution_row(
        "Vmp",
        "m",
        "volume of the peaks per area: material above the material ratio 10 %",
        lambda heights: material_volume(heights, PEAK_RATIO),
    ),
    _make_distribution_row(
        "Vmc",
        "m",
        "volume of the core's material per area: between the material ratios 10 % and 80 %",
        lambda heights: (
            material_volume(heights, VALLEY_RATIO) - material_volume(heights, PEAK_RATIO)
        ),
    ),
    _make_distribution_row(
        "Vvc",
        "m",
        "volume of the core's void per area: between the material ratios 10 % and 80 %",
        lambda heights: void_volume(heights, PEAK_RATIO) - void_volume(heights, VALLEY_RATIO),
    ),
    _make_distribution_row(
        "Vvv",
        "m",
        "volume of the valleys' void per area: below the material ratio 80 %",
        lambda heights: void_volume(heights, VALLEY_RATIO),
    ),
)
TABLE = {row.name: row for row in (*PRIMARY, *ROUGH, *WAVES, *WINDOW, *AREAL)}
