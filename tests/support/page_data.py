"""Contents of an HTML page: figures with their arrays, measures as numbers, the page without scripts, accessibility."""

import gzip
import json
import re
from base64 import b64decode
from html import unescape
from html.parser import HTMLParser

import numpy as np
import xarray as xr

from patchfem.formatting import UNIT_LADDERS

KINDS = {"f4": np.float32, "i1": np.int8}
# value of each displayed unit in SI units
UNITS = {name: 1 / scale for ladder in UNIT_LADDERS.values() for name, scale in ladder if name}
UNITS |= {"%": 0.01, "deg": np.pi / 180, "Hz": 1.0}


def read_figures(text: str) -> list[dict]:
    """Return the figures of a page: the JSON of plotly.js with its packed arrays as ndarrays."""
    match = re.search(r'<script type="text/plain" id="data">(.*?)</script>', text, re.S)
    return [] if match is None else _unpack(json.loads(gzip.decompress(b64decode(match[1]))))


def _unpack(content):
    """Return JSON content in which packed arrays are ndarrays."""
    if isinstance(content, list):
        return [_unpack(item) for item in content]
    if not isinstance(content, dict):
        return content
    if "bdata" in content:
        values = np.frombuffer(b64decode(content["bdata"]), KINDS[content["dtype"]])
        shape = content.get("shape")
        return values.reshape([int(n) for n in shape.split(",")]) if shape else values
    return {key: _unpack(value) for key, value in content.items()}


def read_charts(text: str) -> dict[str, dict]:
    """Return the figures of a page by title."""
    titles = re.findall(r'<figure id="chart\d+"[^>]*><h2>(.*?)</h2>', text)
    return dict(zip(map(unescape, titles), read_figures(text), strict=True))


def read_measures(text: str) -> dict[str, str]:
    """Return the measures that a page lists, as text by name."""
    rows = re.findall(r'<tr id="measure-(\w+)"><td>.*?</td><td class="v">(.*?)</td>', text, re.S)
    return {name: unescape(value) for name, value in rows}


def read_tiles(text: str) -> dict[str, str]:
    """Return the tiles of a page, as text by label."""
    tiles = re.findall(r'<span class="soft">([^<]*)</span><b>([^<]*)</b>', text)
    return {label: unescape(value) for label, value in tiles}


def parse_quantity(text: str) -> tuple[float, float | None]:
    """Return value and error [SI] of a text such as "14.80 ± 0.05 um" or "(1.0 ± 0.5)e-8 m"; error None without one.

    ValueError if the text has another form.
    """
    match = re.fullmatch(
        r"\(?(-?[\d.]+(?:e-?\d+)?)(?: ± ([\d.]+(?:e-?\d+)?))?\)?(e-?\d+)?(?: (\S.*?))?(?: \(.*\))?",
        text,
    )
    if match is None:
        raise ValueError(f"{text!r} is not a quantity")
    power = float(f"1{match[3]}") if match[3] else 1.0
    unit = UNITS.get(match[4], 1.0) if match[4] else 1.0
    error = None if match[2] is None else float(match[2]) * power * unit
    return float(match[1]) * power * unit, error


def find_wrong_numbers(
    texts: dict[str, str], measures: dict[str, dict], rounding: float = 1e-5
) -> list[str]:
    """Return the displayed numbers that differ from those of summary.json by more than their last digit.

    Parameters
    ----------
    texts : dict
        Displayed quantities by name.
    measures : dict
        Entries of summary.json by name.
    rounding : float
        Relative error by the rounding of numbers without an error.
    """
    wrong = []
    for name, text in texts.items():
        entry = measures[name]
        if entry["value"] is None:
            wrong += [] if text.startswith("-") else [f"{name}: {text}, but null in the file"]
            continue
        value, error = parse_quantity(text)
        tolerance = max(2e-3 * (entry["error"] or 0.0), rounding * abs(entry["value"]))
        tolerance = max(tolerance, 0.06 * (error or 0.0), entry["floor"])
        if entry["error"] is None and None not in (entry["low"], entry["high"]):
            # the last of the two digits of the half-width of an interval
            tolerance = max(tolerance, 0.05 * (entry["high"] - entry["low"]) / 2)
        if abs(value - entry["value"]) > tolerance:
            wrong.append(f"{name}: {text}, but {entry['value']:g} in the file")
        if error is not None and abs(error - entry["error"]) > 0.06 * entry["error"]:
            wrong.append(f"{name}: error of {text}, but {entry['error']:g} in the file")
    return wrong


def find_strange_curves(text: str, path) -> list[str]:
    """Return the charts of a page with a curve whose largest value is in no array, in SI, g or a power of ten of SI units.

    path: the netCDF file. The stress in both pieces is from another file.
    """
    with xr.open_dataset(path) as data:
        arrays = [one for one in data.variables.values() if one.dtype.kind in "fi"]
        numbers = [np.abs(np.ravel(one)) for one in arrays]
    numbers = np.concatenate([one[np.isfinite(one)] for one in numbers])
    scales = [10.0**k for k in range(-12, 13, 3)] + [1 / 9.80665]
    strange = []
    for title, figure in read_charts(text).items():
        for trace in figure["data"] if "von Mises" not in title else ():
            values = np.asarray(trace.get("z", trace["y"]), float)
            # error bands have no text under the pointer
            if not np.isfinite(values).any() or trace.get("hoverinfo") == "skip":
                continue
            largest = np.nanmax(np.abs(values))
            distance = min(np.abs(numbers * scale - largest).min() for scale in scales)
            strange += [title] if distance > 1e-6 * largest else []
    return strange


def strip_scripts(text: str) -> str:
    """Return the page without scripts."""
    return re.sub(r"<script.*?</script>", "", text, flags=re.S)


# attribute that gives an element of each tag its accessible name
ACCESSIBLE_NAMES = {"html": "lang", "img": "alt", "th": "scope", "svg": "aria-label"}


class _AccessibilityParser(HTMLParser):
    """Parser that collects tags without an accessible name in `lacks` and heading levels in `levels`."""

    def __init__(self):
        super().__init__()
        self.lacks = []
        self.levels = []
        self.ids = []
        self.links = []

    def handle_starttag(self, tag, attrs):
        """Check that an element has its accessible name, and collect its id, its links and its level."""
        attributes = dict(attrs)
        self.levels += [int(tag[1])] if re.fullmatch("h[1-6]", tag) else []
        self.ids += [attributes["id"]] if "id" in attributes else []
        self.links += [attributes[name] for name in ("href", "src") if name in attributes]
        needed = ACCESSIBLE_NAMES.get(tag)
        if needed and not attributes.get(needed):
            self.lacks.append(self.get_starttag_text())
        if attributes.get("role") == "img" and not attributes.get("aria-label"):
            self.lacks.append(self.get_starttag_text())


def parse_page(text: str) -> _AccessibilityParser:
    """Return the parser of a page without its scripts."""
    parser = _AccessibilityParser()
    parser.feed(strip_scripts(text))
    return parser


def find_accessibility_errors(text: str) -> list[str]:
    """Return tags without language, scope or alternative text, and headings that skip a level."""
    parser = parse_page(text)
    skips = [
        f"<h{low}> before <h{high}>"
        for low, high in zip(parser.levels, parser.levels[1:], strict=False)
        if high > low + 1
    ]
    return parser.lacks + skips
