"""Before and after on paper: lines of text, plain data, traces that a scene can press, a page that stands alone."""

from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np

from ... import __version__
from ...campaigns.compare import Pressed
from ...campaigns.compare import data_of as pressed_data
from ...disk.whole import write_text
from ...scales import LADDERS, plain, step_of
from ...surface.areal import level_plane
from ...surface.compare.compare import Comparison
from ...surface.compare.reference import NO_LIMIT
from ...surface.profile import Profile, even, level
from ...surface.quantity import LEVEL, Quantity
from ...surface.roughness.parameters import Heights, abbott
from ...surface.roughness.spectrum import BAND
from ...surface.scans.change import Change, hidden
from ..pages.document import Section, document, figure, prose, table, warned
from ..pages.words import pair
from . import pictures
from .areal import write_columns, write_x3p

WORDS = {"shift": "shift", "tilt": "tilt", "scale": "scale of x", "worn_depth_max": "worn depth, largest",
         "worn_depth_mean": "worn depth, mean", "worn_area": "worn area (volume per width)",
         "amplitude_ratio": "amplitude ratio",
         "slope_ratio": "slope ratio", "worn_from_before": "start of the worn part, x in the first trace",
         "worn_to_before": "end of the worn part, x in the first trace",
         "worn_from_after": "start of the worn part, x in the second trace",
         "worn_to_after": "end of the worn part, x in the second trace",
         "worn_depth_within": "worn depth, mean over the worn part",
         "track_from": "start of the track", "track_to": "end of the track", "track_direction": "track, direction",
         "track_length": "track length", "track_volume": "track, area times length",
         "track_width": "track width", "track_depth": "track depth, mean", "track_step": "track, step height",
         "track_pile_up_left": "track, pile-up at its beginning", "track_pile_up_right": "track, pile-up at its end",
         "track_depth_floor": "track depth, floor", "track_area_gross": "track, lost area",
         "track_pile_up": "track, pile-up", "track_area_net": "track, lost area minus pile-up",
         "hidden_wear": "mean wear that a tilt may hide",
         "worn_volume": "worn volume", "grown_volume": "grown volume",
         "worn_share": "fraction of the common region that is worn",
         "shift_x": "shift along x", "shift_y": "shift along y", "rotation": "rotation"}
COMMON, TRACK = "common length", "track"
DRAWN = 1_000_000  # heights that a histogram and an Abbott curve are drawn from, spread over a larger scan
NOTE = ("All intervals are 95 % intervals. The intervals of shift, depth and area hold for the measured place and "
        "come from the noise of the unworn heights. A track or worn part begins where the flank that is fitted to its "
        "depths leaves the unworn surface. The flank is a parabola, or a step where a step fits clearly better. The "
        "intervals of both ends, of the width and of the mean depth within hold for flanks that leave the surface at "
        "an angle or in a step, as those of a parabola or a box do; a flank that runs out flat begins farther outside "
        "than its interval says. The intervals of ratios hold for the whole surface and assume Gaussian heights with "
        "the same statistics everywhere. If both traces are of the same place, their heights vary together, and the "
        "intervals are narrower.")


def words_of(one: Comparison, name: str) -> str:
    """A number of a comparison as words; a mean depth tells over what."""
    over = _over(one) if name == "worn_depth_mean" else None
    return WORDS[name] if over is None else f"{WORDS[name]} over the {over}"


def _over(one: Comparison) -> str | None:
    """What the mean worn depth of traces is the mean over, None of scans and where there is none."""
    if not isinstance(one.before, Profile) or one.worn.mean.value is None:
        return None
    return TRACK if one.reference == "flanks" else COMMON


def shown(one: Quantity) -> tuple:
    """Value, interval and unit as texts, in the unit that suits the largest of them."""
    if one.value is None:
        return "-", "", ""
    unit, scale = ("", 1.0)
    if one.unit != "1":
        ladder = {**LADDERS, "m2": (("um^2", 1e12),)}[one.unit]
        unit, scale = step_of(ladder, max(abs(one.low), abs(one.value if one.high is None else one.high)))
    if one.high is None:
        return _written(one.value * scale, 3), f"{_written(one.low * scale, 3)} .. {NO_LIMIT}", unit
    digits = _digits(one)
    value, low, high = (_written(each * scale, digits) for each in (one.value, one.low, one.high))
    return value, f"{low} .. {high}", unit


def _written(value: float, digits: int) -> str:
    """A number with so many digits, without a power of ten where it is below a million."""
    if value == 0 or not 1 <= abs(value) < 1e6:
        return plain(value, digits)
    return f"{value:.{max(digits - 1 - int(np.floor(np.log10(abs(value)))), 0)}f}"


def _digits(one: Quantity) -> int:
    """Digits that show the interval with two of its own."""
    width, size = one.high - one.low, max(abs(one.low), abs(one.high))
    return int(np.clip(np.ceil(np.log10(size / width)) + 2, 3, 6)) if width > 0 and size > 0 else 4


def lines_of(parts: list, found: tuple, pressing: Pressed | None = None) -> list:
    """The answer as lines: the verdict, what proves it, a table for each direction, the scene before and after."""
    headline, sentences = found
    out = [f"{headline}", *(f"  {text}" for text in sentences), ""]
    for one in parts:
        name = f", along {one.direction}" if one.direction else ""
        out.append(f"{one.before.source} -> {one.after.source}{name}")
        out.append(f"  {'':<38} {'value':>10}  {'95 %':<22} unit")
        for key, quantity in one.values.items():
            value, interval, unit = shown(quantity)
            out.append(f"  {words_of(one, key):<38} {value:>10}  {interval:<22} {unit:<5}".rstrip())
    if pressing is not None:
        out += ["", f"{pressing.title}, pressed with each surface"]
        out.append(f"  {'':<38} {'before':>24} {'after':>24}")
        for name, words, *sides in pressing.rows():
            out.append(f"  {words:<38} " + " ".join(f"{_said(name, one):>24}" for one in sides))
        out += [f"  {text}" for text in (*pressing.failed, *pressing.lacking)]
    return out


def _said(name: str, one) -> str:
    if one is None or one.value is None:
        return "-"
    return pair(name, {"value": one.value, "error": one.error, "unit": one.unit})


def data_of(parts: list, found: tuple, directions: list, pressing: Pressed | None = None) -> dict:
    """The answer as plain data in SI; the first direction stands at the top."""
    def part(one: Comparison) -> dict:
        return {"before": one.before.source, "after": one.after.source, "direction": one.direction or None,
                "reference": one.reference or None, **_numbers(one), **_of_traces(one)}

    out = {"patchfem": __version__, "verdict": found[0], "sentences": found[1], "confidence": LEVEL,
           "band": list(BAND), **part(parts[0]), "notes": [text for one in parts for text in one.notes]}
    if len(parts) > 1:
        out["directions"] = {one.direction: part(one) for one in parts}
        out["anisotropy"] = {when: {"amplitude_ratio": plain_of(amplitude), "slope_ratio": plain_of(slope)}
                             for when, amplitude, slope in directions}
    if pressing is not None:
        out["pressed"] = pressed_data(pressing)
    return out


def _numbers(one: Comparison) -> dict:
    """Every number as plain data; the mean worn depth has what it is the mean over in `over`."""
    out = {name: plain_of(each) for name, each in one.values.items()}
    if _over(one) is not None:
        out["worn_depth_mean"]["over"] = _over(one)
    return out


def _of_traces(one: Comparison) -> dict:
    """What traces alone have: how they were laid on each other, the longest track and the others, the heights left
    out."""
    if not isinstance(one.before, Profile):
        return {} if one.change is None else _of_scans(one.change)
    sizes, *others = ({name: plain_of(each) for name, each in found.items()}
                      for found in (one.tracks.sizes, *one.tracks.others))
    return {"registration": {"shift": plain_of(one.shift), "mirrored": one.mirrored},
            "track": sizes or None, "other_tracks": others, "removed": dict(zip(("before", "after"), one.removed))}


def _of_scans(one: Change) -> dict:
    """How scans were laid on each other, and the heights left out."""
    guess = None if one.found is None else one.found.guess
    flags = {"mirrored": bool(guess and guess.mirrored), "turned": bool(guess and guess.turned)}
    return {"registration": {**{name: plain_of(each) for name, each in one.registration.items()}, **flags},
            "hidden_wear": plain_of(hidden(one)), "track": _of_track(one),
            "removed": dict(zip(("before", "after"), one.removed))}


def _of_track(one: Change) -> dict | None:
    """The track of two scans, with the scatter of groups of sections along it; why there is none as `reason`."""
    if one.track is None:
        return None
    if one.track.why:
        return {"reason": one.track.why}
    return {"sections": one.track.sections, **{name: {**plain_of(each), "scatter": one.track.scatter.get(name)}
                                               for name, each in one.track.values.items()}}


def plain_of(one: Quantity) -> dict:
    out = {"value": one.value, "low": one.low, "high": one.high, "unit": one.unit}
    return {**out, "reason": one.reason} if one.value is None else out


def surfaces(one: Comparison) -> tuple:
    """The traces (before, after) [Profile] that a scene presses: the common part where there is one, else each whole.

    x counts from the middle, heights are levelled by least squares; the scene levels them in the same way.
    """
    found = one.registration
    if found is not None:
        pairs = [Profile(found.x, z, each.source) for z, each in
                 ((found.first, one.before), (found.first - found.depth, one.after))]
    else:
        pairs = [one.before, one.after]
    return tuple(level(even(each)) for each in pairs)


def write_trace(path: Path, trace: Profile) -> Path:
    """Write a trace as text that a scene reads with heights = "surface"."""
    middle = (trace.x[0] + trace.x[-1]) / 2
    rows = "\n".join(f"{x:.6f},{z:.6f}" for x, z in zip((trace.x - middle) * 1e6, trace.z * 1e6))
    write_text(path, f"x [um],z [um]\n{rows}\n")
    return path


def write_difference(folder: Path, one: Comparison) -> None:
    """Write the worn depth of two scans that lie on each other, NaN where a height is missing, as difference.x3p and,
    where these are few enough, as columns in difference.csv."""
    if one.change is None or one.change.found is None:
        return
    place = one.change.before.x, one.change.before.y, one.change.found.depth
    write_x3p(folder / "difference.x3p", *place, "worn depth: height before minus height after, once the surfaces are "
                                                 "aligned")
    write_columns(folder / "difference.csv", *place)


def write_page(path: Path, *told) -> None:
    """Write the page; arguments as `page`."""
    write_text(path, page(*told))


def page(parts: list, found: tuple, directions: list = (), pressing: Pressed | None = None) -> str:
    """The page of a comparison, the verdict first, nothing fetched."""
    headline, sentences = found
    names = [Path(each.source).name for each in (parts[0].before, parts[0].after)]
    title = f"{names[0]} and {names[1]}: before and after"
    lead = (f"<p class=soft>patchfem {escape(__version__)}</p><div class=verdict>"
            f"<b>{prose(headline[0].upper() + headline[1:])}.</b>"
            + "".join(f"<p>{prose(text)}</p>" for text in sentences) + "</div>"
            + warned([f"{text}." for one in parts for text in one.notes]))
    sections = []
    if directions:
        said = "; ".join(f"{when} {' '.join(shown(one)[:2])}" for when, one, _ in directions)
        sections.append(Section("directions", "x over y", figure(
            "xy", pictures.crossed(parts, directions),
            "Left: spectra of both directions. Right: amplitude of the band along x divided by that along y, and "
            "slope along x divided by that along y, with their 95 % intervals; the value 1 means that the "
            "surface is equally rough in both directions.",
            f"Waves along x divided by waves along y: amplitude {said}")))
    for number, one in enumerate(parts):
        body = [*(figure(f"{number}{place}", *each) for place, each in enumerate(figures(one))), _table(one),
                f"<p class=soft>{prose(NOTE)}</p>"]
        head = "Changes of depth at each place, and changes of the waves" if one.change is not None else \
            "Waves" if one.direction and parts[0].change is not None else "What changed"
        sections.append(Section(f"changes{number}", f"{head}{one.direction and f' along {one.direction}'}",
                                "\n".join(body)))
    if pressing is not None:
        sections.append(Section("pressed", f"{pressing.title}, pressed with each surface", _pressing(pressing)))
    return document(title, lead, sections)


def _laid(one: Change) -> tuple:
    """Return heights before about their plane, heights after aligned with them, and depth (m, n) [m] of two scans."""
    first = level_plane(one.before).z
    return first, first - one.volumes.filled, one.volumes.filled


def figures(one: Comparison) -> list:
    """Pictures [(svg, caption, alternative text)] of a comparison."""
    out, found, flanks = [], one.registration, one.flanks
    if found is not None:
        second = found.first - found.depth
        tilt = np.polyval(np.polyfit(found.x, found.first, 1), found.x)
        worn = np.where(found.depth > 3 * found.noise, found.depth, 0.0)
        out.append((pictures.overlay(found.x, found.first - tilt, second - tilt, worn, _closer(found.x, worn)),
                    "The trace measured after wear, moved by shift, tilt and offset, is drawn over the trace measured "
                    "before.",
                    f"Both traces after alignment: mean worn depth {' '.join(shown(one.worn.mean)[::2])}"))
        out.append((pictures.difference(found.x, found.depth, found.unworn, found.noise, None),
                    "The curve is the depth of the second trace (after wear) below the first trace (before wear). "
                    "Blue: the unworn heights to which shift, tilt and offset were fitted.",
                    f"Worn depth along the trace: largest {' '.join(shown(one.worn.largest)[::2])}"))
    elif one.change is not None and one.change.found is not None:
        out += _maps(one.change)
    elif isinstance(one.before, Profile):
        out.append((pictures.apart(one.before, one.after), "Each trace is drawn about its own least-squares line. No "
                                                           "common place was found in the two "
                                                           "traces.", "Traces before and after, one above the other"))
    if flanks is not None:
        out.append((pictures.difference(flanks.x, flanks.depth, None, None, (flanks.start, flanks.end)),
                    "The curve is the depth of the second trace (after wear) below the line through its unworn flanks.",
                    f"Depth of the wear track: largest {' '.join(shown(one.worn.largest)[::2])}"))
    about = "the least-squares line or plane of each surface" if found is None else ("the line of the first trace "
                                                                                     "(before wear)")
    curves = [_abbott(each) for each in (one.before, one.after)] if found is None else \
        [_bearing(z - tilt) for z in (found.first, second)]
    spectra = [each.spectrum for each in one.sizes]
    if spectra and all(each.density.any() for each in spectra):
        out.append((pictures.both_statistics(curves, spectra, BAND), f"Left: Abbott curves about {about}. Right: "
                    "spectra with their 95 % bands.",
                    f"Abbott curves and spectra: amplitude ratio {shown(one.amplitude_ratio)[0]}"))
    return out


def _maps(one: Change) -> list:
    """Pictures of two scans that lie on each other."""
    x, y, (first, second, depth) = one.before.x, one.before.y, _laid(one)
    worn = one.volumes.values["worn_volume"]
    out = [(pictures.maps(x, y, (first, second, depth)),
            "Left and middle: the first scan (before wear) and the second scan (after wear), aligned with the first; "
            "heights are measured from the reference plane of the first scan; white: no height. Right: depth of the "
            "second scan below "
            "the first; missing depths are taken from their neighbours; white: outside the second scan.",
            f"Maps of both scans and of the worn depth: worn volume {' '.join(shown(worn)[::2])}")]
    known = np.isfinite(depth)
    there = np.flatnonzero(known & np.isfinite(first))
    there = there[::-(-there.size // DRAWN)]
    heights = [each.ravel()[there] for each in (first, second)]
    out.append((pictures.both_heights(heights, [_bearing(z) for z in heights]),
                "Left: fraction of the heights in each class. Right: Abbott curves. Heights are those of the region "
                "common to both scans, measured from the reference plane of the first scan (before wear).",
                "Histograms and Abbott curves of the heights before and after"))
    if one.track is not None and not one.track.why:
        found = one.track.values
        out.append((pictures.mean_section(one.track, found["from"].value, found["to"].value),
                    f"Mean of {one.track.sections} sections across the track. The band extends one standard deviation "
                    "of the sections above and below the mean. The track lies between the lines.",
                    f"Mean section of the track: width {' '.join(shown(found['width'])[::2])}"))
    return out


def _abbott(surface) -> tuple:
    if isinstance(surface, Profile):
        return _bearing(level(even(surface)).z)
    every = max(int(np.sqrt(surface.z.size / DRAWN)), 1)
    known = level_plane(replace(surface, x=surface.x[::every], y=surface.y[::every], z=surface.z[::every, ::every])).z
    return _bearing(known[~np.isnan(known)])


def _bearing(z) -> tuple:
    """Abbott curve of heights; their order along the surface does not count."""
    return abbott(Heights(z, 1.0))


def _closer(x, worn) -> tuple:
    """Part [m] of the traces around the largest wear, a sixth of them or `FINE` samples."""
    half = max((x[-1] - x[0]) / 12, pictures.FINE / 4 * (x[1] - x[0]))
    half = min(half, (x[-1] - x[0]) / 2)
    at = float(np.clip(x[int(np.argmax(worn))], x[0] + half, x[-1] - half))
    return at - half, at + half


def _table(one: Comparison) -> str:
    rows = []
    for key, quantity in one.values.items():
        value, interval, unit = shown(quantity)
        cells = [escape(value), escape(interval), escape(unit)] if quantity.value is not None else ["&ndash;", "", ""]
        text = quantity.text if quantity.value is not None else f"{quantity.text}: not available"
        rows.append([escape(words_of(one, key)), *cells, f"<td class=soft>{prose(text)}</td>"])
    return table(("quantity", ">value", ">95 %", "unit", "meaning"), rows)


def _pressing(found: Pressed) -> str:
    told = [*found.failed, *(f"{name}: {text}" for name, one in (("before", found.before), ("after", found.after))
                             if one is not None for text in one.warnings)]
    parts = [warned(told)]
    sides = [(one.x, one.stress, name) for name, one in (("before", found.before), ("after", found.after))
             if one is not None]
    if sides:
        peaks = ", ".join(f"{name} {_said('pressure_peak', one.measures.get('pressure_peak'))}" for name, one in
                          (("before", found.before), ("after", found.after)) if one is not None)
        parts.append(figure("p", pictures.pressures(sides), "Normal stress of the patch, pressed once with each of "
                                                            "the two surfaces; all other settings of the scene are "
                                                            "the same.", f"Pressure along the patch, largest: {peaks}"))
        rows = [[escape(words), *(escape(_said(name, one)) for one in measures), _times(*measures)]
                for name, words, *measures in found.rows()]
        parts.append(table(("measure", ">before", ">after", ">after / before"), rows))
    parts += [f"<p class=soft>{prose(text)}.</p>" for text in found.lacking]
    return "\n".join(parts)


def _times(first, second) -> str:
    if any(one is None or one.value is None for one in (first, second)) or not first.value:
        return ""
    return f"{second.value / first.value:#.3g}"
