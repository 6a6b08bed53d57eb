"""Method of bond summation for a rig, and the limits of its bond list.

In: a Model and its Numerics. Out: the EngineChoice of the bond summation (`choose_bond_summation`), and the refusal of time
steps that do not resolve the vibration of the block on its bonds.
"""

from dataclasses import replace
from functools import lru_cache
from math import ceil, inf, pi, sqrt

import numpy as np

from ...core import Missing
from ...effects import law_has_trait
from ...friction.bonds import engines
from ...model.model import Model
from ...structure.drive_sizes import find_drive_omega, find_max_acceleration
from ..bench import engine as bench_engine
from ..bench.contact_points import sums_over_lists
from .engines import Numerics

# Ratio of the stroke that bond summation has to resolve to the first stroke of a released motion.
DECAYED_STROKE_RATIO = 1e-2
# Assumed ratio of the stroke of a block held by the printed law to the stroke of the drive
# (measured: 1e-2 to 1e-4).
STICKING_STROKE_RATIO = 1e-4
# Smallest ratio of friction limit to drive force (D) at which a block counts as stuck. Above it 0.6
# or more strips remain per step, compared with 0.06 at D = 1.06 and 0.28 at D = 1.4.
MIN_STUCK_FORCE_RATIO = 2.0
# Largest phase [rad] per step of the vibration of the block on its bonds.
MAX_BOND_VIBRATION_PHASE = 2.0


@lru_cache(maxsize=8)
def choose_bond_summation(model: Model, numerics: Numerics):
    """Choose the method of bond summation of a nonlocal law in a rig.

    A law that needs no bond list has the recursion, which is exact. Otherwise the method depends on the stroke, i.e. the
    path between two reversals of the motion. It is four times the amplitude that follows from the speed scale and the
    frequency of the drive, or from the stiffness of the bonds if they hold the block. If the motion decays (release,
    step), the stroke is reduced to DECAYED_STROKE_RATIO, because a list of all bonds would need too much memory. For a
    block held by the law as printed in the 1985 report it is reduced to STICKING_STROKE_RATIO. Of several interfaces, the
    narrowest strips serve all lists.
    """
    if numerics.choice is not None:
        return numerics.choice
    choices = []
    for number, part in enumerate(_split_by_interface(model)):
        if sums_over_lists(part):
            choices.append(_choose_summation(part, numerics, number))
    return min(choices, key=lambda choice: choice.merge, default=engines.RECURSION)


def _split_by_interface(model: Model) -> list[Model]:
    """Return a model for each interface, with its law and load; for a single interface the model itself."""
    interfaces = model.rig.friction.interfaces
    if len(interfaces) < 2:
        return [model]
    parts = []
    for interface in interfaces:
        point = replace(model.point, load=interface.load)
        parts.append(replace(model, friction=interface.numbers, point=point))
    return parts


def has_bond_list(model: Model) -> bool:
    """Return whether an interface needs a list of all bonds that have formed, over which its force is summed."""
    if model.friction is None:
        return False
    return any(map(sums_over_lists, _split_by_interface(model)))


def _choose_summation(model: Model, numerics: Numerics, number: int):
    """Return how the bonds of interface `number` are summed, as a `friction.bonds.engines.EngineChoice`.

    The error of a summation depends on the stroke between two reversals: 4 times the displacement amplitude of the drive,
    but at most that of a block held by its bonds, both in bond lengths. `model` has the law of the interface, and
    `numerics` the steps per cycle.
    """
    engine = bench_engine.find_requested_engine(model)
    stretch = _estimate_held_displacement(model, number)
    law = model.bonds
    accuracy = model.accuracy
    drive = model.rig.drive
    ratio = 1.0
    if is_stuck_by_printed_law(model, number):
        ratio = STICKING_STROKE_RATIO
    elif drive.kind == "free" or drive.waveform.is_step:
        ratio = DECAYED_STROKE_RATIO
    amplitude = model.speed_scale / find_drive_omega(drive.signal) / law.length
    stroke = max(4 * ratio * min(amplitude, stretch), 1e-9)
    tail = None if accuracy.tail is None else max(accuracy.tail, 1e-15)
    requested = engines.RequestedEngine(engine, tail, accuracy.merge)
    return engines.choose_engine(law, accuracy.tolerance, stroke, numerics.steps / 2, requested)


def _estimate_held_displacement(model: Model, number: int) -> float:
    """Return the displacement, in bond lengths, of a driven block that sticks on its bonds.

    The stiffness of the bonds is mu_s N/eps_0. The result is inf if the friction limit is below
    MIN_STUCK_FORCE_RATIO times the holding force, or if the printed law gives the bonds no stiffness.
    """
    f = model.friction
    if f.reading == "report" or model.rig.drive.kind == "free":
        return inf
    ratio = _find_holding_ratio(model, number)
    return 1 / ratio if ratio >= MIN_STUCK_FORCE_RATIO else inf


def _find_holding_ratio(model: Model, number: int) -> float:
    """Return the friction limit of interface `number` of a model over the force that holds it at rest."""
    limit = model.friction.static * model.nominal_load
    holding_force = compute_holding_force(model.rig, number)
    return limit / holding_force if holding_force else inf


def is_stuck_by_printed_law(model: Model, number: int = 0) -> bool:
    """Return whether the friction law of a `model` as printed in the report holds interface `number` at rest.

    The block then reverses in almost every step, and each reversal adds a strip to its list.
    """
    return (
        model.rig.drive.kind != "free"
        and model.friction is not None
        and law_has_trait(model.friction.law, "bonds")
        and model.friction.reading == "report"
        and _find_holding_ratio(model, number) >= MIN_STUCK_FORCE_RATIO
    )


def compute_holding_force(rig, number: int = 0) -> float:
    """Return the peak force [N] on interface `number` of a rig when all interfaces are held at rest.

    For a single mode it is mass times acceleration times the ratio of base to slide participation,
    at any frequency. Several modes continue to vibrate while the interfaces stick, and add inertia
    forces. The force is inf if no mode moves an interface, or at an undamped resonance.
    """
    modes = rig.modes
    n = modes.omega.size
    interfaces = modes.interfaces
    omega = find_drive_omega(rig.drive.signal)

    # Harmonic motion exp(i omega t) of the modes, with the forces at the interfaces that hold their slides at 0.
    moves = np.diag(modes.omega**2 - omega**2) + 1j * omega * modes.damping_matrix
    whole = np.block(
        [
            [moves, interfaces.T / modes.mass],
            [interfaces, np.zeros((len(interfaces), len(interfaces)))],
        ]
    )
    push = modes.base * find_max_acceleration(rig.drive.signal)
    try:
        return float(
            abs(np.linalg.solve(whole, np.append(push, np.zeros(len(interfaces))))[n + number])
        )
    except np.linalg.LinAlgError:
        return inf


def refuse_unresolved_bond_vibration(model: Model, numerics: Numerics) -> None:
    """Raise Missing if a bond list is summed and the time step does not resolve the vibration of the block on its bonds.

    The condition is sqrt(k_t/m) dt <= MAX_BOND_VIBRATION_PHASE. With a longer step the motion would be
    meaningless, and every step would leave permanent bonds, so that the CPU time would increase
    with the square of the number of steps.
    """
    if not has_bond_list(model) or model.partial_slip:
        return

    # Highest frequency of the block on the bonds of one interface, with the mass that this interface moves
    modes = model.rig.modes
    drive = model.rig.drive.signal
    omega = 0.0
    for part, interface, row in zip(
        _split_by_interface(model), model.rig.friction.interfaces, modes.interfaces
    ):
        if sums_over_lists(part) and not interface.partial_slip:
            f = part.friction
            mobility = float((row**2).sum()) / modes.mass
            omega = max(omega, sqrt(f.static * part.nominal_load / f.bond_length * mobility))

    phase = omega * drive.period / numerics.steps
    if phase > MAX_BOND_VIBRATION_PHASE:
        wanted = ceil(omega * drive.period)
        raise Missing(
            f"a time step of {drive.period / numerics.steps:.2g} s is too long for the vibration of the "
            f"block on its bonds, at {omega / (2 * pi):.3g} Hz; set accuracy.steps_per_cycle = {wanted}, "
            'raise structure.moving_mass or friction.bond_length, or use reading = "stretch" with '
            "order = 1",
            "",
        )
