"""Rough traces on a crown, compared with a boundary element program of layers; campaign "boundary-traces".

The program uses nothing of the package. Each piece is an elastic layer that is bonded to a rigid base; near short contacts
it acts as a half plane. Pressures are constant on equal cells, displacements those at their centres, by a Fourier series
with a long period. The pieces of the scene are sixteen times as long as tall and touch near their middle, so that their
ends do not matter. Nodes enter and leave the contact set all at once; conjugate gradients solve on the set.
"""

from __future__ import annotations

from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from campaigns import measure_rows
from scipy.interpolate import CubicSpline

SEED = 20261202
LENGTH, HEIGHT, WIDTH = 20e-3, 1.25e-3, 10e-3
YOUNG, POISSON = 210e9, 0.3
COUNTS = (16384, 32768)  # numbers of cells, of which the last gives the reference
N_ALIASES = 40  # number of aliases of a wave on either side that the kernel of a cell contains
MAX_SETS = 60
MAX_DOUBT_RATIO = (
    0.5  # largest uncertainty of the reference over the stated error of a row that holds
)


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
        """Return the forces (n,) [N] and the approach [m] under a load."""
        unit, closing = np.zeros(gap.size), np.zeros(gap.size)
        for _ in range(MAX_SETS):
            unit = self.solve(active, np.ones(gap.size), unit)
            closing = self.solve(active, gap, closing)
            approach = (load + closing.sum()) / unit.sum()
            force = approach * unit - closing
            overlap = approach - gap - self.product(force)
            wanted = np.where(active, force > 0, overlap > 1e-10 * np.abs(approach))
            if (wanted == active).all():
                return force, approach
            active = wanted
        raise ArithmeticError("the contact set did not settle")


def solve_trace(trace: RandomTrace, count: int) -> dict:
    """Return peak, contact fraction, approach and stiffness of a trace on a number of cells."""
    cells = Cells(count)
    curve = CubicSpline(trace.x, trace.z, bc_type="natural")
    gap = curve(cells.x) - curve(np.linspace(-LENGTH / 2, LENGTH / 2, 20001)).min()
    active = gap < gap.min() + 2e-7
    force, approach = cells.press(gap, trace.load, active)
    loads = trace.load * np.array([0.99, 1.01])
    ends = [cells.press(gap, load, force > 0)[1] for load in loads]
    if np.abs(cells.x[force > 0]).max() > LENGTH / 3:
        raise ArithmeticError("the contact is too long")
    return {
        "pressure_peak": float(force.max() / (cells.h * WIDTH)),
        "contact_fraction": float((force > 0).mean()),
        "approach": float(approach),
        "normal_stiffness": float((loads[1] - loads[0]) / (ends[1] - ends[0])),
    }


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
        coarse, fine = (solve_trace(trace, count) for count in COUNTS)
        line["true"] = fine
        line["doubt"] = {name: abs(value - coarse[name]) for name, value in fine.items()}
        # Counted cells are in excess by a fixed part of a cell at each edge.
        fine["contact_fraction"] = 2 * fine["contact_fraction"] - coarse["contact_fraction"]
    found = measure_rows(run.measures, line["true"], line["doubt"])
    line["rows"] = [
        row for row in found if row.doubt <= MAX_DOUBT_RATIO * row.error or not row.holds
    ]
    return line
