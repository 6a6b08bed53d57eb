"""Signals of measurements: a universal file gives back what was written into it."""

import numpy as np
import pytest
import pyuff
from lab_files import INCH, record, written

from patchfem.core import PatchfemError
from patchfem.inputs import read_signal

W = 2 * np.pi * 143


def test_exact_a_universal_file_is_read_back(tmp_path):
    t = np.arange(200) / 1e4
    path = tmp_path / "shake.uff"
    pyuff.UFF(str(path)).write_sets(
        pyuff.prepare_58(
            binary=0,
            func_type=1,
            rsp_node=1,
            rsp_dir=1,
            ref_node=1,
            ref_dir=1,
            ordinate_spec_data_type=12,
            data=np.sin(W * t),
            x=t,
            abscissa_spacing=1,
            abscissa_inc=1e-4,
            num_pts=200,
            ord_data_type=4,
            id1="a",
            id2="b",
            id3="c",
            id4="d",
            id5="e",
            load_case_id=0,
            ver_num=0,
            rsp_ent_name="N",
            ref_ent_name="N",
            **{
                f"{axis}_{key}": 0
                for axis in ("abscissa", "ordinate", "orddenom", "z_axis")
                for key in ("spec_data_type", "len_unit_exp", "force_unit_exp", "temp_unit_exp")
                if (axis, key) != ("ordinate", "spec_data_type")
            },
        ),
        "overwrite",
    )
    time, value = read_signal(path, "acceleration")
    assert time == pytest.approx(t, abs=1e-9)
    assert value == pytest.approx(np.sin(W * t), abs=1e-6)
    with pytest.raises(PatchfemError, match="force is needed; 0 of the 1"):
        read_signal(path, "force")


def test_exact_a_recorded_drive_is_in_the_unit_of_its_label_or_of_the_file(tmp_path):
    """Written in g by its label, and in inch/s^2 by dataset 164, whose factor is 1/0.0254."""
    t = np.arange(200) / 1e4
    a = np.sin(W * t)
    label = written(tmp_path / "a.uff", [record(t, a / 9.80665, 12, ordinate_axis_units_lab="g")])
    inches = written(tmp_path / "b.uff", [INCH, record(t, a / 0.0254, 12), record(t, a, 8)])
    for path in (label, inches):
        assert read_signal(path, "acceleration")[1] == pytest.approx(a, rel=1e-14, abs=1e-15)
