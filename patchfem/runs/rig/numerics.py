"""Numerical choices of a coupled run: engine, steps per cycle, shear modes, quadrature, and what they would cost."""

from dataclasses import dataclass, replace
from math import ceil, log2, pi, sqrt

import numpy as np

from ...core import Missing
from ...effects import has
from ...friction.bonds.list_numbers import AGED, SHARES, form_of
from ...friction.bonds.parameters import LONGEST
from ...model.model import Model
from ...structure.drive_sizes import largest, omega_of, sinusoidal
from ..effort import steps_per_cycle
from .engines import COMPARED, engine_of
from .pieces.costs import pairs_of

COMPARED_STEPS = 400  # per cycle of a comparison method where the scene does not say
DECAYED = 1e-2  # share of the first stroke of a motion that is released, by which its bonds are summed
HELD = 1e-4  # share of the drive's stroke that a block makes which the printed law holds (measured: 1e-2 to 1e-4)
# seconds of a step of it per strip: each of 10 to 50 trial increments splits each strip at u = 0
HELD_STEP = {SHARES: 5e-7, AGED: 1.5e-6}
HELD_ANY = 7e-6  # the same of constant length with an order other than 0, 1, 2
FAST = 2.0  # D from which a block is held fast: 0.6 and more strips per step, against 0.06 at 1.06 and 0.28 at 1.4
TURNING = 0.1  # strokes per step from which they are those of the steps
MOST_CROWDED = 500  # strips of its list, about one per step, from which steps are not halved again: four times the cost
MOST_SWING = 2.0  # radians of the block on its bonds in a step
LEAST_KEPT = 100  # samples of a run that has no cycles


@dataclass(frozen=True, slots=True)
class Numerics:
    """Numerical choices of a run; `pinned` names the ones the scene fixed; shear_modes None: by the tolerance; choice:
    how bonds are summed, None: by the tolerance and the steps; whole: whether the run keeps its histories from before
    the last cycles, which a run for an error need not; local: relative error that a step of the smooth engine may
    make; pairs: how often each two cells of a law's density count as one."""

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

    def finer(self):
        """The choices with four times the cells where some count as one, with twice the steps, or a hundredth of the
        error of each."""
        if self.pairs:
            return replace(self, pairs=max(0, self.pairs - 2))
        return replace(self, local=0.01 * self.local) if self.local else replace(self, steps=2 * self.steps)


def choose(model: Model, per_point: bool = False) -> Numerics:
    """Engine and numerical choices of a coupled run: those of the scene, else what the tolerance asks for.

    per_point: bonds are followed at every node. PatchfemError for a method that cannot do it.
    """
    accuracy, rig, drive = model.accuracy, model.rig, model.rig.drive
    engine = engine_of(model, per_point).name
    window = int(max(1, min(10, rig.cycles // 10)))
    if rig.levels:
        window = min(window, int(rig.level_cycles))
    steps = steps_per_cycle(model)
    if accuracy.steps_per_cycle is None and engine == "march":
        steps = max(steps, unique_steps(model))
    if not sinusoidal(drive) and accuracy.steps_per_cycle is None:
        steps = max(steps, int(np.ceil(LEAST_KEPT / rig.cycles)))
    if accuracy.steps_per_cycle is None and engine == "march":
        steps = ending(steps, rig.cycles)
    pinned = {k for k in ("steps_per_cycle", "tail", "merge", "shear_modes") if getattr(accuracy, k) is not None}
    if engine in COMPARED:
        steps, pinned = accuracy.steps_per_cycle or COMPARED_STEPS, pinned | {"steps_per_cycle"}
    return Numerics(engine, steps, rig.cycles, window, accuracy.shear_modes, per_point or model.side == "lower",
                    frozenset(pinned), local=local_of(accuracy.tolerance) if engine == "smooth" else 0.0,
                    pairs=pairs_of(model) if engine == "piecewise" else 0)


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
    return 4 * min(range(least, least + max(8, least // 8)), key=lambda k: abs(cycles * k - round(cycles * k)))


def unique_steps(model: Model) -> int:
    """Least even number of steps per cycle at which a step of weakening bonds has one solution alone; 0 for other laws.

    dt^2 k_t (eps_0/eps_k - 1)/(2 M) < 1 with k_t = mu_s N/eps_0 and M the mass that the interface moves.
    """
    f, modes = model.friction, model.rig.modes
    if f is None or not has(f.law, "bonds") or f.slip_growth is None or not f.kinetic or f.kinetic >= f.static:
        return 0
    load = model.nominal_load
    stiff = f.static * load / f.bond_length * (f.static / f.kinetic - 1)
    return 2 * ceil(0.55 * model.rig.drive.period * sqrt(stiff * float((modes.slide**2).sum()) / (2 * modes.mass)))


def quadrature_of(model: Model, numerics: Numerics):
    """How the bonds of a nonlocal law are summed, as a Choice of `friction.bonds.engines`.

    The stroke is taken as four times the amplitude that the drive's speed over its frequency gives. That of a motion
    which is released shrinks, and a list of all its bonds would outgrow any room: it is taken as DECAYED times that of
    its start. That of a block which the printed law holds is HELD times what the drive would give.
    """
    if numerics.choice is not None:
        return numerics.choice
    from ...friction.bonds.engines import choose as engine_for

    law, accuracy = model.bonds, model.accuracy
    left = DECAYED if model.rig.kind == "free" else HELD if chatters(model) else 1.0
    stroke = max(4 * left * model.speed / omega_of(model.rig.drive) / law.length, 1e-9)
    tail = None if accuracy.tail is None else max(accuracy.tail, 1e-15)
    return engine_for(law, accuracy.tolerance, stroke, numerics.steps / 2, accuracy.quadrature, tail, accuracy.merge)


def chatters(model: Model) -> bool:
    """Whether the printed law holds the block, D >= FAST of a drive that repeats.

    Its force reaches the limit however small the stroke, so that the stiffness mu_s N/stroke has no bound: the block
    turns back in almost every step, and its list grows by a strip with each.
    """
    f, rig = model.friction, model.rig
    if f is None or not has(f.law, "bonds") or f.reading != "report" or rig.kind == "free":
        return False
    push = rig.force if rig.force else rig.mass * largest(rig.drive)
    return f.static * model.nominal_load >= FAST * push


def crowded(model: Model, numerics: Numerics, book: dict) -> bool:
    """Whether the list of bonds of the printed law has grown too long for steps half as long: by a strip in every few
    steps. Where bonds grow each step leaves a strip, however long the strokes: there the block has to be held."""
    strips = book.get("strips", 0.0)
    if strips <= MOST_CROWDED or model.bonds.reading != "report":
        return False
    return chatters(model) if form_of(model.bonds) == AGED else strips > TURNING * numerics.cycles * numerics.steps


def held_cost(model: Model, numerics: Numerics) -> tuple:
    """Strips at the end of the list of a block that the printed law holds, and the seconds of the run with it."""
    steps = numerics.cycles * numerics.steps
    return steps, _held_step(model.bonds) * steps**2 / 2 * (1 + _probes(model))


def _held_step(law) -> float:
    """Seconds of a step of a held block per strip of its list."""
    any_order = form_of(law) == SHARES and law.order not in (0, 1, 2)
    return HELD_ANY if any_order else HELD_STEP[form_of(law)]


def _probes(model: Model) -> float:
    """Runs of a level that halve the bracket of the onset down to the tolerance, over the cycles of the run."""
    rig = model.rig
    return max(0, ceil(log2(1 / model.accuracy.tolerance))) * rig.level_cycles / rig.cycles if rig.levels else 0.0


def list_cost(model: Model, numerics: Numerics) -> tuple:
    """Expected strips of a shared list of bonds and the seconds of the run with it."""
    found = quadrature_of(model, numerics)
    steps = numerics.cycles * numerics.steps
    strips = min(found.strips, 2 * steps * max(1.0, found.strips)) if found.tail else min(found.strips, 8 * steps)
    return strips, steps * found.seconds * (strips / found.strips if found.strips else 1.0)


def refuse_unresolved(model: Model, numerics: Numerics) -> None:
    """Raise Missing when a step is longer than the block's own swing on its bonds, sqrt(k_t/m) dt > MOST_SWING.

    The motion has nothing to do with the block's then, and every step makes bonds that outlast it: the list grows, and
    the run with its square.
    """
    f, modes, drive = model.friction, model.rig.modes, model.rig.drive
    stiff = f.static * model.nominal_load / f.bond_length * float((modes.slide**2).sum()) / modes.mass
    swing = sqrt(stiff) * drive.period / numerics.steps
    if swing > MOST_SWING:
        wanted = ceil(sqrt(stiff) * drive.period)
        raise Missing(f"a step of {drive.period / numerics.steps:.2g} s does not resolve the block on its bonds, which "
                      f"swings at {sqrt(stiff) / (2 * pi):.3g} Hz; set accuracy.steps_per_cycle = {wanted}, raise "
                      "structure.moving_mass or friction.bond_length, or use reading = \"stretch\" with order = 1", "")


def refuse_costly(model: Model, numerics: Numerics, limit: float = LONGEST) -> None:
    """Raise Missing when the shared bond list of a coupled run would take longer than `limit` seconds."""
    f = model.friction
    if f is None or not has(f.law, "bonds") or quadrature_of(model, numerics).engine == "recursion":
        return
    refuse_unresolved(model, numerics)
    entries, seconds = list_cost(model, numerics)
    if seconds > limit:
        raise Missing(f"the bond list (about {entries:.0f} entries) would take about {seconds:.0f} s, "
                      f"more than {limit:.0f} s; lower drive.cycles or accuracy.steps_per_cycle, loosen accuracy.tail "
                      "or accuracy.merge, or use reading = \"stretch\" with order = 1", "")
