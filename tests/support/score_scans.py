"""Score `patchfem.compare` on areal scans with known truth (`scan_pairs`).

    python tests/support/score_scans.py --first 1 --count 15 -j 2 --table scores.json

A claim is false where it contradicts the truth: wear of an unworn surface, growth where nothing grew, no wear although
more was worn than the stated limit, volumes of two different places. False ratios are changes of waves or slopes of a
surface whose shape did not change; they are counted apart, as the noise of the two scans may differ. Refused are pairs
that could be compared and were not; missed are worn pairs without a worn volume. An interval holds where it contains
the truth. The names end in a word where several definitions are scored: `_inner` also accepts the volume without the
border of the region, `_median` is of 3 x 3 depths, `_flat` of flanks that run out flat.
"""

import re
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
import scan_pairs
from score_pairs import UNITS, make_parser, run_scores, write_table

SHOWN = (
    "worn_depth_mean",
    "worn_depth_max",
    "worn_volume",
    "grown_volume",
    "track_width",
    "track_depth",
)


def compare_pair(pair) -> dict:
    """Return the answer of `patchfem.compare` and its time [s]; `error` holds the message where it is refused."""
    import patchfem

    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for name, heights in (("before", pair.before), ("after", pair.after)):
            paths.append(Path(folder) / f"{name}.npy")
            np.save(paths[-1], heights * 1e6)
        start = time.perf_counter()
        try:
            answer = patchfem.compare(*paths, units=(f"{pair.spacing * 1e6:.12g} um", "um"))
        except patchfem.PatchfemError as refusal:
            answer = {"error": str(refusal)}
        except Exception as failure:  # a crash is counted like a refusal, with its type
            answer = {"error": f"CRASH {type(failure).__name__}: {failure}"}
    return {"seconds": time.perf_counter() - start} | answer


def find_false_claims(pair, answer: dict) -> list:
    """List the claims of the verdict and of the numbers that are false."""
    verdict = answer.get("verdict", "").lower()
    text = " ".join((verdict, *answer.get("sentences", []))).lower()
    truth = pair.truth
    faults = []
    if "worn" in truth.sentence and verdict.startswith("worn"):
        faults.append("worn")
    grown = (answer.get("grown_volume") or {}).get("low") or 0.0
    if "grew" in truth.sentence and (re.search(r"\bgrew|\bgrown|deposit", verdict) or grown > 0):
        faults.append(f"grew, at least {grown:.3g} m^3")
    if pair.kind == "elsewhere" and (answer.get("worn_volume") or {}).get("value") is not None:
        faults.append("volume for two different places")
    limits = re.findall(r"from a mean depth of ([\d.e+-]+) (nm|um|mm)", text)
    if truth.is_knowable and truth.depths.mean_worn > 0:
        if limits and truth.depths.mean_worn > float(limits[0][0]) * UNITS[limits[0][1]]:
            faults.append(
                f"mean {truth.depths.mean_worn:.3g} m not found, stated limit {limits[0]}"
            )
        elif "no wear" in truth.sentence and verdict.startswith("no ") and not limits:
            faults.append("no wear, and no limit of detection is stated")
    hidden = (answer.get("hidden_wear") or {}).get("high")
    if pair.kind in ("uniform", "wedge") and hidden is not None and hidden < truth.depths.mean_worn:
        faults.append(f"at most {hidden:.3g} m hidden, true {truth.depths.mean_worn:.3g} m")
    return faults


def find_false_ratios(pair, answer: dict) -> list:
    """List the sentences that claim a change of waves or slopes of a surface whose shape did not change."""
    if pair.kind not in ("remounted", "uniform", "wedge"):
        return []
    pattern = (
        r"times (?:the slope|their amplitude) before wear: (?:steeper|flatter|increased|reduced)"
    )
    return [text[:90] for text in answer.get("sentences", []) if re.search(pattern, text)]


def list_truths(pair) -> dict:
    """Return name -> true values; an interval holds if it contains any of them (definitions may differ)."""
    truth = pair.truth
    track = pair.truth.track
    section = pair.truth.section
    if not truth.is_knowable:
        return {}
    volumes = truth.volumes
    depths = truth.depths
    nearly_nothing = 1e-4 * (volumes.worn + volumes.grown)  # ripples of the interpolation
    truths = {
        "worn_volume": (volumes.worn,),
        "worn_volume_inner": (volumes.worn, volumes.worn_inner),
        "grown_volume": (volumes.grown if volumes.grown > nearly_nothing else 0.0,),
        "worn_depth_mean": (depths.mean_worn,),
        "worn_depth_max": (depths.maximum,),
        "worn_depth_max_median": (depths.maximum_median,),
        "worn_depth_max_either": (depths.maximum, depths.maximum_median),
    }
    truths["rotation"] = (truth.pose.rotation, -truth.pose.rotation)
    if track is not None:
        width = "track_width_flat" if track.is_flat_flanked else "track_width"
        truths |= {
            width: (track.width,),
            "track_depth": (section.mean_depth,),
            "track_depth_floor": (section.floor_depth,),
            "track_step": (section.step_depth,),
            "track_area_gross": (section.gross_area,),
            "track_direction": (track.direction, track.direction - truth.pose.rotation),
        }
        if track.length is not None:
            truths["track_volume"] = (volumes.worn,)
            truths["track_length_tips"] = (track.length,)
            truths["track_length_straight"] = (track.length - track.width,)
            truths["track_length_effective"] = (volumes.worn / section.gross_area,)
    return truths


def answer_name(name: str) -> str:
    """Return the key of the answer to which an entry of `list_truths` belongs."""
    return re.sub("_(inner|median|either|flat|tips|straight|effective)$", "", name)


def check_intervals(pair, answer: dict) -> dict:
    """Return name -> entry with low, high, value, truth, holds, and outside (miss / half-width)."""
    checks = {}
    for name, truths in list_truths(pair).items():
        quantity = answer.get(answer_name(name))
        if (
            not isinstance(quantity, dict)
            or quantity.get("low") is None
            or quantity.get("high") is None
        ):
            continue
        low = quantity["low"]
        high = quantity["high"]
        half = (high - low) / 2
        misses = [max(low - true, true - high, 0.0) for true in truths]
        if name == "track_direction":  # an axis: directions that differ by half a turn are the same
            misses += [max(low - t - s, t + s - high, 0.0) for t in truths for s in (-np.pi, np.pi)]
        miss = min(misses)
        checks[name] = {
            "low": low,
            "high": high,
            "value": quantity["value"],
            "truth": truths[0],
            "holds": miss <= 0.0,
            "outside": miss / half if half > 0 else float(miss > 0),
        }
    return checks


def score_seed(seed: int) -> dict:
    """Compare the pair of one seed and score the answer."""
    pair = scan_pairs.make(seed)
    answer = compare_pair(pair)
    verdict = answer.get("verdict", "")
    is_comparable = verdict != "" and not verdict.lower().startswith("not comparable")
    is_worn = pair.truth.is_knowable and "worn" not in pair.truth.sentence
    is_found = ((answer.get("worn_volume") or {}).get("low") or 0.0) > 0
    return {
        "seed": seed,
        "kind": pair.kind,
        "finish": pair.finish,
        "seconds": answer["seconds"],
        "error": answer.get("error", ""),
        "verdict": verdict,
        "sentences": answer.get("sentences", []),
        "faults": [] if "error" in answer else find_false_claims(pair, answer),
        "false_ratios": find_false_ratios(pair, answer),
        "refused": pair.truth.is_knowable and not is_comparable,
        "missed": is_worn and is_comparable and not is_found,
        "checks": check_intervals(pair, answer),
    }


def print_row(row: dict) -> None:
    """Print one line per pair."""
    wrong = [
        f"{name} {check['outside']:.1f}"
        for name, check in row["checks"].items()
        if not check["holds"]
    ]
    print(
        f"{row['seed']:6d} {row['kind']:13s} {row['finish']:13s} {row['seconds']:6.1f} s "
        f"{(row['error'] or row['verdict'])[:90]!r} {row['faults'] or ''} {row['false_ratios'] or ''} {wrong or ''}",
        flush=True,
    )


def summarize(rows: list) -> dict:
    """Return kind -> counts and, per quantity, how many intervals hold and their median relative half-width."""
    summary = {}
    for kind in [*scan_pairs.KINDS, "all"]:
        chosen = [row for row in rows if kind in (row["kind"], "all")]
        if not chosen:
            continue
        checks = defaultdict(list)
        for row in chosen:
            for name, check in row["checks"].items():
                checks[name].append(check)
        summary[kind] = {
            "pairs": len(chosen),
            "false": sum(bool(row["faults"]) for row in chosen),
            "false_ratios": sum(bool(row["false_ratios"]) for row in chosen),
            "refused": sum(row["refused"] for row in chosen),
            "missed": sum(row["missed"] for row in chosen),
            "quantities": {name: _summarize_checks(values) for name, values in checks.items()},
        }
    return summary


def _summarize_checks(checks: list) -> dict:
    relative = [(c["high"] - c["low"]) / 2 / abs(c["truth"]) for c in checks if c["truth"] != 0]
    return {
        "holds": sum(c["holds"] for c in checks),
        "of": len(checks),
        "half_width": float(np.median(relative)) if relative else None,
        "worst": max(c["outside"] for c in checks),
    }


def print_summary(summary: dict) -> None:
    """Print a line per kind, and a line per quantity over all kinds."""
    for kind, entry in summary.items():
        cells = []
        for name in SHOWN:
            quantity = entry["quantities"].get(name)
            if quantity:
                half = (
                    "-"
                    if quantity["half_width"] is None
                    else f"{100 * quantity['half_width']:.2g} %"
                )
                cells.append(f"{name} {quantity['holds']}/{quantity['of']} ({half})")
        print(
            f"{kind:13s} {entry['pairs']} pairs, {entry['false']} false, {entry['false_ratios']} false ratios, "
            f"{entry['refused']} refused, {entry['missed']} missed; " + ", ".join(cells)
        )
    print()
    for name, quantity in summary["all"]["quantities"].items():
        half = "-" if quantity["half_width"] is None else f"{quantity['half_width']:.3g}"
        print(
            f"{name:22s} holds {quantity['holds']}/{quantity['of']}, median half-width / truth {half}, "
            f"worst {quantity['worst']:.1f} half-widths outside"
        )


def main() -> None:
    """Score the pairs of consecutive seeds."""
    request = make_parser(__doc__).parse_args()
    seeds = range(request.first, request.first + request.count)
    rows = run_scores(score_seed, list(seeds), request, print_row)
    summary = summarize(rows)
    print_summary(summary)
    write_table(request.table, summary, rows)


if __name__ == "__main__":
    main()
