"""report.html: a self-contained page, made from the files of one or several answers alone.

Every page has the same template: verdict, tiles with the key numbers, charts, tables, all measures, notes and origin.
"""

import base64
import gzip
import json
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np

from ..core import PatchfemError
from ..disk.atomic_write import explain_write_error, write_text
from ..formatting import format_number
from . import quantities, several, store
from .answer import Answer, Answers, JsonObject, Quantity
from .charts import panels, plotly
from .charts.table import CHARTS, TABLES, Column, parse_columns
from .columns import Cells, list_rows, make_quantity

# what a file beside a page is, by its name or its ending
FILE_TEXTS = {
    "fields.vtkhdf": "fields of both pieces and their interface, frame by frame (ParaView 5.13 or newer)",
    "interfaces": "fields of every interface that has a patch of its own, in the same format",
    "summary.json": "verdict, quantities with their errors, warnings and notes, in SI units",
    "scene.resolved.toml": "the scene in SI units, with all default values",
    "scene.fitted.toml": "the scene with the fitted values, ready to run",
    ".nc": "histories, curves and fields along the interface (xarray, MATLAB, ncdump)",
    ".csv": "columns of a table or of a curve (spreadsheet)",
    ".json": "all numbers of this answer, in SI units",
}
WIDE_STYLES = ("relative", "menu", "maps", "film")  # charts of the whole width, which are taller
COMPRESSION = 6  # level of the compression of the figures in a page


def write_page(folder: Path) -> Path:
    """Write report.html into a folder from the other files of the folder, and return its path.

    Raises
    ------
    PatchfemError
        If the folder has no complete result.
    """
    path = Path(folder) / store.PAGE
    write_text(path, make_page([Path(folder)]))
    return path


def write_report(folders: list[Path], out: Path | None = None) -> Path:
    """Write the page of one folder again, or of several folders side by side, and return its path.

    Parameters
    ----------
    folders : list of Path
        Results folders, of answers of the same kind.
    out : Path, optional
        The page; by default report.html in a single folder, else in the current folder.

    Raises
    ------
    PatchfemError
        If a folder has no complete result, or if the results are of different kinds.
    Missing
        If the page cannot be written.
    """
    text = make_page([Path(folder) for folder in folders])
    path = Path(out or (Path(folders[0]) / store.PAGE if len(folders) == 1 else store.PAGE))
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
    answers = _read_all(folders)
    figures = _draw_charts(answers)
    content = _describe_measures(answers)
    if len(folders) == 1:
        figures += _draw_films(folders[0])
        _add_captions(figures, answers[""].details.get("captions", {}))
        content |= _describe_answer(answers[""]) | {"files": _list_files(folders[0])}
    else:
        content |= _describe_several(answers)

    for number, figure in enumerate(figures):
        figure["anchor"] = f"chart{number}"
    content |= {
        "figures": figures,
        "data": pack_figures([_strip(figure) for figure in figures]),
        "library": read_library() if figures else "",
    }
    return _template().render(content)


def _read_all(folders: list[Path]) -> Answers:
    """Return the answers in folders by their names in legends, such as "load 4 kN"; "" for a single answer."""
    if not folders:
        raise PatchfemError("report: at least one results folder is needed")
    if len(folders) == 1:
        return {"": store.read(folders[0])}
    answers = {}
    for folder in folders:
        answer = store.read(folder)
        # a case of a sweep is named by its keys, any other answer by its folder
        case = answer.details.get("case") if answer.is_run else None
        name = ", ".join(f"{key.rpartition('.')[2]} {value}" for key, value in (case or {}).items())
        name = name or folder.resolve().name
        answers[f"{name} ({len(answers) + 1})" if name in answers else name] = answer

    if len({"run" if answer.is_run else answer.kind for answer in answers.values()}) > 1:
        kinds = ", ".join(f"{name}: {answer.kind}" for name, answer in answers.items())
        raise PatchfemError(f"report: the folders have results of different kinds ({kinds})")
    return answers


def _draw_charts(answers: Answers) -> list[plotly.Figure]:
    """Return the figures of all charts for which the answers have data."""
    charts = CHARTS[next(iter(answers.values())).kind]
    return [
        plotly.draw(panel) | {"wide": panel.style in WIDE_STYLES}
        for panel in panels.make_panels(answers, charts)
    ]


def _add_captions(figures: list[plotly.Figure], captions: dict[str, str]) -> None:
    """Add the sentences with the numbers of an answer to the captions of its figures, which their titles name."""
    for figure in figures:
        if figure["title"] in captions:
            figure["caption"] += f" {captions[figure['title']]}"


def _describe_measures(answers: Answers) -> JsonObject:
    """Return warnings and measures of all answers as parts of a page; measures that are zero in all of them apart."""
    names = dict.fromkeys(name for answer in answers.values() for name in answer.quantities)
    zeros = [name for name in names if _is_zero_in_all(name, answers)]

    # every answer is compared with the first one
    first = next(iter(answers.values()))
    measures = [
        {
            "name": f"measure-{name}",
            "label": name.replace("_", " "),
            "texts": [_format_entry(name, answer, first) for answer in answers.values()],
            "meaning": _explain(name, answers),
        }
        for name in names
        if name not in zeros
    ]
    return {
        "warnings": _label_all(answers, lambda answer: answer.remarks.warnings),
        "measures": measures,
        "has_errors": any("±" in text for row in measures for text in row["texts"]),
        "zeros": [name.replace("_", " ") for name in zeros],
    }


def _is_zero_in_all(name: str, answers: Answers) -> bool:
    """Return whether all answers have a measure and display it as 0."""
    known = [answer.quantities.get(name) for answer in answers.values()]
    return all(one is not None and quantities.is_zero(name, one) for one in known)


def _describe_several(answers: Answers) -> JsonObject:
    """Return title, verdict and tables of a page on several answers."""
    headlines = _label_all(answers, lambda answer: answer.verdict[:1])
    kind = next(iter(answers.values())).kind
    return {
        "title": ", ".join(answers),
        "subtitle": f"{kind} · {len(answers)} results",
        "verdict": headlines,
        "heading": list(answers),
        "tables": several.list_scene_differences(answers),
    }


def _describe_answer(answer: Answer) -> JsonObject:
    """Return title, verdict, tiles, tables, notes and origin of a page on one answer."""
    origin = answer.origin
    versions = ", ".join(f"{name} {text}" for name, text in origin.get("versions", {}).items())
    # texts that a reader has to unfold
    texts = {
        "Scene": origin.get("scene"),
        "Scene in SI with all defaults": origin.get("resolved"),
        "Versions": versions,
    }
    return {
        "title": answer.title or f"patchfem {answer.kind}",
        "subtitle": _subtitle(answer),
        "verdict": answer.verdict,
        "tiles": make_tiles(answer),
        "tables": make_tables(answer),
        "notes": answer.remarks.notes,
        "command": origin.get("command", ""),
        "sources": "files" if answer.kind in quantities.SURFACE_KINDS else "scene",
        "effects": answer.details.get("effects", []),
        "texts": [(name, text) for name, text in texts.items() if text],
    }


def _label_all(answers: Answers, get_sentences) -> list[str]:
    """Return the sentences of all answers, each with the name of its answer if there are several."""
    return [
        f"{name}: {sentence}" if name else sentence
        for name, answer in answers.items()
        for sentence in get_sentences(answer)
    ]


def _subtitle(answer: Answer) -> str:
    """Return the line below the title: version, kind, outcome, engine and time."""
    details = answer.details
    engine = (details.get("numerics") or {}).get("engine", "") if answer.is_run else ""
    seconds = (details.get("seconds") or {}).get("total") if answer.is_run else None
    parts = (
        f"patchfem {answer.origin.get('patchfem', '')}".strip(),
        answer.kind,
        answer.details.get("outcome", "") if answer.is_run else "",
        f"engine {engine}" if engine else "",
        f"computed in {seconds:.2f} s" if seconds is not None else "",
    )
    return " · ".join(part for part in parts if part)


def make_tiles(answer: Answer) -> list[dict[str, str]]:
    """Return the tiles of the key quantities: `label`, `text` and `meaning` of each."""
    return [
        {
            "label": name.replace("_", " "),
            "text": quantities.format_quantity(name, quantity),
            "meaning": quantities.describe(name, answer.kind),
        }
        for name, quantity in quantities.choose_key(answer.quantities).items()
    ]


def _format_entry(name: str, answer: Answer, first: Answer) -> str:
    """Return a measure as text with its change from the first answer; "" if it is absent."""
    return several.format_entry(name, answer.quantities.get(name), first.quantities.get(name))


def _explain(name: str, answers: Answers) -> str:
    """Return the definition of a measure, and why it has no value in an answer."""
    found = [answer.quantities[name] for answer in answers.values() if name in answer.quantities]
    kind = next(iter(answers.values())).kind
    reasons = dict.fromkeys(one.reason for one in found if one.value is None and one.reason)
    return " ".join(
        [quantities.describe(name, kind), *(f"No value: {reason}." for reason in reasons)]
    )


def make_tables(answer: Answer) -> list[several.Table]:
    """Return the tables of an answer that have rows: `title`, `headings` and `rows` of strings."""
    tables = []
    for table in TABLES.get(answer.kind, ()):
        rows = list_rows(answer, table.source)
        known = {name for row in rows for name in row}
        columns = [one for one in parse_columns(table.columns) if one.name in known]
        tables.append(
            {
                "title": table.title,
                "headings": [column.heading.replace("_", " ") for column in columns],
                "rows": [[_format_cell(row, column) for column in columns] for row in rows],
            }
        )
    return [table for table in tables if table["rows"]]


def _format_cell(row: Cells, column: Column) -> str:
    """Return a cell of a table as text; a missing value is a dash."""
    cell = row.get(column.name)
    if cell is not None and column.style == "quantity":
        cell = make_quantity(row)
    if column.style == "rounded":
        number = getattr(cell, "value", cell)
        return "-" if number is None else format_number(number, 3)
    if cell is None:
        return "-"
    if isinstance(cell, Quantity):
        return quantities.format_quantity(column.name, cell)
    if isinstance(cell, float):
        return f"{100 * cell:+.3g} %" if column.style == "percent" else format_number(cell, 6)
    return str(cell).replace("_", " ") if column.style == "name" else str(cell)


def _draw_films(folder: Path) -> list[plotly.Figure]:
    """Return the figure of the stress in both pieces with a slider over the frames, if the folder has the fields."""
    path = folder / store.FIELDS
    if not path.is_file():
        return []
    panel = make_stress_panel(path)
    return [] if panel is None else [plotly.draw(panel) | {"wide": True}]


def make_stress_panel(path: Path) -> panels.Panel | None:
    """Return the panel of the stress in both pieces from a file of fields; None if the pieces do not touch."""
    from .fields.film import stress_frames

    frames = stress_frames(path)
    if not np.nanmax(frames["values"], initial=0.0) > 0:
        return None
    return panels.make_film(frames, "von Mises stress in both pieces", "Pa")


def _list_files(folder: Path) -> list[tuple[str, str]]:
    """Return name and description of the files beside the page of an answer."""
    paths = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    texts = {path.name: FILE_TEXTS.get(path.name) or FILE_TEXTS.get(path.suffix) for path in paths}
    return [(name, text) for name, text in texts.items() if text]


def _strip(figure: plotly.Figure) -> plotly.Figure:
    """Return the entries of a figure that the script of the page reads."""
    return {key: figure[key] for key in ("anchor", "data", "layout", "frames") if key in figure}


def pack_figures(content: list[plotly.Figure]) -> str:
    """Return an object as compressed JSON in base64; equal objects give equal strings."""
    text = json.dumps(content, separators=(",", ":"), allow_nan=False)
    return base64.b64encode(gzip.compress(text.encode(), COMPRESSION, mtime=0)).decode()


@cache
def read_library() -> str:
    """Return the compressed bundle of plotly.js in base64."""
    path = files(__package__) / "plotly" / "plotly-cartesian.min.js.gz"
    return base64.b64encode(path.read_bytes()).decode()


@cache
def _template():
    """Return the template of all pages."""
    from jinja2 import Environment

    text = (files(__package__) / "page.html").read_text("utf-8")
    environment = Environment(autoescape=True, trim_blocks=True)
    # sentences mark keys and measures by backquotes, which a page does not show
    environment.filters["plain"] = lambda sentence: sentence.replace("`", "")
    return environment.from_string(text)
