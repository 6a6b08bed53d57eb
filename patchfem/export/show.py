"""The answer of a verb as lines on the screen: verdict, key numbers, and one line for each file."""

import shlex
from pathlib import Path

from . import quantities, store
from .answer import Answer


def make_lines(answer: Answer, is_verbose: bool = False) -> list[str]:
    """Return the lines of an answer for the standard output, without warnings and notes.

    Parameters
    ----------
    answer : Answer
    is_verbose : bool
        Whether all quantities are shown instead of the key quantities.
    """
    lines = [answer.title] if answer.title else []
    lines += answer.verdict
    shown = answer.quantities if is_verbose else quantities.choose_key(answer.quantities)
    width = max(map(len, shown), default=0)
    for name, quantity in shown.items():
        text = quantities.format_quantity(name, quantity)
        reason = f" ({quantity.reason})" if quantity.value is None and quantity.reason else ""
        lines.append(f"  {name:<{width}}  {text}{reason}")
    return lines


def list_files(folder: Path) -> list[str]:
    """Return a line for the results folder, and for its page, its fields and its main table if it has them."""
    lines = [f"results: {folder}"]
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
