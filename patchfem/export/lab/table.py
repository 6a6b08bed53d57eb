"""Columns as CSV with units in the header and as many digits as reproduce the same numbers."""

from pathlib import Path

from .series import Column


def write_columns(path: Path, time, columns: list) -> None:
    """Write histories as a table with headers such as `force [N]`.

    Parameters
    ----------
    path : Path
    time : (k,) array [s] or None
        First column, if there is one.
    columns : list of Column
    """
    all_columns = [*([] if time is None else [Column("time", "s", time, 0)]), *columns]
    lines = [",".join(f"{column.label} [{column.unit}]" for column in all_columns)]
    lines += [
        ",".join(map(repr, row)) for row in zip(*(column.values.tolist() for column in all_columns))
    ]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
