"""Parameters of traces and scans as rows of one table: a new parameter is a new row.

A row has a name, a unit, a definition in one sentence, its function and the kind of its interval. The same functions
serve the primary profile, whose names begin with P, and the roughness profile, whose names begin with R.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .areal import aspect, developed, direction, gradient, shortest
from .parameters import (
    Heights,
    height_at,
    material_ratio,
    mean_element,
    mean_spacing,
    moment,
    of_sections,
    peak_to_valley,
    ratio_heights,
    root_mean_square,
    volume,
)
from .spectrum import spectrum_of


class Parameter(NamedTuple):
    """One parameter of a trace or of a scan.

    of: its function of `Heights`, or of a scan's `Surface`, None where it is not read off them alone; kind of its
    interval (`intervals`): "power", "slope" and "band" by degrees of freedom of the spectrum, "ratio", "shift",
    "share", "wave" and "extreme" by made traces of that spectrum, "" for none. {level}, {first} and {second} in the
    text stand for what `Heights` has.
    """

    name: str
    unit: str
    text: str
    of: Callable | None
    kind: str


def _core(part: str) -> Callable:
    return lambda heights: None if heights.core is None else getattr(heights.core, part)


def _slope(heights: Heights) -> float:
    rise = np.diff(heights.z)
    return float(np.sqrt(rise @ rise / rise.size) / heights.step)


def _five_parts(heights: Heights) -> float:
    edges = np.linspace(0, heights.z.size, 6).astype(int)
    return float(np.mean([np.ptp(heights.z[a:b]) for a, b in pairwise(edges)]))


_BASE = (  # name without its letter
    ("a", "m", "mean of the absolute heights about the mean line", lambda heights: float(np.abs(heights.z).mean()),
     "ratio"),
    ("q", "m", "root mean square of the heights about the mean line", root_mean_square, "power"),
    ("p", "m", "height of the highest peak above the mean line",
     lambda heights: of_sections(heights, lambda z: z.max(axis=1)), "ratio"),
    ("v", "m", "depth of the deepest valley below the mean line",
     lambda heights: of_sections(heights, lambda z: -z.min(axis=1)), "ratio"),
    ("z", "m", "height from the deepest valley to the highest peak", peak_to_valley, "ratio"),
    ("t", "m", "height from the deepest valley to the highest peak of the whole trace",
     lambda heights: float(heights.z.max() - heights.z.min()), "extreme"),
    ("sk", "1", "skewness: mean cube of the heights over the cube of their root mean square",
     lambda heights: moment(heights, 3), "shift"),
    ("ku", "1", "kurtosis: mean fourth power of the heights over the fourth power of their root mean square, 3 for a "
                "Gaussian surface", lambda heights: moment(heights, 4), "ratio"),
    ("Sm", "m", "mean length of a hill together with the neighbouring dale; hills and dales lower than 10 % of the "
                "height from the deepest valley to the highest peak do not count; if a cut-off is given, hills and "
                "dales narrower than 1 % of the cut-off do not count either", mean_spacing, "ratio"),
    ("dq", "1", "root mean square of the slope between neighbouring samples (two points)", _slope, "slope"),
    ("k", "m", "core height: drop, from 0 to 100 %, of the straight line through the flattest 40 % of the Abbott curve",
     _core("core"), "ratio"),
    ("pk", "m", "reduced peak height: height of a triangle on the base Mr1 with the area of the peaks above the core",
     _core("peaks"), "ratio"),
    ("vk", "m", "reduced valley depth: height of a triangle on the base 1 - Mr2 with the area of the valleys below "
                "the core",
     _core("valleys"), "ratio"),
    ("Mr1", "1", "fraction of the length of the trace where the surface lies above the core", _core("first"), "share"),
    ("Mr2", "1", "fraction of the length of the trace where the surface lies above the bottom of the core",
     _core("second"), "share"),
    ("c", "m", "mean height difference between a hill and the neighbouring dale, for the hills and dales that count "
               "for the mean spacing", mean_element,
     "ratio"),
    ("mr", "1", "material ratio: fraction of the length of the trace where the surface lies above the level {level}, "
                "measured "
                "from the mean line", material_ratio,
     "share"),
    ("dc", "m", "height difference between the levels with material ratios {second} and "
                "{first}", ratio_heights, "ratio"),
)
_WHOLE = {"p", "v"}  # of the primary profile: over the whole trace, so extremes
PRIMARY = tuple(Parameter("P" + name, unit, text + ", of the levelled trace", of, "extreme" if name in _WHOLE else kind)
                for name, unit, text, of, kind in _BASE if name != "z")
_MEAN = {"p", "v", "z"}
ROUGH = tuple(Parameter(name if name.startswith("Mr") else "R" + name, unit,
                        text + (", mean over the sections of one cut-off" if name in _MEAN else "")
                        + ", of the roughness profile", of, kind) for name, unit, text, of, kind in _BASE)
WAVES = (
    Parameter("dominant_wavelength", "m", "wavelength of the octave with the largest mean square height, of the "
              "levelled trace", lambda heights: spectrum_of(heights.z, heights.step).dominant, "wave"),
    Parameter("band_amplitude", "m", "amplitude of a sine with the same mean square as the waves of the band, of the "
              "levelled trace", None, "band"),
)
WINDOW = (
    Parameter("RzDin", "m", "height from the deepest valley to the highest peak, mean over five equal parts of the "
              "window (DIN 4768), of the levelled trace", _five_parts, "ratio"),
    Parameter("MaxDev", "m", "largest distance from the mean line to either side, of the levelled trace",
              lambda heights: float(np.abs(heights.z).max()), "extreme"),
    Parameter("ASH", "m", "average step height: height of the last sample of the window minus the height of the first, "
                          "before levelling",
              None, ""),
)


def _all(of: Callable, *more) -> Callable:
    """A function of heights, read off all those of a scan."""
    return lambda surface: of(surface.heights, *more)


AREAL = (
    Parameter("Sa", "m", "mean of the absolute heights about the reference surface",
              _all(lambda heights: float(np.abs(heights.z).mean())), "power"),
    Parameter("Sq", "m", "root mean square of the heights about the reference surface", _all(root_mean_square),
              "power"),
    Parameter("Ssk", "1", "skewness: mean cube of the heights over Sq^3", _all(moment, 3), "shift"),
    Parameter("Sku", "1", "kurtosis: mean fourth power of the heights over Sq^4, 3 for a Gaussian surface",
              _all(moment, 4), "shift"),
    Parameter("Sp", "m", "height of the highest point above the reference surface",
              _all(lambda heights: float(heights.z.max())), ""),
    Parameter("Sv", "m", "depth of the lowest point below the reference surface",
              _all(lambda heights: float(-heights.z.min())), ""),
    Parameter("Sz", "m", "height from the lowest to the highest point", _all(lambda heights: float(np.ptp(heights.z))),
              ""),
    Parameter("Sdq", "1", "root mean square gradient, from the slopes between neighbouring points along x and along "
                          "y", gradient, ""),
    Parameter("Sdr", "1", "developed area divided by projected area, minus one; the area of a cell of four points is "
                          "the mean over the two ways to split the cell into triangles", developed, ""),
    Parameter("Sal", "m", "autocorrelation length: shortest distance at which the autocorrelation falls to 0.2",
              shortest, ""),
    Parameter("Str", "1", "texture aspect ratio: Sal divided by the longest distance at which the autocorrelation "
                          "falls to 0.2; 1 if isotropic", aspect, ""),
    Parameter("Std", "rad", "texture direction: angle from x, anticlockwise, of the waves with the most power; the lay "
                            "is at right angles to it", direction, ""),
    Parameter("Sk", "m", "core height: drop, from 0 to 100 %, of the least-squares line through the flattest 40 % of "
              "the Abbott curve", _all(_core("core")), ""),
    Parameter("Spk", "m", "reduced peak height: height of a triangle on the base Smr1 with the volume of the peaks "
                          "above the core",
              _all(_core("peaks")), ""),
    Parameter("Svk", "m", "reduced valley depth: height of a triangle on the base 1 - Smr2 with the volume of the "
              "valleys below the core", _all(_core("valleys")), ""),
    Parameter("Smr1", "1", "fraction of the area where the surface lies above the core", _all(_core("first")), ""),
    Parameter("Smr2", "1", "fraction of the area where the surface lies above the bottom of the core",
              _all(_core("second")), ""),
    Parameter("Vmp", "m", "volume of the peaks per area: material above the material ratio 10 %",
              _all(volume, 0.1, True), ""),
    Parameter("Vmc", "m", "volume of the core's material per area: between the material ratios 10 % and 80 %",
              _all(lambda heights: volume(heights, 0.8, True) - volume(heights, 0.1, True)), ""),
    Parameter("Vvc", "m", "volume of the core's void per area: between the material ratios 10 % and 80 %",
              _all(lambda heights: volume(heights, 0.1, False) - volume(heights, 0.8, False)), ""),
    Parameter("Vvv", "m", "volume of the valleys' void per area: below the material ratio 80 %",
              _all(volume, 0.8, False), ""),
    Parameter("Smr", "1", "material ratio: fraction of the area where the surface lies above the level {level}, "
                          "measured "
                          "from the reference surface",
              _all(material_ratio), ""),
    Parameter("Sxp", "m", "peak extreme height: height difference between the levels with material ratios 50 % and 2.5 "
                          "%",
              _all(lambda heights: height_at(heights, 0.025) - height_at(heights, 0.5)), ""),
    Parameter("Sdc", "m", "height difference between the levels with material ratios {second} and {first}",
              _all(ratio_heights), ""),
)
TABLE = {row.name: row for row in (*PRIMARY, *ROUGH, *WAVES, *WINDOW, *AREAL)}
