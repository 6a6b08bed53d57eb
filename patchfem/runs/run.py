"""A run from its plan to its result: plan(scene) says what would run, run(plan) runs it."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ..core import Measure, Outcome
from ..effects import has
from ..model.model import Model
from ..model.source import placed
from .plan import Plan, plan, refuse_size
from .results.result import FRAMES, Result, frames_of, still, unripe, warming, without_errors, worded

__all__ = ["Plan", "Result", "plan", "run"]


def run(what, say=None, progress=None, per_point: bool = False, estimate: bool = True, fresh: bool = False) -> Result:
    """Run a Plan, or plan and run a Scene or a Model.

    say: called with one line when compiled code has to be made; progress: called with the share of the main pass that
    is done. per_point forces the path of every interface point where one lumped point would do; estimate=False skips
    the coarser runs and leaves the errors None; fresh condenses the pieces anew. NotConverged and Missing as named by
    the stages.
    """
    what = what if isinstance(what, Plan) else plan(what, per_point)
    with placed(what.model.source):
        refuse_size(what)
        return _run(what, say, progress, per_point, estimate, fresh)


def _run(what: Plan, say, progress, per_point: bool, estimate: bool, fresh: bool) -> Result:
    begin, model = perf_counter(), what.model
    seconds, warnings = {}, list(model.source.remarks)
    patch, coarse = None, (None, None)
    if model.patch is not None:
        from .patch.ladder import solve_all

        patch, *coarse = solve_all(model.patch, model.accuracy.tolerance, estimate, fresh)
        seconds["contact"] = perf_counter() - begin
        warnings += [*_strained(model.patch, patch), *patch.notes]
        if estimate and coarse[0] is None:
            warnings.append(f"no error is estimated on {patch.x.size - 1} elements along the interface; lower "
                            "contact.element_size")
        if patch.pair.coupling > 0.02 and model.kind != "patch":
            warnings.append("the pieces are unlike: the coupling between shear and normal closing is left out; it "
                            f"is {patch.pair.coupling:.2g} of the tangential compliance")
    if patch is not None and patch.pressure.outcome is Outcome.NO_CONTACT and model.kind != "patch":
        warnings.append("no friction acts and no motion was computed")
        result = _static(what, patch, coarse, seconds, warnings)
    elif _unloaded(model):
        warnings += [Outcome.NO_CONTACT.sentence, "no friction acts and no motion was computed"]
        result = Result(what, Outcome.NO_CONTACT, {"normal_load": Measure(0.0, "N", 0.0)}, None, None, None, {},
                        seconds, warnings, {})
    else:
        evolved = None
        if model.wear is not None and patch is not None:
            from .wear.evolve import evolve

            evolved = evolve(model, patch, coarse, progress)
            patch, coarse = evolved.patch, evolved.coarse
        result = _KINDS[what.kind](what, patch, coarse, seconds, warnings, say, progress, per_point, estimate)
        if model.wear is not None:
            from .wear.measures import worn

            result = worn(result, evolved, estimate)
    seconds["total"] = perf_counter() - begin
    apart = "strip" if model.patch is not None else "interface"
    return replace(result, measures=worded(result.measures, apart), warnings=result.warnings + _loose(result))


def _unloaded(model: Model) -> bool:
    """Whether no interface of a model without a patch bears a load."""
    if model.rig is not None and len(model.rig.names):
        return not any(one.load for one in model.rig.interfaces)
    return model.point is not None and model.point.load == 0


def _loose(result: Result) -> list:
    """Warnings of the measures whose error exceeds tolerance * |value| + floor, all in one line."""
    model = result.plan.model
    tolerance, asked, remedies = model.accuracy.tolerance, model.patch, []
    wide = [name for name, m in result.measures.items()
            if m.error is not None and m.error > tolerance * abs(m.value) + m.floor]
    if not wide:
        return []
    if asked is not None and asked.mesh is not None:
        remedies.append("split the elements of contact.mesh")
    elif asked is not None and asked.chosen:
        remedies.append("the mesh is the finest that the tolerance may choose, so these errors stay")
    elif asked is not None:
        remedies.append("lower contact.element_size")
    finer = "harmonics" if result.extra.get("engine") == "harmonic" else "steps_per_cycle"
    remedies += [f"raise accuracy.{finer}"] if model.kind in ("rig", "bench") else []
    return [f"estimated error above the tolerance {tolerance:g} for {', '.join(sorted(wide))}; "
            f"{' or '.join(remedies)}"]


def _strained(asked, patch) -> list:
    """Warnings where the answer leaves small strains, or where bilinear cells lock."""
    out, pieces = [], (asked.lower, asked.upper)
    stuff = [m for piece in pieces for m in (piece.substrate, piece.coating and piece.coating.material) if m]
    deep = patch.pressure.sigma_n.max(initial=0.0) / min(m.young for m in stuff)
    closed = patch.pressure.approach / sum(piece.height for piece in pieces)
    for share, what in ((deep, "the peak pressure is {:.3g} of the lowest Young's modulus"),
                        (closed, "the approach is {:.3g} of the pieces' height")):
        if share > 0.02:
            out.append(what.format(share) + ", beyond the small strains that are assumed (0.02)")
    stiff = max(m.poisson for m in stuff)
    if asked.plane == "strain" and stiff > 0.47:
        out.append(f"Poisson's ratio {stiff:g} in plane strain: bilinear cells lock towards 0.5; the pressure peak is "
                   "some 2 % too high at 0.45, 7 % at 0.499 and wrong beyond")
    return out


def _overhang(asked, fine) -> list:
    """Warnings of a bench whose slide leaves the patch or whose law has no finite peak."""
    out, travel = [], float(np.abs(fine.slide).max()) / asked.length
    if fine.lateral is not None and (aside := float(np.abs(fine.lateral).max()) / asked.width) > 0.1:
        out.append(f"the slide across is {aside:.2g} of the width; the overhang is not modelled")
    lost = 1 - float(fine.load.min() / fine.load[0]) if fine.load[0] > 0 else 0.0
    if lost > 0.01:
        out.append(f"the upper piece slides off the pressure: {100 * lost:.0f} % of the load is not carried at the end")
    elif travel > 0.1:
        out.append(f"the slide is {travel:.2g} of the patch; the pressure rides on the upper piece and the overhang is "
                   "not modelled")
    return out


def _static(what, patch, coarse, seconds, warnings, *_) -> Result:
    from .patch.measures import measures, plane_band, strip_error

    p, extra = patch.pressure, {"residuals": dict(patch.pressure.residuals), "iterations": patch.pressure.iterations}
    if p.outcome is Outcome.NO_CONTACT:
        warnings = [*warnings, Outcome.NO_CONTACT.sentence]
    elif coarse[-1] is not None and what.kind == "patch":
        warnings = [*warnings, *plane_band(what.model.patch, coarse[0])]
    found = measures(patch, *coarse)
    if patch.strips is not None and coarse[0] is not None:
        found = strip_error(what.model.patch, coarse[0], found)
    return Result(what, p.outcome, found, None, None, patch, still(patch), seconds, warnings, extra)


def _bench(what, patch, coarse, seconds, warnings, say, progress, per_point, estimate) -> Result:
    from ..response.errors import with_errors
    from .bench import bench
    from .bench.errors import errors_of
    from .bench.watch import Watch

    model, f = what.model, what.model.friction
    if has(f.law, "bonds") and f.order < 0 and f.initial_bonds > 0:
        warnings = [*warnings, "friction.order below 0 with friction.initial_bonds: the traction is infinite at the "
                    "first instant, so friction peaks depend on the step; set initial_bonds = 0"]
    if has(f.law, "bonds"):
        warnings = [*warnings, *unripe(model.bonds, model.speed)]
        if f.reading == "report" and model.load_varies:
            warnings = [*warnings, "as printed a bond keeps the pressure it formed under: while the load falls the "
                        "friction may exceed mu_s N; reading = \"stretch\" keeps to it"]
    steps = model.slide.steps(model.accuracy.tolerance, model.accuracy.steps_per_cycle, f.bond_length)
    frames = FRAMES if patch is not None else 0
    fine = bench.run(model, patch, steps, frames, watch=Watch(None, say, progress))
    seconds["bench"] = fine.seconds
    others = []
    if estimate:
        others, seconds["error"] = errors_of(model, patch, coarse[0], fine, steps, say)
    found = with_errors(fine.values, *others, least=1e-10)
    fields, created, power = {}, fine.values["energy_created"], np.abs(np.diff(fine.ledger[0])).sum()
    if f.reading == "report" and created > 1e-6 * power:
        warnings = [*warnings, f"the law as printed created {created:.3g} J, {100 * created / power:.2g} % of the work "
                    "that went to and fro: reading = \"stretch\" creates none"]
    warnings = [*warnings, *warming(model, patch, fine)]
    if patch is not None:
        from .patch.measures import measures

        found = measures(patch, *coarse) | {k: m for k, m in found.items() if k != "normal_load"}
        warnings = warnings + _overhang(model.patch, fine)
        fields = frames_of(patch, fine.time[fine.frames], fine.tau, fine.local, fine.slide[fine.frames])
    return Result(what, Outcome.DONE, without_errors(found, estimate), fine, fine, patch, fields, seconds, warnings,
                  {"engine": fine.engine.name, "steps": steps})


def _coupled(*words) -> Result:
    from .rig.rig import coupled

    return coupled(*words)


_KINDS = {"patch": _static, "bench": _bench, "rig": _coupled, "linear": _coupled}
