"""The command that compares two measured surfaces, before and after wear."""

import json
from pathlib import Path
from typing import Annotated, NamedTuple

from cyclopts import Parameter

from ..campaigns import compare as pressing
from ..export import results, summary
from ..export.surfaces import compare as paper
from ..export.surfaces import pairs as pairs_paper
from ..export.surfaces import predicted as predicted_paper
from ..export.surfaces import worn, worn_runs
from ..surface import profile
from ..surface.compare import pairs as tables
from ..surface.compare import verdict
from .shared import (
    CommandExit,
    Json,
    NotConvergedExit,
    Out,
    Quiet,
    Sets,
    Units,
    UsageError,
    choose_folder,
    flag_option,
    load_model,
    load_scene,
    note,
    parse_quantity,
    parse_units,
    print_message,
    progress_bar,
    text_option,
)
from .streams import make_printable


def compare(
    before: Path | None = None,
    after: Path | None = None,
    /,
    *other: Path,
    pairs: Annotated[
        Path | None,
        Parameter(
            help="table of pairs in place of BEFORE and AFTER, such as "
            "pairs.csv: each line names two files or two results folders "
            "in the columns `before` and `after`"
        ),
    ] = None,
    direction: text_option(
        "axis along which the traces run, x or y; it names the direction in the answer and "
        "may be left out"
    ) = "",
    units: Units = "",
    shift: text_option(
        'known shift of the second trace (x of AFTER minus x of BEFORE), such as "0 mm" if both traces '
        "start at the same mark"
    ) = "",
    keep_spikes: flag_option(
        "keep spikes, dropouts and dust; without this option they are removed from traces"
    ) = False,
    datum: text_option(
        "what is known of the datum of the instrument, such as straight; then no bow is subtracted "
        "from traces"
    ) = "",
    scene: Annotated[
        Path | None,
        Parameter(
            name="--scene",
            help="scene with a patch, such as rig.toml; the "
            "patch is pressed with each of the two "
            "surfaces in turn",
        ),
    ] = None,
    set_: Sets = (),
    predicted: Annotated[
        Path | None,
        Parameter(
            help="results folder of a run with [wear], such as out/wear; its worn depth is laid "
            "over that of the traces, and the wear coefficient is fitted"
        ),
    ] = None,
    piece: text_option(
        "piece of which the traces are, such as upper (or lower), for --predicted; it may be left out if "
        "both pieces wear alike (wear.upper_share = 0.5)"
    ) = "",
    out: Out = None,
    json_: Json = False,
    quiet: Quiet = False,
):
    """Compare the surfaces measured in the files BEFORE and AFTER. The results are the shift between the surfaces, the
    worn depth, ratios of roughness parameters, a verdict and a page. Areal scans also give the worn volume, maps, and
    the levelled difference as X3P and text. To compare the perpendicular direction too, append its two traces. With
    --pairs, all pairs of a table are compared; the results are then mean, scatter and interval over the pairs. BEFORE
    and AFTER may also be two results folders. AFTER must then belong to a run with [wear], and the page shows the wear
    between the two runs. With --predicted, the worn depth of a run is overlaid on that of the traces, and the wear
    coefficient is fitted with its interval.

    Example: patchfem compare before.csv after.csv --direction x -o out/worn
    """
    if direction not in ("", "x", "y"):
        raise UsageError(f"compare --direction {direction}: the direction must be x or y")
    if datum not in ("", "straight"):
        raise UsageError(
            f"compare --datum {datum}: give --datum straight, or leave it out if the datum may be bent"
        )
    settings = {
        "units": parse_units(units),
        "shift": parse_quantity(shift, "length", "compare --shift"),
        "keep_spikes": keep_spikes,
        "datum": datum,
    }
    files = [path for path in (before, after, *other) if path is not None]
    if piece and predicted is None:
        raise UsageError(f"compare --piece {piece}: this option needs --predicted")
    if pairs is not None:
        if files or scene is not None or predicted is not None:
            other_option = "--scene" if scene is not None else "--predicted"
            raise UsageError(
                f"compare --pairs {pairs}: give the table alone, without "
                f"{'other files' if files else other_option}"
            )
        _compare_table(pairs, direction, settings, choose_folder(out, pairs.stem), json_, quiet)
        return
    if len(files) < 2:
        raise UsageError(
            "compare: give two files BEFORE and AFTER, or a table of pairs with --pairs"
        )
    folders = before.is_dir(), after.is_dir()
    if any(folders) and len(files) == 2 and not all(folders):
        worn_runs.compare_runs(before, after)  # raises the error for a file and a folder
    if any(folders):
        _refuse_surface_options(
            {
                "a third file": other,
                "--direction": direction,
                "--units": units,
                "--shift": shift,
                "--keep-spikes": keep_spikes,
                "--datum": datum,
                "--scene": scene,
                "--set": set_,
                "--predicted": predicted,
            }
        )
        return _compare_runs(before, after, out, json_)
    request = _RunRequest(scene, set_, predicted, piece)
    target = choose_folder(out, f"{before.stem}-{after.stem}")
    judgement = verdict.judge_files(tuple(files), direction, **settings)
    data = _write_comparison(judgement, request, target, json_=json_, quiet=quiet)
    for text in data["notes"]:
        note(text)
    if json_:
        print(json.dumps(data, ensure_ascii=False, allow_nan=False))


class _RunRequest(NamedTuple):
    """Additional requests of a comparison: a scene to run, and a run whose computed wear is overlaid."""

    scene: Path | None
    sets: tuple
    predicted: Path | None
    piece: str


def _write_comparison(
    judgement: "verdict.Judgement", request: _RunRequest, target: Path, *, json_: bool, quiet: bool
) -> dict:
    """Write the files of a comparison into a folder, and print it as text unless `json_`.

    Parameters
    ----------
    judgement : Judgement
    request : _RunRequest
    target : Path
    json_, quiet : bool

    Returns
    -------
    dict
        The content of compare.json.
    """
    parts, comparison, directions = judgement
    worn_prediction = None
    if request.predicted is not None:
        worn_prediction = predicted_paper.predict_wear(parts, request.predicted, request.piece)
        comparison = paper.add_predicted_sentence(comparison, worn_prediction)
    with results.Folder(target) as folder:
        pressing = None
        if request.scene is not None:
            pressing = _press_surfaces(request.scene, request.sets, parts[0], folder.path, quiet)
        computed = paper.ComputedParts(pressing, worn_prediction)
        data = paper.comparison_data(parts, comparison, directions, computed)
        summary.write_json(data, folder.path / "compare.json")
        paper.write_page(folder.path / "report.html", parts, comparison, directions, computed)
        paper.write_difference(folder.path, parts[0])
        if worn_prediction is not None:
            predicted_paper.write_csv(folder.path / "predicted.csv", worn_prediction)
    if not json_:
        print("\n".join(paper.format_comparison(parts, comparison, computed)))
        print(f"results: {target}")
    return data


def _compare_table(
    path: Path, direction: str, settings: dict, target: Path, json_: bool, quiet: bool
) -> None:
    """Compare all pairs in a table; the exit code is 3 if some pairs fail and 2 if all pairs fail.

    Parameters
    ----------
    path : Path
        The table.
    direction : str
        Axis of the traces whose line in the table states none.
    settings : dict
        Settings of `verdict.judge_files`.
    target : Path
        Folder of the results.
    json_, quiet : bool
    """
    requests = tables.read_pairs(path)
    with results.Folder(target) as folder:
        with progress_bar(quiet) as report_progress:
            rows = pairs_paper.compare_pairs(requests, direction, report_progress, **settings)
        data = pairs_paper.pairs_data(rows)
        summary.write_json(data, folder.path / "pairs.json")
        pairs_paper.write_csv(rows, folder.path / "pairs.csv")
        pairs_paper.write_page(folder.path / "report.html", rows, path.name)
    for text in data["notes"]:
        note(text)
    print(
        json.dumps(rows, ensure_ascii=False, allow_nan=False)
        if json_
        else "\n".join([*pairs_paper.format_pairs(rows), f"results: {target}"])
    )
    failed = [row for row in rows if row["outcome"] == "failed"]
    for row in failed:
        print_message(make_printable(f"{path}:{row['line']}: {row['message']}"))
    if len(failed) == len(rows):
        raise CommandExit(2)
    if failed:
        raise NotConvergedExit


def _refuse_surface_options(options: dict):
    """Raise UsageError for options for measured surfaces if results folders are compared."""
    for name, value in options.items():
        if value:
            raise UsageError(
                f"compare: {name} can only be used for measured surfaces, not for results folders; "
                "leave it out"
            )


def _compare_runs(before: Path, after: Path, out, json_: bool):
    """Compare the wear between the runs in two results folders."""
    wear = worn_runs.compare_runs(before, after)
    wear_verdict = worn.wear_verdict(wear)
    data = worn.wear_data(wear, wear_verdict)
    target = choose_folder(out, f"{before.resolve().name}-{after.resolve().name}")
    with results.Folder(target) as folder:
        summary.write_json(data, folder.path / "compare.json")
        worn.write_page(folder.path / "report.html", wear, wear_verdict)
    for text in data["notes"]:
        note(text)
    print(
        json.dumps(data, ensure_ascii=False, allow_nan=False)
        if json_
        else "\n".join([*worn.format_wear(wear, wear_verdict), f"results: {target}"])
    )


def _press_surfaces(scene: Path, sets, part, target: Path, quiet: bool):
    """Run a scene with each surface as its profile; write the traces into the folder."""
    if not isinstance(part.before, profile.Profile):
        raise UsageError(
            "compare --scene: the contact can be computed only for traces; write one line of heights of "
            "each scan to a file of its own"
        )
    if load_scene(scene, sets).contact is None:
        raise UsageError(
            f"compare --scene {scene}: the scene has no [contact], so it has no patch to press"
        )
    models = []
    for name, trace in zip(("before", "after"), paper.pressed_traces(part)):
        path = paper.write_trace(target / f"surface_{name}.csv", trace).resolve()
        models.append(
            load_model(
                scene, (*sets, f"contact.profile.file={path}", "contact.profile.heights=surface")
            )
        )
    return pressing.run_both_surfaces(*models, scene.name, None if quiet else print_message)
