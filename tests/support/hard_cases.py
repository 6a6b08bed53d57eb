"""Hard cases of dry friction as whole scenes: engine, outcome, values with errors and CPU seconds.

    python tests/support/hard_cases.py [NAME ...]

prints a row of the table in tests/README.md for each case. A case ends with an outcome or is refused in a sentence.
"""

import sys
from time import process_time
from typing import NamedTuple

import numpy as np

import patchfem as pf
from patchfem.core import PatchfemError

AMPLITUDE = "relative_displacement_amplitude"
STATIC = 'law = "coulomb"\nstatic = 0.3\n'
WEAKENING = 'law = "coulomb"\nstatic = 0.3\nkinetic = 0.15\n'
MASS_STIFFNESS = (2 * np.pi * 100) ** 2  # N/m of a mass of 1 kg with a frequency of 100 Hz
RESONANT_PUSH = 37.5  # m/s^2; friction of 30 N is .8 of it


class HardCase(NamedTuple):
    """Scene, and what is known of its amplitude [m]; None if nothing is known."""

    text: str
    truth: float | None = None


def make_block(friction, drive, *, damping=0.003, load="100 N", more="") -> str:
    """Return a scene of one mode of 1 kg and 100 Hz; `friction`, `drive` and `more` are lines of TOML."""
    return (
        f'[normal]\nload = "{load}"\n[friction]\n{friction}[structure]\nmoving_mass = "1 kg"\n'
        f'[[structure.mode]]\nname = "axial"\nfrequency = "100 Hz"\ndamping = {damping}\nslide = 1.0\n'
        f"[drive]\n{drive}{more}"
    )


def make_base_drive(acceleration: float, cycles: int, frequency=100.0) -> str:
    """Return the keys of a base drive; acceleration in m/s^2, frequency in Hz."""
    return (
        f'kind = "base"\nfrequency = "{frequency!r} Hz"\nacceleration = "{acceleration!r} m/s^2"\n'
        f"cycles = {cycles}\n"
    )


def make_chain(n_masses: int, interfaces: dict, cycles: int) -> str:
    """Return a scene of equal masses in a row that the base drives; `interfaces` has lines of TOML by number of the mass."""
    masses = ", ".join(n_masses * ['"1 kg"'])
    parts = [f"[structure]\nmasses = [{masses}]\n"]
    for mass in range(1, n_masses + 1):
        ends = f"between = [{mass}, {mass - 1}]\n"
        parts += [
            f'[[structure.spring]]\n{ends}stiffness = "4e7 N/m"\n',
            f'[[structure.damper]]\n{ends}coefficient = "40 N s/m"\n',
        ]
    for mass, lines in interfaces.items():
        parts.append(f"[[structure.interface]]\nbetween = [{mass}, 0]\n{lines}")
    parts.append(
        f'[drive]\nkind = "force"\nmass = {n_masses}\nforce = "300 N"\nfrequency = "60 Hz"\ncycles = {cycles}\n'
    )
    return "".join(parts)


def make_cases() -> dict[str, HardCase]:
    """Return the hard cases by name."""
    first_slip = {  # amplitude of the first slip by 1 - D, with the static friction D of the drive
        part: 4.5 * part**2 * 30 / MASS_STIFFNESS / 2 for part in (1e-4, 1e-7)
    }
    two_stops = 0.28704671337871602595 * RESONANT_PUSH / MASS_STIFFNESS  # 40 digits
    resonance = make_base_drive(RESONANT_PUSH, 200)
    speed = two_stops * 2 * np.pi * 100  # m/s
    grazing = {
        f"grazing onset, drive {part:g} above friction": HardCase(
            make_block(STATIC, make_base_drive(30 / (1 - part), 1), damping=0.0), truth
        )
        for part, truth in first_slip.items()
    }
    stiff = {
        "tanh, reference speed 1e-4 of the speed": HardCase(
            make_block(
                f'law = "tanh"\nstatic = 0.3\nreference_speed = "{1e-4 * speed!r} m/s"\n', resonance
            ),
            two_stops,
        ),
        "LuGre, layer 1e4 times faster than the drive": HardCase(
            make_block(
                'law = "lugre"\nstatic = 0.3\nkinetic = 0.3\nstiffness = "1e10 N/m"\nstribeck_speed = "1 m/s"\n',
                resonance,
            ),
            two_stops,
        ),
        "elastic-plastic, bond length 1e-4 of the motion": HardCase(
            make_block(
                f'law = "elastic-plastic"\nstatic = 0.3\nbond_length = "{1e-4 * two_stops!r} m"\n',
                resonance,
            ),
            two_stops,
        ),
        "Bouc-Wen, stiffness 1e10 N/m": HardCase(
            make_block('law = "bouc-wen"\nstatic = 0.3\nstiffness = "1e10 N/m"\n', resonance),
            two_stops,
        ),
        "tanh, the same in time steps": HardCase(
            make_block(
                f'law = "tanh"\nstatic = 0.3\nreference_speed = "{1e-4 * speed!r} m/s"\n',
                resonance,
                more='[accuracy]\nmethod = "march"\n',
            ),
            two_stops,
        ),
    }
    mixed = (
        STATIC + 'load = "200 N"\n',
        'law = "elastic-plastic"\nstatic = 0.3\nbond_length = "2 um"\nload = "200 N"\n',
        'law = "bouc-wen"\nstatic = 0.3\nstiffness = "2e7 N/m"\nload = "200 N"\n',
        'law = "tanh"\nstatic = 0.3\nreference_speed = "1 mm/s"\nload = "200 N"\n',
    )
    return grazing | {
        "friction .8 of the drive at resonance": HardCase(
            make_block(STATIC, resonance), two_stops
        ),
        "the same in time steps": HardCase(
            make_block(STATIC, resonance, more='[accuracy]\nmethod = "march"\n'), two_stops
        ),
        "60 000 cycles": HardCase(
            make_block(STATIC, make_base_drive(RESONANT_PUSH, 60_000)), two_stops
        ),
        "eight stops in a cycle": HardCase(
            make_block(
                'law = "coulomb"\nstatic = 0.05\n',
                make_base_drive(10.0, 12, 6.25),
                damping=0.01,
            ),
            None,
        ),
        "slow drive, stick-slip with kinetic friction of a half": HardCase(
            make_block(WEAKENING, make_base_drive(60.0, 12, 1.0)), None
        ),
        "no damping, friction below pi/4 of the drive": HardCase(
            make_block(STATIC, make_base_drive(30 / (np.pi / 4 - 1e-3), 1500), damping=0.0), None
        ),
        "reversal during slip under an oscillating load": HardCase(
            make_block(
                STATIC, make_base_drive(60.0, 60), load='100 N"\namplitude = "80 N"\nfrequency = "270 Hz'
            ),
            None,
        ),
        "load that lifts off in every cycle": HardCase(
            make_block(
                STATIC, make_base_drive(60.0, 60), load='100 N"\namplitude = "150 N"\nfrequency = "70 Hz'
            ),
            None,
        ),
        "eight interfaces with kinetic friction of a half": HardCase(
            make_chain(
                10, {mass: WEAKENING + 'load = "100 N"\n' for mass in range(2, 10)}, cycles=40
            )
        ),
        "40 masses, four interfaces with four laws": HardCase(
            make_chain(40, {10 * k + 10: lines for k, lines in enumerate(mixed)}, cycles=40)
        ),
        "40 masses, 20 interfaces": HardCase(
            make_chain(40, {2 * k + 2: STATIC + 'load = "20 N"\n' for k in range(20)}, cycles=20)
        ),
        "softening spring, motion without bound": HardCase(
            make_block(
                STATIC,
                make_base_drive(60.0, 200),
                more='[structure.stiffening]\ncubic = "-4e11 N/m^3"\n',
            )
        ),
        "travel stop of .1 mm": HardCase(
            make_block(STATIC, make_base_drive(60.0, 200)).replace(
                'moving_mass = "1 kg"\n', 'moving_mass = "1 kg"\ntravel = "0.1 mm"\n'
            )
        ),
        "list of bonds of order 1/2": HardCase(
            make_block(
                'law = "nonlocal"\nstatic = 0.3\nbond_length = "10 um"\norder = 0.5\n',
                make_base_drive(60.0, 60),
            )
        ),
    } | stiff  # fmt: skip


def run_case(name: str, case: HardCase) -> str:
    """Run a case and return its row of the table."""
    begin = process_time()
    try:
        result = pf.run(case.text)
    except PatchfemError as error:
        seconds = process_time() - begin
        sentence = str(error).splitlines()[0]
        return f"| {name} | | refused: {sentence} | | | {seconds:.1f} |"
    seconds = process_time() - begin
    amplitude = result.measures[AMPLITUDE]
    value = "" if amplitude.value is None else f"{amplitude.value:.6g}"
    error = "" if amplitude.error is None else f"{amplitude.error:.1e}"
    true_error = ""
    if case.truth is not None and amplitude.value is not None:
        true_error = f"{abs(amplitude.value - case.truth):.1e}"
    return (
        f"| {name} | {result.plan.engine} | {result.outcome} | {value} ± {error} | {true_error} | "
        f"{seconds:.1f} |"
    )


def main(names) -> None:
    """Print the table of the named cases, or of all."""
    print("| case | engine | outcome | amplitude [m] | true error [m] | CPU s |")
    print("|---|---|---|---|---|---|")
    for name, case in make_cases().items():
        if not names or name in names:
            print(run_case(name, case), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
