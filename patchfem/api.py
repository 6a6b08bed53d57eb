"""The commands as Python functions. `new` gives a scene to start from. `load` and `build` read one. `plan`, `run`,
`sweep` and `cost` compute, and `run` returns a `Result`. `compare` compares two measured surfaces.

    import patchfem as pf
    result = pf.run("scene.toml", **{"contact.tilt.angle": "1 mrad"})
    result.measures["loop_area"].value
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields
from difflib import get_close_matches
from functools import wraps
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from .campaigns import cost as cost_curves
from .campaigns.backbone import curves as backbones
from .campaigns.sweeps import case_models as case_models
from .campaigns.sweeps import executors, parse_request
from .core import Measure, Missing, NotConverged, Outcome, PatchfemError
from .export import backbone as backbone_files
from .export import convert, histories
from .export import cost as cost_files
from .export import folder as results_folder
from .export import report as run_page
from .export import reports as page_of_several
from .export import summary as summaries
from .export.drawing import pictures, swept
from .export.fits import request as fits
from .export.pages import headline, released, sentences
from .export.surfaces import compare as compared_data
from .export.surfaces import pairs as pairs_data
from .export.surfaces import roughness, worn, worn_runs
from .export.sweeps import folder, page, tables
from .export.sweeps import run as sweep_run
from .mesh import files as mesh_files
from .model.model import Model, build_without_sweep
from .model.model import build as build_model
from .runs import joint
from .runs.batch import batches, meshes
from .runs.patch import result as patch_result
from .runs.plan import Plan
from .runs.plan import plan as plan_model
from .runs.results import result as run_result
from .runs.run import run as run_plan
from .scene import axes, starting
from .scene.files import require_files
from .scene.keys import removed
from .scene.keys.quantities import parse_quantity
from .scene.overrides import BaseScene
from .scene.scene import Scene, SceneError, loads
from .scene.scene import load as load_file
from .scene.sets import (
    find_oversized_lengths,
    format_assignments,
    format_scene,
    format_values,
    require_units,
)
from .scene.toml_text import read_text
from .surface.compare import pairs as pairs_tables
from .surface.compare import verdict
from .surface.files import read as surfaces
from .surface.roughness import report as roughness_report

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset

    from .runs.batch.case_results import CaseResults

__all__ = [
    "Measure",
    "Missing",
    "Model",
    "NotConverged",
    "Outcome",
    "PatchfemError",
    "Plan",
    "Result",
    "Scene",
    "SceneError",
    "backbone",
    "build",
    "compare",
    "cost",
    "demo",
    "export",
    "fit",
    "import_",
    "load",
    "mesh",
    "new",
    "plan",
    "plot",
    "profile",
    "report",
    "run",
    "run_many",
    "sweep",
    "view",
]
TEXT, TABLES = "<text>", "<dict>"  # names of a scene that was given as a string, and as a dict
# start of messages that locates a mistake in --set or a dict; a Python program has neither
PLACES = re.compile(rf"^(--set: |{TABLES}(:\d+)?: )", re.MULTILINE)


def _by_key(function: Callable) -> Callable:
    """Decorate a function so that its errors on a dict name only the key, not a file and line."""

    @wraps(function)
    def called(*args: Any, **more: Any) -> Any:
        try:
            return function(*args, **more)
        except PatchfemError as error:
            error.args = tuple(
                PLACES.sub("", one) if isinstance(one, str) else one for one in error.args
            )
            if isinstance(error, SceneError):
                error.mistakes = [PLACES.sub("", one) for one in error.mistakes]
            raise

    return called


def _refuse_removed(function: Callable) -> Callable:
    """Make a function refuse the arguments that were removed, in one sentence."""

    @wraps(function)
    def called(*args: Any, **named: Any) -> Any:
        verb = function.__name__
        for name in named:
            if sentence := removed.describe_removed_option(verb, f"--{name}", f"{verb}: {name}"):
                raise PatchfemError(sentence)
        return function(*args, **named)

    return called


@_by_key
def load(scene: str | Path | Scene | Mapping[str, Any], /, **sets: Any) -> Scene:
    """Read a scene from a file, a text or a dict of its tables.

    A Path, or a str without newline and bracket, is the name of a file; any other str is the text of a scene. A Scene
    is returned with the sets applied. sets: keys with new values, passed as ``**{"contact.load": "26 lbf"}``. A value
    is a text as in the scene, a number in SI, or a list of these. A plain number for a length is refused if it exceeds
    the length of the patch or 1 m, because it was probably meant in millimetres; texts and radii are not checked in
    this way. Raises SceneError, which lists every mistake.
    """
    added = format_assignments(sets)
    if isinstance(scene, Mapping):
        return require_units(
            require_files(loads(format_scene(dict(scene)), TABLES, added)), {**scene, **sets}
        )
    if isinstance(scene, Scene):
        return scene if not added else require_units(base_of(scene).override(added), sets)
    if isinstance(scene, str) and ("\n" in scene or "[" in scene):
        return require_units(require_files(loads(scene, TEXT, added)), sets)
    return require_units(load_file(_path(scene, "a scene"), added), sets)


def base_of(scene: Scene) -> BaseScene:
    """Return the `BaseScene` of a scene, from which scenes with a few other keys are made.

    It is cached for the last scene.
    """
    found = next((one for one in _bases if one.scene is scene), None) or BaseScene(scene)
    _bases[:] = [found]
    return found


_bases: list[BaseScene] = []


@_by_key
def build(scene: str | Path | Scene | Model, /, **sets: Any) -> Model:
    """Build the model of a scene without solving anything. `scene` and sets are those of `load`.

    Raises PatchfemError for sets with a Model, which cannot be changed.
    """
    if isinstance(scene, Model):
        _without(sets, "Model")
        return scene
    return build_model(load(scene, **sets))


@_by_key
def plan(scene: str | Path | Scene | Model, /, **sets: Any) -> Plan:
    """Plan a scene: what a run would compute, its size, its cost, its stiffnesses and dimensionless groups. No result
    is computed.
    """
    return plan_model(build(scene, **sets))


@_by_key
def run(
    scene: str | Path | Scene | Model | Plan,
    /,
    *,
    say: Callable[[str], None] | None = None,
    progress: Callable[[float], None] | None = None,
    **sets: Any,
) -> Result:
    """Run a scene and estimate the errors of its measures. `scene` and sets are those of `load`.

    say: function that takes one line of text, called before steps that take long, such as compiling; default: print to
    stderr. progress: function that takes the completed share of the run, from 0 to 1. Raises SceneError for mistakes in
    the scene, and PatchfemError (also NotConverged and Missing) if the scene cannot be run.
    """
    if isinstance(scene, Plan):
        _without(sets, "Plan")
    what = scene if isinstance(scene, Plan) else plan(scene, **sets)
    done = run_plan(what, _on_stderr if say is None else say, progress)
    return Result(
        **{one.name: getattr(done, one.name) for one in fields(done)}
        | {"measures": Measures(done.measures)}
    )


def demo(**sets: Any) -> Result:
    """Run the scene that comes with the program: the rig of the 1985 report at 143 Hz and 5 g. sets are those of
    `load`.
    """
    return run(starting.find_shipped_scene(), **sets)


def new(kind: str, /) -> str:
    """Return the text of a scene to start from, for `load` and `run`.

    kind: patch, joint, bench, rig, beam, damper, shroud, linear, misalignment or wear. Raises PatchfemError for any
    other kind.
    """
    return starting.read_template(_word(kind, "new"))


def cost(
    scene: str | Path | Scene | Model,
    /,
    *,
    over: str = "",
    out: str | Path | None = None,
    say: Callable[[str], None] | None = None,
    **sets: Any,
) -> dict[str, Any]:
    """Measure error against CPU seconds of a scene for several tolerances: the dict of `patchfem cost --json`.

    scene and sets are those of `load`. over: one setting (element_size, steps_per_cycle, shear_modes, jumps) instead of
    the tolerance. out: folder for cost.csv and the picture. say: function that takes one line of text per run; default:
    print to stderr.

    The dict has the entry "tolerance", or that of the setting, with `runs`. Each run has its `label`, `tolerance`, CPU
    `seconds`, `wall_seconds`, the `worst` measure with its error (relative to what a tolerance of 1 would allow),
    `meets_tolerance`, the `remedies` of its warnings, and by measure its `values` and its stated `errors` in SI. Runs
    with a setting that was tried because a tolerance was missed have the same `tolerance`. For one setting there are
    also `distances` from the best run, `cheapest` and `sentence`, and settings that gave bit-identical runs are listed
    as one. Raises PatchfemError for a setting that the scene does not have.
    """
    model, runs = build(scene, **sets), {}
    for knob in [over] if _word(over, "cost: over") else [cost_curves.TOLERANCE]:
        runs[knob] = cost_curves.curve(model, knob, _on_stderr if say is None else say)
        if out is not None:
            cost_files.write(Path(out), runs)
            cost_files.write_picture(Path(out), knob, runs[knob], model.accuracy.tolerance)
    return {
        knob: cost_files.answer_of(knob, each, model.accuracy.tolerance)
        for knob, each in runs.items()
    }


def backbone(
    scene: str | Path | Scene | Model,
    /,
    *,
    mode: str = "",
    amplitudes: float | str | Iterable | None = None,
    method: str = "all",
    **sets: Any,
) -> Dataset:
    """Compute frequency and damping ratio of a mode against its amplitude at the output, with errors: an
    xarray.Dataset.

    scene and sets are those of `load`. mode: name of the mode, or its number for a rig of masses; default: the first.
    amplitudes: one or more in m, or a text such as "1 um..1 mm:25"; default: around the amplitude at which the contact
    slips. method: "balance", "decay", "quasi-static" or "all". Each method has its own variables and amplitudes in the
    Dataset. Attributes are `free_frequency` and `stuck_frequency` [Hz], the exponents of the energy dissipated per
    cycle `exponent_micro` and `exponent_gross`, and `flutter_amplitude` [m], where they are known. `missing` says why a
    method gave no curve. Raises PatchfemError for a scene without rig or friction, an unknown mode and amplitudes that
    are not positive lengths.
    """
    model = joint.without_joint(build(scene, **sets))
    ways = backbones.METHODS if _word(method, "backbone: method") == "all" else (method,)
    if unknown := set(ways) - set(backbones.METHODS):
        raise PatchfemError(
            f"backbone: method {unknown.pop()!r} does not exist; use one of "
            f"{', '.join(backbones.METHODS)}, or 'all'"
        )
    wanted = None if amplitudes is None else axes.read_lengths(_lengths(amplitudes), "amplitudes")
    found = backbones.backbone(model, _word(mode, "backbone: mode"), wanted, ways)
    return backbone_files.contents(found, model.source.title).to_xarray()


@_by_key
def sweep(
    scene: str | Path | Scene,
    over: Mapping[str, Any] | None = None,
    /,
    *,
    out: str | Path | None = None,
    draw: int = 0,
    seed: int = 0,
    sobol: bool = False,
    of: str = "",
    jobs: int = 1,
    executor: str = "",
    resume: bool = False,
) -> Dataset:
    """Run a scene for all combinations of the values of some keys: the Dataset of sweep.nc.

    `scene` is that of `load`. over: dict of key -> list of values (texts as in a scene, or numbers in SI) or a range
    such as "1e-6 rad..1e-2 rad:9"; default: the table [sweep] of the scene. draw: number of cases to draw between the
    ends of ranges such as "1e-6 rad..1e-2 rad", instead of all combinations. The draw is random, with the seed `seed`,
    or follows Sobol's sequence if `sobol` is true. Drawn cases are rows of one dimension `case`. out: folder to write,
    as `patchfem sweep -o` does; `resume` continues it. of: the measure that the printed answer states, such as
    "equivalent_damping". jobs: number of processes. executor: "dask" or "dask:ADDRESS".

    The attribute `answer` states the main result in one sentence. A case that is refused or fails has the outcome
    "failed" and its message. Raises SceneError if no case is valid.
    """
    if over is not None and not isinstance(over, Mapping):
        raise PatchfemError(
            f"sweep: `over` must be a dict of keys and their values, not {over!r:.60}"
        )
    if wrong := find_oversized_lengths(over or {}):
        raise SceneError(wrong)
    if empty := [
        key for key, one in (over or {}).items() if hasattr(one, "__len__") and not len(one)
    ]:
        raise SceneError([f"{key}: the sweep has no value for this key" for key in empty])
    asked = case_models.Asked(*_text_of(scene), of=of)
    lines = [
        one if isinstance(one, str) else ",".join(format_values(key, one))
        for key, one in (over or {}).items()
    ]
    request = parse_request.Request(
        [f"{key}={line}" for key, line in zip(over or {}, lines)], None, draw, sobol, seed, of
    )
    cases, by = parse_request.cases_of(asked, request), executors.of(executor, jobs)
    place = None if out is None else sweep_run.Place(Path(out), resume)
    found = (
        sweep_run.swept(asked, cases, by, _on_stderr)
        if out is None
        else sweep_run.sweep_into(asked, cases, place, by, _on_stderr)
    )
    named = [] if out is None or place.kept(len(cases)) == "none" else cases.names(asked)
    keys = [folder.key_of(name) for name in named]
    answer = headline.lead_of(page.table_of(asked, cases, found, (), Path(out or ""))).answer()
    return tables.contents(asked, cases, found, keys, answer).to_xarray()


class SweepPlots:
    """Pictures of sweeps and backbones, as matplotlib Axes: ``pf.plot.sweep(dataset, "loop_area")``."""

    @staticmethod
    def sweep(dataset: Dataset, measure: str, ax: Axes | None = None) -> Axes:
        """Plot a measure of a sweep, with its numerical errors, against the key that has most values.

        Hollow points miss the tolerance. An axis is logarithmic if its values span more than two decades. ax: Axes to
        draw on. Raises PatchfemError for a Dataset that does not come from a sweep, and for a measure that the Dataset
        does not contain.
        """
        if not hasattr(dataset, "coords") or not any(
            str(name).endswith("_error") for name in dataset
        ):
            raise PatchfemError(
                "plot.sweep: a Dataset returned by pf.sweep is needed, with measures and their errors"
            )
        figure = pictures.draw.figure([swept.sweep_chart(dataset, measure)], onto=ax)
        return figure.axes[0] if ax is None else ax

    @staticmethod
    def backbone(dataset: Dataset, ax: Axes | None = None) -> Axes:
        """Plot the frequency of a mode against its amplitude for each method, with errors, and its damping ratio.

        With `ax`, the damping ratio is left out. dataset: the result of `pf.backbone`. Raises PatchfemError for any
        other Dataset, and for one without a curve.
        """
        known = getattr(dataset, "coords", ())
        ways = [way for way in backbones.METHODS if f"{way.replace('-', '_')}_amplitude" in known]
        if not ways:
            raise PatchfemError(
                "plot.backbone: a Dataset returned by pf.backbone is needed, with at least one curve"
                + "".join(
                    f"; {why}" for why in [getattr(dataset, "attrs", {}).get("missing")] if why
                )
            )
        curves = {
            way: SimpleNamespace(
                **{
                    name: dataset[f"{way.replace('-', '_')}_{name}"].values
                    for name in backbone_files.COLUMNS
                }
            )
            for way in ways
        }
        figure = pictures.draw.figure(backbone_files.drawn(curves), onto=ax)
        return figure.axes[0] if ax is None else ax


plot = SweepPlots()


def run_many(
    models: Iterable[str | Path | Scene | Model], /, *, say: Callable[[str], None] | None = None
) -> CaseResults:
    """Run many models, or scenes as for `load`: the result has a column per measure and a row per model.

    Models that share work are computed together, with the same results as single runs. Patches of equal geometry share
    one mesh, as in a sweep. A model that cannot be run has the outcome "failed" and its message. A single scene or
    model counts as a list of one. Raises SceneError for a mistake in a scene.
    """
    if isinstance(models, str | Path | Scene | Model | Mapping) or not isinstance(models, Iterable):
        models = [models]
    return batches.solve_models(
        meshes.with_shared_meshes([build(one) for one in models]),
        say=_on_stderr if say is None else say,
    )


def fit(
    scene: str | Path | Scene,
    /,
    *,
    to: str | Path = "",
    free: Mapping[str, Any] | None = None,
    from_patch: bool = False,
    amplitudes: str | Iterable | None = None,
    hold: Iterable[str] = (),
    offset: Iterable[str] = (),
    warm_up: bool = False,
    leave_out: str = "",
    starts: int | None = None,
    seed: int = 0,
    unstable: str = "bound",
    placebo: Iterable[str] = (),
    resume: bool = False,
    out: str | Path | None = None,
    say: Callable[[str], None] | None = None,
    **sets: Any,
) -> dict[str, Any]:
    """Find values of keys of a scene from measurements, with intervals: the dict of fit.json, in SI.

    scene and sets are those of `load`. to: file of the measurements, which are a friction loop for a bench; rows of
    responses, or frequency and damping against amplitude, for a rig; or a worn depth for a scene with [wear]. free:
    dict of key -> (low, high) or a text such as "0.1..0.6". hold: rows to predict without fitting them, such as
    "frequency=135 Hz,150 Hz". leave_out: a column; each of its values is left out in turn. unstable: "bound", "out" or
    "read", the treatment of rows with the flag U (unstable). placebo: values such as
    "structure.mode.yaw.frequency=110 Hz,138 Hz", for each of which the whole fit is repeated. starts, seed: number
    of starting points and their seed. offset, warm_up: options for a loop. out: folder to write, as `patchfem fit -o`
    does; `resume` continues it. say: function that takes a line of text before steps that take long.

    from_patch: instead of `to` and `free`, replace the patch of the scene by laws of a single point, fitted to the
    patch's own loops. amplitudes: amplitudes of the slide for from_patch, in m or as a text such as "0.1 um..10 um:25".

    Raises SceneError or PatchfemError in the same cases as `patchfem fit`.
    """
    found, tell = load(scene, **sets), _on_stderr if say is None else say
    if not isinstance(free, Mapping | None):
        raise PatchfemError(
            f"fit: `free` must be a dict of keys and their ranges (low, high), not {free!r:.60}"
        )
    asked = [f"{key}={_ends_of(key, ends)}" for key, ends in (free or {}).items()]
    slides = "" if amplitudes is None else _lengths(amplitudes)
    options = fits.Options(
        _words(hold, "fit: hold"),
        _words(offset, "fit: offset"),
        warm_up,
        leave_out,
        starts,
        seed,
        unstable,
        _words(placebo, "fit: placebo"),
        resume,
        from_patch,
        slides,
    )
    measured = "" if isinstance(to, str) and not to else str(_path(to, "fit: to"))
    with TemporaryDirectory() as room:
        target = Path(room) / "fit" if out is None else Path(out)
        return fits.fit_into(found, measured, asked, options, target, fits.Listener(tell)).answer


def _ends_of(key: str, ends: Any) -> str:
    """Return the string "low..high" of two values or of a range given as a string.

    Raises PatchfemError for anything else.
    """
    pair = [ends] if isinstance(ends, str) else format_values(key, ends)
    if not isinstance(ends, str) and len(pair) != 2:
        raise PatchfemError(
            f"fit: free: {key}: (low, high) or a text such as '0.1..0.6' is needed, not {ends!r:.60}"
        )
    return "..".join(pair)


def _lengths(given: float | str | Iterable) -> str:
    """Return lengths [m] as the string that a command-line option reads."""
    return given if isinstance(given, str) else ",".join(format_values(axes.LENGTH_KEY, given))


def _words(given: str | Iterable[str], what: str) -> tuple:
    listed = given if isinstance(given, Iterable) and not isinstance(given, str) else [given]
    return tuple(_word(one, what) for one in listed)


@_refuse_removed
def profile(
    *files: str | Path,
    cutoff: float | str | None = None,
    window: Iterable | None = None,
    units: tuple[str, str] | None = None,
) -> dict[str, Any]:
    """Compute the roughness of measured traces or areal scans: the dict of `patchfem profile --json`, in SI.

    cutoff: wavelength that separates roughness from waviness. window: first and last position; for a scan those in x
    first. Each is in m or a text such as "0.25 mm". units: units of x and z for files that give none. The dict has
    `profiles` with an entry per file and `means` over all files. Raises PatchfemError for a file that cannot be read
    and for invalid lengths.
    """
    asked = {"cutoff": _metres(cutoff, "profile: cutoff"), "window": None}
    if window is not None:
        listed = (
            window.split(",")
            if isinstance(window, str)
            else window
            if isinstance(window, Iterable)
            else [window]
        )
        asked["window"] = tuple(_metres(one, "profile: window") for one in listed)
    length = asked["cutoff"]
    if length is not None and not 0 < length < float("inf"):
        raise PatchfemError(f"profile: cutoff: a length above zero is needed, not {length:g} m")
    reports = [
        roughness_report.make_report(surfaces.read_surface(_path(one, "profile"), units), **asked)
        for one in files
    ]
    return {
        "profiles": [roughness.data_of(one) for one in reports],
        "means": roughness.means_data(reports),
    }


@_refuse_removed
def report(folders: str | Path | Iterable[str | Path], /, out: str | Path | None = None) -> Path:
    """Put the results folders of a list side by side on one page and return the path of the page. For a single sweep,
    rebuild the page of the sweep.

    out: the page, default report.html. Raises PatchfemError for an empty list and for folders that cannot be compared.
    """
    target = None if out is None else _path(out, "report: out")
    return Path(page_of_several.report_of(_paths(folders, "report"), target))


def export(
    folder: str | Path,
    out: str | Path,
    /,
    *,
    frame: int | None = None,
    histories: bool = False,
    of: str = "",
) -> Path:
    """Write a results folder, or the structure of a scene (.toml), in another format, and return the path.

    The ending of `out` gives the format. Fields: .pvd, .vtu, .vtkhdf or .csv (the interface). Histories and loops:
    .uff, .mat, or .csv with `histories` or if the folder has no fields. A script that plays the last cycle in ParaView:
    .py. Matrices and friction elements of a scene: .mat for NLvib, .npz for TMDSimPy and pyHarm. frame: number of the
    frame of a .vtu or .csv, default the last. of: the stress that a script shows, such as "sigma_yy". Raises
    PatchfemError in the same cases as `patchfem export`.
    """
    folder, out = _path(folder, "export"), _path(out, "export: out")
    if folder.suffix != ".toml":
        convert.export(folder, out, frame, histories, of)
    elif frame is not None or histories or of:
        raise PatchfemError(
            "the options `frame`, `histories` and `of` can be used only with a results folder; from a "
            "scene only the "
            "structure is exported"
        )
    else:
        from .export.lab import structures  # its folder holds more than words

        structures.export(build_without_sweep(load(folder)), out)
    return out


def view(
    folder: str | Path,
    out: str | Path | None = None,
    /,
    *,
    frame: int | None = None,
    magnify: float | None = None,
) -> None:
    """Show the pieces of a results folder in a window, or draw them into the file `out`.

    `out` is a picture, or the last cycle as .gif, .mp4 or .html. The arguments are those of `patchfem view`.
    """
    convert.view(
        _path(folder, "view"), None if out is None else _path(out, "view: out"), frame, magnify
    )


def import_(
    file: str | Path,
    out: str | Path,
    /,
    *,
    map: str | Iterable[str] = (),
    zero: bool = False,
    decay: bool = False,
    **how: str,
) -> dict[str, Any]:
    """Convert laboratory records (.uff, .mat, .csv): the dict of `patchfem import --json`, in SI.

    The ending of `out` gives the result: a table that scenes and fits read (.csv), modes for a scene (.toml) or a
    frequency response (.uff). map: the quantity of each channel, such as "force=Load cell [lbf]". zero: subtract the
    first row from time and displacement. decay: the record is a free decay. how: the options segment, window, band and
    begin as texts, such as segment="2 s". Raises PatchfemError in the same cases as `patchfem import`.
    """
    from .export.lab import imported

    file, out, given = _path(file, "import_"), _path(out, "import_: out"), imported.Estimate._fields
    if unknown := set(how) - set(given):
        raise PatchfemError(
            f"import_: {unknown.pop()}: unknown setting; use map, zero, {', '.join(sorted(given))}"
        )
    words = {name: _word(one, f"import_: {name}") for name, one in how.items()}
    return {
        "file": str(out),
        **imported.imported(
            file, out, _words(map, "import_: map"), zero, imported.Estimate(decay=decay, **words)
        ),
    }


def mesh(scene: str | Path | Scene | Model, out: str | Path, /, **sets: Any) -> Path:
    """Write the tagged mesh of the pieces of a scene as .msh or .vtu and return its path.

    Raises PatchfemError without [contact].
    """
    model = build(scene, **sets)
    if model.patch is None:
        raise PatchfemError("only a scene with [contact] has a mesh", "contact")
    out = _path(out, "mesh")
    low, high = patch_result.bodies(model)
    mesh_files.write_mesh(low, out, high)
    return out


def compare(
    *files: str | Path,
    direction: str = "",
    units: tuple[str, str] | None = None,
    shift: float | None = None,
    keep_spikes: bool = False,
    pairs: str | Path | None = None,
    datum: str = "",
) -> dict[str, Any]:
    """Compare a measured surface before and after wear: the dict of compare.json, in SI.

    files: the surface before and the surface after wear, as two traces or two areal scans; optionally a second pair of
    traces in the other direction. direction: "x" or "y", along which the first two traces run. units: units of x and z
    for files that give none, such as ("mm", "um"). shift: known shift of the second trace [m], 0.0 if both start at the
    same mark. keep_spikes: do not remove spikes, dropouts and dust. datum: "straight" if the datum of the instrument is
    known to be straight, so that no bow is subtracted from traces. pairs: a table of pairs instead of files, with the
    columns before and after.

    In the dict, `verdict` and `sentences` are texts. `shift`, `worn_depth_mean`, `amplitude_ratio` and others have
    `value`, `low`, `high`, `unit`, and a `reason` if the value is None. Two scans also have `worn_volume`,
    `grown_volume`, `worn_share` and the `registration` in x, y and rotation. With `pairs` the dict has `pairs`, an
    entry per pair, and `means` with mean, interval and scatter; a pair that fails has its reason as `message`. For the
    results folders of two runs, the second with [wear], the dict has the wear between the two runs over the whole
    patch, and the measures of both runs under `runs`. Raises PatchfemError for files that do not fit together.
    """
    how = {
        "units": units,
        "shift": _metres(shift, "compare: shift"),
        "keep_spikes": keep_spikes,
        "datum": datum,
    }
    files = [_path(one, "compare") for one in files]
    _word(direction, "compare: direction")
    _word(datum, "compare: datum")
    if pairs is None and len(files) > 1 and any(Path(one).is_dir() for one in files):
        if (
            len(files) > 2
            or direction
            or units is not None
            or shift is not None
            or keep_spikes
            or datum
        ):
            raise PatchfemError(
                "compare: give two results folders alone, without other files or settings of traces"
            )
        lost = worn_runs.compare_runs(*map(Path, files))
        return worn.data_of(lost, worn.verdict(lost))
    if pairs is None:
        return compared_data.data_of(*verdict.judge_files(files, direction, **how))
    if files:
        raise PatchfemError("compare: give either files or a table of pairs, not both")
    return pairs_data.data_of(
        pairs_data.answers(
            pairs_tables.read_pairs(_path(pairs, "compare: pairs")), direction, **how
        )
    )


def _text_of(scene: str | Path | Scene) -> tuple[Path, str, tuple]:
    """Return path, text and --set strings of a scene that `load` takes, valid or not."""
    if isinstance(scene, Mapping):
        return Path(TABLES), format_scene(dict(scene)), ()
    if isinstance(scene, Scene):
        return scene.path, scene.text, scene.sets
    if isinstance(scene, str) and ("\n" in scene or "[" in scene):
        return Path(TEXT), scene, ()
    return _path(scene, "a scene"), read_text(scene), ()


def _path(given: Any, what: str) -> Path:
    """Return a file or folder as a Path; raise PatchfemError for anything else."""
    if not isinstance(given, str | Path):
        needed = "a path, a text, a dict of tables or a Scene" if what == "a scene" else "a path"
        raise PatchfemError(f"{what}: {needed} is needed, not {given!r:.60}")
    return Path(given)


def _paths(given: Any, what: str) -> list:
    """Return the paths of a list, or a single path as a list."""
    listed = given if isinstance(given, Iterable) and not isinstance(given, str) else [given]
    return [_path(one, what) for one in listed]


def _metres(given: Any, what: str) -> float | None:
    """Return a length [m] from a number or a string with a unit, or None if it is None.

    Raises PatchfemError for anything else.
    """
    try:
        return (
            parse_quantity(given, "length")
            if isinstance(given, str)
            else given
            if given is None
            else float(given)
        )
    except (TypeError, ValueError) as error:
        raise PatchfemError(
            f"{what}: "
            + (
                str(error)
                if isinstance(given, str)
                else f"a length in m or a text such as '0.25 mm' is needed, not {given!r:.60}"
            )
        ) from None


def _word(given: Any, what: str) -> str:
    """Return a value that must be a string; raise PatchfemError for anything else."""
    if not isinstance(given, str):
        raise PatchfemError(f"{what}: a text is needed, not {given!r:.60}")
    return given


def _on_stderr(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _without(sets: dict, kind: str) -> None:
    if sets:
        raise PatchfemError(
            f"{', '.join(sets)} cannot be set in a {kind}; set the value in the scene"
        )


class Measures(Mapping):
    """The measures of a run by name or as attributes, read-only. A notebook shows them as a table."""

    def __init__(self, measures: dict[str, Measure]):
        self._measures = dict(measures)

    def __getitem__(self, name: str) -> Measure:
        if name in self._measures:
            return self._measures[name]
        near = get_close_matches(str(name), self._measures, 1, 0.6)
        raise KeyError(
            f"no measure {name!r} in this run; "
            + (f"did you mean {near[0]!r}?" if near else f"it has {', '.join(self._measures)}")
        )

    def __getattr__(self, name: str) -> Measure:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(*error.args) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._measures)

    def __len__(self) -> int:
        return len(self._measures)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._measures]

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._measures)

    def __repr__(self) -> str:
        return "\n".join(
            sentences.table_of(
                {name: summaries.measure_object(one) for name, one in self._measures.items()}
            )
        )


class Plots:
    """The pictures of a run, each as matplotlib Axes: ``result.plot.loop().figure.savefig("loop.png")``.

    ax: Axes to draw on. Without it each method makes a new figure, which may have more Axes than the method returns.
    Raises PatchfemError if the run does not have what the picture needs.
    """

    def __init__(self, result: Result):
        self._result = result

    def pressure(self, ax: Axes | None = None) -> Axes:
        """Normal stress along the interface, and the shear stress if there is any; if interfaces have patches of their
        own, the normal stress on each. With `ax`, only the first of these charts is drawn.
        """
        bare = self._result.patch is None and not self._result.extra.get("faces")
        return self._drawn(
            ax,
            ("pressure", "faces"),
            "the scene has no [contact]" if bare else "the pieces do not touch",
        )

    def loop(self, ax: Axes | None = None) -> Axes:
        """Friction force against the slide of the interface."""
        return self._drawn(ax, ("loop",), self._still() or "no friction acted, or nothing slid")

    def history(self, ax: Axes | None = None) -> Axes:
        """Displacement over the whole run, and the last cycles or the friction force. With `ax`, only the
        displacement is drawn.
        """
        return self._drawn(ax, ("history",), self._still())

    def levels(self, ax: Axes | None = None) -> Axes:
        """Amplitude at each level, or along the curve of steady states against level or frequency."""
        return self._drawn(
            ax,
            ("levels", "curve"),
            self._still()
            or "the drive has no levels; use drive.waveform = "
            '"levels", or a sweep with accuracy.method = "harmonic"',
        )

    def stress(self, ax: Axes | None = None) -> Axes:
        """Von Mises stress in both pieces under load, and an enlarged view of the contact. With `ax`, only the
        pieces are drawn.
        """
        if self._result.patch is None:
            raise PatchfemError("plot.stress: nothing to draw: the scene has no [contact]")
        from .export.fields import bodies

        with TemporaryDirectory() as room:
            made = bodies.write_fields(self._result, Path(room) / "fields.vtkhdf")
        return self._drawn(
            ax, ("bodies",), "the pieces do not touch, or their mesh is not a grid", made
        )

    def _still(self) -> str:
        if self._result.response is not None:
            return ""
        return (
            "a static patch does not move; add [friction] with [slide], or with [structure] and [drive]"
            if self._result.plan.kind == "patch"
            else "no motion was computed"
        )

    def _drawn(self, ax: Axes | None, names: tuple, lack: str, bodies: dict | None = None) -> Axes:
        if ax is not None and not hasattr(ax, "errorbar"):
            raise PatchfemError(
                f"plot.{names[0]}: matplotlib Axes are needed as ax, not {ax!r:.60}"
            )
        found = run_page.axes(self._result, names, ax, bodies)
        if found is not None:
            return found
        raise PatchfemError(f"plot.{names[0]}: nothing to draw: {lack}")


class Result(run_result.Result):
    """A finished run: `outcome`, `measures`, `warnings`, `notes`, `seconds`, and the stored histories in `response`.

    `outcome.sentence` says how the run ended. `measures[name]` has `value`, `error`, `unit` and `text`, in SI.
    """

    measures: Measures

    def _repr_html_(self) -> str:
        """The answer as a notebook shows it: outcome, headline, every measure in its group, warnings."""
        summary = summaries.summary_of(self)
        return sentences.fragment(
            summary, sentences.verdict(summary), summaries.cycles_of(self), released.released(self)
        )

    @property
    def notes(self) -> list[str]:
        """Sentences on what the model neglects."""
        return list(self.extra.get("notes", ()))

    @property
    def plot(self) -> Plots:
        """The pictures of the run: pressure(), stress(), loop(), history(), levels()."""
        return Plots(self)

    def table(self) -> Any:
        """The measures as rows of name, value, error and unit in SI.

        It is a pandas.DataFrame if pandas is installed, otherwise a list of dicts.
        """
        rows = [
            {"measure": name, "value": one.value, "error": one.error, "unit": one.unit}
            for name, one in self.measures.items()
        ]
        try:
            from pandas import DataFrame
        except ImportError:
            return rows
        return DataFrame(rows).set_index("measure")

    def to_xarray(self) -> Dataset:
        """The Dataset of result.nc: histories and fields with units, and the scene."""
        return histories.contents(self).to_xarray()

    def save(self, folder: str | Path) -> Path:
        """Write the results folder, as `patchfem run -o` does, and return its path. An older results folder is
        replaced.

        Raises PatchfemError for a folder that holds other files.
        """
        folder = _path(folder, "save")
        results_folder.save(self, folder)
        return folder
