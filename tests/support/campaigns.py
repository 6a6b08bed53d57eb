"""Random campaigns: how often stated errors cover the differences from references.

    python tests/support/campaigns.py run KIND FILE --first SEED --count N
    python tests/support/campaigns.py score FILE...

`run` adds one line of JSON to FILE for each seed that FILE does not contain, so that a run that was stopped goes on.
`score` prints the share of errors that hold, for each measure. Choose seeds that nobody used (tests/README.md), and write
them down before the run. A kind of campaign is a function `compare(seed, folder)` that returns a line with its rows. A
stated error *holds* if it is at least as large as the difference from the reference.
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
    "made-fits": ("made_fits", "compare_fit"),
}
# Time limit of a scene with its reference; a longer one is recorded as failed.
MAX_CPU_SECONDS = 60
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


def measure_rows(measures, truths: dict, doubts: dict) -> list[Row]:
    """Return a row for each measure of a result that has a value, an error and a reference value.

    Parameters
    ----------
    measures : mapping of name to Measure
    truths, doubts : dict
        Reference values and their own uncertainties by name.
    """
    return [
        Row(name, measure.value, measure.error, measure.floor, truths[name], doubts.get(name, 0.0))
        for name, measure in measures.items()
        if name in truths and None not in (measure.value, measure.error)
    ]


def strip_number(name: str) -> str:
    """Return the name of a measure without the number of its interface."""
    head, _, number = name.rpartition("_")
    return head if number.isdigit() else name


def read_lines(files: list[Path]) -> list[dict]:
    """Read the stored lines of files."""
    return [json.loads(line) for file in files for line in file.read_text("utf-8").splitlines()]


def print_score(lines: list[dict]) -> None:
    """Print the errors that do not hold, the fraction that holds for each measure, and scenes without rows."""
    by_name = defaultdict(list)
    for line in lines:
        rows = [Row(*row) for row in line["rows"]]
        for row in rows:
            by_name[strip_number(row.name)].append(row.holds)
            by_name["all"].append(row.holds)
            if not row.holds:
                print(f"too small: seed {line['seed']}, {line.get('group')}:", *row)
        if not rows:
            reason = line.get("refused", line.get("outcome"))
            print(f"not compared: seed {line['seed']}, {reason}")
    for name, holds in sorted(by_name.items()):
        print(f"{name:34s} {len(holds):5d} errors, {np.mean(holds):6.1%} hold")


def stop_scene(*_) -> None:
    """Raise TimeoutError in a scene that takes too long (a signal handler)."""
    raise TimeoutError(f"more than {MAX_CPU_SECONDS} CPU seconds")


def run_campaign(compare, seeds: range, file: Path) -> None:
    """Compare the scenes of all seeds that are not yet in the file, and append a line for each."""
    signal.signal(signal.SIGPROF, stop_scene)
    done = {line["seed"] for line in read_lines([file])} if file.exists() else set()
    for seed in sorted(set(seeds) - done):
        signal.setitimer(signal.ITIMER_PROF, MAX_CPU_SECONDS)
        try:
            with tempfile.TemporaryDirectory() as folder:
                line = compare(seed, Path(folder))
        except (TimeoutError, RuntimeError, AssertionError, ArithmeticError, ValueError) as error:
            line = {"rows": [], "refused": f"failed: {error!r}"}
        signal.setitimer(signal.ITIMER_PROF, 0)
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
    verbs.add_parser("score").add_argument("files", nargs="+", type=Path)
    request = parser.parse_args()
    if request.verb == "score":
        print_score(read_lines(request.files))
        return
    module, function = KINDS[request.kind]
    seeds = range(request.first, request.first + request.count)
    run_campaign(getattr(import_module(module), function), seeds, request.file)


if __name__ == "__main__":
    main()
