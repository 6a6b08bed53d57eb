"""The command that compares two measured surfaces, before and after wear, or two runs."""

from pathlib import Path
from typing import Any

from ..campaigns import compare as pressing
from ..export.surfaces import compare as compared
from ..export.surfaces import worn
from ..scene import describe_removed
from ..surface.compare.compare import Options
from .shared import (
    DEFAULT_OUTPUT,
    NOT_CONVERGED_EXIT_CODE,
    CommandExit,
    Output,
    OutputGroup,
    Progress,
    Sets,
    Units,
    UsageError,
    flag_option,
    load_model,
    load_scene,
    parse_quantity,
    parse_units,
    path_option,
    print_message,
    save,
    text_option,
)
from .streams import make_printable


def compare(
    before: Path | None = None,
    after: Path | None = None,
    /,
    *other: Path,
    pairs: path_option(
        "table of pairs in place of BEFORE and AFTER, such as pairs.csv: each line names two files in the columns "
        "`before` and `after`"
    ) = None,
    direction: text_option(
        "axis along which the traces run, x or y; it names the direction in the answer and may be left out"
    ) = "",
    units: Units = "",
    shift: text_option(
        'known shift of the second trace (x of AFTER minus x of BEFORE), such as "0 mm" if both traces '
        "start at the same mark"
    ) = "",
    keep_spikes: flag_option(
        "keep spikes, dropouts and dust; without this option they are removed"
    ) = False,
    datum: text_option(
        "what is known of the datum of the instrument, such as straight; then no bow is subtracted from traces"
    ) = "",
    cutoff: text_option(
        'cut-off of the roughness inside and outside of the track of traces, such as "0.25 mm"; default: the longest '
        "standard one that fits"
    ) = "",
    scene: path_option(
        "scene with a patch, such as rig.toml; the patch is pressed with each of the two surfaces in turn",
        "--scene",
    ) = None,
    set_: Sets = (),
    predicted: path_option(
        "results folder of a run with [wear], such as out/wear; its worn depth is drawn over that of the traces, and the "
        "wear coefficient is fitted"
    ) = None,
    piece: text_option(
        "piece of which the traces are, such as upper (or lower), for --predicted; it may be left out if "
        "both pieces wear alike (wear.upper_share = 0.5)"
    ) = "",
    output_options: OutputGroup = DEFAULT_OUTPUT,
):
    """Compare the surfaces measured in the files BEFORE and AFTER: worn depth, volume or area with intervals, a verdict
    and a page. With --pairs, each pair of a table is compared; pairs.csv and a page then have its depths and ratios with
    their intervals. BEFORE and AFTER may also be results folders of two runs, the second one with [wear]. With --predicted,
    the worn depth of a run is drawn over that of the traces, and the wear coefficient is fitted with its interval.

    Example: patchfem compare before.csv after.csv --direction x -o out/worn
    """
    length = parse_quantity(shift, "length", "compare --shift")
    own_cutoff = parse_quantity(cutoff, "length", "compare --cutoff")
    options = Options(parse_units(units), direction, length, datum, keep_spikes, own_cutoff)
    trace_options = {"--predicted": predicted, "--piece": piece}
    other_options = {"--scene": scene, "--set": set_, **trace_options}
    files = [path for path in (before, after, *other) if path is not None]

    # an option that the kind of comparison does not use is a mistake of the user
    if pairs is not None:
        _refuse_others({"another file": files, **other_options}, "a table of pairs")
        _compare_pairs(pairs, options, output_options.into(pairs.stem))
        return
    if len(files) != 2:
        if len(files) == 4:
            raise UsageError(describe_removed("compare of four files"))
        raise UsageError(
            "compare: give two files BEFORE and AFTER, or a table of pairs with --pairs"
        )

    output = output_options.into(f"{before.resolve().stem}-{after.resolve().stem}")
    if before.is_dir() or after.is_dir():
        other_options |= {"--units": units, "--shift": shift, "--datum": datum}
        other_options |= {
            "--direction": direction,
            "--keep-spikes": keep_spikes,
            "--cutoff": cutoff,
        }
        _refuse_others(other_options, "results folders")
        save(lambda _: worn.answer_runs(before, after), output)
    elif scene is not None:
        _refuse_others(trace_options, "--scene")
        _compare_in_scene(before, after, options, (scene, set_), output)
    else:
        _refuse_others({"--set": set_}, "surfaces alone, without --scene")
        save(lambda _: compared.answer_files(before, after, options, predicted, piece), output)


def _refuse_others(given: dict[str, Any], subject: str) -> None:
    """Raise UsageError for the first of some options that has a value but does not apply.

    `given` has the values by option, and `subject` says in the message what is compared.
    """
    for name, value in given.items():
        if value:
            raise UsageError(f"compare: {name} cannot be used with {subject}; leave it out")


def _compare_pairs(table: Path, options, output: Output) -> None:
    """Compare all pairs in a table, and print or write the answer.

    `options` tell how surfaces are read and compared, and `output` where the answer goes. The exit code is 3 if some
    pairs fail and 2 if all pairs fail.
    """
    with Progress(output.quiet or output.json_) as progress:
        answer = save(lambda _: compared.answer_pairs(table, options, progress), output)
    rows = answer.details["pairs"]
    failed = [row for row in rows if row["outcome"] == "failed"]
    for row in failed:
        print_message(make_printable(f"{table}:{row['line']}: {row['message']}"))
    if failed:
        raise CommandExit(2 if len(failed) == len(rows) else NOT_CONVERGED_EXIT_CODE)


def _compare_in_scene(
    before: Path, after: Path, options, base: tuple[Path, tuple[str, ...]], output: Output
) -> None:
    """Compare two traces, and run a scene with each of them as the profile of its patch.

    `before` and `after` are the files, `options` tell how they are compared, `base` is the scene with its --set
    strings, and `output` tells where the answer goes.
    """
    scene, sets = base
    if load_scene(scene, sets).contact is None:
        raise UsageError(
            f"compare --scene {scene}: the scene has no [contact], so it has no patch to press; "
            "give the scene of a patch"
        )

    def run_surfaces(*paths: Path):
        """Run the scene with each trace."""
        models = []
        for path in paths:
            profile = (f"contact.profile.file={path.resolve()}", "contact.profile.heights=surface")
            models.append(load_model(scene, (*sets, *profile)))
        return pressing.run_both_surfaces(*models, scene.name, output.report)

    save(
        lambda folder: compared.compare_with_scene(before, after, options, run_surfaces, folder),
        output,
    )
