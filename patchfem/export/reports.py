"""Page that compares finished runs, or finished sweeps, from their folders."""

from pathlib import Path

from ..core import PatchfemError
from ..disk.atomic_write import explain_write_error, write_text
from .pages import several_runs, sweep
from .sweeps import page as sweeps

PAGE = "report.html"


def write_report(folders: list, out: Path | None = None) -> Path:
    """Write the page on one or several results folders, and return its path.

    Several runs, or several sweeps over the same keys, are shown side by side; the page of a single
    sweep is rebuilt.

    Parameters
    ----------
    folders : list of Path
    out : Path, optional
        The page; by default report.html in the folder of a single sweep, else in the current
        folder.

    Raises
    ------
    PatchfemError
        If a folder is neither a run nor a sweep, or if there are both.
    Missing
        If the page cannot be written.
    """
    if not folders:
        raise PatchfemError("report: give at least one results folder")
    are_sweeps = [(folder / "sweep.csv").is_file() for folder in folders]
    if len(set(are_sweeps)) > 1:
        raise PatchfemError(
            f"runs and sweeps cannot be compared on one page: {folders[are_sweeps.index(True)]} is a sweep, "
            f"{folders[are_sweeps.index(False)]} is not"
        )
    if out is None:
        out = folders[0] / PAGE if are_sweeps[0] and len(folders) == 1 else Path(PAGE)
    if not are_sweeps[0]:
        return _write_page(
            several_runs.page_html([several_runs.read_run(folder) for folder in folders]), out
        )
    tables = [sweeps.relink_cases(sweeps.read_table(folder), folder, out) for folder in folders]
    names = several_runs.number_duplicates([folder.resolve().name for folder in folders])
    return _write_page(
        sweep.page_html(tables[0] if len(tables) == 1 else sweeps.join_tables(tables, names)), out
    )


def _write_page(text: str, out: Path) -> Path:
    """Write a page to a file, and create the folder of the file."""
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise explain_write_error(error, out, out) from None
    write_text(out, text)
    return out
