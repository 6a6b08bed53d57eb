"""How the bonds of a rig are summed, and what a list of them costs: of a block that moves, or that its bonds hold.

A law without stiffness, the printed one and that of order 0, holds a block by turning back in almost every step, and
each turn leaves a strip in the list: its cost grows with the square of the steps.
"""

from functools import lru_cache
from math import ceil, inf, log2, pi, sqrt
from time import thread_time

import numpy as np

from ...core import Missing
from ...effects import law_has_trait
from ...friction.bonds import engines
from ...friction.bonds.list_forms_kernels import PRINTED_GROWING
from ...friction.bonds.list_numbers import form_of
from ...friction.bonds.parameters import LONGEST
from ...model.model import Model
from ...structure.drive_sizes import drive_omega, max_acceleration, max_frequency_ratio
from ..bench import engine as bench_engine
from .numerics import Numerics

# share of the first stroke of a motion that is released, by which its bonds are summed
DECAYED_FRACTION = 1e-2
HELD = 1e-4  # share of the drive's stroke that a block makes which the printed law holds (measured: 1e-2 to 1e-4)
# s per step and strip of a list that grows with every step (measured: 8e-8 to 4e-6)
GROWING_STEP = 1e-6
# D from which a block is held fast: 0.6 and more strips per step, against 0.06 at 1.06 and 0.28 at 1.4
MIN_STUCK_RATIO = 2.0
TURNING = 0.1  # strokes per step from which they are those of the steps
MOST_CROWDED = 500  # strips of its list, about one per step, from which steps are not halved again: four times the cost
# bond lengths of slip from which a block moves; of the steps that were seen: 0 to 3
MOVES, MOST_HALVINGS = (
    1e-3,
    2,
)
SHEARED = 256.0  # lists of a patch behind shear, times the passes that Newton's method makes more than secants
MOST_SWING = 2.0  # radians of the block on its bonds in a step


@lru_cache(maxsize=8)
def quadrature_of(model: Model, numerics: Numerics):
    """How the bonds of a nonlocal law are summed, as a Choice of `friction.bonds.engines`.

    The stroke is taken as four times the amplitude that the drive's speed over its frequency gives, or that the bonds
    of a block give which they hold. That of a motion which is released, or pushed once, shrinks, and a list of all its
    bonds would outgrow any room: it is taken as DECAYED_FRACTION times that of its start. That of a
    block which the printed law holds is HELD times what the drive would give.
    """
    return numerics.choice or _summed_by(
        model, numerics, _stretch(model), bench_engine.engine_named(model)
    )


def has_list(model: Model, numerics: Numerics) -> bool:
    """Return whether the bonds of a model are summed in a list."""
    f = model.friction
    return (
        f is not None
        and law_has_trait(f.law, "bonds")
        and quadrature_of(model, numerics).engine != "recursion"
    )


def _summed_by(model: Model, numerics: Numerics, stretch: float, engine: str):
    """The Choice of `quadrature_of` by an engine, or "auto", for a block that bonds let move by `stretch` lengths."""
    law, accuracy = model.bonds, model.accuracy
    once = model.rig.drive.kind == "free" or model.rig.drive.waveform.is_step
    left = HELD if chatters(model) else DECAYED_FRACTION if once else 1.0
    stroke = max(
        4
        * left
        * min(model.speed_scale / drive_omega(model.rig.drive.signal) / law.length, stretch),
        1e-9,
    )
    tail = None if accuracy.tail is None else max(accuracy.tail, 1e-15)
    return engines.choose(
        law, accuracy.tolerance, stroke, numerics.steps / 2, engine, tail, accuracy.merge
    )


def _stretch(model: Model, least: float = MIN_STUCK_RATIO) -> float:
    """Bond lengths by which a drive moves a block that its bonds hold by their stiffness mu_s N/eps_0; inf where they
    do not hold it, their limit `least` times what that takes, or the printed law gives them no stiffness."""
    f, rig = model.friction, model.rig
    if f.reading == "report" or rig.drive.kind == "free":
        return inf
    needed, limit = force_that_holds(rig), f.static * model.nominal_load
    return needed / limit if limit >= least * needed else inf


def halvings(model: Model) -> int:
    """How often steps that the scene leaves open will be halved for a block that its bonds hold, which then swings on
    them faster than its modes and its drive do: until that swing has as many steps as those would get, MOST_HALVINGS
    times at most. A stretch that is elastic but for a share below MOVES, half of its square, is met at once."""
    rig, f = model.rig, model.friction
    if f is None or not law_has_trait(f.law, "bonds") or model.accuracy.steps_per_cycle is not None:
        return 0
    stretch = _stretch(model)
    if stretch == inf or stretch**2 / 2 < MOVES:
        return 0
    quickest = max(
        max_frequency_ratio(rig.drive.signal) / rig.drive.signal.period,
        float(rig.structure.frequencies.max()),
    )
    return min(max(0, ceil(log2(_bond_swing(model) / (2 * pi * quickest)))), MOST_HALVINGS)


def _bond_swing(model: Model) -> float:
    """Circular frequency [rad/s] of the block on its bonds, sqrt(k_t/m)."""
    f, modes = model.friction, model.rig.modes
    return sqrt(
        f.static * model.nominal_load / f.bond_length * float((modes.slide**2).sum()) / modes.mass
    )


def held_by_bonds(model: Model, push: float | None = None) -> float:
    """Limit of the bonds of a law without stiffness over the force that holds the block; 0 of other laws.

    The printed law reaches its limit however small the stroke, so that its stiffness mu_s N/stroke has no bound; bonds
    of order 0 pull alike at any stretch. A block of a list of growing bonds that is released is held by its spring
    alone: it then swings on its bonds, or turns back in almost every step, which of both the length of the step decides
    by chance (at 232 steps per cycle the one, at 230 and 234 the other). push [m s-2]: of the drive, None: its largest.
    """
    f, rig = model.friction, model.rig
    if f is None or not law_has_trait(f.law, "bonds"):
        return 0.0
    released, printed = rig.drive.kind == "free", f.reading == "report"
    if (
        released and (not printed or rig.start is None or form_of(model.bonds) != PRINTED_GROWING)
    ) or (not printed and model.bonds.order != 0):
        return 0.0
    needed = (
        _held_with(rig, 0.0, np.zeros(rig.modes.omega.size), rig.modes.interfaces @ rig.start.z)
        if released
        else force_that_holds(rig, push)
    )
    return f.static * model.nominal_load / needed if needed else inf


def least_held(model: Model) -> float:
    """What `held_by_bonds` is at least where a list grows with every step: MIN_STUCK_RATIO; 1 of a driven
    block where each step leaves a strip, which no path wears away: bonds that grow, or have no stiffness by their order."""
    leaves = form_of(model.bonds) == PRINTED_GROWING or model.friction.reading != "report"
    return 1.0 if leaves and model.rig.drive.kind != "free" else MIN_STUCK_RATIO


def chatters(model: Model) -> bool:
    """Whether the printed law holds a driven block fast: it turns back in almost every step, and its list grows by a
    strip with each."""
    return (
        model.rig.drive.kind != "free"
        and model.friction is not None
        and model.friction.reading == "report"
        and held_by_bonds(model) >= MIN_STUCK_RATIO
    )


def stalls(model: Model) -> bool:
    """Whether growing bonds of the printed law hold a released block fast from its start on."""
    return model.rig.drive.kind == "free" and held_by_bonds(model) >= MIN_STUCK_RATIO


def limp(model: Model) -> bool:
    """Whether bonds of order 0 hold the block."""
    return lists_grow(model) and model.friction.reading != "report"


def lists_grow(model: Model) -> bool:
    """Whether a law without stiffness holds the block at some time of the run, so that its list grows with every
    step. Pieces that give way in shear have a stiffness, and the lists of their points are merged."""
    if model.partial_slip:
        return False
    most = held_by_bonds(model, gentlest(model.rig))
    return most > 0 and most >= least_held(model)


def gentlest(rig) -> float:
    """Least push [m s-2] that the drive of a Rig stays at: of levels half the first one, where the search of the onset
    begins, or the least of them."""
    levels = rig.drive.levels.amplitudes
    return min(levels[0] / 2, *levels) if levels else max_acceleration(rig.drive.signal)


def force_that_holds(rig, push: float | None = None) -> float:
    """Peak force [N] on the first interface that keeps all interfaces of a Rig still under a sine of its drive, of its
    largest push [m s-2] unless one is given.

    Of one mode it is mass times acceleration times base/slide, whatever the frequency; modes that go on moving behind
    the interfaces bring their own. inf where nothing holds them: an interface that no mode slides, or an undamped
    resonance behind it.
    """
    modes = rig.modes
    size = max_acceleration(rig.drive.signal) if push is None else push
    return _held_with(
        rig, drive_omega(rig.drive.signal), modes.base * size, np.zeros(len(modes.interfaces))
    )


def _held_with(rig, omega: float, push, slides) -> float:
    """Size of the force [N] on the first interface that keeps the slides (i,) [m] of all of them, beside a push (n,)
    [m s-2] on the modes that goes as exp(i omega t); inf where no forces do."""
    modes, n = rig.modes, rig.modes.omega.size
    faces = modes.interfaces
    moves = np.diag(modes.omega**2 - omega**2) + 1j * omega * modes.damping_matrix
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
    return (
        lists_grow(model)
        if form_of(model.bonds) == PRINTED_GROWING
        else strips > TURNING * numerics.cycles * numerics.steps
    )


def in_vain(book: dict, bars: list) -> bool:
    """Whether a motion on a list of bonds is known no better after two doublings of its steps than before them; bars
    [m]: its errors, one doubling after the other. A released block that turns back in almost every step has another
    list at any step (errors of 71, 509, 139, 39 and 97 times the tolerance): the next doublings cost four and eight
    times as much."""
    return book.get("strips", 0.0) > 0 and len(bars) > 2 and bars[-1] >= bars[-3]


def list_cost(model: Model, numerics: Numerics) -> tuple[float, float]:
    """Return the expected strips of a list of bonds and the CPU seconds of a run with it.

    A list that grows with every step is expected to take all strips; its seconds hold within a factor of about 12,
    because the increments that a step tries depend on the motion. `ListGuard` stops a run that takes too long.
    """
    steps = numerics.cycles * numerics.steps
    if lists_grow(model):
        return steps, GROWING_STEP * steps**2 / 2
    found = quadrature_of(model, numerics)
    if found.engine != "recursion" and numerics.choice is None:
        found = _summed_by(model, numerics, _stretch(model, 1.0), found.engine)
    strips = (
        min(found.strips, 2 * steps * max(1.0, found.strips))
        if found.tail
        else min(found.strips, 8 * steps)
    )
    lists = SHEARED if model.partial_slip else 1.0
    return strips, lists * steps * found.seconds * (strips / found.strips if found.strips else 1.0)


class ListGuard:
    """Progress of a march with a list of bonds, which is stopped if it would take too long.

    A list grows or keeps its length. So all steps take at least as long as those so far over their fraction of all.
    """

    def __init__(self, progress=None):
        self.progress = progress
        # CPU seconds and fraction at the first call, so that compiling does not count
        self.start = None

    def __call__(self, fraction: float) -> None:
        """Pass the fraction of the steps on that is done; Missing if all of them would take more than LONGEST."""
        now = thread_time()
        if self.start is None:
            self.start = now, fraction
        spent, done = now - self.start[0], fraction - self.start[1]
        if done > 0 and spent > LONGEST / 60 and spent > LONGEST * done:
            raise Missing(_too_long(spent / done), "")
        if self.progress is not None:
            self.progress(fraction)


def _too_long(seconds: float, entries: float | None = None) -> str:
    """Return the refusal of a run whose list of bonds takes too long."""
    length = "" if entries is None else f" (about {entries:.0f} entries)"
    return (
        f"the sum over the list of bonds{length} would need a computing time of about {seconds:.0f} s, more than "
        f"the limit of {LONGEST:.0f} s; lower drive.cycles or accuracy.steps_per_cycle, raise accuracy.tail or "
        'accuracy.merge, or use reading = "stretch" with order = 1'
    )


def refuse_unresolved(model: Model, numerics: Numerics) -> None:
    """Raise Missing when a step is longer than the block's own swing on its bonds, sqrt(k_t/m) dt > MOST_SWING.

    The motion has nothing to do with the block's then, and every step makes bonds that outlast it: the list grows, and
    the run with its square.
    """
    drive, pace = model.rig.drive.signal, _bond_swing(model)
    swing = pace * drive.period / numerics.steps
    if swing > MOST_SWING:
        wanted = ceil(pace * drive.period)
        raise Missing(
            f"a time step of {drive.period / numerics.steps:.2g} s is too long for the vibration of the "
            f"block on its bonds, at {pace / (2 * pi):.3g} Hz; set accuracy.steps_per_cycle = {wanted}, "
            'raise structure.moving_mass or friction.bond_length, or use reading = "stretch" with '
            "order = 1",
            "",
        )


def refuse_long_list(model: Model, numerics: Numerics) -> None:
    """Raise Missing if the list of bonds of a coupled run would take too long.

    The seconds of a list that grows are uncertain: its run is stopped when it turns out to be too long.
    """
    if not has_list(model, numerics):
        return
    if not model.partial_slip:
        refuse_unresolved(model, numerics)
    entries, seconds = list_cost(model, numerics)
    if seconds > LONGEST and not lists_grow(model):
        raise Missing(_too_long(seconds, entries), "")
