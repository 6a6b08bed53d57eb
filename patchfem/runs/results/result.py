"""The result of a run, with the parts that every kind of run shares."""

from dataclasses import dataclass, replace

import numpy as np

from ...core import Measure, Outcome
from .patch_rows import TABLE as STATIC

FRAMES = 16  # of the interface, in the last cycle


@dataclass(frozen=True, eq=False, slots=True)
class Result:
    """Everything that a run found.

    plan: the Plan that was run; measures: name -> Measure; response: kept histories or None; patch: the solved patch or
    None; fields: (frame, x) arrays by name with `time`; seconds by part; extra: engine, steps, notes for the report.
    """

    plan: object
    outcome: Outcome
    measures: dict
    response: object
    window: object
    patch: object
    fields: dict
    seconds: dict
    warnings: list
    extra: dict

    def __repr__(self) -> str:
        counts = [f"{len(found) or 'no'} {word}{'s' * (len(found) != 1)}" for found, word in
                  ((self.measures, "measure"), (self.warnings, "warning"))]
        return f"Result of {self.plan.model.source.path.name}, {self.outcome}: {self.outcome.sentence}\n" \
               f"  {' and '.join(counts)}, {self.seconds.get('total', 0.0):.2f} s"


def worded(measures: dict, apart: str) -> dict:
    """The measures by name, with their meanings.

    apart: what a number behind a name counts, "interface" or "strip".
    """
    return {name: replace(m, text=meaning(name, apart)) for name, m in measures.items()}


def meaning(name: str, apart: str = "interface") -> str:
    """Meaning of a measure by its name in a summary, in one sentence without a stop.

    slip_amplitude_2 is that of the second interface, or of what `apart` names.
    """
    if name in STATIC:
        return STATIC[name].text
    from ...response.rows import of_first, row_of

    first = of_first(name)
    return row_of(name).text + ("" if first == name else f"; of {apart} {name.removeprefix(first + '_')}")


def still(patch) -> dict:
    """Fields of the pressed patch before any motion: normal_stress [Pa], gap [m] and status, (1, m) each."""
    return {"time": np.zeros(1), "normal_stress": patch.pressure.sigma_n[None], "gap": patch.pressure.gap[None],
            "status": patch.active.astype(np.int8)[None]}


def frames_of(patch, time, tau, local, slide) -> dict:
    """Frames of the interface: the pressed state first, then the given ones; status 0 open, 1 stick, 2 slip.

    slide (f,): motion of the upper holder [m] in the given frames.
    """
    first = still(patch)
    count = len(time) + 1
    tau = np.concatenate([np.zeros((1, tau.shape[1])), tau])
    slip = np.concatenate([np.zeros((1, tau.shape[1])), local])
    moved = np.abs(np.diff(slip, axis=0, prepend=slip[:1]))
    moved[:2] = 0.0  # the first moving frame has no frame before it to slip from
    status = np.where(patch.active, np.where(moved > 1e-2 * max(moved.max(), 1e-300), 2, 1), 0).astype(np.int8)
    return {"time": np.concatenate([[0.0], time]), "normal_stress": np.repeat(first["normal_stress"], count, axis=0),
            "gap": np.repeat(first["gap"], count, axis=0), "shear_stress": tau, "slip": slip, "status": status,
            "holder_slide": np.concatenate([[0.0], slide])}


def warming(model, patch, response, work: float | None = None) -> list:
    """The line on the rise of the surface temperature as a list, empty where the scene names no temperature.

    work [J]: of friction over the run, None: by the trapezoidal rule on the response.
    """
    if model.heat is None:
        return []
    from .heat import heating

    if work is None:
        work = float(np.trapezoid(response.force, response.slide))
        if response.lateral is not None:
            work += float(np.trapezoid(response.lateral_force, response.lateral))
    return heating(model, patch, work, float(response.time[-1]))


def without_errors(found: dict, estimate: bool) -> dict:
    """The measures as they are, or without their errors where none were estimated."""
    return found if estimate else {k: Measure(m.value, m.unit, None, m.floor) for k, m in found.items()}


def unripe(law, speed: float) -> list:
    """Warning that a printed law's bonds break before they are grown, as a list of sentences."""
    from ...friction.bonds.parameters import ripening

    a = ripening(law, speed) if law.reading == "report" else 0.0
    if a <= 0.3:
        return []
    return [f"bonds ripen over {a:.2g} of their length at the peak speed {speed:.3g} m/s (limit 0.3), so friction as "
            "printed falls below 2.18-2.21; lower friction.slip_growth, or use reading = \"stretch\""]


def creeping(law, outcome, found) -> list:
    """Warning of a bounded motion whose middle moves on, as a list: Dahl's creep, not a property of the joint."""
    drift = found.get("drift_per_cycle")
    if drift is None or drift.error is None or outcome not in (Outcome.STEADY, Outcome.STUCK):
        return []
    if law.breakaway or law.reading != "stretch" or abs(drift.value) <= drift.error + 1e-2 * law.length:
        return []
    return [f"the motion creeps by {drift.value / law.length:.2g} bond lengths a cycle: bonds that are damaged at any "
            "stretch do so under a biased load; friction.breakaway of half the swing of the force over mu N stops it"]
