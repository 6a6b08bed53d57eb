"""Measures of wear with their errors, and the history of the wear over the cycles.

In: the Result of a run on the worn patch, and its `WornPatch`. Out: the Result with the measures,
fields, warnings and notes of wear.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...convergence import convergence_error
from ...core import Outcome, frozen_array
from ...formatting import format_length, format_number
from ...measures.errors import estimate_convergence_errors
from ..results.patch_rows import WORN_SOURCE, Arrays, Measures, Values, make_measure
from ..results.result import UNBOUNDED_OUTCOMES, WornStates
from .evolve import (
    WORN_THROUGH_FRACTION,
    compute_mean_worn_depth,
    compute_values,
    compute_worn_values,
    find_worn_through_coating,
    list_worn_pieces,
    solve_worn,
)
from .slip import compute_point_slip_path

N_WEAR_FRAMES = 24  # Number of frames of the interface during the wear.
WORN_ROUND_OFF = 1e-12  # Relative error of a worn volume or depth due to round-off.
# Note on the wear of a trace whose short waves are represented by asperities
SPLIT_TRACE_NOTE = (
    "worn_depth_max is a mean over the short waves that [contact.asperities] represents: single peaks wear deeper; the "
    "layer itself does not wear, its stiffness and decay length stay those of the new surface; with "
    "contact.asperities.hardness its tops wear"
)
# Note on a rough layer that wears
WORN_LAYER_NOTE = (
    "worn_depth_max and worn_depth_mean are means over the waves of the rough layer; worn_top_height is what its tops "
    "lose; the layer loses height, but its stiffness and decay length stay those of the new surface; the errors leave out "
    "that another trace has other heights"
)
MEASURE_BY_HOLDER_MOTION = {"closing": "approach", "rotation": "rotation"}


def add_wear_measures(result, evolved, with_errors: bool = True):
    """Add the measures of wear to the Result of a run on a worn patch.

    Parameters
    ----------
    result : Result
        Result of the run on the worn patch.
    evolved : WornPatch or None
        None for a single contact point.
    with_errors : bool
        Whether to estimate the errors.
    """
    model = result.plan.model
    is_unbounded = result.outcome in UNBOUNDED_OUTCOMES

    # A single point has no surface that could change: only its worn volume is computed, after the run.
    if evolved is None:
        if is_unbounded:
            warning = f"nothing was worn: {result.outcome.sentence}"
            return result.with_changes(warnings=[*result.warnings, warning])
        volume = _measure_point_volume(model, result, with_errors=with_errors)
        return replace(result, measures=result.measures | volume)

    warnings = [*result.warnings, *filter(None, [evolved.stopped])]
    seconds = result.seconds | {"wear": evolved.seconds}
    result = result.with_changes(seconds=seconds, warnings=warnings)
    if evolved.state is None:
        return result

    # Measures of the wear by name. The finite length of the jumps also adds to the errors of the motion.
    worn = _measure_patch_wear(model, evolved, result.measures, with_errors=with_errors)
    if model.wear.friction is not None:
        worn |= _measure_worn_friction(model, evolved, result.measures, worn["worn_volume"].error)
    if with_errors:
        result = _widen_errors_by_jumps(result, evolved)

    # A run that continues an earlier one, or wears through a coating, says so.
    notes = [*result.notes]
    if evolved.layer is not None:
        notes.append(WORN_LAYER_NOTE)
    elif model.patch.gap.is_split:
        notes.append(SPLIT_TRACE_NOTE)
    if model.wear.start is not None:
        notes.append(model.wear.start.sentence)
    outcome = result.outcome
    coating = find_worn_through_coating(model, evolved.state.depth)
    if coating is not None:
        worn |= _measure_worn_through_cycle(evolved, worn["worn_depth_max"].error)
        notes.append(_describe_worn_through_coating(model, evolved, coating))
        outcome = outcome if is_unbounded else Outcome.WORN_THROUGH
    warnings += [*_warn_of_worn_depth(model, evolved), *_warn_of_friction_table(model, evolved)]
    measures = result.measures | worn
    result = result.with_changes(outcome=outcome, measures=measures, warnings=warnings, notes=notes)
    return _add_wear_frames(result, evolved)


def _measure_worn_through_cycle(evolved, error: float | None) -> Measures:
    """Return a dict with the cycle in which the wear first reaches the substrate.

    `evolved` is the result of the jumps with their moments, and `error` [m] that of the largest worn depth.
    """
    before, last = evolved.moments[-2:]
    deepest = int(np.argmax(last.depth))
    depth = float(last.depth.flat[deepest])
    rate = (depth - float(before.depth.flat[deepest])) / (last.cycle - before.cycle)
    cycle_error = None if error is None else (error + WORN_THROUGH_FRACTION * depth) / rate
    name = "worn_through_cycle"
    return {name: make_measure(name, last.cycle, cycle_error)}


def _describe_worn_through_coating(model, evolved, coating) -> str:
    """Return the note on the coating that is worn through and on the place of the deepest wear.

    `evolved` is the `WornPatch` at the end of the wear, and `coating` the `WornPiece` with the coating.
    """
    patch = evolved.patch
    node = int(np.argmax(evolved.state.depth))
    place = f"x = {format_length(float(patch.x[node]), 3)}"
    if model.patch.area is not None:
        place += f", y = {format_length(float(patch.y[node]), 3)}"
    thickness = format_length(coating.piece.thickness)
    return (
        f"the coating of the {coating.name} piece, {thickness}, is worn through at {place} after "
        f"{format_number(evolved.state.cycle, 4)} of {format_number(model.wear.cycles, 7)} cycles; the measures are those "
        "of the patch at that cycle"
    )


def _widen_errors_by_jumps(result, evolved):
    """Increase the errors of a Result by those of the jumps over cycles.

    A contact edge that moves during a jump leaves the nodes that just came into contact too high.
    The errors follow, at first order, from the change if the same jumps are not subdivided.

    Parameters
    ----------
    result : Result
        Result of the run on the worn patch.
    evolved : WornPatch
        The worn patch with its jumps, also on the coarser meshes.
    """
    coarse_depth = frozen_array(evolved.state.coarse_depth)
    coarse = compute_values(solve_worn(evolved.patch, coarse_depth, evolved.layer))
    fine_values = compute_values(evolved.patch)
    measures = dict(result.measures)
    for name, value in fine_values.items():
        measure = measures.get(name)
        if measure is not None and measure.error is not None:
            error = float(convergence_error(value - coarse[name]))
            measures[name] = replace(measure, error=measure.error + error)
    return replace(result, measures=measures)


def _warn_of_worn_depth(model, evolved) -> list[str]:
    """Return warnings on a worn depth that is large compared with a piece or its coating.

    `evolved` is the `WornPatch` at the end of the wear.
    """
    warnings = []
    for worn in list_worn_pieces(model, evolved.state.depth):
        size = "the thickness of its coating" if worn.piece.coating else "its height"
        # Largest ratio of the worn depth to the thickness of a coating, or to the height of a
        # piece, at which the stiffness of the unworn piece is valid.
        if worn.depth > 0.2 * (worn.piece.thickness or worn.piece.height):
            warnings.append(
                f"up to {format_length(worn.depth, 3)} is worn off the {worn.name} piece, more than 0.2 of {size}, but the "
                "computation still uses the stiffness of the unworn piece"
            )
    return warnings


def _relative_slip_error(measures: Measures) -> float:
    """Return the relative error of the slip amplitude, or else of the displacement amplitude."""
    for name in ("slip_amplitude", "relative_displacement_amplitude"):
        measure = measures.get(name)
        if measure is not None and measure.value and measure.error is not None:
            return abs(measure.error / measure.value)
    return 0.0


def _measure_patch_wear(model, evolved, motion: Measures, *, with_errors: bool = True) -> Measures:
    """Return the measures of worn volume, worn depth and groove amplitude.

    Their errors include those of the earlier run.

    Parameters
    ----------
    model : Model
        Unworn model with [wear].
    evolved : WornPatch
        The worn patch with its jumps, also on the coarser meshes.
    motion : dict
        Measures of the run on the worn patch by name.
    with_errors : bool
        Whether to estimate the errors.
    """
    first = evolved.moments[0]
    last = evolved.moments[-1]
    area = float(evolved.patch.pieces.interface.weight.sum())
    slip_error = last.miss + _relative_slip_error(motion) + _relative_slip_change(last, motion)
    jump_errors = _estimate_jump_errors(evolved)

    # Values on the coarser meshes, for the errors; a single mesh shows no error.
    values = {name: last.values[name] for name in jump_errors}
    meshes = zip(evolved.coarse, evolved.depths)
    coarse = [compute_worn_values(*mesh, evolved.layer) for mesh in meshes] if with_errors else []
    mesh_errors = estimate_convergence_errors(values, *coarse) if coarse else {}

    # The errors of jumps, slip path, mesh, round-off and earlier run add up.
    start = model.wear.start
    measures = {}
    for name, value in values.items():
        before = first.values[name]
        error = 0.0 if start is None else start.measure_error(name, before)
        if not coarse:
            error = None
        if error is not None:
            error += jump_errors[name] + slip_error * max(value - before, 0.0)
            error += float(mesh_errors[name]) + WORN_ROUND_OFF * value
        measures[name] = make_measure(name, value, error, WORN_SOURCE)

    name = "groove_amplitude"
    if name in last.values:
        error = measures["worn_volume"].error
        error = None if error is None else error / area
        measures[name] = make_measure(name, last.values[name], error, WORN_SOURCE)
    return measures


def _estimate_jump_errors(evolved) -> Values:
    """Return the errors of the measures of a `WornPatch` due to the finite length of the jumps, by name, in SI units."""
    state = evolved.state
    patch = evolved.patch
    weight = patch.pieces.interface.weight
    changes = np.abs(state.depth - state.coarse_depth)
    errors = {
        "worn_volume": float(np.vdot(changes, weight)) + state.path_error * float(weight.sum()),
        "worn_depth_max": state.error,
    }
    # What a rough layer has lost is a function of the depth at each node.
    values = compute_worn_values(patch, state.depth, evolved.layer)
    moved = state.depth + changes + state.path_error
    for name, value in compute_worn_values(patch, moved, evolved.layer).items():
        errors.setdefault(name, abs(value - values[name]))
    return errors


def _measure_worn_friction(model, evolved, motion: Measures, error: float | None) -> Measures:
    """Return the friction parameters after wear, and the measures of the motion with wider errors.

    The error of the mean worn depth changes the measures of the motion, at the rate observed in the
    last two jumps.

    Parameters
    ----------
    model : Model
        Unworn model with [wear].
    evolved : WornPatch
        The worn patch with its jumps.
    motion : dict
        Measures of the run on the worn patch by name.
    error : float or None
        Error of the worn volume [m3].
    """
    area = float(evolved.patch.pieces.interface.weight.sum())
    last_moments = evolved.moments[-3:]
    depths = [compute_mean_worn_depth(evolved.patch, moment.depth) for moment in last_moments]
    depth_error = None if error is None else error / area

    # The table of friction is evaluated at the bounds of the mean depth.
    bounds = [] if error is None else [depths[-1] - depth_error, depths[-1] + depth_error]
    table = model.wear.friction
    bound_laws = [table.compute_worn_law(model.friction, max(bound, 0.0)) for bound in bounds]
    values = last_moments[-1].values
    measures = {}
    for name, key in (("static_coefficient", "static"), ("bond_length", "bond_length")):
        if name in values:
            changes = [abs(getattr(law, key) - values[name]) for law in bound_laws]
            measures[name] = make_measure(name, values[name], max(changes, default=None))
    if error is None:
        return measures

    # Rate of a measure: change per change of the mean worn depth in a jump.
    static_names = compute_values(evolved.patch)
    for name, measure in motion.items():
        if measure.error is None or name in static_names:
            continue
        rate = 0.0
        for (before, depth_before), (after, depth) in pairwise(zip(last_moments, depths)):
            if depth > depth_before and name in before.values and name in after.values:
                change = abs(after.values[name] - before.values[name])
                rate = max(rate, change / (depth - depth_before))
        measures[name] = replace(measure, error=measure.error + depth_error * rate)
    return measures


def _warn_of_friction_table(model, evolved) -> list[str]:
    """Return warnings on wear beyond the table [wear.friction], and on jumps over several of its rows.

    The table gives the friction against the mean worn depth, and `evolved` is the `WornPatch` with the history of this
    depth.
    """
    table = model.wear.friction
    if table is None:
        return []
    depths = [compute_mean_worn_depth(evolved.patch, moment.depth) for moment in evolved.moments]
    warnings = []
    if depths[-1] > table.depth[-1]:
        warnings.append(
            f"the mean worn depth, {format_length(depths[-1], 3)}, is larger than the last value of wear.friction.depth, "
            f"{format_length(table.depth[-1], 3)}, and beyond that depth friction is taken as constant; extend the table "
            f"wear.friction to a depth of at least {format_length(depths[-1], 3)}"
        )

    # Largest number of rows of the table that one jump passes. Of more than one, some have no effect.
    n_passed = 0
    for before, after in pairwise(depths):
        n_passed = max(n_passed, sum(before < row < after for row in table.depth))
    if model.wear.jumps and n_passed > 1:
        warnings.append(
            f"one jump of the wear passes {n_passed} rows of the table wear.friction at once, so the values of some "
            "rows are not used; leave out wear.jumps"
        )
    return warnings


def _relative_slip_change(moment, motion: Measures) -> float:
    """Return the relative difference of the slip amplitude in the last jump of the wear and in the final run.

    `moment` is the last WearMoment, and `motion` has the measures of the final run, on the worn patch, which may have used
    smaller time steps.
    """
    wear_amplitude = moment.values.get("slip_amplitude")
    final_amplitude = motion.get("slip_amplitude")
    if wear_amplitude is None or final_amplitude is None or not final_amplitude.value:
        return 0.0
    return abs(wear_amplitude / final_amplitude.value - 1)


def _measure_point_volume(model, result, *, with_errors: bool = True) -> Measures:
    """Return a dict with the worn volume of a single contact point under [normal].

    It is the wear coefficient times load times slip path, over all cycles.

    Parameters
    ----------
    model : Model
        Model with [wear] and [normal].
    result : Result
        Result of the motion, with the histories of its last cycles.
    with_errors : bool
        Whether to estimate the error.
    """
    motion = {name: measure.value for name, measure in result.measures.items()}
    window = result.window.last_cycle if model.rig is None else result.window
    path, path_error = compute_point_slip_path(model, window, motion)
    volume = model.wear.coefficient * model.point.load * path * model.wear.cycles
    error = None
    if with_errors:
        error = (path_error + _relative_slip_error(result.measures) + WORN_ROUND_OFF) * volume
    return {"worn_volume": make_measure("worn_volume", volume, error, WORN_SOURCE)}


def _add_wear_frames(result, evolved):
    """Insert frames of the wear history before the frames of the last cycle in a Result.

    The time of a wear frame is its cycle number times the period; the last cycle follows.
    """
    model = result.plan.model
    if model.rig is not None:
        period = model.rig.drive.signal.period
    else:
        # A path that does not repeat is a cycle.
        period = model.slide.period or float(result.response.time[-1])
    states = [evolved.moments[number] for number in _select_stored_moments(evolved.moments)[:-1]]
    n_motion = len(result.fields["time"])

    # Frames of the wear history: contact after each stored jump, at rest.
    wear = {
        "time": [state.cycle * period for state in states],
        "normal_stress": [state.pressure for state in states],
        "gap": [state.gap for state in states],
        "status": [(state.pressure > 0).astype(np.int8) for state in states],
        "worn_depth": [state.depth for state in states],
    }

    # The last cycle follows all cycles of wear, and its worn depth stays as it is.
    motion = result.fields | {
        "time": result.fields["time"] + evolved.state.cycle * period,
        "worn_depth": np.repeat(evolved.state.depth[None], n_motion, axis=0),
    }
    for field, name in MEASURE_BY_HOLDER_MOTION.items():
        wear[f"holder_{field}"] = [state.values[name] for state in states]
        motion[f"holder_{field}"] = np.full(n_motion, getattr(evolved.patch.pressure, name))

    # Fields that exist only in motion are 0 in the frames of wear.
    fields = motion
    if states:
        fields = {}
        for name, field in motion.items():
            before = wear.get(name, np.zeros((len(states), *field.shape[1:])))
            fields[name] = np.concatenate([before, field])
    history = WornStates(_collect_wear_history(evolved), len(states), period)
    return result.with_changes(fields=fields, wear=history)


def _select_stored_moments(moments) -> np.ndarray:
    """Select the wear moments to store: half of them evenly by jump, half evenly by cycle.

    The last jumps are much longer than the first ones, and the worn depth changes most in them.
    """
    last = len(moments) - 1
    cycles = np.array([moment.cycle for moment in moments])
    by_jump = np.linspace(0, last, N_WEAR_FRAMES // 2).round().astype(int)
    places = np.linspace(0, cycles[-1], N_WEAR_FRAMES // 2)
    by_cycle = np.searchsorted(cycles, places).clip(0, last)
    return np.unique([*by_jump, *by_cycle])


def _collect_wear_history(evolved) -> Arrays:
    """Return a dict of the cycles (j,) and of the wear measures over them."""
    moments = evolved.moments
    history = {"cycle": [moment.cycle for moment in moments]}
    for name in moments[-1].values:
        if all(name in moment.values for moment in moments):
            history[name] = [moment.values[name] for moment in moments]
    return {name: np.array(values, float) for name, values in history.items()}
