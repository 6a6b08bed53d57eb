"""The pressed and sliding pieces through the last cycle, as data that `player.js` plays in a page.

The slide of the upper piece as a whole is kept apart from the rest of its motion, which contains the gap: each is drawn
with a factor of its own. What a page can hold is a sample: some frames, and fewer cells than fields.vtkhdf has.
"""

from base64 import b64encode
from pathlib import Path

import numpy as np

from ...disk.atomic_write import write_text
from ...formatting import axis_unit
from ..drawing.panels import corners, shape, slides
from ..fields.series import Series, moving
from ..fields.vtkhdf import NAME
from .document import Section, document
from .library import own
from .thinned import spread, thinned

# at most: frames, cells of a piece, places along the interface
FRAMES, CELLS, PLACES = (
    24,
    5000,
    400,
)
BYTES = 520_000  # of all frames together, before they are written as text
# of a cell; whether it has a sign
COLOURS = (
    ("von Mises stress", False),
    ("stress along x", True),
    ("stress across the interface", True),
    ("shear stress", True),
)
CURVES = (
    ("normal_stress", "pressure"),
    ("shear_stress", "shear traction"),
    ("gap", "gap"),
    ("slip", "slide"),
)
NARROW = 0.25  # share of the length below which the contact gets half of what is shown
MM = 1e3


def packed(values) -> dict:
    """An array as {low, step, shape, data}: value = low + step * number, numbers of 16 bits in base 64.

    65535 stands for a value that is not finite; rounding takes at most 1e-5 of the range.
    """
    values = np.asarray(values, float)
    there = np.isfinite(values)
    low, high = (
        (float(values[there].min()), float(values[there].max())) if there.any() else (0.0, 0.0)
    )
    step = (high - low) / 65534
    number = np.where(
        there, np.rint((np.where(there, values, low) - low) / (step or 1.0)), 65535
    ).astype("<u2")
    return {
        "low": low,
        "step": step,
        "shape": list(values.shape),
        "data": b64encode(number.tobytes()).decode(),
    }


def reel(folder: Path) -> dict | None:
    """What the player shows of the results in a folder, lengths in mm; None where they have no fields.

    times: [s] of the frames; of: how many the file has there; pieces: lower and upper, each with points (p, 2), cells
    (c, 4), coated (c,), moves (f, p, 2) and colours, one (f, c) for each of COLOURS; slide: (f,); curves: of the
    interface, (f, n) over the places x (n,); status: (f, n), 0 open, 1 sticks, 2 slips, where it is known.
    """
    return _reel(folder) if (Path(folder) / NAME).is_file() else None


def write_page(folder: Path, out: Path) -> str:
    """Write a page with the player of the results in a folder; one line on it. Missing without fields."""
    film = _reel(folder)
    write_text(
        out,
        document(
            Path(folder).resolve().name,
            "",
            [section(film)],
            {"charts": [], "player": film},
            ("figures.js", "stage.js", "player.js"),
        ),
    )
    return f"{out}: {len(film['times'])} frames"


def _reel(folder: Path) -> dict:
    with Series(folder) as series:
        cycle = np.array(moving(series.times))
        numbers = cycle[
            np.linspace(0, cycle.size - 1, min(FRAMES, cycle.size)).round().astype(int)
        ].tolist()
        x = series.points("interface")[:, 0]
        most = min(int((BYTES / len(numbers) - 10 * min(PLACES, x.size)) / 24), CELLS)
        line = {
            name: series.stack("interface", "PointData", name, numbers)
            for name in ("displacement", *(name for name, _ in CURVES), "status")
            if name in series.names("interface", "PointData")
        }
        near = _contact(x, line["normal_stress"])
        places = spread(x, min(PLACES, x.size) - 1, near)
        lower = _piece(series, "lower", numbers, most, near)
        upper = _piece(series, "upper", numbers, most, near)
        slide = _open(upper, x, line)
        times = series.times[numbers]
    unit, scale = axis_unit(
        np.concatenate([piece["colours"].ravel() for piece in (lower, upper)]), "Pa"
    )
    shear = np.any(line.get("shear_stress", 0.0))
    curves = [
        _curve(line[name][:, places], label, "Pa" if name.endswith("stress") else "m")
        for name, label in CURVES
        if name in line and (name == "normal_stress" or np.any(line[name]))
    ]
    force = np.abs(line["shear_stress"] @ np.gradient(x)) if "shear_stress" in line else np.zeros(1)
    return {
        "times": times,
        "of": cycle.size,
        "first": int(np.argmax(force)) if np.any(force) else len(numbers) - 1,
        "pieces": [_told(piece, scale) for piece in (lower, upper)],
        "slide": slide * MM,
        "cells": [
            sum(sizes)
            for sizes in zip(
                *((len(mesh.cells), len(mesh.order)) for mesh in (lower["mesh"], upper["mesh"]))
            )
        ],
        "colours": [{"label": label, "signed": signed, "unit": unit} for label, signed in COLOURS],
        "x": packed(x[places] * MM),
        "curves": curves,
    } | ({"status": packed(line["status"][:, places])} if "status" in line and shear else {})


def _contact(x, sigma) -> tuple | None:
    """Twice the part of x (n,) that touches in some frame of sigma (f, n), where that is short; None elsewhere."""
    touching = x[np.any(sigma > 0, axis=0)]
    if not touching.size or np.ptp(touching) > NARROW * np.ptp(x):
        return None
    more = np.ptp(touching) / 2 + 4 * np.ptp(x) / x.size
    return touching[0] - more, touching[-1] + more


def _piece(series: Series, side: str, numbers: list, most: int, near: tuple | None) -> dict:
    """A piece thinned to `most` cells: its mesh, all its points [m], its moves (f, n, 2) [m] and colours [Pa]."""
    points = series.points(side)[:, :2]
    cells = corners(*series.cells(side))
    coated = series.stack(side, "CellData", "material", [0])[0] > 0
    mesh = thinned(points, cells, coated, most, near)
    moves = series.stack(side, "PointData", "displacement", numbers)[..., :2].astype(float)
    stress = series.stack(side, "CellData", "stress", numbers)
    rows = np.stack(
        [series.stack(side, "CellData", "von_mises", numbers), *(stress[..., k] for k in (0, 1, 3))]
    )
    means = mesh.means(np.nan_to_num(rows).reshape(-1, len(cells)).T).T  # all frames in one sum
    colours = means.reshape(*rows.shape[:2], -1)
    return {
        "points": points,
        "mesh": mesh,
        "coated": coated[mesh.order[mesh.starts]][mesh.groups],
        "moves": moves,
        "colours": colours,
    }


def _open(upper: dict, x, line: dict) -> np.ndarray:
    """Take the slide as a whole (f,) [m] out of the moves of the upper piece and put the gap into them."""
    points, moves = upper["points"], upper["moves"]
    slide = slides(points, moves)
    moves[:, :, 0] -= slide[:, None]
    moves[:, :, 1] += shape(points, moves[:, :, 1], x, line["displacement"][..., 1] + line["gap"])
    return slide


def _told(piece: dict, scale: float) -> dict:
    mesh = piece["mesh"]
    return {
        "points": packed(piece["points"][mesh.nodes] * MM),
        "cells": packed(mesh.cells),
        "coated": packed(piece["coated"]),
        "moves": packed(piece["moves"][:, mesh.nodes] * MM),
        "colours": [packed(one * scale) for one in piece["colours"]],
    }


def _curve(values, label: str, unit: str) -> dict:
    name, scale = axis_unit(values, unit)
    return {"label": label, "unit": name, "values": packed(values * scale)}


def section(film: dict) -> Section:
    """The part of a page in which the player stands."""
    frames, (cells, fine) = len(film["times"]), film["cells"]
    label, scale = axis_unit(film["times"], "s")
    still = f"The pressed state, {cells} cells"
    if frames > 1:
        still = (
            f"{frames} frames from {film['times'][0] * scale:.6g} to {film['times'][-1] * scale:.6g} {label}, "
            f"{cells} cells"
        )
    less = [f"{film['of']} frames"] * (film["of"] > frames) + [f"{fine} cells"] * (fine > cells)
    sample = (
        (
            f"; only a sample of {' and '.join(less)} is drawn, each cell with the mean of the cells that it "
            "replaces"
        )
        if less
        else ""
    )
    text = f"{still}{sample}. Motion and gap are magnified by one factor"
    text += (
        (
            ", the slide of the upper piece as a whole by another factor; colours and scales are the same in every "
            "frame. "
            "Press space to play and the arrow keys to step."
        )
        if frames > 1
        else "."
    )
    return Section(
        "player", "The pieces, frame by frame", own("player.html").replace("CAPTION", text)
    )
