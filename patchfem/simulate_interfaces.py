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
        elements += [_element(scene, k, drive, start) for k in range(len(structure.interface))]
    if interlocked:
        elements.append(slots.interlock(0, structure.bonded.stiffness, structure.bonded.wavelength))
    if structure.stiffening is not None:
        elements.append(slots.cubic(len(rows), structure.stiffening.cubic))
        rows.append(modes.output)
    size = modes.mass * simulate_drive.omega_of(drive) * simulate_drive.peak_speed(drive, start)
    beside = alone if alone is not None and alone.limit > 0 else None
    return slots.SlotsModel(beside, tuple(elements), np.array(rows), size)


def _element(scene, number: int, drive, start):
    from . import simulate_slots as slots
    from .simulate_acting import acting
    from .simulate_rig import law_of

    seen = acting(viewed(scene, number))
    f, load = seen.friction, seen.normal.load
    if f.law == "coulomb":
        return slots.coulomb(number, *limits(scene, number, load))
    if f.law == "tanh":
        return slots.rate(number, f.static * load, f.reference_speed)
    if f.law == "elastic-plastic":
        return slots.elastic_plastic(number, f.static * load, f.bond_length)
    if f.law == "nonlocal" and f.reading == "stretch" and f.order == 1:
        return slots.bonds(number, law_of(seen, simulate_drive.peak_speed(drive, start)), load)
    at = scene.where(f"structure.interface.{number}.law")
    raise PatchfemError(f"{at}: '{f.law}' of reading '{f.reading}' and order {f.order:g} beside other interfaces: not "
                        "yet built; use reading = \"stretch\" with order = 1")


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
