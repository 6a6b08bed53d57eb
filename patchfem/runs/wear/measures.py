"""Measures of wear with their errors, and the history of wear as arrays over the cycles.

In: the Result of a run on the worn patch, and its `Evolved`. Out: the Result with the measures,
fields, warnings and notes of wear.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...core import Measure, Outcome, frozen_array
from ...formatting import format_length, format_number
from ...response.errors import convergence_errors, error_of_change
from ..patch.measures import other_strips
from ..patch.press import areas, press_patch
from ..patch.values import values
from ..results.patch_rows import TABLE, WORN_SOURCE
from .evolve import THIN, mean_depth, worn_through
from .slip import UNBOUNDED_OUTCOMES, slip_path_of_point

FRAMES = 24  # frames of the interface during the wear
# name of the peak at an edge of the contact in the history; nodes next to an edge that count as the
# edge
EDGE_PEAK, N_EDGE_NODES = (
    "pressure_peak_at_edge",
    2,
)
HOLDER = {"closing": "approach", "rotation": "rotation"}


def add_wear_measures(result, found, estimate: bool = True):
    """Return the Result of a run on the worn patch with the measures of wear.

    Parameters
    ----------
    result : Result
    found : Evolved or None
        None for a single point.
    estimate : bool
        Whether errors are computed.
    """
    model = result.plan.model
    if found is None and result.outcome in UNBOUNDED_OUTCOMES:
        return replace(
            result, warnings=[*result.warnings, f"nothing was worn: {result.outcome.sentence}"]
        )
    if found is None:
        return replace(result, measures=result.measures | volume_of_point(model, result, estimate))
    seconds = result.seconds | {"wear": found.seconds}
    warnings = [*result.warnings, *([found.stopped] if found.stopped else [])]
    if found.state is None:
        return replace(result, seconds=seconds, warnings=warnings)
    period = find_period(model, result)
    fields = frames(found, result.fields, period)
    shown = {"period": period, "states": len(fields["time"]) - len(result.fields["time"])}
    static = widen_by_jumps(model, found, result.measures) if estimate else {}
    lost = measure_patch_wear(model, found, result.measures, estimate)
    if model.wear.friction is not None:
        lost |= worn_friction(model, found, result.measures, lost["worn_volume"].error)
    gone = _worn_through_cycle(model, found, lost["worn_depth_max"].error)
    notes = result.extra.get("notes", [])
    outcome = (
        Outcome.WORN_THROUGH
        if gone and result.outcome not in UNBOUNDED_OUTCOMES
        else result.outcome
    )
    return replace(
        result,
        outcome=outcome,
        measures=result.measures | static | lost | gone,
        fields=fields,
        seconds=seconds,
        warnings=[*warnings, *_warn_of_depth(model, found), *_beyond_table_sentence(model, found)],
        extra=result.extra
        | {
            "wear": history(found),
            "wear_shown": shown,
            "notes": [*notes, *_note_on_start(model), *_note_on_coating(model, found, gone)],
        },
    )


def _worn_through_cycle(model, found, error: float | None) -> dict:
    """Return worn_through_cycle by name if a coating is worn through.

    error: of the largest depth [m].
    """
    if worn_through(model, found.state.depth) is None:
        return {}
    before, last = found.moments[-2:]
    deepest = int(np.argmax(last.depth))
    rate = float(last.depth.flat[deepest] - before.depth.flat[deepest]) / (
        last.cycle - before.cycle
    )
    off = None if error is None else (error + THIN * float(last.depth.flat[deepest])) / rate
    row = TABLE["worn_through_cycle"]
    return {row.name: Measure(last.cycle, row.unit, off, row.floor)}


def _note_on_start(model) -> list:
    """Return a note on the earlier run from which this one continues."""
    return [] if model.wear.start is None else [model.wear.start.sentence]


def _note_on_coating(model, found, gone: dict) -> list:
    """Return a note on the coating that is worn through."""
    if not gone:
        return []
    (name, thickness), depth = worn_through(model, found.state.depth), found.state.depth
    strip, node = divmod(int(np.argmax(depth)), found.patch.x.size)
    place = f"x = {format_length(float(found.patch.x[node]), 3)}"
    if model.patch.interface.strips is not None:
        place += (
            f" of the strip at y = {format_length(float(found.patch.strips.offsets[strip]), 3)}"
        )
    return [
        f"the coating of the {name} piece, {format_length(thickness)}, is worn through at {place} after "
        f"{format_number(found.state.cycle, 4)} of {format_number(model.wear.cycles, 7)} cycles; "
        "the measures are those of the "
        "patch at that cycle"
    ]


def widen_by_jumps(model, found, measures: dict) -> dict:
    """Return measures of the worn patch whose errors include those due to the length of the jumps.

    They follow, at first order, from the change if the depth is computed by the same jumps without
    subdivision, and from the change to another number of strips: an edge of contact that moves
    during a jump leaves nodes that just came into contact too high.

    Parameters
    ----------
    model : Model
    found : Evolved
    measures : dict
        Measures by name.
    """
    rough = values(
        press_patch(model.patch, found.patch.pair, frozen_array(found.state.coarse_depth))
    )
    here = values(found.patch)
    other = values(found.stripped[0]) if found.stripped else here
    ratio = other_strips(model.patch)[1]
    added = {
        name: error_of_change(here[name] - rough[name])
        + error_of_change(here[name] - other[name], ratio)
        for name in here
    }
    return {
        name: replace(m, error=float(m.error + added[name]))
        for name, m in measures.items()
        if name in here and m.error is not None
    }


def find_period(model, result) -> float:
    """Return the duration of one cycle of wear [s].

    It is the period of the drive or of the slide, or the duration of a path that does not repeat.
    """
    if model.rig is not None:
        return model.rig.drive.signal.period
    return model.slide.period or float(result.response.time[-1])


def _warn_of_depth(model, found) -> list:
    """Return warnings of a worn depth that invalidates the stiffness of the unworn pieces."""
    depth = float(found.state.depth.max(initial=0.0))
    asked = model.patch
    out = []
    for share, piece, name in (
        (model.wear.upper_share, asked.pieces.upper, "upper"),
        (1 - model.wear.upper_share, asked.pieces.lower, "lower"),
    ):
        if share * depth > 0.2 * (piece.thickness or piece.height):
            out.append(
                f"up to {format_length(share * depth, 3)} is worn off the {name} piece, more than 0.2 of "
                f"{'the thickness of its coating' if piece.coating is not None else 'its height'}, but the "
                "computation still uses the stiffness of the unworn piece"
            )
    return out


def slip_miss(measures: dict) -> float:
    """Return the relative error of the slip of a run.

    It is that of the slip amplitude, or else of the displacement.
    """
    for name in ("slip_amplitude", "relative_displacement_amplitude"):
        found = measures.get(name)
        if found is not None and found.value and found.error is not None:
            return abs(found.error / found.value)
    return 0.0


def measure_patch_wear(model, found, motion: dict, estimate: bool = True) -> dict:
    """Return worn_volume and worn_depth_max with errors that include earlier runs.

    Parameters
    ----------
    model : Model
    found : Evolved
    motion : dict
        Measures of the run on the worn patch by name.
    estimate : bool
        Whether errors are computed.
    """
    state = found.state
    area = areas(model.patch, found.patch.pieces.interface)
    share = found.miss + slip_miss(motion) + _coarser(found, motion)
    mine, *others = [
        _worn_measures(model.patch, *one)
        for one in [(found.patch, state.depth), *zip(found.coarse, found.depths)]
    ]
    asked, ratio = other_strips(model.patch)
    strips = _worn_measures(asked, *found.stripped) if found.stripped else mine
    jumps = {
        "worn_volume": float(np.vdot(np.abs(state.depth - state.coarse_depth), area))
        + state.path_error * float(area.sum()),
        "worn_depth_max": state.error,
    }
    out = {}
    before = found.moments[0].values
    first = model.wear.start
    meshes = convergence_errors(mine, *others) if others else {}
    for name, value in mine.items():
        error = None
        more = 0.0 if first is None else first.measure_error(name, before[name])
        if others and estimate and more is not None:
            error = (
                jumps[name]
                + share * max(value - before[name], 0.0)
                + float(meshes[name])
                + 1e-12 * value
                + more
                + float(error_of_change(strips[name] - value, ratio))
            )
        out[name] = Measure(value, TABLE[name].unit, error, TABLE[name].floor, engine=WORN_SOURCE)
    left = found.moments[-1].values.get("groove_amplitude")
    if left is not None:
        lost = out["worn_volume"].error
        row = TABLE["groove_amplitude"]
        out[row.name] = Measure(
            left,
            row.unit,
            None if lost is None else lost / float(area.sum()),
            row.floor,
            engine=WORN_SOURCE,
        )
    return out


def worn_friction(model, found, motion: dict, error: float | None) -> dict:
    """Return the parameters of the friction law after wear, and measures with wider errors.

    The error of the mean depth changes the measures of the motion, at the rate of the last two
    jumps.

    Parameters
    ----------
    model : Model
    found : Evolved
    motion : dict
        Measures of the run on the worn patch by name.
    error : float or None
        Error of the worn volume [m3].
    """
    change = model.wear.friction
    area = float(found.patch.pieces.interface.weight.sum())
    deep = [mean_depth(found.patch, moment.depth) for moment in found.moments[-3:]]
    off = None if error is None else error / area
    depths = () if off is None else (deep[-1] - off, deep[-1] + off)
    ends = [change.compute_worn_law(model.friction, max(depth, 0.0)) for depth in depths]
    law = change.compute_worn_law(model.friction, deep[-1])
    out = {}
    for name, key in (("static_coefficient", "static"), ("bond_length", "bond_length")):
        value = getattr(law, key)
        row = TABLE[name]
        if value is not None:
            spread = max((abs(getattr(end, key) - value) for end in ends), default=None)
            out[name] = Measure(value, row.unit, spread, row.floor)
    steps = [
        (one, two, b - a) for (one, a), (two, b) in pairwise(zip(found.moments[-3:], deep)) if b > a
    ]
    for name, m in motion.items():
        if off is not None and m.error is not None and name not in values(found.patch):
            rates = [
                abs(two.values[name] - one.values[name]) / step
                for one, two, step in steps
                if name in one.values and name in two.values
            ]
            out[name] = replace(m, error=m.error + off * max(rates, default=0.0))
    return out


def _beyond_table_sentence(model, found) -> list:
    """Return warnings of wear beyond the table of friction, and of jumps past its rows."""
    change = model.wear.friction
    if change is None:
        return []
    deep = [mean_depth(found.patch, moment.depth) for moment in found.moments]
    out = []
    if deep[-1] > change.depth[-1]:
        out.append(
            f"the mean worn depth, {format_length(deep[-1], 3)}, is larger than the last value of wear.friction.depth, "
            f"{format_length(change.depth[-1], 3)}, and beyond that depth friction is taken as constant; extend the table "
            f"wear.friction to a depth of at least {format_length(deep[-1], 3)}"
        )
    past = (
        max(sum(one < row < two for row in change.depth) for one, two in pairwise(deep))
        if len(deep) > 1
        else 0
    )
    if model.wear.jumps and past > 1:
        out.append(
            f"one jump of the wear passes {past} rows of the table wear.friction at once, so the values of some "
            "rows are not used; leave out wear.jumps"
        )
    return out


def _worn_measures(asked, patch, depth) -> dict:
    """Return worn volume [m3] and largest depth [m] of a `PatchModel` by name."""
    return {
        "worn_volume": float(np.vdot(depth, areas(asked, patch.pieces.interface))),
        "worn_depth_max": float(depth.max(initial=0.0)),
    }


def _coarser(found, motion: dict) -> float:
    """Return the relative difference of the slip in the last cycle of wear from that of the run.

    The run on the worn patch may have used smaller steps for its tolerance.
    """
    used = found.moments[-1].values.get("slip_amplitude")
    last = motion.get("slip_amplitude")
    return (
        abs(used / last.value - 1) if used is not None and last is not None and last.value else 0.0
    )


def volume_of_point(model, result, estimate: bool = True) -> dict:
    """Return worn_volume of a single point under [normal] by name.

    It is coefficient times load times slip path, over all cycles of wear.

    Parameters
    ----------
    model : Model
    result : Result
    estimate : bool
        Whether the error is computed.
    """
    path, miss = slip_path_of_point(
        model, result.window, {name: m.value for name, m in result.measures.items()}
    )
    value = model.wear.coefficient * model.point.load * path * model.wear.cycles
    error = (miss + slip_miss(result.measures) + 1e-12) * value if estimate else None
    return {
        "worn_volume": Measure(
            value, TABLE["worn_volume"].unit, error, TABLE["worn_volume"].floor, engine=WORN_SOURCE
        )
    }


def frames(found, fields: dict, period: float) -> dict:
    """Return the fields (frame, x) of the wear and of the last cycle by name.

    The states after some of the jumps come first, then the motion. The time of a state is its cycle
    times the period, and the last cycle follows. The worn depth of strips is (frame, strip, x).

    Parameters
    ----------
    found : Evolved
    fields : dict
        Fields of the last cycle.
    period : float
        Period [s].
    """
    pick = np.unique(np.linspace(0, len(found.moments) - 1, FRAMES).round().astype(int))
    shown = [found.moments[k] for k in pick[:-1]] if len(pick) > 1 else []
    count = len(shown)
    m = found.patch.x.size
    depth = np.repeat(found.state.depth[None], len(fields["time"]), axis=0)
    states = {
        "time": np.array([one.cycle for one in shown]) * period,
        "normal_stress": np.array([one.pressure for one in shown]).reshape(count, m),
        "gap": np.array([one.gap for one in shown]).reshape(count, m),
        "status": np.array([one.pressure > 0 for one in shown], np.int8).reshape(count, m),
        "worn_depth": np.array([one.depth for one in shown]).reshape(
            count, *found.state.depth.shape
        ),
    }
    moving = fields | {
        f"holder_{name}": np.full(len(fields["time"]), getattr(found.patch.pressure, of))
        for name, of in HOLDER.items()
    }
    states |= {
        f"holder_{name}": np.array([one.values[of] for one in shown]) for name, of in HOLDER.items()
    }
    moving |= {"time": fields["time"] + found.state.cycle * period, "worn_depth": depth}
    return {
        name: np.concatenate([states.get(name, np.zeros((count, *np.shape(values)[1:]))), values])
        for name, values in moving.items()
    }


def history(found) -> dict:
    """Return measures over the cycles (j,) by name, with `cycle` and `EDGE_PEAK`.

    They are those that all moments have.
    """
    moments = found.moments
    names = [
        name for name in moments[-1].values if all(name in moment.values for moment in moments)
    ]
    return (
        {"cycle": np.array([moment.cycle for moment in moments])}
        | {name: np.array([moment.values[name] for moment in moments], float) for name in names}
        | {EDGE_PEAK: np.array([edge_peak(moment.pressure) for moment in moments])}
    )


def edge_peak(pressure) -> float:
    """Return by how much [Pa] the pressure at an edge of the contact exceeds that inside.

    It is 0 if the largest pressure is inside, or if the contact ends with the piece. A contact edge
    between two nodes moves as the pieces wear, and the element at the edge carries part of the load
    of its neighbours: the error of such a peak is this excess. pressure: (m,) [Pa].
    """
    bears = np.asarray(pressure) > 0
    top = int(np.argmax(pressure))
    inside = (
        np.convolve(np.pad(bears, N_EDGE_NODES, "edge"), np.ones(2 * N_EDGE_NODES + 1), "valid")
        > 2 * N_EDGE_NODES
    )
    if inside[top] or not (bears & inside).any():
        return 0.0
    return float(pressure[top] - np.asarray(pressure)[inside].max())
