"""A backbone on disk: backbone.csv, backbone.nc, a picture and a page; its answer as plain numbers and as lines."""

from html import escape

import numpy as np

from .. import __version__, scales
from ..campaigns.backbone import Backbone, Curve
from ..disk.whole import write_rows, write_text
from .drawing import charts, pictures
from .netcdf import Contents, write
from .pages.document import Section, document, prose, table
from .results import Folder
from .summary import write_json

COLUMNS = ("amplitude", "frequency", "frequency_error", "damping", "damping_error")
LEFT_OUT = " Frequencies with errors larger than the frequency itself are left out of the picture, not of the table."
HEAD = ("method", "amplitude [m]", "frequency [Hz]", "frequency_error [Hz]", "damping", "damping_error")
WAYS = {"balance": "The curve belongs to the periodic motion that the rig would have without a net loss of energy. A "
                   "slow decay follows this motion, and so does a test in phase resonance.",
        "decay": "The curve belongs to a free decay from the largest amplitude; frequency and damping are evaluated "
                 "from one turning point to the next.",
        "quasi-static": "The frequency follows from the deflection under a static force that is distributed like the "
                        "mode with the contact stuck. The damping follows from the loops of the friction law."}
COLOURS = {"balance": "accent", "decay": "warm", "quasi-static": "#2f9e63"}
LISTED, MOST_LISTED = 9, 25  # amplitudes in the table on the screen of a curve of more, and the most of others


def answer_of(found: Backbone) -> dict:
    """The object that `patchfem backbone --json` prints, in SI."""
    return {"mode": found.mode, "free_frequency": found.free, "stuck_frequency": found.stuck,
            "stuck_frequency_error": found.stuck_error,
            "curves": {way: {name: getattr(one, name).tolist() for name in COLUMNS}
                       for way, one in found.curves.items()},
            "missing": found.missing,
            "exponent": {"micro": found.micro, "gross": found.gross, "micro_theory": found.expected},
            "flutter_amplitude": found.flutter, "notes": list(found.notes)}


def contents(found: Backbone, title: str = "") -> Contents:
    """backbone.nc: every curve under the name of its way, over amplitudes of its own."""
    variables, coordinates = {}, {}
    for way, one in found.curves.items():
        name = way.replace("-", "_")
        coordinates[f"{name}_amplitude"] = (f"{name}_amplitude", one.amplitude, {
            "units": "m", "long_name": "half the peak-to-peak motion at the output"})
        for of, unit, words in (("frequency", "Hz", "frequency"), ("frequency_error", "Hz", "error of the frequency"),
                                ("damping", "1", "damping ratio, structure and friction together"),
                                ("damping_error", "1", "error of the damping ratio")):
            variables[f"{name}_{of}"] = (f"{name}_amplitude", getattr(one, of), {
                "units": unit, "long_name": f"{words}, by {way}"})
    numbers = {"free_frequency": found.free, "stuck_frequency": found.stuck, "exponent_micro": found.micro,
               "exponent_gross": found.gross, "flutter_amplitude": found.flutter,
               "notes": "; ".join(found.notes) or None}
    return Contents(variables, coordinates, {"title": title, "patchfem": __version__, "mode": found.mode} | (
        {"missing": "; ".join(f"{way}: {text}" for way, text in found.missing.items())} if found.missing else {}) | {
        name: value for name, value in numbers.items() if value is not None})


def write_into(found: Backbone, title: str, resolved: str, folder: Folder, with_page: bool = True) -> dict:
    """Write into an open results folder, and return the answer; title: of the scene, resolved: its text in SI."""
    answer = answer_of(found)
    write_rows(folder.path / "backbone.csv", [HEAD, *(
        [way, *(repr(float(value)) for value in row)] for way, one in found.curves.items()
        for row in zip(*(getattr(one, name) for name in COLUMNS)))])
    write(contents(found, title), folder.path / "backbone.nc")
    write_json(answer, folder.path / "backbone.json")
    write_text(folder.path / "scene.resolved.toml", resolved)
    if found.curves:
        write_text(folder.path / "backbone.svg", pictures.draw(drawn(found)))
    if with_page:
        write_text(folder.path / "report.html", page(found, title))
    return answer


def drawn(found: Backbone) -> list:
    """The two charts: frequency and damping ratio over the amplitude, with their errors; frequencies that their errors
    exceed would stretch the axis, and stand in the table alone."""
    unit, scale = scales.axis_unit(np.concatenate([one.amplitude for one in found.curves.values()]), "m")
    out = []
    for name, label, of, log in (("frequency", "frequency", "Hz", False), ("damping", "damping ratio", "", True)):
        log, marks = log and all((one.damping > 0).all() for one in found.curves.values()), []
        for way, one in found.curves.items():
            x, y = one.amplitude * scale, getattr(one, name)
            error = getattr(one, f"{name}_error")
            shown = (y > 0) | (not log) if name == "damping" else _bounded(one)
            marks.append(charts.line(x[shown], y[shown], COLOURS[way], way))
            error = error[shown]
            marks.append(charts.mark("dots", COLOURS[way], "", x=x[shown], y=y[shown], errors=error, shape="circle",
                                     **({"floor": 0.1 * float(y[shown].min(initial=1.0))} if log else {})))
        out.append(charts.chart(label.capitalize(), charts.axis("amplitude at the output", unit, True),
                                charts.axis(label, of, log), marks))
    return out


def _bounded(one: Curve) -> np.ndarray:
    """Which points of a curve (k,) have a frequency that its error does not exceed; all, where none has."""
    found = one.frequency_error <= one.frequency
    return found | (not found.any())


def page(found: Backbone, title: str) -> str:
    """The HTML page of a backbone."""
    made = [one | {"anchor": f"chart{number}"} for number, one in enumerate(drawn(found))] if found.curves else []
    cells = "".join(f'<div id="{one["anchor"]}" class=chart role=img aria-label="{escape(one["title"])}"></div>'
                    for one in made)
    first, *more = sentences(found)
    told = f"<div class=verdict><b>{prose(first)}</b>{''.join(f'<p>{prose(text)}</p>' for text in more)}</div>"
    sections = [Section("curves", "Frequency and damping against amplitude",
                        f"<figure><div class=row>{cells}</div><figcaption>The bars show the numerical "
                        f"errors.{LEFT_OUT * (not all(_bounded(one).all() for one in found.curves.values()))}"
                        "</figcaption>"
                        "</figure>" if made else "<p>No curve was found.</p>"),
                Section("ways", "How the curves were computed", table(("", ""), [
                    [escape(way), prose(text if way in found.curves else f"not known: {found.missing[way]}")]
                    for way, text in WAYS.items() if way in found.curves or way in found.missing]) + "".join(
                        f"<p>{prose(text[0].upper() + text[1:])}.</p>" for text in found.notes)),
                Section("values", "Values", _values(found))]
    title = f"Mode {found.mode}: frequency and damping against amplitude" + f": {title}" * bool(title)
    return document(title, told, sections, {"charts": made} if made else None,
                    ("figures.js", "curves.js") if made else ())


def _values(found: Backbone) -> str:
    heads = ("method", ">amplitude", ">frequency", ">damping ratio")
    rows = [[way, *(escape(text) for text in _told(one, k))] for way, one in found.curves.items()
            for k in range(one.amplitude.size)]
    return table(heads, rows)


def _told(one, k: int) -> tuple:
    """(amplitude, frequency, damping ratio) of a point of a curve in words, with errors."""
    return (scales.short(one.amplitude[k], "m", 3), scales.told(one.frequency[k], one.frequency_error[k], unit="Hz"),
            scales.told(one.damping[k], one.damping_error[k]))


def _held(found: Backbone) -> str:
    """Frequency with the contact held in words, with its error where one is known."""
    return scales.told(found.stuck, found.stuck_error, unit="Hz") if found.stuck_error else \
        scales.short(found.stuck, "Hz", 5)


def sentences(found: Backbone) -> list:
    """The answer in sentences: frequency and damping ratio at both ends of the amplitudes first."""
    held = "" if found.stuck is None else f", and {_held(found)} while the contact sticks"
    free = scales.short(found.free, "Hz", 5)
    out = [f"The natural frequency of mode {found.mode} is {free} without the contact{held}."]
    best = next((found.curves[way] for way in ("balance", "quasi-static", "decay") if way in found.curves), None)
    if best is not None:
        ends = [_told(best, k) for k in sorted({0, best.amplitude.size - 1})]
        said = "; at ".join(f"{place}: {frequency}, damping ratio {damping}" for place, frequency, damping in ends)
        out.insert(0, f"Mode {found.mode} at {said}.")
        if (count := best.amplitude.size) > 1:
            k = int(np.argmax(best.damping))
            out.append(f"Among these {count} amplitudes the damping ratio is largest at "
                       f"{scales.short(best.amplitude[k], 'm', 3)}: {best.damping[k]:.3g}, with a frequency of "
                       f"{scales.short(best.frequency[k], 'Hz', 5)}.")
    theory = "" if found.expected is None else f" (theory: {found.expected:.3g})"
    powers = [f"to the power {value:.3g} {where}" for value, where in (
        (found.micro, f"in micro-slip{theory}"), (found.gross, "in gross slip (theory: 1)")) if value is not None]
    if powers:
        out.append(f"The energy that the contact dissipates per cycle grows with the amplitude {' and '.join(powers)}.")
    if found.flutter is not None:
        out.append(f"At amplitudes above {scales.short(found.flutter, 'm', 3)} the mode gains energy, because "
                   "friction dissipates less than the negative damping supplies.")
    return out


def lines_of(found: Backbone) -> list:
    """The answer in lines for the screen: sentences, a table of some amplitudes, what is missing."""
    out = [*sentences(found), f"{'method':<13}{'amplitude':>12}{'frequency':>26}{'damping ratio':>26}"]
    for way, one in found.curves.items():
        count = one.amplitude.size
        pick = np.unique(np.linspace(0, count - 1, count if count <= MOST_LISTED else LISTED).round().astype(int))
        out += [f"{way:<13}{cells[0]:>12}{cells[1]:>26}{cells[2]:>26}" for cells in (_told(one, k) for k in pick)]
        if pick.size < count:
            out.append(f"{way}: {pick.size} of {count} amplitudes are shown; backbone.csv has all")
    return [*out, *(f"{way}: not known: {text}" for way, text in found.missing.items())]
