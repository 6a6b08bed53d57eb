"""Engines of a motion: which of them computes a model, and its numerical settings.

In: a Model. Out: its Engine (`choose_engine`), i.e. the engine that the scene names, or the first one that can compute the
model, and its `Numerics`, set by the scene or else by the tolerance (`choose_numerics`).
`scene.rules.methods.ENGINE_SUPPORT` lists what each engine can compute. The memory of each engine is in `runs.plan`.
"""

from dataclasses import replace
from functools import lru_cache
from math import ceil, sqrt
from typing import NamedTuple

import numpy as np

from ... import event_driven, structure
from ...effects import NO_WAVEFORM, law_has_trait
from ...measures.errors import compute_absolute_changes
from ...measures.measures import Values
from ...model.model import Model
from ...scene.rules import methods
from ...scene.rules.accuracy import has_effect, list_fixed_settings
from ..bench import engine as bench_engine
from ..bench.engine import MIN_RELATIVE_STEP_ERROR, Numerics, SpaceSettings

# Tolerance of a step from event to event, relative to the tolerance of the run, and its largest value
STEP_ERROR_RATIO = 1e-5
MAX_RELATIVE_STEP_ERROR = 1e-8


class Engine(NamedTuple):
    """Method that computes a motion.

    - name: name in `scene.rules.methods.ENGINE_SUPPORT`, which says what it can compute; "bench" for a prescribed slide.
    - method: value of accuracy.method that selects the engine; "" if the kind of the scene selects it.
    - step_multiple: number of which its equal time steps per cycle are a multiple; 0 without equal steps.
    - finds_periodic_motion: whether it computes periodic motions directly.
    """

    name: str
    method: str
    step_multiple: int = 0
    finds_periodic_motion: bool = False

    @property
    def has_steps(self) -> bool:
        """Whether its time steps have equal lengths."""
        return self.step_multiple > 0

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


def divide_steps(numerics, divisor: int):
    """Return the Numerics of a run with its number of steps per cycle divided by `divisor`.

    The steps of a prescribed slide remain a multiple of 4, so that its reversals are samples.
    """
    multiple = ENGINES[numerics.engine].step_multiple
    steps = max(multiple, numerics.steps // (divisor * multiple) * multiple)
    return replace(numerics, steps=steps)


def enlarge_event_driven_steps(numerics):
    """Return settings of the engine `event_driven` for a comparison run: a larger step tolerance and longer steps."""
    local = event_driven.runs.COARSE * numerics.local
    return replace(numerics, local=local, steps=numerics.steps / event_driven.runs.COARSE_STEP)


def estimate_event_driven_errors(values: Values, coarse_values: Values, rtol: float) -> Values:
    """Return the errors of the measures that a run of the engine `event_driven` and one with larger steps have in common.

    Parameters
    ----------
    values, coarse_values : dict
        Measures of the run and of the run with larger steps, by name.
    rtol : float
        Step tolerance of the run.
    """
    errors = {}
    for name, change in compute_absolute_changes(values, coarse_values).items():
        errors[name] = event_driven.runs.estimate_error(change, values[name], rtol)
    return errors


EVENT_DRIVEN = Engine("event_driven", "exact")
MARCH = Engine("march", "march", step_multiple=1)
HARMONIC = Engine("harmonic", "harmonic", finds_periodic_motion=True)
BENCH = Engine("bench", "", step_multiple=4)
ENGINES = {engine.name: engine for engine in (EVENT_DRIVEN, MARCH, HARMONIC, BENCH)}


@lru_cache(8)
def choose_engine(model: Model) -> Engine:
    """Choose the engine that computes the motion of a model.

    The method of the scene selects its engine. For method = "auto" the motion is computed from event to event if
    possible, else in time steps, and also if the scene has a setting of the time steps and a law that is not rigid. All
    engines solve the same equations, so the choice affects the time and the errors of a run, but not its meaning; the
    summary of a run names its engine.
    """
    if model.rig is None:
        return BENCH
    for engine in ENGINES.values():
        if engine.method == model.accuracy.method:
            return engine
    if EVENT_DRIVEN.find_unsupported_feature(model):
        return MARCH
    laws = [law.numbers.law for law in model.rig.friction.interfaces]
    is_rigid = all(law_has_trait(law, "set-valued") for law in laws)
    is_rigid &= not (model.partial_slip or model.rig.friction.has_partial_slip)
    accuracy = model.accuracy
    has_setting = list_fixed_settings(accuracy) or accuracy.quadrature not in ("auto", "recursion")
    return MARCH if has_setting and not is_rigid and model.grooves is None else EVENT_DRIVEN


def describe_unused_settings(model: Model, engine: str) -> list[str]:
    """Return sentences on the settings in [accuracy] that the engine of a rig does not use."""
    # Steady motions are found by integration from event to event.
    used = "event_driven" if ENGINES[engine].finds_periodic_motion else engine
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
MAX_MARCH_STEPS_PER_CYCLE = 6400  # Largest automatically chosen number of time steps per cycle.


def steps_per_cycle(model: Model) -> int:
    """Return the steps per cycle of a time integration, from the scene or else from the tolerance.

    The tolerance selects between 100 and MAX_MARCH_STEPS_PER_CYCLE steps.
    """
    if model.accuracy.steps_per_cycle:
        return model.accuracy.steps_per_cycle
    rig = model.rig
    period = rig.drive.signal.period
    ratios = [
        structure.drive_sizes.find_max_frequency_ratio(rig.drive.signal),
        float(rig.structure.frequencies.max()) * period,
    ]
    if model.load_varies:
        ratios.append(model.point.frequency * period)
    # The error is proportional to the square of the step; 400 steps per cycle of the fastest motion
    # give 1e-3.
    steps = 2 * round(200 * sqrt(1e-3 / model.accuracy.tolerance) * max(ratios))
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
    engine = engine or choose_engine(model)
    if engine is BENCH:
        return bench_engine.make_bench_numerics(model, bench_engine.steps_per_cycle(model))
    drive = rig.drive
    cycles = drive.cycles
    window = int(max(1, min(10, (cycles + WHOLE_CYCLE_TOL) // 10)))
    # Under a random drive, the window is the whole record without its initial transient.
    if drive.waveform.is_random:
        rate = structure.drive_sizes.find_min_decay_rate(rig.modes) * drive.signal.period
        # Number of decay times after which a transient is neglected; its mean square is then
        # reduced to e^-6.
        start = min(cycles / 4, 3.0 / rate if rate else np.inf)
        window = int(max(1, cycles - start + WHOLE_CYCLE_TOL))

    # The window contains complete periods of a beat; the beat is within a level if the drive has levels.
    beat_cycles = rig.count_repeat_cycles(model.point) or 0.0
    if drive.levels.amplitudes:
        cycles = drive.levels.cycles
        window = min(window, int(cycles + WHOLE_CYCLE_TOL))
    if 1 < beat_cycles <= cycles:
        window = int(beat_cycles * max(1, min(10, cycles // (10 * beat_cycles))) + WHOLE_CYCLE_TOL)

    steps = steps_per_cycle(model)
    if not structure.drive_sizes.is_sinusoidal(drive.signal) and accuracy.steps_per_cycle is None:
        # Smallest number of samples of a run with a non-sinusoidal drive.
        steps = max(steps, int(np.ceil(100 / drive.cycles)))
    local = 0.0
    if engine is EVENT_DRIVEN:
        # A rig without friction needs few steps. Otherwise the error per step is a small part of the tolerance.
        steps = event_driven.cases.MIN_STEPS
        step_error = STEP_ERROR_RATIO * accuracy.tolerance
        local = float(np.clip(step_error, MIN_RELATIVE_STEP_ERROR, MAX_RELATIVE_STEP_ERROR))
        if accuracy.method == "exact" or model.friction is None:
            local = event_driven.cases.EXACT_RTOL
    elif engine is MARCH and accuracy.steps_per_cycle is None:
        # The steps are short enough for a unique solution; comparison runs have half and a quarter of them.
        steps = 4 * ceil(max(steps, min_unique_steps(model)) / 4)
    space = SpaceSettings(accuracy.shear_modes)
    return Numerics(engine.name, steps, drive.cycles, window, space, local=local)


def min_unique_steps(model: Model) -> int:
    """Return the smallest even number of steps per cycle with a unique solution in each step.

    It is 0 except for bonds that weaken. These require dt^2 k_t (eps_0/eps_k - 1)/(2 M) < 1, where
    k_t = mu_s N/eps_0 and M is the mass that the interface moves.
    """
    f = model.friction
    if f is None or not law_has_trait(f.law, "bonds") or f.slip_growth is None or not f.kinetic:
        return 0
    modes = model.rig.modes
    weakening = max(f.static / f.kinetic - 1, 0.0)
    stiffness = f.static * model.nominal_load / f.bond_length * weakening
    mobility = float((modes.slide**2).sum()) / modes.mass
    return 2 * ceil(0.55 * model.rig.drive.signal.period * sqrt(stiffness * mobility / 2))
