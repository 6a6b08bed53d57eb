"""Numerical choices of a coupled run: engine, steps per cycle, shear modes, quadrature, and what they would cost."""

from dataclasses import dataclass, replace
from math import ceil, sqrt

import numpy as np

from ...effects import law_has_trait
from ...model.model import Model
from ...structure.drive_sizes import is_sinusoidal, min_decay_rate, repeat_cycles
from .costs import pairs_of, steps_per_cycle
from .engines import engine_of

# of a cycle by which a run may miss a whole number of them: a record of 30 periods has 30
WHOLE = 1e-6
SETTLED = 3.0  # decay times after which a start has e^-6 of its mean square left
LEAST_KEPT = 100  # samples of a run that has no cycles


@dataclass(frozen=True, slots=True)
class Numerics:
    """Numerical choices of a run; `pinned` names the ones the scene fixed; shear_modes None: by the tolerance; choice:
    how bonds are summed, None: by the tolerance and the steps; whole: whether the run keeps its histories from before
    the last cycles, which a run for an error need not; local: relative error that a step of the smooth engine may
    make; pairs: how often each two cells of a law's density count as one; joined: (how many of those do so besides in a
    run for an error, from which on), () for none; richer: whether the run has more modes of a reduced structure;
    meshed: numbers of the interfaces whose patches are those on a coarser mesh."""

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

    def finer(self):
        """The choices with four times the cells where some count as one, with twice the steps, or a hundredth of the
        error of each."""
        if self.pairs:
            return replace(self, pairs=max(0, self.pairs - 2))
        return (
            replace(self, local=0.01 * self.local)
            if self.local
            else replace(self, steps=2 * self.steps)
        )


def choose(model: Model, per_point: bool = False) -> Numerics:
    """Engine and numerical choices of a coupled run: those of the scene, else what the tolerance asks for.

    per_point: bonds are followed at every node. PatchfemError for a method that cannot do it.
    """
    accuracy, rig = model.accuracy, model.rig
    engine = engine_of(model, per_point)
    window = int(max(1, min(10, (rig.drive.cycles + WHOLE) // 10)))
    if rig.drive.waveform.is_random:  # all of the record but what the start leaves
        rate = min_decay_rate(rig.modes) * rig.drive.signal.period
        start = min(rig.drive.cycles / 4, SETTLED / rate if rate else np.inf)
        window = int(max(1, rig.drive.cycles - start + WHOLE))
    beat = repeat_cycles(rig.drive.signal) or 0.0
    if 1 < beat <= rig.drive.cycles:  # whole beats
        window = int(beat * max(1, min(10, rig.drive.cycles // (10 * beat))) + WHOLE)
    if rig.drive.levels.amplitudes:
        window = min(window, int(rig.drive.levels.cycles + WHOLE))
    steps = steps_per_cycle(model)
    if not is_sinusoidal(rig.drive.signal) and accuracy.steps_per_cycle is None:
        steps = max(steps, int(np.ceil(LEAST_KEPT / rig.drive.cycles)))
    pinned = {
        k
        for k in ("steps_per_cycle", "tail", "merge", "shear_modes")
        if getattr(accuracy, k) is not None
    }
    found = Numerics(
        engine.name,
        steps,
        rig.drive.cycles,
        window,
        accuracy.shear_modes,
        per_point or model.side == "lower",
        frozenset(pinned),
    )
    return engine.call("chosen", model, found) or found


def by_steps(model: Model, found: Numerics) -> Numerics:
    """The choices of a march: steps that have one solution each, and end where the run ends."""
    if "steps_per_cycle" in found.pinned:
        return found
    return replace(
        found, steps=ending(max(found.steps, unique_steps(model)), model.rig.drive.cycles)
    )


def by_error(model: Model, found: Numerics) -> Numerics:
    """The choices of the smooth engine: the error of a step."""
    return replace(found, local=local_of(model.accuracy.tolerance))


def by_pieces(model: Model, found: Numerics) -> Numerics:
    """The choices of the engine of yields: how finely a density is cut."""
    return replace(found, pairs=pairs_of(model))


def local_of(tolerance: float) -> float:
    """Relative error of a step of the smooth engine: the energy balance asks for 1e-9 where the tolerance does not."""
    return float(np.clip(1e-3 * tolerance, 1e-12, 1e-9))


def ending(steps: int, cycles: float) -> int:
    """Steps per cycle, at least `steps` and four times a whole number, as a half and a quarter of them show the order.

    A run ends at a sample, and the last of `cycles` need not be whole. An end off by half a step is an error of first
    order in all that is read off the last cycles. So that number ends as near as an eighth more steps allows.
    """
    least = ceil(steps / 4)
    if cycles == round(cycles):
        return 4 * least
    return 4 * min(
        range(least, least + max(8, least // 8)), key=lambda k: abs(cycles * k - round(cycles * k))
    )


def unique_steps(model: Model) -> int:
    """Least even number of steps per cycle at which a step of weakening bonds has one solution alone; 0 for other laws.

    dt^2 k_t (eps_0/eps_k - 1)/(2 M) < 1 with k_t = mu_s N/eps_0 and M the mass that the interface moves.
    """
    f, modes = model.friction, model.rig.modes
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
