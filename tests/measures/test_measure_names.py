"""Floors of the measures of several interfaces."""

import numpy as np
import pytest

from patchfem.core import Measure
from patchfem.measures import AMPLITUDE, find_error_floor, set_final_floors


def test_exact_floors_of_differences_follow_amplitudes():
    """The floor of a drift is relative to the slip of its interface, and that of a phase to its range."""
    found = {
        "slip_amplitude": Measure(1e-5, "m", 1e-9, 1e-10),
        "slip_amplitude_2": Measure(0.0, "m", 0.0, 1e-10),
        AMPLITUDE: Measure(4e-5, "m", 1e-9, 1e-10),
        "loop_area": Measure(1e-3, "J", 0.0),
        "drift_per_cycle": Measure(6e-11, "m", 2.2e-10, 1e-11),
        "drift_per_cycle_2": Measure(0.0, "m", 0.0, 1e-11),
        "slip_start_phase": Measure(1e-4, "rad", 2e-3, 1e-3),
        "stick_fraction": Measure(None, "1", None, 1e-3),
        "equivalent_stiffness": Measure(3e6, "N m-1", 5e3, 1.0),
        "harmonic_force_ratio": Measure(5e6, "N m-1", 0.0, 0.0),
        "energy_balance": Measure(2e-8, "1", 2e-8, 1e-8),
    }
    floors = {name: one.floor for name, one in set_final_floors(found, 1e-3).items()}
    changed = {
        "drift_per_cycle": 1e-8,
        "drift_per_cycle_2": 4e-8,
        "slip_start_phase": np.pi * 1e-3,
        "equivalent_stiffness": 5e3,
        "energy_balance": 1e-3,
    }
    kept = ("slip_amplitude", "slip_amplitude_2", AMPLITUDE, "loop_area", "stick_fraction")
    assert floors == pytest.approx(changed | {name: found[name].floor for name in kept})
    # its own floor where the tolerance is tight
    assert set_final_floors(found, 1e-9)["drift_per_cycle"].floor == 1e-11
    # that of a small friction force follows from the load of its interface
    loads = {"normal_load": 1.0, "normal_load_2": 1e-3}
    assert find_error_floor("friction_force_peak", loads) == 1e-6
    assert find_error_floor("friction_force_peak_2", loads) == pytest.approx(1e-8)
