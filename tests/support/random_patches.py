"""Recipe of random static patches of all families, and the campaigns "patches" and "patches-fine".

Patch n is the n-th of its recipe for every state of the package: `draw_patch(n)` returns its family, the text of its
scene and its trace. The family follows from n modulo 100. The reference is `patch_of_order_four`, which uses nothing of
the package.
"""

from __future__ import annotations

import tomllib
from functools import partial
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from campaigns import measure_rows, select_known_rows
from patch_of_order_four import solve_patch

SEED = 20261201
# Numbers of patches of each family among a hundred successive numbers
FAMILIES = {
    "plain": 18,
    "step": 12,
    "overhang": 16,
    "ends": 12,
    "linear layer": 8,
    "exponential layer": 8,
    "hertz layer": 8,
    "strips": 8,
    "smooth trace": 10,
}
MATERIALS = ((121e9, 0.32), (210e9, 0.3), (70e9, 0.34), (250e9, 0.24), (600e9, 0.22))


class RandomPatch(NamedTuple):
    """Patch of the recipe: family, text of the scene, and the trace (2, k) [m] that the scene names, or None."""

    family: str
    text: str
    trace: np.ndarray | None


def draw_patch(number: int) -> RandomPatch:
    """Return the patch of a number."""
    families = [name for name, count in FAMILIES.items() for _ in range(count)]
    draw = np.random.default_rng([SEED, number])
    # Neighbouring numbers have different families, so that a part of the recipe covers all of them.
    family = families[37 * number % len(families)]
    length = _log_uniform(draw, 5e-3, 4e-2)
    height = _round(length * draw.uniform(0.3, 1.3))
    trace = None
    keys = {
        "length": f'"{length!r} m"',
        "width": f'"{_log_uniform(draw, 5e-3, 5e-2)!r} m"',
        "height": f'"{height!r} m"',
        "load": f'"{_log_uniform(draw, 20, 5e3)!r} N"',
        "plane": f'"{draw.choice(["strain", "stress"], p=[0.8, 0.2])}"',
        "substrate": _material(draw),
    }
    if draw.random() < 0.5:
        thickness = _round(height * 10 ** draw.uniform(-2, -0.8))
        keys["coating"] = f'{{material = {_material(draw)}, thickness = "{thickness!r} m"}}'
    keys |= _draw_holder(draw, length)
    if family == "smooth trace":
        trace = _draw_trace(draw, length)
        keys["profile"] = '{file = "trace.csv"}'
    elif draw.random() < 0.5 or family == "strips":
        keys["crown"] = f'{{radius = "{_log_uniform(draw, 0.2, 50)!r} m"}}'
    # A piece that is free to rotate has no prescribed angle.
    is_free = "load_line" in keys and "holder" not in keys
    if draw.random() < 0.6 and not is_free:
        keys["tilt"] = f'{{angle = "{_signed(draw, 1e-6, 2e-4)!r} rad"}}'
    keys |= _draw_special(draw, family, length, height)
    lines = [f"{key} = {value}" for key, value in keys.items()]
    return RandomPatch(family, "\n".join(["[contact]", *lines]) + "\n", trace)


def _round(value: float) -> float:
    """Return a number of five digits."""
    return float(f"{value:.5g}")


def _log_uniform(draw, low: float, high: float) -> float:
    """Draw a number of five digits whose logarithm is uniform."""
    return _round(float(10 ** draw.uniform(np.log10(low), np.log10(high))))


def _signed(draw, low: float, high: float) -> float:
    """Draw a number of either sign whose magnitude has a uniform logarithm."""
    return float(draw.choice([-1, 1])) * _log_uniform(draw, low, high)


def _material(draw) -> str:
    """Draw a material as the text of a table."""
    young, poisson = MATERIALS[draw.integers(len(MATERIALS))]
    return f'{{young = "{young!r} Pa", poisson = {poisson}, density = "7800 kg/m^3"}}'


def _draw_holder(draw, length: float) -> dict:
    """Draw a rigid holder, a line of action of the load, or a holder with a rotational spring, as keys of the scene."""
    kind = draw.integers(4)
    line = f'{{offset = "{_round(draw.uniform(-0.3, 0.3) * length)!r} m"}}'
    spring = f'{{rotational_stiffness = "{_log_uniform(draw, 1e2, 1e6)!r} N m/rad"}}'
    return ({}, {}, {"load_line": line}, {"load_line": line, "holder": spring})[kind]


def _draw_special(draw, family: str, length: float, height: float) -> dict:
    """Draw the keys that make a patch one of its family."""
    if family == "step":
        at = _round(draw.uniform(-0.3, 0.3) * length)
        return {"step": f'{{height = "{_log_uniform(draw, 1e-7, 1e-4)!r} m", at = "{at!r} m"}}'}
    longer = f'length = "{_round(length * draw.uniform(1.1, 3))!r} m"'
    other = f'{longer}, height = "{_round(height * draw.uniform(0.7, 2))!r} m"'
    if family == "overhang":
        side = str(draw.choice(["lower", "upper"]))
        return {side: f"{{{other}, substrate = {_material(draw)}}}"}
    if family == "ends":
        kind = "chamfer" if draw.random() < 0.3 else "end_radius"
        size = _round(draw.uniform(0.03, 0.3) * min(length, height))
        pieces = {"lower": f'{{{kind} = "{size!r} m"}}'}
        return pieces | ({"upper": f"{{{other}}}"} if draw.random() < 0.6 else {})
    if family == "strips":
        return {"strips": f'{{count = 4, roll = "{_signed(draw, 1e-6, 1e-4)!r} rad"}}'}
    stiffness = f'normal_stiffness = "{_log_uniform(draw, 1e12, 1e15)!r} Pa/m"'
    layers = {
        "linear layer": f'law = "linear", {stiffness}, tangential_ratio = 0.8',
        "exponential layer": f'law = "exponential", decay_length = "{_log_uniform(draw, 1e-8, 2e-6)!r} m", {stiffness}',
        "hertz layer": f'law = "hertz", radius = "{_log_uniform(draw, 1e-6, 1e-4)!r} m", '
        f'density = "{_log_uniform(draw, 1e8, 1e11)!r} 1/m^2", '
        f'height_deviation = "{_log_uniform(draw, 5e-8, 2e-6)!r} m"',
    }
    return {"asperities": f"{{{layers[family]}}}"} if family in layers else {}


def _draw_trace(draw, length: float) -> np.ndarray:
    """Draw a smooth wavy gap (2, k) [m] without a mean slope."""
    x = np.linspace(-length / 2, length / 2, int(draw.integers(600, 1400)))
    z = x**2 / (2 * _log_uniform(draw, 1, 30))
    for wave in length / draw.integers(2, 12, 3):
        z = z + _log_uniform(draw, 1e-8, 3e-7) * np.cos(2 * np.pi * x / wave + draw.uniform(0, 6))
    z -= np.polyval(np.polyfit(x, z, 1), x)
    return np.stack([x, z - z.min()])


def write_scene(patch: RandomPatch, tolerance: float, folder: Path) -> Path:
    """Write the scene of a patch, and its trace, into a folder; return the path of the scene."""
    if patch.trace is not None:
        rows = "\n".join(f"{x!r},{z!r}" for x, z in patch.trace.T.tolist())
        (folder / "trace.csv").write_text(f"x [m],z [m]\n{rows}\n", "utf-8")
    path = folder / "scene.toml"
    path.write_text(f"{patch.text}[accuracy]\ntolerance = {tolerance!r}\n", "utf-8")
    return path


def compare_patch(
    number: int, folder: Path, earlier: dict | None = None, *, tolerance: float
) -> dict:
    """Compare the patch of a number with its reference; see `campaigns`."""
    import patchfem as pf
    from patchfem.runs.patch import store

    store.clear_cache()
    patch = draw_patch(number)
    scene = write_scene(patch, tolerance, folder)
    started = process_time()
    run = pf.run(pf.load(scene))
    line = {"group": patch.family, "engine": patch.family, "seconds": process_time() - started}
    line["warnings"] = list(run.warnings)
    if earlier and "true" in earlier:
        line |= {key: earlier[key] for key in ("true", "doubt")}
    else:
        line["true"], line["doubt"] = solve_patch(tomllib.loads(patch.text)["contact"], patch.trace)
    rows = measure_rows(run.measures, line["true"], line["doubt"])
    return line | select_known_rows(rows, tolerance)


compare_coarse_patch = partial(compare_patch, tolerance=1e-2)
compare_fine_patch = partial(compare_patch, tolerance=1e-3)
