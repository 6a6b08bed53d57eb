"""Engines of a rig: which of them computes a model, its numerical settings, and the comparison runs for its errors.

In: a Model. Out: its Engine (`choose_engine`), i.e. the engine that the scene names, or the first one that can compute the
model, and its `Numerics`, set by the scene or else by the tolerance (`choose_numerics`).
`scene.rules.methods.ENGINE_SUPPORT` lists what each engine can compute. The memory of each engine is in `runs.plan`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from math import ceil, sqrt
from typing import NamedTuple

import numpy as np

from ... import friction, hybrid, slip
from ...effects import NO_WAVEFORM, law_has_trait
from ...model.model import Model
from ...response.errors import (
    CoarserRuns,
    ComparisonRuns,
    absolute_change,
    convergence_errors,
    edge_errors,
    estimate_sampling_errors,
    finer_errors,
    friction_errors,
    second_order_errors,
)
from ...response.measures import Values
from ...scene.rules import methods
from ...scene.rules.accuracy import has_effect, list_fixed_settings
from ...structure.drive_sizes import find_max_frequency_ratio, find_min_decay_rate, is_sinusoidal
from ..patch import faces
from .evaluation import first_interface_load

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


def _list_coarse_meshes(model: Model, numerics, *, has_coarse_patch: bool) -> list["Numerics"]:
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
    coarse = enlarge_hybrid_steps(numerics)
    return [CoarserRuns((coarse,), partial(estimate_hybrid_errors, rtol=numerics.local))]


def enlarge_hybrid_steps(numerics):
    """Return the settings of the engine `hybrid` with a larger step tolerance and longer steps, for a comparison run."""
    local = hybrid.runs.COARSE * numerics.local
    return replace(numerics, local=local, steps=numerics.steps / hybrid.runs.COARSE_STEP)


def estimate_hybrid_errors(values: Values, coarse_values: Values, rtol: float) -> Values:
    """Return the errors of the measures that a run of the engine `hybrid` and one with larger steps have in common.

    Parameters
    ----------
    values, coarse_values : dict
        Measures of the run and of the run with larger steps, by name.
    rtol : float
        Step tolerance of the run.
    """
    errors = {}
    for name, change in absolute_change(values, coarse_values).items():
        errors[name] = hybrid.runs.estimate_error(change, values[name], rtol)
    return errors


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
    laws = [law.numbers.law for law in model.rig.friction.interfaces]
    is_rigid = all(law_has_trait(law, "set-valued") for law in laws)
    is_rigid &= not (model.partial_slip or model.rig.friction.has_partial_slip)
    accuracy = model.accuracy
    has_setting = list_fixed_settings(accuracy) or accuracy.quadrature not in ("auto", "recursion")
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


# Largest fraction of a cycle by which round-off changes an integer number of cycles, so that a
# record of 30 periods has 30 cycles.
WHOLE_CYCLE_TOL = 1e-6
# Number of decay times after which a transient is neglected; its mean square is then reduced to
# e^-6.
N_TRANSIENT_DECAY_TIMES = 3.0
MIN_SAMPLES_PER_RUN = 100  # Smallest number of samples of a run with a non-sinusoidal drive.
MAX_MARCH_STEPS_PER_CYCLE = 6400  # Largest automatically chosen number of time steps per cycle.
MIN_RELATIVE_STEP_ERROR = 1e-12  # Smallest relative error per step; below it round-off dominates.


@dataclass(frozen=True, slots=True)
class Numerics:
    """Numerical settings of a run of a rig.

    - engine: name of the engine.
    - steps: time steps per cycle; of the engine `hybrid` the smallest number per shortest period of the drive.
    - cycles, window: number of cycles of the run, and of the window at its end.
    - shear_modes: number of shear modes; None: set by the tolerance.
    - choice: method of bond summation; None: set by the tolerance and the steps.
    - whole: whether the run stores the histories before the window, or draws the response curve beside its peak; coarse runs
      may omit them.
    - local: largest relative error per step of the engine `hybrid`.
    - other_rig: index of the rig with other modes of a reduced structure, or None.
    - meshed: indices of the interfaces whose patches have a coarser mesh.
    - coarse_patch: how many times the mesh of the patch of [contact] is coarser by a factor of 2.
    - stiffer_joint: whether a joint that is subtracted from bolted modes is stiffer by its error.
    - has_half_cells: whether Iwan models of time steps have half their cells.
    """

    engine: str
    steps: int
    cycles: float
    window: int
    shear_modes: int | None
    choice: "friction.bonds.engines.EngineChoice | None" = None
    whole: bool = True
    local: float = 0.0
    other_rig: int | None = None
    meshed: tuple[int, ...] = ()
    coarse_patch: int = 0
    stiffer_joint: bool = False
    has_half_cells: bool = False

    def finer(self):
        """Return finer settings for the next run.

        The engine `hybrid` has a hundredth of the step error, and other engines have twice as many steps.
        """
        if self.local:
            return replace(self, local=max(0.01 * self.local, MIN_RELATIVE_STEP_ERROR))
        return replace(self, steps=2 * self.steps)


def steps_per_cycle(model: Model) -> int:
    """Return the steps per cycle of a time integration, from the scene or else from the tolerance.

    The tolerance selects between 100 and MAX_MARCH_STEPS_PER_CYCLE steps.
    """
    if model.accuracy.steps_per_cycle:
        return model.accuracy.steps_per_cycle
    rig = model.rig
    max_frequency_ratio = max(
        find_max_frequency_ratio(rig.drive.signal),
        float(rig.structure.frequencies.max()) * rig.drive.signal.period,
    )
    if model.load_varies:
        max_frequency_ratio = max(
            max_frequency_ratio, model.point.frequency * rig.drive.signal.period
        )
    # The error is proportional to the square of the step; 400 steps per cycle of the fastest motion
    # give 1e-3.
    steps = 2 * round(200 * sqrt(1e-3 / model.accuracy.tolerance) * max_frequency_ratio)
    return min(max(steps, 100), MAX_MARCH_STEPS_PER_CYCLE)


def choose_numerics(model: Model, engine: Engine | None = None) -> Numerics:
    """Choose the engine and the numerical settings of a run of a rig.

    The measures are evaluated over a window of the last cycles: a tenth of all cycles, at least 1 and at
    most 10. Under a drive with a beat, or a load with another period than the drive, the window contains whole
    beats; under a random drive it is the record without its initial transient.

    Parameters
    ----------
    model : Model
        Its table [accuracy] sets what is not chosen here.
    engine : Engine, optional
        Engine of the run; default: that of `choose_engine`.

    Raises
    ------
    PatchfemError
        If the method of the scene cannot compute the model.
    """
    accuracy = model.accuracy
    rig = model.rig
    drive = rig.drive
    cycles = drive.cycles
    engine = engine or choose_engine(model)
    window = int(max(1, min(10, (cycles + WHOLE_CYCLE_TOL) // 10)))
    # Under a random drive, the window is the whole record without its initial transient.
    if drive.waveform.is_random:
        rate = find_min_decay_rate(rig.modes) * drive.signal.period
        start = min(cycles / 4, N_TRANSIENT_DECAY_TIMES / rate if rate else np.inf)
        window = int(max(1, cycles - start + WHOLE_CYCLE_TOL))

    # The window contains complete periods of a beat; the beat is within a level if the drive has levels.
    beat_cycles = rig.count_repeat_cycles(model.point) or 0.0
    if drive.levels.amplitudes:
        cycles = drive.levels.cycles
        window = min(window, int(cycles + WHOLE_CYCLE_TOL))
    if 1 < beat_cycles <= cycles:
        window = int(beat_cycles * max(1, min(10, cycles // (10 * beat_cycles))) + WHOLE_CYCLE_TOL)

    steps = steps_per_cycle(model)
    if not is_sinusoidal(drive.signal) and accuracy.steps_per_cycle is None:
        steps = max(steps, int(np.ceil(MIN_SAMPLES_PER_RUN / drive.cycles)))
    numerics = Numerics(engine.name, steps, drive.cycles, window, accuracy.shear_modes)

    if engine is HYBRID:
        # A rig without friction needs few steps. Otherwise the error per step is a small part of the tolerance.
        is_exact = accuracy.method == "exact" or model.friction is None
        local = float(np.clip(1e-5 * accuracy.tolerance, MIN_RELATIVE_STEP_ERROR, 1e-8))
        if is_exact:
            local = hybrid.cases.EXACT_RTOL
        return replace(numerics, local=local, steps=hybrid.cases.MIN_STEPS)
    if engine is MARCH and accuracy.steps_per_cycle is None:
        # The steps are short enough for a unique solution; comparison runs have half and a quarter of them.
        return replace(numerics, steps=4 * ceil(max(steps, min_unique_steps(model)) / 4))
    return numerics


def min_unique_steps(model: Model) -> int:
    """Return the smallest even number of steps per cycle with a unique solution in each step.

    It is 0 except for bonds that weaken. These require dt^2 k_t (eps_0/eps_k - 1)/(2 M) < 1, where
    k_t = mu_s N/eps_0 and M is the mass that the interface moves.
    """
    f = model.friction
    modes = model.rig.modes
    if (
        f is None
        or not law_has_trait(f.law, "bonds")
        or f.slip_growth is None
        or not f.kinetic
        or f.kinetic >= f.static
    ):
        return 0
    load = model.nominal_load
    stiff = f.static * load / f.bond_length * (f.static / f.kinetic - 1)
    return 2 * ceil(
        0.55
        * model.rig.drive.signal.period
        * sqrt(stiff * float((modes.slide**2).sum()) / (2 * modes.mass))
    )
