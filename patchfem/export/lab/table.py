"""Columns as CSV with units in the header and all digits, so that the same bits are read."""

from pathlib import Path

from .series import Column


def write_columns(path: Path, time, columns: list) -> None:
    """Write columns with headers such as `force [N]`, the time (k,) [s] first if there is one."""
    whole = [*([] if time is None else [Column("time", "s", time, 0)]), *columns]
    lines = [",".join(f"{one.label} [{one.unit}]" for one in whole)]
    lines += [",".join(map(repr, row)) for row in zip(*(one.values.tolist() for one in whole))]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
