"""Sizes, stiffnesses, frequencies and dimensionless groups of a rig for a plan.

In: a Model. Out: the stiffness chain, natural frequencies with free and stuck
interfaces, dimensionless groups, and sentences for the plan.
"""

from math import inf, pi

import numpy as np

from ...core import add_interface_number, remove_interface_number
from ...measures.measures import Values
from ...model.model import Model
from ...structure.drive_sizes import find_drive_omega, find_max_acceleration
from ..interfaces import bond_lists

# Largest relative difference between the frequencies of drive and mode at which the mode counts as
# resonant.
RESONANT_FREQUENCY_TOL = 0.02
# Smallest ratio of link stiffness to modal stiffness at which the link holds the block nearly at
# rest.
MIN_HOLDING_LINK_STIFFNESS_RATIO = 10.0
Chain = dict[str, float | str]  # stiffness [N/m] of each link by name, or why it has none


def structure_stiffnesses(rig) -> Chain:
    """Return the stiffnesses [N/m] of the structure by name: "mode" at the contact, and "bonded" if it has such a spring."""
    chain = {"mode": rig.first_mode.stiffness}
    if rig.springs.bonded is not None:
        chain["bonded"] = rig.springs.bonded
    return chain


def stuck_stiffnesses(rig, chain: Chain) -> np.ndarray:
    """Return the tangential stiffness (i,) [N/m] of each stuck interface of a rig, whose links act in series.

    It is inf without friction and if all links are rigid, and 0 for a law that creeps. Bands that slide apart have equal
    parts of the stiffness of their patch. A patch that was solved to subtract a bolted joint has its own stiffness instead
    of that of the chain.
    """
    n_rows = len(rig.modes.interfaces)
    bolted = rig.structure.bolted
    if bolted is not None and bolted.stuck_stiffness is not None:
        return np.full(n_rows, bolted.stuck_stiffness)
    stiffness = np.full(n_rows, inf)
    n_interfaces = len(rig.friction.interfaces)
    for k in range(n_rows if n_interfaces else 0):
        # Links of this interface; the bands of a face have those of the first one.
        number = k if k < n_interfaces else 0
        compliance = 0.0
        for name, link in chain.items():
            plain_name = remove_interface_number(name)
            is_own = name == add_interface_number(plain_name, number)
            if not is_own or name in ("mode", "bonded", "grooves"):
                continue
            if plain_name == "bonds" and str(link).startswith("none"):
                compliance = inf
            elif not isinstance(link, str) and link > 0:
                compliance += 1 / link
        stiffness[k] = 1 / compliance if compliance else inf
    return stiffness / n_rows if rig.friction.bands_slide_apart else stiffness


def mode_frequencies(rig, chain: Chain) -> list[dict[str, str | float | None]]:
    """Return name, free and stuck frequency [Hz] of each mode as a list of dicts.

    The stuck frequency is that with stuck interfaces. It is None without friction and if no link of
    the stiffness chain is compliant.
    """
    modes = rig.modes
    stiffness = stuck_stiffnesses(rig, chain)
    has_names = rig.structure.lists_modes and modes.shapes is None
    frequencies = []
    for k, omega in enumerate(modes.omega):
        stuck_omega = modes.compute_stuck_mode(modes.interfaces, stiffness, k)[0]
        frequencies.append(
            {
                "name": modes.names[k] if has_names else f"mode {k + 1}",
                "free_frequency": float(omega) / (2 * pi),
                "stuck_frequency": None if stuck_omega is None else stuck_omega / (2 * pi),
            }
        )
    return frequencies


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
    first_mode = rig.first_mode
    laws = rig.friction.interfaces
    limits = [law.friction_limits(bond_lists.find_interface_load(model, law)) for law in laws]
    static = sum(limit.static for limit in limits)
    kinetic = sum(limit.kinetic for limit in limits)

    # Ratio of the participation of the interface in the first elastic mode to that of the base: the effect of friction
    # relative to that of the drive. It is 1 if the scene lists no modes, or if the drive does not excite the mode.
    first = int(np.flatnonzero(rig.modes.omega > 0)[0]) if first_mode.frequency else 0
    slide = abs(float(rig.modes.slide[first]))
    base = abs(float(rig.modes.base[first]))
    participation = slide / base if rig.structure.lists_modes and base > 0 else 1.0

    # D of eq. 2.3: both forces as they act on the first mode.
    drive_force = drive.force or first_mode.mass * find_max_acceleration(drive.signal)
    if drive_force > 0:
        sizes["D"] = participation * static / drive_force
        if kinetic != static:
            sizes["D_kinetic"] = participation * kinetic / drive_force

    # At resonance, friction balances a drive up to 4/pi F, the first harmonic of its square wave.
    if drive.frequency and abs(first_mode.frequency * drive.signal.period - 1) < 0.2:
        bound = 4 / pi * kinetic * participation
        sizes |= {"knee_force": bound} if drive.force else {"knee": bound / first_mode.mass}

    if f is not None and f.bond_length and f.stiffness is None and drive.signal.moving:
        amplitude = find_max_acceleration(drive.signal) / find_drive_omega(drive.signal) ** 2
        sizes["drive_amplitude_over_bond_length"] = amplitude / f.bond_length
    return sizes


def find_drive_and_knee(model: Model) -> Values:
    """Return a dict with the drive and the largest drive at which friction bounds the resonance.

    The keys are "drive" and "knee", both accelerations of the base [m s-2]. The dict is empty
    unless a sine excites a single mode at resonance.
    """
    rig = model.rig
    if rig is None or not rig.drive.waveform.is_sine or not has_single_mode(rig):
        return {}
    offset = abs(rig.first_mode.frequency * rig.drive.signal.period - 1)
    knee = compute_dimensionless_groups(model).get("knee")
    if rig.drive.force or offset > RESONANT_FREQUENCY_TOL or not knee:
        return {}
    return {"drive": float(find_max_acceleration(rig.drive.signal)), "knee": float(knee)}


def has_single_mode(rig) -> bool:
    """Return whether the scene lists the only mode of a rig."""
    return rig.modes.omega.size == 1 and rig.structure.lists_modes


def _find_sticking_force(rig, stiffness: float) -> tuple[float, float | None]:
    """Return the natural frequency [Hz] of a mode whose interface sticks, and the largest friction force over the drive.

    The force is that of the steady motion without damping, inf at resonance; it is None for a drive of many frequencies.

    Parameters
    ----------
    rig : Rig
        Single mode and its drive.
    stiffness : float
        Stiffness of the sticking interface [N/m]; inf if it is rigid, which then carries the drive.
    """
    mode = rig.first_mode
    if np.isinf(stiffness):
        return inf, 1.0
    resonance = np.sqrt((mode.stiffness + stiffness) / mode.contact_mass) / (2 * np.pi)
    signal = rig.drive.signal
    if rig.drive.waveform.is_sine:
        ends = [1 / signal.period]
    elif hasattr(signal, "low"):
        ends = [signal.low, signal.high]
    else:
        return resonance, None
    if min(ends) <= resonance <= max(ends):
        return resonance, inf
    part = stiffness / (stiffness + mode.stiffness)
    return resonance, max(part / abs(1 - (end / resonance) ** 2) for end in ends)


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
    ratio = sizes.get("D")
    if ratio is None or not has_single_mode(rig) or rig.drive.is_release:
        return []
    stiffness = rig.first_mode.stiffness
    limit = MIN_HOLDING_LINK_STIFFNESS_RATIO * stiffness
    links = {name: link for name, link in chain.items() if not isinstance(link, str)}
    compliant_links = [name for name, link in links.items() if name != "mode" and link < limit]
    if ratio >= 1 and compliant_links:
        link = compliant_links[-1]
        return [
            f"D = {ratio:.3g} >= 1, but the block still moves, because the interface is elastic: its stiffness "
            f"({link}) is {chain[link]:.4g} N/m and the stiffness of the mode is {stiffness:.4g} N/m"
        ]
    if ratio >= 1:
        # An elastic interface carries more than the drive near the resonance of the sticking block.
        compliance = sum(1 / link for name, link in links.items() if name not in ("mode", "bonded"))
        hertz, force_ratio = _find_sticking_force(rig, 1 / compliance if compliance else inf)
        if force_ratio is None:
            return []
        if force_ratio > ratio:
            return [
                f"D = {ratio:.3g} >= 1, but the interface is elastic, so that the block may slip near {hertz:.4g} Hz, "
                "its natural frequency while it sticks"
            ]
        return [f"D = {ratio:.3g} >= 1: friction should hold the block, so that it sticks"]

    # The kinetic friction limit acts while the block slides.
    sliding = sizes.get("D_kinetic", ratio)
    words = (
        f"D = {sliding:.3g} is below pi/4: at resonance friction alone does not limit the amplitude"
    )
    if sliding > pi / 4:
        words = f"D = {sliding:.3g} lies between pi/4 and 1: at resonance the block alternates between stick and slip"
    if "D_kinetic" in sizes:
        words = f"D = {ratio:.3g} is below 1, so that the block slips; with the kinetic coefficient {words}"
    return [words]
