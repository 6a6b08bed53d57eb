"""Engines of a rig: which of them computes a model, and the comparison runs from which its errors follow.

In: a Model. Out: its Engine (`choose_engine`), i.e. the engine that the scene names, or the first one that can compute the
model. `scene.rules.methods.ENGINE_SUPPORT` lists what each engine can compute. The memory of each engine is in
`runs.memory`.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from ... import hybrid, slip
from ...effects import NO_WAVEFORM, law_has_trait
from ...model.model import Model
from ...response.coarser import CoarserRuns, ComparisonRuns, edge_errors, second_order_errors
from ...response.errors import (
    convergence_errors,
    estimate_sampling_errors,
    finer_errors,
    friction_errors,
)
from ...response.measures import Values
from ...scene.rules import methods
from ...scene.rules.accuracy import has_effect, list_fixed_settings
from ..patch import faces
from .solution import first_interface_load

# Keys of [accuracy] that select constant time steps.
MARCH_ACCURACY_KEYS = ("steps_per_cycle", "tail", "merge", "shear_modes")
# Ratio of the width within which bonds are merged in the comparison run to that in the run itself.
COMPARISON_MERGE_WIDTH_FACTOR = 0.5
# Largest ratio of the neglected tail of a sum over bonds to the tolerance at which no run with a
# smaller tail is made; the automatic tail is a tenth of this.
MAX_UNCHECKED_TAIL_RATIO = 1e-2
# Ratio of the neglected tail in the comparison run to that in the run itself.
COMPARISON_TAIL_FACTOR = 0.1


class Engine(NamedTuple):
    """Method that computes the motion of a rig, and its comparison runs.

    - name: name in `scene.rules.methods.ENGINE_SUPPORT`, which says what it can compute.
    - method: value of accuracy.method that selects the engine.
    - list_time_runs: function (model, numerics) that returns runs that are coarser in time.
    - list_space_runs: function (model, numerics, patch, n_coarse, solution) that returns runs that are coarser in space;
      n_coarse is the number of coarser meshes on which the patch of [contact] is solved.
    - has_steps: whether its time steps have equal lengths, so that it saves its state during a run.
    - finds_periodic_motion: whether it computes periodic motions directly.
    """

    name: str
    method: str
    list_time_runs: Callable[..., ComparisonRuns]
    list_space_runs: Callable[..., ComparisonRuns]
    has_steps: bool = False
    finds_periodic_motion: bool = False

    def find_unsupported_feature(self, model: Model) -> str:
        """Describe a property of a model that this engine cannot compute; "" if there is none."""
        return methods.find_unsupported_feature(methods.ENGINE_SUPPORT[self.name], model.motion)


def find_obstacle_of_map(name: str, model: Model) -> str:
    """Describe a property of a model that prevents its steady motion, or "".

    `name` is "harmonic", or one of the maps of a period, "exact" and "piecewise".
    """
    features = model.motion._replace(waveform=NO_WAVEFORM)
    return methods.find_unsupported_feature(methods.ENGINE_SUPPORT[name], features)


def may_fold(model: Model) -> bool:
    """Return whether a response curve of a model may turn back over frequency, so that it is followed along its arc length.

    With Coulomb friction, elastic-plastic elements and grooves there is one steady motion at each frequency.
    """
    return bool(
        model.grooves is None
        and find_obstacle_of_map("exact", model)
        and find_obstacle_of_map("piecewise", model)
    )


# ---- comparison runs


def list_runs_with_other_modes(model: Model, numerics) -> ComparisonRuns:
    """List the comparison runs with other modes of a reduced structure, which neglects its highest modes.

    One run has more modes, another one half of them; the list is empty if no modes are neglected. The runs of a time
    integration have a quarter of the steps of `numerics`, the settings of the run.
    """
    n_rigs = len(model.rig.structure.other_rigs)
    if not n_rigs:
        return []
    beside = None
    if ENGINES[numerics.engine].has_steps:
        numerics = beside = _divide_steps(numerics, 4)
    runs = tuple(replace(numerics, other_rig=number) for number in range(n_rigs))
    return [CoarserRuns(runs, finer_errors, beside, "reduced")]


def _list_coarse_meshes(model: Model, numerics, *, has_coarse_patch: bool) -> list:
    """List numerical settings in which one patch of a model has a coarser mesh: that of [contact], or of an interface.

    Interfaces with equal patches are coarsened together.
    `numerics` are the settings of the run, and `has_coarse_patch` tells whether the patch of [contact] matters.
    """
    meshes = [replace(numerics, coarse_patch=1)] * has_coarse_patch
    if model.rig.friction.has_partial_slip:
        groups = faces.group_interfaces_with_coarse_mesh(model)
        meshes += [replace(numerics, meshed=interfaces) for interfaces in groups]
    return meshes


def _divide_steps(numerics, divisor: int):
    """Return the Numerics of a run with its number of steps per cycle divided by `divisor`."""
    return replace(numerics, steps=max(1, numerics.steps // divisor))


def _list_march_time_runs(model: Model, numerics) -> ComparisonRuns:
    """List the comparison runs of a time integration: those with half and with a quarter of the steps of `numerics`."""
    runs = (_divide_steps(numerics, 2), _divide_steps(numerics, 4))
    return [CoarserRuns(runs, partial(convergence_errors, steps=numerics.steps), source="steps")]


def _list_march_space_runs(model: Model, numerics, patch, n_coarse, solution) -> ComparisonRuns:
    """List the comparison runs of a time integration with another spatial discretization.

    Each has a quarter of the steps of the run and is compared with a run that has as many:

    - one or two coarser meshes, if the run has them and depends on its mesh;
    - another number of shear modes, if the load varies, the slide goes over grooves, or a law acts at the nodes of a
      patch;
    - half the cells of an Iwan model, which represent its continuous density to order 2;
    - other settings of a bond summation.

    Parameters
    ----------
    model : Model
        Model of a rig.
    numerics : Numerics
        Settings of the run.
    patch : Patch or None
        Solved patch.
    n_coarse : int
        Number of coarser meshes on which the patch of [contact] is solved.
    solution : Solution
        Results of the run.
    """
    quarter = _divide_steps(numerics, 4)
    varies = model.rig.friction.load_varies
    shape = getattr(getattr(solution.contact, "reduction", None), "stiffness", None)
    n_modes = None if shape is None else shape.size

    # Both runs have the same number of shear modes, so that only the mesh changes.
    depends = n_coarse > 0 and model.motion_depends_on_mesh
    meshes = _list_coarse_meshes(model, quarter, has_coarse_patch=depends)
    if depends and n_modes:
        meshes[0] = replace(meshes[0], shear_modes=n_modes)
    coarser_runs = [CoarserRuns((mesh,), second_order_errors, quarter, "mesh") for mesh in meshes]
    is_below = model.side == "lower"
    if depends and (is_below or model.patch.area is not None):
        runs = tuple(replace(meshes[0], coarse_patch=k + 1) for k in range(min(n_coarse, 2)))
        rule = edge_errors if is_below else convergence_errors
        coarser_runs[0] = CoarserRuns(runs, rule, quarter, "mesh")

    reduction = getattr(solution.contact, "reduction", None)
    has_modes = isinstance(reduction, slip.shear_modes.ShearModes)
    if n_modes and (varies or model.grooves is not None or has_modes):
        coarser = replace(quarter, shear_modes=slip.shear_modes.comparison_mode_count(n_modes))
        coarser_runs.append(CoarserRuns((coarser,), second_order_errors, quarter, "modes"))
    if any(interface.numbers.law == "iwan" for interface in model.rig.friction.interfaces):
        halved = replace(quarter, has_half_cells=True)
        coarser_runs.append(CoarserRuns((halved,), second_order_errors, quarter))
    return [*coarser_runs, *_list_bond_sum_runs(model, quarter, patch, solution)]


def _list_bond_sum_runs(model: Model, quarter, patch, solution) -> ComparisonRuns:
    """List the comparison runs from which the error of a bond list is estimated.

    The first entry is the error bound of the sum on forces and energies. If bonds are merged or a
    large tail is neglected, the second entry is the change of the motion with narrower strips and a
    smaller tail.

    Parameters
    ----------
    model : Model
        Model of a rig.
    quarter : Numerics
        Settings of these runs, with a quarter of the steps of the run.
    patch : Patch or None
        Solved patch.
    solution : Solution
        Results of the run.
    """
    choice = solution.bond_summation
    if choice is None or not choice.error:
        return []

    def bound_errors(values: Values) -> Values:
        """Return a bound of the error of each measure in `values` due to bonds that the sum leaves out or merges.

        The bound follows from the relative error of the force and from the friction work of the run.
        """
        load = first_interface_load(model, patch)
        window = solution.window
        passed = np.abs(np.diff(window.extra["ledger"][0])).sum()
        span = max(window.time[-1] - window.time[0], 1e-300)
        works = solution.book["passed"], passed * model.rig.drive.signal.period / span

        error = choice.find_error(solution.book["join_error"])
        return friction_errors(values, error, model.friction, load, works)

    # The change of the motion adds to the bound where strips or the tail are coarse.
    coarser_runs = [CoarserRuns((), bound_errors, source="bonds")]
    if choice.merge > 0 or choice.tail > MAX_UNCHECKED_TAIL_RATIO * model.accuracy.tolerance:
        finer = replace(
            choice,
            merge=COMPARISON_MERGE_WIDTH_FACTOR * choice.merge,
            tail=COMPARISON_TAIL_FACTOR * choice.tail,
        )
        narrow = replace(quarter, choice=finer)
        same = replace(quarter, choice=choice)
        coarser_runs.append(CoarserRuns((narrow,), finer_errors, same, "bonds"))
    return coarser_runs


def _list_hybrid_time_runs(model: Model, numerics) -> ComparisonRuns:
    """List the run of the engine `hybrid` with larger steps, by comparison with which the step errors are estimated.

    `numerics` are the settings of the run whose errors are estimated.
    """
    coarse = replace(
        numerics,
        local=hybrid.runs.COARSE * numerics.local,
        steps=numerics.steps / hybrid.runs.COARSE_STEP,
    )
    return [CoarserRuns((coarse,), partial(estimate_hybrid_errors, rtol=numerics.local))]


def estimate_hybrid_errors(values: Values, coarse_values: Values, rtol: float) -> Values:
    """Return the errors of the measures that a run of the engine `hybrid` and one with larger steps have in common.

    Parameters
    ----------
    values, coarse_values : dict
        Measures of the run and of the run with larger steps, by name.
    rtol : float
        Step tolerance of the run.
    """
    shared = {name: value for name, value in values.items() if name in coarse_values}
    return hybrid.runs.estimate_errors(shared, coarse_values, rtol)


def _list_hybrid_space_runs(model: Model, numerics, patch, n_coarse, solution) -> ComparisonRuns:
    """List the comparison runs of the engine `hybrid` on coarser meshes.

    The mesh matters only for patches that slip part by part, for the loads of strips, and for the slip force of an
    averaged law. The measures of independent strips also have the error of the trapezoidal rule with 400 samples per
    cycle.

    Parameters
    ----------
    model : Model
        Model of a rig.
    numerics : Numerics
        Settings of the run.
    patch : Patch or None
        Solved patch.
    n_coarse : int
        Number of coarser meshes on which the patch of [contact] is solved.
    solution : Solution
        Results of the run.
    """
    averaged = model.friction is not None and law_has_trait(model.friction.law, "averaged")
    bands_slide_apart = model.rig.friction.bands_slide_apart
    is_smooth = (bands_slide_apart or averaged) and not model.partial_slip
    rule = second_order_errors if is_smooth else convergence_errors
    depends = n_coarse > 0 and bool(model.partial_slip or is_smooth)
    meshes = _list_coarse_meshes(model, numerics, has_coarse_patch=depends)
    coarser_runs = [CoarserRuns((mesh,), rule, source="mesh") for mesh in meshes]
    if bands_slide_apart:
        coarser_runs.insert(0, CoarserRuns((), estimate_sampling_errors, source="samples"))
    return coarser_runs


def _list_steady_space_runs(model: Model, numerics, patch, n_coarse, solution) -> ComparisonRuns:
    """List the comparison runs of a steady motion on coarser meshes.

    The first entry has no runs, but the errors that the solver of the motion knows by measure (`solution.errors`).
    `patch` is the solved patch or None, and `n_coarse` the number of coarser meshes on which it is solved.
    """
    own = CoarserRuns((), lambda fine: {name: solution.errors.get(name, 0.0) for name in fine})
    return [own, *_list_hybrid_space_runs(model, numerics, patch, n_coarse, solution)]


HYBRID = Engine("hybrid", "exact", _list_hybrid_time_runs, _list_hybrid_space_runs)
MARCH = Engine("march", "march", _list_march_time_runs, _list_march_space_runs, has_steps=True)
HARMONIC = Engine(
    "harmonic",
    "harmonic",
    lambda model, numerics: [],
    _list_steady_space_runs,
    finds_periodic_motion=True,
)
ENGINES = {engine.name: engine for engine in (HYBRID, MARCH, HARMONIC)}


@lru_cache(8)
def choose_engine(model: Model) -> Engine:
    """Choose the engine that computes the motion of a model.

    The method of the scene selects its engine. For method = "auto" the motion is computed from event to event if
    possible, else in time steps, and also if the scene has a setting of the time steps and a law that is not rigid. All
    engines solve the same equations, so the choice affects the time and the errors of a run, but not its meaning; the
    summary of a run names its engine.
    """
    for engine in ENGINES.values():
        if engine.method == model.accuracy.method:
            return engine
    if HYBRID.find_unsupported_feature(model):
        return MARCH
    is_rigid = not model.partial_slip and all(
        law_has_trait(law.numbers.law, "set-valued") and not law.partial_slip
        for law in model.rig.friction.interfaces
    )
    accuracy = model.accuracy
    has_setting = accuracy.quadrature not in ("auto", "recursion")
    has_setting |= any(getattr(accuracy, key) is not None for key in MARCH_ACCURACY_KEYS)
    return MARCH if has_setting and not is_rigid and model.grooves is None else HYBRID


def describe_unused_settings(model: Model, engine: str) -> list[str]:
    """Return sentences on the settings in [accuracy] that the engine of a rig does not use."""
    # Steady motions are found by integration from event to event.
    used = "hybrid" if ENGINES[engine].finds_periodic_motion else engine
    sentences = []
    for key in list_fixed_settings(model.accuracy):
        if not has_effect(key, model.kind, used):
            reason = ", which does not use steps of equal length," * (key == "steps_per_cycle")
            sentences.append(
                f"accuracy.{key} has no meaning for engine '{engine}'{reason} and is not used"
            )
    return sentences
