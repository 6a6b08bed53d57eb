"""Sizes, cost and groups of a coupled run, before it runs."""

from dataclasses import replace
from math import inf, pi

import numpy as np

from ... import rates
from ...core import PatchfemError
from ...effects import LAWS, has
from ...friction.bonds import parameters
from ...model.model import Model
from ...response.rows import of_first, of_number
from ...slip import shear_modes
from ...structure.drive_sizes import largest, omega_of
from . import lists
from .costs import exact_words, ringing_and_events, steps_per_cycle
from .engines import ENGINES, PIECES, steady_by
from .numerics import choose

OF_EVENTS = "exact", "piecewise"  # engines whose loop runs as Python where it is over soon
RESAMPLED = *OF_EVENTS, "smooth"  # engines whose last cycles are kept at SAMPLES instants each, not at their steps
SAMPLES = 400  # of a kept cycle, of `dynamics.events.histories` and `dynamics.smooth`
CURVE = 160, 250  # points over a frequency, with those that its bends and its peak ask for: by a map, by a balance
MARCHED = 400.0  # cycles of the marches until a motion repeats, of all steps
RESONANT = 0.02  # of the frequency of a mode, within which a sine drives it at resonance
STIFF = 10.0  # times the stiffness of the mode, from which a link holds the block


def chain(rig) -> dict:
    """Links of the stiffness chain of a Rig by name [N/m]."""
    return {"mode": rig.stiffness} | ({"bonded": rig.bonded} if rig.bonded is not None else {})


def held_stiffness(chain: dict, number: int = 0) -> float:
    """Tangential stiffness [N/m] of the interface of a number, from 0, while nothing slips: its links of a plan's chain
    in series; infinite where all are rigid, 0 of a law that creeps."""
    links = {of_first(name): link for name, link in chain.items() if name not in ("mode", "bonded", "grooves")
             and name == of_number(of_first(name), number)}
    if str(links.get("bonds", "")).startswith("none"):
        return 0.0
    soft = sum(1 / link for link in links.values() if not isinstance(link, str) and link > 0)
    return 1 / soft if soft else inf


def held_by(rig, chain: dict) -> np.ndarray:
    """`held_stiffness` (i,) of every slide of a Rig, infinite without friction; strips have that of their patch."""
    faces = len(rig.interfaces)
    return np.array([held_stiffness(chain, k if k < faces else 0) if faces else inf
                     for k in range(len(rig.modes.interfaces))])


def foreseen(rig, links: dict):
    """A Rig whose modes were measured with a joint that a patch holds, without it by the links of a chain, until the
    patch is pressed; as it was where these hold more than the modes have."""
    try:
        return replace(rig.stuck(held_stiffness(links)), stuck=rig.stuck)
    except PatchfemError:
        return rig


def modes_of(rig, chain: dict) -> list:
    """Name, free and stuck frequency [Hz] of each mode: without the contact, and with it held by the links of a chain;
    None where nothing gives way, and without friction."""
    modes, rows, stiffness = rig.modes, rig.modes.interfaces, held_by(rig, chain)
    if modes.lateral_faces is not None:
        rows, stiffness = np.concatenate([rows, modes.lateral_faces]), np.tile(stiffness, 2)
    named = rig.by_modes and modes.shapes is None
    out = []
    for k, omega in enumerate(modes.omega):
        held = modes.held(rows, stiffness, k)[0]
        out.append({"name": modes.names[k] if named else f"mode {k + 1}", "free_frequency": float(omega) / (2 * pi),
                    "stuck_frequency": None if held is None else held / (2 * pi)})
    return out


def cost(model: Model, per_point: bool, unknowns: dict) -> tuple:
    """Engine, steps of all passes and seconds of a coupled run; sizes that are foreseen go into `unknowns`."""
    numerics = choose(model, per_point)
    engine = ENGINES[numerics.engine]
    steps, seconds = engine.call("cost", model, numerics, unknowns)
    if not engine.steady:
        seconds += kept_samples(numerics) * rates.KEPT_SAMPLE[numerics.engine in OF_EVENTS]
    return numerics.engine, steps, seconds


def kept_samples(numerics) -> float:
    """Samples of the last cycles that a run keeps."""
    each = SAMPLES if numerics.engine in RESAMPLED else numerics.steps
    return float(max(2, numerics.window) * each)


def march_cost(model: Model, numerics, unknowns: dict) -> tuple:
    """Steps of a march and its coarser runs, and their seconds."""
    rig, f, soft = model.rig, model.friction, bool(model.soft)
    steps = int(numerics.cycles * numerics.steps)
    each, points = _step(rig, f), unknowns.get("interface_points", 1)
    if model.grooves is not None:
        each = _of_modes(numerics, points, unknowns, True) if soft else rates.CLIMB
    elif f is not None and has(f.law, "bonds"):
        if lists.quadrature_of(model, numerics).engine != "recursion":
            entries, seconds = lists.bonds_cost(model, numerics)
            each, unknowns["bond_list_about"] = seconds / steps, int(entries)
        elif soft:
            each += _of_modes(numerics, points, unknowns, rig.load_varies)
        elif numerics.per_point:
            each = rates.FIELD_NODE * points
    elif soft and rig.load_varies:
        each = _of_modes(numerics, points, unknowns, True)
    elif soft:
        each = rates.SLIP_NODE * points + rates.LIST_STEP
    elif rig.soft:
        each += rates.SLIP_NODE * points
    elif rig.load_varies and model.patch is not None:
        each = rates.PRESSING_STEP + rates.PRESSING_NODE * points
    passes = 0.75 + 2**(lists.halvings(model) + 1) - 1  # a half and a quarter of the steps, and each halving of them
    return int(steps * passes), steps * passes * each


def _step(rig, f) -> float:
    """Seconds of a step of a march: of one mode and interface, more where bonds grow or interfaces move each other."""
    faces = len(rig.interfaces)
    grows = f is not None and f.slip_growth is not None and has(f.law, "bonds")
    return (rates.BOND_STEP + rates.STEP_MODE * (len(rig.frequencies) - 1)) * (rates.GROWS if grows else 1.0) * (
        rates.JOINT * faces if faces > 1 else 1.0)


def _of_modes(numerics, points: int, unknowns: dict, load_varies: bool) -> float:
    """Seconds of a step behind shear modes, whose number goes into `unknowns`."""
    unknowns["shear_modes"] = numerics.shear_modes or shear_modes.SHEAR_MODES
    return rates.behind_modes(points, unknowns["shear_modes"], load_varies)


def groups(model: Model) -> dict:
    """Dimensionless groups of the motion by name, those without a meaning left out.

    D: static friction limit over the largest force of the drive, which is D of 2.3 at resonance; D_kinetic: that of the
    kinetic limit, where it is another; knee [m s-2], or knee_force [N] of a drive by force: input beyond which friction
    alone does not bound a motion at resonance, that of a block that slides.
    """
    out, f, rig = {}, model.friction, model.rig
    limits = [one.limits(model.nominal_load if one.load is None else one.load) for one in rig.interfaces]
    limit, kinetic = (sum(one[k] for one in limits) for k in range(2))
    push = rig.force if rig.force else rig.mass * largest(rig.drive)
    if push > 0:
        out |= {"D": limit / push} | ({} if kinetic == limit else {"D_kinetic": kinetic / push})
    ratio = rig.own_frequency * rig.drive.period if rig.frequency else inf
    if abs(ratio - 1) < 0.2:
        bound = 4 / pi * kinetic * _lever(rig)
        out |= {"knee_force": bound} if rig.force else {"knee": bound / rig.mass}
    if f is not None and f.bond_length and f.stiffness is None and rig.drive.moving:
        out["drive_amplitude_over_bond_length"] = largest(rig.drive) / omega_of(rig.drive)**2 / f.bond_length
    return out


def run_away(model: Model) -> dict:
    """{`drive`: acceleration of the base, `knee`: that above which friction alone does not limit the amplitude} [m s-2]
    of one mode that a sine drives at its resonance; {} of another rig."""
    rig = model.rig
    if rig is None or not rig.waveform.is_sine or rig.force or rig.modes.omega.size != 1 or not rig.by_modes \
            or abs(rig.own_frequency * rig.drive.period - 1) > RESONANT:
        return {}
    knee = groups(model).get("knee")
    return {} if not knee else {"drive": float(largest(rig.drive)), "knee": float(knee)}


def _lever(rig) -> float:
    """slide_1/base_1, by which friction acts on the first mode that is not rigid over what the drive does; 1 where the
    scene lists no modes, or nothing drives that one."""
    first = int(np.flatnonzero(rig.modes.omega > 0)[0]) if rig.own_frequency else 0
    slide, base = abs(float(rig.modes.slide[first])), abs(float(rig.modes.base[first]))
    return slide / base if rig.by_modes and base > 0 else 1.0


def first_words(rig, found: dict, chain: dict) -> list:
    """The sentence on D of one mode: whether the block sticks, and whether friction bounds its motion.

    chain: links of the stiffness chain by name; one that is not STIFF beside the mode lets a block move that sticks.
    """
    d = found.get("D")
    if d is None or rig.modes.omega.size != 1 or not rig.by_modes or rig.kind == "free":
        return []
    d *= _lever(rig)
    soft = [name for name, link in chain.items() if name != "mode" and not isinstance(link, str)
            and link < STIFF * rig.stiffness]
    if d >= 1 and soft:
        return [f"D = {d:.3g} >= 1, but the block still moves, because the interface is elastic: its stiffness "
                f"({soft[-1]}) is {chain[soft[-1]]:.4g} N/m and the stiffness of the mode is {rig.stiffness:.4g} N/m"]
    if d >= 1:
        return [f"D = {d:.3g} >= 1: friction should hold the block, so that it sticks"]
    if "D_kinetic" in found:  # a block that slides is braked by the kinetic limit
        sliding = found["D_kinetic"] * _lever(rig)
        return [f"D = {d:.3g} is below 1, so that the block slips; with the kinetic coefficient {_sliding(sliding)}"]
    return [_sliding(d)]


def _sliding(d: float) -> str:
    """The sentence on a block that slips at D < 1."""
    if d > pi / 4:
        return f"D = {d:.3g} lies between pi/4 and 1: at resonance the block alternates between stick and slip"
    return f"D = {d:.3g} is below pi/4: at resonance friction alone does not limit the amplitude"


def sum_words(model: Model) -> list:
    """Sentences on how the engine of a rig takes its law."""
    if model.friction is None:
        return []
    numerics = choose(model)
    return ENGINES[numerics.engine].call("words", model, numerics)


def steady_words(model: Model, numerics) -> list:
    """The sentence on how a steady motion is found."""
    return [f"the steady motion is found by {steady_by(model).words}"]


def summed_words(model: Model, numerics) -> list:
    """Sentences on how the bonds of law 'nonlocal' are summed, or on which engine takes elements that stick or slip."""
    if not has(model.friction.law, "bonds"):
        return [] if PIECES.lacks(model) else exact_words(model, numerics.engine)
    found = lists.quadrature_of(model, numerics)
    out = ["method of the sum over bonds: " + found.said()]
    if found.engine == "recursion":
        return out
    if lists.lists_grow(model):
        stiff = "set friction.order above 0 to give the block a stiffness" if lists.limp(model) else \
            "set friction.reading = \"stretch\" to give the block a finite stiffness"
        out.append(f"{_held_words(model)}; {stiff}")
    if (seconds := lists.bonds_cost(model, numerics)[1]) > parameters.LONGEST:
        out.append("`run` will refuse this scene: the sum over the list of bonds would need a computing time of about "
                   f"{seconds:.0f} s, more than the limit of {parameters.LONGEST:.0f} s")
    return out


def _held_words(model: Model) -> str:
    """How bonds hold the block whose list of them grows."""
    turns = "the block reverses its motion in almost every time step, and each reversal makes the list of bonds longer"
    if lists.stalls(model):
        return ("with the law as printed in the report the block does not slide after its release: it vibrates on its "
                "bonds or reverses its motion in almost every time step; the estimated computing time is that of the "
                "slowest case")
    if lists.limp(model):
        return f"bonds of order 0 keep the block from sliding, but they have no stiffness: {turns}"
    if lists.chatters(model):
        return f"with the law as printed in the report the block does not slide at all: {turns}"
    return ("with the law as printed in the report the block hardly slides at one or more of the drive levels: the "
            "list of bonds becomes longer in every time step")


def steady_cost(model: Model, numerics, unknowns: dict) -> tuple:
    """Points of a curve of steady motions and the seconds that they take, those of coarser runs and of one with more
    modes of a reduced structure among them."""
    rig, by = model.rig, steady_by(model).name
    points = CURVE[by == "balance"] if rig.waveform.is_swept else max(1, len(rig.levels))
    soft = [one for one in rig.interfaces if one.soft or model.soft] if by == "yields" else ()
    passes = 1.0 + 0.5 * len(soft)  # a coarser mesh of each has half the elements
    seconds = points * passes * _steady_point(model, by)
    if rig.richer is not None:
        seconds += points * _steady_point(replace(model, rig=rig.richer), by)
    return points, seconds


def _steady_point(model: Model, by: str) -> float:
    """Seconds of a point of a curve of steady motions that is found `by` the finder of that name."""
    rig = model.rig
    if by == "balance":
        size = 2.0 * (model.accuracy.harmonics or 0) * max(1, len(rig.interfaces))
        return rates.BALANCED_POINT + rates.BALANCE * size**3 + _smooth_laws(rig)
    if by == "march":
        return MARCHED * steps_per_cycle(model) * rates.CLIMB
    if not rig.interfaces:
        return rates.CLOSED_POINT
    ringing, events = ringing_and_events(model)
    return rates.MAPPED_POINT + rates.EVENT * len(rig.frequencies) * events + ringing * (
        rates.RINGING_PIECE + rates.RINGING_MODES * len(rig.frequencies)**2)


def _smooth_laws(rig) -> float:
    """Seconds that a balanced point takes besides where a law changes its slope all the cycle long: elements that stick
    and slip have the same one for most of it."""
    laws = {one.numbers.law for one in rig.interfaces}
    flowing = any("pieces" not in LAWS[law].carries.split() and not has(law, "memoryless") for law in laws)
    smooth = flowing or rig.bends or any(has(law, "creeps") for law in laws)
    size = 2 * len(rig.frequencies) + len(rig.interfaces)
    return flowing * rates.FLOWING_POINT + smooth * rates.MULTIPLIERS[flowing] * size**3
