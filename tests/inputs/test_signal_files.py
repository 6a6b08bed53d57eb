"""Signals of measurements: a universal file is read back as it was written."""

import numpy as np
import pytest
import pyuff

from patchfem.core import PatchfemError
from patchfem.inputs import read_signal

OMEGA = 2 * np.pi * 143


def test_exact_signal_of_universal_file_round_trip(tmp_path):
    """The acceleration of a universal file is read back, and a missing quantity is refused."""
    times = np.arange(200) / 1e4
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
            data=np.sin(OMEGA * times),
            x=times,
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
    assert time == pytest.approx(times, abs=1e-9)
    assert value == pytest.approx(np.sin(OMEGA * times), abs=1e-6)
    with pytest.raises(PatchfemError, match="force is needed; 0 of the 1"):
        read_signal(path, "force")
