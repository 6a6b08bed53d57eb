"""The commands of the command line as Python functions.

    import patchfem as pf
    result = pf.run("scene.toml", **{"contact.tilt.angle": "1 mrad"})
    result.measures["loop_area"].value

`new` returns a template scene; `load` and `build` read a scene. `plan`, `run`, `sweep`, `backbone`, `cost` and `fit`
perform computations; `run` returns a `Result`. `profile` and `compare` evaluate measured surfaces. `report`, `view`,
`export`, `import_` and `mesh` read and write files. A test executes the examples of the docstrings.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, replace
from difflib import get_close_matches
from functools import partial, wraps
from html import escape
from numbers import Integral
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from .campaigns import cost as cost_curves
from .campaigns import numerical_settings
from .campaigns.backbone import cost as backbone_cost
from .campaigns.backbone import given_modes
from .campaigns.backbone import request as backbone_requests
from .campaigns.fits import request as fit_requests
from .campaigns.fits.options import FitOptions
from .campaigns.sweeps import case_models as case_models
from .campaigns.sweeps import executors, parse_request
from .core import Measure, Missing, NotConverged, Outcome, PatchfemError
from .export import (
    backbones,
    convert,
    costs,
    fits,
    netcdf,
    page,
    pieces,
    run_folder,
    runs,
    show,
    store,
)
from .export.charts import axes as chart_axes
from .export.fields import grids
from .export.folder import Folder
from .export.surfaces import compare as compared
from .export.surfaces import roughness, worn
from .export.sweeps import dataset as sweep_datasets
from .export.sweeps import run as sweep_run
from .formatting import format_quantity
from .mesh import files as mesh_files
from .model.model import Model, build_without_sweep
from .model.model import build as build_model
from .runs.batch import batches
from .runs.patch import result as patch_result
from .runs.plan import Plan, plan_first_case
from .runs.plan import plan as plan_model
from .runs.results import result as run_result
from .runs.run import run as run_plan
from .scene import assignments, starting
from .scene.backbone_scene import BackboneTables
from .scene.files import require_files
from .scene.keys.quantities import parse_quantity
from .scene.keys.removed import describe_removed, refuse_removed
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
from .surface.compare import compare as surface_comparison

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame
    from xarray import Dataset

    from .runs.batch.case_results import CaseResults

__all__ = [
    "FitOptions",
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
INLINE_SCENE_NAME = "<text>"  # displayed file name of a scene that is given as a string
DICT_NAME = "<dict>"  # displayed file name of a scene that is given as a dict
# location prefix of an error in an option --set or --over or in a scene text, which is meaningless to Python callers
LOCATION_PATTERN = re.compile(rf"^(--(set|over): |{DICT_NAME}(:\d+)?: )", re.MULTILINE)


def _make_verb(function: Callable) -> Callable:
    """Decorate a function so that it refuses removed options, and its messages name the key without file and line.

    Callers who give the keys from Python have written no such file.
    """
    verb = function.__name__.removesuffix("_")

    def strip_file_and_line(message: Any) -> Any:
        """Remove the location at the start of each line of a message."""
        return LOCATION_PATTERN.sub("", message) if isinstance(message, str) else message

    @wraps(function)
    def call_with_short_errors(*args: Any, **keywords: Any) -> Any:
        """Call the function, and remove the locations from its error messages."""
        refuse_removed(verb, keywords)
        try:
            return function(*args, **keywords)
        except PatchfemError as error:
            error.args = tuple(map(strip_file_and_line, error.args))
            if isinstance(error, SceneError):
                error.mistakes = list(map(strip_file_and_line, error.mistakes))
            raise

    return call_with_short_errors


@_make_verb
def load(scene: str | Path | Scene | Mapping[str, Any], /, **sets: Any) -> Scene:
    """Read a scene from a file, from its text, or from a dict of its tables.

    Parameters
    ----------
    scene : path, str, dict or Scene
        A Path, or a str without newline and bracket, is the name of a file. Any other str is the text of a scene. A Scene
        is returned with the new values.
    **sets
        Keys with new values, passed as ``**{"contact.load": "26 lbf"}``. A value is a string as in a scene file, a number
        in SI units, or a list of these. A number for a length is rejected if it exceeds the length of the patch or 1 m,
        because it was probably meant in millimetres; strings and radii are not checked in this way.

    Returns
    -------
    Scene
        Scene with validated values in SI units.

    Raises
    ------
    SceneError
        If the scene is invalid; it lists all errors.

    Examples
    --------
    >>> import patchfem as pf
    >>> scene = pf.load(pf.new("bench"), **{"normal.load": "26 lbf"})
    >>> scene.kind, round(scene.normal.load, 2)
    ('bench', 115.65)
    """
    if not isinstance(scene, Scene):
        return _load_and_prepare(scene, None, sets)
    new_sets = format_assignments(sets)
    if not new_sets:
        return scene
    return require_units(get_base_scene(scene).override(new_sets), sets)


def _load_and_prepare(scene, prepare: Callable | None, sets: dict) -> Scene:
    """Read a scene, and let a function change its raw values before they are validated.

    `scene` and `sets` are as for `load`; `prepare` may be None.
    """
    new_sets = format_assignments(sets)
    if isinstance(scene, Mapping):
        text = format_scene(dict(scene))
        loaded = require_files(loads(text, DICT_NAME, new_sets, prepare=prepare))
        return require_units(loaded, {**scene, **sets})
    if isinstance(scene, Scene):
        all_sets = (*scene.sets, *new_sets)
        return require_units(loads(scene.text, scene.path, all_sets, prepare=prepare), sets)
    if _is_scene_text(scene):
        loaded = require_files(loads(scene, INLINE_SCENE_NAME, new_sets, prepare=prepare))
        return require_units(loaded, sets)
    path = _require_path(scene, "a scene")
    return require_units(load_file(path, new_sets, prepare=prepare), sets)


def _is_scene_text(scene: Any) -> bool:
    """Return whether a scene is given as its text, rather than as a file name."""
    return isinstance(scene, str) and ("\n" in scene or "[" in scene)


def get_base_scene(scene: Scene) -> BaseScene:
    """Return the `BaseScene` of a scene, from which variants with changed keys are derived.

    The result for the last scene is cached.
    """
    for base_scene in _cached_base_scenes:
        if base_scene.scene is scene:
            return base_scene
    _cached_base_scenes[:] = [BaseScene(scene)]
    return _cached_base_scenes[0]


# cached BaseScene of the last scene, at most one
_cached_base_scenes: list[BaseScene] = []


@_make_verb
def build(scene: str | Path | Scene | Model, /, **sets: Any) -> Model:
    """Build the model of a scene without solving anything.

    Parameters
    ----------
    scene : path, str, dict, Scene or Model
        As for `load`. A Model is returned unchanged.
    **sets
        Keys with new values, as for `load`.

    Returns
    -------
    Model
        Model of the scene; `run_many` accepts a list of models.

    Raises
    ------
    SceneError
        If the scene is invalid.
    PatchfemError
        If a file of the scene cannot be used, or if new values are given with a Model.

    Examples
    --------
    >>> import patchfem as pf
    >>> model = pf.build(pf.new("patch"))
    >>> model.kind, round(model.nominal_load, 2)
    ('patch', 115.65)
    """
    if isinstance(scene, Model):
        _reject_keys(sets, "Model")
        return scene
    return build_model(load(scene, **sets))


@_make_verb
def plan(scene: str | Path | Scene | Model, /, **sets: Any) -> Plan:
    """Choose the engine of a run, and count its unknowns, without solving anything.

    The plan of a scene with a table [sweep] is that of its first case, which `run` refuses.

    Parameters
    ----------
    scene : path, str, dict, Scene or Model
        As for `build`.
    **sets
        Keys with new values, as for `load`.

    Returns
    -------
    Plan
        Its string is the output of `patchfem plan`; `run` accepts a Plan.

    Raises
    ------
    SceneError
        If the scene is invalid.
    PatchfemError
        If the scene cannot be run.

    Examples
    --------
    >>> import patchfem as pf
    >>> plan = pf.plan(pf.new("rig"))
    >>> plan.kind, plan.unknowns["modes"]
    ('rig', 1)
    """
    return plan_first_case(
        build(scene, **sets) if isinstance(scene, Model) else load(scene, **sets)
    )


@_make_verb
def run(
    scene: str | Path | Scene | Model | Plan,
    /,
    *,
    say: Callable[[str], None] | None = None,
    progress: Callable[[float], None] | None = None,
    **sets: Any,
) -> Result:
    """Run a scene and estimate the errors of its measures.

    Parameters
    ----------
    scene : path, str, dict, Scene, Model or Plan
        As for `load`, or the result of `build` or `plan`.
    say : callable, optional
        Function that is called with a line of text before slow steps such as compilation. Default: print to stderr.
    progress : callable, optional
        Function that is called with the completed fraction of the run, from 0 to 1.
    **sets
        Keys with new values, as for `load`.

    Returns
    -------
    Result
        Outcome, measures with numerical errors, and time histories.

    Raises
    ------
    SceneError
        If the scene is invalid.
    PatchfemError
        If the scene cannot be run. `NotConverged` and `Missing` are subclasses.

    Examples
    --------
    >>> import patchfem as pf
    >>> result = pf.run(pf.new("bench"))
    >>> result.outcome.value, round(result.measures["friction_force_peak"].value, 3)
    ('done', 34.5)
    """
    if isinstance(scene, Plan):
        _reject_keys(sets, "Plan")
    scene_plan = scene if isinstance(scene, Plan) else plan_model(build(scene, **sets))
    result = run_plan(scene_plan, _print_to_stderr if say is None else say, progress)
    # the public class adds plots and tables to the result, and attribute access to its measures
    values = {field.name: getattr(result, field.name) for field in fields(result)}
    return Result(**values | {"measures": Measures(result.measures)})


def demo(**sets: Any) -> Result:
    """Run the bundled example scene, the rig of the 1985 report at 143 Hz and 5 g.

    Parameters
    ----------
    **sets
        Keys with new values, as for `load`.

    Returns
    -------
    Result

    Raises
    ------
    SceneError
        If a key or a value does not exist.

    Examples
    --------
    >>> import patchfem as pf
    >>> result = pf.demo(**{"accuracy.tolerance": 0.05})
    >>> print(result.outcome)
    steady
    """
    return run(starting.find_shipped_scene(), **sets)


def new(kind: str, /) -> str:
    """Return the text of a template scene, which `load` and `run` accept.

    Parameters
    ----------
    kind : str
        "patch", "area", "joint", "bench", "rig", "beam", "damper", "shroud", "linear", "misalignment" or "wear".

    Returns
    -------
    str

    Raises
    ------
    PatchfemError
        If there is no template of this kind.

    Examples
    --------
    >>> import patchfem as pf
    >>> pf.new("bench").splitlines()[0]
    'title = "A friction loop of one contact point"'
    """
    return starting.read_template(_require_string(kind, "new"))


def cost(
    scene: str | Path | Scene | Model,
    /,
    *,
    over: str = "",
    backbone: bool = False,
    out: str | Path | None = None,
    say: Callable[[str], None] | None = None,
    **sets: Any,
) -> dict[str, Any]:
    """Measure numerical error against CPU time for several tolerances and over the mesh or the steps.

    Parameters
    ----------
    scene : path, str, dict, Scene or Model
        As for `build`.
    over : str, optional
        Only setting to vary: "element_size", "cells", "steps_per_cycle", "shear_modes" or "jumps".
    backbone : bool, optional
        Measure the backbone of the first mode at up to five amplitudes, in place of the run of the scene.
    out : path, optional
        Folder for cost.csv and the page. Default: no files are written.
    say : callable, optional
        Function that is called with a line of text for each run. Default: print to stderr.
    **sets
        Keys with new values, as for `load`.

    Returns
    -------
    dict
        The output of `patchfem cost --json`: an entry "tolerance", and one with the name of the setting, each with the list
        `runs`; and the list `convergence` with the finest value, the observed order and the relative `changes` of each
        measure. Each run has its `label`, `tolerance`, CPU `seconds`, `wall_seconds`, the `worst` measure with its error
        (relative to the allowed error at a tolerance of 1), `meets_tolerance`, the advice from its warnings as `remedies`,
        and for each measure its value in `values` and its error estimate in `errors`, in SI units. The entry of a setting
        has `sentence`.

    Raises
    ------
    SceneError
        If the scene is invalid.
    PatchfemError
        If the scene does not have the setting.

    Examples
    --------
    >>> import patchfem as pf
    >>> curve = pf.cost(pf.new("bench"), over="steps_per_cycle", say=lambda line: None)
    >>> coarsest = curve["steps_per_cycle"]["runs"][0]
    >>> coarsest["label"], coarsest["meets_tolerance"]
    ('200', True)
    """
    if backbone:
        model = given_modes.prepare_model(_make_backbone_builder(scene, sets), "", ()).model
    else:
        model = build(scene, **sets)
    subject = backbone_cost.make_backbone_subject(model) if backbone else cost_curves.RUN
    over = numerical_settings.SCENE_KEYS.get(_require_string(over, "cost: over"), over)
    report = _print_to_stderr if say is None else say
    curves = cost_curves.compute_costs(model, over, report, subject)
    answer = costs.make_cost_answer(curves, model, subject.notes)
    if out is not None:
        _save(lambda _: answer, out)
    return answer.details


def _save(make_answer: Callable[[Path], Any], out: str | Path) -> Any:
    """Write the answer of a study with its page into the folder `out`, and return it.

    `make_answer` computes the answer. It is called with the path of the folder while that is being written.
    """
    with Folder(Path(out)) as folder:
        answer = make_answer(folder.path)
        store.write_answer(answer, folder.path)
        page.write_report(folder.path)
    return answer


def backbone(
    scene: str | Path | Scene | Model,
    /,
    *,
    mode: str = "",
    amplitudes: float | str | Iterable | None = None,
    forces: float | str | Iterable | None = None,
    over: Mapping[str, Any] | None = None,
    method: str = "",
    modes: str | Iterable = "",
    **sets: Any,
) -> Dataset:
    """Compute frequency and damping ratio of a mode, and the force of its phase resonance, against its amplitude.

    Every value has an estimate of its numerical error. The recommended curve has a band, which holds this error and the
    difference between both methods.

    Parameters
    ----------
    scene : path, str, dict, Scene or Model
        As for `build`. The tables [slide] and [drive] are ignored.
    mode : str, optional
        Name of the mode, or its number for a rig of masses. Default: the first mode.
    amplitudes : float, str or list, optional
        One or more amplitudes [m] at the output, or a string such as "1 um..1 mm:25". Default: a range around the
        amplitude at which the contact slips, with more points where the damping changes fast.
    forces : float, str or list, optional
        One or more forces [N] at the output that hold the phase resonance, in place of the amplitudes.
    over : dict, optional
        One key with its values, such as {"contact.load": ["3.2 kN", "4 kN"]}: the variables have the dimension `case`.
    method : str
        "balance" or "quasi-static". Default: both.
    modes : str or list, optional
        Modes that replace those of the scene, such as "120 Hz:0.01, 170 Hz:0.02" (frequency with the bolted joint,
        damping ratio, and optionally the participation `slide`), or a list of tuples such as ("120 Hz", 0.01).
    **sets
        Keys with new values, as for `load`.

    Returns
    -------
    xarray.Dataset
        Variables and amplitudes of each method. Those with the prefix "band" are limits of the recommended curve. The
        attributes, where they are known, are:

        - `free_frequency`, `stuck_frequency`: frequency without the contact and with a sticking contact [Hz].
        - `exponent_micro`, `exponent_gross`: exponents of the energy dissipated per cycle in micro-slip and gross slip.
        - `flutter_amplitude`: amplitude above which the mode gains energy [m].
        - `method`: name of the recommended method.
        - `advice`: text on where each method is valid.
        - `missing`: reason why a method has no curve.
        - `notes`: list of sentences. xarray reads a list with one sentence from a netCDF file as a string.

    Raises
    ------
    SceneError
        If the scene is invalid.
    PatchfemError
        If the scene has no rig or no friction, if the mode is unknown, or if the amplitudes are not positive lengths.

    Examples
    --------
    >>> import patchfem as pf
    >>> law = {"friction.law": "elastic-plastic", "friction.bond_length": "1 um"}
    >>> curves = pf.backbone(pf.new("rig"), amplitudes="0.1 um..10 um:5", method="quasi-static", **law)
    >>> curves["quasi_static_frequency"].size
    5
    """
    if not isinstance(modes, str) and isinstance(modes, Iterable):
        # an iterator can be read only once, but each value of `over` has the same modes
        modes = list(modes)
    if isinstance(scene, Model) and (modes or over):
        raise PatchfemError(
            f"backbone: {'modes' if modes else 'over'} cannot be given with a Model; give the scene"
        )

    # values become texts as on the command line, with the unit of a key of the same kind
    texts = []
    for values, kind in ((amplitudes, "length"), (forces, "force")):
        key = assignments.POSITIVE_KEYS[kind][0]
        texts.append("" if values is None else format_values(key, values))
        if values is not None and not texts[-1]:
            raise PatchfemError(
                "backbone: the list of amplitudes or forces is empty; give values, or leave it out"
            )
    if len(over or {}) > 1:
        raise PatchfemError("backbone: `over` must have one key with its values")

    request = backbone_requests.BackboneRequest(
        _require_string(mode, "backbone: mode"),
        *texts,
        _require_string(method, "backbone: method"),
        modes,
        "".join(f"{key}={format_values(key, values)}" for key, values in (over or {}).items()),
    )
    return netcdf.to_dataset(backbones.compute_answer(_make_backbone_builder(scene, sets), request))


def _make_backbone_builder(scene, changes: Mapping[str, Any]) -> Callable[..., Model]:
    """Return the function that builds the model of a scene with the tables of a backbone.

    `scene` and `changes`, keys with new values, are as for `load`. A Model is built already.
    """

    def build_with(tables: BackboneTables, sets: tuple[str, ...] | None) -> Model:
        """Build the model of the scene with the tables of a backbone.

        `sets` are `key=value` strings of a case. None stands for the scene as written, without other values.
        """
        if isinstance(scene, Model):
            return build(scene, **changes)
        if sets is None:
            written = replace(scene, sets=()) if isinstance(scene, Scene) else scene
            return build_model(_load_and_prepare(written, tables, {}))
        values = {**changes, **dict(text.split("=", 1) for text in sets)}
        return build_model(_load_and_prepare(scene, tables, values))

    return build_with


@_make_verb
def sweep(
    scene: str | Path | Scene,
    over: Mapping[str, Any] | None = None,
    /,
    *,
    out: str | Path | None = None,
    draw: int = 0,
    seed: int = 0,
    sobol: bool = False,
    jobs: int = 1,
    executor: str = "",
    resume: bool = False,
) -> Dataset:
    """Run a scene for all combinations of the values of some keys.

    Parameters
    ----------
    scene : path, str, dict or Scene
        As for `load`.
    over : dict, optional
        Values of each key: a list of values (strings as in a scene, or numbers in SI units) or a range such as
        "1e-6 rad..1e-2 rad:9". Default: the table [sweep] of the scene.
    out : path, optional
        Output folder, as for `patchfem sweep -o`. Default: no files are written.
    draw : int
        Number of random cases within ranges such as "1e-6 rad..1e-2 rad", instead of all combinations. The Dataset then
        has a single dimension `case`.
    seed : int
        Seed of the random numbers.
    sobol : bool
        Whether the random cases form a Sobol sequence instead of independent samples.
    jobs : int
        Number of processes.
    executor : str
        "dask" for a Dask cluster on this machine, or "dask:ADDRESS" for that of a scheduler.
    resume : bool
        Whether to continue the sweep in the folder `out`.

    Returns
    -------
    xarray.Dataset
        Measures and their errors, as in sweep.nc. The attribute `answer` summarises the main result in one sentence. A
        case that is invalid or fails has the outcome "failed" and an error message.

    Raises
    ------
    SceneError
        If no case is valid.
    PatchfemError
        If an option cannot be used.

    Examples
    --------
    >>> import patchfem as pf
    >>> dataset = pf.sweep(pf.new("bench"), {"friction.static": [0.1, 0.2, 0.3]})
    >>> dataset["friction_force_peak"].values.round(1).tolist()
    [11.5, 23.0, 34.5]
    """
    if not isinstance(over, Mapping | None):
        raise PatchfemError(
            f"sweep: `over` must be a dict of keys and their values, not {over!r:.60}"
        )
    values_by_key = over or {}
    mistakes = find_oversized_lengths(values_by_key)
    for key, values in values_by_key.items():
        if hasattr(values, "__len__") and not len(values):
            mistakes.append(f"{key}: the sweep has no value for this key")
    if mistakes:
        raise SceneError(mistakes)

    # the cases are those of the command line, whose words the answer names
    sweep_scene = _read_sweep_scene(scene)
    ranges = [f"{key}={format_values(key, values)}" for key, values in values_by_key.items()]
    request = parse_request.CaseRequest(ranges, None, draw, sobol, seed)
    command = runs.make_command("sweep", sweep_scene.path, sweep_scene.sets, request.list_options())
    cases = replace(parse_request.read_cases(sweep_scene, request), command=command)

    pool = executors.make_executor(executor, jobs)
    if out is None:
        answer = sweep_run.compute_in_memory(sweep_scene, cases, pool, _print_to_stderr)
    else:
        target = sweep_run.SweepTarget(Path(out), resume)
        answer = sweep_run.sweep_into(sweep_scene, cases, target, pool, _print_to_stderr)
    return sweep_datasets.to_dataset(answer)


class SweepPlots:
    """Plots of sweeps, of backbone curves and of results folders as matplotlib Axes.

    The instance `patchfem.plot` is used as in ``pf.plot.sweep(dataset, "loop_area")``.
    """

    @staticmethod
    def sweep(dataset: Dataset, measure: str, ax: Axes | None = None) -> Axes:
        """Plot a measure of a sweep against the key with the most values, with error bars.

        Crosses mark cases that did not settle, with their steady estimate where it counts. An axis whose values span more
        than two decades is logarithmic.

        Parameters
        ----------
        dataset : xarray.Dataset
            Result of `pf.sweep`.
        measure : str
            Name of the measure, such as "loop_area".
        ax : matplotlib.axes.Axes, optional
            Axes to draw on. Default: a new figure.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        PatchfemError
            If the Dataset is not the result of a sweep or does not contain the measure.

        Examples
        --------
        >>> import patchfem as pf
        >>> dataset = pf.sweep(pf.new("bench"), {"friction.static": [0.1, 0.2, 0.3]})
        >>> axes = pf.plot.sweep(dataset, "loop_area")
        >>> axes.figure.savefig("loop_area.png")
        """
        return sweep_datasets.draw_sweep(dataset, measure, ax)

    @staticmethod
    def backbone(dataset: Dataset, ax: Axes | None = None) -> Axes:
        """Plot frequency, damping ratio and force of a mode against its amplitude, for each method.

        The recommended curve is the first one, with its band.

        Parameters
        ----------
        dataset : xarray.Dataset
            Result of `pf.backbone`.
        ax : matplotlib.axes.Axes, optional
            Axes for the frequency; damping ratio and force are then omitted. Default: a new figure with all three.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        PatchfemError
            If the Dataset is not the result of `pf.backbone` or contains no curve.

        Examples
        --------
        >>> import patchfem as pf
        >>> law = {"friction.law": "elastic-plastic", "friction.bond_length": "1 um"}
        >>> curves = pf.backbone(pf.new("rig"), amplitudes="0.1 um..10 um:5", method="quasi-static", **law)
        >>> pf.plot.backbone(curves).figure.savefig("backbone.png")
        """
        return backbones.draw_backbone(dataset, ax)

    @staticmethod
    def folder(folder: str | Path, title: str = "", ax: Axes | None = None) -> Axes:
        """Plot charts of the page of a results folder, which any command has written.

        Parameters
        ----------
        folder : path
            Results folder.
        title : str
            Title of the chart on the page. Default: all charts.
        ax : matplotlib.axes.Axes, optional
            Axes to draw the first chart on. Default: a new figure.

        Returns
        -------
        matplotlib.axes.Axes
            Axes of the first chart.

        Raises
        ------
        PatchfemError
            If the folder has no results, or no chart with this title.

        Examples
        --------
        >>> import patchfem as pf
        >>> folder = pf.run(pf.new("bench")).save("bench")
        >>> pf.plot.folder(folder, "Energy").figure.savefig("energy.png")
        """
        answer = store.read_answer(_require_path(folder, "plot.folder"))
        titles = chart_axes.list_titles(answer)
        if not titles or title not in ("", *titles):
            raise PatchfemError(
                f"plot.folder: {folder} has no chart {title!r}; its charts are {', '.join(titles) or 'none'}"
            )
        return chart_axes.draw_charts(answer, (title,) if title else (), ax, "plot.folder")


plot = SweepPlots()


def run_many(
    models: Iterable[str | Path | Scene | Model], /, *, say: Callable[[str], None] | None = None
) -> CaseResults:
    """Run several scenes or models, and return their measures as arrays with one element per model.

    Similar models are computed together in batches, with the same results as single runs.

    Parameters
    ----------
    models : list of path, str, dict, Scene or Model
        As for `build`. A single scene or model is accepted as well.
    say : callable, optional
        Function that is called with a line of text before slow steps. Default: print to stderr.

    Returns
    -------
    CaseResults
        `values` and `errors` of each measure, and the `outcome` of each model. A model that cannot be run has the outcome
        "failed" and an error message.

    Raises
    ------
    SceneError
        If a scene is invalid.

    Examples
    --------
    >>> import patchfem as pf
    >>> scenes = [pf.load(pf.new("bench"), **{"friction.static": value}) for value in (0.1, 0.2)]
    >>> pf.run_many(scenes).values["friction_force_peak"].round(1).tolist()
    [11.5, 23.0]
    """
    if isinstance(models, str | Path | Scene | Model | Mapping) or not isinstance(models, Iterable):
        models = [models]
    return batches.solve_models(
        [build(model) for model in models], report=_print_to_stderr if say is None else say
    )


@_make_verb
def fit(
    scene: str | Path | Scene,
    data: str | Path = "",
    options: FitOptions | None = None,
    /,
    *,
    free: Mapping[str, Any] | None = None,
    out: str | Path | None = None,
    say: Callable[[str], None] | None = None,
    **keywords: Any,
) -> dict[str, Any]:
    r"""Fit parameters of a scene to measurements, with 95 % confidence intervals.

    Parameters
    ----------
    scene : path, str, dict or Scene
        As for `load`.
    data : path
        File of the measurements: a friction loop for a bench; a table of responses, or frequency and damping against
        amplitude, for a rig; a worn depth for a scene with [wear].
    options : FitOptions, optional
        Validation rows, and the number of starting points of the search.
    free : dict
        Range of each free parameter by its key: (low, high), or a string such as "0.1..0.6".
    out : path, optional
        Output folder, as for `patchfem fit -o`. Default: no files are written.
    say : callable, optional
        Function that is called with a line of text before slow steps. Default: print to stderr.
    **keywords
        Keys with new values, as for `load`. A field of `FitOptions`, such as ``starts=4``, overrides that of `options`;
        ``to`` is an alias of `data`.

    Returns
    -------
    dict
        The contents of fit.json, in SI units. `values` contains the `value` and the interval `low`, `high` of each key.

    Raises
    ------
    SceneError
        If the scene is invalid, or if a key of `free` does not exist.
    PatchfemError
        If the measurements cannot be read or are of the wrong kind for the scene.

    Examples
    --------
    >>> from pathlib import Path
    >>> import patchfem as pf
    >>> run = pf.run(pf.new("bench")).response
    >>> rows = zip(run.time.tolist(), run.slide.tolist(), run.force.tolist())
    >>> lines = ["time [s],displacement [m],force [N]", *(f"{t},{x},{f}" for t, x, f in rows)]
    >>> _ = Path("loop.csv").write_text("\n".join(lines))
    >>> fitted = pf.fit(pf.new("bench"), "loop.csv", free={"friction.static": (0.1, 0.6)})
    >>> round(fitted["values"]["friction.static"]["value"], 6)
    0.3
    """
    names = {field.name for field in fields(FitOptions)}
    changes = {name: value for name, value in keywords.items() if name in names}
    sets = {key: value for key, value in keywords.items() if key not in names | {"to"}}
    loaded = load(scene, **sets)
    if not isinstance(free, Mapping | None):
        raise PatchfemError(
            f"fit: `free` must be a dict of keys and their ranges (low, high), not {free!r:.60}"
        )
    ranges = [_format_bounds(key, ends) for key, ends in (free or {}).items()]
    options = _check_fit_options(FitOptions() if options is None else options, changes)
    data = keywords.get("to", data)
    data_path = "" if isinstance(data, str) and not data else str(_require_path(data, "fit: to"))
    listener = fit_requests.Listener(_print_to_stderr if say is None else say)
    compute = partial(fits.compute_answer, loaded, data_path, ranges, options, listener)
    if out is not None:
        return _save(compute, out).details
    with TemporaryDirectory() as temporary_folder:
        return compute(Path(temporary_folder)).details


def _check_fit_options(options: Any, changes: dict) -> FitOptions:
    """Return the options of a fit in the form of the command line, with some fields replaced.

    `changes` maps field names to new values. Raises PatchfemError for values of the wrong type.
    """
    if not isinstance(options, FitOptions):
        raise PatchfemError(f"fit: options: FitOptions are needed, not {options!r:.60}")
    options = replace(options, **changes)
    return replace(options, hold=_require_strings(options.hold, "fit: hold"))


def _format_bounds(key: str, ends: Any) -> str:
    """Return the key of a free parameter and its bounds as for --free.

    `ends` is a pair of values, or a text. Raises PatchfemError for anything else.
    """
    is_pair = hasattr(ends, "__len__") and len(ends) == 2
    if not (is_pair or isinstance(ends, str)):
        raise PatchfemError(
            f"fit: free: {key}: (low, high) or a text such as '0.1..0.6' is needed, not {ends!r:.60}"
        )
    return f"{key}={format_values(key, ends, '..')}"


def profile(
    *files: str | Path,
    cutoff: float | str | None = None,
    window: Iterable | None = None,
    units: tuple[str, str] | None = None,
) -> dict[str, Any]:
    """Compute the roughness of measured traces or areal scans.

    Parameters
    ----------
    *files : path
        Files of traces or scans.
    cutoff : float or str, optional
        Cutoff wavelength between roughness and waviness [m], or a string such as "0.25 mm".
    window : list, optional
        First and last position [m] of the evaluated section, as numbers or strings, or as one string with a comma. For a
        scan, the limits in x come before those in y.
    units : tuple of str, optional
        Units of x and z for files without units, such as ("mm", "um").

    Returns
    -------
    dict
        The output of `patchfem profile --json`, in SI units: `profiles` with an entry for each file, and `means` over all
        files.

    Raises
    ------
    PatchfemError
        If a file cannot be read or a length is invalid.

    Examples
    --------
    >>> import numpy as np
    >>> import patchfem as pf
    >>> x = np.arange(0.0, 8.0, 0.001)
    >>> z = np.random.default_rng(1).normal(size=x.size)
    >>> np.savetxt("trace.csv", np.c_[x, z], delimiter=",", header="x [mm],z [um]", comments="")
    >>> roughness = pf.profile("trace.csv", cutoff="0.8 mm")
    >>> len(roughness["profiles"])
    1
    """

    length = _parse_length(cutoff, "profile: cutoff")
    limits = None
    if window is not None:
        positions = [window]
        if isinstance(window, str):
            positions = window.split(",")
        elif isinstance(window, Iterable):
            positions = window
        limits = tuple(_parse_length(position, "profile: window") for position in positions)
    if length is not None and not 0 < length < float("inf"):
        raise PatchfemError(f"profile: cutoff: a length above zero is needed, not {length:g} m")
    paths = [_require_path(file, "profile") for file in files]
    return roughness.answer_files(paths, units, cutoff=length, window=limits).details


def report(folders: str | Path | Iterable[str | Path], /, out: str | Path | None = None) -> Path:
    """Make the page of a results folder again, or a page that shows several folders side by side.

    Parameters
    ----------
    folders : path or list of path
        Results folders.
    out : path, optional
        File of the page. Default: report.html in the folder, or in the current folder for several.

    Returns
    -------
    Path
        File of the page.

    Raises
    ------
    PatchfemError
        If the list is empty or the folders cannot be compared.

    Examples
    --------
    >>> import patchfem as pf
    >>> soft = pf.run(pf.new("bench")).save("soft")
    >>> stiff = pf.run(pf.new("bench"), **{"friction.bond_length": "0.1 um"}).save("stiff")
    >>> pf.report([soft, stiff], "both.html").name
    'both.html'
    """
    target = None if out is None else _require_path(out, "report: out")
    return page.write_report(*_require_paths(folders, "report"), out=target)


def export(
    folder: str | Path,
    out: str | Path,
    /,
    *,
    frame: int | None = None,
    histories: bool = False,
) -> Path:
    """Convert a results folder, or the structure of a scene (.toml), to another file format.

    Parameters
    ----------
    folder : path
        Results folder, or a scene file.
    out : path
        Output file, whose extension determines the format. Fields: .pvd, .vtu, .vtkhdf or .csv (interface only). Time
        histories and loops: .uff, .mat, or .csv with `histories` or if the folder has no fields. Matrices and friction
        elements of a scene: .mat.
    frame : int, optional
        Index of the frame of a .vtu or .csv file. Default: the last frame.
    histories : bool
        Whether to write time histories to a .csv file even if the folder has fields.

    Returns
    -------
    Path
        Output file.

    Raises
    ------
    PatchfemError
        In the same cases as `patchfem export`, such as a format that the folder has no data for.

    Examples
    --------
    >>> import patchfem as pf
    >>> folder = pf.run(pf.new("bench")).save("bench")
    >>> pf.export(folder, "histories.csv").read_text().startswith("time")
    True
    """
    folder = _require_path(folder, "export")
    out = _require_path(out, "export: out")
    if folder.suffix != ".toml":
        convert.export_results(folder, out, frame, histories)
    elif frame is not None or histories:
        raise PatchfemError(
            "the options `frame` and `histories` can be used only with a results folder"
        )
    else:
        from .export.lab import structures

        structures.export_structure(build_without_sweep(load(folder)), out)
    return out


def view(
    folder: str | Path,
    out: str | Path | None = None,
    /,
    *,
    frame: int | None = None,
    magnify: float | None = None,
) -> None:
    """Show the pieces of a results folder in a window, or write an image or an animation of them.

    Parameters
    ----------
    folder : path
        Results folder of a scene with [contact].
    out : path, optional
        Image file (.png), or animation of the last cycle (the whole slide of a bench) as .gif, .mp4 or .html. Default:
        show a window.
    frame : int, optional
        Index of the frame. Default: the last frame.
    magnify : float, optional
        Magnification of the displayed displacements.

    Raises
    ------
    PatchfemError
        If the folder has no fields, or if an option does not apply to the format.

    Examples
    --------
    >>> import patchfem as pf
    >>> folder = pf.run(pf.new("patch"), **{"accuracy.tolerance": 0.05}).save("patch")
    >>> pf.view(folder, "patch.html")
    """
    target = None if out is None else _require_path(out, "view: out")
    convert.view_results(_require_path(folder, "view"), target, frame, magnify)


@_make_verb
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
    r"""Convert a laboratory record (.uff, .mat, .csv) to a file for scenes and fits.

    Parameters
    ----------
    file : path
        Laboratory record.
    out : path
        Output file, whose extension determines its contents: a table (.csv) or modes for a scene (.toml).
    map : str or list of str
        Quantity of each channel, such as "force=Load cell [lbf]".
    zero : bool
        Whether to subtract the first row from time and displacement.
    decay : bool
        Whether the record is a free decay.
    **how
        Options `band` and `begin` as strings, such as begin="2 s".

    Returns
    -------
    dict
        The output of `patchfem import --json`, in SI units.

    Raises
    ------
    PatchfemError
        In the same cases as `patchfem import`, such as a channel without a known quantity.

    Examples
    --------
    >>> from pathlib import Path
    >>> import patchfem as pf
    >>> _ = Path("shaker.csv").write_text("time [ms],force [lbf]\n0,1\n1,2\n2,-1\n")
    >>> pf.import_("shaker.csv", "record.csv", zero=True)["rows"]
    3
    """
    from .export.lab import imported

    file = _require_path(file, "import_")
    out = _require_path(out, "import_: out")
    names = imported.EstimateOptions._fields
    if unknown := set(how) - set(names):
        raise PatchfemError(
            f"import_: {unknown.pop()}: unknown setting; use map, zero, {', '.join(sorted(names))}"
        )
    texts = {name: _require_string(value, f"import_: {name}") for name, value in how.items()}
    estimate = imported.EstimateOptions(decay=decay, **texts)
    channels = _require_strings(map, "import_: map")
    return {"file": str(out), **imported.convert_file(file, out, channels, zero, estimate)}


def mesh(scene: str | Path | Scene | Model, out: str | Path, /, **sets: Any) -> Path:
    """Write the finite-element mesh of both pieces of a scene, with tagged regions.

    Parameters
    ----------
    scene : path, str, dict, Scene or Model
        As for `build`.
    out : path
        Output file with the extension .msh or .vtu.
    **sets
        Keys with new values, as for `load`.

    Returns
    -------
    Path
        Output file.

    Raises
    ------
    SceneError
        If the scene is invalid.
    PatchfemError
        If the scene has no [contact].

    Examples
    --------
    >>> import patchfem as pf
    >>> pf.mesh(pf.new("patch"), "pieces.vtu", **{"contact.element_size": "1 mm"}).name
    'pieces.vtu'
    """
    model = build(scene, **sets)
    if model.patch is None:
        raise PatchfemError("only a scene with [contact] has a mesh", "contact")
    out = _require_path(out, "mesh")
    lower, upper = patch_result.make_piece_meshes_of_run(model)
    mesh_files.write_mesh(lower, out, upper)
    return out


def compare(
    *files: str | Path,
    direction: str = "",
    units: tuple[str, str] | None = None,
    shift: float | None = None,
    keep_spikes: bool = False,
    pairs: str | Path | None = None,
    datum: str = "",
    predicted: str | Path | None = None,
    piece: str = "",
    cutoff: float | None = None,
) -> dict[str, Any]:
    """Compare a measured surface before and after wear.

    Parameters
    ----------
    *files : path
        Surface before and after wear, as two traces or two areal scans. Alternatively the results folders of two runs, the
        second one with [wear].
    direction : str
        Direction of the traces, "x" or "y".
    units : tuple of str, optional
        Units of x and z for files without units, such as ("mm", "um").
    shift : float or str, optional
        Known shift of the second trace [m]. It is 0.0 if both start at the same mark. Default: the shift is estimated.
    keep_spikes : bool
        Whether to keep spikes, dropouts and dust instead of removing them.
    pairs : path, optional
        Table with the columns before and after that lists pairs of files; used instead of `files`.
    datum : str
        "straight" if the datum of the instrument is known to be straight, so that no bow is subtracted from traces.
    predicted : path, optional
        Results folder of a run with [wear], whose worn depth is compared with that of the traces.
    piece : str
        Piece on which the traces were measured, "upper" or "lower". Not required if both pieces wear equally.
    cutoff : float or str, optional
        Cut-off [m] of the roughness inside and outside of the track of traces. Default: the longest standard one that fits.

    Returns
    -------
    dict
        The contents of compare.json, in SI units. Measures such as `shift`, `worn_depth_mean` and `amplitude_ratio` have
        `value`, `low`, `high`, `unit`, and a `reason` if the value is None. Scans also have `worn_volume`, `grown_volume`
        and `worn_share`. The other entries, where they exist, are:

        - `verdict`, `sentences`: summary of the comparison.
        - `roughness`: Ra, Rq and rms slope inside and outside the track of two traces.
        - `registration`: shift in x and y, and rotation of the second scan.
        - `predicted`: fitted wear `coefficient`, `difference_rms`, a `sentence` and `warnings`, with the option `predicted`.
        - `pairs`: list of the comparisons, with the option `pairs`. A pair that fails has a `message`.
        - `runs`: measures of both runs, for results folders. The measures beside are the wear between the two runs over the
          whole patch.

    Raises
    ------
    PatchfemError
        If the files cannot be compared.

    Examples
    --------
    >>> import numpy as np
    >>> import patchfem as pf
    >>> x = np.arange(0.0, 8.0, 0.002)
    >>> before = np.convolve(np.random.default_rng(1).normal(size=x.size + 20), np.ones(21) / 21, "valid")
    >>> for name, z in (("before.csv", before), ("after.csv", np.minimum(before, 0.2))):
    ...     np.savetxt(name, np.c_[x, z], delimiter=",", header="x [mm],z [um]", comments="")
    >>> comparison = pf.compare("before.csv", "after.csv", shift=0.0)
    >>> comparison["amplitude_ratio"]["value"] < 1
    True
    """
    options = surface_comparison.Options(
        units=units,
        direction=_require_string(direction, "compare: direction"),
        shift=_parse_length(shift, "compare: shift"),
        datum=_require_string(datum, "compare: datum"),
        keep_spikes=keep_spikes,
        cutoff=_parse_length(cutoff, "compare: cutoff"),
    )
    files = [_require_path(file, "compare") for file in files]
    _require_string(piece, "compare: piece")

    # A table of pairs or two results folders are compared alone.
    if pairs is not None:
        if files or predicted is not None:
            raise PatchfemError(
                "compare: give the table of pairs alone, without files or predicted"
            )
        return compared.answer_pairs(_require_path(pairs, "compare: pairs"), options).details
    if len(files) == 4:
        raise PatchfemError(describe_removed("compare of four files"))
    if len(files) != 2:
        raise PatchfemError("compare: give two files, before and after wear, or a table of pairs")
    if any(file.is_dir() for file in files):
        if options != surface_comparison.Options() or predicted is not None:
            raise PatchfemError(
                "compare: give two results folders alone, without settings of traces"
            )
        return worn.answer_runs(*files).details

    folder = None if predicted is None else _require_path(predicted, "compare: predicted")
    return compared.answer_files(*files, options, folder, piece).details


def _read_sweep_scene(scene: str | Path | Scene) -> case_models.SweepScene:
    """Return the scene text of a sweep without validating the scene.

    `scene` is as for `load`.
    """
    sets: tuple = ()
    if isinstance(scene, Mapping):
        path = Path(DICT_NAME)
        text = format_scene(dict(scene))
    elif isinstance(scene, Scene):
        path = scene.path
        text = scene.text
        sets = scene.sets
    elif _is_scene_text(scene):
        path = Path(INLINE_SCENE_NAME)
        text = scene
    else:
        path = _require_path(scene, "a scene")
        text = read_text(scene)
    return case_models.SweepScene(path, text, sets)


def _require_path(value: Any, name: str) -> Path:
    """Return the name of a file or folder, `value`, as a Path.

    Raises PatchfemError for other types.

    `name` is that of the argument, for the message.
    """
    if not isinstance(value, str | Path):
        needed = "a path, a text, a dict of tables or a Scene" if name == "a scene" else "a path"
        raise PatchfemError(f"{name}: {needed} is needed, not {value!r:.60}")
    return Path(value)


def _require_paths(value: Any, name: str) -> list:
    """Return one or several paths, `value`, as a list of Path.

    `name` is that of the argument.
    """
    is_collection = isinstance(value, Iterable) and not isinstance(value, str)
    return [_require_path(path, name) for path in (value if is_collection else [value])]


def _parse_length(value: Any, name: str) -> float | None:
    """Convert a value, a number [m] or a string with a unit, to a length [m].

    None is returned unchanged. `name` is that of the argument, for the message. Raises PatchfemError for other types
    and invalid strings.
    """
    if value is None:
        return None
    try:
        return parse_quantity(value, "length") if isinstance(value, str) else float(value)
    except (TypeError, ValueError) as error:
        reason = f"a length in m or a text such as '0.25 mm' is needed, not {value!r:.60}"
        if isinstance(value, str):
            reason = str(error)
        raise PatchfemError(f"{name}: {reason}") from None


def _require_string(value: Any, name: str) -> str:
    """Return a value that is a string.

    PatchfemError, which names the argument, is raised for other types.
    """
    if not isinstance(value, str):
        raise PatchfemError(f"{name}: a text is needed, not {value!r:.60}")
    return value


def _require_strings(value: str | Iterable[str], name: str) -> tuple:
    """Return one or several strings, `value`, as a tuple.

    Raises PatchfemError, which has the name of the argument, for other types.
    """
    is_collection = isinstance(value, Iterable) and not isinstance(value, str)
    return tuple(_require_string(string, name) for string in (value if is_collection else [value]))


def _print_to_stderr(line: str) -> None:
    """Print a line of text to the standard error stream."""
    print(line, file=sys.stderr, flush=True)


def _reject_keys(sets: dict, kind: str) -> None:
    """Raise PatchfemError if keys (`sets`) are given for a Plan or a Model, which cannot be changed.

    `kind` is the class name for the message.
    """
    if sets:
        raise PatchfemError(
            f"{', '.join(sets)} cannot be set in a {kind}; set the value in the scene"
        )


class Measures(Mapping):
    """Read-only mapping of the measures of a run, which are also available as attributes.

    A notebook displays the measures as a table.

    Examples
    --------
    >>> import patchfem as pf
    >>> measures = pf.run(pf.new("bench")).measures
    >>> measures.friction_force_peak.unit, "loop_area" in measures
    ('N', True)
    """

    def __init__(self, measures: dict[str, Measure]):
        self._measures = dict(measures)

    def __getitem__(self, name: str) -> Measure:
        """Return a measure by its name.

        The KeyError for another name suggests a similar one.
        """
        if name in self._measures:
            return self._measures[name]
        if removed := describe_removed(f"measure {name}"):
            raise KeyError(removed)
        similar_names = get_close_matches(str(name), self._measures, 1, 0.6)
        advice = f"it has {', '.join(self._measures)}"
        if similar_names:
            advice = f"did you mean {similar_names[0]!r}?"
        raise KeyError(f"no measure {name!r} in this run; {advice}")

    def __getattr__(self, name: str) -> Measure:
        """Return a measure by its name."""
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
        return "\n".join(show.format_quantities(runs.make_quantities(self._measures)))


class Plots:
    """Plots of a run as matplotlib Axes.

    Each method draws on the Axes `ax`. If `ax` is None, it creates a new figure, which may have more Axes than the method
    returns. It raises PatchfemError if the run does not contain the required data.

    Examples
    --------
    >>> import patchfem as pf
    >>> result = pf.run(pf.new("bench"))
    >>> result.plot.loop().figure.savefig("loop.png")
    """

    def __init__(self, result: Result):
        self._result = result

    def pressure(self, ax: Axes | None = None) -> Axes:
        """Plot the normal stress along the interface, and the shear stress if there is any.

        If the interfaces have separate patches, the normal stress on each is drawn. With `ax`, only the first of these
        charts is drawn.
        """
        has_patch = self._result.patch is not None or self._result.faces
        reason = "the pieces do not touch" if has_patch else "the scene has no [contact]"
        titles = ("Pressure on the interface", "Shear stress on the interface")
        return self._draw(ax, "pressure", titles, reason)

    def loop(self, ax: Axes | None = None) -> Axes:
        """Plot the friction force against the relative displacement of the interface.

        It is drawn on `ax`, by default on a new figure.
        """
        reason = self._explain_missing_motion() or "no friction acted, or nothing slid"
        return self._draw(ax, "loop", ("Friction loop",), reason)

    def history(self, ax: Axes | None = None) -> Axes:
        """Plot the displacement against time, and the last cycles or the friction force.

        With `ax`, only the displacement is drawn.
        """
        titles = ("Whole run", "Displacement", "Friction force")
        return self._draw(ax, "history", titles, self._explain_missing_motion())

    def levels(self, ax: Axes | None = None) -> Axes:
        """Plot the amplitude for each level, or the steady-state amplitude against level or frequency.

        It is drawn on `ax`, by default on a new figure.
        """
        no_levels = (
            'the drive has no levels; use drive.waveform = "levels", or a sweep with '
            'accuracy.method = "harmonic"'
        )
        titles = ("Levels of the drive", "Steady motions")
        return self._draw(ax, "levels", titles, self._explain_missing_motion() or no_levels)

    def curve(self, ax: Axes | None = None) -> Axes:
        """Plot the response curve: amplitude and acceleration of the steady motions against frequency or level.

        With `ax`, only the amplitude is drawn. Each run adds a curve in a colour of its own, which the legend names by its
        drive level. The axis is logarithmic if the levels differ by more than a decade.
        """
        no_curve = 'the run has no response curve; use drive.waveform = "sweep" with accuracy.method = "harmonic"'
        reason = self._explain_missing_motion() or no_curve
        return self._draw(ax, "curve", ("Steady motions",), reason, self._name_drive_level())

    def _name_drive_level(self) -> str:
        """Return the drive level of a response curve for the legend, such as "drive 5 N"; "" if it is not one level."""
        levels = runs.make_run_answer(self._result).data.get("curve_level")
        if levels is None or len(set(levels.values.tolist())) != 1:
            return ""
        rig = self._result.plan.model.rig
        is_force = rig.drive.kind == "force"
        unit, factor = ("N", rig.modes.mass) if is_force else ("m s-2", 1.0)
        return f"drive {format_quantity(factor * float(levels.values[0]), unit, 4)}"

    @property
    def charts(self) -> list[str]:
        """Titles of the charts that the page of this run shows."""
        return chart_axes.list_titles(runs.make_run_answer(self._result))

    def chart(self, title: str, ax: Axes | None = None) -> Axes:
        """Plot a chart of the page by its title, one of `charts`.

        It is drawn on `ax`, by default on a new figure.
        """
        reason = f"the charts of this run are {', '.join(self.charts) or 'none'}"
        return self._draw(ax, f"chart {title!r}", (title,), reason)

    def accuracy(self, ax: Axes | None = None) -> Axes:
        """Plot the largest error of the motion against CPU time, for different numbers of time steps.

        It is drawn on `ax`, by default on a new figure.
        """
        no_steps = (
            "the number of time steps does not limit its accuracy; a rig takes time steps with "
            'accuracy.method = "march"'
        )
        reason = self._explain_missing_motion() or no_steps
        return self._draw(ax, "accuracy", ("Accuracy against time",), reason)

    def stress(self, ax: Axes | None = None) -> Axes:
        """Plot the von Mises stress in both loaded pieces, and an enlarged view of the contact.

        The stress along the interface is shown too. With `ax`, only the picture of both pieces is drawn.
        """
        if self._result.patch is None:
            raise PatchfemError("plot.stress: nothing to draw: the scene has no [contact]")
        chart_axes.check_axes(ax, "plot.stress")
        return pieces.draw_result(self._result, ax)

    def _explain_missing_motion(self) -> str:
        """Return why a run has no motion; "" if it has motion."""
        if self._result.response is not None:
            return ""
        if self._result.plan.kind == "patch":
            return "a static patch does not move; add [friction] with [slide], or with [structure] and [drive]"
        return "no motion was computed"

    def _draw(
        self, ax: Axes | None, name: str, titles: tuple[str, ...], reason: str, label: str = ""
    ) -> Axes:
        """Plot the charts with some titles for which the run has data, and return the first Axes.

        With `ax`, only the first chart is drawn. Raises PatchfemError with `reason` if the run has no data for any of
        them.

        `titles` are those of the charts, `name` is that of the method, for the message, and `label` names the run in the
        legend.
        """
        answer = runs.make_run_answer(self._result)
        axes_of_chart = chart_axes.draw_charts(answer, titles, ax, f"plot.{name}", label)
        if axes_of_chart is None:
            raise PatchfemError(f"plot.{name}: nothing to draw: {reason}")
        return axes_of_chart


class Result(run_result.Result):
    """Result of a run: outcome, measures, warnings, notes and time histories.

    `outcome.sentence` describes how the run ended. `measures[name]` has `value`, `error`, `unit` and `text`, in SI units.
    `response` contains the time histories, and `seconds` the CPU time of each part of the run.

    Examples
    --------
    >>> import patchfem as pf
    >>> result = pf.run(pf.new("bench"))
    >>> measure = result.measures["loop_area"]
    >>> measure.unit, measure.error < 1e-3 * measure.value
    ('J', True)
    """

    measures: Measures

    def _repr_html_(self) -> str:
        """Return the HTML representation for notebooks: outcome, headline, measures and warnings."""
        answer = runs.make_run_answer(self)
        rows = ""
        for name, text in show.list_quantities(answer.quantities):
            rows += (
                f"<tr><td>{escape(name)}</td><td style='text-align:right'>{escape(text)}</td></tr>"
            )
        sentences = escape(" ".join(answer.verdict))
        warnings = "".join(f"<p>&#9888; {escape(text)}</p>" for text in self.warnings)
        title = f"<b>{escape(answer.title)}</b><br>" if answer.title else ""
        return f"<div>{title}{sentences}{warnings}<table>{rows}</table></div>"

    @property
    def plot(self) -> Plots:
        """Plots of the run: pressure(), stress(), loop(), history(), curve(), levels(), accuracy(), and chart() by title."""
        return Plots(self)

    def table(self) -> DataFrame:
        """Return the measures of the run as a table of name, value, error and unit, in SI units.

        Returns
        -------
        pandas.DataFrame
            A row for each measure.
        """
        from pandas import DataFrame

        rows = []
        for name, measure in self.measures.items():
            numbers = {"value": measure.value, "error": measure.error, "unit": measure.unit}
            rows.append({"measure": name} | numbers)
        return DataFrame(rows).set_index("measure")

    def to_xarray(self) -> Dataset:
        """Return the time histories and fields of the run with units and scene, as in result.nc."""
        return netcdf.to_dataset(runs.make_run_answer(self))

    def to_pyvista(self, frame: int | None = -1) -> Any:
        """Return both pieces and their interface as PyVista grids, with the fields of fields.vtkhdf.

        The blocks are `lower`, `upper` and `interface`; with [contact.area] there is only `interface`, whose cells are those
        of the face. The pieces have the arrays `displacement`, `stress` (xx, yy, zz, xy, 0, 0; tension positive),
        `von_mises` and `material`. The interface has `normal_stress` (compression positive), `gap` and, after a motion,
        `shear_stress`, `slip` and `status`, all in SI units. The field array `TimeValue` of each grid is the time [s].

        Parameters
        ----------
        frame : int, optional
            Index of the frame in `fields`; negative indices count from the end. Default: the last frame. None: all
            frames.

        Returns
        -------
        pyvista.MultiBlock or list of pyvista.MultiBlock
            A list for ``frame=None``. Each call computes all frames, so use the list for an animation.

        Raises
        ------
        PatchfemError
            If there is no such frame, or if the run has no pieces.

        Examples
        --------
        >>> import patchfem as pf
        >>> fields = pf.run(pf.new("patch")).to_pyvista()
        >>> fields.keys(), fields["upper"]["stress"].shape[1]
        (['lower', 'upper', 'interface'], 6)
        """
        if self.patch is None:
            raise PatchfemError(f"to_pyvista: {self._explain_missing_pieces()}")
        count = len(self.fields["time"])
        if frame is None:
            return grids.make_result_grids(self, range(count))
        if not isinstance(frame, Integral) or not -count <= frame < count:
            raise PatchfemError(
                f"to_pyvista: there is no frame {frame}; the run has frames 0 to {count - 1}"
            )
        return grids.make_result_grids(self, [frame])[0]

    def _explain_missing_pieces(self) -> str:
        """Return why a run has no single pair of pieces, and what to use instead."""
        faces = self.faces
        if not faces:
            return "the scene has no [contact], so there are no pieces; see to_xarray()"
        return (
            "every interface has pieces of its own; save the run with save(DIR) and read "
            f"DIR/interfaces/{faces[0].folder}/fields.vtkhdf with pyvista.read"
        )

    def save(self, folder: str | Path) -> Path:
        """Write the results of the run to a folder, as `patchfem run -o` does.

        An existing results folder is replaced.

        Parameters
        ----------
        folder : path
            Output folder.

        Returns
        -------
        Path
            Output folder.

        Raises
        ------
        PatchfemError
            If the folder exists and contains other files.

        Examples
        --------
        >>> import patchfem as pf
        >>> folder = pf.run(pf.new("bench")).save("bench")
        >>> (folder / "summary.json").is_file()
        True
        """
        folder = _require_path(folder, "save")
        run_folder.save_run(self, folder)
        return folder
