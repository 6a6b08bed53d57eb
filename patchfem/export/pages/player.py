"""Motion of the pressed and sliding pieces in the last cycle, as data for `player.js`.

The slide of the upper piece as a whole is separated from the rest of its motion, which contains the
gap, because each is drawn with its own factor. A page contains a sample of the data: some frames,
and fewer cells than fields.vtkhdf.
"""

from base64 import b64encode
from pathlib import Path

import numpy as np

from ...disk.atomic_write import write_text
from ...formatting import choose_axis_unit
from ..drawing.panels import cell_corners, surface_shape_motion, upper_piece_slides
from ..fields.series import Series, last_consecutive_frames
from ..fields.vtkhdf import NAME
from .document import Section, document_html
from .library import read_file
from .thinned import reduce_mesh, select_lines

MAX_FRAMES = 24
MAX_CELLS = 5000  # largest number of cells per piece
MAX_POSITIONS = 400  # largest number of positions along the interface
MAX_PLAYER_BYTES = 520_000  # largest size of all frames before they are encoded as text [bytes]
# Label of each stress component, and whether it can be negative.
STRESS_COMPONENTS = (
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
# Largest ratio of contact length to interface length at which the view is limited to
# twice the contact length.
MAX_CONTACT_FRACTION = 0.25
MM_PER_M = 1e3


def pack_array(values) -> dict:
    """Pack an array as integers with offset and step size.

    The numbers have 16 bits and are written in base64; 65535 stands for a value that is not finite.
    Rounding changes a value by at most 1e-5 of the range.
    """
    values = np.asarray(values, float)
    is_finite = np.isfinite(values)
    low, high = (
        (float(values[is_finite].min()), float(values[is_finite].max()))
        if is_finite.any()
        else (0.0, 0.0)
    )
    step = (high - low) / 65534
    number = np.where(
        is_finite, np.rint((np.where(is_finite, values, low) - low) / (step or 1.0)), 65535
    ).astype("<u2")
    return {
        "low": low,
        "step": step,
        "shape": list(values.shape),
        "data": b64encode(number.tobytes()).decode(),
    }


def player_data(folder: Path) -> dict | None:
    """Return the data of the animation player for a results folder, or None if it contains no fields.

    Returns
    -------
    dict or None
        Lengths in mm. times: (f,) [s]; of: number of frames in the file; pieces: lower and upper
        piece, each with points (p, 2), cells (c, 4), coated (c,), moves (f, p, 2) and colours, (f,
        c) for each of STRESS_COMPONENTS; slide: (f,); x: (n,); curves: of the interface, (f, n) at the
        positions x; status: (f, n), 0 open, 1 sticks, 2 slips, if it is known.
    """
    return _read_frames(folder) if (Path(folder) / NAME).is_file() else None


def write_page(folder: Path, out: Path) -> str:
    """Write a page with an animation player of a results folder.

    Missing if the results have no fields.
    """
    film = _read_frames(folder)
    write_text(
        out,
        document_html(
            Path(folder).resolve().name,
            "",
            [player_section(film)],
            {"charts": [], "player": film},
            ("figures.js", "stage.js", "player.js"),
        ),
    )
    return f"{out}: {len(film['times'])} frames"


def _read_frames(folder: Path) -> dict:
    """Read the frames that the player shows from a results folder."""
    with Series(folder) as series:
        cycle = np.array(last_consecutive_frames(series.times))
        numbers = cycle[
            np.linspace(0, cycle.size - 1, min(MAX_FRAMES, cycle.size)).round().astype(int)
        ].tolist()
        x = series.points("interface")[:, 0]
        max_cells = min(
            int((MAX_PLAYER_BYTES / len(numbers) - 10 * min(MAX_POSITIONS, x.size)) / 24), MAX_CELLS
        )
        interface_data = {
            name: series.stack("interface", "PointData", name, numbers)
            for name in ("displacement", *(name for name, _ in CURVES), "status")
            if name in series.names("interface", "PointData")
        }
        contact_range = _contact_range(x, interface_data["normal_stress"])
        positions = select_lines(x, min(MAX_POSITIONS, x.size) - 1, contact_range)
        lower = _read_piece(series, "lower", numbers, max_cells, contact_range)
        upper = _read_piece(series, "upper", numbers, max_cells, contact_range)
        slide = _separate_slide(upper, x, interface_data)
        times = series.times[numbers]
    unit, scale = choose_axis_unit(
        np.concatenate([piece["colours"].ravel() for piece in (lower, upper)]), "Pa"
    )
    shear = np.any(interface_data.get("shear_stress", 0.0))
    curves = [
        _pack_curve(
            interface_data[name][:, positions], label, "Pa" if name.endswith("stress") else "m"
        )
        for name, label in CURVES
        if name in interface_data and (name == "normal_stress" or np.any(interface_data[name]))
    ]
    force = (
        np.abs(interface_data["shear_stress"] @ np.gradient(x))
        if "shear_stress" in interface_data
        else np.zeros(1)
    )
    return {
        "times": times,
        "of": cycle.size,
        "first": int(np.argmax(force)) if np.any(force) else len(numbers) - 1,
        "pieces": [_pack_piece(piece, scale) for piece in (lower, upper)],
        "slide": slide * MM_PER_M,
        "cells": [
            sum(sizes)
            for sizes in zip(
                *((len(mesh.cells), len(mesh.order)) for mesh in (lower["mesh"], upper["mesh"]))
            )
        ],
        "colours": [
            {"label": label, "signed": signed, "unit": unit} for label, signed in STRESS_COMPONENTS
        ],
        "x": pack_array(x[positions] * MM_PER_M),
        "curves": curves,
    } | (
        {"status": pack_array(interface_data["status"][:, positions])}
        if "status" in interface_data and shear
        else {}
    )


def _contact_range(x, sigma) -> tuple | None:
    """Return the ends [m] of a view that contains the contact in every frame.

    The view is about twice as long as the contact. None if the contact is longer than MAX_CONTACT_FRACTION times the
    length.
    """
    touching = x[np.any(sigma > 0, axis=0)]
    if not touching.size or np.ptp(touching) > MAX_CONTACT_FRACTION * np.ptp(x):
        return None
    margin = np.ptp(touching) / 2 + 4 * np.ptp(x) / x.size
    return touching[0] - margin, touching[-1] + margin


def _read_piece(
    series: Series, side: str, numbers: list, max_cells: int, fine_range: tuple | None
) -> dict:
    """Read the mesh and fields of a piece, reduced to fewer cells.

    Parameters
    ----------
    series : Series
    side : {"lower", "upper"}
    numbers : list of int
        Numbers of the frames.
    max_cells : int
    fine_range : tuple or None
        Range of x [m] in which the mesh stays fine.

    Returns
    -------
    dict
        mesh: Thinned; points: all points [m]; coated: (c,); moves: (f, n, 2) [m]; colours: (4, f,
        c) [Pa].
    """
    points = series.points(side)[:, :2]
    cells = cell_corners(*series.cells(side))
    coated = series.stack(side, "CellData", "material", [0])[0] > 0
    mesh = reduce_mesh(points, cells, coated, max_cells, fine_range)
    moves = series.stack(side, "PointData", "displacement", numbers)[..., :2].astype(float)
    stress = series.stack(side, "CellData", "stress", numbers)
    rows = np.stack(
        [series.stack(side, "CellData", "von_mises", numbers), *(stress[..., k] for k in (0, 1, 3))]
    )
    # A single summation for all frames.
    means = mesh.means(np.nan_to_num(rows).reshape(-1, len(cells)).T).T
    colours = means.reshape(*rows.shape[:2], -1)
    return {
        "points": points,
        "mesh": mesh,
        "coated": coated[mesh.order[mesh.starts]][mesh.groups],
        "moves": moves,
        "colours": colours,
    }


def _separate_slide(upper: dict, x, line: dict) -> np.ndarray:
    """Subtract the rigid displacement (f,) [m] along x from that of the upper piece, and add the gap."""
    points = upper["points"]
    moves = upper["moves"]
    slide = upper_piece_slides(points, moves)
    moves[:, :, 0] -= slide[:, None]
    moves[:, :, 1] += surface_shape_motion(
        points, moves[:, :, 1], x, line["displacement"][..., 1] + line["gap"]
    )
    return slide


def _pack_piece(piece: dict, scale: float) -> dict:
    """Pack the mesh and fields of a piece for the player."""
    mesh = piece["mesh"]
    return {
        "points": pack_array(piece["points"][mesh.nodes] * MM_PER_M),
        "cells": pack_array(mesh.cells),
        "coated": pack_array(piece["coated"]),
        "moves": pack_array(piece["moves"][:, mesh.nodes] * MM_PER_M),
        "colours": [pack_array(component * scale) for component in piece["colours"]],
    }


def _pack_curve(values, label: str, unit: str) -> dict:
    """Pack a curve for the player in a suitable unit."""
    name, scale = choose_axis_unit(values, unit)
    return {"label": label, "unit": name, "values": pack_array(values * scale)}


def player_section(film: dict) -> Section:
    """Return the section of a page that contains the player."""
    n_frames, (n_cells, n_all_cells) = len(film["times"]), film["cells"]
    label, scale = choose_axis_unit(film["times"], "s")
    content_text = f"The pressed state, {n_cells} cells"
    if n_frames > 1:
        content_text = (
            f"{n_frames} frames from {film['times'][0] * scale:.6g} to {film['times'][-1] * scale:.6g} {label}, "
            f"{n_cells} cells"
        )
    sampled_from = [f"{film['of']} frames"] * (film["of"] > n_frames) + [f"{n_all_cells} cells"] * (
        n_all_cells > n_cells
    )
    sample = (
        (
            f"; only a sample of {' and '.join(sampled_from)} is drawn, each cell with the mean of the cells that it "
            "replaces"
        )
        if sampled_from
        else ""
    )
    text = f"{content_text}{sample}. Motion and gap are magnified by one factor"
    text += (
        (
            ", the slide of the upper piece as a whole by another factor; colours and scales are the same in every "
            "frame. "
            "Press space to play and the arrow keys to step."
        )
        if n_frames > 1
        else "."
    )
    return Section(
        "player", "The pieces, frame by frame", read_file("player.html").replace("CAPTION", text)
    )
