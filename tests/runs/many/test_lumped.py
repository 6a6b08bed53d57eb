"""Lumped cases in one compiled call, beside the same cases run one by one."""

import numpy as np
import pytest
from scene_texts import MODE

from patchfem.api import base_of, build, load
from patchfem.runs.many import one_by_one
from patchfem.runs.many.lumped import lumped
from patchfem.scene.sets import assignments

DRIVE = '[drive]\nkind = "{kind}"\n{kind_size}\nfrequency = "140 Hz"\ncycles = 40\n'
SCENE = '[normal]\nload = "30 N"\n[friction]\n{law}\n' + MODE + DRIVE
LAWS = {"coulomb": 'law = "coulomb"\nstatic = 0.3', "weakening": 'law = "coulomb"\nstatic = 0.3\nkinetic = 0.2',
        "elastic-plastic": 'law = "elastic-plastic"\nstatic = 0.3\nbond_length = "10 um"',
        "iwan": 'law = "iwan"\nstatic = 0.3\nstiffness = "2e6 N/m"\nchi = -0.5\nbeta = 1.0'}
SMOOTH = {"tanh": 'law = "tanh"\nstatic = 0.3\nreference_speed = "2 mm/s"',
          "bonds": 'law = "nonlocal"\nstatic = 0.3\nbond_length = "5 um"',
          "stiff bonds": 'law = "nonlocal"\nstatic = 0.3\nbond_length = "0.5 um"',
          "fresh bonds": 'law = "nonlocal"\nstatic = 0.3\nbond_length = "40 um"\ninitial_bonds = 0.5'}
LAWS |= SMOOTH
OF_RUNS = 2e-15  # of a value, round-off of the difference of two runs that its bar is
SIZES = {"base": 'acceleration = "5 g"', "force": 'force = "5 N"'}
LOOPS = ("loop_area", "equivalent_damping", "friction_work")
BITS = ("relative_displacement_amplitude", "relative_displacement_amplitude_steady")  # by extremes and phasors alone
DIFFERENCES = ("drift_per_cycle", "energy_balance", "work_check")  # of larger terms: known to their round-off


def models(law: str, seed: int, count: int) -> list:
    """Random cases of a law: sizes that stick, that stop and that slide all the time, near resonance and away."""
    r, out = np.random.default_rng(seed), []
    for _ in range(count):
        kind = str(r.choice(["base", "base", "force"]))
        push, mode = 10 ** r.uniform(0.3, 2), "structure.mode.axial"
        sets = {"normal.load": r.uniform(2, 1.5 * push), "drive.frequency": r.uniform(60, 250),
                f"{mode}.damping": float(r.choice([0, 0.003, 0.05, 0.3, 1.0, 1.4])),
                f"{mode}.slide": float(r.choice([1, -0.7])), f"{mode}.output": float(r.choice([1, -1.3, 0.5])),
                "drive.cycles": int(r.choice([20, 47])), "accuracy.tolerance": float(r.choice([1e-3, 1e-5]))}
        sets |= {"drive.acceleration": push, f"{mode}.base": r.uniform(0.4, 1)} if kind == "base" else \
            {"drive.force": push}
        if r.random() < 0.2:
            sets["structure.start.velocity"] = [0.05]
        if law == "elastic-plastic":
            sets["friction.bond_length"] = 10 ** r.uniform(-7, -4)
        scene = load(SCENE.format(law=LAWS[law], kind=kind, kind_size=SIZES[kind]))
        out.append(build(base_of(scene).changed(assignments(sets))))
    return out


def batch(cases):
    """Answers of the batch, group by group."""
    from patchfem.runs.many.answers import Answers

    found, groups = Answers.blank(len(cases)), {}
    for case, model in enumerate(cases):
        assert lumped.refuses(model) == ""
        groups.setdefault(lumped.group(model), []).append(case)
    for places in groups.values():
        found.place(places, lumped.solve([cases[case] for case in places]))
    return found


def passed(found, case: int, name: str) -> float:
    """Friction force times the slide of all cycles [J], or for the damping [1] the share of it in 2 pi K A^2."""
    size = 40 * found.values["friction_force_peak"][case] * found.values["relative_displacement_amplitude"][case]
    loop = found.values["loop_area"][case]
    if name == "equivalent_damping":
        return abs(found.values[name][case] / loop) * size if loop else 1.0
    return size


def conditioned(found, case: int) -> float:
    """How much round-off of the coordinate counts in the slip: static displacement of the drive over the slip."""
    slip = found.values["slip_amplitude"][case]
    return max(1.0, 1e-6 / slip) if slip > 0 else 1.0


def held_against(cases, ones, many, of_bar: float = 0.0) -> None:
    """Assert that a batch gave what single runs give: values and bars to 1e-12, all words the same; but for smooth
    laws, amplitudes and steady estimates to the last bit, and their bars but for Iwan's.

    of_bar: share of a value that its bar may be off besides.
    """
    assert list(many.outcome) == list(ones.outcome)
    assert many.warnings == ones.warnings and many.notes == ones.notes and many.numerics == ones.numerics
    for case in range(len(cases)):
        for name in {*ones.values, *many.values}:
            assert many.has(name, case) == (name in ones.values and ones.has(name, case)), (case, name)
            assert many.reasons.get(name, {}).get(case) == ones.reasons.get(name, {}).get(case), (case, name)
            if not ones.has(name, case):
                continue
            if name in BITS and not of_bar:
                told_apart = cases[case].friction.law == "iwan"  # by a coarser run, not of the batch
                for one, other in ((ones.values, many.values), (ones.errors, many.errors))[:1 if told_apart else 2]:
                    np.testing.assert_array_equal(other[name][case], one[name][case], f"{case}, {name}")
            value, bar = ones.values[name][case], ones.errors[name][case]
            near = 1e-12 * conditioned(ones, case) * abs(value)
            if name in LOOPS:  # of the work that goes to and fro
                near += 1e-14 * passed(ones, case, name)
            if name in DIFFERENCES:  # other orders of the same sums leave another round-off, which either bar may know
                theirs = min(many.errors[name][case], 1e-13)
                near += max(bar, theirs, 1e-14) if np.isfinite(bar) else 1e-12
            elif name == "acceleration_distortion":
                near += 1e-13  # of the first harmonic: round-off of the phase omega t
            assert many.floors[name][case] == ones.floors[name][case]
            assert many.values[name][case] == pytest.approx(value, rel=0, abs=near, nan_ok=True), (case, name)
            if name not in DIFFERENCES:
                told = 1e-9 * near + of_bar * abs(value)
                if cases[case].friction.law == "iwan":  # a coarser run tells it
                    told = 3 * near
                same = pytest.approx(bar, rel=1e-11, abs=told, nan_ok=True)
                assert many.errors[name][case] == same, (case, name)


@pytest.mark.parametrize(("law", "count"), [(law, 6 if law == "iwan" else 8 if law in SMOOTH else 20) for law in LAWS])
def test_exact_batch_is_the_single_runs(law, count):
    cases = models(law, 1, count)
    held_against(cases, one_by_one.solve(cases), batch(cases), OF_RUNS * (law in SMOOTH))


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_exact_batch_is_the_single_runs_many(law):
    cases = models(law, 2, 180)
    held_against(cases, one_by_one.solve(cases), batch(cases), OF_RUNS * (law in SMOOTH))


def test_exact_cases_shared_by_threads_are_the_same_to_the_last_bit(monkeypatch):
    from patchfem.runs.many.lumped import threads

    cases = [one for one in models("coulomb", 3, 100) if one.rig.cycles == 20]
    alone = lumped.solve(cases)
    monkeypatch.setattr(threads, "LEAST", 8)
    monkeypatch.setattr(threads, "cores", lambda: 3)
    shared = lumped.solve(cases)
    for name, values in alone.values.items():
        np.testing.assert_array_equal(shared.values[name], values)
        np.testing.assert_array_equal(shared.errors[name], alone.errors[name])
    assert list(shared.outcome) == list(alone.outcome) and shared.reasons == alone.reasons


def test_always_parts_make_up_the_cases(monkeypatch):
    from patchfem.runs.many.lumped import threads

    monkeypatch.setattr(threads, "cores", lambda: 4)
    for count in (0, 1, 31, 64, 129, 1000):
        seen = []
        threads.in_threads(seen.append, count)
        assert sorted(k for part in seen for k in range(count)[part]) == list(range(count))
        assert len(seen) == max(1, min(4, count // 32))


def test_exact_a_case_beyond_the_room_is_run_by_itself(monkeypatch):
    """A block that stops twice a cycle has twice the phases of one that slides, in the same call."""
    from patchfem.runs.many.lumped import coulomb

    base = base_of(load(SCENE.format(law=LAWS["coulomb"], kind="base", kind_size=SIZES["base"])))
    shared = ["drive.frequency=100 Hz", "drive.cycles=80", "structure.mode.axial.damping=0.05"]
    cases = [build(base.changed([*shared, one])) for one in ("normal.load=5 N", "normal.load=125 N")]
    monkeypatch.setattr(coulomb, "PHASES", 0)  # 256 in all
    seen, real = [], one_by_one.solve
    monkeypatch.setattr(one_by_one, "solve", lambda models, say: seen.extend(models) or real(models, say))
    many = batch(cases)
    assert seen == cases[1:]
    monkeypatch.undo()
    held_against(cases, one_by_one.solve(cases), many)


def test_exact_what_is_extrapolated_far_is_that_of_a_single_run(monkeypatch):
    """Of two Coulomb cases one still changes; its steady estimate, beyond its tolerance, shows the last bits of the
    extremes and phasors it is made of: the batch has those bits without a run by itself, and the same words."""
    from patchfem.runs.many.lumped import coulomb

    base = base_of(load(SCENE.format(law=LAWS["coulomb"], kind="base", kind_size=SIZES["base"])))
    shared = ["drive.frequency=143 Hz", "structure.mode.axial.frequency=143 Hz", "structure.moving_mass=0.884 kg",
              "drive.cycles=200", "structure.mode.axial.damping=0.003"]
    cases = [build(base.changed([*shared, f"normal.load={load} N", f"drive.acceleration={push} m/s^2"]))
             for load, push in (("69.0969899665552", 30), ("100", 60))]
    ones = one_by_one.solve(cases)
    assert "relative_displacement_amplitude_steady is known" in ones.warnings[0][-1] and 1 not in ones.warnings
    assert not coulomb.refuses(cases[0])
    monkeypatch.setattr(one_by_one, "solve", None)
    held_against(cases, ones, batch(cases))


def test_exact_elements_of_all_cases_are_those_of_each():
    """Sums and numbers of pieces that are made for all cases at once, beside those of one after the other."""
    from patchfem.dynamics.piecewise.elements import elements_of, table_of
    from patchfem.runs.many.lumped import pieces
    from patchfem.runs.rig.pieces import costs

    rng = np.random.default_rng(4)
    groups = [elements_of(rng.uniform(1, 2, count), rng.uniform(1, 2, count)) for count in (1, 5, 3, 0, 5)]
    counts, sorts = pieces.tables_of(groups)
    for group, count, columns in zip(groups, counts, sorts):
        one = table_of([group])
        assert count == one.count[0] == group.stiffness.size
        for column, part in zip(columns, (one.reach, one.stiff, one.limit, one.twice)):
            np.testing.assert_array_equal(column[:count + 1], part[0])
            np.testing.assert_array_equal(column[count + 1:], part[0, -1])
    for case in (one for law in ("elastic-plastic", "iwan") for one in models(law, 6, 5)):
        rig, *_, group, _ = pieces.row_of(case)
        all_of = group.stiffness.size
        for _ in range(pieces.coarsened(case)):
            group = pieces.paired(group)
        told = costs.pieces(case) + 2 * (group.stiffness.size - (all_of >> pieces.coarsened(case)))  # an odd one stays
        assert pieces.most_pieces(np.array([rig]), [case.rig.drive], [group]) == pytest.approx(told, rel=1e-12)


def test_always_few_cells_are_told_from_many():
    """Cells of a density that a tolerance asks for: the answers of all 769 lie within the bars, where small cycles
    slip too, for which the first cells are too few."""
    base = base_of(load(SCENE.format(law=LAWS["iwan"], kind="base", kind_size=SIZES["base"])))
    for push in ("20 m/s^2", "2 m/s^2", "0.3 m/s^2"):
        few = build(base.changed([f"drive.acceleration={push}", "accuracy.tolerance=1e-3"]))
        found, best = lumped.solve([few]), lumped._solved([few], None, 0)
        for name, value in found.values.items():
            if np.isfinite(value[0]) and name not in ("energy_balance", "work_check"):
                assert abs(value[0] - best.values[name][0]) <= found.errors[name][0] + found.floors[name][0], name
                assert found.errors[name][0] <= 1e-3 * abs(value[0]) + found.floors[name][0], name
