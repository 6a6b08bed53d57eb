"""Predicted cost, stiffnesses, frequencies and dimensionless groups of a rig for a plan.

In: a Model. Out: `Cost` of its engine, the stiffness chain, natural frequencies with free and stuck
interfaces, dimensionless groups, and sentences for the plan.
"""

from dataclasses import replace
from math import inf, pi

import numpy as np

from ... import cost_model
from ...dynamics.march import capacity
from ...effects import LAWS, law_has_trait
from ...friction.bonds import parameters
from ...model.model import Model
from ...response.rows import add_interface_number, remove_interface_number
from ...slip import shear_modes
from ...structure.drive_sizes import find_drive_omega, find_max_acceleration
from ..cost import (
    BALANCE_CODE,
    EVENT_CODE,
    MARCH_CODE,
    SHEAR_MARCH_CODE,
    Cost,
    EngineCode,
    MemoryPart,
)
from . import bond_lists
from .costs import (
    MARCH_HISTORY,
    count_intervals_by_cause,
    count_stored_samples,
    describe_element_engine,
    find_interface_load,
    predict_event_driven_cost,
    predict_history_memory,
    predict_hybrid_cost,
    steps_per_cycle,
)
from .engines import ENGINES, PIECES, choose_steady_method
from .numerics import choose_numerics

# Memory [bytes] per pair of modes: matrices, mode shapes and workspace of the eigenvalue solver.
MODE_PAIR_BYTES = 125.0
# Memory [bytes] per pair of unknowns of harmonic balance: Jacobian, and factors for the error
# estimate.
HARMONIC_PAIR_BYTES = 94.0
MODE_NODE_BYTES = 24.0  # Memory per shear mode and interface node [bytes].
DRIVE_ROW_BYTES = 400.0  # Memory per row of a recorded drive [bytes].
STEADY_CODES = {
    "exact": EVENT_CODE,
    "piecewise": EVENT_CODE,
    "harmonic": BALANCE_CODE,
    "march": None,
}
# Expected number of points of a response curve, including those near its peak and bends.
N_MAPPED_POINTS = 160  # Number of points of a curve by event maps or time steps.
# Number of points of a curve by harmonic balance, which follows its folds.
N_BALANCE_POINTS = 250
N_MARCHED_CYCLES = 400.0  # Expected number of integrated cycles until a motion is periodic.
# Largest relative difference between the frequencies of drive and mode at which the mode counts as
# resonant.
RESONANCE_TOL = 0.02
# Smallest ratio of link stiffness to modal stiffness at which the link holds the block nearly at
# rest.
MIN_STIFF_LINK_RATIO = 10.0


def structure_stiffnesses(rig) -> dict:
    """Return a dict of the stiffnesses [N/m] of the structure in the stiffness chain."""
    return {"mode": rig.first_mode.stiffness} | (
        {"bonded": rig.springs.bonded} if rig.springs.bonded is not None else {}
    )


def stuck_interface_stiffness(chain: dict, index: int = 0) -> float:
    """Return the tangential stiffness [N/m] of a stuck interface, whose links act in series.

    It is inf if all links are rigid, and 0 for a law that creeps.

    Parameters
    ----------
    chain : dict
        Stiffness chain of a plan by name.
    index : int
        Index of the interface.
    """
    links = {}
    for name, link in chain.items():
        plain_name = remove_interface_number(name)
        is_own = name == add_interface_number(plain_name, index)
        if is_own and name not in ("mode", "bonded", "grooves"):
            links[plain_name] = link
    if str(links.get("bonds", "")).startswith("none"):
        return 0.0
    soft = sum(1 / link for link in links.values() if not isinstance(link, str) and link > 0)
    return 1 / soft if soft else inf


def stuck_stiffnesses(rig, chain: dict) -> np.ndarray:
    """Return the tangential stiffness (i,) [N/m] of each stuck interface of a rig.

    Strips have the stiffness of their patch. Without friction the stiffness is inf. A patch that was
    solved to subtract a bolted joint has its own stiffness instead of that of the chain.
    """
    bolted = rig.structure.bolted
    if bolted is not None and bolted.stuck_stiffness is not None:
        return np.full(len(rig.modes.interfaces), bolted.stuck_stiffness)
    n_interfaces = len(rig.friction.interfaces)
    stiffness = np.full(len(rig.modes.interfaces), inf)
    if n_interfaces:
        for k in range(stiffness.size):
            stiffness[k] = stuck_interface_stiffness(chain, k if k < n_interfaces else 0)
    return stiffness


def mode_frequencies(rig, chain: dict) -> list:
    """Return name, free and stuck frequency [Hz] of each mode as a list of dicts.

    The stuck frequency is that with stuck interfaces. It is None without friction and if no link of
    the stiffness chain is compliant.
    """
    modes = rig.modes
    rows = rig.modes.interfaces
    stiffness = stuck_stiffnesses(rig, chain)
    has_names = rig.structure.lists_modes and modes.shapes is None
    frequencies = []
    for k, omega in enumerate(modes.omega):
        stuck_omega = modes.compute_stuck_mode(rows, stiffness, k)[0]
        frequencies.append(
            {
                "name": modes.names[k] if has_names else f"mode {k + 1}",
                "free_frequency": float(omega) / (2 * pi),
                "stuck_frequency": None if stuck_omega is None else stuck_omega / (2 * pi),
            }
        )
    return frequencies


def predict_cost(model: Model, n_points: int) -> Cost:
    """Predict the cost of a run of a rig.

    Parameters
    ----------
    model : Model
    n_points : int
        Number of interface nodes; 1 without a patch.
    """
    rig = model.rig
    numerics = choose_numerics(model)
    n_modes = len(rig.structure.frequencies)
    rows = len(getattr(rig.drive.signal, "breaks", ())) if not rig.drive.signal.segments else 0
    rows_key = "drive.file" if "file" in rig.drive.waveform.required_keys else "drive.duration"
    structure = MemoryPart(MODE_PAIR_BYTES * n_modes**2, f"{n_modes} modes", "structure")
    drive = MemoryPart(DRIVE_ROW_BYTES * rows, f"{rows} rows of the drive", rows_key)
    sentences = ()
    if model.friction is not None:
        sentences = tuple(_describe_method(model, numerics))
    rig_cost = Cost(
        parts=(structure, drive), words=sentences, sizes={"modes": n_modes}, engine=numerics.engine
    )
    return rig_cost + COSTS[numerics.engine](model, numerics, n_points)


def _describe_method(model: Model, numerics) -> list:
    """Describe the method that computes the motion in sentences for a plan."""
    if ENGINES[numerics.engine].finds_periodic_motion:
        return [f"the steady motion is found by {choose_steady_method(model).words}"]
    return describe_bond_summation(model, numerics)


def predict_march_cost(model: Model, numerics, n_points: int) -> Cost:
    """Predict the cost of a time integration and its coarse runs.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    n_points : int
        Number of interface nodes.
    """
    rig = model.rig
    f = model.friction
    has_shear = bool(model.partial_slip)
    steps = int(numerics.cycles * numerics.steps)
    has_bonds = model.grooves is None and f is not None and law_has_trait(f.law, "bonds")
    sizes = {}
    parts = []
    n_modes = 0
    if has_bonds and bond_lists.has_bond_list(model, numerics):
        entries, seconds = bond_lists.estimate_bond_list_cost(model, numerics)
        step_seconds = seconds / steps
        sizes["bond_list_about"] = int(entries)
        parts.append(
            MemoryPart(capacity.list_bytes(int(entries)), "the list of bonds", "accuracy.tail")
        )
    elif has_shear and (has_bonds or model.grooves is not None or rig.friction.load_varies):
        sizes["shear_modes"] = n_modes = numerics.shear_modes or shear_modes.N_SHEAR_MODES
        step_seconds = cost_model.predict_shear_mode_step(
            n_points, n_modes, load_varies=rig.friction.load_varies or model.grooves is not None
        )
        step_seconds += _predict_point_step_seconds(rig, f) if has_bonds else 0.0
        parts.append(
            MemoryPart(
                MODE_NODE_BYTES * n_modes * n_points,
                f"{n_modes} shear modes",
                "accuracy.shear_modes",
            )
        )
    else:
        step_seconds = _predict_plain_step_seconds(model, numerics, n_points, has_bonds=has_bonds)
    # The cost includes runs with half and a quarter of the steps, and one more run for each halving
    # of the step.
    passes = 0.75 + 2 ** (bond_lists.count_step_halvings(model) + 1) - 1
    times = {
        "motion": steps * passes * step_seconds,
        "histories": cost_model.KEPT_SAMPLE_SECONDS * count_stored_samples(numerics),
    }
    parts += predict_history_memory(model, numerics, MARCH_HISTORY)
    return (
        Cost(times, tuple(parts), (), int(steps * passes), sizes) + choose_march_code(model).cost()
    )


def choose_march_code(model: Model) -> EngineCode:
    """Return the compiled code of a time integration, with its memory and compile time."""
    return SHEAR_MARCH_CODE if model.partial_slip else MARCH_CODE


def _predict_plain_step_seconds(model: Model, numerics, n_points: int, *, has_bonds: bool) -> float:
    """Predict the CPU time [s] of a time step without shear modes or bond list."""
    rig = model.rig
    step = _predict_point_step_seconds(model.rig, model.friction)
    if model.grooves is not None:
        return cost_model.GROOVE_STEP_SECONDS
    if has_bonds:
        return cost_model.BOND_NODE_SECONDS * n_points if numerics.per_point else step
    if model.partial_slip:
        return cost_model.SLIP_NODE_SECONDS * n_points + cost_model.LIST_STEP_SECONDS
    if rig.friction.has_partial_slip:
        return step + cost_model.SLIP_NODE_SECONDS * n_points
    if rig.friction.load_varies and model.patch is not None:
        return cost_model.PRESSING_STEP_SECONDS + cost_model.PRESSING_NODE_SECONDS * n_points
    return step


def _predict_point_step_seconds(rig, friction) -> float:
    """Predict the CPU time [s] of a time step of interfaces without mesh.

    It is larger for growing bonds, further modes and further interfaces.
    """
    n_interfaces = len(rig.friction.interfaces)
    has_growing_bonds = (
        friction is not None
        and friction.slip_growth is not None
        and law_has_trait(friction.law, "bonds")
    )
    return (
        (
            cost_model.BOND_STEP_SECONDS
            + cost_model.STEP_MODE_SECONDS * (len(rig.structure.frequencies) - 1)
        )
        * (cost_model.GROWING_BOND_STEP_FACTOR if has_growing_bonds else 1.0)
        * (cost_model.INTERFACE_STEP_FACTOR * n_interfaces if n_interfaces > 1 else 1.0)
    )


def compute_dimensionless_groups(model: Model) -> dict:
    """Return a dict of the dimensionless groups of the motion of a rig.

    - D: ratio of the static friction limit to the largest force of the drive, D of (2.3) at
      resonance.
    - D_kinetic: the same ratio with the kinetic limit, if it differs.
    - knee [m s-2], or knee_force [N] for a drive by force: largest drive at which friction alone
      bounds the motion of a sliding block at resonance.
    """
    sizes = {}
    f = model.friction
    rig = model.rig
    drive = rig.drive
    laws = rig.friction.interfaces
    limits = [law.friction_limits(find_interface_load(model, law)) for law in laws]
    limit = sum(static for static, _ in limits)
    kinetic = sum(sliding for _, sliding in limits)
    drive_force = drive.force or rig.first_mode.mass * find_max_acceleration(drive.signal)
    if drive_force > 0:
        sizes["D"] = limit / drive_force
        if kinetic != limit:
            sizes["D_kinetic"] = kinetic / drive_force
    ratio = rig.first_mode.frequency * drive.signal.period if drive.frequency else inf
    if abs(ratio - 1) < 0.2:
        bound = 4 / pi * kinetic * _find_participation_ratio(rig)
        sizes |= {"knee_force": bound} if drive.force else {"knee": bound / rig.first_mode.mass}
    if f is not None and f.bond_length and f.stiffness is None and drive.signal.moving:
        sizes["drive_amplitude_over_bond_length"] = (
            find_max_acceleration(drive.signal)
            / find_drive_omega(drive.signal) ** 2
            / f.bond_length
        )
    return sizes


def find_drive_and_knee(model: Model) -> dict:
    """Return a dict with the drive and the largest drive at which friction bounds the resonance.

    The keys are "drive" and "knee", both accelerations of the base [m s-2]. The dict is empty
    unless a sine excites a single mode at resonance.
    """
    rig = model.rig
    if (
        rig is None
        or not rig.drive.waveform.is_sine
        or rig.drive.force
        or rig.modes.omega.size != 1
        or not rig.structure.lists_modes
        or abs(rig.first_mode.frequency * rig.drive.signal.period - 1) > RESONANCE_TOL
    ):
        return {}
    knee = compute_dimensionless_groups(model).get("knee")
    if not knee:
        return {}
    return {"drive": float(find_max_acceleration(rig.drive.signal)), "knee": float(knee)}


def _find_participation_ratio(rig) -> float:
    """Return the ratio of two participation factors of the first elastic mode.

    They are the factors for the relative displacement of the interface and for the base motion. The
    ratio is the effect of friction relative to that of the drive. It is 1 if the scene lists no
    modes, or if the drive does not excite the mode.
    """
    first = int(np.flatnonzero(rig.modes.omega > 0)[0]) if rig.first_mode.frequency else 0
    slide = abs(float(rig.modes.slide[first]))
    base = abs(float(rig.modes.base[first]))
    return slide / base if rig.structure.lists_modes and base > 0 else 1.0


def describe_stick(rig, sizes: dict, chain: dict) -> list:
    """Describe in sentences for a plan whether friction stops a driven block.

    For a single mode, they say from D whether the block sticks, and whether friction bounds its
    motion. There are none for other rigs.

    Parameters
    ----------
    rig : Rig
    sizes : dict
        Groups of `compute_dimensionless_groups`.
    chain : dict
        Stiffness chain by name. A link with less than MIN_STIFF_LINK_RATIO times the stiffness of
        the mode allows a stuck block to move.
    """
    friction_ratio = sizes.get("D")
    if (
        friction_ratio is None
        or rig.modes.omega.size != 1
        or not rig.structure.lists_modes
        or rig.drive.kind == "free"
    ):
        return []
    friction_ratio *= _find_participation_ratio(rig)
    limit = MIN_STIFF_LINK_RATIO * rig.first_mode.stiffness
    links = {name: link for name, link in chain.items() if not isinstance(link, str)}
    compliant_links = [name for name, link in links.items() if name != "mode" and link < limit]
    if friction_ratio >= 1 and compliant_links:
        return [
            f"D = {friction_ratio:.3g} >= 1, but the block still moves, because the interface is elastic: its stiffness "
            f"({compliant_links[-1]}) is {chain[compliant_links[-1]]:.4g} N/m and the "
            f"stiffness of the mode is {rig.first_mode.stiffness:.4g} N/m"
        ]
    if friction_ratio >= 1:
        return [f"D = {friction_ratio:.3g} >= 1: friction should hold the block, so that it sticks"]
    if "D_kinetic" in sizes:  # The kinetic friction limit acts while the block slides.
        sliding = sizes["D_kinetic"] * _find_participation_ratio(rig)
        return [
            f"D = {friction_ratio:.3g} is below 1, so that the block slips; "
            f"with the kinetic coefficient {_describe_sliding(sliding)}"
        ]
    return [_describe_sliding(friction_ratio)]


def _describe_sliding(friction_ratio: float) -> str:
    """Describe whether friction bounds the resonance of a block that slips.

    `friction_ratio` is D of equation (2.3), below 1.
    """
    if friction_ratio > pi / 4:
        return f"D = {friction_ratio:.3g} lies between pi/4 and 1: at resonance the block alternates between stick and slip"
    return f"D = {friction_ratio:.3g} is below pi/4: at resonance friction alone does not limit the amplitude"


def describe_bond_summation(model: Model, numerics) -> list:
    """Describe the bond summation or the engine of friction elements in sentences for a plan."""
    if not law_has_trait(model.friction.law, "bonds"):
        if PIECES.find_unsupported_feature(model):
            return []
        return describe_element_engine(model, numerics.engine)
    choice = bond_lists.choose_bond_summation(model, numerics)
    sentences = ["method of the sum over bonds: " + choice.describe()]
    if choice.engine == "recursion":
        return sentences
    if bond_lists.is_bond_list_growing(model):
        remedy = 'set friction.reading = "stretch" to give the block a finite stiffness'
        if bond_lists.is_stuck_without_stiffness(model):
            remedy = "set friction.order above 0 to give the block a stiffness"
        sentences.append(
            f"{_describe_stuck_block(model)}, so that the computing time is known within a factor of about 12 only; "
            f"{remedy}"
        )
    elif (
        seconds := bond_lists.estimate_bond_list_cost(model, numerics)[1]
    ) > parameters.MAX_LIST_SECONDS:
        sentences.append(
            "`run` will refuse this scene: the sum over the list of bonds would need a computing time of about "
            f"{seconds:.0f} s, more than the limit of {parameters.MAX_LIST_SECONDS:.0f} s"
        )
    return sentences


def _describe_stuck_block(model: Model) -> str:
    """Describe how bonds stop a block while its bond list grows."""
    if bond_lists.is_stuck_without_stiffness(model):
        motion = "bonds of order 0 keep the block from sliding, but they have no stiffness"
    elif bond_lists.is_stuck_after_release(model):
        motion = "with the law as printed in the report the block does not slide after its release"
    else:
        motion = (
            "with the law as printed in the report the block hardly slides or does not slide at all"
        )
    return (
        f"{motion}: it reverses its motion in almost every time step, and each reversal makes the list of bonds "
        "longer"
    )


def predict_steady_cost(model: Model, numerics, n_nodes: int) -> Cost:
    """Predict the cost of a response curve and its coarse runs.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    n_nodes : int
        Number of interface nodes; not used.
    """
    rig = model.rig
    method = choose_steady_method(model)
    n_points = max(1, len(rig.drive.levels.amplitudes))
    if rig.drive.waveform.is_swept:
        n_points = N_BALANCE_POINTS if method.name == "balance" else N_MAPPED_POINTS
    n_soft = 0
    if method.name == "yields":
        laws = rig.friction.interfaces
        n_soft = sum(bool(law.partial_slip or model.partial_slip) for law in laws)
    passes = (
        1.0 + 0.5 * n_soft
    )  # Each interface adds a run on a coarser mesh with half the elements.
    seconds = n_points * passes * _estimate_point_seconds(model, method.name)
    if rig.structure.richer_rig is not None:
        seconds += n_points * _estimate_point_seconds(
            replace(model, rig=rig.structure.richer_rig), method.name
        )
    harmonics = model.accuracy.harmonics or 0
    balance = HARMONIC_PAIR_BYTES * (2.0 * harmonics * max(1, len(rig.friction.interfaces))) ** 2
    parts = (MemoryPart(balance, f"{harmonics} harmonics", "accuracy.harmonics"),)
    code = STEADY_CODES[method.engine] or choose_march_code(model)
    return Cost({"motion": seconds}, parts, (), n_points) + code.cost()


def _estimate_point_seconds(model: Model, method_name: str) -> float:
    """Estimate the CPU time [s] per point of a response curve.

    `method_name` is the name of the method that computes the steady motion.
    """
    rig = model.rig
    if method_name == "balance":
        size = 2.0 * (model.accuracy.harmonics or 0) * max(1, len(rig.friction.interfaces))
        return (
            cost_model.BALANCE_POINT_SECONDS
            + cost_model.BALANCE_UNKNOWN_SECONDS * size**3
            + _estimate_smooth_law_seconds(rig)
        )
    if method_name == "march":
        return N_MARCHED_CYCLES * steps_per_cycle(model) * cost_model.GROOVE_STEP_SECONDS
    if not rig.friction.interfaces:
        return cost_model.CLOSED_POINT_SECONDS
    ringing, events = count_intervals_by_cause(model)
    return (
        cost_model.MAPPED_POINT_SECONDS
        + cost_model.EVENT_SECONDS * len(rig.structure.frequencies) * events
        + ringing
        * (
            cost_model.STICKING_PIECE_SECONDS
            + cost_model.STICKING_MODES_SECONDS * len(rig.structure.frequencies) ** 2
        )
    )


def _estimate_smooth_law_seconds(rig) -> float:
    """Estimate the additional CPU time [s] per point of a response curve for a smooth law.

    The slope of such a law changes during the whole cycle, whereas elements that stick and slip
    have a constant slope for most of it.
    """
    laws = {interface.numbers.law for interface in rig.friction.interfaces}
    with_memory = [law for law in laws if not law_has_trait(law, "memoryless")]
    is_flowing = any("pieces" not in LAWS[law].supports.split() for law in with_memory)
    is_smooth = (
        is_flowing or rig.springs.is_nonlinear or any(law_has_trait(law, "creeps") for law in laws)
    )
    size = 2 * len(rig.structure.frequencies) + len(rig.friction.interfaces)
    return (
        is_flowing * cost_model.FLOWING_LAW_POINT_SECONDS
        + is_smooth * cost_model.MULTIPLIER_SECONDS[is_flowing] * size**3
    )


# Function (model, numerics, points) -> Cost of each engine.
COSTS = {
    "exact": predict_event_driven_cost,
    "piecewise": predict_event_driven_cost,
    "hybrid": predict_hybrid_cost,
    "march": predict_march_cost,
    "harmonic": predict_steady_cost,
}
