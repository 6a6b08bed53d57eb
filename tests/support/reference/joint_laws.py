"""Table of the guide that shows which friction law a joint needs."""

from pathlib import Path

from patchfem.scene.joint_laws import JOINT_LAWS

from .keys import FOLDER, format_table

FILE: Path = FOLDER / "guide/friction.md"
BEGIN = "<!-- joint laws -->\n"
END = "<!-- end -->"
HEAD = ("you know", "you want", "law and its keys", "what it gives, and its limits")


def text() -> str:
    """Return the page of the guide with its table of joint laws generated again."""
    before, _, rest = FILE.read_text("utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    return f"{before}{BEGIN}{format_table(HEAD, _list_rows())}\n\n{END}{after}"


def _format_code(words: tuple) -> str:
    """Return words or keys in the form of code."""
    return ", ".join(f"`{word}`" for word in words)


def _list_rows() -> list[tuple]:
    """Return the rows of the table as texts."""
    rows = []
    for row in JOINT_LAWS:
        keys = _format_code(("static", *row.keys))
        limits = f"{row.gives}. *Limits:* {row.cannot}"
        known, wanted = ", ".join(row.known), ", ".join(row.wanted)
        rows.append((known, wanted, f"**{row.law}**: {keys}", limits))
    return rows
