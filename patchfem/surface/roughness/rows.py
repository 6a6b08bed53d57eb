"""Parameters of a trace as rows of one table: a new parameter is a new row.

A row has a name, a unit, a definition in one sentence, its function and the kind of its interval. The same functions
serve the primary profile, whose names begin with P, and the roughness profile, whose names begin with R.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .parameters import Heights, mean_spacing, moment, of_sections, peak_to_valley, root_mean_square
from .spectrum import spectrum_of


class Parameter(NamedTuple):
    """One parameter of a trace.

    of: its function of `Heights`, None where it is not read off them alone; kind of its interval (`intervals`):
    "power", "slope" and "band" by degrees of freedom of the spectrum, "ratio", "shift", "share", "wave" and "extreme"
    by made traces of that spectrum, "" for none.
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
    ("ku", "1", "kurtosis: mean fourth power of the heights over that of their root mean square, 3 for a Gaussian "
     "surface", lambda heights: moment(heights, 4), "ratio"),
    ("Sm", "m", "mean length of a hill with its neighbouring dale; those lower than 10 % of the height from valley to "
     "peak or, with a cut-off, narrower than 1 % of it do not count", mean_spacing, "ratio"),
    ("dq", "1", "root mean square of the slope between neighbouring samples (two points)", _slope, "slope"),
    ("k", "m", "core height: fall of the straight line through the flattest 40 % of the Abbott curve, over all of it",
     _core("core"), "ratio"),
    ("pk", "m", "reduced peak height: a triangle over Mr1 with the area of the peaks above the core",
     _core("peaks"), "ratio"),
    ("vk", "m", "reduced valley depth: a triangle over 1 - Mr2 with the area of the valleys below the core",
     _core("valleys"), "ratio"),
    ("Mr1", "1", "share of the length above the core", _core("first"), "share"),
    ("Mr2", "1", "share of the length above the bottom of the core", _core("second"), "share"),
)
_WHOLE = {"p", "v"}  # of the primary profile: over the whole trace, so extremes
PRIMARY = tuple(Parameter("P" + name, unit, text + ", of the levelled trace", of, "extreme" if name in _WHOLE else kind)
                for name, unit, text, of, kind in _BASE if name != "z")
_MEAN = {"p", "v", "z"}
ROUGH = tuple(Parameter(name if name.startswith("Mr") else "R" + name, unit,
                        text + (", mean over the sections of one cut-off" if name in _MEAN else "")
                        + ", of the roughness profile", of, kind) for name, unit, text, of, kind in _BASE)
WAVES = (
    Parameter("dominant_wavelength", "m", "wavelength at which an octave of frequencies holds most height, of the "
              "levelled trace", lambda heights: spectrum_of(heights.z, heights.step).dominant, "wave"),
    Parameter("band_amplitude", "m", "amplitude of the sine with the mean square of the waves of the band, of the "
              "levelled trace", None, "band"),
)
WINDOW = (
    Parameter("RzDin", "m", "height from the deepest valley to the highest peak, mean over five equal parts of the "
              "window (DIN 4768), of the levelled trace", _five_parts, "ratio"),
    Parameter("MaxDev", "m", "largest distance from the mean line to either side, of the levelled trace",
              lambda heights: float(np.abs(heights.z).max()), "extreme"),
    Parameter("ASH", "m", "average step height: height of the window's last sample over its first, before levelling",
              None, ""),
)
AREAL = (
    Parameter("Sa", "m", "mean of the absolute heights about the least-squares plane", None, "power"),
    Parameter("Sq", "m", "root mean square of the heights about the least-squares plane", None, "power"),
    Parameter("Ssk", "1", "skewness: mean cube of the heights over Sq^3", None, "shift"),
    Parameter("Sku", "1", "kurtosis: mean fourth power of the heights over Sq^4, 3 for a Gaussian surface", None,
              "shift"),
    Parameter("Sz", "m", "height from the lowest to the highest point", None, ""),
)
TABLE = {row.name: row for row in (*PRIMARY, *ROUGH, *WAVES, *WINDOW, *AREAL)}
