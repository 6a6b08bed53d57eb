"""Numerical settings of a coupled run: engine, steps per cycle, window, shear modes.

In: a Model. Out: `Numerics` by its scene, else by its tolerance (`choose_numerics`).
"""

from dataclasses import dataclass, replace
from math import ceil, sqrt

import numpy as np

from ...effects import law_has_trait
from ...model.model import Model
from ...structure.drive_sizes import count_repeat_cycles, find_min_decay_rate, is_sinusoidal
from .costs import MARCH_SETTINGS, count_merges, steps_per_cycle
from .engines import MARCH, PIECES, SMOOTH, choose_engine

# fraction of a cycle by which a whole number of cycles may be missed by round-off, so that a record of 30
# periods has 30 cycles
WHOLE_CYCLE_TOL = 1e-6
N_DECAY_TIMES = 3.0  # decay times of a transient, which reduce its mean square to e^-6
MIN_SAMPLES = 100  # smallest number of samples of a run whose drive is not sinusoidal


@dataclass(frozen=True, slots=True)
class Numerics:
    """Numerical settings of a run of a rig.

    - engine: name of the engine.
    - steps: time steps per cycle.
    - cycles, window: cycles of the run, and of the window at its end.
    - shear_modes: number of shear modes; None: by the tolerance.
    - per_point: whether bonds are followed at every node.
    - pinned: settings that the scene fixed.
    - choice: method of the sum over bonds; None: by the tolerance and the steps.
    - whole: whether the run keeps its histories from before the window; a coarse run need not.
    - local: relative error that a step of the smooth engine may have.
    - pairs: how often neighbouring cells of a density are merged in pairs.
    - joined: (number of cells that a coarse run merges into one, first cell of the merging); () for
      none.
    - richer: whether the run has more modes of a reduced structure.
    - meshed: indices of the interfaces whose patches are those on a coarser mesh.
    - coarse_patch: whether the patch of [contact] is that on a coarser mesh.
    """

    engine: str
    steps: int
    cycles: float
    window: int
    shear_modes: int | None
    per_point: bool
    pinned: frozenset
    choice: object = None
    whole: bool = True
    local: float = 0.0
    pairs: int = 0
    joined: tuple = ()
    richer: bool = False
    meshed: tuple = ()
    coarse_patch: bool = False

    def finer(self):
        """Return refined settings for the next run.

        The next run has four times as many cells if cells are merged; else a hundredth of the error
        of a step of the smooth engine, or twice as many steps.
        """
        if self.pairs:
            return replace(self, pairs=max(0, self.pairs - 2))
        if self.local:
            return replace(self, local=0.01 * self.local)
        return replace(self, steps=2 * self.steps)


def choose_numerics(model: Model) -> Numerics:
    """Choose the engine and the numerical settings of a run of a rig.

    Parameters
    ----------
    model : Model

    Raises
    ------
    PatchfemError
        For a method that cannot do it.
    """
    accuracy = model.accuracy
    rig = model.rig
    engine = choose_engine(model)
    window = int(max(1, min(10, (rig.drive.cycles + WHOLE_CYCLE_TOL) // 10)))
    # under a random drive, the evaluated window is the whole record except the transient at its start
    if rig.drive.waveform.is_random:
        rate = find_min_decay_rate(rig.modes) * rig.drive.signal.period
        start = min(rig.drive.cycles / 4, N_DECAY_TIMES / rate if rate else np.inf)
        window = int(max(1, rig.drive.cycles - start + WHOLE_CYCLE_TOL))
    beat = count_repeat_cycles(rig.drive.signal) or 0.0
    if 1 < beat <= rig.drive.cycles:  # the evaluated window contains whole periods of the beat
        window = int(beat * max(1, min(10, rig.drive.cycles // (10 * beat))) + WHOLE_CYCLE_TOL)
    if rig.drive.levels.amplitudes:
        window = min(window, int(rig.drive.levels.cycles + WHOLE_CYCLE_TOL))
    steps = steps_per_cycle(model)
    if not is_sinusoidal(rig.drive.signal) and accuracy.steps_per_cycle is None:
        steps = max(steps, int(np.ceil(MIN_SAMPLES / rig.drive.cycles)))
    pinned = {key for key in MARCH_SETTINGS if getattr(accuracy, key) is not None}
    numerics = Numerics(
        engine.name,
        steps,
        rig.drive.cycles,
        window,
        accuracy.shear_modes,
        model.side == "lower",
        frozenset(pinned),
    )
    if engine is SMOOTH:
        return replace(numerics, local=step_tolerance(accuracy.tolerance))
    if engine is PIECES:
        return replace(numerics, pairs=count_merges(model))
    if engine is MARCH and accuracy.steps_per_cycle is None:
        # the steps are short enough for a unique solution, and the last step ends where the run ends
        steps = round_steps_to_run_end(max(steps, min_unique_steps(model)), rig.drive.cycles)
        return replace(numerics, steps=steps)
    return numerics


def step_tolerance(tolerance: float) -> float:
    """Return the relative error that one step of the smooth engine may have.

    The energy balance requires 1e-9 if the tolerance does not require less.
    """
    return float(np.clip(1e-3 * tolerance, 1e-12, 1e-9))


def round_steps_to_run_end(steps: int, cycles: float) -> int:
    """Round steps per cycle up so that a sample lies nearest to the requested end of a run.

    The steps are a multiple of 4, because runs with a half and a quarter of them show the order. A run
    ends at a sample, and the last of its `cycles` may be incomplete. An end that is wrong by half a
    step is an error of first order in all measures of the last cycles. Up to an eighth more steps
    are tried.
    """
    least = ceil(steps / 4)
    if cycles == round(cycles):
        return 4 * least
    return 4 * min(
        range(least, least + max(8, least // 8)), key=lambda k: abs(cycles * k - round(cycles * k))
    )


def min_unique_steps(model: Model) -> int:
    """Return the smallest even number of steps per cycle with a unique solution in each step.

    It is 0 except for bonds that weaken, which need dt^2 k_t (eps_0/eps_k - 1)/(2 M) < 1, with k_t = mu_s
    N/eps_0 and the mass M that the interface moves.
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
