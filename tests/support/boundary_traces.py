"""Rough traces on a crown, compared with a boundary element program of layers; campaign "boundary-traces".

The program uses nothing of the package. Each piece is an elastic layer that is bonded to a rigid base; near short contacts
it acts as a half plane. Pressures are constant on equal cells, displacements those at their centres, by a Fourier series
with a long period. The pieces of the scene are sixteen times as long as tall and touch near their middle, so that their
ends do not matter. Nodes enter and leave the contact set all at once; conjugate gradients solve on the set. The
changes between three numbers of cells are the uncertainties.
"""

from __future__ import annotations

from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from campaigns import measure_rows, select_known_rows
from scipy.interpolate import CubicSpline

SEED = 20261202
LENGTH, HEIGHT, WIDTH = 20e-3, 1.25e-3, 10e-3
YOUNG, POISSON = 210e9, 0.3
COUNTS = (65536, 131072, 262144)  # numbers of cells of the interface
N_ALIASES = 40  # number of aliases of a wave on either side that the kernel of a cell contains
MAX_SETS = 60
MIN_CELLS = 8  # smallest number of cells of an interval whose ends are extrapolated


class RandomTrace(NamedTuple):
    """Gap (k,) [m] at samples (k,) [m], and the load [N]."""

    x: np.ndarray
    z: np.ndarray
    load: float


def draw_trace(number: int) -> RandomTrace:
    """Return the trace of a number: random waves with a power-law spectrum on a crown, without a mean slope."""
    draw = np.random.default_rng([SEED, number])
    x = np.linspace(-LENGTH / 2, LENGTH / 2, int(draw.integers(700, 1300)))
    waves = np.arange(1, x.size // 2)
    amplitude = waves ** -(draw.uniform(0.5, 1.0) + 0.5) * (waves > draw.integers(4, 20))
    phase = draw.uniform(0, 2 * np.pi, waves.size)
    angle = 2 * np.pi * waves[:, None] * x / LENGTH + phase[:, None]
    z = (amplitude[:, None] * np.cos(angle)).sum(axis=0)
    z *= 10 ** draw.uniform(-8, -6.5) / z.std()
    z += x**2 / (2 * 10 ** draw.uniform(-0.5, 0.4))
    z -= np.polyval(np.polyfit(x, z, 1), x)
    return RandomTrace(x, z - z.min(), float(f"{10 ** draw.uniform(1.3, 3):.4g}"))


def layer_compliance(k) -> np.ndarray:
    """Return the normal displacement per pressure [m/Pa] of a layer on a rigid base for waves k >= 0 [1/m]."""
    q = np.maximum(k, 1e-3 / HEIGHT) * HEIGHT
    ratio = 3 - 4 * POISSON
    decay = np.exp(-2 * q)
    numerator = 1 - 4 * q / ratio * decay - decay**2
    denominator = 1 + (ratio + (1 + 4 * q**2) / ratio) * decay + decay**2
    return 2 * (1 - POISSON**2) / YOUNG * HEIGHT / q * numerator / denominator


class Cells:
    """Compliance of equal cells of the interface."""

    def __init__(self, count: int):
        self.h = LENGTH / count
        self.x = (np.arange(count) + 0.5) * self.h - LENGTH / 2
        n = 2 * count
        k = 2 * np.pi * np.fft.rfftfreq(n, self.h)
        kernel = 0.0
        for alias in range(-N_ALIASES, N_ALIASES + 1):
            wave = k + 2 * np.pi * alias / self.h
            kernel = kernel + layer_compliance(np.abs(wave)) * np.sinc(wave * self.h / 2 / np.pi)
        self.kernel = 2 * kernel / (self.h * WIDTH)
        self.n = n

    def product(self, force) -> np.ndarray:
        """Return the closing (n,) [m] under forces (n,) [N]."""
        return np.fft.irfft(self.kernel * np.fft.rfft(force, self.n), self.n)[: force.size]

    def solve(self, active, right, start) -> np.ndarray:
        """Return the forces on a set of cells that close given gaps, by preconditioned conjugate gradients."""
        force = np.where(active, start, 0.0)
        residual = np.where(active, right - self.product(force), 0.0)
        limit = 1e-11 * np.abs(right[active]).max()
        direction, last = 0.0, np.inf
        for _ in range(600):
            if np.abs(residual).max() <= limit:
                break
            stiff = np.fft.irfft(np.fft.rfft(residual, self.n) / self.kernel, self.n)
            stiff = np.where(active, stiff[: force.size], 0.0)
            square = residual @ stiff
            direction = stiff + square / last * direction
            last = square
            moved = np.where(active, self.product(direction), 0.0)
            step = square / (direction @ moved)
            force = force + step * direction
            residual = residual - step * moved
        return force

    def press(self, gap, load: float, active) -> tuple:
        """Return the forces (n,) [N], the approach [m], and the forces [N/m] of a unit motion of the set."""
        unit, closing = np.zeros(gap.size), np.zeros(gap.size)
        for _ in range(MAX_SETS):
            unit = self.solve(active, np.ones(gap.size), unit)
            closing = self.solve(active, gap, closing)
            approach = (load + closing.sum()) / unit.sum()
            force = approach * unit - closing
            overlap = approach - gap - self.product(force)
            wanted = np.where(active, force > 0, overlap > 1e-10 * np.abs(approach))
            if (wanted == active).all():
                return force, approach, unit
            active = wanted
        raise ArithmeticError("the contact set did not settle")


def correct_edges(x, force, unit) -> tuple[float, float]:
    """Return the length in contact [m] and the stiffness [N/m] for edges between the cells.

    The square of the pressure vanishes linearly at an edge, extrapolated from the second and third cell of an interval.
    Where the set ends short of its edge by a, the pressures c/sqrt(distance) of a unit motion, unbounded there, add
    2 pi c^2 a/E' per width to the stiffness (energy release rate).

    Parameters
    ----------
    x : (n,) ndarray
        Centres of equal cells [m].
    force, unit : (n,) ndarray
        Forces [N] under the load, and [N/m] of a unit motion of the same cells.
    """
    h = x[1] - x[0]
    modulus = YOUNG / (1 - POISSON**2) / 2
    changes = np.flatnonzero(np.diff(np.concatenate([[False], force > 0, [False]])))
    length, stiffness = 0.0, unit.sum()
    for begin, end in changes.reshape(-1, 2):
        length += (end - begin) * h
        if end - begin < MIN_CELLS:
            continue
        for near, far in ((begin + 1, begin + 2), (end - 2, end - 3)):
            ratio = force[far] ** 2 / force[near] ** 2
            if ratio <= 1:
                continue
            # The edge lies beyond the second centre, which is a cell and a half inside the end of the set.
            distance = min(1 / (ratio - 1), 3.0) * h
            missing = distance - 1.5 * h
            length += missing
            squares = (unit[near] ** 2 * distance + unit[far] ** 2 * (distance + h)) / 2
            stiffness += 2 * np.pi / modulus * squares / h**2 / WIDTH * missing
    return length, stiffness


def solve_trace(trace: RandomTrace) -> tuple[dict, dict]:
    """Return peak, contact fraction, approach and stiffness of a trace, and their uncertainties."""
    curve = CubicSpline(trace.x, trace.z, bc_type="natural")
    turns = curve.derivative().roots(extrapolate=False)
    lowest = curve(np.append(turns, trace.x[[0, -1]])).min()
    values, force = [], None
    for count in COUNTS:
        cells = Cells(count)
        gap = curve(cells.x) - lowest
        active = gap < 2e-7 if force is None else np.repeat(force > 0, count // force.size)
        force, approach, unit = cells.press(gap, trace.load, active)
        length, stiffness = correct_edges(cells.x, force, unit)
        if np.abs(cells.x[force > 0]).max() > LENGTH / 3:
            raise ArithmeticError("the contact is too long")
        largest = int(np.argmax(force))
        before, peak, after = force[largest - 1 : largest + 2]
        peak += (before - after) ** 2 / 8 / (2 * peak - before - after)
        values.append([peak / (cells.h * WIDTH), length / LENGTH, approach, stiffness])
    coarse, middle, fine = np.array(values)
    doubt = np.maximum(np.abs(fine - middle), np.abs(middle - coarse) / 2)
    names = ("pressure_peak", "contact_fraction", "approach", "normal_stiffness")
    return dict(zip(names, fine.tolist())), dict(zip(names, doubt.tolist()))


def compare_trace(number: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the patch under the trace of a number with the boundary element program; see `campaigns`."""
    import patchfem as pf

    trace = draw_trace(number)
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(trace.x.tolist(), trace.z.tolist()))
    (folder / "trace.csv").write_text(f"x [m],z [m]\n{rows}\n", "utf-8")
    text = (
        f'[contact]\nlength = "{LENGTH!r} m"\nwidth = "{WIDTH!r} m"\nheight = "{HEIGHT!r} m"\n'
        f'load = "{trace.load!r} N"\nprofile = {{file = "trace.csv"}}\n'
        f'substrate = {{young = "{YOUNG!r} Pa", poisson = {POISSON}, density = "7800 kg/m^3"}}\n'
        "[accuracy]\ntolerance = 1e-3\n"
    )
    (folder / "scene.toml").write_text(text, "utf-8")
    started = process_time()
    run = pf.run(pf.load(folder / "scene.toml"))
    line = {
        "group": "rough",
        "engine": "points" if run.patch.points else "cells",
        "seconds": process_time() - started,
        "warnings": list(run.warnings),
    }
    if earlier and "true" in earlier:
        line |= {key: earlier[key] for key in ("true", "doubt")}
    else:
        line["true"], line["doubt"] = solve_trace(trace)
    return line | select_known_rows(measure_rows(run.measures, line["true"], line["doubt"]), 1e-3)
