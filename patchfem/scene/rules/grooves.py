"""Rules of [contact.grooves] and [normal.grooves]: their slope and their motion."""

from math import pi

from .facts import TableFacts
from .scene_draft import SceneDraft
from .view import TableView


def find_grooves(draft: SceneDraft) -> TableFacts | None:
    """Return the table of the grooves of a scene draft, or None if it has none."""
    for name in ("contact", "normal"):
        if draft.values[name].grooves:
            return TableFacts(draft, f"{name}.grooves", draft.values[name].grooves.table)
    return None


def find_steepest_slope(grooves: TableView) -> float:
    """Return the steepest slope [1] of the flanks of grooves, which are sinusoidal."""
    return 2 * pi / grooves.wavelength * grooves.amplitude


def check_grooves(draft: SceneDraft) -> None:
    """Report grooves of a scene draft that are so steep that the pieces lock on them."""
    grooves = find_grooves(draft)
    static = draft.values.friction.static
    if grooves is None or not draft.values.friction.law:
        return
    slope = find_steepest_slope(grooves)
    if static * slope >= 1:
        max_amplitude = grooves.amplitude / (static * slope)
        grooves.add_mistake(
            "amplitude",
            f"{grooves.amplitude:.6g} m gives flanks of slope {slope:.6g}, on which the pieces lock with static = "
            f"{static:g}: no force can move one piece over the flanks of the other; an amplitude below wavelength/(2 "
            f"pi static) = {max_amplitude:.6g} m is needed, or a smaller `static`",
        )
