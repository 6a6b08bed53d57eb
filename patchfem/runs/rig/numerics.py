"""Numerical choices of a coupled run: engine, steps per cycle, shear modes, quadrature, and what they would cost."""

from dataclasses import dataclass, replace
from math import ceil, inf, log2, pi, sqrt

import numpy as np

from ...core import Missing
from ...effects import has
from ...friction.bonds.list_numbers import AGED, SHARES, form_of
from ...friction.bonds.parameters import LONGEST
from ...model.model import Model
from ...structure.drive_sizes import fastest, largest, omega_of, sinusoidal
from ..effort import steps_per_cycle
from .engines import engine_of
from .pieces.costs import pairs_of

COMPARED_STEPS = 400  # per cycle of a comparison method where the scene does not say
DECAYED = 1e-2  # share of the first stroke of a motion that is released, by which its bonds are summed
HELD = 1e-4  # share of the drive's stroke that a block makes which the printed law holds (measured: 1e-2 to 1e-4)
# seconds of a step of it per step before: half of them leave a strip, and each of 4 to 30 trial increments splits each
# strip at u = 0; half as many of them in 2000 steps and more as in some hundred (measured: 3e-8 to 4e-7, 1e-6 to 1e-5)
HELD_STEP = {SHARES: 8e-8, AGED: 1.5e-6}
HELD_ANY = 2e-6  # the same of constant length with an order other than 0, 1, 2
# and of a released block that stalls: 10 to 50 trial increments where it turns back in every step (measured: 14 s of
# 2784 steps, 14 s more of four runs with a half and a quarter of them)
STALLED_STEP = 4e-6
LIMP_STEP = 2.7e-6  # and of bonds of order 0 that hold a block: 50 trial increments (measured: 2.75e-6 of 2880 steps)
# and of growing bonds that hold the block, but not fast: it turns back with its drive alone, in 2 or 3 trial increments
LEANING_STEP = 2e-7
FAST = 2.0  # D from which a block is held fast: 0.6 and more strips per step, against 0.06 at 1.06 and 0.28 at 1.4
TURNING = 0.1  # strokes per step from which they are those of the steps
MOST_CROWDED = 500  # strips of its list, about one per step, from which steps are not halved again: four times the cost
MOVES, MOST_HALVINGS = 1e-3, 2  # bond lengths of slip from which a block moves; of the steps that were seen: 0 to 3
WHOLE = 1e-6  # of a cycle by which a run may miss a whole number of them: a record of 30 periods has 30
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
    accuracy, rig = model.accuracy, model.rig
    engine = engine_of(model, per_point)
    window = int(max(1, min(10, (rig.cycles + WHOLE) // 10)))
    if rig.levels:
        window = min(window, int(rig.level_cycles + WHOLE))
    steps = steps_per_cycle(model)
    if not sinusoidal(rig.drive) and accuracy.steps_per_cycle is None:
        steps = max(steps, int(np.ceil(LEAST_KEPT / rig.cycles)))
    pinned = {k for k in ("steps_per_cycle", "tail", "merge", "shear_modes") if getattr(accuracy, k) is not None}
    found = Numerics(engine.name, steps, rig.cycles, window, accuracy.shear_modes, per_point or model.side == "lower",
                     frozenset(pinned))
    return engine.ask("chosen", model, found) or found


def by_steps(model: Model, found: Numerics) -> Numerics:
    """The choices of a march: steps that have one solution each, and end where the run ends."""
    if "steps_per_cycle" in found.pinned:
        return found
    return replace(found, steps=ending(max(found.steps, unique_steps(model)), model.rig.cycles))


def by_named_steps(model: Model, found: Numerics) -> Numerics:
    """The choices of a comparison method, whose steps no error chooses."""
    return replace(found, steps=model.accuracy.steps_per_cycle or COMPARED_STEPS,
                   pinned=found.pinned | {"steps_per_cycle"})


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

    The stroke is taken as four times the amplitude that the drive's speed over its frequency gives, or that the bonds
    of a block give which they hold. That of a motion which is released, or pushed once, shrinks, and a list of all its
    bonds would outgrow any room: it is taken as DECAYED times that of its start. That of a block which the printed law
    holds is HELD times what the drive would give.
    """
    return numerics.choice or _summed_by(model, numerics, _stretch(model), model.accuracy.quadrature)


def _summed_by(model: Model, numerics: Numerics, stretch: float, engine: str):
    """The Choice of `quadrature_of` by an engine, or "auto", for a block that bonds let move by `stretch` lengths."""
    from ...friction.bonds.engines import choose as engine_for

    law, accuracy = model.bonds, model.accuracy
    once = model.rig.kind == "free" or model.rig.waveform == "step"
    left = HELD if chatters(model) else DECAYED if once else 1.0
    stroke = max(4 * left * min(model.speed / omega_of(model.rig.drive) / law.length, stretch), 1e-9)
    tail = None if accuracy.tail is None else max(accuracy.tail, 1e-15)
    return engine_for(law, accuracy.tolerance, stroke, numerics.steps / 2, engine, tail, accuracy.merge)


def _stretch(model: Model, least: float = FAST) -> float:
    """Bond lengths by which a drive moves a block that its bonds hold by their stiffness mu_s N/eps_0; inf where they
    do not hold it, their limit `least` times what that takes, or the printed law gives them no stiffness."""
    f, rig = model.friction, model.rig
    if f.reading == "report" or rig.kind == "free":
        return inf
    needed, limit = holding(rig), f.static * model.nominal_load
    return needed / limit if limit >= least * needed else inf


def halvings(model: Model) -> int:
    """How often steps that the scene leaves open will be halved for a block that its bonds hold, which then swings on
    them faster than its modes and its drive do: until that swing has as many steps as those would get, MOST_HALVINGS
    times at most. A stretch that is elastic but for a share below MOVES, half of its square, is met at once."""
    rig, f = model.rig, model.friction
    if f is None or not has(f.law, "bonds") or model.accuracy.steps_per_cycle is not None:
        return 0
    stretch = _stretch(model)
    if stretch == inf or stretch**2 / 2 < MOVES:
        return 0
    quickest = max(fastest(rig.drive) / rig.drive.period, float(rig.frequencies.max()))
    return min(max(0, ceil(log2(_bond_swing(model) / (2 * pi * quickest)))), MOST_HALVINGS)


def _bond_swing(model: Model) -> float:
    """Circular frequency [rad/s] of the block on its bonds, sqrt(k_t/m)."""
    f, modes = model.friction, model.rig.modes
    return sqrt(f.static * model.nominal_load / f.bond_length * float((modes.slide**2).sum()) / modes.mass)


def chatters(model: Model) -> bool:
    """Whether the printed law holds the block: its limit is FAST times what holding it takes, or more, under a drive.

    Its force reaches the limit however small the stroke, so that the stiffness mu_s N/stroke has no bound: the block
    turns back in almost every step, and its list grows by a strip with each.
    """
    f, rig = model.friction, model.rig
    if f is None or not has(f.law, "bonds") or f.reading != "report" or rig.kind == "free":
        return False
    return f.static * model.nominal_load >= FAST * holding(rig)


def stalls(model: Model) -> bool:
    """Whether growing bonds of the printed law hold a released block from its start on: their limit is FAST times the
    force of the spring, or more.

    The block then swings on its bonds, or turns back in almost every step as one that `chatters`; which of both, the
    length of the step decides by chance (at 232 steps per cycle the one, at 230 and 234 the other).
    """
    f, rig = model.friction, model.rig
    if f is None or not has(f.law, "bonds") or f.reading != "report" or rig.kind != "free" or rig.start is None:
        return False
    if form_of(model.bonds) != AGED:
        return False
    return f.static * model.nominal_load >= FAST * _held_with(rig, 0.0, np.zeros(rig.modes.omega.size),
                                                              rig.modes.interfaces @ rig.start.z)


def limp(model: Model) -> bool:
    """Whether bonds of order 0 hold the block: they pull alike at any stretch, which is no stiffness, so that it turns
    back in almost every step and leaves a strip with each."""
    f, rig = model.friction, model.rig
    if f is None or not has(f.law, "bonds") or f.reading == "report" or model.bonds.order != 0 or rig.kind == "free":
        return False
    return f.static * model.nominal_load >= holding(rig, gentlest(rig))


def lists_grow(model: Model) -> bool:
    """Whether a law without stiffness holds the block at some time of the run, so that its list grows with every
    step."""
    return chatters(model) or stalls(model) or limp(model) or _held_level(model) > 0


def _held_level(model: Model) -> float:
    """Limit of the printed law over what holding its gentlest level takes, where a list grows at that; else 0.

    It grows from FAST on, and from 1 on where bonds grow: each step leaves a strip there, which no path wears away.
    """
    f, rig = model.friction, model.rig
    if f is None or not has(f.law, "bonds") or f.reading != "report" or rig.kind == "free":
        return 0.0
    limit, needed = f.static * model.nominal_load, holding(rig, gentlest(rig))
    least = 1.0 if form_of(model.bonds) == AGED else FAST
    return limit / needed if needed and limit >= least * needed else 0.0


def gentlest(rig) -> float:
    """Least push [m s-2] that the drive of a Rig stays at: of levels half the first one, where the search of the onset
    begins, or the least of them."""
    return min(rig.levels[0] / 2, *rig.levels) if rig.levels else largest(rig.drive)


def holding(rig, push: float | None = None) -> float:
    """Peak force [N] on the first interface that keeps all interfaces of a Rig still under a sine of its drive, of its
    largest push [m s-2] unless one is given.

    Of one mode it is mass times acceleration times base/slide, whatever the frequency; modes that go on moving behind
    the interfaces bring their own. inf where nothing holds them: an interface that no mode slides, or an undamped
    resonance behind it.
    """
    modes = rig.modes
    size = largest(rig.drive) if push is None else push
    return _held_with(rig, omega_of(rig.drive), modes.base * size, np.zeros(len(modes.interfaces)))


def _held_with(rig, omega: float, push, slides) -> float:
    """Size of the force [N] on the first interface that keeps the slides (i,) [m] of all of them, beside a push (n,)
    [m s-2] on the modes that goes as exp(i omega t); inf where no forces do."""
    modes, n = rig.modes, rig.modes.omega.size
    faces = modes.interfaces
    moves = np.diag(modes.omega**2 - omega**2) + 1j * omega * modes.dampers
    whole = np.block([[moves, faces.T / modes.mass], [faces, np.zeros((len(faces), len(faces)))]])
    try:
        return float(abs(np.linalg.solve(whole, np.append(push, slides))[n]))
    except np.linalg.LinAlgError:
        return inf


def crowded(model: Model, numerics: Numerics, book: dict) -> bool:
    """Whether the list of bonds of the printed law has grown too long for steps half as long: by a strip in every few
    steps. Where bonds grow each step leaves a strip, however long the strokes: there the block has to be held."""
    strips = book.get("strips", 0.0)
    if strips <= MOST_CROWDED or model.bonds.reading != "report":
        return False
    return lists_grow(model) if form_of(model.bonds) == AGED else strips > TURNING * numerics.cycles * numerics.steps


def held_cost(model: Model, numerics: Numerics) -> tuple:
    """Strips at the end of the list of a block that the printed law holds, and the seconds of the run with it: of one
    that was released the most of both."""
    steps = numerics.cycles * numerics.steps
    if stalls(model):
        return steps, STALLED_STEP * steps**2 / 2
    moving = list_cost(model, numerics)[1] / steps
    if not model.rig.levels:
        return steps, _held_seconds(model, largest(model.rig.drive), 0.0, steps, moving)
    sizes, size = model.rig.levels, model.rig.level_cycles * numerics.steps
    seconds = sum(_held_seconds(model, push, k * size, (k + 1) * size, moving) for k, push in enumerate(sizes))
    # the search of the onset begins from nought, with a list of its own
    return steps, seconds + sum(_held_seconds(model, sizes[0] / 2**k, 0.0, size, moving)
                                for k in range(1, 1 + _probes(model)))


def _held_seconds(model: Model, push: float, first: float, last: float, moving: float) -> float:
    """Seconds of the steps from number `first` to `last` under a sine of this push [m s-2], each of which counts the
    strips that those before it have left; moving: seconds of a step of a block that moves, which leaves none."""
    needed = holding(model.rig, push)
    ratio = model.friction.static * model.nominal_load / needed if needed else inf
    if ratio < (1.0 if form_of(model.bonds) == AGED or limp(model) else FAST):
        return moving * (last - first)
    if limp(model):
        return LIMP_STEP * (last**2 - first**2) / 2
    return (_held_step(model.bonds) if ratio >= FAST else LEANING_STEP) * (last**2 - first**2) / 2


def bonds_cost(model: Model, numerics: Numerics) -> tuple:
    """Strips of a shared list of bonds and the seconds of the run with it, of a block that is held or moves."""
    return (held_cost if lists_grow(model) else list_cost)(model, numerics)


def _held_step(law) -> float:
    """Seconds of a step of a held block per strip of its list."""
    any_order = form_of(law) == SHARES and law.order not in (0, 1, 2)
    return HELD_ANY if any_order else HELD_STEP[form_of(law)]


def _probes(model: Model) -> int:
    """Runs of a level that halve the bracket of the onset from nought down to the tolerance."""
    return max(0, ceil(log2(1 / model.accuracy.tolerance)))


def list_cost(model: Model, numerics: Numerics) -> tuple:
    """Expected strips of a shared list of bonds and the seconds of the run with it; a block that its bonds just hold
    leaves a list as long as one that they hold fast."""
    found = quadrature_of(model, numerics)
    if found.engine != "recursion" and numerics.choice is None:
        found = _summed_by(model, numerics, _stretch(model, 1.0), found.engine)
    steps = numerics.cycles * numerics.steps
    strips = min(found.strips, 2 * steps * max(1.0, found.strips)) if found.tail else min(found.strips, 8 * steps)
    return strips, steps * found.seconds * (strips / found.strips if found.strips else 1.0)


def refuse_unresolved(model: Model, numerics: Numerics) -> None:
    """Raise Missing when a step is longer than the block's own swing on its bonds, sqrt(k_t/m) dt > MOST_SWING.

    The motion has nothing to do with the block's then, and every step makes bonds that outlast it: the list grows, and
    the run with its square.
    """
    drive, pace = model.rig.drive, _bond_swing(model)
    swing = pace * drive.period / numerics.steps
    if swing > MOST_SWING:
        wanted = ceil(pace * drive.period)
        raise Missing(f"a step of {drive.period / numerics.steps:.2g} s does not resolve the block on its bonds, which "
                      f"swings at {pace / (2 * pi):.3g} Hz; set accuracy.steps_per_cycle = {wanted}, raise "
                      "structure.moving_mass or friction.bond_length, or use reading = \"stretch\" with order = 1", "")


def refuse_costly(model: Model, numerics: Numerics, limit: float = LONGEST) -> None:
    """Raise Missing when the shared bond list of a coupled run would take longer than `limit` seconds."""
    f = model.friction
    if f is None or not has(f.law, "bonds") or quadrature_of(model, numerics).engine == "recursion":
        return
    refuse_unresolved(model, numerics)
    entries, seconds = bonds_cost(model, numerics)
    if seconds > limit:
        raise Missing(f"the bond list (about {entries:.0f} entries) would take about {seconds:.0f} s, "
                      f"more than {limit:.0f} s; lower drive.cycles or accuracy.steps_per_cycle, loosen accuracy.tail "
                      "or accuracy.merge, or use reading = \"stretch\" with order = 1", "")
