"""Score of stated errors on LuGre rigs and on rigs with short sticks, against the independent program of `motion_bars`.

    python tests/support/lugre_and_stick_scores.py lugre FILE [--truth OTHER]   # 60 LuGre rigs, half of them marched
    python tests/support/lugre_and_stick_scores.py sticks FILE [--truth OTHER]  # 40 rigs that stick for a short time
    python tests/support/motion_bars.py score FILE

The seeds were not used to build anything. A rig has short sticks if it sticks for less than MAX_STICK of the time.
"""

import argparse
import json
import tempfile
from itertools import count
from pathlib import Path

import motion_bars
from motion_scenes import spec, written

import patchfem as pf

LUGRE_SEED, STICK_SEED = 95_000_000, 96_000_000
N_LUGRE, N_STICKS = 60, 40
MAX_STICK = 0.08  # fraction of the time


def lugre_rigs() -> list:
    """Draw rigs with the LuGre law; every second one names method march, the others leave the choice to the program."""
    out = []
    for seed in count(LUGRE_SEED):
        rig = spec(seed)
        if rig["law"] != "lugre":
            continue
        rig.pop("method", None)
        if len(out) % 2:
            rig["method"] = "march"
        out.append(rig)
        if len(out) == N_LUGRE:
            return out


def sticking_rigs() -> list:
    """Draw rigs under a periodic drive that stick for a short time of each cycle."""
    out = []
    for seed in count(STICK_SEED):
        rig = spec(seed)
        if rig["drive"] not in ("sine", "force") or not motion_bars.referable(rig):
            continue
        with tempfile.TemporaryDirectory() as folder:
            try:
                measure = pf.run(written(rig, Path(folder)), **{"accuracy.tolerance": "0.01"}).measures.get(
                    "stick_fraction")
            except pf.PatchfemError:
                continue
        if measure is not None and measure.value is not None and 0 < measure.value < MAX_STICK:
            out.append(rig)
        if len(out) == N_STICKS:
            return out


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=("lugre", "sticks"))
    parser.add_argument("file")
    parser.add_argument("--truth", type=Path, help="file of an earlier score, whose truths are taken")
    request = parser.parse_args()
    lines = request.truth.read_text("utf-8").splitlines() if request.truth else []
    earlier = {line["seed"]: line for line in map(json.loads, lines)}
    if earlier:
        methods = {seed: rig.get("method") for seed, rig in ((rig["seed"], rig) for rig in lugre_rigs())}
        rigs = [spec(seed) for seed in earlier]
        for rig in rigs if request.kind == "lugre" else []:
            rig.pop("method", None)
            if methods[rig["seed"]]:
                rig["method"] = methods[rig["seed"]]
    else:
        rigs = lugre_rigs() if request.kind == "lugre" else sticking_rigs()
    motion_bars.campaign(rigs, request.file, earlier)


if __name__ == "__main__":
    main()
