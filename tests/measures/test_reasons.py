"""Reasons for absent measures, such as a loop that does not close."""

from types import SimpleNamespace

import numpy as np
import pytest

from patchfem import run
from patchfem.core import DriveSegment, Measure, Outcome
from patchfem.measures import STICKS_AT_REVERSAL_REASON, find_invalid
from patchfem.measures.reasons import APERIODIC_REASON, OPEN_LOOP_REASON, OUTPUT_AT_REST_REASON

FREE = SimpleNamespace(segments=(DriveSegment(0.0),), period=0.1)
RELEASED = """[normal]
load = "100 N"
[friction]
law = "elastic-plastic"
static = 0.5
bond_length = "50 um"
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "m0"
frequency = "100 Hz"
damping = 0.01
slide = 1.0
[drive]
kind = "free"
displacement = "{start}"
cycles = {cycles}
"""


def make_window(stored: float, lost: float) -> SimpleNamespace:
    """Return two cycles in which an interface stores and dissipates the given energies [J]."""
    time = np.linspace(0.3, 0.5, 5)
    rise = np.linspace(0, 1, 5)
    ledger = np.stack([(stored + lost) * rise, 7.0 + stored * rise, 2.0 + lost * rise, 0 * rise])
    return SimpleNamespace(span=time[-1] - time[0], extra={"ledger": ledger})


@pytest.mark.parametrize(
    ("stored", "lost", "open_"),
    [
        (3e-6, 2e-6, True),
        (-2e-6, 3e-6, False),
        (-1.9e-10, 0.0, False),
        (-2.1e-10, 0.0, True),
    ],
)  # the floor is 1e-10 J a cycle
def test_exact_loop_area_needs_dissipation_above_storage(stored, lost, open_):
    """A loop that stores more energy than it dissipates is not closed and has no area."""
    area = Measure((stored + lost) / 2, "J", 0.0, 1e-10)
    window = make_window(stored, lost)
    found = find_invalid({"loop_area": area}, (window, FREE, None), Outcome.STEADY, is_rigid=False)
    assert set(found) == ({"loop_area"} if open_ else set())
    if open_:
        one = found["loop_area"]
        assert (one.value, one.error, one.unit, one.floor, one.reason) == (
            None,
            None,
            "J",
            1e-10,
            OPEN_LOOP_REASON,
        )


def test_exact_elastic_interface_has_no_loop():
    """An interface released within its elastic range dissipates nothing; it has no loop area and no drift."""
    found = run(RELEASED.format(start="20 um", cycles=15.3)).measures
    assert found["energy_dissipated"].value == pytest.approx(0.0, abs=1e-15)
    assert found["loop_area"].value is None and found["loop_area"].reason == OPEN_LOOP_REASON
    assert found["drift_per_cycle"].value is None
    assert found["drift_per_cycle"].reason == APERIODIC_REASON


@pytest.mark.parametrize(("force", "there"), [("1e-9 N", False), ("1 N", True)])
def test_exact_output_at_rest_has_no_distortion(force, there):
    """An output at rest has no distortion of its acceleration, and a reason for this."""
    text = (
        RELEASED.partition("[drive]")[0].replace("slide = 1.0", "slide = 1.0\nbase = 0.0")
        + f'[drive]\nkind = "force"\nforce = "{force}"\nfrequency = "80 Hz"\ncycles = 20\n'
    )
    found = run(text).measures
    first, ratio = (
        found[name] for name in ("absolute_acceleration_fundamental", "acceleration_distortion")
    )
    assert (ratio.value is not None) == there == (first.value > first.floor)
    assert ratio.reason == ("" if there else OUTPUT_AT_REST_REASON)


STICK_SLIP = """[normal]
load = "100 N"
[friction]
law = "coulomb"
static = 0.4
kinetic = 0.2
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "m0"
frequency = "50 Hz"
damping = 0.02
slide = 1.0
[drive]
kind = "force"
frequency = "3 Hz"
force = "150 N"
cycles = 12
"""


@pytest.mark.parametrize(("kinetic", "there"), [("0.2", False), ("0.05", True)])
def test_exact_no_secant_if_interface_sticks_at_reversal(kinetic, there):
    """Rigid friction that sticks at a reversal has no secant stiffness; one that slides through has zero."""
    text = STICK_SLIP.replace("kinetic = 0.2", f"kinetic = {kinetic}")
    if there:
        text = (
            text.replace("3 Hz", "50 Hz")
            .replace("static = 0.4", "static = 0.05")
            .replace("= 12", "= 60")
        )
    found = run(text).measures
    secant = found["secant_stiffness"]
    assert (found["stick_fraction"].value == 0) == there == (secant.value is not None)
    assert (
        secant.value == pytest.approx(0.0, abs=1e-3)
        if there
        else secant.reason == STICKS_AT_REVERSAL_REASON
    )
