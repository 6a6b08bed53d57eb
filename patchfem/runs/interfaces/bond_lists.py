"""Method by which the bonds of an interface are summed, and the limits of its bond list.

In: a Model. Out: the EngineChoice of the bond summation of a rig or a bench, and the refusal of time steps that do not
resolve the vibration of the block on its bonds.
"""

from dataclasses import replace
from functools import lru_cache
from math import ceil, inf, pi, sqrt

import numpy as np

from ... import friction, structure
from ...core import Missing
from ...effects import law_has_trait, needs_bond_list
from ...model.model import Model

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
MIN_STROKE = 1e-9  # shortest stroke in bond lengths, so that an interface at rest has a finite list


def sums_over_lists(model: Model, keys=None) -> bool:
    """Return whether the bonds of a law are summed one by one; without its keys, of the first interface of a model.

    A list keeps the load under which a bond formed, but the bonds of order 1 break as the load falls. So a named sum does
    not replace their recursion under a load that changes.
    """
    keys = keys or model.friction
    if not law_has_trait(keys.law, "bonds") or needs_bond_list(keys):
        return needs_bond_list(keys)
    changes = model.load_varies or model.grooves is not None
    if model.rig is not None:
        changes = changes or model.rig.friction.load_varies
    return not changes and model.accuracy.quadrature not in ("auto", "recursion")


def has_bond_list(model: Model) -> bool:
    """Return whether an interface of a rig needs a list of all bonds that have formed, over which its force is summed."""
    return any(sums_over_lists(model, law.numbers) for law in model.rig.friction.interfaces)


def _choose_sum(model: Model, keys, tolerance: float, stroke: float, steps: float):
    """Return how the bonds of a law are summed, as a `friction.bonds.engines.EngineChoice`.

    A list of each point becomes "merged", if the scene does not name a sum and the bonds keep the pressure at which they
    formed: each step adds a strip to every list.

    Parameters
    ----------
    model : Model
        Its [accuracy] may name the sum and its settings.
    keys : Friction
        Effective keys of the law.
    tolerance : float
        Relative tolerance of the sum.
    stroke, steps : float
        Path between two reversals [bond lengths], and steps on it.
    """
    accuracy = model.accuracy
    name = "auto"
    if sums_over_lists(model, keys):
        has_separate_lists = model.side == "lower" or (model.rig is not None and model.load_varies)
        name = "merged" if has_separate_lists else "auto"
        if accuracy.quadrature not in ("auto", "recursion"):
            name = accuracy.quadrature
    tail = None if accuracy.tail is None else max(accuracy.tail, 1e-15)
    engines = friction.bonds.engines
    requested = engines.RequestedEngine(name, tail, accuracy.merge)
    return engines.choose_engine(model.make_bonds(keys), tolerance, stroke, steps, requested)


@lru_cache(maxsize=8)
def choose_bond_summation(model: Model, numerics):
    """Choose the method of bond summation of a nonlocal law in a rig, at the steps of its `Numerics`.

    A law that needs no bond list has the recursion, which is exact. Otherwise the method depends on the stroke, i.e. the
    path between two reversals of the motion. It is four times the amplitude that follows from the speed scale and the
    frequency of the drive, or from the stiffness of the bonds if they hold the block: mu_s N/eps_0. If the motion decays
    (release, step), the stroke is reduced to DECAYED_STROKE_RATIO, because a list of all bonds would need too much memory.
    For a block held by the law as printed in the 1985 report it is reduced to STICKING_STROKE_RATIO. Of several interfaces,
    the narrowest strips serve all lists.
    """
    if numerics.space.choice is not None:
        return numerics.space.choice
    drive = model.rig.drive
    choices = []
    for number, interface in enumerate(model.rig.friction.interfaces):
        keys = interface.numbers
        if not sums_over_lists(model, keys):
            continue

        # Amplitude of the block relative to the bond length: that of free motion, or that of bonds which hold it
        amplitude = (
            model.speed_scale
            / structure.drive_sizes.find_drive_omega(drive.signal)
            / keys.bond_length
        )
        if keys.reading != "report" and not drive.is_release:
            holding = _find_holding_ratio(model, number)
            amplitude = min(amplitude, 1 / holding if holding >= MIN_STUCK_FORCE_RATIO else inf)

        # Late strokes of a motion that decays are much shorter, and need narrow strips.
        ratio = 1.0
        if is_stuck_by_printed_law(model, number):
            ratio = STICKING_STROKE_RATIO
        elif drive.is_release or drive.waveform.is_step:
            ratio = DECAYED_STROKE_RATIO
        stroke = max(4 * ratio * amplitude, MIN_STROKE)
        choices.append(
            _choose_sum(model, keys, model.accuracy.tolerance, stroke, numerics.steps / 2)
        )
    return min(choices, key=lambda choice: choice.merge, default=friction.bonds.engines.RECURSION)


def choose_slide_summation(model: Model, slide, *, is_smooth: bool = False):
    """Choose the method of bond summation for an interface whose points all follow a slide; None for laws without a list.

    Its error refers to the largest force, which is small for strokes that are short compared with the bond length. With
    merging, the summation error jumps when a parameter changes, which disturbs a fit.

    Parameters
    ----------
    model : Model
        Model of a bench.
    slide : (k,) array
        Relative displacement [m].
    is_smooth : bool
        Whether the force has to be smooth in the parameters, so that strips are not merged unless the scene says so.
    """
    if not sums_over_lists(model):
        return None
    # Mean path between two reversals, and mean number of steps that move on it.
    moves = np.diff(slide)
    directions = np.sign(moves[moves != 0])
    count = 1 + np.count_nonzero(directions[1:] != directions[:-1])
    stroke = float(np.abs(moves).sum()) / count / model.friction.bond_length
    stroke = max(stroke, MIN_STROKE)
    tolerance = model.accuracy.tolerance * min(1.0, stroke)
    steps = max(directions.size / count, 1.0)
    choice = _choose_sum(model, model.friction, tolerance, stroke, steps)
    is_free = model.accuracy.quadrature == "auto" and model.accuracy.merge is None
    if is_smooth and is_free and choice.engine == "merged":
        return replace(choice, engine="truncated", merge=0.0, error=choice.tail)
    return choice


def find_interface_load(model: Model, interface) -> float:
    """Return the normal load [N] on an interface; that of the model for an interface without a load of its own."""
    return model.nominal_load if interface.load is None else interface.load


def _find_holding_ratio(model: Model, number: int) -> float:
    """Return the friction limit of interface `number` of a model over the force that holds it at rest."""
    interface = model.rig.friction.interfaces[number]
    limit = interface.numbers.static * find_interface_load(model, interface)
    holding_force = compute_holding_force(model.rig, number)
    return limit / holding_force if holding_force else inf


def is_stuck_by_printed_law(model: Model, number: int = 0) -> bool:
    """Return whether the friction law of a `model` as printed in the report holds interface `number` at rest.

    The block then reverses in almost every step, and each reversal adds a strip to its list.
    """
    if model.rig.drive.is_release or model.friction is None:
        return False
    keys = model.rig.friction.interfaces[number].numbers
    is_printed = law_has_trait(keys.law, "bonds") and keys.reading == "report"
    return is_printed and _find_holding_ratio(model, number) >= MIN_STUCK_FORCE_RATIO


def compute_holding_force(rig, number: int = 0) -> float:
    """Return the peak force [N] on interface `number` of a rig when all interfaces are held at rest.

    For a single mode it is mass times acceleration times the ratio of base to slide participation,
    at any frequency. Several modes continue to vibrate while the interfaces stick, and add inertia
    forces. The force is inf if no mode moves an interface, or at an undamped resonance.
    """
    modes = rig.modes
    interfaces = modes.interfaces
    omega = structure.drive_sizes.find_drive_omega(rig.drive.signal)

    # Harmonic motion exp(i omega t) of the modes, with the forces at the interfaces that hold their slides at 0.
    moves = np.diag(modes.omega**2 - omega**2) + 1j * omega * modes.damping_matrix
    held = np.zeros(len(interfaces))
    whole = np.block([[moves, interfaces.T / modes.mass], [interfaces, np.diag(held)]])
    push = modes.base * structure.drive_sizes.find_max_acceleration(rig.drive.signal)
    try:
        return float(abs(np.linalg.solve(whole, np.append(push, held))[modes.omega.size + number]))
    except np.linalg.LinAlgError:
        return inf


def refuse_unresolved_bond_vibration(model: Model, numerics) -> None:
    """Raise Missing if a bond list is summed and the time step does not resolve the vibration of the block on its bonds.

    The condition is sqrt(k_t/m) dt <= MAX_BOND_VIBRATION_PHASE. With a longer step the motion would be
    meaningless, and every step would leave permanent bonds, so that the CPU time would increase
    with the square of the number of steps.
    """
    if not has_bond_list(model) or model.partial_slip:
        return

    # Highest frequency of the block on the bonds of one interface, with the mass that this interface moves
    modes = model.rig.modes
    period = model.rig.drive.signal.period
    omega = 0.0
    for number, interface in enumerate(model.rig.friction.interfaces):
        keys = interface.numbers
        if sums_over_lists(model, keys) and not interface.partial_slip:
            mobility = float((modes.interfaces[number] ** 2).sum()) / modes.mass
            stiffness = keys.static * find_interface_load(model, interface) / keys.bond_length
            omega = max(omega, sqrt(stiffness * mobility))

    if omega * period / numerics.steps > MAX_BOND_VIBRATION_PHASE:
        raise Missing(
            f"a time step of {period / numerics.steps:.2g} s is too long for the vibration of the "
            f"block on its bonds, at {omega / (2 * pi):.3g} Hz; set accuracy.steps_per_cycle = {ceil(omega * period)}, "
            'raise structure.moving_mass or friction.bond_length, or use reading = "stretch" with '
            "order = 1",
            "",
        )
