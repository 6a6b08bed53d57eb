"""The verbs for Python: `new` for a scene to start from, `load` and `build` one, `plan`, `run`, `sweep` or `cost` it,
look at the `Result`; `compare` two measured surfaces.

    import patchfem as pf
    result = pf.run("scene.toml", **{"contact.tilt.angle": "1 mrad"})
    result.measures["loop_area"].value
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields
from difflib import get_close_matches
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from .campaigns import backbone as backbones
from .campaigns import cost as cost_curves
from .campaigns.sweeps import ask, executors
from .campaigns.sweeps import asked as case_models
from .core import Measure, Missing, NotConverged, Outcome, PatchfemError
from .export import backbone as backbone_files
from .export import chosen, fits, histories, shown
from .export import cost as cost_files
from .export import folder as results_folder
from .export import reports as page_of_several
from .export import summary as summaries
from .export.drawing import pictures, swept
from .export.pages import lead, released, words
from .export.surfaces import compare as compared_data
from .export.surfaces import pairs as pairs_data
from .export.surfaces import roughness, worn
from .export.sweeps import folder, page, tables
from .export.sweeps import run as sweep_run
from .mesh import files as mesh_files
from .model.model import Model
from .model.model import build as build_model
from .runs import joint
from .runs.many import many, meshes
from .runs.patch import result as patch_result
from .runs.plan import Plan
from .runs.plan import plan as plan_model
from .runs.results import result as run_result
from .runs.run import run as run_plan
from .scene import axes, starting
from .scene.changed import Base
from .scene.keys.quantities import parse
from .scene.scene import Scene, SceneError, loads, text_of, with_files
from .scene.scene import load as load_file
from .scene.sets import assignments, oversized, sized, texts
from .scene.sets import text_of as tables_text
from .surface.compare import pairs as pairs_tables
from .surface.compare import verdict
from .surface.files import read as surfaces
from .surface.roughness import report as roughness_report

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset

    from .runs.many.answers import Answers

__all__ = ["Measure", "Missing", "Model", "NotConverged", "Outcome", "PatchfemError", "Plan", "Result", "Scene",
           "SceneError", "backbone", "build", "compare", "cost", "demo", "export", "fit", "import_", "load", "mesh",
           "new", "plan", "plot", "profile", "report", "run", "run_many", "sweep", "view"]
TEXT = "<text>"  # the name of a scene that came without a file


def load(scene: str | Path | Scene | Mapping[str, Any], /, **sets: Any) -> Scene:
    """Read a scene from a file, a text or a dict of its tables; SceneError with every mistake at once.

    A str that holds a newline or a bracket is the text of a scene, any other and a Path name a file. sets: keys with
    their values, as ``**{"contact.load": "26 lbf"}``; a text stands as in the scene, a number is in SI, lists are
    taken too. A Scene is read again with the sets added to its own. A length that is a number alone and more than the
    patch is long, or than 1 m, is refused, as somebody meant millimetres; a radius and a text are taken as they are.
    """
    added = assignments(sets)
    if isinstance(scene, Mapping):
        return sized(with_files(loads(tables_text(dict(scene)), TEXT, added)), {**scene, **sets})
    if isinstance(scene, Scene):
        return scene if not added else sized(base_of(scene).changed(added), sets)
    if isinstance(scene, str) and ("\n" in scene or "[" in scene):
        return sized(with_files(loads(scene, TEXT, added)), sets)
    return sized(load_file(_path(scene, "a scene"), added), sets)


def base_of(scene: Scene) -> Base:
    """What scenes that differ from this one in a few keys share; kept for the scene that was asked for last."""
    found = next((one for one in _bases if one.scene is scene), None) or Base(scene)
    _bases[:] = [found]
    return found


_bases: list[Base] = []


def build(scene: str | Path | Scene | Model, /, **sets: Any) -> Model:
    """Everything that a scene means, made once; nothing is solved. `scene` and sets as `load` takes them.

    PatchfemError for sets beside a Model, which is already made.
    """
    if isinstance(scene, Model):
        _without(sets, "Model")
        return scene
    return build_model(load(scene, **sets))


def plan(scene: str | Path | Scene | Model, /, **sets: Any) -> Plan:
    """Plan a scene: what it would run, its sizes, cost, stiffness chain and groups; no physics is computed."""
    return plan_model(build(scene, **sets))


def run(scene: str | Path | Scene | Model | Plan, /, *, say: Callable[[str], None] | None = None,
        progress: Callable[[float], None] | None = None, **sets: Any) -> Result:
    """Run a scene and estimate the errors of its measures; `scene` and sets as `load` takes them.

    say: called with one line where something takes long (compiling); on stderr unless given. progress: called with the
    share that is done: of all passes of a rig, of the main one of a bench. SceneError for mistakes in the scene,
    PatchfemError where it cannot run, NotConverged and Missing among them.
    """
    if isinstance(scene, Plan):
        _without(sets, "Plan")
    what = scene if isinstance(scene, Plan) else plan(scene, **sets)
    done = run_plan(what, _on_stderr if say is None else say, progress)
    return Result(**{one.name: getattr(done, one.name) for one in fields(done)} | {"measures": Measures(done.measures)})


def demo(**sets: Any) -> Result:
    """Run the scene that comes with the program, the rig of the 1985 report at 143 Hz and 5 g; sets as `load` takes
    them."""
    return run(starting.shipped(), **sets)


def new(kind: str, /) -> str:
    """The text of a scene of this kind to start from, which `load` and `run` take: patch, joint, bench, rig, beam,
    damper, shroud, linear, misalignment or wear; PatchfemError for any other word, with those that there are."""
    return starting.text_of(_word(kind, "new"))


def cost(scene: str | Path | Scene | Model, /, *, over: str = "", out: str | Path | None = None,
         say: Callable[[str], None] | None = None, **sets: Any) -> dict[str, Any]:
    """Error against CPU seconds of a scene: knob -> `runs`, `cheapest`, `sentence`, the dict of `patchfem cost --json`.

    scene and sets as `load` takes them. over: one knob (element_size, steps_per_cycle, shear_modes, jumps) in place of
    all that the scene has. Of each run CPU `seconds` and `wall_seconds`, and by measure its `values`, the `errors` that
    it states and its `distances` to the best run, in SI; settings that gave the same run, bit for bit, are one. out: a
    folder for cost.csv and pictures. say: called with one line per run, on
    stderr unless given. {} where the answer is exact; PatchfemError for a knob that the scene does not have.
    """
    model, runs = build(scene, **sets), {}
    for knob in [over] if _word(over, "cost: over") else cost_curves.knobs_of(model):
        runs[knob] = cost_curves.curve(model, knob, _on_stderr if say is None else say)
        if out is not None:
            cost_files.write(Path(out), runs)
            names = cost_files.shown(runs[knob], model.accuracy.tolerance)
            cost_files.write_picture(Path(out), knob, runs[knob], model.accuracy.tolerance, names)
    return {knob: cost_files.answer_of(each, model.accuracy.tolerance) for knob, each in runs.items()}


def backbone(scene: str | Path | Scene | Model, /, *, mode: str = "",
             amplitudes: float | str | Iterable | None = None, method: str = "all", **sets: Any) -> Dataset:
    """Frequency and damping ratio of a mode over its amplitude at the output, with errors, as an xarray.Dataset.

    scene and sets as `load` takes them. mode: its name, of masses its number; the first unless given. amplitudes: one
    or more [m], or a text such as "1 um..1 mm:25"; around where the contact slips unless given. method: "balance",
    "decay", "quasi-static" or "all"; each has variables of its own name over amplitudes of its own. The attributes have
    `free_frequency` and `stuck_frequency` [Hz], `exponent_micro` and `exponent_gross` of the contact's loss,
    `flutter_amplitude` [m], where they are known; `missing`: why a method gave no curve. PatchfemError for a scene
    without a rig or friction, no such mode and amplitudes that are no lengths above 0.
    """
    model = joint.freed(build(scene, **sets))
    ways = backbones.WAYS if _word(method, "backbone: method") == "all" else (method,)
    if unknown := set(ways) - set(backbones.WAYS):
        raise PatchfemError(f"backbone: method {unknown.pop()!r}: one of {', '.join(backbones.WAYS)} or all")
    wanted = None if amplitudes is None else axes.lengths(_lengths(amplitudes), "amplitudes")
    found = backbones.backbone(model, _word(mode, "backbone: mode"), wanted, ways)
    return backbone_files.contents(found, model.source.title).to_xarray()


def sweep(scene: str | Path | Scene, over: Mapping[str, Any] | None = None, /, *, out: str | Path | None = None,
          draw: int = 0, seed: int = 0, sobol: bool = False, jobs: int = 1, executor: str = "",
          resume: bool = False) -> Dataset:
    """Run a scene for all combinations of the values of some keys: the Dataset that sweep.nc holds; its attribute
    `answer` says in a sentence what came out.

    `scene` as `load` takes it. over: key -> list of values, texts as in a scene or numbers in SI, or one text such as
    "1e-6 rad..1e-2 rad:9"; left out, those of its table [sweep]. draw: so many cases in place of all combinations,
    drawn with `seed` between the ends of ranges "1e-6 rad..1e-2 rad", by Sobol's sequence where asked; the cases then
    are rows of one dimension `case`. out: the folder that `patchfem sweep -o` writes, with `resume` gone on with.
    jobs: processes; executor: "dask" or "dask:ADDRESS". A case that is refused or fails has outcome "failed" and its
    message; SceneError where no case is valid.
    """
    if over is not None and not isinstance(over, Mapping):
        raise PatchfemError(f"sweep: over is a dict of key: values, not {over!r:.60}")
    if wrong := oversized(over or {}):
        raise SceneError(wrong)
    asked = case_models.Asked(*_text_of(scene))
    lines = [one if isinstance(one, str) else ",".join(texts(key, one)) for key, one in (over or {}).items()]
    request = ask.Request([f"{key}={line}" for key, line in zip(over or {}, lines)], None, draw, sobol, seed)
    cases, by = ask.cases_of(asked, request), executors.of(executor, jobs)
    place = None if out is None else sweep_run.Place(Path(out), resume)
    found = sweep_run.swept(asked, cases, by, _on_stderr) if out is None else \
        sweep_run.sweep_into(asked, cases, place, by, _on_stderr)
    named = [] if out is None or place.kept(len(cases)) == "none" else cases.names(asked)
    keys = [folder.key_of(name) for name in named]
    answer = lead.lead_of(page.table_of(asked, cases, found, (), Path(out or ""))).answer()
    return tables.contents(asked, cases, found, keys, answer).to_xarray()


class SweepPlots:
    """Pictures of sweeps and backbones, as matplotlib Axes: ``pf.plot.sweep(dataset, "loop_area")``."""

    @staticmethod
    def sweep(dataset: Dataset, measure: str, ax: Axes | None = None) -> Axes:
        """A measure of the Dataset of a sweep over its key with most values, with the numerical errors.

        Hollow points miss the tolerance; values over two decades have a logarithmic axis. ax: Axes to draw on.
        PatchfemError for what is no Dataset of a sweep, and for a measure that it has not.
        """
        if not hasattr(dataset, "coords") or not any(str(name).endswith("_error") for name in dataset):
            raise PatchfemError("plot.sweep: the Dataset of pf.sweep is needed, with measures and their errors")
        figure = swept.draw.figure(dataset, measure, onto=ax)
        return figure.axes[0] if ax is None else ax

    @staticmethod
    def backbone(dataset: Dataset, ax: Axes | None = None) -> Axes:
        """Frequency of a mode over its amplitude by each way, with the errors; beside it, unless on `ax`, its damping
        ratio.

        dataset: of `pf.backbone`; PatchfemError for any other, and for one without a curve.
        """
        ways = [way for way in backbones.WAYS if f"{way.replace('-', '_')}_amplitude" in getattr(dataset, "coords", ())]
        if not ways:
            raise PatchfemError("plot.backbone: the Dataset of pf.backbone with at least one curve is needed"
                                + "".join(f"; {why}" for why in [getattr(dataset, "attrs", {}).get("missing")] if why))
        curves = {way: SimpleNamespace(**{name: dataset[f"{way.replace('-', '_')}_{name}"].values
                                          for name in backbone_files.COLUMNS}) for way in ways}
        figure = pictures.draw.figure(backbone_files.drawn(SimpleNamespace(curves=curves)), onto=ax)
        return figure.axes[0] if ax is None else ax


plot = SweepPlots()


def run_many(models: Iterable[str | Path | Scene | Model], /, *, say: Callable[[str], None] | None = None) -> Answers:
    """Answers of many models, or of scenes as `load` takes them: a column per measure, a place per model.

    Models that share work are run together, with the answers of single runs; patches of one geometry share the mesh
    that serves all of them, as in a sweep. A model that cannot run has outcome "failed" and its message; SceneError
    for a mistake in a scene. One scene or model alone is a list of one.
    """
    if isinstance(models, str | Path | Scene | Model | Mapping) or not isinstance(models, Iterable):
        models = [models]
    return many.answers(meshes.meshed([build(one) for one in models]), say=_on_stderr if say is None else say)


def fit(scene: str | Path | Scene, /, *, to: str | Path = "", free: Mapping[str, Any] | None = None,
        from_patch: bool = False, amplitudes: str | Iterable | None = None, hold: Iterable[str] = (),
        offset: Iterable[str] = (), warm_up: bool = False, leave_out: str = "", starts: int = 8, seed: int = 0,
        unstable: str = "bound", placebo: Iterable[str] = (), resume: bool = False, out: str | Path | None = None,
        say: Callable[[str], None] | None = None, **sets: Any) -> dict[str, Any]:
    """Values of keys of a scene from what was measured, with intervals: the dict that fit.json holds, in SI.

    scene and sets as `load` takes them. to: a loop of a bench, rows of a rig or its frequency and damping over the
    amplitude, a worn depth of a scene with [wear]. free: key -> (low, high), texts as in a scene or numbers in SI, or a
    text such as "0.1..0.6". from_patch: laws of one point from the loops of the scene's own patch in place of both;
    amplitudes: of its slide, [m] or a text such as "0.1 um..10 um:25". hold: rows that are only predicted, such as
    "frequency=135 Hz,150 Hz"; offset, warm_up: of a loop; leave_out: a column of which each value is left out in turn;
    unstable: "bound", "out" or "read", what rows flagged U count as; placebo: values such as
    "structure.mode.yaw.frequency=110 Hz,138 Hz", with each of which a whole fit is made; starts, seed: of the search
    over rows. out: the folder that `patchfem fit -o` writes, with `resume` gone on with. say: called with one line
    where something takes long. SceneError, PatchfemError as `patchfem fit` refuses.
    """
    found, tell = load(scene, **sets), _on_stderr if say is None else say
    if not isinstance(free, Mapping | None):
        raise PatchfemError(f"fit: free is a dict of key: (low, high), not {free!r:.60}")
    asked = [f"{key}={_ends_of(key, ends)}" for key, ends in (free or {}).items()]
    slides = "" if amplitudes is None else _lengths(amplitudes)
    options = fits.Options(_words(hold, "fit: hold"), _words(offset, "fit: offset"), warm_up, leave_out, starts, seed,
                           unstable, _words(placebo, "fit: placebo"), resume, from_patch, slides)
    measured = "" if isinstance(to, str) and not to else str(_path(to, "fit: to"))
    with TemporaryDirectory() as room:
        target = Path(room) / "fit" if out is None else Path(out)
        return fits.fit_into(found, measured, asked, options, target, fits.Heard(tell))


def _ends_of(key: str, ends: Any) -> str:
    """"low..high" of such a text or of two values; PatchfemError for anything else."""
    pair = [ends] if isinstance(ends, str) else texts(key, ends)
    if not isinstance(ends, str) and len(pair) != 2:
        raise PatchfemError(f"fit: free: {key}: (low, high) or a text such as '0.1..0.6' is needed, not {ends!r:.60}")
    return "..".join(pair)


def _lengths(given: float | str | Iterable) -> str:
    """Lengths [m], or a text of them, as the text that an option reads."""
    return given if isinstance(given, str) else ",".join(texts(axes.LENGTH, given))


def _words(given: str | Iterable[str], what: str) -> tuple:
    listed = given if isinstance(given, Iterable) and not isinstance(given, str) else [given]
    return tuple(_word(one, what) for one in listed)


def profile(*files: str | Path, cutoff: float | str | None = None, window: Iterable | None = None,
            tip: float | str | None = None, units: tuple[str, str] | None = None) -> dict[str, Any]:
    """Roughness of measured traces or areal scans: the dict that `patchfem profile --json` prints, in SI.

    cutoff: wavelength that splits roughness from waviness; window: first and last place, of a scan first those of x;
    tip: radius of the stylus; each in m, or a text such as "0.25 mm". units: of x and of z for files that name none.
    `profiles` has a dict per file, `means` those over all. PatchfemError for a file that cannot be read and what is no
    length, of cutoff and tip above zero.
    """
    asked = {"cutoff": _metres(cutoff, "profile: cutoff"), "tip": _metres(tip, "profile: tip"), "window": None}
    if window is not None:
        listed = window.split(",") if isinstance(window, str) else window if isinstance(window, Iterable) else [window]
        asked["window"] = tuple(_metres(one, "profile: window") for one in listed)
    for name in ("cutoff", "tip"):
        if asked[name] is not None and not 0 < asked[name] < float("inf"):
            raise PatchfemError(f"profile: {name}: a length above zero is needed, not {asked[name]:g} m")
    reports = [roughness_report.report_of(surfaces.read_surface(_path(one, "profile"), units), **asked)
               for one in files]
    return {"profiles": [roughness.data_of(one) for one in reports], "means": roughness.means_data(reports)}


def report(folders: str | Path | Iterable[str | Path], /, out: str | Path | None = None, *,
           measured: str | Path | None = None) -> Path:
    """Lay the results folders of a list side by side on one page, of one sweep its own; the path of the page.

    out: the page, report.html unless given. measured: a file of a laboratory, laid over the pictures. PatchfemError for
    folders that do not stand together, and for none.
    """
    return Path(page_of_several.report_of(_paths(folders, "report"), None if out is None else _path(
        out, "report: out"), None if measured is None else _path(measured, "report: measured")))


def export(folder: str | Path, out: str | Path, /, *, frame: int | None = None, histories: bool = False,
           of: str = "") -> Path:
    """Write a results folder, or the structure of a scene (.toml), in another format, by the ending of `out`; its path.

    Fields: .pvd, .vtu, .vtkhdf, .csv (the interface); histories and loops: .uff, .mat, and .csv where `histories` asks
    for them or the folder has no fields; .py: a script that plays the last cycle in ParaView. Of a scene: matrices and
    friction elements, .mat for NLvib, .npz for TMDSimPy and pyHarm. frame: number of the frame of a .vtu or .csv, the
    last one unless given; of: the stress that a script colours, such as "sigma_yy". PatchfemError as `patchfem export`
    refuses.
    """
    folder, out = _path(folder, "export"), _path(out, "export: out")
    if folder.suffix != ".toml":
        chosen.export(folder, out, frame, histories, of)
    elif frame is not None or histories or of:
        raise PatchfemError("frame, histories, of: belong to a results folder; a scene is exported as its structure")
    else:
        from .export.lab import structures  # its folder holds more than words

        structures.export(build(folder), out)
    return out


def view(folder: str | Path, out: str | Path | None = None, /, *, frame: int | None = None,
         magnify: float | None = None) -> None:
    """Show the pieces of a results folder in a window, or draw them into `out`: a picture, or the last cycle as .gif,
    .mp4 or .html; arguments as those of `patchfem view`."""
    chosen.view(_path(folder, "view"), None if out is None else _path(out, "view: out"), frame, magnify)


def import_(file: str | Path, out: str | Path, /, *, map: str | Iterable[str] = (), zero: bool = False,
            decay: bool = False, **how: str) -> dict[str, Any]:
    """Write the records of a laboratory's file (.uff, .mat, .csv) as the table that scenes and fits read (.csv), as
    modes of a scene (.toml) or as a frequency response (.uff): the dict that `patchfem import --json` prints, in SI.

    map: which channel is what, as "force=Load cell [lbf]"; zero: time and displacement count from their first row;
    decay: the record is a free decay; how: the words of segment, window, band and begin, as segment="2 s".
    PatchfemError as `patchfem import` refuses.
    """
    from .export.lab import imported

    file, out, given = _path(file, "import_"), _path(out, "import_: out"), imported.Estimate._fields
    if unknown := set(how) - set(given):
        raise PatchfemError(f"import_: {unknown.pop()}: unknown setting; use map, zero, {', '.join(sorted(given))}")
    words = {name: _word(one, f"import_: {name}") for name, one in how.items()}
    return {"file": str(out), **imported.imported(file, out, _words(map, "import_: map"), zero,
                                                  imported.Estimate(decay=decay, **words))}


def mesh(scene: str | Path | Scene | Model, out: str | Path, /, **sets: Any) -> Path:
    """Write the tagged mesh of the pieces of a scene as .msh or .vtu; its path. PatchfemError without [contact]."""
    model = build(scene, **sets)
    if model.patch is None:
        raise PatchfemError("only a scene with [contact] has a mesh", "contact")
    out = _path(out, "mesh")
    low, high = patch_result.bodies(model)
    mesh_files.write_mesh(low, out, high)
    return out


def compare(*files: str | Path, direction: str = "", units: tuple[str, str] | None = None, shift: float | None = None,
            keep_spikes: bool = False, pairs: str | Path | None = None) -> dict[str, Any]:
    """Compare a measured surface before with the same surface after: the dict that compare.json holds, in SI.

    files: before and after, two traces or two areal scans; then the pair of traces of the other direction. direction:
    "x" or "y", along which the first two run. units: of x and of z for files that name none, as ("mm", "um").
    shift [m]: of two traces whose places are known, 0.0 where both start at one mark. keep_spikes: spikes, dropouts and
    dust stay in. In the dict `verdict` and `sentences` are words; `shift`, `worn_depth_mean`, `amplitude_ratio` and so
    on have `value`, `low`, `high`, `unit`, and a `reason` where the value is None. Two scans have `worn_volume`,
    `grown_volume`, `worn_share` and the `registration` by x, y and rotation. pairs: in place of files a table of
    them, or of results folders, with the columns before and after: `pairs` then has the dict of each pair, `means`
    mean, interval and scatter over them; a pair that fails has its reason as `message`. Two results folders, the second
    of a run with [wear]: what wore off between them, over the whole patch, with the measures of both under `runs`.
    PatchfemError for files that do not fit together.
    """
    how = {"units": units, "shift": _metres(shift, "compare: shift"), "keep_spikes": keep_spikes}
    files = [_path(one, "compare") for one in files]
    _word(direction, "compare: direction")
    if pairs is None and len(files) > 1 and any(Path(one).is_dir() for one in files):
        if len(files) > 2 or direction or units is not None or shift is not None or keep_spikes:
            raise PatchfemError("compare: give two results folders alone, without other files or settings of traces")
        lost = worn.lost(*map(Path, files))
        return worn.data_of(lost, worn.verdict(lost))
    if pairs is None:
        return compared_data.data_of(*verdict.judged(files, direction, **how))
    if files:
        raise PatchfemError("compare: files or a table of pairs are needed, not both")
    return pairs_data.data_of(pairs_data.answers(pairs_tables.read_pairs(_path(pairs, "compare: pairs")), direction,
                                                 **how))


def _text_of(scene: str | Path | Scene) -> tuple[Path, str, tuple]:
    """(path, text, --set strings) of a scene as `load` takes it, whether it is valid or not."""
    if isinstance(scene, Mapping):
        return Path(TEXT), tables_text(dict(scene)), ()
    if isinstance(scene, Scene):
        return scene.path, scene.text, scene.sets
    if isinstance(scene, str) and ("\n" in scene or "[" in scene):
        return Path(TEXT), scene, ()
    return _path(scene, "a scene"), text_of(scene), ()


def _path(given: Any, what: str) -> Path:
    """The path of a file or folder; PatchfemError for anything else."""
    if not isinstance(given, str | Path):
        raise PatchfemError(f"{what}: a path is needed, not {given!r:.60}")
    return Path(given)


def _paths(given: Any, what: str) -> list:
    """The paths of a list, or of one alone."""
    listed = given if isinstance(given, Iterable) and not isinstance(given, str) else [given]
    return [_path(one, what) for one in listed]


def _metres(given: Any, what: str) -> float | None:
    """A length [m], from a number or from a text with its unit; None stays. PatchfemError for anything else."""
    try:
        return parse(given, "length") if isinstance(given, str) else given if given is None else float(given)
    except (TypeError, ValueError) as error:
        raise PatchfemError(f"{what}: " + (str(error) if isinstance(given, str) else
                            f"a length in m or a text such as '0.25 mm' is needed, not {given!r:.60}")) from None


def _word(given: Any, what: str) -> str:
    """A text; PatchfemError for anything else."""
    if not isinstance(given, str):
        raise PatchfemError(f"{what}: a text is needed, not {given!r:.60}")
    return given


def _on_stderr(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _without(sets: dict, kind: str) -> None:
    if sets:
        raise PatchfemError(f"a {kind} is made once: {', '.join(sets)} cannot be set in it; set it in the scene")


class Measures(Mapping):
    """The measures of a run by name, read-only; also as attributes. It shows itself as a table."""

    def __init__(self, measures: dict[str, Measure]):
        self._measures = dict(measures)

    def __getitem__(self, name: str) -> Measure:
        if name in self._measures:
            return self._measures[name]
        near = get_close_matches(str(name), self._measures, 1, 0.6)
        raise KeyError(f"no measure {name!r} in this run; " + (f"did you mean {near[0]!r}?" if near else
                       f"it has {', '.join(self._measures)}"))

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
        return "\n".join(words.table_of({name: summaries.measure_object(one) for name, one in self._measures.items()}))


class Plots:
    """The pictures of a run, each as matplotlib Axes: ``result.plot.loop().figure.savefig("loop.png")``.

    ax: Axes to draw on; without it a new figure is made, whose `axes` may be more than the first one, which is
    returned. A notebook shows them; PatchfemError where the run has nothing to show, with what it lacks.
    """

    def __init__(self, result: Result):
        self._result = result

    def pressure(self, ax: Axes | None = None) -> Axes:
        """Normal stress along the interface; beside it, unless on `ax`, the shear stress where some acts."""
        return self._drawn(ax, ("pressure",), "the scene has no [contact]" if self._result.patch is None else
                           "the pieces do not touch")

    def loop(self, ax: Axes | None = None) -> Axes:
        """Friction force against the slide of the interface."""
        return self._drawn(ax, ("loop",), self._still() or "no friction acted, or nothing slid")

    def history(self, ax: Axes | None = None) -> Axes:
        """Displacement over the whole run; beside it, unless on `ax`, the last cycles or the friction force."""
        return self._drawn(ax, ("history",), self._still())

    def levels(self, ax: Axes | None = None) -> Axes:
        """Amplitude level by level, or along the curve of steady motions over level or frequency."""
        return self._drawn(ax, ("levels", "curve"), self._still() or 'the drive has no levels; use drive.waveform = '
                           '"levels", or a sweep with accuracy.method = "harmonic"')

    def stress(self, ax: Axes | None = None) -> Axes:
        """Von Mises stress in both pieces, pressed; beside it, unless on `ax`, the part around the contact."""
        if self._result.patch is None:
            raise PatchfemError("plot.stress: nothing to draw: the scene has no [contact]")
        from .export.fields import bodies

        with TemporaryDirectory() as room:
            made = bodies.write_fields(self._result, Path(room) / "fields.vtkhdf")
        return self._drawn(ax, ("bodies",), "the pieces do not touch, or their mesh is not a grid", {"bodies": made})

    def _still(self) -> str:
        if self._result.response is not None:
            return ""
        return "a static patch does not move; add [friction] with [slide], or with [structure] and [drive]" \
            if self._result.plan.kind == "patch" else "no motion was computed"

    def _drawn(self, ax: Axes | None, names: tuple, lack: str, more: dict | None = None) -> Axes:
        if ax is not None and not hasattr(ax, "errorbar"):
            raise PatchfemError(f"plot.{names[0]}: matplotlib Axes are needed as ax, not {ax!r:.60}")
        found = shown.axes(self._result, names, ax, more)
        if found is not None:
            return found
        raise PatchfemError(f"plot.{names[0]}: nothing to draw: {lack}")


class Result(run_result.Result):
    """A finished run: `outcome`, `measures`, `warnings`, `notes`, `seconds`, the kept histories in `response`.

    `outcome.sentence` says how it ended; `measures[name]` has `value`, `error`, `unit` and `text`, in SI.
    """

    measures: Measures

    def _repr_html_(self) -> str:
        """The answer as a notebook shows it: outcome, headline, every measure in its group, warnings."""
        summary = summaries.summary_of(self)
        return words.fragment(summary, words.verdict(summary), summaries.cycles_of(self), released.released(self))

    @property
    def notes(self) -> list[str]:
        """Sentences on what the model leaves out."""
        return list(self.extra.get("notes", ()))

    @property
    def plot(self) -> Plots:
        """The pictures of the run: pressure(), stress(), loop(), history(), levels()."""
        return Plots(self)

    def table(self) -> Any:
        """The measures as rows of name, value, error and unit in SI: a pandas.DataFrame where pandas is installed, else
        a list of dicts."""
        rows = [{"measure": name, "value": one.value, "error": one.error, "unit": one.unit}
                for name, one in self.measures.items()]
        try:
            from pandas import DataFrame
        except ImportError:
            return rows
        return DataFrame(rows).set_index("measure")

    def to_xarray(self) -> Dataset:
        """Histories and fields with units and the scene they came from: the Dataset that result.nc holds."""
        return histories.contents(self).to_xarray()

    def save(self, folder: str | Path) -> Path:
        """Write the results folder that `patchfem run -o` writes, and give its path; an older one is replaced.

        PatchfemError for a folder that holds other files.
        """
        folder = _path(folder, "save")
        results_folder.save(self, folder)
        return folder
