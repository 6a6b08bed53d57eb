"""Checks of the files of a run: they are complete and finite, and no claim contradicts the energy balance."""

from pathlib import Path

import numpy as np

from .trial import Trial, Wrong, strict

BALANCE = 1e-8  # Largest energy balance, relative to the work, of a run that ends as steady.
# An event of the drive has no displacement, and a level may lack a measure; both are marked as
# missing.
MISSING = ("event_slide", "level_")


def whole(folder: Path) -> dict:
    """Return the summary of a results folder.

    Raises TrialFailure if a file is missing, a number is not finite or a claim cannot be true.
    """
    if not (folder / "summary.json").is_file():
        raise Wrong(f"no {folder.name}/summary.json")
    summary = strict((folder / "summary.json").read_text("utf-8"))
    for name, measure in summary["measures"].items():
        if measure["value"] is None and not measure.get("reason"):
            raise Wrong(f"{name} is null without a reason")
    finite(folder / "result.nc")
    books = summary["measures"].get("energy_balance", {"value": None})
    # For harmonic balance the error states the truncated part.
    closes = max(BALANCE, books.get("error") or 0.0)
    if (
        books["value"] is not None
        and books["value"] > closes
        and summary["outcome"] in ("steady", "stuck")
    ):
        raise Wrong(
            f"{summary['outcome']} with an energy balance of {books['value']:.3g} ± {closes:.3g}"
        )
    if summary["outcome"] == "not_converged" and not summary["warnings"]:
        raise Wrong("not_converged without a warning")
    return summary


def finite(path: Path) -> None:
    """Raise TrialFailure if a netCDF file contains a number that is not finite."""
    import h5py

    def look(name, item):
        """Check one dataset of the file."""
        if not isinstance(item, h5py.Dataset) or item.dtype.kind != "f" or name.startswith(MISSING):
            return
        if item.size and not np.isfinite(item[()]).all():
            raise Wrong(
                f"{path.name}: {name} holds {np.size(item[()]) - np.isfinite(item[()]).sum()} of "
                f"{np.size(item[()])} values that are not finite"
            )

    if path.is_file():
        with h5py.File(path) as file:
            file.visititems(look)


def left_over(folder: Path) -> None:
    """Raise TrialFailure if a command left unfinished files beside its results."""
    rest = [
        one.name
        for one in folder.iterdir()
        if one.name.startswith(".") or one.name.endswith(".partial")
    ]
    if rest:
        raise Wrong(f"left behind: {', '.join(sorted(rest))}")


def ran(trial: Trial, file, *words, most: float = 3.0) -> dict | None:
    """Check, plan and run a scene, compare the outcomes, and return the summary.

    None if it is refused, ends without results (exit code 3 or 4) or is planned above `most`
    seconds.
    """
    checked = trial.run("check", file, *words)
    seconds = trial.announced(file, *words)
    if checked.code == 0 and seconds is None:
        raise Wrong("check ends with 0, plan refuses")
    if seconds is None or seconds > most:
        return None
    ended = trial.run("run", file, "-o", "result", "--no-page", *words, seconds=seconds)
    if checked.code == 2 and ended.code in (0, 3):
        raise Wrong(f"check ends with 2, run with {ended.code}")
    left_over(trial.folder)
    if ended.code == 0 or (trial.folder / "result").exists():
        return whole(trial.folder / "result")
    return None
