"""Tables of measured rows of a rig as a laboratory writes them, and those of an oscillator in closed form."""

import numpy as np

from patchfem.core import G_N

MIL = 25.4e-6
HEAD = "frequency [Hz],input [g],acceleration [g],displacement [mil],flag\n"


def write_rows(folder, rows, name="rows.csv"):
    """Write a table of (frequency [Hz], input [m s-2], acceleration [m s-2], displacement [m], flag) and return its path."""
    path = folder / name
    lines = [
        f"{f!r},{a / G_N!r},{format_cell(x, G_N)},{format_cell(y, MIL)},{flag}"
        for f, a, x, y, flag in rows
    ]
    path.write_text(HEAD + "\n".join(lines) + "\n", "utf-8")
    return path


def format_cell(value, unit):
    """Return a value in another unit as text, or "" if it is absent."""
    return value if value == "" else repr(float(value) / unit)


def linear_response(f, level):
    """Return absolute acceleration and relative displacement of a driven oscillator of 141 Hz in closed form."""
    w = 2 * np.pi * f
    wn = 2 * np.pi * 141.0
    z = -level / (wn**2 - w**2 + 2j * 0.03 * wn * w)
    return float(abs(level - w**2 * z)), float(abs(z))


def make_linear_rows(scale=1.0, seen=1.0):
    """Return rows of an oscillator at five frequencies, with gains."""
    out = []
    for f in (120.0, 135.0, 143.0, 150.0, 160.0):
        a, y = linear_response(f, 20.0)
        out.append((f, 20.0, a * scale, y * seen, ""))
    return out
