"""A coupled run from its plan to its result: engine, errors by coarser runs, levels, frames of the interface."""

from dataclasses import replace

import numpy as np

from ...core import Outcome, PatchfemError
from ...effects import has, listed
from ...friction.record import law_from
from ...model.accuracy import MOST_STEPS, choose, refuse_costly
from ...model.engine import COMPARED, set_valued
from ...response.errors import change, step_error, with_errors
from ...response.outcome import changing_note, settle
from ...response.run_events import events_of, with_own
from ..fields import element_fields, point_fields
from ..result import FRAMES, Result, creeping, frames_of, unripe, warming, without_errors
from .march import created_warning, run_march, sampled


def coupled(what, patch, coarse, seconds, warnings, say, progress, per_point, estimate) -> Result:
    """Run a plan of kind rig or linear; arguments as `run.run` has them, patch and coarse of its [contact]."""
    model, rig, f = what.model, what.model.rig, what.model.friction
    numerics, drive = choose(model, per_point), rig.drive
    warnings = [*warnings, *rig.notes]
    if rig.start is None and rig.kind != "free" and not np.any(rig.modes.base):
        raise PatchfemError("the drive pushes no mode, so nothing moves; give a mode its share of it, base or output",
                            "drive.kind")
    extra = {"engine": numerics.engine, "cycles": numerics.cycles, "window": numerics.window}
    lumps = f is not None and not has(f.law, "averaged")
    moves = rig.load_varies or rig.strips_slide_apart
    if patch is not None and lumps and not model.soft and not numerics.per_point and not moves:
        warnings = [*warnings, "nothing spatial acts on the motion: with a rigid slide, constant load and the pressure "
                    "on the upper piece the patch moves exactly as one point under the same load; add [contact.shear]"]
    if numerics.engine == "exact":
        raw, found = _exact(model, numerics, patch, coarse[0] if estimate else None, seconds, say, progress)
    elif numerics.engine == "harmonic":
        from .steady import curve_measures, steady

        raw, errors, more = steady(model, numerics, patch, say)
        seconds["march"] = raw.seconds
        found, extra = with_errors(raw.values, errors) | curve_measures(more), extra | more
        drive = extra.pop("at", drive)
    else:
        refuse_costly(model, numerics)
        raw, numerics, found = _marched(model, numerics, patch, coarse, seconds, say, progress, estimate)
        extra |= {"steps_per_cycle": numerics.steps, "iterations": raw.book["iterations"]}
    if raw.levels:
        from . import levels

        lowest = levels.onset(raw.levels, raw.slips, model.accuracy.tolerance)
        found, extra = found | levels.measures(raw.levels, lowest), extra | {"levels": raw.levels}
    estimated = estimate and raw.outcome is not Outcome.NOT_CONVERGED
    found = with_own(found, raw.own)
    outcome, found = settle(raw, without_errors(found, estimated), model.accuracy.tolerance, drive, rig.level_cycles)
    if f is not None:
        extra["events"] = events_of(raw.window, drive, raw.log, raw.held)
    fields = {}
    if patch is not None:
        from ..patch.measures import measures

        found = measures(patch, *coarse) | {k: m for k, m in found.items() if k != "normal_load"}
        fields = _rig_fields(model, numerics, patch, raw)
    extra |= {"book": raw.book, "period": drive.period}
    warnings = [*warnings, *_said(model, patch, raw, outcome, found)]
    warnings = [*warnings, *changing_note(outcome, drive), *raw.notes, *([raw.message] if raw.message else [])]
    return Result(what, outcome, found, raw.response, raw.window, patch, fields, seconds, warnings, extra)


def _said(model, patch, raw, outcome, found) -> list:
    """Warnings of the law and of the load, in this run."""
    f, out = model.friction, warming(model, patch, raw.response, raw.book["friction"])
    if f is not None and has(f.law, "creeps"):
        out = [*out, f"law '{f.law}' never holds: under a steady half of the limit it creeps at "
               f"{0.5493 * f.reference_speed:.3g} m/s"]
    if f is not None and has(f.law, "bonds"):
        law = model.bonds
        out = [*out, *unripe(law, float(np.abs(raw.window.slide_rate).max())), *creeping(law, outcome, found)]
    out = [*out, *created_warning(model, raw.book, model.rig.cycles)]
    if patch is not None and model.rig.load_varies:
        from .varying_load import shear_note

        out = [*out, *shear_note(model, raw.contact)]
    return out


def _exact(model, numerics, patch, coarse, seconds, say, progress) -> tuple:
    """(Raw of the exact engine, measures with errors): those of the mesh, where the loads of strips or the limit of an
    averaged law come from it."""
    from .exact import run_exact

    apart = model.rig.strips_slide_apart
    share, rough = _shares(model, patch, coarse)
    raw = run_exact(model, numerics, patch, share, say, progress)
    seconds["march"] = raw.seconds
    errors = [sampled(raw.values)] if apart else []
    if apart and coarse is not None:
        other = run_exact(model, numerics, coarse, 1.0, say)
        errors, seconds["error"] = [*errors, change(raw.values, other.values)], other.seconds
    if rough is not None:
        other = run_exact(model, numerics, coarse, rough)
        errors, seconds["error"] = [change(raw.values, other.values)], other.seconds
    return raw, with_errors(raw.values, *errors, least=1e-9)


def _shares(model, patch, coarse) -> tuple:
    """Shares of mu N that limit a rigid block, on the mesh of the patch and on the coarser one, None where it is 1."""
    if model.friction is None or not has(model.friction.law, "averaged"):
        return 1.0, None
    from ..bench.averaged import limit_share

    return limit_share(model, patch), None if coarse is None else limit_share(model, coarse)


def _marched(model, numerics, patch, coarse, seconds, say, progress, estimate) -> tuple:
    """The march with its error: half and a quarter of the steps, a coarser mesh, fewer shear modes; an automatic step
    is halved until the error of the displacement is met."""
    frames = FRAMES if patch is not None else 0
    go = run_march
    if numerics.engine in COMPARED:
        from .comparison import run_comparison as go
    raw = go(model, numerics, patch, frames, say, progress)
    seconds |= {"march": raw.seconds, "reduce": raw.prepare["reduce"], "load": raw.prepare["load"], "error": 0.0}
    if not estimate or raw.outcome is Outcome.NOT_CONVERGED:
        return raw, numerics, with_errors(raw.values)
    half, quarter = (go(model, replace(numerics, steps=max(1, numerics.steps // k)), patch)
                     for k in (2, 4))
    seconds["error"] += half.seconds + quarter.seconds
    rest = _space_errors(model, numerics, patch, coarse, quarter, seconds)
    tolerance = model.accuracy.tolerance
    while True:
        step = step_error(raw.values, half.values, quarter.values, numerics.steps)
        if set_valued(model, numerics):
            step = _beside(step, raw, lambda n, s=numerics: go(model, replace(s, steps=n), patch),
                           numerics.steps)
        found = with_errors(raw.values, step, *rest, least=1e-9)
        main = found["relative_displacement_amplitude"]
        if raw.levels:
            from .levels import with_errors as level_errors

            raw = replace(raw, levels=level_errors(raw.levels, half.levels, quarter.levels, numerics.steps))
        met = main.error <= tolerance * abs(main.value) + main.floor
        again = numerics.steps * 2
        if met or "steps_per_cycle" in numerics.pinned or again > MOST_STEPS or again * numerics.cycles > 1e7 \
                or raw.outcome is Outcome.EXCEEDS_TRAVEL:
            return raw, numerics, found
        half, quarter, numerics = raw, half, replace(numerics, steps=again)
        seconds["error"] += raw.seconds
        raw = go(model, numerics, patch, frames, say, progress)
        seconds["march"] = raw.seconds


def _beside(step: dict, raw, run, steps: int) -> dict:
    """Errors of a march of set-valued friction: where in a step a slide reverses is chance, so its error does not fall
    evenly; runs at 15/16, 7/8 and 3/4 of the steps show its size. Three halves of the largest change count."""
    out = dict(step)
    for share in (15 / 16, 7 / 8, 3 / 4):
        for name, gap in change(raw.values, run(max(4, round(share * steps))).values).items():
            out[name] = max(out.get(name, 0.0), 1.5 * gap)
    return out


def _space_errors(model, numerics, patch, coarse, quarter, seconds) -> list:
    """Errors of the mesh and of the shear modes, both at a quarter of the steps."""
    out = []
    few = replace(numerics, steps=max(1, numerics.steps // 4))
    if coarse[0] is not None and model.rig.load_varies:
        rough = run_march(model, few, coarse[0])
        out.append(change(quarter.values, rough.values))
        seconds["error"] += rough.seconds
    elif coarse[0] is not None and model.soft:
        rough = run_march(model, few, coarse[0])
        out.append(change(quarter.values, rough.values))
        seconds["error"] += rough.seconds
    shape = getattr(getattr(quarter.contact, "reduction", None), "stiffness", None)
    if shape is not None and (model.rig.load_varies or (coarse[0] is not None and has(model.friction.law, "bonds"))):
        fewer = run_march(model, replace(few, shear_modes=max(1, shape.size // 2)), patch)
        out.append(change(quarter.values, fewer.values))
        seconds["error"] += fewer.seconds
    return out


def _rig_fields(model, numerics, patch, raw) -> dict:
    """Interface frames of the last cycle."""

    sigma, f = patch.pressure.sigma_n, model.friction
    if model.rig.load_varies:
        from .varying_load import frames_of as wrench_frames

        return wrench_frames(model, patch, raw)
    if numerics.engine == "exact" or not raw.snapshots:
        at = np.linspace(max(0, len(raw.window.time) - 1 - len(raw.window.time) // numerics.window),
                         len(raw.window.time) - 1, FRAMES).round().astype(int)
        tau = np.outer(raw.window.force[at] / patch.pressure.load, sigma)
        if f is not None and has(f.law, "averaged"):
            from ..bench.averaged import limit_tractions

            tau = limit_tractions(model, patch, raw.window.force[at])
        slip = np.repeat(raw.window.slip[at][:, None], sigma.size, axis=1)
        return frames_of(patch, raw.window.time[at], tau, slip, raw.window.slide[at])
    shots = raw.snapshots
    time = np.array([s["time"] for s in shots])
    shear = bool(model.soft)
    if has(f.law, "bonds") and not listed(f) and (shear or numerics.per_point):
        tau, local = point_fields(patch, model.bonds, raw.contact.reduction, [(s["slide"], s["bonds"]) for s in shots])
    elif shear:
        length = law_from(f).element(1.0).length
        states = [(s["slide"], s["stretch"]) for s in shots]
        tau, local = element_fields(patch, raw.contact.reduction, states, length)
    else:
        tau = np.array([s["force"] / patch.pressure.load * sigma for s in shots])
        local = np.array([np.full(sigma.size, s["slip"]) for s in shots])
    return frames_of(patch, time, tau, local, np.array([s["slide"] for s in shots]))
