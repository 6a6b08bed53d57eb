"""Run a study from the command line: `--help`, `--out FOLDER`, further options, and the time that has passed.

A study writes its files into `out/studies/<folder>`, so that a run leaves the checkout as it was. `--out` with the folder
of the study renews the pictures and tables that the pages show, and the CPU seconds in `report/seconds.json`.
"""

import argparse
import inspect
import json
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from measuring import run

STUDIES = Path(__file__).parents[1]
SECONDS_FILE = STUDIES / "report/seconds.json"  # CPU seconds of each study
BEAT = 10.0  # [s] between two lines of progress: often enough that nobody takes the study for dead


class Option(NamedTuple):
    """Option of a study: value without the option, and its line of help; a boolean is a flag."""

    default: object
    text: str


def run_study(main: Callable, **options: Option) -> None:
    """Run a study by the words of the command line, and end the program with its exit code.

    Parameters
    ----------
    main : callable
        The study. If it has a parameter `path`, this parameter gets the file of the same name in the folder `--out`.
    **options : Option
        Further parameters of `main`, each an option of the command line.
    """
    file = Path(inspect.getfile(main)).resolve()
    name = file.relative_to(STUDIES).as_posix()
    parser = argparse.ArgumentParser(
        description=sys.modules[main.__module__].__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    target = inspect.signature(main).parameters.get("path")
    if target is not None:
        place = Path("out/studies") / file.parent.name
        parser.add_argument("--out", type=Path, default=place, help=f"folder for files [{place}]")
    for option, (default, text) in options.items():
        kind = {"action": "store_true"} if default is False else {"type": type(default)}
        parser.add_argument(f"--{option}", default=default, help=text, **kind)
    words = vars(parser.parse_args())
    folder = words.pop("out", None)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        words["path"] = folder / target.default.name

    seconds = json.loads(SECONDS_FILE.read_text("utf-8"))
    ended = threading.Event()
    threading.Thread(target=_print_progress, args=(name, seconds.get(name), ended)).start()
    try:
        code = run(lambda: main(**words))
    finally:
        ended.set()
    if folder is not None and code == 0:
        print(f"files: {folder}", file=sys.stderr)
        if folder.resolve() == file.parent:
            seconds[name] = round(time.process_time(), 1)
            SECONDS_FILE.write_text(json.dumps(dict(sorted(seconds.items())), indent=1) + "\n")
    sys.exit(code)


def _print_progress(name: str, expected: float | None, ended: threading.Event) -> None:
    """Print the CPU seconds so far, beside those of the last measured run, until the study has ended."""
    whole = "" if expected is None else f" of about {expected:.0f}"
    while not ended.wait(BEAT):
        print(f"{name}: {time.process_time():.0f}{whole} CPU s", file=sys.stderr, flush=True)
