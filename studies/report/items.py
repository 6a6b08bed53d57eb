"""Which items of the report can this program compute, and with which scene, study and test?

See items.md in this folder, which this script writes.

Of 79 items 68 work, 8 in part, one cannot be computed, and of two there is nothing to compute. The verdict is on this
program: whether the report itself is right an item's study says. Paths are those of the repository.

Run: python studies/report/items.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from study_run import run_study

FOLDER = Path(__file__).parent
VERDICT_TEXTS = {"nothing": "nothing to compute"}
VERDICTS = {
    "works": "work",
    "in part": "work in part",
    "missing": "cannot be computed",
    "nothing": "have nothing to compute",
}


class Item(NamedTuple):
    """Item of the report.

    Contains its place, its statement, paths of the scene, study and test ("" if there is none), and
    the verdict, one of VERDICTS, with what is missing.
    """

    place: str
    said: str
    scene: str
    study: str
    test: str
    verdict: str


RIG = "studies/rig/rig.toml"
PRINTED_LAW_SCENE = "studies/rig/report.toml"
GROOVED_SCENE = "studies/report/grooved.toml"
BLOCK = "studies/report/block.toml"
FRAME = "studies/report/figure_5.toml"
LOOP = "studies/bench/loop.toml"
TWO = "studies/report/figures_10_12.toml"
FIGURES = "tests/studies/test_report_figures.py"
MODAL = "tests/studies/test_report_modal.py"
HISTORIES = "tests/studies/test_report_histories.py"
CONCLUSION_TESTS = "tests/studies/test_report_conclusions.py"
RIG_TESTS = "tests/studies/test_report_rig.py"


def _figure(name: str) -> str:
    return f"studies/report/figure{name}.py"


def _conclusion(number: int, said: str) -> Item:
    return Item(
        f"5, conclusion {number}",
        said,
        BLOCK,
        "studies/report/conclusions.py",
        CONCLUSION_TESTS,
        "works",
    )


ITEMS = (
    Item(
        "2",
        "friction of constant magnitude that opposes the velocity, and static friction below a threshold of speed",
        BLOCK,
        "studies/friction_ladder/ladder.py",
        "tests/runs/test_bench_engines.py",
        "works",
    ),
    Item(
        "2.A, eq. 2.1, Fig. 1",
        "a mass with friction, held to the frame by a spring and a dashpot",
        BLOCK,
        _figure("s_2_3"),
        "tests/event_driven/test_event_driven_closed_forms.py",
        "works",
    ),
    Item(
        "2.A, eqs 2.2, 2.3",
        "the dimensionless groups q, D, zeta, xi of this mass",
        BLOCK,
        _figure("s_2_3"),
        FIGURES,
        "works",
    ),
    Item(
        "2.A",
        "Newmark's method with a threshold of speed for sticking, and the spikes that this method causes",
        BLOCK,
        "studies/report/conclusions.py",
        "tests/studies/test_report_methods.py",
        "works",
    ),
    Item(
        "2.A",
        "input displacement: a sine or a step",
        BLOCK,
        "",
        "tests/structure/test_drives.py",
        "works",
    ),
    Item(
        "2.A",
        "other models, such as micro-slip, instead of a fully stuck contact",
        RIG,
        "studies/friction_ladder/ladder.py",
        "tests/partial_slip/test_partial_slip.py",
        "works",
    ),
    Item(
        "2.A, Figs 2, 3",
        "time histories, phase plane and friction force of the block at resonance",
        BLOCK,
        _figure("s_2_3"),
        FIGURES,
        "works",
    ),
    Item(
        "2.B, eqs 2.4, 2.5, Fig. 4",
        "friction that grows with the tanh of the velocity",
        FRAME,
        _figure("_5"),
        "tests/friction/laws/test_rate_law.py",
        "works",
    ),
    Item(
        "2.B, Fig. 5",
        "the block rings if it is computed by Euler's method",
        FRAME,
        _figure("_5"),
        FIGURES,
        "works",
    ),
    Item(
        "2.B, Fig. 8",
        "measured friction loops with ringing",
        "studies/report/figure_8.toml",
        _figure("_8"),
        RIG_TESTS,
        "works",
    ),
    Item("2.B, Figs 6, 7", "photographs of an older set-up", "", "", "", "nothing"),
    Item(
        "2.B, eqs 2.6, 2.7, Figs 9 to 12",
        "two masses that rub: ringing below resonance, no ringing near resonance",
        TWO,
        _figure("s_10_12"),
        FIGURES,
        "works",
    ),
    Item(
        "2.C, eqs 2.8, 2.9",
        "the path of a point, and the distance that the point has covered since a bond formed",
        LOOP,
        "",
        "tests/friction/bonds/test_bond_sums.py",
        "works",
    ),
    Item(
        "2.C, eqs 2.10 to 2.13",
        "a bond grows at rest and by slip, at rates that depend on the temperature",
        LOOP,
        "studies/bench/stribeck.py",
        "tests/friction/bonds/test_temperature.py",
        "works",
    ),
    Item(
        "2.C, eqs 2.14, 2.15, Figs 13, 14",
        "weights of a bond along and across the path",
        LOOP,
        _figure("_13"),
        "tests/friction/bonds/test_spread.py",
        "works",
    ),
    Item(
        "2.C, eqs 2.16, 2.17",
        "the nonlocal law as printed",
        PRINTED_LAW_SCENE,
        "studies/rig/readings.py",
        "tests/friction/bonds/test_bond_sums.py",
        "in part: the program refuses to combine this law with grooves",
    ),
    Item(
        "2.C, eq. 2.17",
        "the nonlocal law on pieces that deform in shear",
        RIG,
        "studies/rig/readings.py",
        "tests/time_steps/test_march_bonds.py",
        "works",
    ),
    Item(
        "2.C, eq. 2.17",
        "the law uses the normal stress at the place where a bond formed",
        LOOP,
        "",
        "tests/time_steps/test_march_bonds.py",
        "works",
    ),
    Item(
        "2.C, eq. 2.18",
        "at constant speed the nonlocal law becomes a local law",
        LOOP,
        "studies/bench/stribeck.py",
        "tests/friction/bonds/test_bond_sums.py",
        "works",
    ),
    Item(
        "2.C, eqs 2.19 to 2.21",
        "static and kinetic friction coefficients, from the bond lengths",
        LOOP,
        "studies/bench/stribeck.py",
        "tests/studies/test_bench_studies.py",
        "works",
    ),
    Item(
        "3.A, eq. 3.1",
        "mass, damping and stiffness matrices, with internal friction and external forces",
        TWO,
        "",
        "tests/structure/test_matrices.py",
        "works",
    ),
    Item(
        "3.A, eqs 3.2 to 3.4",
        "the modes of this structure; damping may couple the modes",
        RIG,
        "",
        "tests/structure/test_response.py",
        "works",
    ),
    Item(
        "3.B, eqs 3.5 to 3.10",
        "the solution by Duhamel's integral, with implicit friction",
        BLOCK,
        "studies/integrators/failure.py",
        "tests/studies/test_report_methods.py",
        "works",
    ),
    Item(
        "3.B",
        "prescribed initial displacements and velocities",
        "studies/report/free.toml",
        _figure("_15"),
        "tests/structure/test_initial_conditions.py",
        "works",
    ),
    Item(
        "3",
        "any transient load, or a sweep over a range of frequencies",
        RIG,
        "studies/steady/fold.py",
        "tests/event_driven/test_event_driven_reference.py",
        "works",
    ),
    Item(
        "3.C.1, eq. 3.11, Fig. 15",
        "a released block comes to rest",
        "studies/report/figure_15.toml",
        _figure("_15"),
        FIGURES,
        "works",
    ),
    Item(
        "3.C.2, Fig. 16",
        "two masses with a rigid-body mode and friction on the second mass",
        TWO,
        "studies/integrators/failure.py",
        "tests/studies/test_report_methods.py",
        "works",
    ),
    Item(
        "3.C.2, Figs 17, 18",
        "if the displacement decides whether a step is accepted, mass 2 moves although friction should hold it",
        BLOCK,
        "studies/integrators/failure.py",
        "tests/studies/test_report_methods.py",
        "works",
    ),
    Item(
        "3.C.2, Figs 19, 20",
        "if the velocity decides whether a step is accepted, mass 2 does not drift, but the friction force is erratic",
        BLOCK,
        "studies/integrators/failure.py",
        "tests/studies/test_report_methods.py",
        "works",
    ),
    Item(
        "3.C.3, eq. 3.12, Figs 21, 22",
        "the simplified law, elastic up to the friction limit",
        BLOCK,
        "studies/integrators/failure.py",
        "tests/event_driven/test_event_driven_closed_forms.py",
        "works",
    ),
    Item(
        "4.A",
        "threaded rods and flexures act as springs; the load is a weight on a cable",
        RIG,
        "",
        "tests/structure/test_universal.py",
        "in part: a scene has an axial mode and a constant load instead of rods, cable and weight",
    ),
    Item(
        "4.A",
        "the base is shaken with a prescribed acceleration; the axial mode lies between 100 and 150 Hz",
        RIG,
        "studies/rig/tilt.py",
        "tests/studies/test_studies.py",
        "works",
    ),
    Item("4.A, Figs 23, 24", "photographs of the rig", "", "", "", "nothing"),
    Item(
        "4.A, Fig. 25",
        "titanium pieces with a coating of 6 mil tungsten carbide",
        RIG,
        "studies/patch/from_file.py",
        "tests/elasticity/test_elasticity.py",
        "works",
    ),
    Item(
        "4.A",
        "the normal load is varied by changing the weight",
        RIG,
        "",
        "tests/runs/test_batches.py",
        "works",
    ),
    Item(
        "4.B, Fig. 26",
        "modal test without friction: 143 Hz, damping ratio 0.003",
        RIG,
        _figure("_26"),
        MODAL,
        "works",
    ),
    Item(
        "4.B",
        "rocking at 73 Hz and yaw at 129 Hz, in addition to the axial mode",
        RIG,
        "studies/table_1/unfitted.py",
        "tests/studies/test_table_1.py",
        "works",
    ),
    Item(
        "4.B, Fig. 27",
        "with a load of 26 lbf: nearly critically damped in the vicinity of 148 Hz",
        GROOVED_SCENE,
        _figure("_27"),
        MODAL,
        "in part: the critically damped mode lies at 101 Hz, at 128 to 135 Hz or at 295 Hz, "
        "depending on the model, but not at 148 Hz",
    ),
    Item(
        "4.B, Fig. 27",
        "rocking and yaw are suppressed when the pieces rub",
        RIG,
        "studies/report/engaged.py",
        RIG_TESTS,
        "works",
    ),
    Item(
        "4.B",
        "asymmetric friction would have excited yaw",
        RIG,
        "studies/misalignment/roll.py",
        "tests/studies/test_misalignment.py",
        "works",
    ),
    Item(
        "4.C",
        "exploratory sweeps from 130 to 160 Hz below 5 g",
        RIG,
        "studies/report/sweeps.py",
        RIG_TESTS,
        "works",
    ),
    Item(
        "4.C",
        "slip begins at 4 g at all frequencies and distorts the acceleration",
        RIG,
        "studies/table_1/levels.py",
        "tests/measures/test_levels.py",
        "in part: a rigid block does so; the patch of rig.toml, which slips part by part, distorts it by 3 % from 3.39 g "
        "(135 Hz) to 2.96 g (155 Hz) on",
    ),
    Item(
        "4.C",
        "the level is raised in steps at a fixed frequency, up to 10 g or divergence",
        RIG,
        "studies/report/steps.py",
        RIG_TESTS,
        "works",
    ),
    Item(
        "4.C",
        "the strain gauge shows 1 V per 0.001 inch",
        RIG,
        "studies/report/steps.py",
        "tests/campaigns/rows/test_fit_rows.py",
        "works",
    ),
    Item(
        "4.C",
        "records of input, absolute acceleration and gauge signal",
        RIG,
        "studies/report/steps.py",
        RIG_TESTS,
        "works",
    ),
    Item(
        "4.D, Fig. 28",
        "time histories at 135 Hz",
        GROOVED_SCENE,
        _figure("s_28_29"),
        HISTORIES,
        "works",
    ),
    Item(
        "4.D, Fig. 29",
        "time histories at 143 Hz, stable and unstable at 8 g",
        GROOVED_SCENE,
        _figure("s_28_29"),
        HISTORIES,
        "works",
    ),
    Item(
        "4.D, Figs 30, 31",
        "surface profiles: waves of 80 um length and 13 to 18 um height, lower after the tests",
        "",
        _figure("s_30_31"),
        FIGURES,
        "in part: on synthetic surfaces; the printed curves could not be read",
    ),
    Item(
        "4.D, Figs 2, 3, 32, 33",
        "at 5 g: amplitude computed as q = 0.15 and measured as 0.23 mil; acceleration computed as 5 g and measured "
        "as 6 g",
        BLOCK,
        _figure("s_2_3"),
        FIGURES,
        "works",
    ),
    Item(
        "4.D",
        "the analysis predicts no slip at 4 g and divergence at 8 g",
        BLOCK,
        _figure("s_2_3"),
        FIGURES,
        "works",
    ),
    Item(
        "Table 1",
        "absolute accelerations at four frequencies and several levels",
        RIG,
        "studies/table_1/ladder.py",
        "tests/studies/test_table_1_ladder.py",
        "works",
    ),
    Item(
        "Table 1",
        "relative displacements, some of them flagged as unstable or lost",
        RIG,
        "studies/table_1/ladder.py",
        "tests/studies/test_table_1_ladder.py",
        "works",
    ),
    Item(
        "Table 1",
        "onset of slip, 3.8 to 4.2 g",
        RIG,
        "studies/table_1/levels.py",
        "tests/studies/test_table_1.py",
        "in part: the friction of rig.toml is set so that a rigid block slips from 4.00 g on; at 3 % third harmonic its own "
        "onset is 2.96 to 3.39 g, that of the fitted models 3.95 to 4.9 g",
    ),
    Item(
        "Table 1",
        "repeated readings at 135 and 143 Hz",
        RIG,
        "studies/report/repeats.py",
        "tests/studies/test_table_1_repeats.py",
        "works",
    ),
    _conclusion(1, "slip begins at the same level at all frequencies"),
    _conclusion(2, "above a certain level the motion diverges; stiffening limits the motion"),
    _conclusion(3, "sticking and slipping make the mass ring"),
    _conclusion(4, "responses can be nearly sinusoidal above certain levels"),
    _conclusion(5, "only a portion of the area rubbed, because the pieces were not well aligned"),
    _conclusion(6, "slip begins near the input's maximum and is largest somewhat later"),
    _conclusion(7, "the masses are stuck while the input displacement returns through zero"),
    _conclusion(8, "the masses slip again and follow the input, lagging"),
    _conclusion(9, "when the mass sticks, its velocity drops and its acceleration jumps"),
    _conclusion(10, "a model of one degree of freedom does not ring"),
    Item(
        "Table 1, 4.D",
        "levels of runaway: from 6 g on at 135 Hz, 8 g at 143 Hz",
        GROOVED_SCENE,
        "studies/report/runaways.py",
        RIG_TESTS,
        "in part: with friction far off the axis the computed rig also has its "
        "lowest level of runaway at 135 Hz, but its displacement is 8 to 11 times the measured one; no model fitted "
        "to Table 1 has its lowest level of runaway at 135 Hz",
    ),
    Item(
        "5",
        "relative and absolute acceleration",
        BLOCK,
        _figure("s_2_3"),
        "tests/measures/test_measures.py",
        "works",
    ),
    Item(
        "2.C, reference 2",
        "the nonlocal law of Oden and Pires, which averages over x",
        LOOP,
        "studies/friction_ladder/ladder.py",
        "tests/friction/laws/test_convolution.py",
        "works",
    ),
    Item(
        "2.C, eq. 2.17",
        "slide in two directions, with bonds in the whole plane",
        LOOP,
        "",
        "",
        "missing: an interface slides along one direction (removed in 2.0)",
    ),
    Item(
        "3",
        "any number of interfaces",
        TWO,
        "",
        "tests/event_driven/test_event_driven_hard_cases.py",
        "works",
    ),
    Item(
        "3",
        "the stability of the response",
        RIG,
        "studies/steady/fold.py",
        "tests/studies/test_steady_studies.py",
        "works",
    ),
    Item(
        "3.C",
        "numerical methods must be chosen carefully: accuracy against computing time",
        BLOCK,
        "studies/integrators/work_precision.py",
        "tests/campaigns/test_cost.py",
        "works",
    ),
    Item(
        "1",
        "damping of built-up structures by friction at their joints",
        RIG,
        "studies/steady/backbone.py",
        "tests/studies/test_steady_studies.py",
        "works",
    ),
    Item(
        "1",
        "devices that are added to dissipate energy by friction",
        "",
        "studies/damper/damper.py",
        "tests/studies/test_damper_study.py",
        "works",
    ),
    Item(
        "Fig. 25",
        "a mesh of the test pieces",
        "",
        "studies/patch/from_file.py",
        "tests/studies/test_mesh_file.py",
        "works",
    ),
    Item(
        "4.D, Fig. 31",
        "wear of the rubbed surfaces",
        RIG,
        "studies/wear/rig_story.py",
        "tests/studies/test_wear_studies.py",
        "works",
    ),
    Item(
        "1",
        "a law that experiments can check and whose parameters come from measurements",
        RIG,
        "studies/table_1/ladder.py",
        "tests/campaigns/rows/test_fit_rows.py",
        "works",
    ),
    Item(
        "1",
        "flutter: friction limits the motion that negative damping causes",
        BLOCK,
        "",
        "tests/runs/test_flutter.py",
        "works",
    ),
    Item(
        "5, conclusion 2",
        "stiffening of the flexures at large motion",
        "studies/table_1/rigid.toml",
        "studies/report/conclusions.py",
        CONCLUSION_TESTS,
        "works",
    ),
    Item(
        "1",
        "the friction of many asperities, derived from that of one",
        "",
        "studies/misalignment/rough_skin.py",
        "tests/contact/test_asperity_layer.py",
        "in part: stiffness and pressure of many asperities are computed, but no "
        "friction law is derived from them",
    ),
)


def link(path: str) -> str:
    """Return a path of the repository as a link from the page."""
    return f"[{path.split('/', 1)[1]}](../../{path})" if path else "-"


def table(items=ITEMS) -> str:
    """Return the page in Markdown."""
    counts = [
        (sum(item.verdict.split(":")[0] == verdict for item in items), words)
        for verdict, words in VERDICTS.items()
    ]
    rows = [
        f"| {number} | {one.place} | {one.said} | {link(one.scene)} | {link(one.study)} | {link(one.test)} | "
        f"{VERDICT_TEXTS.get(one.verdict, one.verdict)} |"
        for number, one in enumerate(items, 1)
    ]
    return "\n".join(
        [
            "# The report, item by item",
            "This page is generated by `items.py`. The verdict says whether this program can "
            "compute the item. The study of the item says whether the report is right; for the ten conclusions, [a table]"
            "(reproduced.md#conclusions) says this.",
            "",
            f"Of {len(items)} items, {', '.join(f'{count} {words}' for count, words in counts)}.",
            "",
            "| | section of the report | what the report says | scene | study | test | verdict |",
            "|---|---|---|---|---|---|---|",
            *rows,
            "",
        ]
    )


def main(path: Path | None = FOLDER / "items.md") -> tuple:
    """Write the items as a page and return them."""
    if path is not None:
        path.write_text(table(), "utf-8")
    return ITEMS


if __name__ == "__main__":
    run_study(main)
