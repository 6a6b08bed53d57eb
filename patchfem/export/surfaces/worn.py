"""Answer of the comparison of two results folders: wear of a patch between two runs."""

from pathlib import Path

import numpy as np

from ...core import Missing, PatchfemError
from ...formatting import format_length
from ...wear import between_runs
from ...wear.between_runs import Wear
from .. import quantities
from ..answer import Answer, Quantity, Variables
from ..rows import make_variables
from . import sentences
from .compare import SURFACE_NAMES, build_answer
from .patches import PatchRun, read_patch
from .sentences import format_value
from .variables import make_maps

# measures of both runs that stand beside each other; the first three are in the verdict
BEFORE_AND_AFTER_MEASURES = (
    "contact_fraction",
    "pressure_peak",
    "loop_area",
    "normal_stiffness",
    "tangential_stiffness",
    "approach",
    "rotation",
    "groove_amplitude",
    "slip_amplitude",
    "relative_displacement_amplitude",
    "friction_force_peak",
)
N_VERDICT_MEASURES = 3
# Hidden wear relative to the mean depth from which on the verdict states it.
MIN_HIDDEN_WEAR_RATIO = 0.01
BOTH_PIECES_NOTE = (
    "Depths, areas and volumes are those of both pieces together; their intervals are the numerical errors of "
    "the runs."
)


def answer_runs(before: Path, after: Path) -> Answer:
    """Compare the runs in two results folders.

    Parameters
    ----------
    before, after : Path
        The later run has [wear]; the earlier one may be new.

    Returns
    -------
    Answer

    Raises
    ------
    Missing
        If a folder does not exist.
    PatchfemError
        If a folder is no run of a patch, or if the two are not states of one patch in this order.
    """
    for path, other in ((before, after), (after, before)):
        if not path.exists():
            raise Missing(f"{path}: there is no such folder")
        if not path.is_dir():
            raise PatchfemError(
                f"{path}: a file, while {other} is a folder: two files of surfaces or two results folders are needed"
            )
    runs = (read_patch(before), read_patch(after))
    if "wear" not in runs[1].tables:
        raise PatchfemError(
            f"{after}: this run has no [wear], so nothing wore off; give the run with [wear] as the second folder"
        )
    return make_answer(runs, between_runs.measure_wear(runs[0].state, runs[1].state))


def make_answer(runs: tuple[PatchRun, PatchRun], wear: Wear) -> Answer:
    """Return the answer on the wear of a patch between two runs: its sentences, quantities and curves."""
    verdict = describe_wear(runs, wear)
    # Measures and warnings of the run before and of the run after.
    sides = {}
    warnings = []
    for side, run in zip(SURFACE_NAMES, runs, strict=True):
        known = {name: run.answer.quantities.get(name) for name in BEFORE_AND_AFTER_MEASURES}
        measures = {name: q for name, q in known.items() if sentences.is_known(q)}
        outcome = run.answer.details.get("outcome")
        sides[side] = {"outcome": outcome, "cycles": run.cycles, "measures": measures}
        warnings += [f"{side}: {text}" for text in run.answer.remarks.warnings]

    # Wear only removes material, so the later run cannot be less worn.
    if wear.depth.min() < -wear.error:
        warnings.append(
            f"at {_find_place(runs[1], np.argmin(wear.depth))} the later run is worn by "
            f"{format_length(-wear.depth.min(), 3)} less, so it does not continue the earlier one"
        )

    # Both runs have the same coordinates, so that the second surface needs no alignment.
    zero = {"shift": Quantity(0.0, "m", low=0.0, high=0.0)}
    stored = sides["before"]["measures"] | sides["after"]["measures"]
    names = [name for name in BEFORE_AND_AFTER_MEASURES if name in stored]

    return build_answer(
        sources=[run.state.source for run in runs],
        words=sentences.Words(verdict, tuple(warnings), (BOTH_PIECES_NOTE,)),
        values=wear.values,
        track=wear.track,
        data=_make_data(runs, wear),
        details={
            "direction": "x",
            "reference": "run",
            **zero,
            "registration": zero | {"mirrored": False},
            "removed": dict.fromkeys(SURFACE_NAMES, 0),
            "runs": sides,
            "measures": {
                name: {side: sides[side]["measures"].get(name) for side in SURFACE_NAMES}
                for name in names
            },
            "notes": warnings,
        },
    )


def describe_wear(runs: tuple[PatchRun, PatchRun], wear: Wear) -> tuple[str, ...]:
    """Return the verdict: worn depth, worn part, hidden wear, and the main measures before and after."""
    values = wear.values
    if not values["worn_depth_mean"].value > 0:
        return ("Nothing wore off between the two runs.",)
    after = runs[1]
    since = f" (the surface before: {runs[0].cycles:.6g})" if runs[0].cycles else ""
    if "start" in after.tables["wear"]:
        since += f", continued from {Path(after.tables['wear']['start']).name}"
    depth = format_value("worn_depth_mean", values["worn_depth_mean"])
    headline = (
        f"Worn depth {depth}, the mean over the patch, after {after.cycles:.6g} cycles{since}."
    )
    volume, largest = (
        format_value(name, values[name]) for name in ("worn_volume", "worn_depth_max")
    )
    loss = (
        f"{volume} are lost, at most {largest} deep, at {_find_place(after, np.argmax(wear.depth))}"
    )

    verdict = [headline, f"{loss}."]
    # A part that hardly counts is not stated.
    if values["hidden_wear"].value > MIN_HIDDEN_WEAR_RATIO * values["worn_depth_mean"].value:
        hidden = format_value("hidden_wear", values["hidden_wear"])
        measurement = "trace" if after.state.y is None else "scan"
        verdict.append(
            f"Of this depth, {hidden} on average is even or wedge-shaped wear, which a {measurement} alone cannot show."
        )
    return (*verdict, *_describe_measures(runs))


def _find_place(run: PatchRun, number) -> str:
    """Return where on the patch a node lies, given its number."""
    state = run.state
    strip, node = divmod(int(number), state.x.size)
    text = f"x = {format_length(state.x[node], 3)}"
    return text if state.y is None else f"{text}, y = {format_length(state.y[strip], 3)}"


def _describe_measures(runs: tuple[PatchRun, PatchRun]) -> list[str]:
    """Return the sentence with the main measures before and after; [] if there are none."""
    parts = []
    for name in BEFORE_AND_AFTER_MEASURES[:N_VERDICT_MEASURES]:
        pair = [run.answer.quantities.get(name) for run in runs]
        if all(sentences.is_known(number) for number in pair):
            first, second = (quantities.format_quantity(name, number) for number in pair)
            parts.append(f"{name.replace('_', ' ')} {first} and {second}")
    return [f"Before and after: {'; '.join(parts)}."] if parts else []


def _make_data(runs: tuple[PatchRun, PatchRun], wear: Wear) -> Variables:
    """Return gaps, worn depth and its hidden part along the patch, and pressure and friction loop of both runs."""
    state = runs[1].state
    before, after = wear.gaps
    if state.y is not None:
        data = make_maps(state.x, state.y, before_map=before, after_map=after, depth_map=wear.depth)
    else:
        line = np.interp(state.x, state.x[[0, -1]], wear.hidden)
        data = make_variables(
            "surface",
            x=state.x,
            gap_before=before,
            gap_after=after,
            depth=wear.depth,
            hidden_depth=line,
        )

    if wear.track:
        ends = [wear.track[name].value for name in ("from", "to")]
        data |= make_variables("surface", track_end=ends)

    # Pressure of the last frame, on a face that at y = 0, and the loop of a single interface.
    for side, run in zip(SURFACE_NAMES, runs, strict=True):
        variables = run.answer.data
        last = np.atleast_2d(variables["normal_stress"].values[-1])
        middle = last[(len(last) - 1) // 2 : len(last) // 2 + 1].mean(axis=0)
        columns = {f"x_pressed_{side}": run.state.x, f"pressure_{side}": middle}
        if "loop_slide" in variables and variables["loop_slide"].values.ndim == 1:
            columns[f"slide_{side}"] = variables["loop_slide"].values
            columns[f"force_{side}"] = variables["loop_friction_force"].values
        data |= make_variables("surface", **columns)
    return data
