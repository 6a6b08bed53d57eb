"""Runs of the rig of a scene by a method of the report."""

from patchfem.effects import law_has_trait
from patchfem.friction.record import law_from

from . import point_laws


def laws_of(model, load: float, stick_speed: float = 0.0) -> list:
    """Return a law of `point_laws` for each interface.

    load : normal load [N] of an interface that does not name one.
    stick_speed : speed [m/s] below which Coulomb friction holds an interface.
    """
    laws = []
    for interface in model.rig.friction.interfaces:
        friction = interface.numbers
        bears = load if interface.load is None else interface.load
        if law_has_trait(friction.law, "set-valued"):
            laws.append(point_laws.Coulomb(*interface.friction_limits(bears), stick_speed))
        else:
            laws.append(point_laws.Smooth(law_from(friction, bears).element(bears)))
    return laws or [point_laws.NO_FRICTION] * len(model.rig.modes.interfaces)


def run_rig(model, method, steps_per_cycle: int, load: float = 0.0, **options):
    """Run the rig of a model for its cycles by `method` (a module of this folder), as `steps.Comparison`."""
    rig = model.rig
    duration = rig.drive.cycles * rig.drive.signal.period
    laws = laws_of(model, load)
    return method.run(
        rig.modes, rig.drive.signal, laws, duration, steps_per_cycle, start=rig.start, **options
    )
