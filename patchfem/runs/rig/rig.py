"""A coupled run from its plan to its result: engine, errors by coarser runs, levels, frames of the interface."""

from dataclasses import replace

import numpy as np

from ...core import Outcome
from ...effects import has, listed
from ...friction.record import law_from
from ...model.accuracy import MOST_STEPS, choose, refuse_costly
from ...model.drive import drive_of, refuse_rest, speed_of
from ...model.engine import COMPARED, set_valued
from ...model.interfaces import acts, viewed, yaws
from ...model.law import law_of
from ...model.structure import modes_of, notes_of, start_of
from ...response.errors import change, step_error, with_errors
from ...response.outcome import changing_note, settle
from ...response.run_events import events_of, with_own
from ..fields import element_fields, point_fields
from ..result import FRAMES, Result, creeping, frames_of, unripe, warming, without_errors
from . import march as rig


def coupled(what, patch, coarse, seconds, warnings, say, progress, per_point, estimate) -> Result:
    """Run a plan of kind rig or linear; arguments as `simulate.run` has them, patch and coarse of its [contact]."""

    scene = viewed(what.scene)
    settings, drive, modes = choose(scene, per_point), drive_of(scene), modes_of(scene)
    warnings = [*warnings, *notes_of(scene)]
    if start_of(scene, modes) is None:
        refuse_rest(scene, modes)
    extra = {"engine": settings.engine, "cycles": settings.cycles, "window": settings.window}
    lumps = scene.friction is not None and not has(scene.friction.law, "averaged")
    moves = acts(scene) or yaws(scene)
    if patch is not None and lumps and not scene.contact.gives_way and not settings.per_point and not moves:
        warnings = [*warnings, "nothing spatial acts on the motion: with a rigid slide, constant load and the pressure "
                    "on the upper piece the patch moves exactly as one point under the same load; add [contact.shear]"]
    if settings.engine == "exact":
        from .exact import run_exact

        load = patch.pressure.load if patch is not None else scene.normal.load if scene.normal is not None else 0.0
        share, rough = _shares(scene, patch, coarse[0] if estimate else None)
        start = start_of(scene, modes)
        raw = run_exact(scene, settings, modes, drive, load, start, progress, share, say, patch)
        seconds["march"] = raw.seconds
        errors = [rig.sampled(raw.values)] if yaws(scene) else []
        if yaws(scene) and estimate and coarse[0] is not None:  # the loads of the strips are those of the mesh
            other = run_exact(scene, settings, modes, drive, coarse[0].pressure.load, start, None, 1.0, say, coarse[0])
            errors, seconds["error"] = [*errors, change(raw.values, other.values)], other.seconds
        if rough is not None:
            other = run_exact(scene, settings, modes, drive, coarse[0].pressure.load, None, None, rough)
            errors, seconds["error"] = [change(raw.values, other.values)], other.seconds
        found = with_errors(raw.values, *errors, least=1e-9)
    elif settings.engine == "harmonic":
        from .steady import curve_measures, steady

        load = patch.pressure.load if patch is not None else scene.normal.load if scene.normal is not None else 0.0
        raw, errors, more = steady(scene, settings, modes, drive, patch, load, say)
        seconds["march"] = raw.seconds
        found, extra = with_errors(raw.values, errors) | curve_measures(more), extra | more
        drive = extra.pop("at", drive)
    else:
        refuse_costly(scene, settings, drive)
        raw, settings, found = _marched(scene, settings, modes, drive, patch, coarse, seconds, warnings, say, progress,
                                        estimate)
        extra |= {"steps_per_cycle": settings.steps, "iterations": raw.book["iterations"]}
    if raw.levels:
        from . import levels

        lowest = levels.onset(scene, raw.levels, raw.slips, scene.accuracy.tolerance)
        found, extra = found | levels.measures(raw.levels, lowest), extra | {"levels": raw.levels}
    estimated = estimate and raw.outcome is not Outcome.NOT_CONVERGED
    found = with_own(found, raw.own)
    outcome, found = settle(raw, without_errors(found, estimated), scene, drive)
    if scene.friction is not None:
        extra["events"] = events_of(raw.window, drive, raw.log, raw.held)
    fields = {}
    if patch is not None:
        from ..patch.measures import measures

        found = measures(patch, *coarse) | {k: m for k, m in found.items() if k != "normal_load"}
        fields = _rig_fields(scene, settings, patch, raw, drive)
    extra |= {"book": raw.book, "period": drive.period}
    warnings = [*warnings, *warming(scene, patch, raw.response, raw.book["friction"])]
    if scene.friction is not None and has(scene.friction.law, "creeps"):
        warnings = [*warnings, f"law '{scene.friction.law}' never holds: under a steady half of the limit it creeps at "
                    f"{0.5493 * scene.friction.reference_speed:.3g} m/s"]
    if scene.friction is not None and has(scene.friction.law, "bonds"):
        law = law_of(scene, speed_of(scene, drive))
        warnings = [*warnings, *unripe(law, float(np.abs(raw.window.slide_rate).max())),
                    *creeping(law, outcome, found)]
    warnings = [*warnings, *rig.created_warning(scene, raw.book, settings.cycles)]
    if patch is not None and acts(scene):
        from .varying_load import shear_note

        warnings = [*warnings, *shear_note(scene, raw.model)]
    warnings = [*warnings, *changing_note(outcome, drive), *raw.notes, *([raw.message] if raw.message else [])]
    return Result(what, outcome, found, raw.response, raw.window, patch, fields, seconds, warnings, extra)


def _shares(scene, patch, coarse) -> tuple:
    """Shares of mu N that limit a rigid block, on the mesh of the patch and on the coarser one, None where it is 1."""
    if scene.friction is None or not has(scene.friction.law, "averaged"):
        return 1.0, None
    from ..bench.averaged import limit_share

    return limit_share(scene, patch), None if coarse is None else limit_share(scene, coarse)


def _marched(scene, settings, modes, drive, patch, coarse, seconds, warnings, say, progress, estimate) -> tuple:
    """The march with its error: half and a quarter of the steps, a coarser mesh, fewer shear modes; an automatic step
    is halved until the error of the displacement is met."""

    frames = FRAMES if patch is not None else 0
    go = rig.run_march
    if settings.engine in COMPARED:
        from .comparison import run_comparison as go
    raw = go(scene, settings, modes, drive, patch, frames, say, progress)
    seconds |= {"march": raw.seconds, "reduce": raw.prepare["reduce"], "load": raw.prepare["load"], "error": 0.0}
    if not estimate or raw.outcome is Outcome.NOT_CONVERGED:
        return raw, settings, with_errors(raw.values)
    half, quarter = (go(scene, replace(settings, steps=max(1, settings.steps // k)), modes, drive, patch)
                     for k in (2, 4))
    seconds["error"] += half.seconds + quarter.seconds
    rest = _space_errors(scene, settings, modes, drive, patch, coarse, quarter, seconds)
    tolerance = scene.accuracy.tolerance
    while True:
        step = step_error(raw.values, half.values, quarter.values, settings.steps)
        if set_valued(scene, settings):
            step = _beside(step, raw, lambda n, s=settings: go(scene, replace(s, steps=n), modes, drive, patch),
                           settings.steps)
        found = with_errors(raw.values, step, *rest, least=1e-9)
        main = found["relative_displacement_amplitude"]
        if raw.levels:
            from .levels import with_errors as level_errors

            raw = replace(raw, levels=level_errors(raw.levels, half.levels, quarter.levels, settings.steps))
        met = main.error <= tolerance * abs(main.value) + main.floor
        again = settings.steps * 2
        if met or "steps_per_cycle" in settings.pinned or again > MOST_STEPS or again * settings.cycles > 1e7 \
                or raw.outcome is Outcome.EXCEEDS_TRAVEL:
            return raw, settings, found
        half, quarter, settings = raw, half, replace(settings, steps=again)
        seconds["error"] += raw.seconds
        raw = go(scene, settings, modes, drive, patch, frames, say, progress)
        seconds["march"] = raw.seconds


def _beside(step: dict, raw, run, steps: int) -> dict:
    """Errors of a march of set-valued friction: where in a step a slide reverses is chance, so its error does not fall
    evenly; runs at 15/16, 7/8 and 3/4 of the steps show its size. Three halves of the largest change count."""
    out = dict(step)
    for share in (15 / 16, 7 / 8, 3 / 4):
        for name, gap in change(raw.values, run(max(4, round(share * steps))).values).items():
            out[name] = max(out.get(name, 0.0), 1.5 * gap)
    return out


def _space_errors(scene, settings, modes, drive, patch, coarse, quarter, seconds) -> list:
    """Errors of the mesh and of the shear modes, both at a quarter of the steps."""

    out = []
    few = replace(settings, steps=max(1, settings.steps // 4))
    if coarse[0] is not None and acts(scene):
        rough = rig.run_march(scene, few, modes, drive, coarse[0])
        out.append(change(quarter.values, rough.values))
        seconds["error"] += rough.seconds
    elif coarse[0] is not None and scene.contact.gives_way:
        rough = rig.run_march(scene, few, modes, drive, coarse[0])
        out.append(change(quarter.values, rough.values))
        seconds["error"] += rough.seconds
    shape = getattr(getattr(quarter.model, "reduction", None), "stiffness", None)
    if shape is not None and (acts(scene) or (coarse[0] is not None and has(scene.friction.law, "bonds"))):
        fewer = rig.run_march(scene, replace(few, shear_modes=max(1, shape.size // 2)), modes, drive, patch)
        out.append(change(quarter.values, fewer.values))
        seconds["error"] += fewer.seconds
    return out


def _rig_fields(scene, settings, patch, raw, drive) -> dict:
    """Interface frames of the last cycle."""

    sigma, f = patch.pressure.sigma_n, scene.friction
    if acts(scene):
        from .varying_load import frames_of as wrench_frames

        return wrench_frames(scene, patch, raw)
    if settings.engine == "exact" or not raw.snapshots:
        at = np.linspace(max(0, len(raw.window.time) - 1 - len(raw.window.time) // settings.window),
                         len(raw.window.time) - 1, FRAMES).round().astype(int)
        tau = np.outer(raw.window.force[at] / patch.pressure.load, sigma)
        if f is not None and has(f.law, "averaged"):
            from ..bench.averaged import limit_tractions

            tau = limit_tractions(scene, patch, raw.window.force[at])
        slip = np.repeat(raw.window.slip[at][:, None], sigma.size, axis=1)
        return frames_of(patch, raw.window.time[at], tau, slip, raw.window.slide[at])
    shots = raw.snapshots
    time = np.array([s["time"] for s in shots])
    shear = bool(scene.contact.gives_way)
    if has(f.law, "bonds") and not listed(f) and (shear or settings.per_point):
        law = law_of(scene, speed_of(scene, drive))
        tau, local = point_fields(patch, law, raw.model.reduction, [(s["slide"], s["bonds"]) for s in shots])
    elif shear:
        length = 0.0 if raw.model.reduction is None else law_from(f).element(1.0).length
        states = [(s["slide"], s["stretch"]) for s in shots]
        tau, local = element_fields(patch, raw.model.reduction, states, length)
    else:
        tau = np.array([s["force"] / patch.pressure.load * sigma for s in shots])
        local = np.array([np.full(sigma.size, s["slip"]) for s in shots])
    return frames_of(patch, time, tau, local, np.array([s["slide"] for s in shots]))
