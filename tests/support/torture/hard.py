"""Hard physics with answers known beforehand: grazing onset, resonance, lift-off, reversals, thin layers, first touch.

A run may refuse or say that it found no end; what it calls an answer must be the answer.
"""

import math

from . import physics as books
from .trial import Trial, Wrong

WITHIN = 1e-9  # of the value, beside the run's own error


def physics(trial: Trial) -> None:
    """One of the kinds, its numbers at random."""
    trial.draw(*KINDS)(trial)


def rig(trial: Trial, law: dict, drive: dict, damping: float = 0.01, load: str = "", **more) -> dict:
    """A scene of one mode at 100 Hz and 1 kg."""
    mode = {"name": "m", "frequency": "100 Hz", "damping": damping, "slide": 1.0}
    return {"normal": {"load": load or "30 N"}, "friction": {"static": 0.3} | law,
            "structure": {"moving_mass": "1 kg", "mode": [mode]}, "drive": {"kind": "base", "cycles": 12} | drive,
            "accuracy": {"tolerance": 1e-2} | more}


def solved(trial: Trial, tables: dict, most: float = 3.0):
    """The Result of a scene that must not be refused, None where it found no end or would take too long."""
    return books.solved(trial, tables, most, True)


def close(found, name: str, want: float, least: float = 0.0) -> None:
    """Wrong where a measure misses the truth by more than its own error."""
    one = found.measures[name]
    if one.value is None or abs(one.value - want) > (one.error or 0.0) + WITHIN * abs(want) + least:
        raise Wrong(f"{name} {one.value} ± {one.error}, true {want:.9g}, outcome {found.outcome.value}")


def onset(trial: Trial) -> None:
    """Coulomb a hair below or above mu N/m: it sticks for ever, or it slips."""
    part = 10.0 ** -trial.r.uniform(3, 9) * trial.draw(1, -1)
    drive = {"frequency": f"{trial.wide(30, 300)!r} Hz", "acceleration": f"{9.0 * (1 + part)!r} m/s^2"}
    found = solved(trial, rig(trial, {"law": "coulomb"}, drive, method=trial.draw("auto", "march", "exact")))
    if found is None:
        return
    if part < 0 and (found.outcome.value != "stuck" or
                     found.measures["relative_displacement_amplitude"].value > 1e-18):  # a march leaves its residual
        raise Wrong(f"{found.outcome.value} at {1 + part!r} of the force that holds")
    if part > 1e-6 and found.outcome.value == "stuck":
        raise Wrong(f"stuck at {1 + part!r} of the force that holds")


def resonance(trial: Trial) -> None:
    """A mode without damping driven at its own frequency grows for ever; nothing about it is steady."""
    tables = rig(trial, {}, {"frequency": "100 Hz", "acceleration": f"{trial.wide(1e-3, 1e3)!r} m/s^2",
                             "cycles": int(trial.wide(5, 400))}, 0.0, method=trial.draw("auto", "march", "exact"))
    found = solved(trial, {name: table for name, table in tables.items() if name not in ("normal", "friction")})
    if found is not None and found.outcome.value in ("steady", "stuck"):
        raise Wrong(f"{found.outcome.value} at resonance without damping")


def runaway(trial: Trial) -> None:
    """Coulomb takes 4 mu N per amplitude and cycle, the drive gives pi m a: above it no damping holds the motion."""
    size = 9.0 * 4 / math.pi * trial.r.uniform(1.2, 4)
    found = solved(trial, rig(trial, {"law": "coulomb"}, {
        "frequency": "100 Hz", "acceleration": f"{size!r} m/s^2", "cycles": int(trial.wide(20, 300))}, 0.0))
    if found is not None and found.outcome.value in ("steady", "stuck"):
        raise Wrong(f"{found.outcome.value} where the drive gives more than friction can take")


def lift_off(trial: Trial) -> None:
    """A load that falls below zero is none: friction within mu times what is left, and the books close."""
    load = trial.wide(5, 60)
    tables = rig(trial, trial.draw({"law": "coulomb"}, {"law": "tanh", "reference_speed": "1 mm/s"}, {
        "law": "elastic-plastic", "bond_length": "2 um"}, {"law": "nonlocal", "bond_length": "2 um"}), {
            "frequency": f"{trial.wide(50, 200)!r} Hz", "acceleration": "20 m/s^2"}, load=f"{load!r} N")
    part = trial.r.uniform(0.9, 3)
    tables["normal"] |= {"amplitude": f"{part * load!r} N", "frequency": f"{trial.wide(20, 300)!r} Hz"}
    found = solved(trial, tables)
    if found is None:
        return
    if found.measures["friction_force_peak"].value > 0.3 * (1 + part) * load * (1 + 1e-6):
        raise Wrong("more friction than the largest load bears")
    if found.outcome.value != "not_converged" and found.measures["energy_balance"].value > 1e-8:
        raise Wrong(f"energy balance {found.measures['energy_balance'].value:.3g}")


def swing(trial: Trial, reach: float, cycles: int) -> dict:
    """[slide] to and fro by `reach` [m]."""
    more = trial.draw({"kind": "sine", "frequency": "10 Hz"}, {"kind": "triangle", "speed": "1 mm/s"})
    return more | {"amplitude": f"{reach!r} m", "cycles": cycles}


def reversals(trial: Trial) -> None:
    """Elastic-plastic along a swing: a loop of 4 mu N (A - eps) where it slips, none where it does not."""
    reach, eps = trial.wide(1e-7, 1e-4), trial.wide(1e-7, 1e-4)
    found = solved(trial, {"normal": {"load": "30 N"}, "friction": {
        "law": "elastic-plastic", "static": 0.3, "bond_length": f"{eps!r} m"}, "slide": swing(trial, reach, 3),
                           "accuracy": {"tolerance": 1e-2}})
    if found is not None:
        close(found, "loop_area", 36.0 * max(0.0, reach - eps), 1e-9 * 36.0 * reach)


def stick_slip(trial: Trial) -> None:
    """Coulomb that holds more at rest: no more force than it holds, and the books close, in events and in a march."""
    drive = {"frequency": f"{trial.wide(5, 60)!r} Hz", "acceleration": f"{trial.wide(9.1, 40)!r} m/s^2"}
    law = {"law": "coulomb", "kinetic": round(float(trial.r.uniform(0, 0.3)), 3)}
    found = solved(trial, rig(trial, law, drive, trial.draw(0.0, 0.003, 0.3), method=trial.draw("auto", "march")))
    if found is None or found.outcome.value == "not_converged":
        return
    if found.measures["friction_force_peak"].value > 9.0 * (1 + 1e-9):
        raise Wrong(f"friction {found.measures['friction_force_peak'].value!r} N of 9 N that hold")
    if found.measures["energy_balance"].value > 1e-8:
        raise Wrong(f"energy balance {found.measures['energy_balance'].value:.3g}")


def patch(trial: Trial, **more) -> dict:
    """A pair of plain pieces pressed."""
    return {"contact": {"length": "10 mm", "width": "10 mm", "height": "5 mm", "substrate": "steel", "load": "50 N"}
            | more, "accuracy": {"tolerance": 1e-2}}


def thin_coating(trial: Trial) -> None:
    """A layer of any thinness and stiffness: pieces of one series of springs, E A/h each in uniaxial strain at least
    where they stop neither other; the load that was given, all of the length in touch."""
    thick = trial.wide(1e-8, 2e-3)
    coating = {"material": {"young": f"{trial.wide(1e7, 1e14)!r} Pa", "poisson": 0.3, "density": "4000 kg/m^3"},
               "thickness": f"{thick!r} m"}
    found = solved(trial, patch(trial, coating=coating, element_size="0.5 mm"), 8.0)
    if found is not None:
        close(found, "normal_load", 50.0)
        if found.measures["contact_fraction"].value < 1 - 1e-6 and not found.warnings:
            raise Wrong(f"flat pieces touch on {found.measures['contact_fraction'].value} of their length")


def first_touch(trial: Trial) -> None:
    """A crown under a small load: Hertz's half width sqrt(4 P R/(pi E*)) far below the height of the pieces."""
    from patchfem.scene.keys.materials import MATERIALS

    steel = MATERIALS["steel"]
    stiff = steel.young / (1 - steel.poisson**2) / 2
    want = trial.wide(2e-6, 5e-5)  # below a hundredth of the height
    radius = trial.wide(0.05, 2.0)
    load = want**2 * math.pi * stiff / (4 * radius) * 0.01
    found = solved(trial, patch(trial, load=f"{load!r} N", crown={"radius": f"{radius!r} m"}), 8.0)
    if found is not None:
        close(found, "contact_half_width", want, 0.02 * want)


KINDS = (onset, resonance, runaway, lift_off, reversals, stick_slip, thin_coating, first_touch)


def wear(trial: Trial) -> None:
    """Coulomb along a swing: kappa N s whatever the shares, the jumps, the form of the patch and the scheme."""
    reach, kappa, cycles = trial.wide(1e-6, 1e-4), trial.wide(1e-16, 1e-13), int(trial.wide(1, 1e5))
    load = trial.wide(5, 200)
    tables = {"friction": {"law": "coulomb", "static": 0.3}, "accuracy": {"tolerance": 1e-2},
              "slide": swing(trial, reach, 2),
              "wear": {"coefficient": f"{kappa!r} m^2/N", "cycles": cycles}}
    if trial.chance(0.5):
        tables["normal"] = {"load": f"{load!r} N"}
    else:
        tables["contact"] = patch(trial)["contact"] | {"load": f"{load!r} N", "element_size": "0.5 mm"}
        tables["wear"] |= {"upper_share": round(float(trial.r.random()), 3)}
        if trial.chance(0.4):
            tables["contact"] |= {"tilt": {"angle": f"{trial.wide(1e-7, 1e-4)!r} rad"}}
    found = solved(trial, tables, 8.0)
    if found is not None:
        close(found, "worn_volume", kappa * load * 4 * reach * cycles)
