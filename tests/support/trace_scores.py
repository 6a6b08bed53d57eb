"""Score of the comparison on pairs of traces with known wear, from eight generators.

    python tests/support/trace_scores.py SEED COUNT NAME=MODULE.py:FUNCTION ...
    python tests/support/trace_scores.py SEED COUNT ratios

Four generators belong to the tests: `known_pairs`, `worn_kinds`, `track_pairs` (kinds in turn), and tracks of 0.3 to 8
standard deviations of the depth noise over the middle third. The others are functions `FUNCTION(seed, count)` of
somebody who had not seen the method; they yield dicts with the keys that `read_dict` reads, or are named `make(seed)`.
Seeds below 900000 may have been used in developing it; the scores of 1.2 and later used 910000, 9841001 and, for the rule
of the largest depth, 9843001 with 75 pairs of each of eight generators (known, kinds, tracks, shallow, machined, workshop,
a, b): 9 of 600 headlines false, 5 pairs refused, intervals that hold: mean 370 of 387, area 371, largest depth 362, from
235 of 255, to 235 of 260, width 244 of 263. `scan_scores` used 9842001, and 9844001 with 15 pairs of each of two generators.

What counts:

- A headline is false if it states a worn depth or growth where there is none, or if "no wear" is said of a track
  between unworn flanks whose lost area is above that of the track which the comparison says it would have found, or,
  without such a limit, whose depth is above 20 times the noise of the depth. Pairs whose wear cannot be decided
  cannot have a false headline.
- A pair is refused if something can be said of it, and the verdict is that there is no common place or datum.
- A pair is missed if it is worn, something can be said of it, and no worn depth is stated.
- Intervals of pairs for which a worn depth is stated: mean and area of the lost material over the common length, and
  the largest depth, must contain the truth to half of the last digit of the heights. The interval of an end must
  contain a place, to one sample, between the nominal end and that where the depth leaves the noise; that of the width
  a difference of such places.
"""

import importlib.util
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import known_pairs
import numpy as np
import track_pairs
import worn_kinds
from scipy.ndimage import gaussian_filter1d

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface.profile import Profile

QUANTITIES = ("mean", "area", "largest", "from", "to", "width")
REFUSALS = ("elsewhere", "no_datum", "mirror_finish", "refused")
NM = 1e-9


class ScoredPair(NamedTuple):
    """Two traces, and what is true of them.

    - is_worn: whether a track between unworn flanks, or worn tops between valleys, can be seen; None if undecidable.
    - has_grown: whether growth may be stated.
    - may_refuse: whether "no common place" is a right answer too.
    - truths: mean [m], area [m2] and largest [m] by name, as tuples of accepted values; None reads them from worn.
    - worn: lost material (n,) [m] at the samples of the second trace, or None.
    - ends: as in `TrackPair`; side: index of the trace whose x they use.
    - noise: of the depth [m]; digit: last digit of the heights [m].
    """

    name: str
    before: Profile
    after: Profile
    is_worn: bool | None
    has_grown: bool
    noise: float
    worn: np.ndarray | None = None
    truths: dict | None = None
    ends: tuple | None = None
    side: int = 1
    digit: float = 1e-10
    may_refuse: bool = False


class Outcome(NamedTuple):
    """What a comparison says of a pair.

    - code: verdict; intervals: {quantity: (value, low, high)}, ends by "from_before" and so on.
    - x: places (n,) [m] of the depths in the second trace; limit: detection limit [m] or None.
    """

    code: str
    intervals: dict
    x: np.ndarray | None = None
    is_mirrored: bool = False
    limit: float | None = None


def _make_profile(x, z, name: str) -> Profile:
    return Profile(frozen_array(np.asarray(x, float)), frozen_array(np.asarray(z, float)), name)


def draw_known(seed: int, count: int) -> Iterator[ScoredPair]:
    """Draw pairs of `known_pairs`."""
    for k in range(count):
        pair = known_pairs.draw_pair(known_pairs.KINDS[k % len(known_pairs.KINDS)], seed + k)
        yield ScoredPair(
            pair.kind,
            *known_pairs.make_profiles(pair),
            is_worn=pair.kind in known_pairs.RUBBED,
            has_grown=pair.kind in ("deposits", "exchanged"),
            noise=8e-9,
            worn=pair.worn,
            digit=1e-9,
            may_refuse=pair.kind in ("elsewhere", "turned", "even", "exchanged"),
        )


def draw_kinds(seed: int, count: int) -> Iterator[ScoredPair]:
    """Draw pairs of `worn_kinds`."""
    kinds = tuple(worn_kinds.KINDS)
    for k in range(count):
        kind = kinds[k % len(kinds)]
        pair = worn_kinds.make_trace_pair(kind, seed + k)
        is_worn = kind not in ("unworn", "arch")
        yield ScoredPair(kind, pair.before, pair.after, is_worn, False, 40e-9, worn=pair.worn)


def draw_tracks(seed: int, count: int) -> Iterator[ScoredPair]:
    """Draw pairs of `track_pairs`."""
    for k in range(count):
        pair = track_pairs.draw_pair(track_pairs.KINDS[k % len(track_pairs.KINDS)], seed + k)
        yield ScoredPair(
            pair.kind,
            pair.before,
            pair.after,
            is_worn=pair.kind not in (*track_pairs.WITHOUT, "drift alone"),
            has_grown=pair.kind == "lumps",
            noise=np.sqrt(2) * pair.noise,
            worn=pair.worn,
            ends=pair.ends,
        )


def draw_shallow(seed: int, count: int) -> Iterator[ScoredPair]:
    """Draw tracks over the middle third, of 0 (each fifth) or 0.3 to 8 standard deviations."""
    x = 1e-6 * np.arange(3000)
    noise = 5e-9
    for k in range(count):
        random = np.random.default_rng([seed, k])
        depth = np.sqrt(2) * noise * random.uniform(0.3, 8) if k % 5 else 0.0
        surface = gaussian_filter1d(random.normal(size=3300), 10.6)[100:-100]
        surface *= 0.5e-6 / surface.std()
        worn = depth * ((x >= 1e-3) & (x < 2e-3))
        heights = (surface[:3000], surface[40:3040] - worn)
        before, after = (
            _make_profile(x, z + noise * random.normal(size=3000) + 3e-4 * x, name)
            for z, name in zip(heights, ("before", "after"), strict=True)
        )
        yield ScoredPair(
            f"shallow {depth / noise / np.sqrt(2):.2f}",
            before,
            after,
            is_worn=depth > 0,
            has_grown=False,
            noise=np.sqrt(2) * noise,
            worn=worn,
            ends=((1e-3, 1e-3), (2e-3, 2e-3)) if depth else None,
        )


def load_function(path: str) -> Callable:
    """Load `MODULE.py:FUNCTION`."""
    module, name = path.rsplit(":", 1)
    spec = importlib.util.spec_from_file_location(Path(module).stem, module)
    loaded = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(Path(module).parent))
    sys.modules[spec.name] = loaded
    spec.loader.exec_module(loaded)
    return getattr(loaded, name)


def read_dict(pair: dict) -> ScoredPair:
    """Read a pair of the generators of somebody else."""
    truths = {"mean": (pair["mean_gross"],), "area": (pair["area_gross"],)}
    if pair["kind"] == "filled floor":
        # What stands above the first surface may count as pile-up or not.
        length = pair["common_to"] - pair["common_from"]
        truths = {"mean": (pair["mean_gross"], pair["area_net"] / length)}
        truths |= {"area": (pair["area_gross"], pair["area_net"])}
    ends = None
    if pair["track_from"] is not None and pair["seen_from"] is not None:
        ends = tuple((pair[f"track_{end}"], pair[f"seen_{end}"]) for end in ("from", "to"))
    is_open = pair["undecidable"] or pair["refuse_ok"] or pair["accept_unworn"]
    return ScoredPair(
        pair["name"] + " " + pair["kind"],
        _make_profile(pair["x_before"], pair["z_before"], "before"),
        _make_profile(pair["x_after"], pair["z_after"], "after"),
        is_worn=None if is_open and pair["really_worn"] else bool(pair["really_worn"]),
        has_grown=(pair["pile_up"] or 0.0) > 0,
        noise=max(pair["noise_depth"], pair["residual"] or 0.0),
        truths=truths | {"largest": (pair["largest"],)},
        ends=ends,
        side=0,
        digit=pair["digits"] or 1e-10,
        may_refuse=bool(pair["refuse_ok"] or pair["undecidable"]),
    )


def draw_made(make: Callable, seed: int, count: int) -> Iterator[ScoredPair]:
    """Draw pairs of a generator `make(seed)`, whose truth is the loss of material of the surface itself."""
    for k in range(count):
        pair = make(seed + k)
        truth = pair["truth"]
        area = truth["removed_area"]
        # What traces show of the loss, with the radius of the tip, is a right answer too.
        means = [area / truth["common_length"]]
        if truth.get("depth_mean_traced") is not None and not truth["built_up_area"]:
            means.append(truth["depth_mean_traced"])
        is_single = truth["ends"] is not None and len(truth["tracks"]) == 1
        # A loss below the noise of a single point cannot be decided.
        is_hidden = truth["worn"] and area < 1.5 * truth["noise"] * max(truth["width"], 1e-12)
        yield ScoredPair(
            f"{k} {truth['kind']} {truth['finish']}",
            _make_profile(*pair["before"], "before"),
            _make_profile(*pair["after"], "after"),
            is_worn=None if is_hidden else bool(truth["worn"]),
            has_grown=truth["built_up_area"] > 0,
            noise=np.sqrt(2) * truth["noise"],
            truths={
                "mean": tuple(means),
                "area": tuple(mean * truth["common_length"] for mean in means),
                "largest": (truth["largest_depth"],),
            },
            ends=tuple((end, end) for end in truth["ends"]) if is_single else None,
            side=0,
        )


def judge(before: Profile, after: Profile) -> Outcome:
    """Compare two traces."""
    from patchfem.surface.compare.compare import compare_surfaces

    try:
        comparison = compare_surfaces(before, after)
    except PatchfemError:
        return Outcome("refused", {})
    values = comparison.values
    intervals = {}
    names = {"mean": "worn_depth_mean", "area": "worn_area", "largest": "worn_depth_max"}
    names |= {
        f"{end}_{side}": f"worn_{end}_{side}"
        for end in ("from", "to")
        for side in ("before", "after")
    }
    for name, key in names.items():
        intervals[name] = values[key][:3]
    if comparison.track is not None:
        intervals["width"] = comparison.track.values["width"][:3]
    curves = comparison.evidence.curves
    placement = comparison.evidence.placement
    return Outcome(
        comparison.verdict.code,
        {name: bounds for name, bounds in intervals.items() if bounds[0] is not None},
        None if curves is None else curves.x,
        bool(placement and placement.mirrored),
        comparison.verdict.numbers.get("detection_limit"),
    )


def _read_truths(pair: ScoredPair, outcome: Outcome) -> dict:
    """Return the accepted true values over the common part of two traces."""
    if pair.truths is not None:
        return pair.truths
    x = pair.after.x if outcome.x is None else outcome.x
    worn = pair.worn[::-1] if outcome.is_mirrored else pair.worn
    lost = np.maximum(np.interp(x, pair.after.x, worn), 0.0)
    width = np.gradient(x)
    area = float(lost @ width)
    return {"mean": (area / width.sum(),), "area": (area,), "largest": (lost.max(),)}


def _holds(bounds, low: float, high: float) -> bool | None:
    """Return whether an interval contains a place between two values; None without an interval."""
    if bounds is None or bounds[1] is None:
        return None
    upper = np.inf if bounds[2] is None else bounds[2]
    return bool(bounds[1] <= high and low <= upper)


def score_pair(pair: ScoredPair, judge: Callable = judge) -> dict:
    """Compare a pair, and return its verdict, whether it is false or missed, and which intervals hold."""
    start = time.process_time()
    outcome = judge(pair.before, pair.after)
    row = {"name": pair.name, "code": outcome.code, "seconds": time.process_time() - start}
    says_worn = outcome.code.startswith("worn")
    truths = _read_truths(pair, outcome)
    x = pair.after.x
    is_above = (
        (truths["largest"][0] or 0.0) > 20 * pair.noise
        if outcome.limit is None
        else (truths["area"][0] or 0.0) > outcome.limit * (x[-1] - x[0]) / 3
    )

    is_false = says_worn and pair.is_worn is False
    is_false |= outcome.code == "grown" and not pair.has_grown and pair.is_worn is not None
    is_false |= bool(outcome.code == "no_wear" and pair.is_worn and is_above)
    row["false"] = bool(is_false)
    row["refused"] = outcome.code in REFUSALS and pair.is_worn is not None and not pair.may_refuse
    row["missed"] = bool(pair.is_worn and not says_worn)
    if not says_worn or pair.is_worn is False or truths["mean"][0] is None:
        return row

    for name in ("mean", "area", "largest"):
        digit = pair.digit / 2 * (x[-1] - x[0] if name == "area" else 1)
        bounds = outcome.intervals.get(name)
        held = [_holds(bounds, true - digit, true + digit) for true in truths[name]]
        row[name] = any(held)
        row[f"{name}_interval"] = (*(bounds or (None,) * 3), *truths[name])
    if pair.ends is not None:
        step = max(pair.before.step, pair.after.step)
        side = ("before", "after")[pair.side]
        for name, span in zip(("from", "to"), pair.ends, strict=True):
            bounds = outcome.intervals.get(f"{name}_{side}")
            row[name] = _holds(bounds, min(span) - step, max(span) + step)
            row[f"{name}_interval"] = (*(bounds or (None,) * 3), *span)
        first, last = pair.ends
        span = (min(last) - max(first), max(last) - min(first))
        row["width"] = _holds(
            outcome.intervals.get("width"), span[0] - 2 * step, span[1] + 2 * step
        )
        row["width_interval"] = (*(outcome.intervals.get("width") or (None,) * 3), *span)
    return row


def score_ratios(seed: int, count: int) -> dict[str, list[int]]:
    """Score the intervals of the ratios of waves: {quantity: [held, stated]}.

    The second trace shows the same or another place of a polished surface. A true ratio is that of the whole surface,
    which is 20 times longer than the traces.
    """
    from patchfem.surface.compare.compare import compare_surfaces
    from patchfem.surface.compare.waves import compare_waves

    scores = {"amplitude_ratio": [0, 0], "slope_ratio": [0, 0]}
    for k in range(count):
        draw = np.random.default_rng([seed, k])
        length, step = draw.uniform(2e-3, 6e-3), 0.5e-6
        x, new = known_pairs.draw_surface(
            draw, 20 * length, ("self-affine", "turned", "plateau")[k % 3]
        )
        x, new = x[::2], new[::2]
        old = new - draw.uniform(0, 0.6) * (new - gaussian_filter1d(new, draw.uniform(5, 60)))
        part = slice(0, int(20 * length / step))
        truths = compare_waves([z[None, part] for z in (new, old)], step, 0.0)
        n = int(length / step)
        starts = draw.integers(0, part.stop - n, 2)
        starts[1] = starts[draw.integers(2)]
        traces = []
        for name, z, start in zip(("before", "after"), (new, old), starts, strict=True):
            noise = draw.normal(0, 3e-9, n)
            traces.append(_make_profile(x[:n], np.round(z[start : start + n] + noise, 9), name))
        values = compare_surfaces(*traces).values
        for name, score in scores.items():
            bounds = values[name]
            if bounds.value is not None:
                score[1] += 1
                score[0] += bounds.low <= truths[name].value <= bounds.high
    return scores


def draw_generators(seed: int, count: int, others: list[str]) -> Iterator[tuple[str, Iterator]]:
    """Yield the name of each generator with its pairs."""
    own = {"known": draw_known, "kinds": draw_kinds, "tracks": draw_tracks, "shallow": draw_shallow}
    for name, draw in own.items():
        yield name, draw(seed, count)
    for text in others:
        name, path = text.split("=", 1)
        function = load_function(path)
        if path.endswith(":make"):
            yield name, draw_made(function, seed, count)
        else:
            yield name, map(read_dict, function(seed, count))


def format_scores(name: str, rows: list) -> str:
    """Return the counts of headlines and of intervals that hold as a line of text."""
    counts = [
        f"{key} {sum(row.get(key, False) for row in rows)}"
        for key in ("false", "refused", "missed")
    ]
    for quantity in QUANTITIES:
        held = [row[quantity] for row in rows if row.get(quantity) is not None]
        counts.append(f"{quantity} {sum(held)}/{len(held)}")
    seconds = np.mean([row["seconds"] for row in rows])
    return f"{name:>8} {len(rows):4} pairs: " + ", ".join(counts) + f", {seconds:.2f} s"


def score_all(seed: int, count: int, others: list[str], judge: Callable = judge) -> list[dict]:
    """Print the scores of each generator, their sum, and each pair with a fault; return the rows."""
    every = []
    for name, pairs in draw_generators(seed, count, others):
        rows = [score_pair(pair, judge) for pair in pairs]
        every += rows
        print(format_scores(name, rows), flush=True)
        for row in rows:
            faults = [quantity for quantity in QUANTITIES if row.get(quantity) is False]
            words = [key for key in ("false", "refused", "missed") if row.get(key)]
            if faults or words:
                print(f"   {row['name']} | {row['code']} | {' '.join(words)}")
            for fault in faults:
                value, low, high, *true = row[f"{fault}_interval"]
                print(f"      {fault} {value} ({low}..{high}), true {true}")
    print(format_scores("all", every))
    return every


if __name__ == "__main__":
    if sys.argv[3:] == ["ratios"]:
        print(score_ratios(int(sys.argv[1]), int(sys.argv[2])))
    else:
        score_all(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:])
