"""What do all studies ask and answer, how long do they take, and which figures of the report do they reproduce?

The answers are in studies/report/README.md. This script writes that page from the docstrings of the studies.

A study with a VERDICT states question and answer in its docstring, which is read without running it; those of the
others are in the gallery of studies/README.md. Seconds are CPU seconds of `python STUDY`, start and compiled code
loaded included, as `--measure` saw them one after the other and keeps them in seconds.json.

Run: python studies/report/table.py [--measure [STUDY ...]]
"""

import ast
import json
import re
import resource
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from study_text import read_answer, read_question

FOLDER = Path(__file__).parent
STUDIES = FOLDER.parent
SECONDS_FILE = FOLDER / "seconds.json"
ANSWER = read_answer(__doc__)
VERDICT = ""
# links from the gallery to a later section of the same page
LINK_BELOW = re.compile(r",? see \[below\]\([^)]*\)|See \[below\]\([^)]*\)\.")
LONGEST = 300  # CPU seconds after which a measurement ends
LONG = 20  # CPU seconds beyond which a study is marked as long


class Study(NamedTuple):
    """Entry of the table of studies.

    Contains the path below studies/, question, answer, and the figure of the report that it
    reproduces ("" if there is none).
    """

    path: str
    question: str
    answer: str
    reproduced: str


def constant(tree: ast.Module, name: str) -> str | None:
    """Return the text of the value that a module assigns to a name; None if it does not."""
    for line in tree.body:
        if isinstance(line, ast.Assign) and any(
            isinstance(t, ast.Name) and t.id == name for t in line.targets
        ):
            return ast.literal_eval(line.value)
    return None


def studies() -> list:
    """Return every script of the gallery of studies/README.md, in its order."""
    found = []
    seen = set()
    for line in (STUDIES / "README.md").read_text("utf-8").splitlines():
        named = re.match(r"\| \[([\w/]+\.py)\]", line)
        if named is None or named[1] in seen:
            continue
        seen.add(named[1])
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        tree = ast.parse((STUDIES / named[1]).read_text("utf-8"))
        reproduced = constant(tree, "VERDICT")
        question, answer = cells[1:3]
        if reproduced is not None:
            text = ast.get_docstring(tree)
            question = read_question(text)
            answer = read_answer(text)
        found.append(
            Study(
                named[1], LINK_BELOW.sub("", question), LINK_BELOW.sub("", answer), reproduced or ""
            )
        )
    return found


def measure_study(path: str) -> float | None:
    """Measure the CPU seconds of one study in a process of its own; None if it fails."""

    def limit_seconds():
        resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))

    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, str(STUDIES / path)],
        preexec_fn=limit_seconds,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if done.returncode:
        print(
            f"{path}: exit {done.returncode} after {spent:.1f} s: {done.stderr.strip()[-200:]}",
            file=sys.stderr,
        )
    return None if done.returncode else round(spent, 1)


def table(found: list, seconds: dict) -> str:
    """Return the page in Markdown."""
    rows = [
        f"| [{one.path}](../{one.path}) | {one.question} | {one.answer} | {format_seconds(seconds.get(one.path))} | "
        f"{one.reproduced} |"
        for one in found
    ]
    figures = [one for one in found if one.reproduced]
    yes = sum(figure.reproduced == "yes" for figure in figures)
    known = [seconds[one.path] for one in found if seconds.get(one.path) is not None]
    return "\n".join(
        [
            "# All studies in one table",
            "`table.py` generates this page from the studies. Computing times are CPU "
            f"seconds of one core. The times of {len(known)} of {len(found)} studies were measured; their sum is "
            f"{sum(known):.0f} s. A dash means that the time was not measured yet, or that the study needs a file or "
            "another program. "
            f'Studies that take more than {LONG} s are marked "long".',
            "",
            f"{len(figures)} of the studies try to reproduce a figure (a diagram) of the report. {yes} of these studies "
            "reproduce the whole figure; the other studies reproduce a part of the figure. [The ten conclusions of the "
            "report](conclusions.md) have their own table.",
            "",
            "Table 1 of the report lists measured accelerations and displacements of the rig. "
            "The score of a model is the root mean square of ln(computed/measured) for Table 1. Three scores separated "
            "by slashes are those of all readings, of the accelerations and of the displacements.",
            "",
            "| study | question | answer | computing time [s] | is the figure of the report reproduced? |",
            "|---|---|---|---|---|",
            *rows,
            "",
        ]
    )


def format_seconds(seconds: float | None) -> str:
    """Format CPU seconds as a table cell, with a mark for slow studies."""
    if seconds is None:
        return "-"
    return f"{seconds:.1f}" if seconds < 10 else f"{seconds:.0f}" + ", long" * (seconds > LONG)


def main(measure: list | None = None, path: Path | None = FOLDER / "README.md") -> list:
    """Write the page and return the studies; measure: paths to be measured, [] for all, None for none."""
    found = studies()
    seconds = json.loads(SECONDS_FILE.read_text("utf-8")) if SECONDS_FILE.exists() else {}
    if measure is not None:
        for one in found:
            if one.path != "report/table.py" and (not measure or one.path in measure):
                seconds[one.path] = measure_study(one.path)
                print(f"{one.path}: {format_seconds(seconds[one.path])} s", flush=True)
                SECONDS_FILE.write_text(
                    json.dumps(dict(sorted(seconds.items())), indent=1) + "\n", "utf-8"
                )
    if path is not None:
        path.write_text(table(found, seconds), "utf-8")
    return found


if __name__ == "__main__":
    main(sys.argv[2:] if sys.argv[1:2] == ["--measure"] else None)
