"""The page of a fit: the answer first, values with intervals, measured and fitted in one picture, what is left over."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from .fit import told_of
from .pages.document import Section, document, figure, prose, table, warned

PICTURE, FITTED = "fit.svg", "scene.fitted.toml"
FILES = {"fit.json": "the result of the fit in SI units, with all digits",
         "fit.csv": "measured and fitted values, row by row",
         FITTED: "the scene with the fitted values, ready to run"}


def page(answer: dict, lines: Sequence, folder: Path) -> str:
    """The page as HTML; answer: the object of fit.json; lines: its text, the sentence first; folder: that of the fit,
    whose picture and fitted scene are taken in."""
    values = answer["values"] | {f"offset of the {name}": one for name, one in answer.get("offsets", {}).items()}
    short = "; ".join(f"{escape(key)} = {_short(one)}" for key, one in values.items())
    law = f"{answer['law']}: " if "law" in answer else ""
    told = [lines[0], *(lines[1 + len(values):] if isinstance(answer.get("rms"), dict) or "offsets" in answer else ())]
    bars = " Brackets enclose 95 % intervals." if any(one.get("interval") for one in values.values()) else ""
    lead = (f"<div class=verdict><b>{law}{short}</b><p>{prose('; '.join(' '.join(one.split()) for one in told))}."
            f"{bars}</p></div>{warned(answer['warnings'])}")
    sections = [Section("values", "Fitted values", _values(values))]
    if (folder / PICTURE).is_file():
        caption = {"rows": "Computed against measured readings; the line is where both are equal",
                   "decay": "Frequency and damping ratio against amplitude: measured values with errors, and the fit",
                   "patch": "Stiffness and loss per cycle of the patch and of each fitted law, against slide amplitude"}
        text = caption.get(answer["quantity"], "Measured and fitted values; on the right the residual of each row")
        picture = (folder / PICTURE).read_text("utf-8")
        sections.append(Section("picture", "Measured and fitted", figure(0, picture, f"{text}.", text)))
    if len(answer.get("correlation", ())) > 1:
        sections.append(Section("correlation", "Correlation of the values", _correlation(answer, list(values))))
    whole = escape("\n".join(lines))
    sections.append(Section("text", "The answer in full", f"<pre style='white-space:pre-wrap'>{whole}</pre>"))
    files = "".join(f"<li><a href={name}>{name}</a>: {what}</li>" for name, what in FILES.items()
                    if (folder / name).is_file())
    scene = (folder / FITTED).read_text("utf-8")
    sections.append(Section("origin", "Scene and files", f"<ul>{files}</ul><details><summary>Fitted scene</summary>"
                            f"<pre>{escape(scene)}</pre></details><p class=soft>patchfem {answer['patchfem']}</p>"))
    return document(f"{answer['title'] or 'Fit'}: fitted to {Path(answer['measured']).name}", lead, sections)


def _short(one: dict) -> str:
    """A value as the verdict gives it: with its interval where there is one."""
    value, unit, ends = told_of(one)
    return f"{value} {unit}".strip() + (f" ({ends[0]} to {ends[1]})" if ends else "")


def _values(values: dict) -> str:
    """Value, interval and range of each key; a value without an interval is said not to be determined."""
    rows = []
    for key, one in values.items():
        value, unit, ends = told_of(one)
        interval = " .. ".join(ends) if ends else "not determined" if "interval" in one else "&ndash;"
        low, high = (told_of(one | {"value": end, "interval": None}) for end in one["bounds"]) if "bounds" in one else \
            (("", "", ()),) * 2
        searched = f"{low[0]} {low[1]} .. {high[0]} {high[1]}" if low[0] else "&ndash;"
        bound = f", at its {one['at_bound']} bound" if one.get("at_bound") else ""
        rows.append([escape(key), value, interval, escape(unit), f"{searched}{bound}"])
    return table(("key", ">value", ">95 %", "unit", "searched"), rows)


def _correlation(answer: dict, names: list) -> str:
    """The correlation of the errors of the values, as a table."""
    rows = [[escape(name), *("&ndash;" if one is None else f"{one:.2f}" for one in row)]
            for name, row in zip(names, answer["correlation"])]
    return table(("key", *(f">{escape(name)}" for name in names)), rows) + \
        "<p class=soft>If a correlation is near 1 or -1, the measurement determines only a combination of these two " \
        "values.</p>"
