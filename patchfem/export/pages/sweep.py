"""The page of a sweep: what came out over the swept keys, explored in the browser, and a table of the cases."""

from collections import Counter
from html import escape
from math import isfinite

import numpy as np

from ...core import Outcome
from ...scales import LADDERS, axis_unit, rounded, short
from . import allowed
from .changes import changes
from .document import Section, document
from .words import linked, zero_below
from .written import NUMBER, brief

SETTLED = ("steady", "stuck", "done", "no_contact")
FIRST = ("relative_displacement_amplitude", "loop_area", "friction_ratio_peak", "onset_level", "pressure_peak")
DRAWN, LISTED = 20_000, 400  # cases in the pictures and in the table; sweep.csv has them all


def page(table: dict) -> str:
    """The whole HTML page of a sweep.

    table: `title`, `of` (the scene's own title; may be missing), `version`, `command` (the line that made it),
    `scene` (its text), `seconds` of work (NaN: unknown); `grid`: whether the cases are all combinations of the keys'
    values; `keys`: [{`name`, `unit`, `values` (n,) in SI, `texts` (n,) as written, `log`}];
    `measures`: {name: {`unit`, `means`, `values` (n,), `errors` (n,)}}, NaN where a case has none; `outcome` (n,);
    `messages`: {case: why it has no answer}; `folders` (n,): where the cases lie beside the page, or None; `own`: False
    where sweep.csv does not lie beside the page.
    """
    outcome, number = list(table["outcome"]), len(table["outcome"])
    drawn = _spread(number, DRAWN)
    keys = [_key(one, drawn) for one in table["keys"]]
    measures = [_measure(name, one, drawn) for name, one in table["measures"].items()
                if np.isfinite(one["values"]).any()]
    first = next((name for name in FIRST if any(m["name"] == name for m in measures)), None)
    data = {"keys": keys, "measures": measures, "outcome": [outcome[i] for i in drawn], "settled": SETTLED,
            "grid": bool(table["grid"]), "first": first, "along": _along(keys),
            "links": None if table["folders"] is None else [table["folders"][i] for i in drawn]}
    sections = [Section("answers", "What came out", _explorer(number, len(drawn)) if measures else
                        "<p>No case has a value to draw.</p>"),
                *_change(table),
                Section("cases", "Cases", _cases(table)),
                Section("measures", "What the measures mean", _meanings(table)),
                Section("again", "The same again", _again(table))]
    return document(table["title"] or "patchfem sweep", _lead(table), sections, data if measures else None,
                    ("figures.js", "explorer.js") if measures else ())


def _spread(number: int, most: int) -> np.ndarray:
    """At most `most` of so many cases, evenly spread."""
    return np.arange(number) if number <= most else np.unique(np.linspace(0, number - 1, most).astype(int))


def label(name: str) -> str:
    """A name of the program as people read it."""
    return name.replace("_", " ")


def _key(one: dict, drawn) -> dict:
    """A swept key in the unit in which it was written, where all its values are; `words`: (number, text) of its values
    where they are words."""
    texts = [str(one["texts"][i]) for i in drawn]
    written = [NUMBER.match(text) for text in texts]
    units = {(match[2] or "").strip() if match else None for match in written}
    if len(units) == 1 and None not in units:
        unit, values = units.pop(), [float(match[1]) for match in written]
    else:
        unit, values = one["unit"], np.asarray(one["values"], float)[drawn]
    words = None if any(written) else list(dict(zip(values, map(brief, texts))).items())
    return {"name": one["name"], "label": one["name"], "unit": "" if unit == "1" else unit, "values": values,
            "texts": [brief(text) for text in texts], "log": bool(one["log"]), "words": words}


def _measure(name: str, one: dict, drawn) -> dict:
    """A measure in the unit that suits its largest value."""
    unit, scale = axis_unit(one["values"], one["unit"]) if one["unit"] in LADDERS else (one["unit"], 1.0)
    return {"name": name, "label": label(name), "unit": "" if unit == "1" else unit, "means": one.get("means", ""),
            "values": np.asarray(one["values"], float)[drawn] * scale,
            "errors": np.asarray(one["errors"], float)[drawn] * scale, "least": zero_below(name) * scale}


def _along(keys: list) -> str:
    """The key with most values: the one along the axis."""
    return max(keys, key=lambda one: len(set(np.asarray(one["values"]).tolist())))["name"] if keys else ""


def _explorer(number: int, drawn: int) -> str:
    """The choices and the place of the picture; `explorer.js` fills both."""
    thinned = f"<p class=soft>Drawn are {drawn} of {number} cases, evenly spread.</p>" if drawn < number else ""
    return ("<div class=choices><label>Measure<select id=measure></select></label>"
            "<label>Along the axis<select id=along></select></label>"
            "<label>Second key<select id=beside></select></label>"
            "<label>Shown as<select id=shown><option value=lines>lines</option><option value=map>map</option></select>"
            "</label><span id=held class=choices style='padding:0'></span></div>"
            "<div id=chart class=chart role=img></div><p id=means class=soft aria-live=polite></p>"
            "<p class=soft>Bands show the numerical error. Crosses, shading and hatching mark cases that did not "
            f"settle. A click on a case opens it.</p>{thinned}<noscript><p class=verdict>The pictures need "
            "JavaScript; the numbers stand in sweep.csv.</p></noscript>")


def span(measures: dict, outcome) -> str:
    """From where to where the first measure of interest runs, and its largest numerical error; "" where none has a
    value. measures: {name: (values (n,), errors (n,), SI unit)}, NaN where a case has none; outcome (n,): cases that
    did not settle are left out where others did."""
    settled = np.isin(np.asarray(outcome, str), SETTLED)
    for name in FIRST:
        if name not in measures or not np.isfinite(measures[name][0]).any():
            continue
        values, errors, unit = measures[name]
        every = np.isfinite(values)
        there = every & settled if np.any(every & settled) else every
        values, errors = np.asarray(values, float)[there], np.asarray(errors, float)[there]
        low, high = (short(one, unit, 4, zero_below(name)) for one in (values.min(), values.max()))
        ran = f"is {high} throughout" if low == high else f"runs from {low} to {high}"
        known = errors[np.isfinite(errors)]
        largest = f"numerical error at most {short(known.max(), unit, 1)}" if known.any() else "without numerical error"
        band = f", {largest}" if known.size else ""
        whose = "" if every.sum() == there.sum() else " of the settled cases"
        return f"{label(name).capitalize()}{whose} {ran}{band}."
    return ""


def turns(keys: list, measures: dict, outcome, grid: bool = True) -> str:
    """What changes first as a swept key grows, and from where on, as a sentence; "" where nothing does beyond the bars.

    keys: [{`name`, `values` (n,), `texts` (n,)}] of the cases; measures and outcome as `span` takes them; grid: the
    cases are all combinations of the keys' values.
    """
    main = next((name for name in FIRST if name in measures and np.isfinite(measures[name][0]).any()), "")
    known = {name: one[:2] for name, one in measures.items()}
    if main:
        settled = np.isin(np.asarray(outcome, str), SETTLED)
        there = settled & np.isfinite(known[main][0])
        known[main] = np.where(settled if there.any() else True, known[main][0], np.nan), known[main][1]
    return changes(_named(keys), known, outcome, grid, main)


def within(keys: list, measures: dict, outcome, grid: bool = True) -> str:
    """How far the key may go until each main measure is off by 5 %, as a sentence; "" where none is. As `turns`."""
    return allowed.sentence(*allowed.allowed(_named(keys), measures, outcome, SETTLED, grid))


def _named(keys: list) -> list:
    """The keys with whether their values are words."""
    return [one | {"words": not any(NUMBER.match(str(text)) for text in one["texts"])} for one in keys]


def _columns(table: dict) -> dict:
    """The measures of a table as `span` takes them."""
    return {name: (one["values"], one["errors"], one["unit"]) for name, one in table["measures"].items()}


def _change(table: dict) -> list:
    """The section on what each main measure has changed by since the first case; none where no key grows alone."""
    columns = _columns(table)
    text = allowed.table(*allowed.allowed(_named(table["keys"]), columns, table["outcome"], SETTLED, table["grid"]),
                         columns)
    return [Section("change", "Change against the first case", text)] if text else []


def _lead(table: dict) -> str:
    """The verdict: how many cases, over what, how they ended, the span of the first measure, what changes first."""
    number, over = len(table["outcome"]), " × ".join(one["name"] for one in table["keys"])
    ended = ", ".join(f"{count} {label(name)}" for name, count in Counter(table["outcome"]).most_common())
    text = f"<b>{number} cases</b> over {escape(over)}: {escape(ended)}."
    columns, outcome, grid = _columns(table), table["outcome"], table["grid"]
    for said in (span(columns, outcome), turns(table["keys"], columns, outcome, grid),
                 within(table["keys"], columns, outcome, grid)):
        text += f" {escape(said)}" if said else ""
    text += "".join(f" <i>{escape(label(one))}</i>: {escape(one.sentence)}" for one in Outcome
                    if one.value in table["outcome"] and one.value not in SETTLED)
    failed = table["messages"]
    fault = ""
    if failed:
        shown = Counter(failed.values()).most_common(5)
        fault = "<div class='verdict warn'>" + "".join(
            f"<p>{count} case{'s' if count > 1 else ''} failed: {escape(why)}</p>" for why, count in shown) + "</div>"
    took = f" &middot; computed in {table['seconds']:.2f} s, all cases together" if isfinite(table["seconds"]) else ""
    scene = f"Scene: {escape(table['of'])} &middot; " if "of" in table else ""
    return (f"<p class=soft>{scene}patchfem {escape(table['version'])}{took}</p>"
            f"<p class=verdict>{text}</p>{fault}")


def _cases(table: dict) -> str:
    """The first cases as a table with their keys, outcome and the measures that change from case to case."""
    shown = [name for name in FIRST if name in table["measures"]]
    shown += [name for name, one in table["measures"].items() if name not in shown and _changes(one["values"])]
    shown = shown[:6]
    columns = [_measure(name, table["measures"][name], slice(None)) for name in shown]
    head = "".join(f"<th>{escape(one['name'])}</th>" for one in table["keys"]) + "<th>outcome</th>" + "".join(
        f"<th class=n>{linked(one['label'], one['name'])}{escape(one['unit'] and ' [' + one['unit'] + ']')}</th>"
        for one in columns)
    rows = []
    for i, outcome in enumerate(table["outcome"][:LISTED]):
        cells = "".join(f"<td>{escape(brief(str(one['texts'][i])))}</td>" for one in table["keys"])
        said = escape(label(outcome))
        if table["folders"] is not None:
            said = f'<a href="{escape(table["folders"][i])}">{said}</a>'
        cells += f"<td>{said}</td>" + "".join(
            f"<td class=n>{_number(one['values'][i], one['errors'][i], one['least'])}</td>" for one in columns)
        rows.append(f"<tr{'' if outcome in SETTLED else ' class=bad'}>{cells}</tr>")
    number = len(table["outcome"])
    more = f"<p class=soft>The first {LISTED} of {number} cases; sweep.csv has all.</p>" if number > LISTED else ""
    files = ("<p class=soft>Every case with every measure and its error: <a href=sweep.csv>sweep.csv</a>, "
             "<a href=sweep.nc>sweep.nc</a>.</p>") if table.get("own", True) else ""
    return (f"{files}<div class=wide><table><thead><tr>{head}</tr></thead>"
            f"<tbody>{''.join(rows)}</tbody></table></div>{more}")


def _changes(values) -> bool:
    found = np.asarray(values, float)
    found = found[np.isfinite(found)]
    return found.size > 0 and np.ptp(found) > 1e-9 * np.abs(found).max()


def _number(value: float, error: float, least: float) -> str:
    """A value rounded by its error and with it; least: its floor in the unit of both."""
    if not np.isfinite(value):
        return "&ndash;"
    return " ± ".join(text for text in rounded(value, error if np.isfinite(error) else None, least) if text)


def _meanings(table: dict) -> str:
    rows = "".join(f"<tr id='measure-{escape(name)}'><td>{escape(label(name))}</td><td>{escape(one['unit'])}</td>"
                   f"<td>{escape(one.get('means', ''))}</td></tr>" for name, one in table["measures"].items())
    return ("<div class=across><table><thead><tr><th>measure</th><th>unit</th><th>meaning</th></tr></thead>"
            f"<tbody>{rows}</tbody></table></div>")


def _again(table: dict) -> str:
    return (f"<p>This line made the sweep:</p><pre>{escape(table['command'])}</pre>"
            f"<details><summary>Scene</summary><pre>{escape(table['scene'])}</pre></details>")
