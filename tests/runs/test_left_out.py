"""What the model leaves out, said with every kind of run: plane state, held faces, lever arms, slides off the piece."""

import json

import numpy as np
import pytest
from any_mesh_cases import FORMATS, drawn
from command_line import cli
from scene_texts import COATED, COULOMB, MODE, NONLOCAL, PIECE

from patchfem import build, plan
from patchfem.core import NotConverged, PatchfemError
from patchfem.mesh import graded_grid
from patchfem.mesh.files import EDGE_TAGS
from patchfem.model import make_piece_meshes
from patchfem.runs.patch.condensed import condense
from patchfem.runs.patch.press import press_patch
from patchfem.runs.patch.values import values
from patchfem.runs.run import run
from patchfem.scene import loads

SINE = '[slide]\nkind = "sine"\nfrequency = "1 Hz"\ncycles = 1\namplitude = "{}"\n'
HELD = (
    '[contact]\nlength = "12.8 mm"\nwidth = "12.7 mm"\nheight = "6.4 mm"\nload = "26 lbf"\n'
    'substrate = "Ti-8Al-1Mo-1V"\nmesh = "{}"\n'
)
TURNING = (
    PIECE
    + 'substrate = "Ti-8Al-1Mo-1V"\nelement_size = "0.2 mm"\n[contact.approach]\ndistance = "0.2 um"\n'
)
LINE = '[contact.load_line]\noffset = "{} mm"\n'


def ran(text, estimate=True):
    return run(loads(text), estimate=estimate)


# ---------------------------------------------------------------------------------------------------- plane state


def test_exact_notes_are_printed_and_written_beside_the_warnings(tmp_path):
    (tmp_path / "a.toml").write_text(COATED)
    answer = cli("run", tmp_path / "a.toml", "-o", tmp_path / "out")
    [note] = json.loads((tmp_path / "out" / "summary.json").read_text())["notes"]
    assert f"note: {note}" in answer.err
    assert f"Note: {note}" in (tmp_path / "out" / "report.html").read_text()


# ---------------------------------------------------------------------------------------------- mesh files, tall pieces
@pytest.mark.parametrize("kept", [2, 16])
def test_exact_a_mesh_fixed_on_part_of_a_face_gives_a_note_in_three_formats(kept, tmp_path):
    """lower_far on 2 of its 16 edges of 0.8 mm: 1.6 of 12.8 mm."""
    m = drawn("quads", graded_grid(12.8e-3, 6.4e-3, 0.8e-3))
    far = np.flatnonzero(m.edge_tags == EDGE_TAGS["lower_far"])
    gone = far[np.argsort(m.points[m.edges[far], 0].mean(axis=1))][kept:]
    m.edges, m.edge_tags = np.delete(m.edges, gone, axis=0), np.delete(m.edge_tags, gone)
    approaches = []
    for form in ("gmsh 2.2 binary", "vtu", "inp lines"):
        path = tmp_path / f"pair{FORMATS[form][0]}"
        FORMATS[form][1](m, path)
        found = ran(HELD.format(path))
        approaches.append(found.measures["approach"].value)
        said = [text for text in found.extra["notes"] if "lower_far" in text]
        assert said == (
            []
            if kept == 16
            else [
                "contact.mesh: the held nodes `lower_far` cover 0.0016 m of a face "
                "of 0.0128 m, 0.125 of the length of this face; the rest of the face is "
                "free"
            ]
        )
    assert approaches == pytest.approx([approaches[0]] * 3, rel=1e-9)
    flat = 115.654 / (12.8e-3 * 12.7e-3) * 2 * 6.4e-3 / 121e9  # both pieces as bars
    assert (approaches[0] > 3 * flat) == (kept == 2)


def test_exact_a_note_states_the_area_of_a_hole_in_the_mesh(tmp_path):
    """Two cells of 0.8 mm side by side left out of the lower piece."""
    m = drawn("quads", graded_grid(12.8e-3, 6.4e-3, 0.8e-3))
    middle = m.points[m.quads].mean(axis=1)
    row = np.unique(middle[middle[:, 1] < 0, 1])
    deep = row[len(row) // 2]
    gone = np.flatnonzero((np.abs(middle[:, 0]) < 0.8e-3) & (middle[:, 1] == deep))
    area = np.ptp(m.points[m.quads[gone[0]], 1]) * 1.6e-3
    whole = tmp_path / "whole.vtu", tmp_path / "hole.vtu"
    FORMATS["vtu"][1](m, whole[0])
    m.quads, m.quad_tags = np.delete(m.quads, gone, axis=0), np.delete(m.quad_tags, gone)
    FORMATS["vtu"][1](m, whole[1])
    said = [
        [text for text in ran(HELD.format(path), False).extra["notes"] if "hole" in text]
        for path in whole
    ]
    told = f"contact.mesh: the lower piece has 1 hole inside, {1e6 * area:.3g} mm^2 in all; if a hole is not"
    assert gone.size == 2 and said == [[], [f"{told} intended, close it in the mesh"]]


def test_exact_a_note_states_the_fraction_of_the_buckling_load():
    """Euler's column, clamped and free: pi^2 E' I/(4 H^2), I = width length^3/12."""
    text = (
        '[contact]\nlength = "10 mm"\nwidth = "1 m"\nheight = "{} mm"\nload = "{} N"\nelement_size = "0.5 mm"\n'
        'substrate = {{young = "100 GPa", poisson = 0.3, density = "4000 kg/m^3"}}\n'
    )
    critical = np.pi**2 * 100e9 / 0.91 * (1e-2**3 / 12) / (4 * 0.1**2)
    notes = ran(text.format(100, 0.05 * critical)).extra["notes"]
    said = [line for line in notes if "buckle" in line]
    assert len(said) == 2
    assert "10 times as tall as it is long and carries 0.05 of the load" in said[0]
    for height, share in ((100, 0.015), (10, 0.05)):
        assert not any(
            "buckle" in line for line in ran(text.format(height, share * critical)).extra["notes"]
        )


# ---------------------------------------------------------------------------------------------------- sliding away
@pytest.mark.parametrize(
    "share, said, outcome",
    [
        (0.09, False, "done"),
        (0.11, True, "done"),
        (0.99, True, "done"),
        (1.01, True, "leaves_contact"),
    ],
)
def test_exact_a_warning_states_how_far_a_bench_slides_off_the_contact(share, said, outcome):
    found = ran(COATED + COULOMB + SINE.format(f"{12.7 * share} mm"), False)
    line = (
        f"the slide amplitude, {12.7 * share:.3g} mm, is {share:.2g} of the contact length 12.7 mm"
    )
    assert any(text.startswith(line) for text in found.warnings) == said
    assert any(text.startswith("the slide amplitude") for text in found.warnings) == said
    assert found.outcome == outcome


def test_exact_a_bench_across_its_width_leaves_it_too(tmp_path):
    for across, outcome in ((12.6, "done"), (12.8, "leaves_contact")):
        path = tmp_path / "path.csv"
        path.write_text(f"time [s],displacement [um],lateral [mm]\n0,0,0\n1,5,{across}\n", "utf-8")
        law = NONLOCAL.replace("1 um", "1 mm")
        assert (
            ran(COATED + law + f'[slide]\nkind = "file"\nfile = "{path}"\n', False).outcome
            == outcome
        )


@pytest.mark.share(1, 2)
@pytest.mark.parametrize(
    "law, more, engine",
    [
        (COULOMB, "", "exact"),
        (COULOMB, '[accuracy]\nmethod = "march"\nsteps_per_cycle = 100\n', "march"),
        (COULOMB.replace('"coulomb"', '"elastic-plastic"\nbond_length = "1 um"'), "", "piecewise"),
        (COULOMB, '[accuracy]\nmethod = "harmonic"\n', "harmonic"),
    ],
)
def test_exact_every_engine_and_a_level_in_between_leave_the_piece(law, more, engine):
    """60 g move the block by 48 mm on a piece of 12.7 mm, after 30 cycles as in the middle one of three levels."""
    sine = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "60 g"\ncycles = 30\n'
    found = ran(COATED + law + MODE + sine + more, False)
    assert found.extra["engine"] == engine and found.outcome == "leaves_contact"
    if engine != "harmonic":
        steps = sine.replace(
            'acceleration = "60 g"', 'waveform = "levels"\nlevels = ["5 g", "60 g", "5 g"]'
        )
        assert ran(COATED + law + MODE + steps + more, False).outcome == "leaves_contact"


# ------------------------------------------------------------------------------------- approaches that no load reaches
@pytest.mark.parametrize("offset", ["5", "-5"])
def test_refuses_an_approach_whose_middle_opens_as_the_load_grows(offset):
    """At 5 mm twice the load opens the middle of flat pieces twice as far; at 3 mm it closes it twice as far."""
    with pytest.raises(
        PatchfemError, match=r"contact\.approach\.distance: the line of the load lies -?5 mm off"
    ):
        ran(TURNING + LINE.format(offset), False)
    closing = []
    for load in (100.0, 200.0):
        for line in (float(offset), np.sign(float(offset)) * 3):
            found = build(
                loads(
                    TURNING.replace('[contact.approach]\ndistance = "0.2 um"', f'load = "{load} N"')
                    + LINE.format(line)
                )
            ).patch
            closing.append(
                values(press_patch(found, condense(found, *make_piece_meshes(found))))["approach"]
            )
    assert closing[2:] == pytest.approx(2 * np.array(closing[:2]), rel=1e-9)
    assert closing[0] < 0 < closing[1]
    assert ran(TURNING + LINE.format(3), False).measures["approach"].value == pytest.approx(
        2e-7, rel=1e-9
    )


def test_refuses_an_approach_between_two_rotations_on_one_node():
    """A crown of 18 mm on cells of 1 mm touches at one node; under a moment it rolls from node to node, in jumps of the
    order of h^2/2R = 28 um. On finer cells it rolls evenly and reaches the distance."""
    text = (
        TURNING.replace("0.2 um", "2.509 um") + '[contact.crown]\nradius = "18.18 mm"\n'
        '[contact.load_line]\nmoment = "0.0001782 N m"\n'
    )
    with pytest.raises(
        NotConverged, match=r"contact\.approach\.distance: an approach of 2\.509e-06 m cannot be"
    ):
        ran(text.replace('"0.2 mm"', '"1 mm"'), False)
    found = ran(text.replace('"0.2 mm"', '"0.02 mm"'), False)
    assert found.measures["approach"].value == pytest.approx(2.509e-6, rel=1e-6)


@pytest.mark.parametrize(
    "tilt, more",
    [
        (10, ""),
        (1, ""),
        (20, ""),
        (1, '[contact.crown]\nradius = "1 m"\n'),
        (1, '[contact.step]\nheight = "1 um"\nat = "0 mm"\n'),
    ],
)
def test_always_a_plan_calls_no_contact_full_that_is_not(tilt, more):
    """At 10 urad bars still touch all over, elastic pieces on 94 %; a crown leaves 6 %."""
    text = (
        COATED.replace('element_size = "0.5 mm"\n', "")
        + f'[contact.tilt]\nangle = "{tilt} urad"\n{more}'
    )
    scene = loads(text, "a.toml", ["accuracy.tolerance=1e-2"])
    whole = any(text.endswith("the pieces touch everywhere") for text in plan(scene).verdict)
    assert whole == (run(scene).measures["contact_fraction"].value == 1.0)
