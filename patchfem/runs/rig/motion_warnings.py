"""Warnings and notes of a run of a rig or a bench on its friction law, load and engine.

In: a `rig.CoupledRun`. Out: sentences. MOTION_WARNINGS and MOTION_NOTES are the tables of conditions of a rig,
SLIDE_WARNINGS that of a bench; each entry yields the sentences of a run that meets its condition. Those on the friction law
are in `results.notes`.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain

import numpy as np

from ... import structure
from ...core import NotConverged, Outcome
from ...effects import law_has_trait
from ...formatting import format_length, format_number, format_quantity
from ...measures.outcome import (
    OPEN_LOOP_MESSAGE,
    describe_ringing,
    find_ringing,
    note_on_changing_drive,
)
from ...measures.rows import AMPLITUDE
from ...model import structure as model_structure
from ...motion_measures import MAX_RESTING_SLIDE_RANGE
from ..bench import bench
from ..interfaces import joints
from ..results.interfaces import PressedFace, merge_sentences, warn_of_large_slide
from ..results.notes import LAW_NOTES, LAW_WARNINGS
from .engines import ENGINES, find_obstacle_of_map

SAME_FREQUENCY_TOL = 1e-9  # largest relative difference at which two frequencies count as equal
# Speed at half the friction limit of a law that creeps, relative to its reference speed: the inverse of tanh at 1/2.
HALF_LIMIT_SPEED_RATIO = np.arctanh(0.5)
SINGLE_POINT_WARNING = (
    "the shape of the patch does not affect the motion: with pieces that are rigid in shear, a constant "
    "load and a pressure that moves with the upper piece, the patch moves exactly as one point under the "
    "same load; add [contact.shear] to let the patch slip part by part"
)
NEGLECTED_YAW_NOTE = (
    "the yaw also moves the ends of the patch across x; this motion and its friction are neglected"
)


def collect_remarks(run) -> tuple[list[str], list[str]]:
    """Return the warnings and the notes of a run on its friction law, load, engine and end of motion.

    Warnings are sentences on numbers that may be wrong, and notes on what the model leaves out or assumes.
    """
    is_bench = run.model.rig is None
    warnings = SLIDE_WARNINGS if is_bench else MOTION_WARNINGS
    notes = LAW_NOTES if is_bench else MOTION_NOTES
    sentences = [
        list(chain.from_iterable(find(run) for find in table)) for table in (warnings, notes)
    ]
    return sentences[0], sentences[1]


def _warn_of_single_points(run) -> list[str]:
    """Return warnings on patches that move exactly like single points, so that their shape has no effect on the motion.

    Their pieces are rigid in shear, their load is constant, and the pressure moves with the upper piece. Without friction
    no shape matters.
    """
    model = run.model
    friction = model.rig.friction
    if friction.load_varies or friction.bands_slide_apart or model.side == "lower":
        return []

    def warn(face: PressedFace) -> list[str]:
        """Return the warning on an interface."""
        law = face.model.friction
        has_friction = law is not None and law.static > 0 and not law_has_trait(law.law, "averaged")
        return [SINGLE_POINT_WARNING] * (has_friction and not face.partial_slip)

    return merge_sentences(model, run.inputs.faces, warn)


def _warn_of_engine(run) -> Iterator[str]:
    """Warn of what the engine reports: an unfinished change of the drive, its own messages, and remaining vibration.

    Free vibration may remain, because a stuck interface dissipates nothing. An end at the grooves is no defect of the run,
    so that it is a note (`_note_on_end`).
    """
    motion = run.solution.run
    rig = run.model.rig
    yield from note_on_changing_drive(run.outcome, run.drive)
    yield from run.solution.steady.notes if run.solution.steady is not None else ()
    if not rig.drive.levels.amplitudes:
        tolerance = run.model.accuracy.tolerance
        rate = structure.drive_sizes.find_min_decay_rate(rig.modes)
        ringing = find_ringing(motion, run.measures, (tolerance, rate), run.drive)
        if ringing:
            limits = (tolerance, rate * run.drive.period)
            ratio = ringing / run.measures[AMPLITUDE].value
            yield describe_ringing(ratio, limits, run.numerics.cycles)
    if motion.message and motion.outcome is not Outcome.LEAVES_GROOVES:
        yield motion.message


def _warn_of_peak(run) -> Iterator[str]:
    """Warn if the largest response of a sweep lies at an end of its range, or if a rigid law holds the output at rest."""
    peak = run.measures.get("peak_frequency")
    friction = run.model.friction
    if peak is None:
        return

    # Without motion there is no peak.
    if run.measures[AMPLITUDE].value <= MAX_RESTING_SLIDE_RANGE:
        if friction is not None and law_has_trait(friction.law, "set-valued"):
            yield (
                f"the interface sticks at all frequencies, and law '{friction.law}' is rigid while it sticks, so that the "
                "output does not move; law 'elastic-plastic' has the stiffness of the contact (Jenkins element: a spring "
                "and a slider)"
            )
        return

    # A peak inside the range is a resonance.
    drive = run.model.rig.drive.signal
    ends = {"drive.from": drive.low, "drive.to": drive.high}
    for key, end in ends.items():
        if peak.value and abs(peak.value - end) <= SAME_FREQUENCY_TOL * end:
            side, move = ("upper", "raise") if end == max(ends.values()) else ("lower", "lower")
            yield (
                f"the largest response lies at {key} = {format_number(end, 6)} Hz, the {side} end of the swept "
                f"frequencies, so that it may be no resonance; {move} {key}"
            )
            return


def _warn_of_sparse_record(run) -> Iterator[str]:
    """Warn if the straight lines between the rows of drive.file lose more than the tolerance."""
    find_line_loss = getattr(run.model.rig.drive.signal, "find_line_loss", None)
    if find_line_loss is None:
        return
    loss = find_line_loss(run.model.rig.modes)
    tolerance = run.model.accuracy.tolerance
    if loss.fraction > tolerance:
        yield (
            f"drive.file has {loss.rows:.3g} rows per cycle of {loss.frequency:.4g} Hz, where it moves the rig most; the "
            f"straight lines between its rows lower a sine of this frequency by {100 * loss.fraction:.2g} %, which the "
            f"errors do not contain; resample it to {np.ceil(np.pi / np.sqrt(3 * tolerance)):.0f} rows per cycle or more"
        )


def _warn_of_large_slides(run) -> list[str]:
    """Warn of interfaces that slide by a large part of their contact, at which the computation keeps the pressure."""
    return merge_sentences(
        run.model,
        run.inputs.faces,
        lambda face: warn_of_large_slide(face.patch, face.slide(run.solution.run.response)),
    )


# ---- benches


def _warn_of_open_loop(run) -> list[str]:
    """Return a list with a warning if the last friction loop of a bench is not closed, nor its area that of a longer run."""
    model = run.model
    fine = run.solution.run.response
    tolerance = model.accuracy.tolerance
    slide = model.slide
    if slide.period is None or slide.cycles < 1 or not fine.values.get("loop_area"):
        return []
    # Relative difference between start and end of the last cycle: the change of the force over its peak, or that of the
    # stored energy over the work.
    force = fine.force[fine.first :]
    work, stored, *_ = fine.ledger[:, fine.first :]
    changes = (force[-1] - force[0], stored[-1] - stored[0])
    sizes = (np.abs(force).max(), work[-1] - work[0])
    gap = max((abs(float(a / b)) for a, b in zip(changes, sizes) if b), default=0.0)
    if gap <= tolerance:
        return []
    text = (
        f"{OPEN_LOOP_MESSAGE}: it misses by {100 * gap:.2g} % (limit {100 * tolerance:g} %), so loop_area, the friction "
        "work of the last cycle, is not the energy dissipated in a steady loop"
    )

    # The comparison must not end a run that is complete.
    # Number of cycles that are added to see whether the last loop of a bench is steady.
    cycles = slide.cycles + 4
    longer_model = replace(model, slide=replace(slide, cycles=cycles))
    try:
        longer = bench.run_bench(longer_model, run.patch, run.numerics.steps)
    except NotConverged:
        return [f"{text}; raise slide.cycles"]

    # The loop is steady if the last two cycles of the longer run do the same work.
    ends = longer.time[-1] - slide.period * np.arange(2, -1, -1)
    before, area = np.diff(np.interp(ends, longer.time, longer.ledger[0])).tolist()
    if abs(area - fine.values["loop_area"]) <= tolerance * abs(area):
        return []
    if abs(area - before) > tolerance * abs(area):
        return [f"{text}; no steady loop is reached within {cycles:g} cycles"]
    return [f"{text}, which is {format_quantity(area, 'J', 4)}; set slide.cycles = {cycles:g}"]


def _warn_of_overhang(run) -> Iterator[str]:
    """Warn if the upper piece of a bench slides off the loaded area."""
    load = run.solution.run.response.load
    load_loss = 1 - float(load.min() / load[0]) if load[0] > 0 else 0.0
    if run.patch is not None and load_loss > 0.01:
        yield (
            "the upper piece slides off the pressed area: at worst the computed contact carries "
            f"{100 * load_loss:.0f} % less than the given load"
        )


# ---- notes on rigs


def _note_on_bands(run) -> Iterator[str]:
    """Note that the bands of a face yaw as wholes."""
    if run.model.rig.friction.bands_slide_apart:
        yield f"the face yaws as {model_structure.N_YAW_BANDS} bands of cells, each with the displacement of its middle"


def _note_on_elements_without_slip(run) -> Iterator[str]:
    """Note that a steady motion is not unique if some elements of the joint never slip in it."""
    is_steady = run.solution.run.outcome in (Outcome.STEADY, Outcome.STUCK) and run.has_friction
    is_found = ENGINES[run.numerics.engine].finds_periodic_motion
    if not (is_steady and is_found) or find_obstacle_of_map("piecewise", run.model):
        return
    slides = run.solution.run.window.slides.T
    parts = joints.list_parts(run.model, run.patch, run.numerics.space.meshed)
    for joint, slide in zip(parts, slides):
        _, yields = joint.list_elements()
        largest_yield = float(yields.max(initial=0.0))
        amplitude = float(np.ptp(slide)) / 2
        if largest_yield > amplitude:
            yield (
                f"a part of the joint slips only at a slide above {format_length(largest_yield)}, but the slide in this "
                f"motion is {format_length(amplitude)}, so this part never slips and keeps the force that earlier "
                "motion left in it; the steady motion is therefore not unique; for the motion "
                'that is reached from rest set accuracy.method = "auto"'
            )
            return


def _note_on_smallest_slip_of_onset(run) -> Iterator[str]:
    """Note the smallest slip that counts as the onset, in a run of drive levels whose interface is elastic in stick."""
    found = run.solution.levels
    is_by_slip = run.model.rig.drive.levels.onset[0] == "slip"
    if found is not None and is_by_slip and found.stick_tolerance > 0:
        yield (
            f"onset_level: slip counts only if its amplitude is above {format_length(found.stick_tolerance)}, "
            "a thousandth of the elastic range of the interface; a part of the interface may slip earlier"
        )


def note_on_creep(friction) -> list[str]:
    """Return a list with a note on a friction law that never sticks."""
    if friction is None or not law_has_trait(friction.law, "creeps"):
        return []
    return [
        f"law '{friction.law}' never sticks: under a constant force of half the friction limit the interface "
        f"creeps at {1e3 * HALF_LIMIT_SPEED_RATIO * friction.reference_speed:.3g} mm/s"
    ]


def _note_on_end(run) -> Iterator[str]:
    """Note on the neglected lateral motion of a face that yaws, and on an end at the grooves, which is no defect."""
    if run.model.rig.friction.bands_slide_apart:
        yield NEGLECTED_YAW_NOTE
    motion = run.solution.run
    if motion.message and motion.outcome is Outcome.LEAVES_GROOVES:
        yield motion.message


SLIDE_WARNINGS = (*LAW_WARNINGS, _warn_of_open_loop, _warn_of_overhang, _warn_of_large_slides)
MOTION_WARNINGS = (
    lambda run: run.model.rig.structure.notes,
    *LAW_WARNINGS,
    _warn_of_single_points,
    _warn_of_engine,
    _warn_of_peak,
    _warn_of_sparse_record,
    _warn_of_large_slides,
)
MOTION_NOTES = (
    lambda run: run.model.rig.structure.reduction_notes,
    *LAW_NOTES,
    _note_on_bands,
    _note_on_elements_without_slip,
    _note_on_smallest_slip_of_onset,
    lambda run: note_on_creep(run.model.friction),
    _note_on_end,
)
