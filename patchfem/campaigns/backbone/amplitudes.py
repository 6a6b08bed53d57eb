"""Amplitudes of a backbone: a default range, those of given forces, and more points where the damping changes fast."""

import numpy as np

from ...core import NotConverged, PatchfemError
from ...formatting import format_length, format_quantity
from ...runs.refine import NO_LIMIT, Verdict, refine
from .balance import compute_balance_curve
from .joint import MIN_AMPLITUDE_OVER_GROSS_SLIP, JointMode
from .quasi_static import compute_static_curve
from .records import Curve

AMPLITUDES_PER_DECADE = 6  # Number of default amplitudes per decade before points are added.
# Ratio of the largest default amplitude to the amplitude at which the complete contact slips.
MAX_AMPLITUDE_OVER_GROSS_SLIP = 15.0
# Change between neighbours, as a fraction of the range of the curve, above which a point is added between them.
MAX_CURVE_CHANGE = 0.08
# Ratio of neighbouring amplitudes below which no point is added. A rigid contact begins to slip at once, so that its damping
# jumps; this is the width within which the place of the jump is found.
MIN_AMPLITUDE_SPACING_RATIO = 1.001
MAX_HALVINGS = 9  # Largest number of halvings of the spacing, from the default one to the smallest.
MAX_ADDED_DECADES = 8  # Number of decades by which the default range is extended to reach a force.


def default_amplitudes(joints: list[JointMode]) -> np.ndarray:
    """Return amplitudes (k,) [m] at the output from full stick to nearly free motion of one or several modes.

    `joints` are the modes with their contact. The amplitudes lie closer where frequency or damping change fast.
    """
    low, high = find_default_range(joints)
    if joints[0].is_linear:
        # Number of amplitudes of a linear rig, whose values are constant
        return np.geomspace(low, high, 4)
    count = 1 + int(np.ceil(AMPLITUDES_PER_DECADE * np.log10(high / low)))
    amplitudes = np.geomspace(low, high, count)
    for joint in joints:
        amplitudes = refine_amplitudes(joint, amplitudes)
    return amplitudes


def find_default_range(joints: list[JointMode]) -> tuple[float, float]:
    """Return the smallest and largest default amplitude [m] at the output of one or several modes with their contact."""
    ends = np.array([_default_range(joint) for joint in joints])
    travel = min(joint.model.rig.springs.travel for joint in joints)
    return float(ends[:, 0].min()), float(min(ends[:, 1].max(), travel))


def _default_range(joint: JointMode) -> tuple[float, float]:
    """Return the smallest and largest default amplitude [m] at the output of a mode (`joint`)."""
    travel = joint.model.rig.springs.travel
    if joint.is_linear:
        # Largest amplitude of a linear rig [m]
        high = min(1e-3, travel)
        return 1e-3 * high, high
    low, high = joint.output_amplitude(np.array(_default_slides(joint)))
    high = min(high, _max_amplitude(joint))
    return min(low, MIN_AMPLITUDE_OVER_GROSS_SLIP * high), high


def _default_slides(joint: JointMode) -> tuple[float, float]:
    """Return the smallest and largest relative displacement [m] at the contact of the default amplitudes of a joint."""
    stiffness = joint.stiffness[joint.face]
    deflection = joint.deflection if joint.friction_limit else 0.0
    if 0 < stiffness < np.inf or not deflection:
        slip = joint.slip_displacement
        high = MAX_AMPLITUDE_OVER_GROSS_SLIP * max(slip, deflection)
        return MIN_AMPLITUDE_OVER_GROSS_SLIP * slip, high
    # Rigid friction has no slip amplitude, so that the range begins above the static deflection by friction.
    # Ratio of the smallest default amplitude under rigid friction to the static deflection by
    # friction.
    return 2.0 * deflection, MAX_AMPLITUDE_OVER_GROSS_SLIP**2 * deflection


def _max_amplitude(joint: JointMode) -> float:
    """Return the largest default amplitude [m] at the output, within the travel and the range of a cubic spring."""
    springs = joint.model.rig.springs
    # Ratio of the travel to the largest default amplitude, so that a release can start above it.
    travel = springs.travel / 1.15
    if not springs.cubic:
        return travel
    # The cubic spring at the output u = o q resists the mode q as much as its stiffness, |k3| u^3 o = k q, at
    # u = sqrt(k/|k3|)/o.
    output = abs(joint.modes.output[joint.mode]) or joint.reach
    limit = np.sqrt(joint.spring / abs(springs.cubic)) / output
    # Ratio of the largest amplitude to that at which a hardening spring is as stiff as the mode.
    factor = 3.0
    if springs.cubic < 0:
        # Ratio of the largest amplitude to that at which a softening spring no longer returns the
        # block.
        factor = 0.7
    return min(travel, factor * limit)


def estimate_curve(joint: JointMode, amplitudes) -> Curve | None:
    """Return a fast estimate of the backbone of a joint, without errors, or None if no method has one.

    `amplitudes` (k,) [m] are those at the output. The methods are periodic motions, then quasi-static loops.
    """
    joint = joint._replace(has_errors=False)
    for compute in (compute_balance_curve, compute_static_curve):
        try:
            return compute(joint, amplitudes)
        except (NotConverged, PatchfemError):
            continue
    return None


def refine_amplitudes(joint: JointMode, amplitudes) -> np.ndarray:
    """Add amplitudes where frequency or damping ratio change by more than MAX_CURVE_CHANGE of their range.

    Parameters
    ----------
    joint : JointMode
        Mode and joint of the backbone.
    amplitudes : (k,) array
        Increasing [m].

    Returns
    -------
    (n,) array
        The amplitudes, with further ones between them.
    """
    if joint.is_linear:
        return amplitudes

    # The force of phase resonance is not needed here.
    joint = joint._replace(has_force=False)

    def solve(added, before: Curve | None) -> Curve | None:
        """Return the curve with points at further amplitudes (k,) [m]; None if no such point is known."""
        curve = estimate_curve(joint, added)
        if curve is None or before is None:
            return curve
        found.append(added)
        return _join(before, curve)

    def judge(known: Curve, excesses: list[float]) -> Verdict:
        """Ask for a point in each step that is too wide."""
        between = _find_amplitudes_between(known)
        if not between.size or len(excesses) == MAX_HALVINGS:
            return Verdict(0.0)
        return Verdict(float(between.size), between)

    found = [np.asarray(amplitudes)]
    refine(solve, amplitudes, judge, NO_LIMIT)
    return np.unique(np.concatenate(found))


def _find_amplitudes_between(curve: Curve) -> np.ndarray:
    """Return the geometric means of the ends of the steps of a curve that change by more than MAX_CURVE_CHANGE [m]."""
    is_wide = np.zeros(max(curve.amplitude.size - 1, 0), bool)
    for values in (curve.frequency, curve.damping):
        step = np.abs(np.diff(values))
        is_wide |= step > MAX_CURVE_CHANGE * (np.nanmax(values) - np.nanmin(values))
    # The halves of a step have the square root of its ratio, which must not fall below MIN_AMPLITUDE_SPACING_RATIO.
    is_wide &= curve.amplitude[1:] > MIN_AMPLITUDE_SPACING_RATIO**2 * curve.amplitude[:-1]
    return np.sqrt(curve.amplitude[1:] * curve.amplitude[:-1])[is_wide]


def _join(curve: Curve, other: Curve) -> Curve:
    """Return the points of two curves as one curve with increasing amplitudes."""
    joined = Curve(*(np.concatenate(pair) for pair in zip(curve, other)))
    return joined.at(np.argsort(joined.amplitude))


def find_amplitudes_of_forces(joint: JointMode, forces) -> np.ndarray:
    """Return the smallest amplitudes (n,) [m] at which a given force at the output is in phase with the velocity.

    The force then holds the mode at its phase resonance.

    Parameters
    ----------
    joint : JointMode
        Mode and joint of the backbone.
    forces : (n,) array
        Amplitudes of the force [N], above 0.

    Raises
    ------
    PatchfemError
        If no amplitude within the travel has one of the forces.
    """
    forces = np.asarray(forces, float)
    travel = joint.model.rig.springs.travel
    low, high = _default_range(joint)
    count = 1 + int(np.ceil(AMPLITUDES_PER_DECADE * np.log10(high / low)))

    def solve(added, before: Curve | None) -> Curve:
        """Return the curve with points at further amplitudes (k,) [m]."""
        curve = _estimate_forces(joint, np.asarray(added))
        return curve if before is None else _join(before, curve)

    def judge_range(known: Curve, excesses: list[float]) -> Verdict:
        """Ask for a range that is wider by a decade, until all forces lie inside."""
        added = []
        if known.force.min() > forces.min() and not joint.is_rigid:
            added.append(known.amplitude[0] / 10)
        if known.force.max() < forces.max() and known.amplitude[-1] < travel:
            added.append(min(10 * known.amplitude[-1], travel))
        is_last = not added or len(excesses) == MAX_ADDED_DECADES
        return Verdict(float(len(added)), None if is_last else added)

    known, _ = refine(solve, np.geomspace(low, high, count), judge_range, NO_LIMIT)
    for force in forces:
        if not known.force.min() <= force <= known.force.max():
            ends = [format_quantity(end, "N", 3) for end in (known.force.min(), known.force.max())]
            low, high = (format_length(known.amplitude[k], 3) for k in (0, -1))
            raise PatchfemError(
                f"no amplitude from {low} to {high} needs a force of {format_quantity(force, 'N', 3)} at the "
                f"output for its phase resonance: the forces there are {ends[0]} to {ends[1]}; give other --forces"
            )

    # Regula falsi in logarithms; each step adds the points that it found. At most eight steps are needed.
    tolerance = 1e-2 * joint.model.accuracy.tolerance
    for _ in range(8):
        # The largest force up to an amplitude leaves the first place at which a force is reached.
        largest = np.log(np.maximum.accumulate(known.force))
        places = np.exp(np.interp(np.log(forces), largest, np.log(known.amplitude)))
        new = _estimate_forces(joint, np.unique(places))
        reached = np.interp(places, new.amplitude, new.force)
        if np.all(np.abs(reached - forces) <= tolerance * forces):
            break
        known = _join(known, new)
    return places


def _estimate_forces(joint: JointMode, amplitudes) -> Curve:
    """Return the estimated backbone of a joint at amplitudes (k,) [m], without points whose force is not above 0.

    The force is that of phase resonance at the output. Raises PatchfemError if there are no points.
    """
    curve = estimate_curve(joint, amplitudes)
    if curve is not None:
        curve = curve.at(curve.force > 0)
    if curve is None or not curve.amplitude.size:
        raise PatchfemError(
            "the force at the output that holds the phase resonance is not known here; give --amplitudes"
        )
    return curve
