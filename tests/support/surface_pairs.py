"""Pairs of traces with known wear, of the kinds that a laboratory compares.

Made from how instruments work, without knowledge of the method that compares them. Both measurements of a pair are taken
from one surface; each has its own place, tilt, offset and noise. Lengths in m.
Campaign `trace-pairs` of `campaigns`: a verdict is right if it does not claim what is false of the kind.
Seeds 41000 to 41019 were used in developing the comparison of traces.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from campaigns import Row
from traces import format_trace

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface import Profile
from patchfem.surface.compare.compare import compare_surfaces

KINDS = (
    "unworn",
    "even",
    "wedge",
    "groove",
    "edge",
    "run-in",
    "deposits",
    "dust",
    "dropouts",
    "bent",
    "mirrored",
    "turned",
    "exchanged",
    "elsewhere",
    "scale",
)
RUBBED = ("groove", "edge", "run-in", "dropouts", "bent")  # Kinds with both worn and unworn parts.


@dataclass(frozen=True)
class TracePair:
    """Two traces and their true difference.

    worn: depths [m] at the points of the trace after, positive where material was removed.
    """

    kind: str
    seed: int
    before: tuple  # Positions x and heights z, (n,) [m] each.
    after: tuple
    worn: np.ndarray = field(repr=False)  # Worn depth at each point of `after`.
    # Offset of the trace after relative to the trace before: x on the surface minus x in the file.
    shift: float = 0.0
    spoilt: tuple = (0, 0)  # Number of points of dust or dropouts in each trace.


def draw_surface(rng, length: float, style: str):
    """Return x and heights [m] at the spacing of the finest trace: self-affine, turned, or with a plateau."""
    step = 0.25e-6
    count = int(2 ** np.ceil(np.log2(length / step)))
    wave = np.fft.rfftfreq(count, step)
    hurst = rng.uniform(0.6, 0.9)
    roll = 1 / rng.uniform(60e-6, 300e-6)
    tip = 1 / rng.uniform(4e-6, 10e-6)
    power = np.maximum(wave, roll) ** (-1 - 2 * hurst) / (1 + (wave / tip) ** 6)
    power[0] = 0.0
    heights = np.fft.irfft(np.sqrt(power) * np.exp(2j * np.pi * rng.random(wave.size)), count)
    heights *= 1 / heights.std()
    x = step * np.arange(count)
    if style == "turned":
        feed = rng.uniform(60e-6, 110e-6)
        phase = 2 * np.pi * x / feed + 0.25 * np.cumsum(rng.normal(size=count)) * np.sqrt(
            step / feed
        )
        heights = np.cos(phase) + 0.2 * np.cos(2 * phase + 0.7) + 0.25 * heights
    elif style == "plateau":
        heights = np.where(heights > 0, 0.3 * heights, heights)
    return x, heights / heights.std() * rng.uniform(0.2e-6, 2.5e-6)


def track_depth(x, start: float, stop: float, depth: float, ramp: float):
    """Return a worn track of a given depth whose sides are `ramp` wide."""
    into = np.clip((x - start) / ramp, 0, 1)
    out = np.clip((stop - x) / ramp, 0, 1)
    return depth * (3 * into**2 - 2 * into**3) * (3 * out**2 - 2 * out**3)


def draw_pair(kind: str, seed: int) -> TracePair:
    """Draw the pair of a kind for a seed."""
    draw = np.random.default_rng([seed, KINDS.index(kind)])
    style = ("self-affine", "turned", "plateau")[draw.integers(3)]
    length = draw.uniform(1.5e-3, 6e-3)
    spacing = draw.choice([0.5e-6, 1e-6, 2e-6])
    reach = draw.uniform(-0.04, 0.04) * length
    margin = 0.06 * length
    x, new = draw_surface(draw, (3.2 if kind == "elsewhere" else 1.0) * length + 2 * margin, style)
    start = margin
    rms = new.std()
    depth = draw.uniform(0.5, 4) * rms
    wear = np.zeros_like(x)
    if kind == "even":
        wear += depth
    elif kind == "wedge":
        fraction = (x - start) / length
        wear += depth * (fraction if draw.random() < 0.5 else 1 - fraction)
    elif kind in ("groove", "exchanged", "bent", "dropouts"):
        a = start + draw.uniform(0.2, 0.4) * length
        b = a + draw.uniform(0.2, 0.35) * length
        wear += track_depth(x, a, b, depth, draw.uniform(20e-6, 150e-6))
    elif kind == "edge":  # The wear begins inside the trace and continues beyond its end.
        a = start + draw.uniform(0.25, 0.6) * length
        wear += track_depth(x, a, x[-1] + 1e-3, depth, draw.uniform(20e-6, 150e-6))
    old = new - wear
    if kind == "run-in":  # The peaks are worn and the valleys are not.
        level = np.quantile(new, draw.uniform(0.5, 0.85))
        old = np.where(new > level, level + draw.uniform(0.0, 0.15) * (new - level), new)
        wear = new - old
    elif kind == "deposits":
        for _ in range(draw.integers(1, 4)):
            a = start + draw.uniform(0.05, 0.8) * length
            deposit = track_depth(
                x, a, a + draw.uniform(0.03, 0.12) * length, draw.uniform(0.5, 3) * rms, 30e-6
            )
            old = old + deposit
            wear = wear - deposit
    noise = draw.uniform(1e-9, 8e-9)
    begin = start + reach
    if kind == "elsewhere":
        begin = start + draw.uniform(1.2, 2.0) * length

    def sample_trace(heights, place, spacing, gain=1.0, stretch=1.0):
        """Return points, heights and surface positions of a trace that starts at `place`."""
        points = np.arange(0, length, spacing)
        surface_positions = place + stretch * points
        keep = surface_positions < x[-1]
        points = points[keep]
        surface_positions = surface_positions[keep]
        z = gain * np.interp(surface_positions, x, heights) + noise * draw.normal(size=points.size)
        z += draw.uniform(-0.8e-3, 0.8e-3) * points + draw.uniform(-5e-6, 5e-6)
        return points, np.round(z, 9), surface_positions

    second_spacing = draw.choice([0.5e-6, 1e-6, 2e-6]) if kind == "scale" else spacing
    gain = draw.uniform(0.97, 1.03) if kind == "scale" else 1.0
    stretch = draw.uniform(0.99, 1.01) if kind == "scale" else 1.0
    xb, zb, _ = sample_trace(new, start, spacing)
    xa, za, surface_positions = sample_trace(old, begin, second_spacing, gain, stretch)
    worn = np.interp(surface_positions, x, wear)
    spoilt = [0, 0]
    if kind == "dust":
        which = draw.integers(1, 4)  # 1: before, 2: after, 3: both.
        for k, z in enumerate((zb, za)):
            if which & (k + 1):
                for centre in draw.integers(5, z.size - 5, draw.integers(1, 4)):
                    width = draw.integers(1, 5)
                    z[centre : centre + width] += draw.uniform(8, 25) * rms
                    spoilt[k] += int(width)
    if kind == "dropouts":
        for k, z in enumerate((zb, za)):
            for centre in draw.integers(5, z.size - 5, draw.integers(1, 3)):
                width = draw.integers(1, 4)
                z[centre : centre + width] -= draw.uniform(10, 30) * rms
                spoilt[k] += int(width)
    if kind == "bent":
        za += draw.choice([-1, 1]) * draw.uniform(2, 6) * rms * ((xa / xa[-1] - 0.5) ** 2 * 4)
    if kind == "mirrored":
        za = za[::-1].copy()
    if kind == "turned":
        za = -za
    before = (xb, zb)
    after = (xa, za)
    if kind == "exchanged":
        before, after, worn = after, before, -np.interp(xb + start, surface_positions, worn)
    return TracePair(kind, seed, before, after, worn, begin - start, tuple(spoilt))


def make_profiles(pair: TracePair) -> tuple:
    """Return both traces as `Profile`."""
    return tuple(
        Profile(*map(frozen_array, trace), name)
        for trace, name in ((pair.before, "before"), (pair.after, "after"))
    )


def write_traces(pair: TracePair, folder: Path, before: str, after: str) -> tuple:
    """Write both traces of a pair as tables in um; return their paths."""
    paths = folder / f"{before}.csv", folder / f"{after}.csv"
    for path, (x, z) in zip(paths, (pair.before, pair.after)):
        path.write_text(format_trace(1e6 * x, 1e6 * z, digits=9), "utf-8")
    return paths


FALSE_VERDICTS = {
    "unworn": ("worn", "worn_and_grown", "grown"),
    "dust": ("worn", "worn_and_grown", "grown"),
    "deposits": ("worn", "no_wear"),
    "exchanged": ("worn", "no_wear"),
}
UNDECIDABLE = ("even", "wedge", "elsewhere", "scale", "mirrored", "turned")


def compare_traces(seed: int, folder) -> dict:
    """Compare the traces of a seed: whether the verdict is false, and the interval of the worn area; see `campaigns`."""
    kind = KINDS[seed % len(KINDS)]
    pair = draw_pair(kind, seed)
    try:
        comparison = compare_surfaces(*make_profiles(pair))
    except PatchfemError as error:
        return {"rows": [], "refused": str(error), "group": kind}
    verdict = comparison.verdict.code
    if kind in UNDECIDABLE:
        return {"rows": [], "outcome": verdict, "group": kind}
    is_false = verdict in FALSE_VERDICTS.get(kind, ("no_wear", "grown"))
    rows = [Row("verdict", float(is_false), 0.0, 0.0, 0.0, 0.0)]
    value = comparison.values["worn_area"]
    if verdict == "worn" and value.value is not None and value.high is not None:
        truth = 0.0
        if kind != "exchanged":
            truth = np.trapezoid(np.maximum(pair.worn, 0), pair.after[0])
        error = value.high - value.value if truth > value.value else value.value - value.low
        rows.append(Row("worn_area", value.value, error, 0.0, truth, 0.0))
    return {"rows": rows, "outcome": verdict, "group": kind}
