"""report.html: a self-contained page, made from the files of one or several answers alone.

In: results folders, as `store` wrote them. Out: HTML of the template page.html with the texts, the packed figures and the
packed plotly.js.
"""

import base64
import gzip
import json
import tomllib
from functools import cache
from importlib.resources import files
from pathlib import Path
from textwrap import shorten
from typing import Any

from ..core import PatchfemError
from ..disk.atomic_write import explain_write_error, write_text
from ..formatting import format_number
from . import quantities, store
from .answer import Answers, Quantity
from .charts import panels, plotly
from .columns import Table, make_tables
from .quantities import format_quantity
from .rows import CHARTS, FILE_DESCRIPTIONS

# value in a scene file
TomlValue = str | float | list[Any] | dict[str, Any]
FIGURE_COMPRESSION_LEVEL = 6  # level of zlib, from 1 (fast) to 9 (small)


def write_report(*folders: Path, out: Path | None = None) -> Path:
    """Write the page of one folder, or of several folders side by side, and return its path.

    Parameters
    ----------
    *folders : Path
        Results folders, of answers of the same kind.
    out : Path, optional
        The page; by default report.html in a single folder, else in the current folder.

    Raises
    ------
    PatchfemError
        If a folder has no complete result, if the results are of different kinds, or if the page is no .html.
    Missing
        If the page cannot be written.
    """
    path = Path(
        out or (Path(folders[0]) / store.PAGE_FILE if len(folders) == 1 else store.PAGE_FILE)
    )
    if path.suffix != ".html":
        raise PatchfemError(f"{path}: the ending of a page is .html; use -o {store.PAGE_FILE}")
    text = make_page([Path(folder) for folder in folders])
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise explain_write_error(error, path) from None
    write_text(path, text)
    return path


def make_page(folders: list[Path]) -> str:
    """Return the page of an answer, or of several answers of the same kind side by side.

    PatchfemError if a folder has no complete result, or if the answers are of different kinds.
    """
    answers = read_answers(folders)
    first = next(iter(answers.values()))
    drawn = panels.make_panels(answers, CHARTS[first.kind])
    # a single answer has tables, files and films; of several answers the page shows what differs
    if len(folders) == 1:
        tables = make_tables(first)
        paths = sorted(folders[0].glob("[!.]*"))
        texts = {
            path.name: FILE_DESCRIPTIONS.get(path.name) or FILE_DESCRIPTIONS.get(path.suffix)
            for path in paths
        }
        if (folders[0] / store.FIELDS_FILE).is_file() and "y" not in first.data:
            # only a run with fields of both pieces has the modules that read them
            from .fields.film import make_stress_panels

            drawn += make_stress_panels(folders[0] / store.FIELDS_FILE)
    else:
        tables = list_scene_differences(answers)
        texts = {}

    figures = [plotly.make_plotly_figure(panel) for panel in drawn]
    packed = json.dumps(figures, separators=(",", ":"), allow_nan=False, default=plotly.pack_array)
    measures, zeros = _list_measures(answers)
    return _read_template().render(
        answers=answers,
        first=first,
        panels=drawn,
        tables=tables,
        measures=measures,
        zeros=zeros,
        files=[(name, text) for name, text in texts.items() if text],
        data=_encode_base64(gzip.compress(packed.encode(), FIGURE_COMPRESSION_LEVEL, mtime=0)),
        library=read_library() if drawn else "",
    )


def read_answers(folders: list[Path]) -> Answers:
    """Return the answers in folders by their names in legends, such as "load 4 kN"; "" for a single answer."""
    if not folders:
        raise PatchfemError("report: at least one results folder is needed")
    if len(folders) == 1:
        return {"": store.read_answer(folders[0])}
    answers = {}
    for folder in folders:
        answer = store.read_answer(folder)
        # a case of a sweep is named by its keys, any other answer by its folder
        case = answer.details.get("case") if answer.is_run else None
        name = ", ".join(f"{key.rpartition('.')[2]} {value}" for key, value in (case or {}).items())
        name = name or folder.resolve().name
        answers[f"{name} ({len(answers) + 1})" if name in answers else name] = answer
    if len({"run" if answer.is_run else answer.kind for answer in answers.values()}) > 1:
        kinds = ", ".join(f"{name}: {answer.kind}" for name, answer in answers.items())
        raise PatchfemError(
            f"report: the folders have results of different kinds ({kinds}); "
            "give folders of one kind"
        )
    return _sort_by_drive_level(answers)


def _sort_by_drive_level(answers: Answers) -> Answers:
    """Return response curves in the order of their drive levels, and other answers in the given order."""
    levels = {}
    for name, answer in answers.items():
        level = answer.data.get("curve_level")
        if level is None or "curve_frequency" not in answer.data:
            return answers
        levels[name] = level.values.max()
    return {name: answers[name] for name in sorted(levels, key=levels.__getitem__)}


def _list_measures(answers: Answers) -> tuple[list[tuple[str, list[str], str]], list[str]]:
    """Return the rows of the table of measures of a page, and the names of the measures that are zero in all answers.

    A row has the name of a measure, its text in each answer, and its definition.
    """
    rows = []
    zeros = []
    for name in dict.fromkeys(name for answer in answers.values() for name in answer.quantities):
        entries = [answer.quantities.get(name) for answer in answers.values()]
        if all(entry is not None and quantities.is_zero(name, entry) for entry in entries):
            zeros.append(name.replace("_", " "))
            continue

        # every answer is compared with the first one
        texts = [format_entry(name, entry, entries[0]) for entry in entries]
        reasons = dict.fromkeys(entry.reason for entry in entries if entry and entry.value is None)
        kind = next(iter(answers.values())).kind
        missing = [f"No value: {reason}." for reason in reasons if reason]
        rows.append((name, texts, " ".join([quantities.describe_quantity(name, kind), *missing])))
    return rows, zeros


def _find_uncertainty(quantity: Quantity) -> float:
    """Return the half-width of the interval of a quantity, but at least its floor, the smallest value that is not 0."""
    if None in (quantity.low, quantity.high):
        return quantity.floor
    return max((quantity.high - quantity.low) / 2, quantity.floor)


def format_entry(name: str, quantity: Quantity | None, first: Quantity | None) -> str:
    """Return a quantity as text, with its change from the first answer if it differs by more than both errors.

    The change is in percent, or a factor if it is large. There is none from a value that may be 0.

    Parameters
    ----------
    name : str
        Name of the quantity.
    quantity, first : Quantity or None
        The quantity of an answer and that of the first answer.
    """
    if quantity is None:
        return ""
    text = format_quantity(name, quantity)
    if first is None or None in (quantity.value, first.value) or quantity.unit != first.unit:
        return text
    uncertainty = _find_uncertainty(first)
    limit = uncertainty + _find_uncertainty(quantity)
    if abs(quantity.value - first.value) <= limit or abs(first.value) <= uncertainty:
        return text
    factor = quantity.value / first.value
    # Smallest ratio to the first value that is written as a factor
    if abs(factor) >= 10.0:
        return f"{text} (x {format_number(factor, 2)})"
    change = (quantity.value - first.value) / abs(first.value)
    return f"{text} ({100 * change:+.{1 if abs(change) > 0.01 else 2}f} %)"


def list_scene_differences(answers: Answers) -> list[Table]:
    """Return a table of the keys in which the resolved scenes differ, as `columns.make_tables` does, or [] without any."""
    scenes = {
        name: _flatten_tables(tomllib.loads(answer.origin.get("resolved", "")))
        for name, answer in answers.items()
    }
    rows = []
    for key in dict.fromkeys(key for scene in scenes.values() for key in scene):
        texts = [str(scene.get(key, "-")) for scene in scenes.values()]
        if len(set(texts)) > 1:
            # Largest number of characters of a value of a scene
            rows.append([key, *(shorten(text, 80) for text in texts)])
    table = {"title": "Where the scenes differ", "headings": ["key", *answers], "rows": rows}
    return [table] if rows else []


def _flatten_tables(table: TomlValue, prefix: str = "") -> dict[str, TomlValue]:
    """Return nested tables of a scene as dotted keys.

    Tables of a list are named by their name or number.
    """
    if isinstance(table, dict):
        pairs = table.items()
    elif isinstance(table, list) and table and isinstance(table[0], dict):
        pairs = [(entry.get("name", number), entry) for number, entry in enumerate(table, 1)]
    else:
        return {prefix: table}
    flat = {}
    for name, entry in pairs:
        flat |= _flatten_tables(entry, f"{prefix}.{name}" if prefix else str(name))
    return flat


def _encode_base64(content: bytes) -> str:
    """Return bytes in base64."""
    return base64.b64encode(content).decode()


@cache
def read_library() -> str:
    """Return the compressed bundle of plotly.js in base64."""
    return _encode_base64(
        (files(__package__) / "plotly" / "plotly-cartesian.min.js.gz").read_bytes()
    )


@cache
def _read_template():
    """Return the template of all pages."""
    from jinja2 import Environment

    text = (files(__package__) / "page.html").read_text("utf-8")
    environment = Environment(autoescape=True, trim_blocks=True)
    # sentences mark keys and measures by backquotes, which a page does not show
    environment.filters["plain"] = lambda sentence: sentence.replace("`", "")
    environment.filters["words"] = lambda name: name.replace("_", " ")
    environment.globals |= {"quantities": quantities}
    return environment.from_string(text)
