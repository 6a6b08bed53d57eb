"""Random rigs of `hybrid` against the independent integrator: coverage of the stated errors and true errors.

    python tests/support/hybrid_campaign.py FIRST COUNT [FILE]

runs the specs of `hybrid_rigs` with the seeds FIRST to FIRST + COUNT - 1, appends a line of JSON per rig to FILE, and prints
for each measure and each class of rigs how many errors hold, the true errors, and the CPU seconds of both programs. An error
holds if the value lies within it and the error of the reference. Classes are the laws and the kinds of drive; a rig belongs
to each of its laws.
"""

import json
import sys
from collections import defaultdict
from pathlib import Path
from time import process_time

import numpy as np

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]

from hybrid_reference import integrate
from hybrid_rigs import draw_spec, make_case

from patchfem.hybrid import runs
from patchfem.hybrid.records import Status

REFERENCE_ERROR = 2e-5  # of peaks and times of stick between the samples of the reference, relative
ZERO = 1e-12  # relative to the values that the drive alone would give


def compare(seed: int) -> dict:
    """Return measures with error, true error and allowed error of a rig, its classes and the CPU seconds."""
    spec = draw_spec(seed)
    case = make_case(spec)
    begin = process_time()
    motion = runs.run_case(case)
    seconds = process_time() - begin
    classes = [*sorted({face["keys"]["law"] for face in spec["faces"]}), spec["kind"]]
    row = {"seed": seed, "classes": classes, "seconds": seconds, "message": motion.message}
    if motion.status is not Status.DONE:
        return row | {"measures": {}}
    begin = process_time()
    expected = integrate(spec, 1e-9, 20)
    sizes = {
        "relative_displacement_amplitude": spec["length"],
        "absolute_acceleration_peak": spec["acceleration"],
    }
    measures = {}
    for name, value in expected.items():
        own = REFERENCE_ERROR * abs(value) + ZERO * sizes.get(name, 1.0)
        true = abs(motion.values[name] - value)
        measures[name] = [float(value), float(motion.errors[name]), float(true), float(own)]
    return row | {"measures": measures, "reference_seconds": process_time() - begin}


def summarize(rows) -> list[str]:
    """Return lines with the coverage by measure and by class, and the CPU seconds."""
    groups = defaultdict(list)
    for row in rows:
        for name, (value, error, true, own) in row["measures"].items():
            ratio = true / (error + own)
            relative = true / abs(value) if value else 0.0
            for group in (
                f"measure {name.rstrip('_234')}",
                *(f"class {c}" for c in row["classes"]),
            ):
                groups[group].append((ratio, relative))
    lines = []
    for group, pairs in sorted(groups.items()):
        ratio, relative = np.array(pairs).T
        lines.append(
            f"{group:48s} {np.sum(ratio <= 1):4d} of {ratio.size:4d} hold, worst {ratio.max():.2g} times; "
            f"true error {np.median(relative):.1e} (median), {relative.max():.1e} (largest)"
        )
    seconds = np.array([row["seconds"] for row in rows])
    ended = [row["message"] for row in rows if row["message"]]
    lines.append(
        f"{len(rows)} rigs, {seconds.sum():.1f} CPU s, largest {seconds.max():.2f}; ended early: {ended}"
    )
    return lines


if __name__ == "__main__":
    first, count = map(int, sys.argv[1:3])
    file = Path(sys.argv[3]) if len(sys.argv) > 3 else None
    runs.run_case(make_case(draw_spec(0)))
    found = []
    for seed in range(first, first + count):
        found.append(compare(seed))
        if file is not None:
            with file.open("a", encoding="utf-8") as out:
                out.write(json.dumps(found[-1]) + "\n")
    print(*summarize(found), sep="\n")
