"""Test the installed patchfem with seeded scenes and files; exit code 3 if a trial failed.

Example: python tests/support/torture --share 0.001 --campaign grammar
"""

import argparse
import sys
import tempfile
import traceback
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from torture.driver import CAMPAIGNS, run_trial
from torture.trial import TrialFailure


def main() -> int:
    """Run the command line and return the exit code."""
    parser = argparse.ArgumentParser(prog="torture", description=__doc__.splitlines()[0])
    parser.add_argument("--share", type=float, default=0.02, help="of every campaign, up to 1")
    parser.add_argument("--campaign", nargs="+", choices=CAMPAIGNS, default=list(CAMPAIGNS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="place of one trial in one --campaign, from 0 on")
    options = parser.parse_args()
    faults = 0
    with tempfile.TemporaryDirectory(prefix="torture") as folder:
        for name in options.campaign:
            count = max(1, round(options.share * CAMPAIGNS[name].size))
            for index in range(count) if options.only is None else [options.only]:
                try:
                    run_trial(name, options.seed, index, Path(folder))
                except (Exception, TrialFailure):
                    faults += 1
                    traceback.print_exc(limit=-3)
                    print(f"{name} {index}: --campaign {name} --seed {options.seed} --only {index}")
    print(f"{faults} trials failed")
    return 3 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
