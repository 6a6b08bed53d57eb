"""Exact answers to small problems of contact, friction and vibration: truths for users, studies and tests.

In: sizes in SI units, shapes as each docstring says. Out: closed forms, or one scalar equation solved to round-off.
`contact` has Hertz, punches, waves, wedges and layers; `friction` the bond law of eqs. 2.10 to 2.17 along given
slides; `dynamics` one mode with Coulomb friction; `wear` depths under a steady slip.
Nothing here uses the rest of the package but `later`, so tests may trust it. Read `contact` first.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from ..later import modules_of

if TYPE_CHECKING:
    from .contact import (
        cattaneo_shear,
        cattaneo_stick_half_width,
        combined_modulus,
        hertz_half_width,
        hertz_peak,
        hertz_pressure,
        kern_fraction,
        layered_compliance,
        punch_contact,
        punch_pressure,
        punch_rotation,
        rounded_corner,
        rounded_punch_half_width,
        rounded_punch_pressure,
        wedge_linear,
        wedge_loop,
        wedge_opening,
        wedge_skin,
        westergaard_approach,
        westergaard_full_pressure,
        westergaard_half_width,
        westergaard_pressure,
        westergaard_stiffness,
    )
    from .dynamics import (
        COULOMB_RESONANCE,
        bounded_input,
        decay,
        decay_half_cycles,
        decay_rest,
        sliding_amplitude,
        two_stop_amplitude,
        two_stop_relation,
    )
    from .friction import (
        coulomb_loop_area,
        dither_drift,
        growth_factor,
        jenkins_loop,
        report_loop,
        reversal_force,
        steady_bond_length,
        steady_shear,
        stretch_loop,
        virgin_force,
        weight_across,
        weight_along,
    )
    from .wear import even_wear_pressure, worn_crown_half_width, worn_pad_fraction, worn_volume

__all__ = [
    "COULOMB_RESONANCE",
    "bounded_input",
    "cattaneo_shear",
    "cattaneo_stick_half_width",
    "combined_modulus",
    "coulomb_loop_area",
    "decay",
    "decay_half_cycles",
    "decay_rest",
    "dither_drift",
    "even_wear_pressure",
    "growth_factor",
    "hertz_half_width",
    "hertz_peak",
    "hertz_pressure",
    "jenkins_loop",
    "kern_fraction",
    "layered_compliance",
    "punch_contact",
    "punch_pressure",
    "punch_rotation",
    "report_loop",
    "reversal_force",
    "rounded_corner",
    "rounded_punch_half_width",
    "rounded_punch_pressure",
    "sliding_amplitude",
    "steady_bond_length",
    "steady_shear",
    "stretch_loop",
    "two_stop_amplitude",
    "two_stop_relation",
    "virgin_force",
    "wedge_linear",
    "wedge_loop",
    "wedge_opening",
    "wedge_skin",
    "weight_across",
    "weight_along",
    "westergaard_approach",
    "westergaard_full_pressure",
    "westergaard_half_width",
    "westergaard_pressure",
    "westergaard_stiffness",
    "worn_crown_half_width",
    "worn_pad_fraction",
    "worn_volume",
]


def __getattr__(name: str):
    """A closed form by its name; the module that has it is loaded now, and with it what it takes from SciPy."""
    for home in ("contact", "dynamics", "wear", "friction") if name in __all__ else ():
        found = getattr(import_module(f"{__name__}.{home}"), name, None)
        if found is not None:
            return found
    return modules_of(__name__, __path__)(name)
