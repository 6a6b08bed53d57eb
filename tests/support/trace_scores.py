"""Score of `patchfem compare` on 200 pairs of traces with known wear, 40 of each of five generators.

    python tests/support/trace_scores.py SEED OTHER.py

Generators: `known_pairs`, `worn_kinds`, `track_pairs` (kinds in turn), tracks of 0.3 to 8 standard deviations of the
depth noise over the middle third, and OTHER.py with `machined_pairs(seed, count)` and `workshop_pairs(seed, count)`,
written by somebody who had not seen the method. Seeds below 70000 may have been used in developing it.

What counts:

- A headline is false if it states a worn depth or growth where there is none, or if "no wear detected" is said of a
  track between unworn flanks whose lost area is above that of the track which the sentence says would have been found,
  or, without such a limit, whose depth is above 20 times the noise of the depth. Pairs that OTHER.py calls undecidable
  cannot have a false headline.
- Intervals of pairs for which a worn depth is stated: mean and area of the lost material over the common length, and
  the largest depth, must contain the truth to half of the last digit of the heights. The interval of an end must
  contain a place, to one sample, between the nominal end and that where the depth leaves the noise.
"""

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import known_pairs
import numpy as np
import track_pairs
import worn_kinds
from scipy.ndimage import gaussian_filter1d

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface import Profile
from patchfem.surface.compare.compare import compare_traces
from patchfem.surface.compare.verdict import compose_verdict

N_PAIRS = 40
QUANTITIES = ("mean", "area", "largest", "from", "to")
NM = 1e-9


class ScoredPair(NamedTuple):
    """Two traces, and what is true of them.

    - is_worn: whether a track between unworn flanks, or worn tops between valleys, can be seen; None if undecidable.
    - has_grown: whether growth may be stated.
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


def _make_profile(x, z, name: str) -> Profile:
    return Profile(frozen_array(np.asarray(x, float)), frozen_array(np.asarray(z, float)), name)


def draw_known(seed: int) -> Iterator[ScoredPair]:
    """Draw pairs of `known_pairs`."""
    for k in range(N_PAIRS):
        pair = known_pairs.draw_pair(known_pairs.KINDS[k % len(known_pairs.KINDS)], seed + k)
        yield ScoredPair(
            pair.kind,
            *known_pairs.make_profiles(pair),
            is_worn=pair.kind in known_pairs.RUBBED,
            has_grown=pair.kind in ("deposits", "exchanged"),
            noise=8e-9,
            worn=pair.worn,
            digit=1e-9,
        )


def draw_kinds(seed: int) -> Iterator[ScoredPair]:
    """Draw pairs of `worn_kinds`."""
    kinds = tuple(worn_kinds.KINDS)
    for k in range(N_PAIRS):
        kind = kinds[k % len(kinds)]
        pair = worn_kinds.make_trace_pair(kind, seed + k)
        is_worn = kind not in ("unworn", "arch")
        yield ScoredPair(kind, pair.before, pair.after, is_worn, False, 40e-9, worn=pair.worn)


def draw_tracks(seed: int) -> Iterator[ScoredPair]:
    """Draw pairs of `track_pairs`."""
    for k in range(N_PAIRS):
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


def draw_shallow(seed: int) -> Iterator[ScoredPair]:
    """Draw tracks over the middle third, of 0 (each fifth) or 0.3 to 8 standard deviations."""
    x = 1e-6 * np.arange(3000)
    noise = 5e-9
    for k in range(N_PAIRS):
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


def draw_other(path: Path, seed: int) -> Iterator[ScoredPair]:
    """Draw 25 pairs of the laboratory and 15 of the workshop from the generator of somebody else."""
    spec = importlib.util.spec_from_file_location("other_pairs", path)
    other = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(other)
    for pair in (*other.machined_pairs(seed, 25), *other.workshop_pairs(seed, 15)):
        truths = {"mean": (pair["mean_gross"],), "area": (pair["area_gross"],)}
        if (
            pair["kind"] == "filled floor"
        ):  # what stands above the first surface may count as pile-up or not
            length = pair["common_to"] - pair["common_from"]
            truths = {"mean": (pair["mean_gross"], pair["area_net"] / length)}
            truths |= {"area": (pair["area_gross"], pair["area_net"])}
        ends = None
        if pair["track_from"] is not None and pair["seen_from"] is not None:
            ends = tuple((pair[f"track_{end}"], pair[f"seen_{end}"]) for end in ("from", "to"))
        is_open = pair["undecidable"] or pair["refuse_ok"] or pair["accept_unworn"]
        yield ScoredPair(
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
        )


def _read_truths(pair: ScoredPair, comparison) -> dict:
    """Return the accepted true values over the common part of two traces."""
    if pair.truths is not None:
        return pair.truths
    x = comparison.after.x if comparison.alignment is None else comparison.alignment.x
    worn = pair.worn[::-1] if comparison.is_mirrored else pair.worn
    lost = np.maximum(np.interp(x, pair.after.x, worn), 0.0)
    width = np.gradient(x)
    area = float(lost @ width)
    return {"mean": (area / width.sum(),), "area": (area,), "largest": (lost.max(),)}


def _holds(quantity, low: float, high: float) -> bool | None:
    """Return whether an interval contains a place between two values; None without an interval."""
    if quantity is None or quantity.value is None:
        return None
    upper = np.inf if quantity.high is None else quantity.high
    return bool(quantity.low <= high and low <= upper)


def score_pair(pair: ScoredPair) -> dict:
    """Compare a pair, and return its headline, whether it is false or missed, and which intervals hold."""
    try:
        comparison = compare_traces(pair.before, pair.after)
    except PatchfemError as refusal:
        return {"name": pair.name, "headline": f"refused: {refusal}", "missed": bool(pair.is_worn)}
    headline, sentences = compose_verdict([comparison])
    values = comparison.values
    mean = values["worn_depth_mean"]
    says_worn = mean.value is not None and mean.low > 0
    says_none = any("no wear detected" in sentence for sentence in sentences)
    truths = _read_truths(pair, comparison)
    limit = comparison.detection_limit
    x = pair.after.x
    is_above = (
        (truths["largest"][0] or 0.0) > 20 * pair.noise
        if limit is None
        else (truths["area"][0] or 0.0) > limit * (x[-1] - x[0]) / 3
    )
    is_false = says_worn and pair.is_worn is False
    is_false |= "material grew" in headline and not pair.has_grown and pair.is_worn is not None
    is_false |= bool(says_none and pair.is_worn and is_above)
    row = {"name": pair.name, "headline": headline, "false": bool(is_false)}
    row["missed"] = bool(pair.is_worn and not says_worn)
    if not says_worn or pair.is_worn is False or truths["mean"][0] is None:
        return row
    names = {"mean": "worn_depth_mean", "area": "worn_area", "largest": "worn_depth_max"}
    for name, key in names.items():
        digit = pair.digit / 2 * (x[-1] - x[0] if name == "area" else 1)
        held = [_holds(values[key], true - digit, true + digit) for true in truths[name]]
        row[name] = any(held)
        row[f"{name}_interval"] = (*values[key][:3], *truths[name])
    if pair.ends is not None:
        step = max(pair.before.step, pair.after.step)
        when = ("before", "after")[pair.side]
        for name, span in zip(("from", "to"), pair.ends, strict=True):
            end = values.get(f"worn_{name}_{when}")
            row[name] = _holds(end, min(span) - step, max(span) + step)
            row[f"{name}_interval"] = (*(end or (None,) * 3)[:3], *span)
    return row


def score_generators(seed: int, other: Path) -> Iterator[tuple]:
    """Yield the name of each generator with the rows of its pairs."""
    generators = {
        "known": draw_known(seed),
        "kinds": draw_kinds(seed),
        "tracks": draw_tracks(seed),
        "shallow": draw_shallow(seed),
        "other": draw_other(other, seed),
    }
    for name, pairs in generators.items():
        yield name, [score_pair(pair) for pair in pairs]


def format_scores(name: str, rows: list) -> str:
    """Return the counts of false and missed headlines and of intervals that hold as a line of text."""
    counts = [f"false {sum(row.get('false', False) for row in rows)}"]
    counts.append(f"missed {sum(row['missed'] for row in rows)}")
    for quantity in QUANTITIES:
        held = [row[quantity] for row in rows if row.get(quantity) is not None]
        counts.append(f"{quantity} {sum(held)}/{len(held)}")
    return f"{name:>8} {len(rows):4} pairs: " + ", ".join(counts)


def main() -> None:
    """Print the scores of each generator, their sum, and each pair with a fault."""
    every = []
    for name, rows in score_generators(int(sys.argv[1]), Path(sys.argv[2])):
        every += rows
        print(format_scores(name, rows), flush=True)
        for row in rows:
            faults = [q for q in QUANTITIES if row.get(q) is False]
            if faults or row.get("false") or row["missed"]:
                kind = "FALSE" if row.get("false") else "missed" * row["missed"]
                print(f"   {row['name']} | {row['headline'][:160]} | {kind}")
                for fault in faults:
                    value, low, high, *true = row[f"{fault}_interval"]
                    print(f"      {fault} {value:.6g} ({low:.6g}..{high:.6g}), true {true}")
    print(format_scores("all", every))


if __name__ == "__main__":
    main()
