"""Recipe of a hundred random static patches of all families, and their runs beside a reference.

    python tests/support/random_patches.py run FILE [--tolerance 1e-2] [--numbers 0:100]
    python tests/support/random_patches.py score FILE TRUTH

Patch n is the n-th of its recipe for every state of the package: `draw_patch(n)` returns its family, the text of its
scene and its trace. `run` writes one line of JSON for each patch: the measures with their errors and the CPU seconds.
`score` compares the measures with those of another file: a run at a much smaller tolerance, or `patch_by_skfem`.
A stated error holds if the difference is at most the sum of both errors.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

SEED = 20261129
# Numbers of patches of each family; a patch without an entry in SPECIAL is plain.
FAMILIES = {
    "plain": 20,
    "step": 10,
    "overhang": 16,
    "ends": 10,
    "linear layer": 6,
    "exponential layer": 6,
    "hertz layer": 6,
    "strips": 8,
    "smooth trace": 8,
    "rough trace": 10,
}
MATERIALS = ((121e9, 0.32), (210e9, 0.3), (70e9, 0.34), (250e9, 0.24), (600e9, 0.22))
MAX_CPU_SECONDS = 120
# Differences below this fraction of the value, or below the floor of a measure, do not count.
ROUND_OFF = 1e-9


class RandomPatch(NamedTuple):
    """Patch of the recipe: family, text of the scene, and the trace (2, k) [m] that the scene names, or None."""

    family: str
    text: str
    trace: np.ndarray | None


def draw_patch(number: int) -> RandomPatch:
    """Return the patch of a number from 0 to 99."""
    families = [name for name, count in FAMILIES.items() for _ in range(count)]
    draw = np.random.default_rng([SEED, number])
    family = families[number]
    length = _log_uniform(draw, 5e-3, 4e-2)
    height = _round(length * draw.uniform(0.3, 1.3))
    load = _log_uniform(draw, 20, 5e3)
    lines = [
        "[contact]",
        f'length = "{length!r} m"',
        f'width = "{_log_uniform(draw, 5e-3, 5e-2)!r} m"',
        f'height = "{height!r} m"',
        f'load = "{load!r} N"',
        f'plane = "{draw.choice(["strain", "stress"], p=[0.8, 0.2])}"',
        f"substrate = {_material(draw)}",
    ]
    coating = ""
    if draw.random() < 0.5:
        thickness = _round(height * 10 ** draw.uniform(-2, -0.8))
        coating = f'{{material = {_material(draw)}, thickness = "{thickness!r} m"}}'
        lines.append(f"coating = {coating}")
    lines += _draw_holder(draw, length)
    trace = None
    if family in ("smooth trace", "rough trace"):
        trace, load = _draw_trace(draw, family, length)
        lines[4] = f'load = "{load!r} N"'
        lines.append('profile = {file = "trace.csv"}')
    elif draw.random() < 0.5 or family == "strips":
        lines.append(f'crown = {{radius = "{_log_uniform(draw, 0.2, 50)!r} m"}}')
    # A piece that is free to rotate has no prescribed angle.
    keys = {line.split(" ")[0] for line in lines}
    is_free = "load_line" in keys and "holder" not in keys
    if draw.random() < 0.6 and not is_free:
        lines.append(f'tilt = {{angle = "{_signed(draw, 1e-6, 2e-4)!r} rad"}}')
    lines += _draw_special(draw, family, length, height)
    return RandomPatch(family, "\n".join(lines) + "\n", trace)


def _round(value: float) -> float:
    return float(f"{value:.5g}")


def _log_uniform(draw, low: float, high: float) -> float:
    return _round(float(10 ** draw.uniform(np.log10(low), np.log10(high))))


def _signed(draw, low: float, high: float) -> float:
    return float(draw.choice([-1, 1])) * _log_uniform(draw, low, high)


def _material(draw) -> str:
    young, poisson = MATERIALS[draw.integers(len(MATERIALS))]
    return f'{{young = "{young!r} Pa", poisson = {poisson}, density = "7800 kg/m^3"}}'


def _draw_holder(draw, length: float) -> list:
    """Return lines for a rigid holder, a line of action of the load, or a holder with a rotational spring."""
    kind = draw.integers(4)
    line = f'load_line = {{offset = "{_round(draw.uniform(-0.3, 0.3) * length)!r} m"}}'
    holder = f'holder = {{rotational_stiffness = "{_log_uniform(draw, 1e2, 1e6)!r} N m/rad"}}'
    return ([], [], [line], [line, holder])[kind]


def _draw_special(draw, family: str, length: float, height: float) -> list:
    """Return the lines that make a patch one of its family."""
    if family == "step":
        at = _round(draw.uniform(-0.3, 0.3) * length)
        return [f'step = {{height = "{_log_uniform(draw, 1e-7, 1e-4)!r} m", at = "{at!r} m"}}']
    other = f'length = "{_round(length * draw.uniform(1.1, 3))!r} m", height = "{_round(height * draw.uniform(0.7, 2))!r} m"'
    if family == "overhang":
        side = draw.choice(["lower", "upper"])
        return [f"{side} = {{{other}, substrate = {_material(draw)}}}"]
    if family == "ends":
        radius = f'end_radius = "{_round(draw.uniform(0.03, 0.3) * min(length, height))!r} m"'
        if draw.random() < 0.3:
            radius = radius.replace("end_radius", "chamfer")
        return [f"lower = {{{radius}}}", *([f"upper = {{{other}}}"] if draw.random() < 0.6 else [])]
    stiffness = f'normal_stiffness = "{_log_uniform(draw, 1e12, 1e15)!r} Pa/m"'
    if family == "linear layer":
        return [f'asperities = {{law = "linear", {stiffness}, tangential_ratio = 0.8}}']
    if family == "exponential layer":
        decay = f'decay_length = "{_log_uniform(draw, 1e-8, 2e-6)!r} m"'
        return [f'asperities = {{law = "exponential", {decay}, {stiffness}}}']
    if family == "hertz layer":
        peaks = (
            f'radius = "{_log_uniform(draw, 1e-6, 1e-4)!r} m", density = "{_log_uniform(draw, 1e8, 1e11)!r} 1/m^2", '
            f'height_deviation = "{_log_uniform(draw, 5e-8, 2e-6)!r} m"'
        )
        return [f'asperities = {{law = "hertz", {peaks}}}']
    if family == "strips":
        return [f'strips = {{count = 4, roll = "{_signed(draw, 1e-6, 1e-4)!r} rad"}}']
    return []


def _draw_trace(draw, family: str, length: float) -> tuple[np.ndarray, float]:
    """Return a gap (2, k) [m] and a load [N] that closes part of it."""
    x = np.linspace(-length / 2, length / 2, int(draw.integers(600, 1400)))
    if family == "smooth trace":
        z = x**2 / (2 * _log_uniform(draw, 1, 30))
        for wave in length / draw.integers(2, 12, 3):
            z = z + _log_uniform(draw, 1e-8, 3e-7) * np.cos(
                2 * np.pi * x / wave + draw.uniform(0, 6)
            )
        return np.stack([x, z]), _log_uniform(draw, 20, 5e3)
    # Random waves with a power-law spectrum, down to two samples.
    count = x.size // 2 - 1
    number = np.arange(1, count + 1)
    amplitude = number ** -(draw.uniform(0.5, 1.0) + 0.5) * (number > draw.integers(2, 8))
    phase = draw.uniform(0, 2 * np.pi, count)
    z = (
        amplitude[:, None] * np.cos(2 * np.pi * number[:, None] * x / length + phase[:, None])
    ).sum(axis=0)
    z *= _log_uniform(draw, 5e-8, 5e-7) / z.std()
    slope = np.sqrt(np.mean((np.diff(z) / np.diff(x)) ** 2))
    load = np.clip(10 ** draw.uniform(-2.3, -0.8) * 6e10 * slope * length * 1e-2, 5.0, 1e4)
    return np.stack([x, z]), _round(float(load))


def write_scene(patch: RandomPatch, tolerance: float, folder: Path) -> Path:
    """Write the scene of a patch, and its trace, into a folder; return the path of the scene."""
    if patch.trace is not None:
        rows = "\n".join(f"{x!r},{z!r}" for x, z in patch.trace.T.tolist())
        (folder / "trace.csv").write_text(f"x [m],z [m]\n{rows}\n", "utf-8")
    path = folder / "scene.toml"
    path.write_text(f"{patch.text}[accuracy]\ntolerance = {tolerance!r}\n", "utf-8")
    return path


def run_patch(number: int, tolerance: float) -> dict:
    """Run a patch with an empty cache; return its family, measures {name: [value, error]} and CPU seconds."""
    import patchfem as pf
    from patchfem.runs.patch import store

    store.clear_cache()
    patch = draw_patch(number)
    row = {"n": number, "family": patch.family}
    with tempfile.TemporaryDirectory() as folder:
        started = process_time()
        signal.setitimer(signal.ITIMER_PROF, MAX_CPU_SECONDS)
        try:
            result = pf.run(pf.load(write_scene(patch, tolerance, Path(folder))))
            row["measures"] = {k: [m.value, m.error, m.floor] for k, m in result.measures.items()}
        except Exception as error:  # a failed patch is one line of the score
            row["failed"] = f"{type(error).__name__}: {error}"[:300]
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
    row["cpu"] = process_time() - started
    return row


class _TimeLimit(Exception):
    """A patch took more than MAX_CPU_SECONDS."""


def _stop(*_) -> None:
    raise _TimeLimit


def read_rows(path: Path) -> dict:
    """Return the rows of a file by number."""
    rows = map(json.loads, path.read_text("utf-8").splitlines())
    return {row["n"]: row for row in rows}


def score(tested: Path, truth: Path) -> None:
    """Print the share of errors that hold by family and by measure, true errors and CPU seconds."""
    truths = read_rows(truth)
    counts = defaultdict(lambda: [0, 0])
    true_errors = defaultdict(list)
    seconds = defaultdict(list)
    for number, row in read_rows(tested).items():
        seconds[row["family"]].append(row["cpu"])
        reference = truths.get(number, {}).get("measures")
        if "measures" not in row or reference is None:
            print(number, row["family"], row.get("failed", "no reference"))
            continue
        for name, (value, error, floor) in row["measures"].items():
            known, doubt, *_ = reference.get(name, (None, None))
            if (
                value is None
                or known is None
                or error is None
                or doubt is None
                or name == "normal_load"
            ):
                continue
            difference = abs(value - known)
            # A row whose reference is less certain than the tested error proves nothing.
            if doubt > 0.5 * max(error, floor) and difference <= error + doubt + floor:
                continue
            holds = difference <= error + doubt + max(ROUND_OFF * abs(known), 1e-3 * floor)
            for key in (row["family"], name, "all"):
                counts[key][0] += holds
                counts[key][1] += 1
            true_errors[row["family"]].append(difference / max(abs(known), floor, 1e-300))
            if not holds:
                print(
                    f"{number} {row['family']} {name}: {value:.6g} +- {error:.2g}, reference {known:.6g} +- {doubt:.2g}"
                )
    for key, (held, total) in counts.items():
        spent = seconds.get(key)
        extra = ""
        if spent:
            median, high = np.quantile(true_errors[key], [0.5, 0.9])
            total_seconds = f"CPU s: median {np.median(spent):.2f}, sum {sum(spent):.1f}"
            extra = f"  true error {median:.1e} (90 %: {high:.1e})  {total_seconds}"
        print(f"{key:24s} {held}/{total} = {100 * held / total:.1f} %{extra}")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    run = verbs.add_parser("run")
    run.add_argument("file", type=Path)
    run.add_argument("--tolerance", type=float, default=1e-2)
    run.add_argument("--numbers", default="0:100")
    compare = verbs.add_parser("score")
    compare.add_argument("tested", type=Path)
    compare.add_argument("truth", type=Path)
    arguments = parser.parse_args()
    if arguments.verb == "score":
        score(arguments.tested, arguments.truth)
        return
    signal.signal(signal.SIGPROF, lambda *_: _stop())
    with arguments.file.open("a", encoding="utf-8") as out:
        for number in range(*map(int, arguments.numbers.split(":"))):
            row = run_patch(number, arguments.tolerance)
            out.write(json.dumps(row) + "\n")
            out.flush()
            print(
                number, row["family"], f"{row['cpu']:.2f}", row.get("failed", ""), file=sys.stderr
            )


if __name__ == "__main__":
    main()
