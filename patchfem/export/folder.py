"""A finished run on disk: summary, netCDF, fields, resolved scene and page in one folder."""

import os
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from .. import __version__
from ..core import Missing, NotConverged, PatchfemError
from ..disk.atomic_write import write_text
from ..runs.results.result import Result, shorten_file_names
from ..runs.run import StateFile, is_march, run
from . import netcdf, report
from .fields import vtkhdf
from .histories import result_contents
from .results import INTERFACES_FOLDER, MAX_INTERFACES, PAGE, STATE, Folder, is_state
from .summary import read_summary, summarise_run, write_json

SCENE = "scene.resolved.toml"


class WrittenRun(NamedTuple):
    """Finished run whose results are on disk.

    summary: content of summary.json; result: the run; folder_id: device and inode of the folder,
    which identify it after it has been renamed.
    """

    summary: dict
    result: Result
    folder_id: tuple


def run_into(
    run_plan, target: Path, say=None, progress=None, fresh: bool = False, resume: bool = False
) -> WrittenRun:
    """Run a plan and write its results into a folder, without the page.

    The folder is locked first. An older results folder is replaced only when the new one is
    complete, and a folder with other files is refused before anything runs. A run with [wear] and a
    long march save their state in the folder. If the motion does not converge, the patch that was
    pressed before is written, with the outcome not_converged.

    Parameters
    ----------
    run_plan : Plan
    target : Path
        Results folder.
    say, progress : callable, optional
        Take a line of text and the completed fraction.
    fresh : bool
        Whether the pieces are condensed again.
    resume : bool
        Whether to continue from the saved state.

    Returns
    -------
    WrittenRun

    Raises
    ------
    PatchfemError
        If there is no state to continue from.
    NotConverged
        If the motion does not converge and there is no pressed patch.
    """
    with Folder(target, resume) as folder:
        if folder.dropped and say is not None:
            say(folder.dropped)
        state_file = (
            StateFile(folder.path / STATE, __version__, resume) if saves_state(run_plan) else None
        )
        try:
            result = run(run_plan, say, progress, fresh=fresh, state_file=state_file)
        except NotConverged as error:
            if error.partial_result is None:
                raise NotConverged(
                    f"{error}; the run stopped before any result, so there is no results folder"
                ) from None
            result = _partial_result(error)
        return write_results(result, folder.path)


def _partial_result(error: NotConverged) -> Result:
    """Return the partial results of a run that did not converge, with the reason as a warning."""
    result = error.partial_result
    return replace(
        result,
        warnings=[
            *shorten_file_names([str(error)], result.plan.model.source.path),
            *result.warnings,
        ],
    )


def saves_state(run_plan) -> bool:
    """Return whether the run of a plan saves its state for a later resume."""
    return (run_plan.model.wear is not None and run_plan.model.patch is not None) or is_march(
        run_plan
    )


def is_complete(run_plan, target: Path) -> bool:
    """Return whether a folder contains the complete run of a plan, with nothing left to resume.

    It is False for an incomplete folder, or one with the state of an interrupted run. PatchfemError
    if it contains the complete run of another scene.
    """
    state = target.parent / f"{target.name}.partial"
    try:
        if state.is_dir() and any(is_state(path.name) for path in state.iterdir()):
            return False
        version = read_summary(target / "summary.json")["patchfem"]
        text = (target / SCENE).read_text("utf-8")
    except (OSError, ValueError):
        return False
    if (version, text) == (__version__, run_plan.model.source.resolved):
        return True
    raise PatchfemError(
        f"{target}: this folder contains no interrupted run but a complete run of another scene or of "
        "another version of patchfem; name another folder with -o, or run without --resume to replace "
        "that run"
    )


def write_results(result: Result, path: Path) -> WrittenRun:
    """Write all files of a run, except its page, into a folder."""
    start_time = perf_counter()
    text = result.plan.model.source.resolved
    write_text(path / SCENE, text)
    netcdf.write_netcdf(result_contents(result), path / "result.nc")
    if result.patch is not None:
        vtkhdf.write_fields(result, path / vtkhdf.NAME)
    for face in result.extra.get("faces", ())[:MAX_INTERFACES]:
        face_folder = path / INTERFACES_FOLDER / face.folder
        face_folder.mkdir(parents=True, exist_ok=True)
        face_result = replace(
            result,
            plan=replace(result.plan, model=face.model),
            patch=face.patch,
            fields=face.fields,
            extra={},
        )
        vtkhdf.write_fields(face_result, face_folder / vtkhdf.NAME)
        result.extra["notes"] += [
            f"interface {face.name}: {text}" for text in face_result.extra["notes"]
        ]
    result.seconds["files"] = perf_counter() - start_time
    summary = summarise_run(result)
    write_json(summary, path / "summary.json")
    return WrittenRun(summary, result, _folder_identity(path))


def write_run_page(stored_run: WrittenRun, folder: Path) -> Path:
    """Write the page of a run into its complete results folder, and return the path of the page.

    Missing if another run has replaced the folder in the meantime.
    """
    text = report.run_page(stored_run.result)
    path = Path(folder) / PAGE
    if not path.parent.is_dir() or _folder_identity(path.parent) != stored_run.folder_id:
        raise Missing(f"{folder}: replaced by another run while the page was drawn")
    write_text(path, text)
    return path


def _folder_identity(folder: Path) -> tuple:
    """Return the device and inode numbers that identify a folder."""
    status = os.stat(folder)
    return status.st_dev, status.st_ino


def save_run(result: Result, folder: Path, page: bool = True) -> None:
    """Write the results folder of a finished run, by default with its page.

    An older results folder is replaced.

    Parameters
    ----------
    result : Result
    folder : Path
    page : bool
        Whether report.html is written.
    """
    with Folder(folder) as claimed:
        stored_run = write_results(result, claimed.path)
    if page:
        write_run_page(stored_run, claimed.target)
