"""A coupled run from its plan to its result: engine, errors by coarser runs, levels, frames of the interface."""

from dataclasses import replace
from math import ceil

import numpy as np

from ...core import Outcome, PatchfemError
from ...core import say as length
from ...effects import has, listed
from ...friction.record import law_from
from ...response import reasons
from ...response.coarser import estimate, left_open
from ...response.errors import with_errors
from ...response.outcome import changing_note, settle
from ...response.rows import judged
from ...response.run_events import events_of, with_own
from ...response.settling import slip_period
from ...structure.drive_sizes import sinusoidal, slowest
from ..bench.averaged import limit_tractions
from ..effort import MOST_STEPS, refuse_endless
from ..results.notes import climbing_as_one, creeping, of_growth, two_books, unbounded, unripe, warming
from ..results.result import FRAMES, Result, frames_of, on_a_mesh_of_known_error, still, without_errors
from ..results.travel import ended, travelled
from . import levels
from .engines import ENGINES, Variant, dearer_pieces, no_pieces, unbalanced
from .numerics import choose, crowded, quadrature_of, refuse_costly
from .solution import borne, curve_measures
from .start_ring import StartRing, start_ring

ENDED = (Outcome.EXCEEDS_TRAVEL, Outcome.LEAVES_GROOVES)  # of a run before its time
FINEST = 1e-12  # error of a step below which round-off rules


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
    if numerics.engine == "march":
        refuse_costly(model, numerics)
    if numerics.engine == "exact":
        refuse_endless(model)
    raw, numerics, found = _solved(model, numerics, patch, coarse[0], seconds, say, progress, estimate)
    extra |= raw.extra | {"window": numerics.window}
    wrong = unbalanced(ENGINES[numerics.engine], found)
    if wrong:
        raw = replace(raw, outcome=Outcome.NOT_CONVERGED, message=raw.message or wrong)
    drive = extra.pop("at", drive)
    if numerics.engine == "smooth":
        extra |= {"iterations": raw.book["iterations"]}
    elif numerics.engine not in ("exact", "piecewise", "harmonic"):
        extra |= {"steps_per_cycle": numerics.steps, "iterations": raw.book["iterations"]}
    if raw.levels:
        found |= levels.measures(rig, raw.levels, raw.probe, model.accuracy.tolerance, f is not None, raw.coarser)
        extra |= {"levels": levels.shown(rig, raw.levels)}
    estimated = estimate and raw.outcome is not Outcome.NOT_CONVERGED and on_a_mesh_of_known_error(model, patch, coarse)
    found = with_own(found, raw.own)
    outcome, found = settle(raw, without_errors(found, estimated), model.accuracy.tolerance, drive, rig.level_cycles,
                            slowest(rig.modes))
    rings = StartRing(found, {}, [])
    if patch is not None and not raw.levels:
        rings = start_ring(outcome, found, raw.window, drive, numerics.cycles, model.accuracy.tolerance)
    found, extra["still_rings"] = rings.measures, rings.remedies
    if f is not None:
        extra["events"] = events_of(raw.window, drive, raw.log, raw.held)
    fields = {}
    if patch is not None:
        fields = rig_fields(model, numerics, patch, raw)
    found |= reasons.unclosed(found, raw.window, drive) | reasons.without_value(
        found, raw.window, drive, f is not None, rig.beside_first(raw.window.modal))
    told = _told(raw)
    notes = [*_notes(model, numerics, patch, raw), *rings.notes, *told[1]]
    extra |= {"book": raw.book, "period": drive.period, "notes": notes}
    extra |= _behind(model, numerics, raw.contact)
    warnings = [*warnings, *_said(model, patch, raw, outcome, found)]
    warnings = [*warnings, *two_books(found, extra.get("steps_per_cycle"), extra.get("harmonics"))]
    warnings = [*warnings, *changing_note(outcome, drive), *raw.notes, *told[0]]
    if patch is not None:
        warnings = [*warnings, *travelled(patch, raw.response.slide)]
    found = judged(found, model.accuracy.tolerance)
    if numerics.engine == "harmonic" and outcome is Outcome.GROWS:
        found = reasons.unbounded(found)
    return Result(what, ended(outcome, model.patch, patch, raw.response.slide), found, raw.response, raw.window, patch,
                  fields, seconds, warnings, extra)


def _told(raw) -> tuple:
    """(warnings, notes) of how an engine says that its run ended: that of a motion which ends by itself is a note."""
    said = [raw.message] if raw.message else []
    return ([], said) if raw.outcome is Outcome.LEAVES_GROOVES else (said, [])


def _behind(model, numerics, contact) -> dict:
    """How the friction of a march is summed and what stands for the pieces behind it, as far as it has any."""
    out, f = {}, model.friction
    reduced = getattr(contact, "reduction", None)
    if reduced is not None:
        out["elements" if hasattr(reduced, "yield_slide") else "shear_modes"] = int(np.size(reduced.stiffness))
    if f is not None and has(f.law, "bonds") and numerics.engine == "march":
        out["quadrature"] = quadrature_of(model, numerics).engine
    return out


def _notes(model, numerics, patch, raw) -> list:
    """What the law and the engine of a run mean, as far as it has to be said, and what its fields leave out."""
    f, climb = model.friction, [*climbing_as_one(model, patch), *_of_engine(model, numerics, patch, raw)]
    if raw.levels and model.rig.onset[0] == "slip" and raw.held > 0:
        climb = [*climb, f"onset_level: a slip amplitude counts from {length(raw.held)} on, a thousandth of the slide "
                 "over which the interface gives way; below it a part of the interface may slip already"]
    if patch is not None and patch.strips is not None and model.soft:
        return ["strips that slip part by part have no common shear stress: the fields hold the pressure"]
    if f is not None and has(f.law, "creeps"):
        climb = [*climb, f"law '{f.law}' never holds: under a constant force of half its limit it creeps at "
                 f"{1e3 * 0.5493 * f.reference_speed:.3g} mm/s"]
    if f is None or not has(f.law, "bonds"):
        return climb
    limit = f.static * borne(model, patch)
    steady = limit > 0 and not model.rig.load_varies
    return [*of_growth(model.bonds, float(np.abs(raw.response.force).max()) / limit if steady else None), *climb]


def _of_engine(model, numerics, patch, raw) -> list:
    """Notes on elements that a steady motion never moves, and on a mesh whose yields are too many for the exact engine.
    """
    if not len(model.rig.interfaces) or no_pieces(model):
        return []
    if numerics.engine == "march" and model.accuracy.method == "auto" and "steps_per_cycle" not in numerics.pinned:
        pinned = patch is not None and not model.patch.chosen
        return [f"the motion is marched in steps, as {dearer_pieces(model)}; {'on a coarser mesh, or ' * pinned}by "
                "accuracy.method = \"exact\" it is exact"]
    if numerics.engine != "harmonic" or raw.outcome not in (Outcome.STEADY, Outcome.STUCK):
        return []
    from .pieces.run import Interfaces

    slides = raw.window.extra.get("slides", raw.window.slide[:, None])
    for group, slide in zip(Interfaces(model, numerics, patch).groups, slides.T):
        most, half = float(group.yield_slide.max(initial=0.0)), float(np.ptp(slide)) / 2
        if most > half:
            return [f"part of the joint yields only at {length(most)} and never slips in this motion of "
                    f"{length(half)}: it keeps whatever force it was left with, so the steady motion is not unique; "
                    "this one has no mean force, accuracy.method = \"auto\" gives the one that is reached from rest"]
    return []


def _said(model, patch, raw, outcome, found) -> list:
    """Warnings of the law and of the load, in this run."""
    f, out = model.friction, warming(model, patch, raw.response, raw.book["friction"])
    if f is not None:
        out = [*out, *said_of_law(model, outcome, found, float(np.abs(raw.window.slide_rate).max()))]
    out = [*out, *created_warning(model, raw.book, model.rig.cycles)]
    if patch is not None and model.rig.load_varies:
        out = [*out, *shear_note(model, raw.contact)]
    if model.grooves is not None and model.soft:
        out = [*out, *modes_note(model, raw.contact.shear.stiffness.size, raw.contact.shear.points.size)]
    return out


def said_of_law(model, outcome, found, peak: float) -> list:
    """Warnings of the law of a run; found: its measures by name, peak: its largest speed of the slide [m/s]."""
    if not has(model.friction.law, "bonds"):
        return []
    return [*unbounded(model.bonds), *unripe(model.bonds, peak), *creeping(model.bonds, outcome, found)]


def created_warning(model, book: dict, cycles: float) -> list:
    """A sentence for the energy that the printed law made in steps where it gave back more than it had stored."""
    if model.friction is None or model.friction.reading != "report":
        return []
    made, work = book.get("created", 0.0), book.get("dissipated", 0.0)
    if made <= 1e-9 * work or made <= 0:
        return []
    return [f"the printed law created {made / cycles:.3g} J per cycle, {100 * made / max(work, 1e-300):.3g} % of what "
            "it dissipated; reading = \"stretch\" creates none"]


def shear_note(model, contact) -> list:
    """The sentence on the shear modes of a run whose load changes; empty where none stand for the pieces."""
    if contact is None or contact.reduction is None:
        return []
    kept, nodes = contact.reduction.stiffness.size, contact.sets.x.size
    return modes_note(model, kept, nodes)


def modes_note(model, kept: int, nodes: int) -> list:
    """The sentence on the shear modes of points whose normal force changes."""
    return [f"{model.soft}: the load changes with the motion, so no exact set of elements exists; {kept} "
            f"tangential modes of {nodes} nodes stand for what gives way (accuracy.shear_modes)"]


def _solved(model, numerics, patch, coarse, seconds, say, progress, estimated) -> tuple:
    """Solution of the chosen engine, its numerics, and its measures with errors on the engine's ladder of coarser runs.

    Steps that the scene does not pin are halved until the error of the displacement is met.
    """
    engine, frames, made = ENGINES[numerics.engine], FRAMES if patch is not None else 0, {}
    go, size = engine.run, model.rig.displacement
    found = go(model, numerics, patch, frames, say, progress)
    seconds |= {"march": found.seconds} | (found.prepare or {})
    wide = _whole_period(model, numerics, found)
    if wide > numerics.window:
        numerics = replace(numerics, window=wide)
        found = go(model, numerics, patch, frames, say, progress)
    if not estimated or found.outcome is Outcome.NOT_CONVERGED:
        return found, numerics, with_errors(found.values, size=size) | curve_measures(found.extra)

    def solve(variant):
        return go(model, replace(variant.numerics, whole=False), variant.patch)

    meshed = engine.in_space(model, numerics, patch, coarse, found)
    space, spent = estimate(solve, found.values, meshed, made)
    while True:
        rungs = engine.in_time(model, numerics, patch)
        time, more = estimate(solve, found.values, rungs, made)
        spent += more
        measures = with_errors(found.values, *time, *space, least=engine.least, size=size)
        if numerics.pairs and not resolved(measures, model.accuracy.tolerance):
            return _solved(model, numerics.finer(), patch, coarse, seconds, say, progress, estimated)
        if found.levels:
            apart = [one for one in (*rungs, *meshed) if one.runs or found.errors is None]  # else levels have their own
            found = replace(found, levels=levels.with_errors(found.levels, apart, made),
                            coarser=tuple((made[one.runs[0]], one.beside and made[one.beside]) for one in apart
                                          if one.runs and one.runs[0].numerics.choice is None))  # a list has its bound
        if _enough(model, numerics, found, measures) or not time:
            if spent:
                seconds["error"] = spent
            runs = [found.values, *(made[one].values for one in _halved(engine, model, numerics, patch))]
            late = [one for one in (found.extra.get("late"),) if one]
            kinds = [*(one.of for one in (*rungs, *meshed)), *["end"] * len(late)]
            left = left_open(kinds, [*time, *space, *late], runs)
            found = replace(found, extra=found.extra | {"left_open": left})
            return found, numerics, measures | curve_measures(found.extra)
        made[Variant(numerics, patch)] = found
        spent += found.seconds
        numerics = numerics.finer()
        found = go(model, numerics, patch, frames, say, progress)
        seconds["march"] = found.seconds


def _halved(engine, model, numerics, patch) -> tuple:
    """Variants at half and a quarter of the steps of an engine that has steps, as `left_open` compares them."""
    rungs = engine.in_time(model, numerics, patch)
    return rungs[0].runs if rungs and not numerics.local else ()


def resolved(measures, tolerance: float) -> bool:
    """Whether the errors of all Measures by name are within a tolerance of their values, or their floors."""
    return all(one.error <= tolerance * abs(one.value) + one.floor for one in measures.values())


def _whole_period(model, numerics, found) -> int:
    """Cycles of a window that holds a whole stick-slip period, where no sine sets the pace of a run (a belt); 0 where
    the run has none that lasts, or none two windows long."""
    drive = model.rig.drive
    if model.friction is None or not drive.segments or sinusoidal(drive):
        return 0
    cycles = ceil(slip_period(found.response.time, found.response.slide_rate) / drive.period)
    return cycles if 2 * cycles <= numerics.cycles else 0


def _enough(model, numerics, found, measures) -> bool:
    """Whether the error of the displacement is met, or the steps cannot be halved again."""
    main, again = measures["relative_displacement_amplitude"], numerics.steps * 2
    met = main.error <= model.accuracy.tolerance * abs(main.value) + main.floor
    if numerics.local:
        return met or numerics.local < FINEST
    return met or "steps_per_cycle" in numerics.pinned or again > MOST_STEPS or again * numerics.cycles > 1e7 \
        or crowded(model, numerics, found.book) or found.outcome in ENDED


def rig_fields(model, numerics, patch, raw) -> dict:
    """Interface frames of the last cycle."""

    sigma, f = patch.pressure.sigma_n, model.friction
    if model.soft and patch.strips is not None:  # strips have no common field of shear
        return still(patch)
    if model.rig.load_varies:
        from .varying_load import frames_of as varying_frames

        return varying_frames(model, patch, raw)
    if numerics.engine == "exact" or not raw.snapshots:
        at = np.linspace(max(0, len(raw.window.time) - 1 - len(raw.window.time) // numerics.window),
                         len(raw.window.time) - 1, FRAMES).round().astype(int)
        tau = np.outer(raw.window.force[at] / patch.pressure.load, sigma)
        if f is not None and has(f.law, "averaged"):
            tau = limit_tractions(model, patch, raw.window.force[at])
        slip = np.repeat(raw.window.slip[at][:, None], sigma.size, axis=1)
        return frames_of(patch, raw.window.time[at], tau, slip, raw.window.slide[at])
    from ...slip.fields import element_fields, point_fields

    shots = raw.snapshots
    if model.soft and model.grooves is not None:
        from ..bench.shear import climbed_fields

        tau, local = climbed_fields(patch, raw.contact, [(s["slide"], s["nodes"]) for s in shots])
        return frames_of(patch, np.array([s["time"] for s in shots]), tau, local, np.array([s["slide"] for s in shots]))
    time = np.array([s["time"] for s in shots])
    shear = bool(model.soft)
    pointed = shear or (numerics.per_point and model.grooves is None)
    if has(f.law, "bonds") and not listed(f) and pointed:
        tau, local = point_fields(patch, model.bonds, raw.contact.reduction, [(s["slide"], s["bonds"]) for s in shots])
    elif shear:
        length = 0.0 if raw.contact.reduction is None else law_from(f).element(1.0).length
        states = [(s["slide"], s["stretch"]) for s in shots]
        tau, local = element_fields(patch, raw.contact.reduction, states, length)
    else:
        tau = np.array([s["force"] / patch.pressure.load * sigma for s in shots])
        local = np.array([np.full(sigma.size, s["slip"]) for s in shots])
    return frames_of(patch, time, tau, local, np.array([s["slide"] for s in shots]))
