"""Columns as CSV: units in the header, numbers with every digit, so that reading them gives the same bits."""

from pathlib import Path

from .series import Column


def write(path: Path, time, columns: list) -> None:
    """Write `Column`s, time (k,) [s] or None first, with headers like `force [N]`."""
    whole = [*([] if time is None else [Column("time", "s", time, 0)]), *columns]
    lines = [",".join(f"{one.label} [{one.unit}]" for one in whole)]
    lines += [",".join(map(repr, row)) for row in zip(*(one.values.tolist() for one in whole))]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
