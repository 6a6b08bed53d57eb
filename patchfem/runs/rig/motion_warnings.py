"""Warnings and notes of a run of a rig on its friction law, load and engine.

In: a `postprocessing.CoupledRun`. Out: lists of sentences.
"""

import numpy as np

from ...core import Outcome
from ...effects import law_has_trait
from ...formatting import format_length, format_number
from ...response.outcome import describe_ringing, find_ringing, note_on_changing_drive
from ...response.rows import AMPLITUDE
from ...structure.drive_sizes import find_min_decay_rate
from ..results.interfaces import merge_sentences
from ..results.notes import (
    note_on_groove_slope,
    note_on_growth,
    warn_of_bonds,
    warn_of_created_energy,
    warn_of_work_check,
)
from ..results.travel import warn_of_large_slide
from .engines import ENGINES, find_obstacle_of_map
from .hybrid_laws import list_elements
from .solution import first_interface_load

SAME_FREQUENCY_TOL = 1e-9  # Largest relative difference at which two frequencies count as equal.
SINGLE_POINT_WARNING = (
    "the shape of the patch does not affect the motion: with pieces that are rigid in shear, a constant "
    "load and a pressure that moves with the upper piece, the patch moves exactly as one point under the "
    "same load; add [contact.shear] to let the patch slip part by part"
)


def collect_warnings(run) -> list[str]:
    """Return the warnings of a run on its friction law, load and engine."""
    model = run.model
    patch = run.patch
    solution = run.solution
    measures = run.measures
    book = solution.book
    steps = solution.extra.get("steps_per_cycle")
    if "steps_per_cycle" in ENGINES[run.numerics.engine].summary_numbers:
        steps = run.numerics.steps

    warnings = [
        *model.rig.structure.notes,
        *_warn_of_single_point(model, patch, run.numerics),
    ]
    if run.has_friction:
        speed = float(np.abs(solution.window.slide_rate).max())
        warnings += warn_of_bonds(model, speed, measures, run.outcome)
    warnings += warn_of_created_energy(model, book.get("created", 0.0), book.get("passed", 0.0))

    # The shear modes of a patch replace its nodes if its load varies, or on grooves.
    reduction = getattr(solution.contact, "reduction", None)
    if patch is not None and model.rig.friction.load_varies and reduction is not None:
        n_nodes = solution.contact.sets.x.size
        warnings += note_on_shear_modes(model, reduction.stiffness.size, n_nodes)
    if model.grooves is not None and model.partial_slip:
        warnings += note_on_shear_modes(model, reduction.stiffness.size, reduction.points.size)

    warnings += [
        *warn_of_work_check(measures, steps, solution.extra.get("harmonics")),
        *note_on_changing_drive(run.outcome, run.drive),
        *solution.notes,
    ]

    # A stuck interface dissipates nothing, so that free vibration of the structure may remain.
    if not model.rig.drive.levels.amplitudes:
        tolerance = model.accuracy.tolerance
        rate = find_min_decay_rate(model.rig.modes)
        ringing = find_ringing(solution, measures, (tolerance, rate), run.drive)
        if ringing:
            limits = (tolerance, rate * run.drive.period)
            ratio = ringing / measures[AMPLITUDE].value
            warnings.append(describe_ringing(ratio, limits, run.numerics.cycles))

    # An end at the grooves is reported by a note.
    if solution.message and solution.outcome is not Outcome.LEAVES_GROOVES:
        warnings.append(solution.message)
    warnings += _warn_of_peak_at_sweep_end(run)
    warnings += merge_sentences(
        model,
        run.inputs.faces,
        lambda face: _warn_of_interface_patch(face, solution.response),
    )
    return warnings


def _warn_of_interface_patch(face, response) -> list[str]:
    """Return the warnings on the patch of one interface; `_warn_of_single_point` tells that of [contact]."""
    is_point = face.name and not face.partial_slip
    warnings = [SINGLE_POINT_WARNING] if is_point else []
    return [*warnings, *warn_of_large_slide(face.patch, face.slide(response))]


def _warn_of_peak_at_sweep_end(run) -> list[str]:
    """Return a list with a warning if the largest response is at an end of the sweep."""
    peak = run.measures.get("peak_frequency")
    if peak is None or not peak.value or not run.measures[AMPLITUDE].value > 0:
        return []
    drive = run.model.rig.drive.signal
    ends = {"drive.from": drive.low, "drive.to": drive.high}
    for key, end in ends.items():
        if abs(peak.value - end) <= SAME_FREQUENCY_TOL * end:
            side, move = ("upper", "raise") if end == max(ends.values()) else ("lower", "lower")
            return [
                f"the largest response lies at {key} = {format_number(end, 6)} Hz, the {side} end of the swept "
                f"frequencies, so that it may be no resonance; {move} {key}"
            ]
    return []


def collect_notes(run) -> list[str]:
    """Return the notes of a run on its friction law, engine, fields and end of motion."""
    model = run.model
    solution = run.solution
    rig = run.model.rig

    # An end at the grooves follows from the model; it is no defect of the run.
    end_notes = _note_on_lateral_motion(run)
    if solution.message and solution.outcome is Outcome.LEAVES_GROOVES:
        end_notes.append(solution.message)

    if run.patch is not None and run.patch.strips is not None and model.partial_slip:
        return [
            "strips that slip part by part have no common shear stress, so the fields contain only the pressure",
            *end_notes,
        ]

    notes = [
        *_note_on_bond_growth(model, run.patch, solution),
        *note_on_groove_slope(model, run.patch),
    ]
    f = model.friction
    if ENGINES[run.numerics.engine].finds_periodic_motion:
        notes += _note_on_elements_without_slip(run)
    if solution.levels and rig.drive.levels.onset[0] == "slip" and solution.stick_tolerance > 0:
        notes.append(
            f"onset_level: slip counts only if its amplitude is above {format_length(solution.stick_tolerance)}, "
            "a thousandth of the elastic range of the interface; a part of the interface may slip earlier"
        )
    return [
        *rig.structure.reduction_notes,
        *notes,
        *note_on_creep(f),
        *end_notes,
    ]


def _note_on_lateral_motion(run) -> list[str]:
    """Return a list with a note on the neglected lateral motion of strips that yaw."""
    if not run.model.rig.friction.strips_slide_apart:
        return []
    return [
        "the yaw also moves the ends of the patch across x; this motion and its friction are neglected"
    ]


def note_on_creep(friction) -> list[str]:
    """Return a list with a note on a friction law that never sticks."""
    if friction is None or not law_has_trait(friction.law, "creeps"):
        return []
    return [
        f"law '{friction.law}' never sticks: under a constant force of half the friction limit the interface "
        "creeps at "
        f"{1e3 * 0.5493 * friction.reference_speed:.3g} mm/s"
    ]


def _warn_of_single_point(model, patch, numerics) -> list[str]:
    """Return a list with a warning if a patch moves exactly like a single point."""
    f = model.friction
    can_move = model.rig.friction.load_varies or model.rig.friction.strips_slide_apart
    if (
        patch is None
        or f is None
        or law_has_trait(f.law, "averaged")
        or model.partial_slip
        or numerics.per_point
        or can_move
    ):
        return []
    return [SINGLE_POINT_WARNING]


def _note_on_bond_growth(model, patch, solution) -> list[str]:
    """Return the notes on bonds that grow with contact time."""
    if model.friction is None:
        return []
    limit = model.friction.static * first_interface_load(model, patch)
    peak = None
    if limit > 0 and not model.rig.friction.load_varies:
        peak = float(np.abs(solution.response.force).max()) / limit
    return note_on_growth(model, peak)


def _note_on_elements_without_slip(run) -> list[str]:
    """Return a list with a note on a steady motion in which some elements never slip."""
    is_steady = run.solution.outcome in (Outcome.STEADY, Outcome.STUCK)
    if not (is_steady and run.has_friction) or find_obstacle_of_map("piecewise", run.model):
        return []
    window = run.solution.window
    slides = window.extra.get("slides", window.slide[:, None])
    for (_, yields), slide in zip(list_elements(run.model, run.numerics, run.patch), slides.T):
        largest_yield = float(yields.max(initial=0.0))
        amplitude = float(np.ptp(slide)) / 2
        if largest_yield > amplitude:
            return [
                f"a part of the joint slips only at a slide above {format_length(largest_yield)}, but the slide in this "
                f"motion is {format_length(amplitude)}, so this part never slips and keeps the force that earlier "
                "motion left in it; the steady motion is therefore not unique; for the motion "
                'that is reached from rest set accuracy.method = "auto"'
            ]
    return []


def note_on_shear_modes(model, n_modes: int, n_nodes: int) -> list[str]:
    """Return a list with a note on the shear modes of a patch under varying normal load.

    Parameters
    ----------
    model : Model
        Its `partial_slip` begins the sentence.
    n_modes, n_nodes : int
        Number of shear modes, and number of nodes of the patch.
    """
    return [
        f"{model.partial_slip}: the normal load changes with the motion, so the patch cannot be replaced exactly by a set "
        f"of elements; {n_modes} tangential modes of the {n_nodes} nodes are used instead (key accuracy.shear_modes)"
    ]
