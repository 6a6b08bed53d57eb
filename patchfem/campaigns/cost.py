"""Cost of accuracy in time: a scene run again and again with one knob turned, each run timed against its error."""

from dataclasses import dataclass, replace
from time import perf_counter

from ..core import NotConverged, PatchfemError
from ..effects import has
from ..model.model import Model
from ..model.source import placed
from ..runs.plan import plan
from ..runs.results.patch_rows import TABLE
from ..runs.run import run

KNOBS = ("element_size", "steps_per_cycle", "shear_modes", "jumps")
LEVELS = 5  # values of a knob, each twice as fine as the one before
MOST_CELLS = 1600  # columns of the finest mesh
MOST_STEPS = 12800
JUMPS = 8  # of wear, the middle of its curve


@dataclass(frozen=True, eq=False, slots=True)
class Cost:
    """One run of a cost curve.

    value: of the knob in SI, None where the tolerance chose; seconds of the whole run; values: measure -> value;
    errors: measure -> distance to the best run, of the best run its own estimate.
    """

    label: str
    value: float | None
    seconds: float
    values: dict
    errors: dict
    units: dict


def knobs_of(model: Model) -> list:
    """Knobs, of KNOBS, that change what a model computes: those of its mesh, its steps, its shear modes and its
    jumps over cycles of wear."""
    out = ["element_size"] if model.patch is not None else []
    if model.kind in ("bench", "rig") or (model.kind == "linear" and model.accuracy.method == "march"):
        engine = plan(model).engine
        if engine in ("march", "bench"):
            out.append("steps_per_cycle")
            if model.soft and has(model.friction.law, "bonds"):
                out.append("shear_modes")
    if model.wear is not None and model.patch is not None:
        out.append("jumps")
    return out


def curve(model: Model, knob: str, say=None) -> list:
    """Cost of every value of a knob, coarse to fine; a static patch ends with the mesh that its tolerance chooses.

    PatchfemError for a knob that this scene does not have.
    """
    with placed(model.source):
        return _curve(model, knob, say)


def _curve(model: Model, knob: str, say) -> list:
    mine = knobs_of(model)
    if knob not in mine:
        raise PatchfemError(f"cost --over {knob}: this scene has the knobs {', '.join(mine) or 'none'}", "")
    wanted = list(_turned(model, knob))
    _timed(wanted[0][2], "first run, not counted", wanted[0][1], None)  # imports and compiling stay out of the times
    runs = [_timed(turned, label, value, say) for label, value, turned in wanted]
    runs = [one for one in runs if one is not None]
    if len(runs) < 3:
        raise PatchfemError(f"cost --over {knob}: fewer than three values could be run", "")
    if knob == "element_size" and model.kind == "patch" and model.patch.mesh is None:
        chosen = _timed(_sized(model, None), "by tolerance", None, say, True)
        if chosen is not None:
            return [*(_beside(one, chosen) for one in runs), chosen]
    from ..runs.patch.limits import limit

    fine, coarse, coarsest = runs[:-4:-1]
    left = {name: limit([coarsest.values[name], coarse.values[name], value], False).error
            for name, value in fine.values.items() if name in coarse.values and name in coarsest.values}
    return [*(_beside(one, fine) for one in runs[:-1]), replace(fine, errors=left)]


def _beside(one: Cost, best: Cost) -> Cost:
    return replace(one, errors={name: abs(value - best.values[name]) for name, value in one.values.items()
                                if name in best.values})


def _turned(model: Model, knob: str):
    """Settings of a knob, coarse to fine: (label, value, (model, halvings of the file))."""
    if knob == "element_size" and model.patch.mesh is not None:
        for level in range(3):
            yield f"file split {2**level} x", float(2**-level), (model, level)
        return
    if knob == "element_size":
        length = model.patch.length
        middle = round(length / model.patch.size)
        for power in range(-3, LEVELS - 3):
            cells = round(middle * 2.0**power)
            if 8 <= cells <= MOST_CELLS:
                yield f"{1e6 * length / cells:.4g} um", length / cells, (_sized(model, length / cells), 0)
        return
    if knob == "jumps":
        for power in range(-2, LEVELS - 2):
            value = max(1, round((model.wear.jumps or JUMPS) * 2.0**power))
            yield str(value), float(value), (replace(model, wear=replace(model.wear, jumps=value)), 0)
        return
    from ..runs.rig.numerics import choose

    now = getattr(model.accuracy, knob) or (choose(model).steps if knob == "steps_per_cycle" and model.kind == "rig"
                                            else {"steps_per_cycle": 400, "shear_modes": 8}[knob])
    for power in range(-2, LEVELS - 2):
        value = max(1, round(now * 2.0**power))
        if knob == "shear_modes" or 4 <= value <= MOST_STEPS:
            accuracy = model.accuracy.model_copy(update={knob: value})
            yield str(value), float(value), (replace(model, accuracy=accuracy), 0)


def _sized(model: Model, size: float | None) -> Model:
    return replace(model, patch=model.patch.sized(size))


def _timed(turned, label: str, value, say, estimate: bool = False):
    model, level = turned if isinstance(turned, tuple) else (turned, 0)
    begin = perf_counter()
    try:
        if level or (model.kind == "patch" and model.patch.mesh is not None):
            (values, units), errors = _split_file(model, level), {}
        else:
            found = run(plan(model), estimate=estimate, fresh=True).measures
            values = {name: m.value for name, m in found.items() if m.value is not None}
            errors = {name: m.error for name, m in found.items() if m.error is not None} if estimate else {}
            units = {name: m.unit for name, m in found.items()}
    except (NotConverged, MemoryError) as error:
        if say is not None:
            say(f"{label}: left out ({error or 'out of memory'})")
        return None
    seconds = perf_counter() - begin
    if say is not None:
        say(f"{label}: {seconds:.2f} s")
    return Cost(label, value, seconds, values, errors, units)


def _split_file(model: Model, level: int) -> tuple:
    """Static measures on the mesh of a file with every edge halved `level` times."""
    from ..runs.patch.ladder import solve_split

    return solve_split(model.patch, level), {name: row.unit for name, row in TABLE.items()}


def turned_by(runs: list) -> list:
    """Names of the measures that the knob changes at all, beyond 1e-11 of their value, in the order of the runs."""
    return [name for name, value in runs[0].values.items()
            if any(one.errors.get(name, 0.0) > 1e-11 * abs(one.values[name]) for one in runs[:-1])]


def cheapest(runs: list, tolerance: float) -> dict:
    """Label of the quickest run within the tolerance, by measure; None where no run is.

    A coarse run that is right by chance does not count: no finer run may leave the tolerance again.
    """
    out = {}
    for name in turned_by(runs):
        good = []
        for one in reversed(runs):
            if name not in one.errors or one.errors[name] > tolerance * abs(one.values[name]):
                break
            good.append(one)
        out[name] = min(good, key=lambda one: one.seconds).label if good else None
    return out
