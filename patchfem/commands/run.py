"""The command that runs a scene and writes its results folder."""

import json
from pathlib import Path

from .. import core
from ..export import run_folder, store
from ..runs import plan
from .shared import (
    DEFAULT_OUTPUT,
    NOT_CONVERGED_EXIT_CODE,
    CommandExit,
    Output,
    OutputGroup,
    Progress,
    Sets,
    UsageError,
    flag_option,
    load_scene,
    present,
    print_message,
)


def run(
    scene: Path,
    /,
    *,
    set_: Sets = (),
    resume: flag_option(
        "continue an interrupted run; possible with [wear] and for a run that is integrated in time"
    ) = False,
    output_options: OutputGroup = DEFAULT_OUTPUT,
):
    """Run SCENE and write its results folder, by default out/<scene name>.

    Example: patchfem run rig.toml --set "drive.acceleration=6 g" -o out/six
    """
    run_plan = plan.plan(load_scene(scene, set_))
    if resume and not run_folder.saves_state(run_plan):
        raise UsageError(
            "run --resume: only a run with [wear] on a patch or a run that is integrated in time saves its "
            "state; run the scene again without --resume"
        )

    # a run that is complete has no state, so that nothing is left to resume
    output = output_options.into(run_plan.model.source.path.stem)
    target = output.out
    if resume and run_folder.is_complete(run_plan, target):
        _report_complete_run(target, output)
        return

    report = None if output.quiet else print_message
    with Progress(output.quiet or output.json_) as progress:
        written = run_folder.run_into(
            run_plan,
            target,
            report,
            progress,
            resume=resume,
            has_page=not output.no_page,
        )
    present(written.answer, output)
    if written.page_fault is not None:
        _report_missing_page(written.page_fault, target)
    if output.verbose:
        seconds = written.answer.details["seconds"]
        print_message("CPU seconds: " + ", ".join(f"{k} {v:.3f}" for k, v in seconds.items()))
    _end_run(written.answer, output.quiet)


def _report_complete_run(target: Path, output: Output) -> None:
    """Say that a run to be resumed is already complete, and print it again as JSON if that is asked for.

    `target` is the results folder, and `output` tells what is printed.
    """
    if not output.quiet:
        print_message(
            f"{target}: this run is already complete; to run it again, leave out --resume"
        )
    answer = store.read_answer(target)
    if output.json_:
        print(json.dumps(store.make_summary(answer), ensure_ascii=False), flush=True)
    _end_run(answer, output.quiet)


def _end_run(answer, is_quiet: bool) -> None:
    """End with exit code 3 if the run of an answer did not converge.

    A quiet run prints its warnings.
    """
    if answer.details["outcome"] != "not_converged":
        return
    for text in answer.remarks.warnings if is_quiet else ():
        print_message(f"warning: {text}")
    raise CommandExit(NOT_CONVERGED_EXIT_CODE)


def _report_missing_page(fault: BaseException, target: Path) -> None:
    """Say why a run has no page, and end with exit code 4; with 130 if the page was interrupted.

    `fault` is the exception that ended the page, and `target` is the results folder.
    """
    if isinstance(fault, KeyboardInterrupt):
        reason = "interrupted while the page was drawn"
    elif isinstance(fault, MemoryError):
        reason = f"{target / store.PAGE_FILE}: out of memory"
    elif isinstance(fault, core.PatchfemError | OSError):
        reason = str(fault)
    else:
        raise fault
    print_message(f"{reason}; the results in {target} are complete except for report.html")
    raise CommandExit(130 if isinstance(fault, KeyboardInterrupt) else 4)
