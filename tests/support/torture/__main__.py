"""Test the installed patchfem with seeded scenes, files, kills and limits; exit code 3 if a trial failed.

Example: python tests/support/torture --share 0.001 --campaign grammar
"""

import argparse
import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from torture import driver


def main(arguments=None) -> int:
    """Run the command line and return the exit code."""
    parser = argparse.ArgumentParser(prog="torture", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--share", type=float, default=0.02, help="of every campaign, above 0 and up to 1"
    )
    parser.add_argument("--campaign", default="", help="one campaign, or several with commas")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="place of one trial in one --campaign, from 0 on")
    options = parser.parse_args(arguments)
    names = options.campaign.split(",") if options.campaign else list(driver.CAMPAIGNS)
    if unknown := [name for name in names if name not in driver.CAMPAIGNS]:
        parser.error(f"--campaign {unknown[0]}: one of {', '.join(driver.CAMPAIGNS)}")
    if not 0 < options.share <= 1:
        parser.error(f"--share {options.share}: above 0 and up to 1 is needed")
    if options.only is not None and (len(names) != 1 or options.only < 0):
        parser.error("--only N: the place of one trial in one --campaign, from 0 on")
    if sys.platform == "win32":
        print("a system on which a process can fork is needed, as Linux and macOS", file=sys.stderr)
        return 4

    def print_message(text: str) -> None:
        """Print a message to stderr."""
        print(text, file=sys.stderr, flush=True)

    from patchfem.__main__ import run_command

    rows = driver.run_campaigns(
        run_command, options.share, names, options.seed, options.only, print_message
    )
    print(driver.format_table(rows), flush=True)
    return 3 if any(row.faults for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
