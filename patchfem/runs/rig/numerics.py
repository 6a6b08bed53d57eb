"""Numerical settings of a run of a rig: engine, steps per cycle, window and shear modes.

In: a Model. Out: its `Numerics`, set by the scene or else by the tolerance (`choose_numerics`).
"""

from dataclasses import dataclass, replace
from math import ceil, sqrt

import numpy as np

from ... import hybrid
from ...effects import law_has_trait
from ...model.model import Model
from ...structure.drive_sizes import find_max_frequency_ratio, find_min_decay_rate, is_sinusoidal
from .engines import HYBRID, MARCH, Engine, choose_engine

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
    - whole: whether the run stores the histories before the window; coarse runs may omit them.
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
    choice: object = None
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
