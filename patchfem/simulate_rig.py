"""The coupled run of a scene: patch or point, law and modes, by the exact engine or the march, with its errors."""

from dataclasses import dataclass, replace
from math import sqrt
from time import perf_counter

import numpy as np

from . import simulate_drive
from .core import Missing, ModalBasis, Outcome, PatchfemError, Response
from .friction.law import Bonds
from .response.measures import (
    energy_balance,
    harmonic,
    interface_loop,
    ledger_measures,
    run_measures,
    slip_measures,
    step_harmonic,
    window_amplitudes,
    window_ends,
)
from .simulate_acting import acting
from .simulate_interfaces import yaws
from .simulate_methods import COMPARED, engine_of, unique_steps
from .simulate_structure import highest_frequency, mode_stiffness
from .simulate_wrench_scene import acts

MOST_STEPS = 6400  # finest automatic march, steps per cycle
COMPARED_STEPS = 400  # per cycle of a comparison method where the scene does not say
LEAST_KEPT = 100  # samples of a run that has no cycles
LONGEST = 600.0  # seconds that a shared bond list may take before the run is refused


@dataclass(frozen=True, slots=True)
class Settings:
    """Numerical choices of a run; `pinned` names the ones the scene fixed; shear_modes None: by the tolerance."""

    engine: str
    steps: int
    cycles: float
    window: int
    shear_modes: int | None
    per_point: bool
    pinned: frozenset


@dataclass(frozen=True, eq=False, slots=True)
class Raw:
    """One run before its errors are known: values by measure name, histories, amplitudes per window, (steady amplitude,
    error) or (None, None), snapshots; levels: of a run in levels, slips: as `simulate_levels.onset` asks;
    log: events of the exact engine; notes: warnings of the method; held: slip [m] below which a cycle sticks; own: what
    the run itself leaves open of its measures."""

    values: dict
    response: Response
    window: Response
    amplitudes: np.ndarray
    steady: tuple
    outcome: Outcome | None
    snapshots: list
    book: dict
    seconds: float
    model: object = None
    prepare: dict | None = None
    message: str = ""
    levels: tuple = ()
    slips: object = None
    log: object = None
    notes: tuple = ()
    held: float = 0.0
    own: dict | None = None


def modes_of(scene) -> ModalBasis:
    """Modes of [structure]."""
    from .simulate_structure import modes_of

    return modes_of(scene)


def drive_of(scene):
    """The drive of [drive]."""
    return simulate_drive.drive_of(scene, modes_of(scene))


def start_of(scene, modes: ModalBasis):
    """core.Start of a scene that does not begin at rest, else None."""
    from .simulate_structure import start_of

    start, travel = start_of(scene, modes), scene.structure.travel
    if travel is not None and abs(float(modes.output @ start.z)) > travel:
        raise PatchfemError(f"{scene.where('structure.travel')}: the start lies beyond it; raise travel or start "
                            "nearer to the middle")
    return start if start.z.any() or start.v.any() else None


def speed_of(scene, drive) -> float:
    """Size of the speeds to expect [m/s]: sets the default floor of the speed in the growth of bonds."""
    return simulate_drive.peak_speed(drive, start_of(scene, modes_of(scene)))


def law_of(scene, speed: float) -> Bonds:
    """Bond law of [friction]; `speed` [m/s] sets the default floor v_h = 1e-3 of the peak speed."""
    f = acting(scene).friction
    ratio = f.kinetic / f.static if f.static > 0 else 1.0
    return Bonds(f.static, f.bond_length, f.order, f.reading, ratio, f.rest_growth, f.slip_growth,
                 f.rest_speed or max(1e-3 * speed, 1e-12), f.initial_bonds, f.breakaway)


def choose(scene, per_point: bool = False) -> Settings:
    """Engine and numerical settings from the scene; PatchfemError for a method that cannot do it."""
    accuracy, contact = scene.accuracy, scene.contact
    side = "upper"
    if contact is not None:
        from .simulate_plan import shape_side

        side = shape_side(contact)
    drive = drive_of(scene)
    engine = engine_of(scene, drive, side)
    cycles = simulate_drive.cycles_of(scene, drive)
    window = int(max(1, min(10, cycles // 10)))
    if simulate_drive.levelled(scene):
        window = min(window, int(simulate_drive.cycles_per_level(scene)))
    fastest = max(simulate_drive.fastest(drive), highest_frequency(scene) * drive.period)
    if scene.normal is not None and scene.normal.amplitude:
        fastest = max(fastest, scene.normal.frequency * drive.period)
    # errors fall with the square of the step; 400 steps per cycle of the fastest motion give about 1e-3
    steps = accuracy.steps_per_cycle or int(np.clip(
        2 * round(200 * sqrt(1e-3 / accuracy.tolerance) * fastest), 100, MOST_STEPS))
    if accuracy.steps_per_cycle is None and engine == "march":
        steps = max(steps, unique_steps(scene, drive))
    if not simulate_drive.sinusoidal(drive) and accuracy.steps_per_cycle is None:
        steps = max(steps, int(np.ceil(LEAST_KEPT / cycles)))
    pinned = {k for k in ("steps_per_cycle", "tail", "merge", "shear_modes") if getattr(accuracy, k) is not None}
    if engine in COMPARED:
        steps, pinned = accuracy.steps_per_cycle or COMPARED_STEPS, pinned | {"steps_per_cycle"}
    return Settings(engine, steps, cycles, window, accuracy.shear_modes, per_point or side == "lower",
                    frozenset(pinned))


def quadrature_of(scene, settings: Settings, drive):
    """The engines.Choice of a nonlocal law; a stroke is taken as the drive's own amplitude."""
    from .friction.engines import choose as engine_for

    speed = speed_of(scene, drive)
    law, accuracy = law_of(scene, speed), scene.accuracy
    stroke = max(4 * speed / simulate_drive.omega_of(drive) / law.length, 1e-9)
    tail = None if accuracy.tail is None else max(accuracy.tail, 1e-15)
    return engine_for(law, accuracy.tolerance, stroke, settings.steps / 2, accuracy.quadrature, tail, accuracy.merge)


def contact_model(scene, settings: Settings, patch, drive):
    """The ContactModel of a marching scene; patch: the solved Patch or None for [normal]."""
    from . import simulate_march as hub

    scene = acting(scene)
    f, contact = scene.friction, scene.contact
    if f is None:
        return hub.coulomb_model(0.0, 0.0)
    if acts(scene):
        from .simulate_wrench_scene import model_of

        return model_of(scene, modes_of(scene), patch, speed_of(scene, drive), settings.shear_modes)
    load = patch.pressure.load if patch is not None else scene.normal.load
    limit = f.static * load
    shear = contact.gives_way if contact is not None else ""
    if f.law == "convolution":
        from .simulate_convolution import limit_share

        return hub.coulomb_model(*(limit * limit_share(scene, patch),) * 2)
    if f.law in ("coulomb", "elastic-plastic"):
        length = f.bond_length if f.law == "elastic-plastic" else 0.0
        if shear:
            from .contact.slip import jenkins_set

            per_node = patch.pressure.sigma_n * patch.pieces.interface.weight
            if f.law == "coulomb" and f.kinetic < f.static:
                raise PatchfemError(f"{scene.path}: friction.kinetic below static with {shear}: not yet "
                                    "built; the exact set of elements needs static = kinetic")
            found = jenkins_set(patch.giving, f.static * per_node, length)
            return replace(hub.jenkins_model(found.stiffness, found.yield_slide), reduction=found)
        if f.law == "coulomb":
            return hub.coulomb_model(limit, f.kinetic * load)
        return hub.jenkins_model([limit / length], [length])
    if f.law == "tanh":
        return hub.rate_model(limit, f.reference_speed)
    law = law_of(scene, speed_of(scene, drive))
    found = quadrature_of(scene, settings, drive)
    if found.engine == "exponential":
        return hub.place_model(law, limit, found.tail, found.nodes, found.width, found.ripe)
    if found.engine != "recursion":
        from .friction.quadrature import cutoff

        reach = cutoff(law.order, found.tail) if found.tail > 0 else np.inf
        return hub.list_model(law, limit, reach, found.merge)
    if shear:
        from .simulate_patch import shear_of

        reduced = shear_of(patch, law, settings.shear_modes, scene.accuracy.tolerance)
        model = hub.points_model(law, patch.pieces.interface.weight, patch.pressure.sigma_n, reduced)
        return replace(model, reduction=reduced)
    if settings.per_point:
        from .simulate_plan import shape_side

        x, weight, sigma = patch.x, patch.pieces.interface.weight, patch.pressure.sigma_n
        pattern = (x, sigma) if shape_side(contact) == "lower" else None
        return hub.points_model(law, weight, sigma, None, pattern)
    return hub.points_model(law, [1.0], [load])


def sampled(values: dict) -> dict:
    """Errors of measures of strips that are read off 400 samples a cycle, by the trapezoidal rule."""
    loops = ("loop_area", "equivalent_stiffness", "equivalent_damping", "slip_amplitude", "friction_force_peak")
    return {name: 1e-4 * abs(value) if name in loops else 0.005 if name in ("stick_fraction", "slip_start_phase")
            else 1e-9 * abs(value) for name, value in values.items()}


def _ledger(ledger) -> dict:
    """Measures of the ledger but for what is stored, which depends on the instant at which the run ends."""
    return {name: value for name, value in ledger_measures(ledger).items() if name != "energy_stored"}


def run_march(scene, settings: Settings, modes, drive, patch, frames: int = 0, say=None, progress=None) -> Raw:
    """One march at settings.steps per cycle."""
    from . import simulate_events, simulate_levels
    from . import simulate_march as hub
    from .simulate_interfaces import joined, model_of, other_measures
    from .simulate_march import Mark

    travel, marks, start = scene.structure.travel or np.inf, simulate_levels.ends(scene), start_of(scene, modes)
    begin = perf_counter()
    model = model_of(scene, settings, patch, modes, drive, start)
    reduced = perf_counter() - begin
    hub.warm_up(modes, drive, model, say)
    loaded = perf_counter() - begin - reduced
    begin = perf_counter()
    frames = 0 if yaws(scene) else frames  # strips have no common field of shear
    done = hub.march(modes, drive, model, settings.cycles, settings.steps, settings.window, travel, frames, say,
                     progress, start, marks)
    seconds = perf_counter() - begin
    done = joined(done, patch) if yaws(scene) else done
    last = min(settings.window, len(done.amplitudes))
    values = run_measures(done.window, done.amplitudes, done.ledger, drive, last)
    held, rubbing = 0.0, None
    if scene.friction is None:
        values.pop("friction_force_peak")
    else:
        length = model.length or model.limit / max(float(np.sum(model.fields.get("stiffness", [0.0]))), 1e-300)
        held = 1e-3 * length if model.kind else 1e-15 * simulate_drive.peak_speed(drive) * drive.period
        held *= scene.friction.law != "tanh"  # a law of the speed never holds

        def rubbing(part):
            others = {} if yaws(scene) else other_measures(part.window, drive, settings.steps)
            found = _rubbing(scene, settings, modes, drive, patch, part) | others
            rigid = not model.kind and found["slip_amplitude"] < held  # what moves is round-off
            return {name: v for name, v in found.items() if not (rigid and name.startswith("equivalent_"))}

        whole_run = Mark(done.window, done.step_force, done.window_work, done.amplitudes, done.ledger)
        values |= rubbing(whole_run) | _ledger(done.response.extra["ledger"])
    rings, own, stuck = {}, {}, False
    if scene.friction is not None:
        rings, own = simulate_events.rings(done.window, modes, drive, None, held)
        stuck = simulate_events.all_stick(done.window, held) and scene.friction.law != "tanh"
        if stuck and not model.kind:  # what moves in round-off does not slide
            values["stick_fraction"] = 1.0
            for name in ("slip_start_phase", "equivalent_stiffness", "equivalent_damping"):
                values.pop(name, None)
            moving = modes.mass * simulate_drive.peak_speed(drive, start)**2  # its energies are round-off of such a one
            values["energy_balance"] = energy_balance(done.ledger | {"power": done.ledger["power"] + moving})
    values |= rings
    if scene.friction is not None and "normal_load" in done.window.extra:
        load = done.window.extra["normal_load"]
        values |= {"normal_load_least": float(load.min()), "normal_load_peak": float(load.max()),
                   "open_fraction": float(np.mean(load <= 0))}
    levels, slips = (), None
    if marks:
        levels = simulate_levels.rows(scene, done.marks, drive, held, rubbing)

        def slips(number, level):
            other = simulate_levels.drive_with(drive, number + 1, level)
            run = done.marks[number].after.fork(other) if number >= 0 else hub.fresh(
                modes, other, model, settings.steps, travel, start)
            return run.slip_amplitude(round(marks[0]), settings.window) >= held
    outcome = done.outcome or (Outcome.STUCK if stuck else None)
    ends = window_ends(done.amplitudes, done.phasors, settings.window)
    return Raw(values, done.response, done.window, window_amplitudes(done.amplitudes, settings.window),
               simulate_drive.steady_of(drive, *ends), outcome, done.snapshots, done.ledger, seconds, model,
               {"reduce": reduced, "load": loaded}, done.message, levels, slips, held=held, own=own)


def _rubbing(scene, settings: Settings, modes: ModalBasis, drive, patch, part) -> dict:
    """Measures of the interface in a Mark of a march."""
    w, omega = part.window, simulate_drive.omega_of(drive)
    values = slip_measures(w, drive, settings.steps)
    if not simulate_drive.sinusoidal(drive):
        values.pop("slip_start_phase", None)
    values["normal_load"] = patch.pressure.load if patch is not None else scene.normal.load
    weight = np.full(w.time.size, 1.0)
    weight[[0, -1]] = 0.5
    span = w.time[-1] - w.time[0]
    work = part.work  # of all strips; of interfaces only the first, the others have their own
    if len(scene.structure.interface) > 1:
        work = float(part.step_force @ np.diff(w.slide))
    work *= drive.period / span if span > 0 else 0.0
    q = harmonic(w.time, weight, w.slide - w.slide.mean(), omega)
    if simulate_drive.whole(span, drive):
        values |= interface_loop(w.slide, q, step_harmonic(w.time, part.step_force, omega), work,
                                 mode_stiffness(scene))
    return values


def list_cost(scene, settings: Settings, drive) -> tuple:
    """(expected strips, seconds) of a shared list of bonds."""
    found = quadrature_of(scene, settings, drive)
    steps = settings.cycles * settings.steps
    strips = min(found.strips, 2 * steps * max(1.0, found.strips)) if found.tail else min(found.strips, 8 * steps)
    return strips, steps * found.seconds * (strips / found.strips if found.strips else 1.0)


def refuse_costly(scene, settings: Settings, drive, limit: float = LONGEST) -> None:
    """Missing when the shared bond list of a coupled run would take longer than `limit` seconds."""
    f = scene.friction
    if f is None or f.law != "nonlocal" or quadrature_of(scene, settings, drive).engine == "recursion":
        return
    entries, seconds = list_cost(scene, settings, drive)
    if seconds > limit:
        raise Missing(f"{scene.path}: the bond list (about {entries:.0f} entries) would take about {seconds:.0f} s, "
                      f"more than {limit:.0f} s; lower drive.cycles or accuracy.steps_per_cycle, loosen accuracy.tail "
                      "or accuracy.merge, or use reading = \"stretch\" with order = 1")


def created_warning(scene, book: dict, cycles: float) -> list:
    """A sentence for the energy that the printed law made in steps where it gave back more than it had stored."""
    if scene.friction is None or scene.friction.reading != "report":
        return []
    made, work = book.get("created", 0.0), book.get("dissipated", 0.0)
    if made <= 1e-9 * work or made <= 0:
        return []
    return [f"the printed law created {made / cycles:.3g} J per cycle, {100 * made / max(work, 1e-300):.3g} % of what "
            "it dissipated; reading = \"stretch\" creates none"]
