"""Memory of 40 random bolted joints: tilted and crowned blocks, half of them with a tolerance of 1e-4."""

import subprocess
import sys

import numpy as np
import pytest

SEED = 20261201  # of all joints; drawn before any of them was computed
N_JOINTS = 40
MAX_BYTES = 2e9  # default of accuracy.max_memory
MATERIALS = {"steel": (210e9, 0.3), "Ti-8Al-1Mo-1V": (120e9, 0.32), "aluminium": (70e9, 0.33)}


def make_joint(number: int) -> str:
    """Return the scene of a random bolted joint, tilted if `number` is even; every second pair has the tolerance 1e-4."""
    rng = np.random.default_rng([SEED, number])

    def draw(low: float, high: float) -> float:
        """Return a number whose logarithm is uniformly distributed."""
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    material = rng.choice(list(MATERIALS))
    young, poisson = MATERIALS[material]
    length = draw(8e-3, 35e-3)
    height = length * draw(0.2, 0.7)
    width = draw(4e-3, 25e-3)
    load = draw(80.0, 600.0)
    static = rng.uniform(0.2, 0.6)

    # Contact of a given size, from the formulas of Hertz and of a wedge, for half-spaces
    contact_modulus = young / (2 * (1 - poisson**2))
    if number % 2 == 0:
        extent = length * draw(0.05, 0.7)
        shape = f'[contact.tilt]\nangle = "{load / width / (contact_modulus * extent):.5g} rad"'
    else:
        half_width = length * draw(0.05, 0.4)
        radius = half_width**2 * np.pi * contact_modulus / (4 * load / width)
        shape = f'[contact.crown]\nradius = "{radius:.5g} m"'

    # A mode to which the joint contributes up to a quarter of the stiffness, driven near resonance to a part or a multiple
    # of the displacement at which a patch of about this stiffness slips as a whole
    stiffness = young / (2 * (1 + poisson)) * width
    mass = draw(0.5, 5.0)
    frequency = draw(200.0, 1500.0)
    damping = draw(0.005, 0.02)
    omega = 2 * np.pi * frequency
    slide = np.sqrt(draw(0.02, 0.25) * mass * omega**2 / stiffness)
    ratio = rng.uniform(0.9, 1.0)
    amplitude = draw(0.14, 2.5) * static * load / stiffness / slide
    force = amplitude * mass * omega**2 * np.hypot(1 - ratio**2, 2 * damping * ratio)
    level = f'kind = "force"\nforce = "{force:.5g} N"'
    if rng.random() < 0.5:
        level = f'kind = "base"\nacceleration = "{force / mass:.5g} m/s^2"'
    tolerance = 1e-3 if number % 4 < 2 else 1e-4

    return f"""[contact]
length = "{length * 1e3:.5g} mm"
width = "{width * 1e3:.5g} mm"
height = "{height * 1e3:.5g} mm"
load = "{load:.5g} N"
substrate = "{material}"
{shape}
[contact.shear]
[friction]
law = "coulomb"
static = {static:.5g}
[structure]
measured = "stuck"
moving_mass = "{mass:.5g} kg"
[[structure.mode]]
name = "m0"
frequency = "{frequency:.5g} Hz"
damping = {damping:.5g}
slide = {slide:.5g}
base = 1.0
output = 1.0
[drive]
{level}
frequency = "{ratio * frequency:.5g} Hz"
cycles = 400
[accuracy]
tolerance = {tolerance:g}
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", range(N_JOINTS))
def test_always_below_the_memory_limit(number, tmp_path):
    """A run in a process of its own, with its pages and files, needs at most the memory that the scene allows."""
    path = tmp_path / "joint.toml"
    path.write_text(make_joint(number), "utf-8")
    program = "import sys, resource\nfrom patchfem.__main__ import main\n"
    program += "try:\n    main(['run', sys.argv[1], '-o', sys.argv[2]])\n"
    program += "finally:\n    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)\n"
    command = [sys.executable, "-c", program, str(path), str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert 1024 * int(done.stdout.split()[-1]) <= MAX_BYTES
