"""Warnings and notes of a bench or a rig on its friction law.

In: the `LawFacts` of a run. Out: sentences. LAW_WARNINGS and LAW_NOTES are their tables: each entry is a condition on the
facts with its sentence and, if there is one, the remedy with its value.
"""

from collections.abc import Iterator
from itertools import chain
from math import ceil, log2
from typing import NamedTuple

import numpy as np

from ... import friction
from ...core import Outcome
from ...effects import law_has_trait
from ...formatting import format_length, format_quantity
from .patch_rows import Measures
from .result import Settings

# Largest relative difference of the friction works from samples and from energies without a
# warning.
MAX_WORK_CHECK = 1e-3
# Largest ratio of created to exchanged energy without a warning.
MAX_CREATED_ENERGY_FRACTION = 1e-6
# Largest ratio of the slip during the formation of a bond to the bond length without a warning.
MAX_BOND_FORMING_SLIP_RATIO = 0.3
# Smallest excess of the friction force over mu_s N, relative to it, that a note reports.
MIN_REPORTED_FORCE_EXCESS_RATIO = 1e-3
# Largest ratio of the slip in one time step to the slide of the holders in it without a warning of a sudden slip.
MAX_SLIP_PER_SLIDE = 10.0
MAX_PROPOSED_HALVINGS = 8  # Largest number of halvings of the time step that a warning proposes.


class LawFacts(NamedTuple):
    """What a run shows of its friction law.

    - model, patch: Model, and solved Patch or None.
    - measures: measures by name.
    - outcome: how the motion ended; a bounded motion may creep.
    - speed: peak speed [m/s].
    - force_ratio: largest ratio of friction force to mu_s N; None if the load varies.
    - created, exchanged: energy that the law created, and integral of the absolute friction power [J].
    - settings: Settings of the run.
    - time, slide, slip (k,): times [s] of successive time steps, slide and slip [m] of the first interface.
    """

    model: object
    patch: object
    measures: Measures
    outcome: Outcome
    speed: float
    force_ratio: float | None
    created: float
    exchanged: float
    settings: Settings
    time: np.ndarray
    slide: np.ndarray
    slip: np.ndarray


def list_law_warnings(facts: LawFacts) -> list[str]:
    """Return the warnings of a run on its friction law."""
    return list(chain.from_iterable(find(facts) for find in LAW_WARNINGS))


def list_law_notes(facts: LawFacts) -> list[str]:
    """Return the notes of a run on its friction law."""
    return list(chain.from_iterable(find(facts) for find in LAW_NOTES))


def _warn_of_infinite_traction(facts: LawFacts) -> Iterator[str]:
    """Warn of initial bonds whose traction is infinite at first, because the order is negative.

    Bonds that form later carry at most the fraction P(p + 1, R/eps_0) of mu_s N, with or without growth.
    """
    law = find_bonds(facts.model)
    if law is not None and law.order < 0 and law.initial != 0:
        yield (
            "friction.order below 0 with friction.initial_bonds: the traction is infinite at the first instant, so "
            "friction peaks depend on the time step; set initial_bonds = 0"
        )


def _warn_of_slow_forming(facts: LawFacts) -> Iterator[str]:
    """Warn of a law as printed in the 1985 report whose bonds slide far while they form.

    The limit is MAX_BOND_FORMING_SLIP_RATIO of the bond length; beyond it the printed law differs from its own equations.
    """
    law = find_bonds(facts.model)
    if law is None or law.reading != "report":
        return
    ratio = friction.bonds.parameters.growth_path_ratio(law, facts.speed)
    if ratio > MAX_BOND_FORMING_SLIP_RATIO:
        # At this growth path, growth_path_ratio(law, speed) equals MAX_BOND_FORMING_SLIP_RATIO.
        max_growth_path = law.ratio / (
            1 / (MAX_BOND_FORMING_SLIP_RATIO * law.length) - law.rest_growth / facts.speed**2
        )
        yield (
            f"at the peak speed of {facts.speed:.3g} m/s a bond slides by {ratio:.2g} of its length while it forms (limit "
            f"{MAX_BOND_FORMING_SLIP_RATIO:g}), so the law as printed in the report gives less friction than eqs. "
            f'2.18-2.21; set friction.slip_growth = "{0.95e6 * max_growth_path:.2g} um", or friction.reading = "stretch"'
        )


def _warn_of_creep(facts: LawFacts) -> Iterator[str]:
    """Warn of a mean position that moves on in each cycle of a bounded motion (creep under a mean force, as in Dahl's law).

    The drift is a property of the law, not of the joint.
    """
    law = find_bonds(facts.model)
    drift = facts.measures.get("drift_per_cycle")
    is_bounded = facts.outcome in (Outcome.STEADY, Outcome.STUCK)
    if law is None or law.reading != "stretch" or drift is None or drift.error is None:
        return
    if is_bounded and abs(drift.value) > drift.error + 1e-2 * law.length:
        yield (
            f"the mean position creeps by {drift.value / law.length:.2g} bond lengths per cycle, because bonds damaged "
            "in each cycle creep under a force with a nonzero mean"
        )


def _warn_of_created_energy(facts: LawFacts) -> Iterator[str]:
    """Warn if the law as printed in the 1985 report created energy: more than a fraction of the work that was exchanged."""
    friction = facts.model.friction
    if friction is None or friction.reading != "report":
        return
    if facts.created > MAX_CREATED_ENERGY_FRACTION * facts.exchanged:
        percent = 100 * facts.created / facts.exchanged
        yield (
            f"the law as printed in the report created {facts.created:.3g} J, which is {percent:.2g} % of the work "
            'exchanged; with friction.reading = "stretch" no energy is created'
        )


def _warn_of_sudden_slip(facts: LawFacts) -> Iterator[str]:
    """Warn of a contact that jumps within a time step, because its force falls more steeply than pieces and holder relax.

    The slip then exceeds the bond length, while the holders hardly move. Without mass nothing else limits its speed.
    """
    law = find_bonds(facts.model)
    if law is None or not law.has_growth or not facts.model.partial_slip:
        return
    slips = np.abs(np.diff(facts.slip))
    slides = np.abs(np.diff(facts.slide))
    is_sudden = slips > np.maximum(law.length, MAX_SLIP_PER_SLIDE * slides)
    if not is_sudden.any():
        return
    step = int(np.argmax(slips * is_sudden))
    end = format_quantity(float(facts.time[step + 1]), "s", 3)
    slip = format_length(slips[step], 3)
    slide = format_length(slides[step], 3)
    length = format_length(law.length, 3)
    yield (
        f"the contact jumps within a time step: in the one that ends at {end} it slips by {slip}, more than the bond length "
        f"of {length}, while its holders slide by {slide} (limit {MAX_SLIP_PER_SLIDE:g} times this slide), because the "
        "friction force falls more steeply than the pieces and the holder relax; no mass limits the speed of such a slip; "
        "raise friction.bond_length or friction.kinetic, or make the holder stiffer"
    )


def _warn_of_kept_pressure(facts: LawFacts) -> Iterator[str]:
    """Warn that bonds of the printed law keep the pressure at which they formed, on a bench whose load varies."""
    model = facts.model
    if model.rig is None and model.load_varies and model.friction.reading == "report":
        yield (
            "in the law as printed in the report, a bond keeps the pressure at which it formed, "
            "so while the load falls the friction force may exceed mu_s N; set friction.reading "
            '= "stretch" to avoid this'
        )


def _warn_of_work_check(facts: LawFacts) -> Iterator[str]:
    """Warn if the sampled friction work differs from that in the energies.

    The trapezoidal rule for the samples is of second order. A difference below the error of the
    rule may be small by chance, so that the larger of both is used.
    """
    check = facts.measures.get("work_check")
    if check is None or check.value is None or check.value <= MAX_WORK_CHECK:
        return
    ratio = max(check.value, check.error or 0.0) / MAX_WORK_CHECK
    steps = facts.settings.steps_per_cycle
    # One more halving of the time step is proposed, because in a motion with stick the difference
    # of the two works is of second order in the step only on average.
    halvings = 1 + ceil(log2(ratio) / 2)
    if steps and halvings > MAX_PROPOSED_HALVINGS:
        remedy = f"with this method {steps} steps per cycle are too few for this motion"
    elif steps:
        remedy = f"set accuracy.steps_per_cycle = {steps * 2**halvings}"
    else:
        remedy = 'compare with a run with accuracy.method = "march"'
    yield (
        f"work_check is {check.value:.2g} (limit {MAX_WORK_CHECK:g}): the friction work computed from the samples by the "
        f"trapezoidal rule differs from the friction work in the energy balance; {remedy}"
    )


def _note_on_growth(facts: LawFacts) -> Iterator[str]:
    """Note on a bond length that grows during the run.

    In the law as printed in the 1985 report only bonds that form during the motion have the grown length, not the
    initial ones. In the other reading of the law, older bonds pull harder as the length grows, so that friction may
    exceed mu_s N.
    """
    law = find_bonds(facts.model)
    if law is None or not law.has_growth:
        return

    # In the reading of the report, growth changes only the bonds that form later.
    if law.reading == "report":
        if law.initial:
            yield (
                "in the law as printed in the report, the initial bonds keep the bond length eps_0, even though the length "
                "of later bonds grows"
            )
        return

    # In the other reading, bonds of a short length pull harder as the length grows.
    if law.order > 1:
        yield (
            f"with friction.order = {law.order:g} and a growing bond length, friction has no limit: as the bond "
            "length grows, a bond that formed while the length was small pulls harder and breaks later; set "
            "friction.order <= 1 to keep friction near mu_s N"
        )
    if (facts.force_ratio or 0.0) > 1 + MIN_REPORTED_FORCE_EXCESS_RATIO:
        yield (
            f"the friction force reaches {facts.force_ratio:.3g} times mu_s N: the bond length grows during the run, and "
            "bonds that formed while the bond length was small then break later; to keep the friction force at "
            'or below mu_s N, set friction.reading = "report" and friction.order <= 0'
        )


def _note_on_groove_slope(facts: LawFacts) -> Iterator[str]:
    """Note that the slope of grooves is the same for all points of pieces that deform in shear.

    It is taken at the displacement of the holders. The note states how far a point may be from this displacement.
    """
    model = facts.model
    if model.grooves is None or not model.partial_slip:
        return
    patch = facts.patch
    limit = model.friction.static * patch.pressure.sigma_n * patch.pieces.interface.weight
    max_lag = float((patch.slip_compliance @ limit).max())
    yield (
        f"{model.partial_slip} with grooves: the height and the slope of the grooves are taken at the slide of the holders "
        "and are the same for all points; a point at its friction limit slides by up to "
        f"{format_length(max_lag, 3)} less than "
        f"the holders, which is {max_lag / model.grooves.wavelength:.2g} of the wavelength; the normal force at each "
        "point is in proportion to the total load"
    )


def _note_on_rigid_pieces(facts: LawFacts) -> Iterator[str]:
    """Note that the stiffness of the pieces has no effect on a motion that treats them as rigid in shear."""
    model = facts.model
    if facts.patch is not None and model.friction is not None and not model.partial_slip:
        yield (
            "tangential_stiffness is that of the pieces while the whole patch sticks; the motion does not use it, because "
            "pieces are rigid in shear without [contact.shear]"
        )


LAW_WARNINGS = (
    _warn_of_infinite_traction,
    _warn_of_slow_forming,
    _warn_of_creep,
    _warn_of_sudden_slip,
    _warn_of_kept_pressure,
    _warn_of_created_energy,
    _warn_of_work_check,
)
LAW_NOTES = (_note_on_growth, _note_on_groove_slope, _note_on_rigid_pieces)


def find_bonds(model):
    """Return the parameters of a law with bonds; None for other laws."""
    friction = model.friction
    has_bonds = friction is not None and law_has_trait(friction.law, "bonds")
    return model.bonds if has_bonds else None
