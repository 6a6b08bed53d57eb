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
    from .contact import *  # noqa: F403
    from .dynamics import *  # noqa: F403
    from .friction import *  # noqa: F403
    from .wear import *  # noqa: F403

HOMES = {  # the module of every closed form
    "contact": "cattaneo_shear cattaneo_stick_half_width combined_modulus hertz_half_width hertz_peak hertz_pressure "
               "kern_fraction layered_compliance punch_contact punch_pressure punch_rotation rounded_corner "
               "rounded_punch_half_width rounded_punch_pressure wedge_linear wedge_loop wedge_opening wedge_skin "
               "westergaard_approach westergaard_full_pressure westergaard_half_width westergaard_pressure "
               "westergaard_stiffness",
    "dynamics": "COULOMB_RESONANCE bounded_input decay decay_half_cycles decay_rest sliding_amplitude "
               "two_stop_amplitude two_stop_relation",
    "friction": "coulomb_loop_area dither_drift growth_factor jenkins_loop report_loop reversal_force "
               "steady_bond_length steady_shear stretch_loop virgin_force weight_across weight_along",
    "wear": "even_wear_pressure worn_crown_half_width worn_pad_fraction worn_volume",
}
__all__ = [*(name for names in HOMES.values() for name in names.split())]


def __getattr__(name: str):
    """A closed form by its name; the module that has it is loaded now, and with it what it takes from SciPy."""
    home = next((home for home, names in HOMES.items() if name in names.split()), None)
    if home is None:
        return modules_of(__name__, __path__)(name)  # noqa: F405
    return getattr(import_module(f"{__name__}.{home}"), name)
