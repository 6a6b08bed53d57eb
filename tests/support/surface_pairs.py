"""Campaign `scan-pairs`: answers of `patchfem compare` on pairs of areal scans with known truth.

The generator (`scan_pairs`) was written by somebody who had not seen the method. Seeds below 1000 were used to develop
it. Pairs of traces by such a generator are scored in tests/surface/compare/test_laboratory_pairs.py.

A row is an interval of the answer: its middle, its half-width and the true value. The row
`false_claims` counts the claims that contradict the truth: wear of an unworn surface, growth
without growth, changed waves that did not change, less wear than there was, a depth of two
different places. A row `missed` is 1 if the wear of a pair is not reported. Suffixes of names
distinguish definitions: `_inner` also accepts the volume without the border of the region,
`_median` is of 3 x 3 depths, `_flat` of flanks that end with zero slope.
"""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scan_pairs
from campaigns import Row

import patchfem

UNITS = {"nm": 1e-9, "um": 1e-6, "mm": 1e-3, "m": 1.0}
LIMIT = re.compile(r"from a mean depth of ([\d.e+-]+) (nm|um|mm)")
CHANGES = ("reduced", "increased", "flatter")
# 20 times the noise of a height [m]; deeper wear must not be reported as none.
SHOWN_DEPTH = 0.3e-6


class WearTruth(NamedTuple):
    """True properties that an answer must not contradict."""

    can_show: bool  # The pair can show wear.
    grew: bool  # Growth may be claimed.
    is_changed: bool  # The waves may have changed.
    is_elsewhere: bool  # The traces or scans are of two different places.
    is_hidden: bool  # An offset or a tilt explains the wear.
    mean: float  # [m]
    largest: float  # [m]


def find_false_claims(answer: dict, worn: WearTruth) -> list:
    """Return the claims of an answer that contradict the truth."""
    verdict = answer["verdict"].lower()
    text = " ".join((verdict, *answer["sentences"])).lower()

    def get_number(name, key):
        """Return an entry of a quantity of the answer, or None."""
        return (answer.get(name) or {}).get(key)

    limit = LIMIT.search(text)
    hidden = get_number("hidden_wear", "high")
    shows_place = {get_number(name, "value") for name in ("worn_depth_mean", "worn_volume")} != {
        None
    }
    has_grown = re.search(r"\bgrew|\bgrown|deposit", verdict) or get_number("grown_volume", "low")
    claims = {
        "worn": not worn.can_show and verdict.startswith("worn"),
        "grew": not worn.grew and has_grown,
        "waves": not worn.is_changed and any(word in verdict for word in CHANGES),
        "two places": worn.is_elsewhere and shows_place,
        "limit": limit and worn.can_show and worn.mean > float(limit[1]) * UNITS[limit[2]],
        "no wear": worn.can_show and "no wear" in text and worn.largest > SHOWN_DEPTH,
        "hidden": worn.is_hidden and hidden is not None and hidden < worn.mean,
    }
    return [name for name, is_false in claims.items() if is_false]


def interval_rows(answer: dict, truths: dict) -> list:
    """Return the intervals of an answer whose truth is known; of several true values the nearest counts."""
    rows = []
    for name, values in truths.items():
        key = re.sub("_(inner|median|either|flat|tips|straight|effective)$", "", name)
        quantity = answer.get(key)
        if not isinstance(quantity, dict) or None in (quantity.get("low"), quantity.get("high")):
            continue
        # A mean over the track alone is scored by the entries of the track.
        if quantity.get("over", "common length") == "common length":
            middle = (quantity["low"] + quantity["high"]) / 2
            true = min(values, key=lambda value, middle=middle: abs(value - middle))
            rows.append(Row(name, middle, quantity["high"] - middle, 0.0, true, 0.0))
    return rows


def make_line(kind: str, files: tuple, units: tuple | None, worn: WearTruth, truths: dict) -> dict:
    """Compare two files and return the line of a campaign."""
    try:
        answer = patchfem.compare(*files, units=units)
    except patchfem.PatchfemError as refusal:
        return {"rows": [], "group": kind, "refused": str(refusal)}
    claims = find_false_claims(answer, worn)
    counts = {"false_claims": len(claims)}
    if worn.can_show:
        counts["missed"] = int("worn" not in answer["verdict"].lower())
    rows = [Row(name, count, 0.0, 0.0, 0.0, 0.0) for name, count in counts.items()]
    rows += interval_rows(answer, truths)
    return {"rows": rows, "group": kind, "outcome": answer["verdict"], "claims": claims}


def compare_scans(seed: int, folder: Path, _) -> dict:
    """Compare the pair of areal scans of a seed."""
    pair = scan_pairs.draw_pair(seed)
    truth = pair.truth
    files = (folder / "before.npy", folder / "after.npy")
    for file, heights in zip(files, (pair.before, pair.after), strict=True):
        np.save(file, heights * 1e6)
    worn = WearTruth(
        can_show=truth.is_knowable and "worn" not in truth.sentence,
        grew="grew" not in truth.sentence,
        # A sentence on waves also compares noise, if nothing else differs.
        is_changed=True,
        is_elsewhere=pair.kind == "elsewhere",
        is_hidden=pair.kind in ("uniform", "wedge"),
        mean=truth.depths.mean_worn,
        largest=truth.depths.maximum,
    )
    units = (f"{pair.spacing * 1e6:.12g} um", "um")
    truths = list_scan_truths(truth) if truth.is_knowable else {}
    return make_line(pair.kind, files, units, worn, truths)


def list_scan_truths(truth) -> dict:
    """Return the true values of a pair of scans by name, several if definitions differ."""
    volumes = truth.volumes
    depths = truth.depths
    rotation = truth.pose.rotation
    # Ripples of the interpolation do not count as growth.
    has_grown = volumes.grown > 1e-4 * (volumes.worn + volumes.grown)
    truths = {
        "worn_volume": (volumes.worn,),
        "worn_volume_inner": (volumes.worn, volumes.worn_inner),
        "grown_volume": (volumes.grown if has_grown else 0.0,),
        "worn_depth_mean": (depths.mean_worn,),
        "worn_depth_max": (depths.maximum,),
        "worn_depth_max_median": (depths.maximum_median,),
        "worn_depth_max_either": (depths.maximum, depths.maximum_median),
        "rotation": (rotation, -rotation),
    }
    if truth.track is None:
        return truths
    track = truth.track
    section = truth.section
    # Directions of an axis that differ by half a turn are equal.
    half_turns = (-np.pi, 0.0, np.pi)
    directions = [track.direction + half_turn for half_turn in half_turns]
    truths |= {
        "track_width_flat" if track.is_flat_flanked else "track_width": (track.width,),
        "track_depth": (section.mean_depth,),
        "track_depth_floor": (section.floor_depth,),
        "track_step": (section.step_depth,),
        "track_area_gross": (section.gross_area,),
        "track_direction": (*directions, *(direction - rotation for direction in directions)),
    }
    if track.length is not None:
        truths |= {
            "track_volume": (volumes.worn,),
            "track_length_tips": (track.length,),
            "track_length_straight": (track.length - track.width,),
            "track_length_effective": (volumes.worn / section.gross_area,),
        }
    return truths
