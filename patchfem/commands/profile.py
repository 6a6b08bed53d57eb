"""The command that reads measured surfaces and prints their roughness."""

import json
import re
import tomllib
from dataclasses import asdict
from pathlib import Path

from .. import __version__
from ..disk.atomic_write import write_text
from ..export.surfaces import roughness
from ..model import model
from ..model.source import locate_errors
from ..runs.patch import trace_split
from ..scene import scene, toml_text
from ..scene.files import require_files
from ..surface.roughness import form as forms
from .shared import (
    Json,
    Output,
    Plot,
    Units,
    UsageError,
    Verbose,
    out_option,
    parse_quantity,
    parse_units,
    path_option,
    present,
    refuse_existing,
    save,
    text_option,
)

# Tables [contact.profile] and [contact.asperities] of a scene; each match ends before the
# comments above the next table.
SURFACE_TABLES_PATTERN = re.compile(
    r"^[ \t]*\[contact\.(?:profile|asperities)\].*?(?=(?:^[ \t]*(?:#[^\n]*)?\n)*^[ \t]*\[|\Z)",
    re.MULTILINE | re.DOTALL,
)


def profile(
    file: Path,
    /,
    *more: Path,
    cutoff: text_option(
        'wavelength that separates roughness from waviness (L-filter), such as "0.25 mm"'
    ) = "",
    form: text_option(
        "form to subtract first, such as 1 (a line or a plane), or circle for a trace over a cylinder or a ball"
    ) = "1",
    s_filter: text_option(
        'wavelength of the S-filter, such as "2.5 um"; shorter waves are removed first'
    ) = "",
    window: text_option(
        'part to evaluate, between two positions such as "468 um,733 um"; a scan needs four '
        "positions, first the two in x, then the two in y"
    ) = "",
    units: Units = "",
    split: path_option(
        "scene with a patch, such as scene.toml: print the tables that divide FILE between its mesh and a layer "
        "of asperities, at --cutoff or at the shortest wave that mesh and load resolve; -o names the new scene"
    ) = None,
    out: out_option(
        "folder for a page, a table of the parameters and the levelled heights, such as out/trace"
    ) = None,
    plot: Plot = None,
    json_: Json = False,
    verbose: Verbose = False,
):
    """Print the roughness parameters of each FILE, with 90 % intervals estimated from this one file (those of compare are
    95 % intervals). For several files, print also the mean of each parameter.

    Example: patchfem profile trace.csv --cutoff "0.25 mm"
    """
    options = {"window": _window(window) if window else None}
    for key, name, text in (("cutoff", "cutoff", cutoff), ("short", "s-filter", s_filter)):
        options[key] = parse_quantity(text, "length", f"profile --{name}")
        if options[key] is not None and options[key] <= 0:
            raise UsageError(f"profile --{name} {text}: a length above zero is needed")
    if split is not None:
        if more or form != "1" or s_filter or window or units or plot or verbose:
            raise UsageError(
                "profile --split: takes one FILE, without --form, --s-filter, --window, --units, --plot and --verbose"
            )
        _print_split(file, split, options["cutoff"], out, json_=json_)
        return

    options["form"] = forms.parse_form_option(form)
    paths = (file, *more)
    output = Output(out, plot=plot, json_=json_, verbose=verbose)
    if out is not None:
        save(lambda _: roughness.answer_files(paths, parse_units(units), **options), output)
    else:
        present(roughness.answer_files(paths, parse_units(units), **options), output)


def _print_split(
    trace: Path, scene_path: Path, cutoff: float | None, out: Path | None, *, json_: bool
):
    """Print the tables that divide a trace between the mesh and a layer of asperities, and write the new scene.

    The trace is a file, `scene_path` the scene of the patch, and `cutoff` [m] the wavelength between both, or None for the
    shortest wave that mesh and load resolve. The new scene is written to `out`, unless it is None. `json_` prints JSON.
    """
    target = scene_path if out is None else out
    refuse_existing(out)
    relative_path = toml_text.name_file(trace, target.parent)
    text = toml_text.read_text(scene_path)
    if scene.loads(text, target).contact is None:
        raise UsageError(
            f"profile --split: {scene_path} has no [contact], so no patch has this trace"
        )

    # the split depends on the mesh and the load of the scene
    scene_with_trace = require_files(
        scene.loads(text, target, [f"contact.profile.file={relative_path}"])
    )
    with locate_errors(scene_with_trace):
        divided = trace_split.split_trace(model.build(scene_with_trace).patch, cutoff)
    if out is not None:
        _write_split(text, divided.tables, scene_path, out)
    if json_:
        print(json.dumps({"patchfem": __version__, "split": asdict(divided)}, ensure_ascii=False))
        return

    has_cutoff = cutoff is not None
    is_written = out is not None
    words = divided.describe_split(is_cutoff_given=has_cutoff, is_scene_written=is_written)
    print(f"{trace}: {words}")
    if is_written:
        print(f"scene: {out}")


def _write_split(text: str, tables: str, scene_path: Path, out: Path) -> None:
    """Write a scene with new tables of profile and asperities to the file `out`.

    `text` is the scene in the file `scene_path`, and `tables` are the new tables as text. Raises UsageError if the
    scene has such tables inside [contact].
    """
    remaining_text = SURFACE_TABLES_PATTERN.sub("", text).rstrip()
    if {"profile", "asperities"} & tomllib.loads(remaining_text)["contact"].keys():
        raise UsageError(
            f"profile --split: {scene_path} has profile or asperities inside [contact]; write them as tables "
            "[contact.profile] and [contact.asperities], or paste the tables that are printed without -o"
        )
    new_text = f"{remaining_text}\n\n{tables}"
    scene.loads(new_text, out)
    write_text(out, new_text)


def _window(text: str) -> tuple[float, ...]:
    """Read the positions [m] of a window from a text.

    UsageError is raised unless there are two or four.
    """
    positions = text.split(",")
    if len(positions) not in (2, 4) or not all(map(str.strip, positions)):
        raise UsageError(
            f"profile --window '{text}': "
            "two positions are needed, such as '468 um,733 um'; a scan needs four"
        )
    return tuple(parse_quantity(word, "length", "profile --window") for word in positions)
