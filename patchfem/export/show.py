"""The answer of a verb as lines on the screen: verdict, key numbers, and one line for each file."""

import shlex
from pathlib import Path

from ..formatting import format_number
from . import quantities, store
from .answer import Answer, Quantities, Quantity


def make_lines(answer: Answer, is_verbose: bool = False) -> list[str]:
    """Return the lines of an answer for the standard output, without warnings and notes.

    is_verbose: whether all quantities are shown instead of the key quantities.
    """
    lines = [answer.title] if answer.title else []
    lines += answer.verdict
    if answer.kind == "cost":
        lines += _format_costs(answer)
    shown = answer.quantities if is_verbose else quantities.choose_key(answer.quantities)
    return lines + format_quantities(shown)


def _format_costs(answer: Answer) -> list[str]:
    """Return an aligned line for each run of `cost`: setting, CPU time, and value and error of the main measure."""
    data = answer.data
    main = next((name for name in answer.quantities if f"error_{name}" in data), None)
    rows = []
    for k, seconds in enumerate(data["seconds"].values.tolist()):
        cells = [f"{data['knob'].values[k]} {data['setting'].values[k]}"]
        cells.append(f"{format_number(seconds, 2)} CPU s")
        if main is not None:
            value, error = (data[name].values[k] for name in (main, f"error_{main}"))
            quantity = Quantity(value, data[main].unit, error)
            cells.append(f"{main} {quantities.format_quantity(main, quantity)}")
        rows.append(cells)

    # The last column needs no width
    widths = [max(map(len, column)) for column in zip(*rows)]
    widths[-1] = 0
    return ["  " + "  ".join(map(str.ljust, cells, widths)) for cells in rows]


def list_quantities(shown: Quantities) -> list[tuple[str, str]]:
    """Return name and text of each quantity, with the reason for a missing value or error."""
    rows = []
    for name, quantity in shown.items():
        reason = f" ({quantity.reason})" if quantity.reason else ""
        rows.append((name, quantities.format_quantity(name, quantity) + reason))
    return rows


def format_quantities(shown: Quantities) -> list[str]:
    """Return an aligned line for each quantity."""
    rows = list_quantities(shown)
    width = max((len(name) for name, _ in rows), default=0)
    return [f"  {name:<{width}}  {text}" for name, text in rows]


def list_files(folder: Path, has_page: bool = True) -> list[str]:
    """Return a line for the results folder, and for its page, its fields and its main table if it has them."""
    lines = [f"results: {folder}{'' if has_page else ' (without report.html: --no-page)'}"]
    for label, name in (("page", store.PAGE), ("fields", store.FIELDS), ("table", "sweep.csv")):
        if (folder / name).is_file():
            lines.append(f"{label}: {folder / name}")
    inside = sorted(folder.glob("interfaces/*"))
    if inside:
        first = shlex.quote(str(inside[0]))
        lines.append(
            f"fields of each interface: {folder / 'interfaces'}; view: patchfem view {first}"
        )
    return lines
