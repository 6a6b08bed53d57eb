"""The page where the stages meet: plan(scene) says what would run, run(plan) runs it."""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from .core import Measure, Outcome
from .simulate_plan import Plan, chosen_mesh, piece_of, plan, refuse_size

__all__ = ["Plan", "Result", "plan", "run"]
FRAMES = 16


@dataclass(frozen=True, eq=False, slots=True)
class Result:
    """Everything a run found. measures: name -> Measure; response: kept histories or None; patch: the solved patch or
    None; fields: (frame, x) arrays by name with `time`; seconds by part; extra: engine, steps, notes for the report."""

    plan: Plan
    outcome: Outcome
    measures: dict
    response: object
    window: object
    patch: object
    fields: dict
    seconds: dict
    warnings: list
    extra: dict


def run(what: Plan, say=None, progress=None, per_point: bool = False, estimate: bool = True,
        fresh: bool = False) -> Result:
    """Run a plan. say: called with one line when the hub compiles; progress: with the done share of the main pass.

    per_point forces the path of every interface point where one lumped point would do; estimate=False skips the
    re-runs and leaves errors None; fresh condenses the pieces anew. NotConverged and Missing as named by the stages.
    """
    begin, scene = perf_counter(), what.scene
    seconds, warnings = {}, list(scene.remarks)
    refuse_size(what)
    patch, coarse = None, (None, None)
    if scene.contact is not None:
        from .simulate_patch import solve_all

        patch, *coarse = solve_all(scene, estimate, fresh)
        seconds["contact"] = perf_counter() - begin
        warnings += [*_strained(scene, patch), *patch.notes]
        if estimate and coarse[0] is None:
            warnings.append(f"no error is estimated on {patch.x.size - 1} elements along the interface; lower "
                            "contact.element_size")
        if patch.pair.coupling > 0.02 and scene.kind != "patch":
            warnings.append("the pieces are unlike: what shear does to the normal closing, and the load to the slide, "
                            f"is left out; it is {patch.pair.coupling:.2g} of what shear does to the slide")
    if patch is not None and patch.pressure.outcome is Outcome.NO_CONTACT and scene.kind != "patch":
        warnings.append("no friction acts and no motion was computed")
        result = _static(what, patch, coarse, seconds, warnings)
    elif scene.normal is not None and scene.normal.load == 0:
        warnings += [Outcome.NO_CONTACT.sentence, "no friction acts and no motion was computed"]
        result = Result(what, Outcome.NO_CONTACT, {"normal_load": Measure(0.0, "N", 0.0)}, None, None, None, {},
                        seconds, warnings, {})
    else:
        result = _KINDS[what.kind](what, patch, coarse, seconds, warnings, say, progress, per_point, estimate)
    seconds["total"] = perf_counter() - begin
    return replace(result, warnings=result.warnings + _loose(result))


def _loose(result: Result) -> list:
    """One warning per measure whose error exceeds tolerance * |value| + floor, all in one line."""
    tolerance = result.plan.scene.accuracy.tolerance
    wide = [name for name, m in result.measures.items()
            if m.error is not None and m.error > tolerance * abs(m.value) + m.floor]
    if not wide:
        return []
    scene, remedies = result.plan.scene, []
    if scene.contact is not None and scene.contact.mesh is not None:
        remedies.append("split the elements of contact.mesh")
    elif scene.contact is not None and chosen_mesh(scene):
        remedies.append("the mesh that the tolerance chose reaches no further, their errors stand")
    elif scene.contact is not None:
        remedies.append("lower contact.element_size")
    remedies += ["raise accuracy.steps_per_cycle"] if result.plan.kind in ("rig", "bench") else []
    return [f"estimated error above the tolerance {tolerance:g} for {', '.join(sorted(wide))}; "
            f"{' or '.join(remedies)}"]


def _strained(scene, patch) -> list:
    """Warnings where the answer leaves small strains, or where bilinear cells lock."""
    out, contact = [], scene.contact
    pieces = [piece_of(contact, side) for side in ("lower", "upper")]
    stuff = [m for _, substrate, coating in pieces for m in (substrate, coating and coating.material) if m]
    deep = patch.pressure.sigma_n.max(initial=0.0) / min(m.young for m in stuff)
    closed = patch.pressure.approach / sum(height for height, _, _ in pieces)
    for share, what in ((deep, "the peak pressure is {:.3g} of the lowest Young's modulus"),
                        (closed, "the approach is {:.3g} of the pieces' height")):
        if share > 0.02:
            out.append(what.format(share) + ", beyond the small strains that are assumed (0.02)")
    stiff = max(m.poisson for m in stuff)
    if contact.plane == "strain" and stiff > 0.47:
        out.append(f"Poisson's ratio {stiff:g} in plane strain: bilinear cells lock towards 0.5; the pressure peak is "
                   "some 2 % too high at 0.45, 7 % at 0.499 and wrong beyond")
    return out


def _overhang(scene, fine) -> list:
    """Warnings of a bench whose slide leaves the patch or whose law has no finite peak."""
    out, travel = [], float(np.abs(fine.slide).max()) / scene.contact.length
    if fine.lateral is not None and (aside := float(np.abs(fine.lateral).max()) / scene.contact.width) > 0.1:
        out.append(f"the slide across is {aside:.2g} of the width; the overhang is not modelled")
    lost = 1 - float(fine.load.min() / fine.load[0]) if fine.load[0] > 0 else 0.0
    if lost > 0.01:
        out.append(f"the upper piece slides off the pressure: {100 * lost:.0f} % of the load is not carried at the end")
    elif travel > 0.1:
        out.append(f"the slide is {travel:.2g} of the patch; the pressure rides on the upper piece and the overhang is "
                   "not modelled")
    return out


def _unripe(law, speed: float) -> list:
    """The warning of a printed law whose bonds break before they are grown."""
    from .friction.law import ripening

    a = ripening(law, speed) if law.reading == "report" else 0.0
    if a <= 0.3:
        return []
    return [f"bonds ripen over {a:.2g} of their length at the peak speed {speed:.3g} m/s (limit 0.3): as printed, "
            "friction then falls below 2.18-2.21; lower friction.slip_growth, or use reading = \"stretch\""]


def _creeping(law, outcome, found) -> list:
    """The warning of a bounded motion whose middle moves on: Dahl's creep, not a property of the joint."""
    drift = found.get("drift_per_cycle")
    if drift is None or drift.error is None or outcome not in (Outcome.STEADY, Outcome.STUCK):
        return []
    if law.breakaway or law.reading != "stretch" or abs(drift.value) <= drift.error + 1e-2 * law.length:
        return []
    return [f"the motion creeps by {drift.value / law.length:.2g} bond lengths a cycle: bonds that are damaged at any "
            "stretch do so under a biased load; friction.breakaway of half the swing of the force over mu N stops it"]


def _static(what, patch, coarse, seconds, warnings, *_) -> Result:
    from .simulate_measures import measures, plane_band, strip_error

    p, extra = patch.pressure, {"residuals": dict(patch.pressure.residuals), "iterations": patch.pressure.iterations}
    if p.outcome is Outcome.NO_CONTACT:
        warnings = [*warnings, Outcome.NO_CONTACT.sentence]
    elif coarse[-1] is not None and what.kind == "patch":
        warnings = [*warnings, *plane_band(what.scene, coarse[0])]
    found = measures(patch, *coarse)
    if patch.strips is not None and coarse[0] is not None:
        found = strip_error(what.scene, coarse[0], found)
    return Result(what, p.outcome, found, None, None, patch, _still(patch), seconds, warnings, extra)


def _still(patch) -> dict:
    """Fields of the pressed patch before any motion."""
    return {"time": np.zeros(1), "normal_stress": patch.pressure.sigma_n[None], "gap": patch.pressure.gap[None],
            "status": patch.active.astype(np.int8)[None]}


def _fields(patch, time, tau, local, slide) -> dict:
    """Frames of the interface: the pressed state first, then the given ones; status 0 open, 1 stick, 2 slip.

    slide (f,): motion of the upper holder [m] in the given frames.
    """
    still = _still(patch)
    count = len(time) + 1
    tau = np.concatenate([np.zeros((1, tau.shape[1])), tau])
    slip = np.concatenate([np.zeros((1, tau.shape[1])), local])
    moved = np.abs(np.diff(slip, axis=0, prepend=slip[:1]))
    moved[:2] = 0.0  # the first moving frame has no frame before it to slip from
    status = np.where(patch.active, np.where(moved > 1e-2 * max(moved.max(), 1e-300), 2, 1), 0).astype(np.int8)
    return {"time": np.concatenate([[0.0], time]), "normal_stress": np.repeat(still["normal_stress"], count, axis=0),
            "gap": np.repeat(still["gap"], count, axis=0), "shear_stress": tau, "slip": slip, "status": status,
            "holder_slide": np.concatenate([[0.0], slide])}


def _bench(what, patch, coarse, seconds, warnings, say, progress, per_point, estimate) -> Result:
    from . import simulate_bench as bench
    from .response.errors import change, step_error, with_errors
    from .simulate_slide import peak_speed, steps_of

    scene = what.scene
    if scene.friction.law == "nonlocal" and scene.friction.order < 0 and scene.friction.initial_bonds > 0:
        warnings = [*warnings, "friction.order below 0 with friction.initial_bonds: the traction is infinite at the "
                    "first instant, so friction peaks depend on the step; set initial_bonds = 0"]
    if scene.friction.law == "nonlocal":
        warnings = [*warnings, *_unripe(bench.bonds_of(scene), peak_speed(scene))]
        if scene.friction.reading == "report" and bench.varies(scene):
            warnings = [*warnings, "as printed a bond keeps the pressure it formed under: while the load falls the "
                        "friction may exceed mu_s N; reading = \"stretch\" keeps to it"]
    steps = steps_of(scene)
    frames = FRAMES if patch is not None else 0
    fine = bench.run(scene, patch, steps, frames, say)
    seconds["bench"] = fine.seconds
    others = []
    if estimate:
        half, quarter = (bench.run(scene, patch, max(4, steps // (4 * k) * 4), 0, say) for k in (2, 4))
        seconds["error"] = half.seconds + quarter.seconds
        first_order = bench.varies(scene)  # twice the change, as of few steps
        others.append(step_error(fine.values, half.values, quarter.values, min(steps, 399) if first_order else steps))
        if coarse[0] is not None:
            rough = bench.run(scene, coarse[0], max(4, steps // 16 * 4), 0, say)
            others.append(change(quarter.values, rough.values))
            seconds["error"] += rough.seconds
    found = with_errors(fine.values, *others, least=1e-10)
    fields, created, power = {}, fine.values["energy_created"], np.abs(np.diff(fine.ledger[0])).sum()
    if created > 1e-6 * power:
        warnings = [*warnings, f"the law as printed created {created:.3g} J, {100 * created / power:.2g} % of the work "
                    "that went to and fro: reading = \"stretch\" creates none"]
    warnings = [*warnings, *_warming(scene, patch, fine)]
    if patch is not None:
        from .simulate_measures import measures

        found = measures(patch, *coarse) | {k: m for k, m in found.items() if k != "normal_load"}
        warnings = warnings + _overhang(scene, fine)
        fields = _fields(patch, fine.time[fine.frames], fine.tau, fine.local, fine.slide[fine.frames])
    return Result(what, Outcome.DONE, _without_errors(found, estimate), fine, fine, patch, fields, seconds, warnings,
                  {"engine": "bench", "steps": steps})


def _warming(scene, patch, response, work: float | None = None) -> list:
    """The line on the rise of the surface temperature, where the scene has one."""
    if scene.friction is None or scene.friction.temperature is None:
        return []
    from .simulate_heat import heating

    if work is None:
        work = float(np.trapezoid(response.force, response.slide))
        if response.lateral is not None:
            work += float(np.trapezoid(response.lateral_force, response.lateral))
    return heating(scene, patch, work, float(response.time[-1]))


def _without_errors(found: dict, estimate: bool) -> dict:
    return found if estimate else {k: Measure(m.value, m.unit, None, m.floor) for k, m in found.items()}


def _rig(what, patch, coarse, seconds, warnings, say, progress, per_point, estimate) -> Result:
    from . import simulate_rig as rig
    from .response.errors import change, with_errors

    scene = what.scene
    settings, drive, modes = rig.choose(scene, per_point), rig.drive_of(scene), rig.modes_of(scene)
    extra = {"engine": settings.engine, "cycles": settings.cycles, "window": settings.window}
    lumps = scene.friction is not None and scene.friction.law != "convolution"
    if patch is not None and lumps and not scene.contact.gives_way and not settings.per_point and not rig.acts(scene):
        warnings = [*warnings, "nothing spatial acts on the motion: with a rigid slide, constant load and the pressure "
                    "on the upper piece the patch moves exactly as one point under the same load; add [contact.shear]"]
    if settings.engine == "exact":
        load = patch.pressure.load if patch is not None else scene.normal.load if scene.normal is not None else 0.0
        share, rough = _shares(scene, patch, coarse[0] if estimate else None)
        raw = rig.run_exact(scene, settings, modes, drive, load, progress, share)
        seconds["march"] = raw.seconds
        errors = []
        if rough is not None:
            other = rig.run_exact(scene, settings, modes, drive, coarse[0].pressure.load, None, rough)
            errors, seconds["error"] = [change(raw.values, other.values)], other.seconds
        found = with_errors(raw.values, *errors, least=1e-9)
    else:
        rig.refuse_costly(scene, settings, drive)
        raw, settings, found = _marched(scene, settings, modes, drive, patch, coarse, seconds, warnings, say, progress,
                                        estimate)
        extra |= {"steps_per_cycle": settings.steps, "iterations": raw.book["iterations"]}
    estimated = estimate and raw.outcome is not Outcome.NOT_CONVERGED
    outcome, found = rig.settle(raw, _without_errors(found, estimated), scene.accuracy.tolerance)
    fields = {}
    if patch is not None:
        from .simulate_measures import measures

        found = measures(patch, *coarse) | {k: m for k, m in found.items() if k != "normal_load"}
        fields = _rig_fields(scene, settings, patch, raw, drive)
    extra["book"] = raw.book
    warnings = [*warnings, *_warming(scene, patch, raw.response, raw.book["friction"])]
    if scene.friction is not None and scene.friction.law == "tanh":
        warnings = [*warnings, "law 'tanh' never holds: under a steady half of the limit it creeps at "
                    f"{0.5493 * scene.friction.reference_speed:.3g} m/s"]
    if scene.friction is not None and scene.friction.law == "nonlocal":
        law = rig.law_of(scene, rig.speed_of(scene, drive))
        warnings = [*warnings, *_unripe(law, float(np.abs(raw.window.slide_rate).max())),
                    *_creeping(law, outcome, found)]
    warnings = [*warnings, *rig.created_warning(scene, raw.book, settings.cycles)]
    warnings = [*warnings, raw.message] if raw.message else warnings
    return Result(what, outcome, found, raw.response, raw.window, patch, fields, seconds, warnings, extra)


def _shares(scene, patch, coarse) -> tuple:
    """Shares of mu N that limit a rigid block, on the mesh of the patch and on the coarser one, None where it is 1."""
    if scene.friction is None or scene.friction.law != "convolution":
        return 1.0, None
    from .simulate_convolution import limit_share

    return limit_share(scene, patch), None if coarse is None else limit_share(scene, coarse)


def _marched(scene, settings, modes, drive, patch, coarse, seconds, warnings, say, progress, estimate) -> tuple:
    """The march with its error: half and a quarter of the steps, a coarser mesh, fewer shear modes; an automatic step
    is halved until the error of the displacement is met."""
    from . import simulate_rig as rig
    from .response.errors import step_error, with_errors

    frames = FRAMES if patch is not None else 0
    raw = rig.run_march(scene, settings, modes, drive, patch, frames, say, progress)
    seconds |= {"march": raw.seconds, "reduce": raw.prepare["reduce"], "load": raw.prepare["load"], "error": 0.0}
    if not estimate or raw.outcome is Outcome.NOT_CONVERGED:
        return raw, settings, with_errors(raw.values)
    half, quarter = (rig.run_march(scene, replace(settings, steps=max(1, settings.steps // k)), modes, drive, patch)
                     for k in (2, 4))
    seconds["error"] += half.seconds + quarter.seconds
    rest = _space_errors(scene, settings, modes, drive, patch, coarse, quarter, seconds)
    tolerance = scene.accuracy.tolerance
    while True:
        step = step_error(raw.values, half.values, quarter.values, settings.steps)
        found = with_errors(raw.values, step, *rest, least=1e-9)
        main = found["relative_displacement_amplitude"]
        met = main.error <= tolerance * abs(main.value) + main.floor
        again = settings.steps * 2
        if met or "steps_per_cycle" in settings.pinned or again > rig.MOST_STEPS or again * settings.cycles > 1e7 \
                or raw.outcome is Outcome.EXCEEDS_TRAVEL:
            return raw, settings, found
        half, quarter, settings = raw, half, replace(settings, steps=again)
        seconds["error"] += raw.seconds
        raw = rig.run_march(scene, settings, modes, drive, patch, frames, say, progress)
        seconds["march"] = raw.seconds


def _space_errors(scene, settings, modes, drive, patch, coarse, quarter, seconds) -> list:
    """Errors of the mesh and of the shear modes, both at a quarter of the steps."""
    from . import simulate_rig as rig
    from .response.errors import change

    out = []
    few = replace(settings, steps=max(1, settings.steps // 4))
    if coarse[0] is not None and rig.acts(scene):
        rough = rig.run_march(scene, few, modes, drive, coarse[0])
        out.append(change(quarter.values, rough.values))
        seconds["error"] += rough.seconds
    elif coarse[0] is not None and scene.contact.gives_way:
        rough = rig.run_march(scene, few, modes, drive, coarse[0])
        out.append(change(quarter.values, rough.values))
        seconds["error"] += rough.seconds
        if scene.friction.law == "nonlocal":
            kept = quarter.model.reduction.stiffness.size
            fewer = rig.run_march(scene, replace(few, shear_modes=max(1, kept // 2)), modes, drive, patch)
            out.append(change(quarter.values, fewer.values))
            seconds["error"] += fewer.seconds
    return out


def _rig_fields(scene, settings, patch, raw, drive) -> dict:
    """Interface frames of the last cycle."""
    from . import simulate_bench as bench
    from . import simulate_rig as rig

    sigma, f = patch.pressure.sigma_n, scene.friction
    if rig.acts(scene):
        from .simulate_wrench_scene import frames_of

        return frames_of(scene, patch, raw)
    if settings.engine == "exact" or not raw.snapshots:
        at = np.linspace(max(0, len(raw.window.time) - 1 - len(raw.window.time) // settings.window),
                         len(raw.window.time) - 1, FRAMES).round().astype(int)
        tau = np.outer(raw.window.force[at] / patch.pressure.load, sigma)
        if f is not None and f.law == "convolution":
            from .simulate_convolution import limit_tractions

            tau = limit_tractions(scene, patch, raw.window.force[at])
        slip = np.repeat(raw.window.slip[at][:, None], sigma.size, axis=1)
        return _fields(patch, raw.window.time[at], tau, slip, raw.window.slide[at])
    shots = raw.snapshots
    time = np.array([s["time"] for s in shots])
    shear = bool(scene.contact.gives_way)
    if f.law == "nonlocal" and f.reading == "stretch" and f.order == 1 and (shear or settings.per_point):
        law = rig.law_of(scene, rig.speed_of(scene, drive))
        tau, local = bench.point_fields(patch, law, raw.model.reduction, [(s["slide"], s["bonds"]) for s in shots])
    elif shear:
        length = f.bond_length if f.law == "elastic-plastic" else 0.0
        states = [(s["slide"], s["stretch"]) for s in shots]
        tau, local = bench.element_fields(patch, raw.model.reduction, states, length)
    else:
        tau = np.array([s["force"] / patch.pressure.load * sigma for s in shots])
        local = np.array([np.full(sigma.size, s["slip"]) for s in shots])
    return _fields(patch, time, tau, local, np.array([s["slide"] for s in shots]))


_KINDS = {"patch": _static, "bench": _bench, "rig": _rig, "linear": _rig}
