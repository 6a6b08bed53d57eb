"""Comparisons of a table of pairs, with the means over the pairs, as text, data and a page."""

from collections.abc import Callable
from html import escape
from pathlib import Path

from ... import __version__
from ...core import PatchfemError
from ...disk.atomic_write import write_rows, write_text
from ...formatting import format_number
from ...surface.compare import pairs, verdict
from ..pages.document import (
    Section,
    document_html,
    figure_html,
    sentence_html,
    table_html,
    warning_box,
)
from . import compare, worn
from .pictures import PairsPanel, draw_pairs
from .quantities import UNITS, QuantityTable, Row, csv_columns, format_quantity
from .worn_runs import compare_runs

TRACE_QUANTITIES = ("worn_depth_mean", "amplitude_ratio")  # main quantities of a pair of traces
SCAN_QUANTITIES = ("worn_volume", "worn_depth_mean")  # main quantities of a pair of scans or runs
MEANS_NOTE = (
    "The mean is taken over the pairs that have a value, each with equal weight. The interval is "
    "the 95 % interval of the mean, by Student's t from the scatter of the pairs, or from the "
    "intervals of the pairs if these give a wider interval. The interval does not include an error "
    "that all pairs share, such as calibration. The scatter is the standard deviation of the "
    "values of single pairs."
)


def compare_pairs(
    table_lines: list, direction: str = "", report_fraction: Callable | None = None, **settings
) -> list[dict]:
    """Compare the surfaces of each pair that a table lists, from files or results folders.

    Parameters
    ----------
    table_lines : list of TableLine
    direction : str
        Axis of the traces whose line in the table states none.
    report_fraction : callable, optional
        Receives the fraction of the pairs that are done.
    **settings
        units, shift, keep_spikes and datum of all files (`verdict.judge_files`).

    Returns
    -------
    list of dict
        Plain data of each pair (`pairs.compare_pairs`).
    """

    def answer(paths: tuple, pair_direction: str) -> dict:
        if not any(path.is_dir() for path in paths):
            return compare.comparison_data(
                *verdict.judge_files(paths, pair_direction or direction, **settings)
            )
        if pair_direction or settings.get("shift") is not None:
            option = "a direction" if pair_direction else "a shift"
            raise PatchfemError(f"{option} can be given only for traces, not for results folders")
        wear = compare_runs(*paths)
        return worn.wear_data(wear, worn.wear_verdict(wear))

    return pairs.compare_pairs(table_lines, answer, report_fraction)


def pairs_data(rows: list) -> dict:
    """Return the comparisons of all pairs, and the means over them, as a dict in SI units."""
    means = []
    for (group, direction, kind), count, averages in pairs.average_pairs(rows):
        entry = {"group": group, "direction": direction or None, "kind": kind, "pairs": count}
        for name, average in averages.items():
            value, low, high, unit = average.mean[:4]
            entry[name] = {"value": value, "low": low, "high": high, "unit": unit}
            entry[name] |= {"scatter": average.scatter, "pairs": average.count}
        means.append(entry)
    return {"patchfem": __version__, "pairs": rows, "means": means, "notes": mean_notes(rows)}


def mean_notes(rows: list) -> list:
    """Write sentences on the limits of the means over pairs."""
    out = []
    firsts = [(pairs.find_group(row), row["before"]) for row in rows if row["outcome"] == "done"]
    if len(set(firsts)) < len(firsts):
        out.append(
            "some pairs share the surface measured before wear; the errors of this surface are "
            "then common to these pairs, and the intervals of the means do not include such common "
            "errors"
        )
    for group, count, averages in pairs.average_pairs(rows):
        fewer = [
            f"{_quantity_name(name)} ({average.count})"
            for name, average in averages.items()
            if average.count < count
        ]
        if fewer:
            out.append(
                f"{_group_title(*group)}: not all {count} pairs have a value of {', '.join(fewer)}; the "
                "mean of this value says nothing about the other pairs"
            )
    return out


def _quantity_name(name: str) -> str:
    """Return the name of a quantity of a pair.

    `amplitude_ratio_y` is the one of the other direction of a scan.
    """
    if name in compare.QUANTITY_LABELS:
        return compare.QUANTITY_LABELS[name]
    return f"{compare.QUANTITY_LABELS[name.removesuffix('_x').removesuffix('_y')]} along {name[-1]}"


def _group_title(group: str, direction: str, kind: str) -> str:
    """Return the title of a group of pairs over which means are taken."""
    along = f"along {direction}" if direction else ""
    return ", ".join(filter(None, (group, pairs.KINDS[kind], along)))


def write_csv(rows: list, path: Path) -> None:
    """Write the comparisons of all pairs as CSV, with quantities in SI units."""
    quantities = [pairs.collect_quantities(row) for row in rows]
    columns = csv_columns(quantities)
    before = ("before", "after", "direction")
    after = ("outcome", "verdict", "message")
    labels = {}
    names = set()
    for row, own in zip(rows, quantities):
        labels |= row["labels"]
        names |= own.keys()
    labels = [label for label in labels if label not in (*before, *after, *names)]
    lines = [[*before, *labels, *after, *columns.heads]]
    for row, cells in zip(rows, columns.cells):
        first = [row[name] or "" for name in before]
        first += [row["labels"].get(label, "") for label in labels]
        first += [row.get(name, "") for name in after]
        lines.append([*first, *cells])
    write_rows(path, lines)


def format_pairs(rows: list) -> list:
    """Return the comparisons of all pairs and the means of each group as lines of text."""
    out = [_count_sentence(rows), ""]
    for row in rows:
        out.append(f"{row['before']} -> {row['after']}{_direction_text(row)}")
        out.append("; ".join([f"  {row['message'] or row['verdict']}", *_main_texts(row)]))
    for group, count, averages in pairs.average_pairs(rows):
        if averages:
            out += ["", _group_heading(group, count), *_means_table(averages).lines()]
    return out


def _count_sentence(rows: list) -> str:
    """Write a sentence with the numbers of pairs, of pairs with wear and of failed pairs."""
    failed = sum(row["outcome"] == "failed" for row in rows)
    with_wear = sum(
        (row[_main_names(row)[0]]["low"] or 0.0) > 0 for row in rows if row["outcome"] == "done"
    )
    text = f"{len(rows)} pairs, {with_wear} with detected wear"
    return f"{text}, {failed} failed" if failed else text


def _main_names(row: dict) -> tuple:
    """Return the names of the main quantities of a pair."""
    return SCAN_QUANTITIES if "worn_volume" in row else TRACE_QUANTITIES


def _direction_text(row: dict) -> str:
    """Return the direction of a pair of traces as text."""
    return (
        f", along {row['direction']}"
        if row["direction"] and _main_names(row) == TRACE_QUANTITIES
        else ""
    )


def _main_texts(row: dict) -> list:
    """Return the main quantities of a pair that have an interval, as strings."""
    if row["outcome"] == "failed":
        return []
    out = []
    for name in _main_names(row):
        text = format_quantity(pairs.parse_quantity(row[name]))
        if text.interval:
            interval = text.interval.replace(" .. ", " to ")
            out.append(f"{_quantity_name(name)} {text.value} ({interval}) {text.unit}".rstrip())
    return out


def _means_table(averages: dict) -> QuantityTable:
    """Return the table of the means of a group of pairs, with their scatter."""
    rows = []
    for name, average in averages.items():
        unit = format_quantity(average.mean).unit
        scale = dict(UNITS[average.mean.unit])[unit]
        rows.append(
            Row(
                _quantity_name(name),
                average.mean,
                more=(format_number(average.scatter * scale, 3), str(average.count)),
            )
        )
    return QuantityTable(("quantity", "mean", "95 %", "scatter", "pairs", "unit"), rows)


def page_html(rows: list, name: str) -> str:
    """Return the self-contained page of a table of pairs."""
    lead = f"<p class=soft>patchfem {escape(__version__)}</p><div class=verdict><b>{_count_sentence(rows)}.</b></div>"
    lead += warning_box([f"{text}." for text in mean_notes(rows)])
    sections = []
    for number, (group, count, averages) in enumerate(pairs.average_pairs(rows)):
        if averages:
            rows_of_group = [
                row for row in rows if row["outcome"] == "done" and pairs.find_group(row) == group
            ]
            sections.append(
                Section(
                    f"means{number}",
                    _group_heading(group, count),
                    _means_html(number, rows_of_group, averages),
                )
            )
    lines = []
    for row in rows:
        names = (row["before"], row["after"] + _direction_text(row), *row["labels"].values())
        outcome = sentence_html(row["message"] or row["verdict"])
        lines.append(
            [str(row["line"]), *map(escape, names), outcome, escape("; ".join(_main_texts(row)))]
        )
    heads = (
        ">line",
        "before",
        "after",
        *map(escape, rows[0]["labels"]),
        "verdict",
        "main numbers, 95 %",
    )
    sections.append(Section("pairs", "Each pair", table_html(heads, lines)))
    return document_html(f"{name}: pairs before and after", lead, sections)


def _group_heading(group: tuple, count: int) -> str:
    """Return the heading of the means of a group of pairs."""
    text = _group_title(*group)
    return f"{text[0].upper()}{text[1:]}: mean of {count} pairs"


def _means_html(number: int, rows: list, averages: dict) -> str:
    """Return the picture and the table of the means of a group of pairs as HTML."""
    panels = []
    for name in _main_names(rows[0]):
        if name in averages:
            values = {row["line"]: pairs.parse_quantity(row[name]) for row in rows}
            panels.append(PairsPanel(_quantity_name(name), values, averages[name].mean))
    parts = []
    if panels:
        caption = (
            "Each point is one pair with its interval, plotted over the line number of the pair in "
            "the table. The band is the mean with its interval."
        )
        texts = [f"{panel.title}: mean {format_quantity(panel.mean).short}" for panel in panels]
        parts.append(figure_html(f"m{number}", draw_pairs(panels), caption, "; ".join(texts)))
    return "\n".join(
        [*parts, _means_table(averages).html(), f"<p class=soft>{sentence_html(MEANS_NOTE)}</p>"]
    )


def write_page(path: Path, rows: list, name: str) -> None:
    """Write the page of a table of pairs.

    Parameters
    ----------
    path : Path
    rows : list of dict
    name : str
        Name of the table.
    """
    write_text(path, page_html(rows, name))
