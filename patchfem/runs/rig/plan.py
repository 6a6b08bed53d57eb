"""Sizes, stiffnesses, frequencies and dimensionless groups of a rig for a plan.

In: a Model. Out: numbers of unknowns, the stiffness chain, natural frequencies with free and stuck
interfaces, dimensionless groups, and sentences for the plan.
"""

from math import inf, pi

import numpy as np

from ... import slip
from ...core import add_interface_number, remove_interface_number
from ...effects import law_has_trait
from ...model.model import Model
from ...response.measures import Values
from ...structure.drive_sizes import find_drive_omega, find_max_acceleration
from ..interfaces import bond_lists
from .engines import choose_numerics

# Largest relative difference between the frequencies of drive and mode at which the mode counts as
# resonant.
RESONANT_FREQUENCY_TOL = 0.02
# Smallest ratio of link stiffness to modal stiffness at which the link holds the block nearly at
# rest.
MIN_HOLDING_LINK_STIFFNESS_RATIO = 10.0
Chain = dict[str, float | str]  # stiffness [N/m] of each link by name, or why it has none


def structure_stiffnesses(rig) -> Chain:
    """Return the stiffnesses [N/m] of the structure by name: "mode" at the contact, and "bonded" if it has such a spring."""
    return {"mode": rig.first_mode.stiffness} | (
        {"bonded": rig.springs.bonded} if rig.springs.bonded is not None else {}
    )


def stuck_interface_stiffness(chain: Chain, index: int = 0) -> float:
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


def stuck_stiffnesses(rig, chain: Chain) -> np.ndarray:
    """Return the tangential stiffness (i,) [N/m] of each stuck interface of a rig.

    Bands that slide apart have equal parts of the stiffness of their patch. Without friction the stiffness is inf. A
    patch that was solved to subtract a bolted joint has its own stiffness instead of that of the chain.
    """
    bolted = rig.structure.bolted
    if bolted is not None and bolted.stuck_stiffness is not None:
        return np.full(len(rig.modes.interfaces), bolted.stuck_stiffness)
    n_interfaces = len(rig.friction.interfaces)
    stiffness = np.full(len(rig.modes.interfaces), inf)
    if n_interfaces:
        for k in range(stiffness.size):
            stiffness[k] = stuck_interface_stiffness(chain, k if k < n_interfaces else 0)
    if rig.friction.bands_slide_apart:
        stiffness /= stiffness.size
    return stiffness


def mode_frequencies(rig, chain: Chain) -> list[dict[str, str | float | None]]:
    """Return name, free and stuck frequency [Hz] of each mode as a list of dicts.

    The stuck frequency is that with stuck interfaces. It is None without friction and if no link of
    the stiffness chain is compliant.
    """
    modes = rig.modes
    rows = modes.interfaces
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


def count_unknowns(model: Model) -> dict[str, int]:
    """Count the unknowns of a rig: modes, and for time steps the shear modes."""
    counts = {"modes": len(model.rig.structure.frequencies)}
    numerics = choose_numerics(model)
    f = model.friction
    if numerics.engine != "march" or f is None:
        return counts
    has_bonds = model.grooves is None and law_has_trait(f.law, "bonds")
    if has_bonds and bond_lists.has_bond_list(model):
        return counts
    is_changed = has_bonds or model.grooves is not None or model.rig.friction.load_varies
    if model.partial_slip and is_changed:
        counts["shear_modes"] = numerics.shear_modes or slip.shear_modes.N_SHEAR_MODES
    return counts


def find_interface_load(model: Model, interface) -> float:
    """Return the normal load [N] on an interface; that of the model for an interface without a load of its own."""
    return model.nominal_load if interface.load is None else interface.load


def compute_dimensionless_groups(model: Model) -> Values:
    """Return a dict of the dimensionless groups of the motion of a rig.

    - D: ratio of the static friction limit to the largest force of the drive, both as they act on the first mode. At
      resonance it is D of eq. 2.3 of Srinivasan, Cassenti and Cutts (1985).
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

    # D of eq. 2.3: both forces as they act on the first mode.
    drive_force = drive.force or rig.first_mode.mass * find_max_acceleration(drive.signal)
    participation = _find_participation_ratio(rig)
    if drive_force > 0:
        sizes["D"] = participation * limit / drive_force
        if kinetic != limit:
            sizes["D_kinetic"] = participation * kinetic / drive_force

    # At resonance, friction balances a drive up to 4/pi F, the first harmonic of its square wave.
    ratio = rig.first_mode.frequency * drive.signal.period if drive.frequency else inf
    if abs(ratio - 1) < 0.2:
        bound = 4 / pi * kinetic * participation
        sizes |= {"knee_force": bound} if drive.force else {"knee": bound / rig.first_mode.mass}

    if f is not None and f.bond_length and f.stiffness is None and drive.signal.moving:
        sizes["drive_amplitude_over_bond_length"] = (
            find_max_acceleration(drive.signal)
            / find_drive_omega(drive.signal) ** 2
            / f.bond_length
        )
    return sizes


def find_drive_and_knee(model: Model) -> Values:
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
        or abs(rig.first_mode.frequency * rig.drive.signal.period - 1) > RESONANT_FREQUENCY_TOL
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


def describe_stick(rig, sizes: Values, chain: Chain) -> list[str]:
    """Describe in sentences for a plan whether friction stops a driven block.

    For a single mode, they say from D whether the block sticks, and whether friction bounds its
    motion. There are none for other rigs.

    Parameters
    ----------
    rig : Rig
        Modes and drive.
    sizes : dict
        Groups of `compute_dimensionless_groups`.
    chain : dict
        Stiffness chain by name. A link with less than MIN_HOLDING_LINK_STIFFNESS_RATIO times the stiffness of
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

    limit = MIN_HOLDING_LINK_STIFFNESS_RATIO * rig.first_mode.stiffness
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
        sliding = sizes["D_kinetic"]
        return [
            f"D = {friction_ratio:.3g} is below 1, so that the block slips; "
            f"with the kinetic coefficient {_describe_sliding(sliding)}"
        ]
    return [_describe_sliding(friction_ratio)]


def _describe_sliding(friction_ratio: float) -> str:
    """Describe whether friction bounds the resonance of a block that slips.

    `friction_ratio` is D of eq. 2.3 (`compute_dimensionless_groups`), below 1.
    """
    if friction_ratio > pi / 4:
        return f"D = {friction_ratio:.3g} lies between pi/4 and 1: at resonance the block alternates between stick and slip"
    return f"D = {friction_ratio:.3g} is below pi/4: at resonance friction alone does not limit the amplitude"
