"""The verb that sets two measured surfaces side by side, before and after."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..campaigns import compare as pressing
from ..export import results, summary
from ..export.surfaces import compare as paper
from ..surface import profile
from ..surface.compare import compare as comparison
from ..surface.compare import verdict
from .shared import (
    Json,
    Out,
    Quiet,
    Refused,
    Sets,
    Units,
    flag,
    model_of,
    note,
    pair,
    placed,
    quantity,
    say,
    scene_of,
    word,
)


def compare(before: Path, after: Path, /, *other: Path,
            direction: word("x or y, along which the traces run; an areal scan has both") = "",
            units: Units = "",
            shift: word("known shift: what stands at x before stands at x + shift after, such as \"0 mm\" for traces "
                        "from one mark") = "",
            keep_spikes: flag("keep spikes, dropouts and dust, which are left out of traces otherwise") = False,
            scene: Annotated[Path | None, Parameter(name="--scene", help="press the patch of this scene with each "
                                                    "surface, such as rig.toml")] = None,
            set_: Sets = (), out: Out = None, json_: Json = False, quiet: Quiet = False):
    """Compare the surface in BEFORE with that in AFTER: registration, worn depth, ratios, a verdict, a page; of areal
    scans the worn volume and maps; two more files are the pair of the other direction, of traces.

    Example: patchfem compare before.csv after.csv --direction x -o out/worn
    """
    if direction not in ("", "x", "y"):
        raise Refused(f"compare --direction {direction}: x or y is wanted")
    known = quantity(shift, "length", "compare --shift")
    parts = comparison.compared_files((before, after, *other), direction, pair(units), known, keep_spikes)
    directions = comparison.directions_of(parts)
    found = verdict.verdicts(parts, directions)
    target = placed(out, f"{before.stem}-{after.stem}")
    with results.Folder(target) as folder:
        pressing = _pressed(scene, set_, parts[0], folder.path, quiet) if scene is not None else None
        data = paper.data_of(parts, found, directions, pressing)
        summary.write_json(data, folder.path / "compare.json")
        paper.write_page(folder.path / "report.html", parts, found, pressing)
    for text in data["notes"]:
        note(text)
    if json_:
        print(json.dumps(data, ensure_ascii=False, allow_nan=False))
    else:
        print("\n".join(paper.lines_of(parts, found, pressing)))
        print(f"results: {target}")


def _pressed(scene: Path, sets, part, target: Path, quiet: bool):
    """The scene with each surface as its profile; the traces are written beside the page."""
    if not isinstance(part.before, profile.Profile):
        raise Refused("compare --scene: a scene presses traces; write one row of each scan to a file")
    if scene_of(scene, sets).contact is None:
        raise Refused(f"compare --scene {scene}: no [contact] in it; a surface is pressed into a patch")
    models = []
    for name, trace in zip(("before", "after"), paper.surfaces(part)):
        path = paper.write_trace(target / f"surface_{name}.csv", trace).resolve()
        models.append(model_of(scene, (*sets, f"contact.profile.file={path}", "contact.profile.heights=surface")))
    return pressing.pressed(*models, scene.name, None if quiet else say)
