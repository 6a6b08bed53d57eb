"""How far friction warms the surface of a run: a diagnostic beside [friction.temperature], without feedback."""

import numpy as np

from ...friction.bonds.temperature import surface_rise
from ...scene.keys.materials import MATERIALS, THERMAL


def heating(model, patch, work: float, duration: float) -> list:
    """One line on the rise of the surface temperature; none where nothing is loaded or nothing moves.

    work [J] of the friction over `duration` [s]. All of the heat goes into one half-space of the substrate through the
    loaded area: two alike pieces share it and warm by half as much.
    """
    if patch is None:
        return ["the warming by friction is not estimated: [normal] has no contact area"]
    kind = model.patch.substrate
    known = THERMAL.get(kind.name) if kind.name in MATERIALS else None
    if known is None:
        return ["the warming by friction is not estimated: the conductivity of contact.substrate is not known; name a "
                f"material of the table ({', '.join(THERMAL)})"]

    area = float(patch.pieces.interface.weight[patch.active].sum())
    if not (area > 0 and duration > 0 and np.isfinite(work)):
        return []
    period = _cycle(model)
    flux, stuff = work / duration / area, (known.conductivity, known.heat_capacity * kind.density)
    rises = [f"{surface_rise(flux, duration, *stuff):.2g} K after {duration:.3g} s"]
    if period is not None:
        rises.insert(0, f"{surface_rise(flux, period, *stuff):.2g} K in a cycle")
    return [f"friction of {work / duration:.2g} W on {1e6 * area:.3g} mm2 warms the face of one half-space that takes "
            f"it all by {', '.join(rises)}; friction.temperature.surface stays as given"]


def _cycle(model) -> float | None:
    """Period of the motion [s], None where it does not repeat."""
    if model.rig is not None:
        return 1 / model.rig.frequency if model.rig.frequency else None
    return model.slide.period
