"""Sentences of a run on its law and its heat: how it warms, ripens and creeps."""

from math import ceil, log2

import numpy as np

from ...core import Outcome
from ...formatting import format_length
from ...friction.bonds import parameters, temperature
from ...scene.keys import materials

BOOKS = 1e-3  # relative gap of the two books of energy beyond which a run says so
RIPE = 0.3  # of their length, over which bonds may ripen before a run says so
BOUND = 1e-3  # share of mu_s N that friction may exceed before a run says so
FARTHEST = 8  # halvings of the steps that are named at once where no engine without steps serves
MORE, LEAST = 4, 31  # times the harmonics of a balance, and harmonics, that are proposed
MOST_HARMONICS = 500  # that are proposed at once


def climbing_as_one(model, patch) -> list:
    """The note on pieces that give way over grooves: how far a point is from where its flank is taken."""
    if model.grooves is None or not model.partial_slip:
        return []
    limit = model.friction.static * patch.pressure.sigma_n * patch.pieces.interface.weight
    apart = float((patch.giving @ limit).max())
    return [
        f"{model.partial_slip} with grooves: the height and the slope of the grooves are taken at the slide of the holders "
        "and are the same for all points; a point at its friction limit slides by up to "
        f"{format_length(apart, 3)} less than "
        f"the holders, which is {apart / model.grooves.wavelength:.2g} of the wavelength; the normal force at each "
        "point is in proportion to the total load"
    ]


def warming(model, patch, response, work: float | None = None) -> list:
    """The line on the rise of the surface temperature, where the scene names one."""
    if model.heat is None:
        return []
    if work is None:
        work = float(np.trapezoid(response.force, response.slide))
        if response.lateral is not None:
            work += float(np.trapezoid(response.lateral_force, response.lateral))
    return heating(model, patch, work, float(response.time[-1]))


def unripe(law, speed: float) -> list:
    """Warning that a printed law's bonds break before they are grown, as a list of sentences."""
    a = parameters.growth_path_ratio(law, speed) if law.reading == "report" else 0.0
    if a <= RIPE:
        return []
    # growth_path_ratio(law, speed) = RIPE with it
    least = law.ratio / (1 / (RIPE * law.length) - law.rest_growth / speed**2)
    return [
        f"at the peak speed of {speed:.3g} m/s a bond slides by {a:.2g} of its length while it forms (limit "
        f"{RIPE:g}), so the law as printed in the report gives less friction than eqs. 2.18-2.21; set "
        "friction.slip_growth = "
        f'"{0.95e6 * least:.2g} um", or friction.reading = "stretch"'
    ]


def creeping(law, outcome, found) -> list:
    """Warning of a bounded motion whose middle moves on, as a list: Dahl's creep, not a property of the joint."""
    drift = found.get("drift_per_cycle")
    if drift is None or drift.error is None or outcome not in (Outcome.STEADY, Outcome.STUCK):
        return []
    if law.reading != "stretch" or abs(drift.value) <= drift.error + 1e-2 * law.length:
        return []
    return [
        f"the mean position creeps by {drift.value / law.length:.2g} bond lengths per cycle, because bonds damaged "
        "in each cycle creep under a force with a nonzero mean"
    ]


def unbounded_bonds(law) -> list:
    """Warning, as a list, of initial bonds of negative order: they pull without a bound in the first instant.

    Bonds that form later never do: grown or not, theirs is at most the share P(p + 1, R/eps_0) of mu_s N.
    """
    if law.order >= 0 or law.initial == 0:
        return []
    return [
        "friction.order below 0 with friction.initial_bonds: the traction is infinite at the first instant, so "
        "friction peaks depend on the time step; set initial_bonds = 0"
    ]


def of_growth(law, peak: float | None) -> list:
    """Notes, as a list, on what growing bonds mean.

    peak: largest friction force of the run over mu_s N [1], None where the load changes.
    """
    if not law.grows:
        return []
    if law.reading == "report":
        return (
            []
            if law.initial == 0
            else [
                "in the law as printed in the report, the initial bonds keep the bond length eps_0, even though the length "
                "of later bonds grows"
            ]
        )
    out = []
    if law.order > 1:
        out.append(
            f"with friction.order = {law.order:g} and a growing bond length, friction has no limit: as the bond "
            "length grows, a bond that formed while the length was small pulls harder and breaks later; set "
            "friction.order <= 1 to keep friction near mu_s N"
        )
    if peak is not None and peak > 1 + BOUND:
        out.append(
            f"the friction force reaches {peak:.3g} times mu_s N: the bond length grows during the run, and "
            "bonds that formed while the bond length was small then break later; to keep the friction force at "
            'or below mu_s N, set friction.reading = "report" and friction.order <= 0'
        )
    return out


def work_check_warning(values: dict, steps: int | None, harmonics: int | None = None) -> list:
    """Warning, as a list, of friction work that the samples of a run do not show as its ledger books it.

    values: measures; steps: per cycle, harmonics: of the run, each None of an engine without. The trapezoidal rule is
    of second order; a gap that is smaller than its error can be small by chance.
    """
    found = values.get("work_check")
    if found is None or found.value is None or found.value <= BOOKS:
        return []
    wide = max(found.value, found.error or 0.0) / BOOKS
    # one more: of a motion with stops the gap falls by second order on the whole
    halvings = 1 + ceil(log2(wide) / 2)
    if harmonics:
        remedy = more_harmonics(harmonics)
    elif steps and halvings > FARTHEST:
        remedy = f"with this method {steps} steps per cycle are too few for this motion"
    else:
        remedy = (
            f"set accuracy.steps_per_cycle = {steps * 2**halvings}"
            if steps
            else 'compare with a run with accuracy.method = "march"'
        )
    return [
        f"work_check is {found.value:.2g} (limit {BOOKS:g}): the friction work computed from the samples by the "
        f"trapezoidal rule differs from the friction work in the energy balance; {remedy}"
    ]


def more_harmonics(found: int, sharp: float = 0.0) -> str:
    """The harmonics that make a balance of so many better; few of them say little of how it converges.

    sharp: how many the friction itself asks for.
    """
    return f"set accuracy.harmonics = {max(MORE * found, LEAST, min(ceil(sharp), MOST_HARMONICS))}"


def heating(model, patch, work: float, duration: float) -> list:
    """One line on the rise of the surface temperature; none where nothing is loaded or nothing moves.

    work [J] of the friction over `duration` [s]. All of the heat goes into one half-space of the substrate through the
    loaded area: two alike pieces share it and warm by half as much.
    """
    if patch is None:
        return [
            "the warming by friction is not estimated, because a contact given by [normal] has no area"
        ]
    kind = model.patch.pieces.substrate
    known = materials.THERMAL.get(kind.name) if kind.name in materials.MATERIALS else None
    if known is None:
        return [
            "the warming by friction is not estimated, because the conductivity of contact.substrate is not "
            f"known; choose one of the materials {', '.join(materials.THERMAL)}"
        ]

    area = float(patch.pieces.interface.weight[patch.active].sum())
    if not (area > 0 and duration > 0 and np.isfinite(work)):
        return []
    period = _cycle(model)
    flux, stuff = work / duration / area, (known.conductivity, known.heat_capacity * kind.density)
    rises = [f"{temperature.surface_rise(flux, duration, *stuff):.2g} K after {duration:.3g} s"]
    if period is not None:
        rises.insert(0, f"{temperature.surface_rise(flux, period, *stuff):.2g} K after one cycle")
    return [
        f"friction dissipates {work / duration:.2g} W on {1e6 * area:.3g} mm2; if one half-space took all this "
        f"heat, the surface temperature would rise by {', '.join(rises)}; the run does not include this rise and "
        "keeps friction.temperature.surface as given"
    ]


def _cycle(model) -> float | None:
    """Period of the motion [s], None where it does not repeat."""
    if model.rig is not None:
        return 1 / model.rig.drive.frequency if model.rig.drive.frequency else None
    return model.slide.period
