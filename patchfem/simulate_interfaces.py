"""Several interfaces of one rig: each with its own law and load, and the springs that stand beside them."""

from dataclasses import replace

import numpy as np

from . import simulate_drive
from .core import ModalBasis, PatchfemError
from .scene_tables import Normal

ELEMENTS = ("coulomb", "tanh", "elastic-plastic", "nonlocal")


def viewed(scene, number: int = 0):
    """The scene as one interface sees it: the law and load of [[structure.interface]] `number` as [friction] and
    [normal]; the scene itself where it names none."""
    if scene.structure is None or not scene.structure.interface:
        return scene
    one = scene.structure.interface[number]
    return replace(scene, friction=one, normal=Normal.model_construct(load=one.load, amplitude=None, frequency=None,
                                                                      phase=None, width=None))


def loads_of(scene) -> list:
    """Normal load of every interface of a scene without [contact] [N]."""
    if scene.structure.interface:
        return [one.load for one in scene.structure.interface]
    return [scene.normal.load] if scene.normal is not None else []


def yaws(scene) -> bool:
    """Whether strips slide each by themselves: modes that yaw the patch about its normal, over [contact.strips]."""
    strips = scene.contact is not None and scene.contact.strips is not None
    return strips and scene.friction is not None and any(mode.yaw for mode in scene.structure.mode)


def strip_rows(basis: ModalBasis, offsets) -> np.ndarray:
    """(s, n): slide of strips at offsets y (s,) [m] from the middle, slide - y yaw (yaw > 0 turns +x to +y, so a piece
    at +y goes back); a moment about +z on the upper piece is sum y f of the friction f that resists."""
    yaw = np.zeros(basis.slide.size) if basis.yaw is None else basis.yaw
    return basis.slide - np.outer(offsets, yaw)


def strip_loads(patch) -> np.ndarray:
    """Normal load of every strip of a solved patch (s,) [N]."""
    return patch.strips.force.sum(axis=1)


def limits(scene, number: int, load: float) -> tuple:
    """(static, kinetic) friction force [N] of a Coulomb interface."""
    from .simulate_acting import acting

    f = acting(viewed(scene, number)).friction
    return f.static * load, (f.kinetic if f.kinetic is not None else f.static) * load


def model_of(scene, settings, patch, modes: ModalBasis, drive, start):
    """The model that a march takes: one contact, or slots where interfaces or springs stand beside it."""
    from .simulate_rig import contact_model

    structure, many = scene.structure, len(modes.interfaces) > 1
    interlocked = structure.bonded is not None and structure.bonded.wavelength is not None
    alone = None if many else contact_model(scene, settings, patch, drive)
    if not many and structure.stiffening is None and not interlocked:
        return alone
    from . import simulate_slots as slots

    rows, elements = [*modes.interfaces], []
    if many:
        loads = strip_loads(patch) if patch is not None else loads_of(scene)
        elements += [_element(scene, k, load, drive, start) for k, load in enumerate(loads)]
    if interlocked:
        elements.append(slots.interlock(0, structure.bonded.stiffness, structure.bonded.wavelength))
    if structure.stiffening is not None:
        elements.append(slots.cubic(len(rows), structure.stiffening.cubic))
        rows.append(modes.output)
    size = modes.mass * simulate_drive.omega_of(drive) * simulate_drive.peak_speed(drive, start)
    beside = alone if alone is not None and alone.limit > 0 else None
    return slots.SlotsModel(beside, tuple(elements), np.array(rows), size)


def _element(scene, number: int, load: float, drive, start):
    from . import simulate_slots as slots
    from .simulate_acting import acting
    from .simulate_rig import law_of

    seen = acting(viewed(scene, number))
    f = seen.friction
    if f.law == "coulomb":
        return slots.coulomb(number, *limits(scene, number, load))
    if f.law == "tanh":
        return slots.rate(number, f.static * load, f.reference_speed)
    if f.law == "elastic-plastic":
        return slots.elastic_plastic(number, f.static * load, f.bond_length)
    if f.law == "nonlocal" and f.reading == "stretch" and f.order == 1:
        return slots.bonds(number, law_of(seen, simulate_drive.peak_speed(drive, start)), load)
    at = scene.where(f"structure.interface.{number}.law" if scene.structure.interface else "friction.law")
    raise PatchfemError(f"{at}: '{f.law}' of reading '{f.reading}' and order {f.order:g} beside other interfaces: not "
                        "yet built; use reading = \"stretch\" with order = 1")


def joined(done, patch):
    """A MarchResult of strips as that of the patch."""
    loads, offsets = strip_loads(patch), patch.strips.offsets
    window = as_one(done.window, loads, offsets)
    marks = tuple(replace(mark, window=as_one(mark.window, loads, offsets)) for mark in done.marks)
    marks = tuple(replace(mark, step_force=(mark.window.force[1:] + mark.window.force[:-1]) / 2) for mark in marks)
    return replace(done, response=as_one(done.response, loads, offsets), window=window, marks=marks,
                   step_force=(window.force[1:] + window.force[:-1]) / 2)


def as_one(response, loads, offsets):
    """Histories of strips as those of the patch: slide, speed and slip averaged with the loads, the resultant force;
    `extra` keeps the strips and has yaw_moment (k,) [N m], sum y f of the friction about +z on the upper piece."""
    extra, share = response.extra, np.asarray(loads) / np.sum(loads)
    slides, rates, forces = (extra[name] for name in ("slides", "slide_rates", "forces"))
    slips = extra.get("slips", slides)
    return replace(response, slide=slides @ share, slide_rate=rates @ share, force=forces.sum(axis=1),
                   slip=slips @ share, extra=extra | {"yaw_moment": forces @ np.asarray(offsets)})


def other_windows(window) -> list:
    """The histories of the interfaces after the first as windows of their own."""
    extra = window.extra
    if "slides" not in extra:
        return []
    slips = extra.get("slips", extra["slides"])
    return [replace(window, slide=extra["slides"][:, k], slide_rate=extra["slide_rates"][:, k],
                    force=extra["forces"][:, k], slip=slips[:, k]) for k in range(1, slips.shape[1])]


def other_measures(window, drive, steps: int, log=None) -> dict:
    """Measures of the interfaces after the first, their number behind the name: slip_amplitude_2, stick_fraction_2,
    friction_force_peak_2, loop_area_2 (by the trapezoidal rule, which leaves nothing out where the friction is constant
    in slip). With the log of an exact run the stick fraction is that of its events."""
    from .response.events import stuck_time
    from .response.measures import slip_measures

    out, events = {}, None
    if log is not None and "slides" in window.extra:
        from .simulate_events import of_log

        events = of_log(log)
    for k, one in enumerate(other_windows(window), 2):
        found, length = slip_measures(one, drive, steps), one.time[-1] - one.time[0]
        found.pop("slip_start_phase", None)
        if events is not None:
            held = stuck_time(events, k, one.time[0], one.time[-1], bool(np.ptp(one.slip)))
            found["stick_fraction"] = min(held / length, 1.0)
        found |= {"friction_force_peak": float(np.abs(one.force).max()),
                  "loop_area": float(np.trapezoid(one.force, one.slide)) / max(length / drive.period, 1e-300)}
        out |= {f"{name}_{k}": value for name, value in found.items()}
    return out
