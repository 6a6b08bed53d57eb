"""The command that runs a scene for many values of its keys."""

import json
import shlex
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from .. import core
from ..campaigns.sweeps import executors, parse_request
from ..export.sweeps import run
from .shared import (
    DEFAULT_OUTPUT,
    NOT_CONVERGED_EXIT_CODE,
    CommandExit,
    OutputGroup,
    Progress,
    Sets,
    UsageError,
    describe_command,
    flag_option,
    note,
    path_option,
    present,
    print_message,
    repeated_option,
    text_option,
)


@Parameter(name="*")
@dataclass
class CaseOptions:
    """Options that select the cases."""

    over: repeated_option(
        "key and its values: table.key=v1,v2,... or, for 9 values in a range, table.key=1 mm..9 mm:9 (:9log "
        "or :9lin fixes the spacing); may be repeated",
        "--over",
    ) = ()
    cases: path_option(
        "file of cases, such as cases.csv: one column `table.key [unit]` for each key, one row for each case; or the "
        "sweep.csv of another sweep",
        "--cases",
    ) = None
    random: Annotated[
        int,
        Parameter(
            name="--random",
            show_default=False,
            help="number of random cases, such as 200, drawn from the ranges in --over, such as 1 "
            "mm..9 mm",
        ),
    ] = 0
    sobol: Annotated[
        int,
        Parameter(
            name="--sobol",
            show_default=False,
            help="number of cases from Sobol's sequence, such as 256; a power of 2 is best",
        ),
    ] = 0
    seed: Annotated[int, Parameter(name="--seed", help="seed of the random cases, such as 1")] = 0

    def request(self):
        """Return the request for cases.

        UsageError is raised if the options are incompatible.
        """
        if self.random and self.sobol:
            raise UsageError("--random and --sobol: use only one of them")
        if (self.random or self.sobol) and not self.over:
            raise UsageError(
                "--random and --sobol draw values from ranges; give each range by --over table.key=low..high"
            )
        return parse_request.CaseRequest(
            self.over, self.cases, self.random or self.sobol, bool(self.sobol), self.seed
        )


@Parameter(name="*")
@dataclass
class WorkerOptions:
    """Options of the workers: number of processes, executor, and shard of the cases."""

    jobs: Annotated[
        int, Parameter(name=["-j", "--jobs"], help="number of processes on this machine, such as 4")
    ] = 1
    executor: text_option(
        "where the cases run: dask (a cluster on this machine) or dask:ADDRESS, such as "
        "dask:tcp://10.0.0.2:8786",
        "--executor",
    ) = ""
    shard: text_option(
        "run only one part of the cases, such as 3/40 for the third of 40 parts; all parts write into the "
        "same folder",
        "--shard",
    ) = ""
    collect: flag_option(
        "run no case, only write the tables of a sweep whose cases are all done", "--collect"
    ) = False

    def part(self) -> tuple[int, int] | None:
        """Return (i, n) for shard i of n parts of the cases, or None without a shard."""
        if not self.shard:
            return None
        i, _, n = self.shard.partition("/")
        if not (i.isdecimal() and n.isdecimal() and 1 <= int(i) <= int(n)):
            raise UsageError(f"--shard {self.shard}: must be i/n with i from 1 to n, such as 3/40")
        return int(i), int(n)


def sweep(
    scene: Path,
    /,
    *,
    what: CaseOptions | None = None,
    by: WorkerOptions | None = None,
    set_: Sets = (),
    resume: flag_option("continue an interrupted sweep in this folder") = False,
    keep: Annotated[
        Literal["none", "summaries", "results", "pages"] | None,
        Parameter(
            help="files to keep of each case in addition to its row in the tables, such as results; possible values: "
            "none, summaries, results, pages (results and report.html); default: summaries for up to 1000 "
            "cases, none for more cases"
        ),
    ] = None,
    output_options: OutputGroup = DEFAULT_OUTPUT,
):
    """Run SCENE for all combinations of the values in --over, or of the values in its table [sweep]. Write sweep.csv,
    sweep.nc and report.html; the default folder is out/<scene name>-sweep.

    Example: patchfem sweep rig.toml --over "contact.tilt.angle=1e-6 rad..1e-2 rad:9" -j 2
    """
    if output_options.no_page and keep == "pages":
        raise UsageError(
            "sweep: --no-page and --keep pages contradict each other; use only one of them"
        )

    # read_sweep returns what all cases share, and the cases with the values of their keys.
    by = by or WorkerOptions()
    part = by.part()
    output = output_options.into(f"{scene.stem}-sweep")
    target = output.out
    sweep_scene, cases = parse_request.read_sweep(scene, set_, (what or CaseOptions()).request())
    cases = replace(cases, command=describe_command())

    # `answer` is None for a shard, because its tables would lack the cases of the other shards
    if by.collect:
        answer = run.collect_shards(sweep_scene, cases, target, not output.no_page)
    else:
        for text in (cases.warning, sweep_scene.note_bolted_joint()):
            if text and not output.quiet:
                note(text)
        place = run.SweepTarget(target, resume, keep or "", part, not output.no_page)
        answer = _run_cases(sweep_scene, cases, place, by, is_quiet=output.quiet)

    # The exit code tells a script whether all cases failed, or some of them.
    if answer is not None:
        present(answer, output)
        counts = answer.details["cases"]
        if counts["failed"] == counts["count"]:
            raise UsageError("sweep: no case could be run")
        if counts["failed"] or "not_converged" in counts["outcomes"]:
            raise CommandExit(NOT_CONVERGED_EXIT_CODE)
    elif output.json_:
        print(json.dumps({"cases": len(cases), "folder": str(target)}))
    elif not output.quiet:
        print(
            f"shard {by.shard} is in {target}; when all shards are done, run the sweep with --collect"
        )


def _run_cases(sweep_scene, cases, place, by: WorkerOptions, *, is_quiet: bool):
    """Run the cases of a sweep, and return its Answer, or None for a shard.

    If it is interrupted, the folder has the tables of the cases that are done, and the command that continues is printed.

    `sweep_scene` and `cases` say what is computed, `place` which folder and files are written, and `by` how many
    workers compute. Without `is_quiet`, progress is shown.
    """
    executor = executors.make_executor(by.executor, by.jobs)
    report = None if is_quiet else print_message
    progress = Progress(is_quiet)
    try:
        with progress:
            return run.sweep_into(sweep_scene, cases, place, executor, report, progress.count)
    except (KeyboardInterrupt, core.Missing) as why:
        if isinstance(why, core.Missing) and not progress.done:
            raise
        words = [word for word in sys.argv[1:] if word != "--resume"]
        print_message(
            f"{str(why) or 'interrupted'}; {progress.done} of {len(cases)} cases are kept; continue with: patchfem "
            f"{shlex.join(words)} --resume"
        )
        raise CommandExit(getattr(why, "code", 130)) from None
