"""Six generators of pairs of traces with known wear, written from how surfaces, wear and stylus instruments work.

A pair is drawn on a line with four points per sample, worn, and traced twice; each trace has its own start, tilt, noise,
drift, gain and faults. Until a pair is complete, lengths are in samples of the first trace, and heights in rms heights of
the unworn surface. `score_pair` compares a pair and says what is right.
"""

import time
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d, grey_dilation, uniform_filter1d

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface import Profile
from patchfem.surface.compare.compare import compare_surfaces

FINE = 4  # points of a surface per sample of the first trace
UM = 1e-6


class Generator(NamedTuple):
    """Number of pairs of a generator in a set of 250, and its kinds of wear or faults, drawn in turn."""

    count: int
    kinds: tuple[str, ...]


GENERATORS = {
    # Tracks of .6 to 8 standard deviations of a depth
    "shallow": Generator(40, ("shallow", "shallow", "shallow", "none")),
    # Surfaces and measurements that are hard to place or to judge
    "odd": Generator(
        60,
        (
            *("mirror finish", "periodic", "elsewhere", "elsewhere track", "noisy", "transfer"),
            *("whole", "mirrored", "few", "fine second", "gaps", "stretched", "exchanged", "dust"),
            *("deposit", "craters", "tip", "two tracks", "bent", "bent unworn"),
        ),
    ),
    # Slow drift of both measurements
    "drift": Generator(36, ("drift", "drift", "drift unworn")),
    # Shapes of tracks on five finishes
    "mine": Generator(
        45,
        (
            *("arc", "box", "trapezoid", "corner", "polished", "new floor"),
            *("ridges", "none", "cut off"),
        ),
    ),
    # Wear that a laboratory knows
    "known": Generator(30, ("groove", "edge", "run-in", "unworn", "dropouts", "bent")),
    # Faults of instruments and unusual wear
    "own": Generator(
        39,
        (
            *(
                "polish",
                "scratch",
                "fine scratches",
                "remounted",
                "low gain",
                "high gain",
                "spikes",
            ),
            *("jump", "half worn", "ground anew", "jump", "half worn", "none"),
        ),
    ),
}
UNWORN = (
    "none",
    "elsewhere",
    "dust",
    "bent unworn",
    "drift unworn",
    "unworn",
    "remounted",
    "low gain",
    "jump",
)
GROWN = ("deposit", "exchanged")
# Kinds of which the heights allow two causes: "either ... or" is right too
AMBIGUOUS = ("jump", "half worn", "whole")
SINGLE_TRACKS = (
    *(
        "shallow",
        "drift",
        "arc",
        "box",
        "trapezoid",
        "corner",
        "polished",
        "new floor",
        "ridges",
        "groove",
    ),
    *(
        "bent",
        "few",
        "fine second",
        "stretched",
        "high gain",
        "mirror finish",
        "periodic",
        "gaps",
        "scratch",
        "spikes",
    ),
)
DOUBTS = ("growth_at_ends", "scar_or_bow", "scar_or_drift", "scar_or_step")
REFUSALS = ("elsewhere", "no_datum", "mirror_finish", "refused")
VERDICTS = ("right", "false", "missed")
INTERVALS = ("mean", "area", "largest", "from", "to", "width")


class WornPair(NamedTuple):
    """Two traces and what is true of them.

    - worn: loss (n,) [m] at the samples of the second trace, negative where material grew.
    - ends: place [m] in the second trace of both ends of a single track, each as nominal place and place where the loss
      leaves the noise; None for other wear.
    """

    kind: str
    before: Profile
    after: Profile
    worn: np.ndarray
    ends: tuple[tuple[float, float], ...] | None


def draw_rough(random, count: int, length: float) -> np.ndarray:
    """Return Gaussian heights (count,) of unit deviation with this correlation length in samples."""
    z = gaussian_filter1d(random.normal(size=count), FINE * length)
    return (z - z.mean()) / z.std()


def draw_finish(random, count: int) -> np.ndarray:
    """Return heights (count,) of unit deviation: ground, turned, honed with plateaus, blasted or self-affine."""
    u = np.arange(count) / FINE
    style = random.integers(5)
    z = draw_rough(random, count, random.uniform(3, 15))
    if style == 1:
        feed = random.uniform(40, 150)
        phase = u / feed + 0.05 * draw_rough(random, count, feed)
        z = 2 * np.abs(np.sin(np.pi * phase)) + 0.3 * z
    elif style == 2:
        z = np.where(z > 0, random.uniform(0.1, 0.4) * z, z)
    elif style == 3:
        z = 0.3 * z
        for middle in random.uniform(0, u[-1], count // (FINE * 50)):
            t = (u - middle) / random.uniform(8, 40)
            z = z - random.uniform(0.5, 2) * np.clip(1 - t**2, 0, None)
    elif style == 4:
        wave = np.fft.rfftfreq(count, 1 / FINE)
        power = np.maximum(wave, 1 / random.uniform(80, 300)) ** -random.uniform(2.2, 2.8)
        power /= 1 + (wave * random.uniform(4, 10)) ** 6
        z = np.fft.irfft(np.sqrt(power) * np.exp(2j * np.pi * random.random(wave.size)), count)
    z = z - z.mean()
    return z / z.std()


def wear_surface(random, kind: str, u, z, ends: tuple[float, float], noise: float) -> np.ndarray:
    """Return the heights (m,) after wear of a kind at places u (m,) of a surface z (m,), between two ends."""
    first, last = ends
    t = (2 * u - first - last) / (last - first)
    inside = np.abs(t) < 1
    ramp = np.clip((1 - np.abs(t)) / random.uniform(0.05, 0.4), 0, 1)
    arc = np.clip(1 - t**2, 0, None)
    depth = np.exp(random.uniform(np.log(0.4), np.log(4)))
    depth = max(depth, 20 * noise)
    if kind == "shallow":
        return z - random.uniform(0.6, 8) * np.sqrt(2) * noise * (
            inside if random.random() < 0.5 else arc
        )
    if kind in (
        "arc",
        "drift",
        "few",
        "stretched",
        "high gain",
        "mirror finish",
        "periodic",
        "spikes",
        "noisy",
    ):
        return z - depth * arc
    if kind == "box":
        return z - depth * inside
    if kind in (
        "trapezoid",
        "groove",
        "bent",
        "fine second",
        "gaps",
        "dropouts",
        "mirrored",
        "exchanged",
    ):
        return z - depth * (3 * ramp**2 - 2 * ramp**3)
    if kind == "corner":
        apex = random.uniform(-0.6, 0.6)
        return z - depth * np.clip(
            np.where(t < apex, (1 + t) / (1 + apex), (1 - t) / (1 - apex)), 0, None
        )
    if kind in ("polished", "polish"):
        line = uniform_filter1d(z, int(FINE * random.uniform(30, 120)))
        pressed = random.uniform(0.3, 0.95) * np.maximum(z - line, 0)
        return (
            z
            - pressed * (ramp if kind == "polished" else 1.0)
            - (0.3 * depth * ramp if kind == "polished" else 0)
        )
    if kind in ("run-in", "tip"):
        level = np.quantile(z, random.uniform(0.5, 0.85))
        return np.where(z > level, level + random.uniform(0.0, 0.15) * (z - level), z)
    if kind in ("new floor", "ground anew"):
        new = random.uniform(0.1, 0.7) * draw_rough(random, u.size, random.uniform(2, 10))
        floor = np.quantile(z, 0.99) - (1.5 + depth) * np.minimum(1, 4 * ramp) + new
        return np.where(inside, np.minimum(z, floor), z)
    if kind in ("ridges", "scratch"):
        ridge = 0.25 * depth * (np.exp(-(((np.abs(t) - 1.12) / 0.06) ** 2)) - np.exp(-4.0)).clip(0)
        return z - depth * arc + np.where(np.abs(t) > 1, ridge, 0)
    if kind == "fine scratches":
        for middle in random.uniform(first, last, 40):
            z = z - random.uniform(0.3, 1.5) * np.clip(
                1 - np.abs(u - middle) / random.uniform(3, 10), 0, None
            )
        return z
    if kind == "craters":
        for middle in random.uniform(first, last, random.integers(2, 7)):
            z = z - depth * np.sqrt(
                np.clip(1 - ((u - middle) / random.uniform(15, 60)) ** 2, 0, None)
            )
        return z
    if kind == "two tracks":
        other = np.clip(
            1 - (4 * (u - first + 0.25 * (last - first) + 60) / (last - first)) ** 2, 0, None
        )
        return z - depth * np.clip(1 - (2 * t - 1) ** 2, 0, None) - 0.6 * depth * other
    if kind == "transfer":
        lump = np.clip(
            1 - ((2 * u - 2 * last - 0.5 * (last - first)) / (0.4 * (last - first))) ** 2, 0, None
        )
        return z - depth * arc + random.uniform(0.5, 1.5) * depth * lump
    if kind == "deposit":
        return z + depth * ramp
    if kind == "whole":
        return z - 3 * depth * np.clip(1 - (2 * u / u[-1] - 1) ** 2, 0, None)
    if kind in ("half worn", "edge", "cut off"):
        edge = 0.5 * (first + last) + 0.1 * (last - first)
        flank = {
            "half worn": 0.5,
            "edge": random.uniform(30, 150),
            "cut off": random.uniform(60, 400),
        }[kind]
        into = np.clip((u - edge) / flank, 0, 1)
        return z - depth * into ** random.choice([1, 2])
    if kind == "elsewhere track":
        return z - 12 * depth * arc
    return z


def draw_pair(generator: str, seed: int, index: int) -> WornPair:
    """Draw the pair at an index of a generator for a seed."""
    random = np.random.default_rng([seed, index, list(GENERATORS).index(generator)])
    kinds = GENERATORS[generator].kinds
    kind = kinds[index % len(kinds)]
    count = int(np.exp(random.uniform(np.log(1000), np.log(6000))))
    noise = 10 ** random.uniform(-2.7, -1.4)
    if kind == "few":
        count = 400
    if kind == "noisy":
        noise = random.uniform(0.2, 0.5)
    reach = count * (2.3 if kind.startswith("elsewhere") else 1.15)
    u = np.arange(int(FINE * reach)) / FINE
    z = draw_finish(random, u.size)
    if kind == "mirror finish":
        noise = random.uniform(0.25, 0.6)
        z = draw_rough(random, u.size, random.uniform(3, 10))
    if kind == "periodic":
        z = np.cos(2 * np.pi * u / random.uniform(40, 120) + 0.3 * draw_rough(random, u.size, 300))
        z = np.sqrt(2) * z + 0.1 * draw_rough(random, u.size, 4)
    starts = random.uniform(0.01, 0.12, 2) * count
    width = random.uniform(0.15, 0.45)
    first = random.uniform(0.27, 0.85 - width)
    ends = (first * count, (first + width) * count)
    if kind.startswith("elsewhere"):
        starts[1] += 1.1 * count
        ends = (ends[0] + 1.1 * count, ends[1] + 1.1 * count)
    worn_line = wear_surface(random, kind, u, z, ends, noise)
    heights = [z, worn_line]
    if kind == "exchanged":
        heights = heights[::-1]
    if kind == "tip":
        # A ball of 50 to 400 samples radius at these heights rounds narrow valleys.
        ball = np.arange(-24, 25) / FINE
        tip = -(ball**2) / random.uniform(10, 80)
        heights = [grey_dilation(line, structure=tip) for line in heights]

    step = 10 ** random.uniform(-6.3, -5.4)
    unit = 10 ** random.uniform(-7.3, -5.8)
    ratio = random.choice([0.5, 0.7, 1.3]) if kind == "fine second" else 1.0
    stretch = 1 + (random.uniform(-8e-3, 8e-3) if kind == "stretched" else random.normal(0, 3e-4))
    traces = []
    for side in (0, 1):
        x = np.arange(0, count, ratio if side else 1.0)
        places = starts[side] + x * (stretch if side else 1.0)
        traces.append(
            (
                x,
                places,
                trace_line(
                    random, generator, kind, side, x, np.interp(places, u, heights[side]), noise
                ),
            )
        )

    (x_before, _, z_before), (x_after, places, z_after) = traces
    worn = np.interp(places, u, heights[0] - heights[1])
    seen = None
    if kind in SINGLE_TRACKS:
        nominal = np.interp(ends, places, x_after)
        deep = x_after[worn > 3 * np.sqrt(2) * noise]
        visible = deep[[0, -1]] if deep.size else nominal
        seen = tuple((a * step, b * step) for a, b in zip(nominal, visible))
    if kind == "mirrored":
        z_after = z_after[::-1]
        worn = worn[::-1]
    profiles = [
        Profile(frozen_array(x * step), frozen_array(np.round(line * unit, 11)), name)
        for x, line, name in ((x_before, z_before, "before"), (x_after, z_after, "after"))
    ]
    return WornPair(kind, *profiles, worn * unit, seen)


def trace_line(
    random, generator: str, kind: str, side: int, x, heights, noise: float
) -> np.ndarray:
    """Return the heights (n,) that the instrument reads at x (n,), with the faults of a kind of pair."""
    # The gain of the second trace differs slightly; the first one defines the unit of height.
    z = heights * (random.normal(1, 1e-3) if side else 1.0)
    z = (
        z
        + random.uniform(-20, 20) * x / x[-1]
        + random.uniform(-5, 5)
        + random.normal(0, noise, x.size)
    )
    t = 2 * x / x[-1] - 1
    if generator == "drift":
        slow = gaussian_filter1d(
            random.normal(size=3 * x.size), random.uniform(0.08, 0.4) * x.size
        )[x.size : -x.size]
        z += random.uniform(1, 8) * noise * slow / slow.std()
    if side and kind.startswith("bent"):
        z += random.choice([-1, 1]) * random.uniform(2, 6) * t**2
    if side and kind == "remounted":
        # 5 mrad, if a height is a thousandth of a length
        z += 5e-3 * x * random.uniform(5, 50)
    if side and kind in ("low gain", "high gain"):
        z *= 0.95 if kind == "low gain" else 1.05
    if side and kind == "jump":
        z[int(random.uniform(0.25, 0.75) * x.size) :] += (
            random.choice([-1, 1]) * random.uniform(20, 200) * noise
        )
    if kind in ("gaps", "dropouts", "spikes"):
        for place in random.integers(10, x.size - 60, 3):
            z[place : place + random.integers(2, 40 if kind == "gaps" else 6)] = (
                np.nan if kind == "gaps" else -25.0
            )
    if kind in ("dust", "spikes"):
        for place in random.integers(10, x.size - 10, 3):
            z[place : place + random.integers(1, 4)] += random.uniform(8, 25)
    return z


def holds(quantity, low: float, high: float) -> bool | None:
    """Return whether an interval contains a value between two others; None without an interval."""
    if quantity.value is None or quantity.low is None:
        return None
    return bool(
        quantity.low <= high and low <= (np.inf if quantity.high is None else quantity.high)
    )


def judge_outcome(
    kind: str, code: str, mean: float, at_most: float | None, mean_holds: bool | None
) -> str:
    """Return "right", "false" or "missed" for the verdict on a pair of a kind, whose mean lost depth [m] is known.

    A verdict is false if it states a loss or growth where there is none, or no wear where more is lost than it allows.
    """
    if code in DOUBTS or code in REFUSALS:
        is_open = kind in UNWORN or kind in GROWN or (code in DOUBTS and kind in AMBIGUOUS)
        return "right" if is_open or kind == "elsewhere track" else "missed"
    if kind in GROWN:
        return "right" if code == "grown" else "false"
    if code == "grown":
        return "false"
    if kind in UNWORN:
        return "false" if code.startswith("worn") else "right"
    if code == "no_wear":
        return "false" if at_most is not None and mean > at_most else "missed"
    return "false" if kind == "whole" and not mean_holds else "right"


def score_pair(pair: WornPair) -> dict:
    """Compare a pair; return the judgement of the verdict, the intervals that hold, and their relative half-widths."""
    start = time.process_time()
    try:
        found = compare_surfaces(pair.before, pair.after)
        code = found.verdict.code
    except PatchfemError:
        return {
            "kind": pair.kind,
            "code": "refused",
            "verdict": judge_outcome(pair.kind, "refused", 0.0, None, None),
        }
    row = {"kind": pair.kind, "code": code, "seconds": time.process_time() - start}

    x = pair.after.x
    worn = pair.worn
    curves = found.evidence.curves
    if curves is not None:
        values = worn[::-1] if found.evidence.placement.mirrored else worn
        x, worn = curves.x, np.interp(curves.x, x, values)
    lost = np.maximum(worn, 0.0)
    mean = float(lost.mean())
    length = float(np.ptp(x))
    is_measured = code.startswith("worn") and pair.kind not in (*UNWORN, *GROWN)
    truths = {}
    if is_measured:
        digit = 0.5e-10
        truths = {
            "mean": ("worn_depth_mean", mean - digit, mean + digit),
            "area": ("worn_area", (mean - digit) * length, (mean + digit) * length),
            "largest": ("worn_depth_max", lost.max() - digit, lost.max() + digit),
        }
    quantities = {name: (found.values[key], low, high) for name, (key, low, high) in truths.items()}
    if is_measured and pair.ends is not None:
        step = max(pair.before.step, pair.after.step)
        for name, end in zip(("from", "to"), pair.ends):
            quantities[name] = (
                found.values[f"worn_{name}_after"],
                min(end) - step,
                max(end) + step,
            )
        first, last = pair.ends
        shortest = min(last) - max(first) - 2 * step
        quantities["width"] = (
            found.track.values["width"],
            shortest,
            max(last) - min(first) + 2 * step,
        )
    for name, (quantity, low, high) in quantities.items():
        row[name] = holds(quantity, low, high)
        if row[name] is not None and quantity.high is not None:
            scale = (
                (low + high) / 2
                if name not in ("from", "to")
                else pair.ends[1][0] - pair.ends[0][0]
            )
            row[f"{name} width"] = (quantity.high - quantity.low) / 2 / scale
            row[f"{name} error"] = max(quantity.value - high, low - quantity.value, 0.0) / scale
    at_most = found.verdict.numbers.get("at_most")
    row["verdict"] = judge_outcome(pair.kind, code, mean, at_most, row.get("mean"))
    return row
