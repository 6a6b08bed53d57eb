"""The answer of a run in words and in the units that people read: its headline, its measures in groups."""

import re
from collections.abc import Callable
from html import escape
from math import isfinite, pi

from ...core import Outcome, rounded
from ...response.rows import TABLE as MOTION
from ...runs.results.patch_rows import TABLE as STATIC
from ...runs.results.result import Result
from .. import scales

G, LBF, INCH = 9.80665, 4.4482216152605, 0.0254
DEG = ("deg", 180 / pi)
WORKSHOP = {  # as scales.LADDERS
    "m": (("mil", 1e3 / INCH), ("in", 1 / INCH)), "m3": (("in^3", INCH**-3),), "rad": (DEG,),
    "N": (("lbf", 1 / LBF),), "N m": (("lbf in", 1 / LBF / INCH),), "J": (("in lbf", 1 / LBF / INCH),),
    "Pa": (("psi", INCH**2 / LBF), ("ksi", 1e-3 * INCH**2 / LBF)),
    "N m-1": (("lbf/in", INCH / LBF), ("klbf/in", 1e-3 * INCH / LBF))}
GROUPS = ("motion", "friction", "energy", "patch", "wear")
NO_SLIP = 1e-15  # m, the last digits of a slide
WHOLE_RUN = "over the whole run"
OF_WHAT = {  # said behind a value that would otherwise be taken for another, or for more than it says
    "loop_area": "per cycle", "friction_work": WHOLE_RUN, "energy_dissipated": WHOLE_RUN, "energy_created": WHOLE_RUN,
    "stick_fraction": "of the interface as a whole", "equivalent_damping": "a damping ratio of mode 1"}
BETWEEN = ("jump_level",)  # known to lie between two levels of the drive, whatever the tolerance
ROUND = 1e-12  # of the friction force times the motion: work that is round-off


def units(name: str, value: float, unit: str) -> list:
    """Units [(unit, scale)] in which a person reads the measure `name`, by its size; the metric one first.

    value and unit: in SI; value times scale is in the unit.
    """
    if name.endswith("fraction"):
        return [("%", 100.0)]
    if name.endswith("phase"):
        return [DEG]
    if unit == "m s-2":
        return [("g", 1 / G)]
    ladders = [table[unit] for table in (scales.LADDERS, WORKSHOP) if unit in table]
    return [scales.step_of(ladder, value) for ladder in ladders]


def pair(name: str, measure: dict) -> str:
    """A measure with its error in the first of its units, such as `14.808 ± 0.041 um`; a dash without a value."""
    value, error = measure["value"], measure["error"]
    if value is None:
        return "-"
    plain = "" if measure["unit"] == "1" else measure["unit"]
    unit, scale = (units(name, value, measure["unit"]) or [(plain, 1.0)])[0]
    value, error = rounded(value * scale, None if error is None else error * scale)
    return (f"{value} ± {error} {unit}" if error else f"{value} {unit}").strip()


def others(name: str, measure: dict) -> str:
    """The value in its other units, to the digits its error allows; nothing for a value that is zero within it."""
    value, error = measure["value"], measure["error"]
    if value is None or not isfinite(value) or abs(value) <= (error or 0.0):
        return ""
    out = []
    for unit, scale in units(name, value, measure["unit"]):
        if scale == 1.0 or abs(value) * scale < 1e-3:
            continue
        sharp = error is None or error < 1e-4 * abs(value)
        text = f"{value * scale:.5g}" if sharp else rounded(value * scale, error * scale)[0]
        out.append(f"{text} {unit}")
    return " = ".join(out)


def verdict(summary: dict) -> str:
    """The sentence on how a run ended, from its summary as summary.json holds it; of a bench also whether it slipped.

    `stuck` speaks of the interface as a whole. Where its last cycles dissipate, or slip, more than their error, part of
    it slips, and the sentence says how much.
    """
    outcome, measures = Outcome(summary["outcome"]), summary["measures"]
    if summary["kind"] == "bench" and outcome is Outcome.DONE:
        return _slid(measures.get("slip_amplitude"), outcome.sentence)
    if outcome is not Outcome.STUCK or not {"loop_area", "slip_amplitude"} & measures.keys():
        return outcome.sentence
    force, motion = (measures.get(name, {}).get("value") or 0.0 for name in
                     ("friction_force_peak", "relative_displacement_amplitude"))
    part = "part of the patch slips" if "contact_fraction" in measures else "part of it slips"
    for first, least, form in (("loop_area", ROUND * abs(force * motion), "{} per cycle"),
                               ("slip_amplitude", 0.0, "by {}")):
        found = {name: one for name, one in measures.items() if re.sub(r"_\d+$", "", name) == first and one["value"]}
        name = max(found, key=lambda each: found[each]["value"], default="")
        if name and found[name]["value"] > max(_open(found[name]), least):
            return f"The interface holds as a whole; {part} ({form.format(pair(name, found[name]))})."
    return "The interface holds: no slip in the last cycles."


def _slid(slip: dict | None, done: str) -> str:
    """The sentence of a bench: its slip, the mean weighted by the pressure, where that is more than what is open."""
    if slip is None or slip["value"] is None:
        return done
    if slip["value"] <= max(_open(slip), NO_SLIP):
        return f"{done} The interface holds: no slip in the last cycle."
    return f"{done} The interface slips: {pair('slip_amplitude', slip)} half peak-to-peak in the mean over it."


def _open(one: dict) -> float:
    """What a measure leaves open, in its unit: its error, or its floor where none was estimated."""
    return one["floor"] if one["error"] is None else one["error"]


def headline(summary: dict, cycles: float | None, number: Callable[[str, str], str] | None = None,
             released: str = "") -> str:
    """The measures that answer first, as one sentence; "" where there is none.

    summary: as summary.json holds it; cycles: of the drive that were run, None where it has none; number: makes of a
    value with its error, and of the name of its measure, what stands in the text; released: how a released output
    swung, in place of what is left of that in the last cycles.
    """
    measures, parts = summary["measures"], []
    whole = cycles is None or cycles >= 1 - 1e-6

    def said(name: str, text: str) -> None:
        found = measures.get(name)
        if found and found["value"] is not None:
            value = pair(name, found)
            parts.append(text.format(value if number is None else number(value, name)))

    if summary["outcome"] != "no_contact":
        worn = next((name for name in ("worn_depth_max", "worn_volume") if name in measures), "")
        said(worn, "{} worn off at the deepest place" if worn == "worn_depth_max" else "{} worn off")
        if released:
            parts.append(released)
            said("friction_work", "friction takes {} in all")
        else:
            said("relative_displacement_amplitude", "the output moves {} half peak-to-peak")
            said("relative_displacement_amplitude_steady", "it would settle at {}")
            said("absolute_acceleration_peak", "peak acceleration {}")
        if "relative_displacement_amplitude" not in measures:
            said("friction_ratio_peak", "friction ratio peaks at {}")
        if whole and not released:
            said("loop_area", "{} dissipated per cycle")
        said("contact_fraction", "contact on {} of the length")
        if summary["kind"] == "patch":
            said("pressure_peak", "peak pressure {}")
    text = "; ".join(parts)
    if text and not whole and not released:
        text = f"in {cycles:.2g} of a cycle {text}"
    return f"{text[0].upper() + text[1:]}." if text else ""


def least_known(result: Result) -> str:
    """The measure known least well for the tolerance, as one sentence; "" where one misses it, which a warning says."""
    tolerance = result.plan.model.accuracy.tolerance
    wide = {name: one.error / (tolerance * abs(one.value) + one.floor) for name, one in result.measures.items()
            if one.value and one.error is not None}
    if not wide or max(wide.values()) > 1:
        return ""

    def known(name: str) -> str:
        one = result.measures[name]
        return f"{name}, {pair(name, {'value': one.value, 'error': one.error, 'unit': one.unit})}"

    steps = [name for name in wide if name in BETWEEN]
    name = max([name for name in wide if name not in BETWEEN], key=wide.get, default="")
    of_steps = f"{', '.join(map(known, steps))}, is known to the distance of two levels of the drive"
    if not name:
        return f"{of_steps}."
    but = f"; {of_steps}, which the scene sets" if steps else ""
    return f"Every measure with an error meets the tolerance {tolerance:g}; least well {known(name)}{but}."


def linked(text: str, name: str, more: str = "") -> str:
    """A text as a link to the definition of a measure on the same page."""
    return f"<a{more} href='#measure-{escape(name)}'>{escape(text)}</a>"


def meaning(name: str) -> str:
    """What a measure is, in a sentence; "" for one that no table has."""
    for known in (name, re.sub(r"_\d+$", "", name)):
        for table in (MOTION, STATIC):
            if known in table:
                return table[known].text
    return ""


def group_of(name: str, pressed: bool = True) -> str:
    """The group, one of GROUPS, of a measure by its name; that of one of several interfaces ends in its number.

    pressed: a patch was pressed, so that what it shares with a point, the load, is its own.
    """
    for table in (STATIC, MOTION) if pressed else (MOTION, STATIC):
        for known in (name, re.sub(r"_\d+$", "", name)):
            if known in table:
                return table[known].group
    return GROUPS[0]


def table_of(measures: dict) -> list[str]:
    """Lines of all measures in their groups, each with its error in people's units, or why it has no value."""
    width = max(map(len, measures), default=0)
    out, pressed = [], "contact_fraction" in measures
    for group in GROUPS:
        lines = [f"  {name:<{width}}  {_value(name, one)}" for name, one in measures.items()
                 if group_of(name, pressed) == group]
        out += [group, *lines] if lines else []
    return out


def fragment(summary: dict, sentence: str, cycles: float | None, released: str = "") -> str:
    """The answer as HTML without styles of its own, for a notebook; cycles and released as `headline` takes them."""
    rows, measures = [], summary["measures"]
    for line in table_of(measures):
        name, _, value = line.strip().partition(" ")
        cells = f"<td>{escape(name)}</td><td style='text-align:right'>{escape(value.strip())}</td>"
        rows.append(f"<tr>{cells if value else f'<th colspan=2>{escape(name)}</th>'}</tr>")
    title = f"<b>{escape(summary['title'])}</b><br>" if summary["title"] else ""
    warnings = "".join(f"<p>&#9888; {escape(text)}</p>" for text in summary["warnings"])
    answer = escape(f"{summary['outcome']}: {sentence} {headline(summary, cycles, released=released)}")
    return f"<div>{title}{answer}{warnings}<table>{''.join(rows)}</table></div>"


def _value(name: str, one: dict) -> str:
    if one.get("reason"):
        return f"- ({one['reason']})"
    of_what = OF_WHAT.get(re.sub(r"_\d+$", "", name))
    return f"{pair(name, one)}, {of_what}" if of_what else pair(name, one)
