"""Random campaigns: how often stated errors cover the differences from independent references.

    python tests/support/campaigns.py run KIND FILE --first SEED --count N [--truth OTHER]
    python tests/support/campaigns.py score FILE...
    python tests/support/campaigns.py compare BEFORE AFTER

`run` adds one line of JSON to FILE for each seed that FILE does not contain, so that a run that was stopped goes on.
`--truth` takes the reference values from an earlier FILE, also of another version of the package. `compute_score` prints the
share of errors that hold, for each measure and each engine. `compare` prints two files side by side for the scenes that
both contain. Choose seeds that nobody used (tests/README.md), and write them down before the run.

A kind of campaign is a function `compare_scene(seed, folder, earlier)` that returns a `line` or None for a seed that
does not belong to the kind. A stated error *holds* if it is at least as large as the difference from the reference. It
is *sharp* if it is at most five times that difference, or too small to matter.
"""

import argparse
import json
import signal
import tempfile
from collections import defaultdict
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import numpy as np

KINDS = {  # Name on the command line -> module and function.
    "rigs": ("random_rigs", "compare_rig"),
    "harmonic": ("random_rigs", "compare_harmonic_rig"),
    "marched-rigs": ("random_rigs", "compare_marched_rig"),
    "partial-slip": ("micro_slip", "compare_bench"),
    "shear-joints": ("shear_scenes", "compare_joint"),
    "shear-rigs": ("shear_scenes", "compare_rig"),
    "shear-chains": ("shear_scenes", "compare_chain"),
    "static": ("static_scenes", "compare_coarse_patch"),
    "static-fine": ("static_scenes", "compare_fine_patch"),
    "wear": ("wear_scenes", "compare_bench"),
    "predicted-wear": ("predicted_pairs", "compare_pair"),
    "hybrid-rigs": ("hybrid_campaign", "compare_rig"),
    "made-fits": ("made_fits", "compare_fit"),
    "trace-pairs": ("surface_pairs", "compare_traces"),
    "scan-pairs": ("surface_pairs", "compare_scans"),
    "backbone-forces": ("backbone_motions", "compare_force"),
    "backbone-motions": ("backbone_motions", "compare_motions"),
}
# Time limit of a scene with its reference; a longer one is recorded as failed.
MAX_CPU_SECONDS = 60
SHARP_FACTOR = 5.0  # Largest ratio of a sharp error to the true error.
# Smaller errors, relative to the value, count as sharp because more digits have no use.
SHARP_FRACTION = 1e-8
FLOOR_FRACTION = 1e-3  # Smaller differences, relative to the floor of a measure, do not count.
ROUND_OFF = 1e-9  # Smaller differences, relative to the value, do not count.


class Row(NamedTuple):
    """Measure of a scene beside its reference value; `doubt` is the uncertainty of the reference itself."""

    name: str
    value: float
    error: float
    floor: float
    truth: float
    doubt: float

    @property
    def true_error(self) -> float:
        """Absolute difference from the reference; a phase is compared modulo pi."""
        gap = abs(self.truth - self.value)
        if self.name == "slip_start_phase":
            return min(gap, abs(np.pi - gap))
        return gap

    @property
    def holds(self) -> bool:
        """Whether the stated error is at least the true error minus the uncertainty of the reference."""
        ignored = max(FLOOR_FRACTION * self.floor, ROUND_OFF * abs(self.value))
        return self.true_error <= self.error + self.doubt + ignored

    @property
    def is_sharp(self) -> bool | None:
        """Whether the stated error is at most five times the true error.

        None if the reference is too uncertain to decide.
        """
        if self.error <= max(self.floor, SHARP_FRACTION * abs(self.value)):
            return True
        if self.true_error <= 2 * self.doubt:
            return None
        return self.error <= SHARP_FACTOR * self.true_error


class Score(NamedTuple):
    """Fractions over a list of lines: scenes whose errors all hold, errors that hold, and errors that are sharp."""

    n_scenes: int
    right_scenes: float
    n_errors: int
    held: float
    sharp: float


def measure_rows(measures, truths: dict, doubts: dict, names=None) -> list:
    """Return a row for each measure of a result that has a value, an error and a reference value.

    Parameters
    ----------
    measures : mapping of name to Measure
    truths, doubts : dict
        Reference values and their own uncertainties by name.
    names : collection of str, optional
        Names that count; all if omitted.
    """
    return [
        Row(name, measure.value, measure.error, measure.floor, truths[name], doubts.get(name, 0.0))
        for name, measure in measures.items()
        if name in truths
        and None not in (measure.value, measure.error)
        and (names is None or name in names)
    ]


def strip_number(name: str) -> str:
    """Return the name of a measure without the number of its interface."""
    head, _, number = name.rpartition("_")
    return head if number.isdigit() else name


def read_rows(line: dict) -> list:
    """Return the rows of a stored line."""
    return [Row(*row) for row in line["rows"]]


def true_fraction(values: list) -> float:
    """Return the fraction of the values other than None that are true."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else float("nan")


def compute_score(lines: list) -> Score:
    """Return the score of the lines that have rows."""
    scenes = [read_rows(line) for line in lines if line["rows"]]
    rows = [row for scene in scenes for row in scene]
    return Score(
        n_scenes=len(scenes),
        right_scenes=true_fraction([all(row.holds for row in scene) for scene in scenes]),
        n_errors=len(rows),
        held=true_fraction([row.holds for row in rows]),
        sharp=true_fraction([row.is_sharp for row in rows]),
    )


def print_score(lines: list) -> None:
    """Print the errors that do not hold, then the fractions for each measure and each engine."""
    by_name = defaultdict(list)
    for line in lines:
        for row in read_rows(line):
            by_name[strip_number(row.name)].append(row)
            if not row.holds:
                print(
                    f"too small: seed {line['seed']}, {line.get('group')}, {line.get('engine')}:",
                    *row,
                )
    for name, rows in sorted(by_name.items()):
        fraction_held = true_fraction([row.holds for row in rows])
        sharp = true_fraction([row.is_sharp for row in rows])
        print(
            f"{name:34s} {len(rows):5d} errors, {fraction_held:6.1%} hold, {sharp:6.1%} are sharp"
        )
    for engine in [*list_engines(lines), None]:
        selected = [line for line in lines if engine in (None, line.get("engine"))]
        print(f"{engine or 'all':12s}", describe_score(compute_score(selected)))
    for line in lines:
        if not line["rows"]:
            print(f"not compared: seed {line['seed']}, {line.get('refused', line.get('outcome'))}")


def list_engines(lines: list) -> list:
    """Return the names of the engines of the lines that have rows."""
    return sorted({line.get("engine") or "" for line in lines if line["rows"]} - {""})


def describe_score(result: Score) -> str:
    """Return a score as a sentence."""
    return (
        f"{result.n_scenes} scenes, all errors hold in {result.right_scenes:.1%}; {result.n_errors} errors, "
        f"{result.held:.1%} hold, {result.sharp:.1%} are sharp"
    )


def print_comparison(before: list, after: list) -> None:
    """Print the scores of two files and their ratios of seconds and steps, for the scenes in both files."""
    old = {line["seed"]: line for line in before}
    pairs = [(old[line["seed"]], line) for line in after if line["seed"] in old]
    pairs = [pair for pair in pairs if all(line["rows"] for line in pair)]
    for engine in [*list_engines([new for _, new in pairs]), None]:
        selected = [pair for pair in pairs if engine in (None, pair[1].get("engine"))]
        print(engine or "all")
        for label, column in (("before", 0), ("after", 1)):
            print(
                f"    {label:7s}",
                describe_score(compute_score([pair[column] for pair in selected])),
            )
        for key in ("seconds", "steps"):
            ratios = [
                new[key] / first[key] for first, new in selected if first.get(key) and new.get(key)
            ]
            if ratios:
                print(
                    f"    {key} after/before: median {np.median(ratios):.3f}, largest {max(ratios):.2f}"
                )
        counts = [
            sum(len(pair[column].get("warnings") or ()) for pair in selected) for column in (0, 1)
        ]
        print(f"    warnings: {counts[0]} before, {counts[1]} after")


def read_lines(names) -> list:
    """Read the stored lines of files."""
    return [
        json.loads(line) for name in names for line in Path(name).read_text("utf-8").splitlines()
    ]


def stop_scene(*_) -> None:
    """Raise TimeoutError in a scene that takes too long (a signal handler)."""
    raise TimeoutError(f"more than {MAX_CPU_SECONDS} CPU seconds")


def run_campaign(compare_scene, seeds, file: Path, earlier: dict) -> None:
    """Compare the scenes of all seeds that are not yet in the file, and append a line for each.

    Parameters
    ----------
    compare_scene : callable
        `compare_scene(seed, folder, earlier_line)` returns a line, or None to leave the seed out.
    seeds : iterable of int
    file : Path
    earlier : dict
        Lines of an earlier run by seed, whose reference values are used again.
    """
    signal.signal(signal.SIGPROF, stop_scene)
    done = {line["seed"] for line in read_lines([file])} if file.exists() else set()
    for seed in seeds:
        if seed in done:
            continue
        signal.setitimer(signal.ITIMER_PROF, MAX_CPU_SECONDS)
        try:
            with tempfile.TemporaryDirectory() as folder:
                line = compare_scene(seed, Path(folder), earlier.get(seed))
        except (TimeoutError, RuntimeError, AssertionError, ArithmeticError, ValueError) as error:
            line = {"rows": [], "refused": f"failed: {error!r}"}
        signal.setitimer(signal.ITIMER_PROF, 0)
        if line is not None:
            with file.open("a", encoding="utf-8") as out:
                out.write(json.dumps({"seed": seed} | line, default=float) + "\n")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    run = verbs.add_parser("run")
    run.add_argument("kind", choices=KINDS)
    run.add_argument("file", type=Path)
    run.add_argument("--first", type=int, required=True)
    run.add_argument("--count", type=int, required=True)
    run.add_argument("--truth", type=Path)
    verbs.add_parser("score").add_argument("files", nargs="+")
    compare = verbs.add_parser("compare")
    compare.add_argument("before")
    compare.add_argument("after")
    request = parser.parse_args()
    if request.verb == "score":
        print_score(read_lines(request.files))
        return
    if request.verb == "compare":
        print_comparison(read_lines([request.before]), read_lines([request.after]))
        return
    module, function = KINDS[request.kind]
    earlier = {line["seed"]: line for line in read_lines([request.truth])} if request.truth else {}
    seeds = range(request.first, request.first + request.count)
    run_campaign(getattr(import_module(module), function), seeds, request.file, earlier)


if __name__ == "__main__":
    main()
