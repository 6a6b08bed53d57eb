"""Checks of the files of a run: they are complete and finite, and no claim contradicts the energy balance."""

from pathlib import Path

import numpy as np

from .trial import Trial, TrialFailure, parse_strict_json

BALANCE = 0.1  # Largest energy balance, relative to the work, of a run without a warning.
# An event of the drive has no displacement, and a level may lack a measure; both are marked as
# missing.
MISSING = ("event_slide", "level_")


def check_results(folder: Path) -> dict:
    """Return the summary of a results folder.

    Raises TrialFailure if a file is missing, a number is not finite or a claim cannot be true.
    """
    if not (folder / "summary.json").is_file():
        raise TrialFailure(f"no {folder.name}/summary.json")
    summary = parse_strict_json((folder / "summary.json").read_text("utf-8"))
    for name, measure in summary["measures"].items():
        if measure["value"] is None and not measure.get("reason"):
            raise TrialFailure(f"{name} is null without a reason")
    check_finite(folder / "result.nc")
    balance = summary["measures"].get("energy_balance", {"value": None})
    # The stated error is never less than this value, which is itself an error; one above the tolerance has a warning.
    value = balance["value"]
    if (value or 0.0) > BALANCE and not summary["warnings"]:
        raise TrialFailure(
            f"{summary['outcome']} with an energy balance of {value:.3g} without a warning"
        )
    if summary["outcome"] == "not_converged" and not summary["warnings"]:
        raise TrialFailure("not_converged without a warning")
    return summary


def check_finite(path: Path) -> None:
    """Raise TrialFailure if a netCDF file contains a number that is not finite."""
    import h5py

    def check_dataset(name, item):
        """Check one dataset of the file."""
        if not isinstance(item, h5py.Dataset) or item.dtype.kind != "f" or name.startswith(MISSING):
            return
        if item.size and not np.isfinite(item[()]).all():
            raise TrialFailure(
                f"{path.name}: {name} holds {np.size(item[()]) - np.isfinite(item[()]).sum()} of "
                f"{np.size(item[()])} values that are not finite"
            )

    if path.is_file():
        with h5py.File(path) as file:
            file.visititems(check_dataset)


def check_no_remnants(folder: Path) -> None:
    """Raise TrialFailure if a command left unfinished files beside its results."""
    remnants = [
        path.name
        for path in folder.iterdir()
        if path.name.startswith(".") or path.name.endswith(".partial")
    ]
    if remnants:
        raise TrialFailure(f"left behind: {', '.join(sorted(remnants))}")


def run_scene(trial: Trial, file, *words, max_seconds: float = 3.0) -> dict | None:
    """Check, plan and run a scene, compare the outcomes, and return the summary.

    None if it is refused, ends without results (exit code 3 or 4) or would take more than about
    `max_seconds` seconds.
    """
    checked = trial.run("check", file, *words)
    seconds = trial.planned_seconds(file)
    if checked.code == 0 and seconds is None:
        raise TrialFailure("check ends with 0, plan refuses")
    if seconds is None or seconds > max_seconds:
        return None
    result = trial.run("run", file, "-o", "result", "--no-page", *words, seconds=seconds)
    if checked.code == 2 and result.code in (0, 3):
        raise TrialFailure(f"check ends with 2, run with {result.code}")
    check_no_remnants(trial.folder)
    if result.code == 0 or (trial.folder / "result").exists():
        return check_results(trial.folder / "result")
    return None
