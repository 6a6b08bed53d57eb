"""Random traces on random bodies, and their stated errors against much finer meshes.

Campaign `traces` of `campaigns`. A patch is run with default settings and tolerance. The reference
is the same patch on cells alone, whose stated errors are the uncertainties: on uniform cells of
1/1588 of the length if a trace is fine everywhere, else on graded cells with a tenth of the
tolerance. These cells have other compliances than the points on which a trace is pressed, another
contact algorithm and other edges. Both use the same curve through the samples.
"""

from pathlib import Path
from time import process_time

import numpy as np
from campaigns import measure_rows
from scene_texts import COATING, PIECE
from synthetic import self_affine

import patchfem as pf
from patchfem.model import build
from patchfem.runs import solve_with_coarser
from patchfem.runs.patch import profile_points
from patchfem.scene import loads

LENGTH, CELLS = 12.7e-3, 1588  # Length of the interface [m]; cells of the uniform reference mesh.
KINDS = ("corner", "roofs", "punch", "wave", "short wave", "rough", "smooth rough", "crowned wave")
FINE = ("roofs", "short wave", "rough")
MODULUS = 6e10  # Typical contact modulus of a pair of bodies [Pa].
PIECES = (
    'substrate = "steel"\n',
    'substrate = "Ti-8Al-1Mo-1V"\n' + COATING,
    'substrate = "Ti-8Al-1Mo-1V"\n'
    + COATING
    + '[contact.lower]\ncoating = "none"\nheight = "9 mm"\n',
)


def draw_trace(seed: int) -> tuple:
    """Return (kind, x (n,) [m], gap z (n,) [m], text of the scene without its profile) of a seed."""
    draw = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    count = (
        int(draw.integers(300, 500))
        if kind in ("corner", "roofs", "rough")
        else int(draw.integers(800, 1600))
    )
    x = np.linspace(-LENGTH / 2, LENGTH / 2, count + 1)
    z, load = _draw_gap(kind, x, draw)
    text = PIECE + f'load = "{load!r} N"\n' + PIECES[draw.integers(3)]
    load_case = draw.integers(3)
    if load_case == 1:
        text += f'[contact.tilt]\nangle = "{draw.uniform(-3e-5, 3e-5)!r} rad"\n'
    elif load_case == 2:
        text += f'[contact.load_line]\noffset = "{draw.uniform(-1, 1)!r} mm"\n'
    return kind, x, z, text


def _draw_gap(kind: str, x, draw) -> tuple:
    """Draw a gap (n,) [m] of a kind, and a load [N] that closes part of it."""
    area = LENGTH * 12.7e-3
    half = LENGTH / 2
    position = draw.uniform(-0.4, 0.4) * half
    if kind == "corner":
        left, right = 10 ** draw.uniform(-4, -2.7, 2)
        return np.where(
            x < position, left * (position - x), right * (x - position)
        ), 10 ** draw.uniform(1.7, 3)
    if kind == "roofs":
        corners = np.sort(draw.uniform(-1, 1, int(draw.integers(4, 9)))) * half
        heights = draw.uniform(0, 10 ** draw.uniform(-6.5, -5.5), corners.size)
        return np.interp(x, corners, heights), 10 ** draw.uniform(1.7, 3)
    if kind == "punch":
        flat_half_width = draw.uniform(0.05, 0.3) * half
        radius = 10 ** draw.uniform(-1.7, 0)
        return np.maximum(np.abs(x - position) - flat_half_width, 0) ** 2 / (
            2 * radius
        ), 10 ** draw.uniform(2, 3.5)
    if kind in ("rough", "smooth rough"):
        short = 2.05 * LENGTH / (x.size - 1) if kind == "rough" else draw.uniform(150e-6, 400e-6)
        z = self_affine(
            LENGTH,
            x.size - 1,
            10 ** draw.uniform(-7.3, -6.3),
            draw.uniform(0.5, 1),
            0.8e-3,
            short,
            int(draw.integers(10**6)),
        ).z
        slope = np.sqrt(np.mean((np.diff(z) / np.diff(x)) ** 2))
        return z, float(np.clip(10 ** draw.uniform(-2.5, -0.7) * MODULUS * slope * area, 5.0, 2e4))
    wave = LENGTH / draw.uniform(4, 30) if kind != "short wave" else LENGTH / draw.uniform(30, 200)
    amplitude = 10 ** draw.uniform(-7.5, -6.5)
    z = amplitude * np.cos(2 * np.pi * (x - position) / wave)
    if kind == "crowned wave":
        z = z + x**2 / (2 * 10 ** draw.uniform(0, 1.5))
    return z, float(
        np.clip(10 ** draw.uniform(-1.7, 0.3) * np.pi * MODULUS * amplitude / wave * area, 5.0, 2e4)
    )


def compare_trace(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the patch under the trace of a seed with cells alone; see `campaigns`."""
    kind, x, z, text = draw_trace(seed)
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(x.tolist(), z.tolist()))
    (folder / "trace.csv").write_text(f"x [m],z [m]\n{rows}\n", "utf-8")
    scene = loads(text + '[contact.profile]\nfile = "trace.csv"\n', folder / "scene.toml")
    started = process_time()
    result = pf.run(scene)
    seconds = process_time() - started
    model = build(scene)
    finer = _solve_on_cells(kind, model.patch, model.accuracy.tolerance / 10)
    known = {
        name: measure
        for name, measure in finer.items()
        if name != "normal_load" and measure.value is not None
    }
    truths = {name: float(measure.value) for name, measure in known.items()}
    doubts = {name: float(measure.error) for name, measure in known.items()}
    return {
        "group": kind,
        "engine": "points" if result.patch.points else "cells",
        "seconds": seconds,
        "warnings": list(result.warnings),
        "rows": measure_rows(result.measures, truths, doubts),
    }


def _solve_on_cells(kind: str, patch_model, tolerance: float) -> dict:
    """Return the measures of a patch on cells alone, uniform ones for kinds in FINE, else graded ones."""
    if kind in FINE:
        even = patch_model.with_mesh(element_size=LENGTH / CELLS)
        return solve_with_coarser(even, tolerance)[0].measures
    can_use_points = profile_points.can_use_points
    profile_points.can_use_points = lambda patch_model: False
    try:
        return solve_with_coarser(patch_model, tolerance)[0].measures
    finally:
        profile_points.can_use_points = can_use_points
