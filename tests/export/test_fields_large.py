"""Large series of fields: rounding errors as stated, frames written one by one, and files after a kill."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import zlib
from time import process_time
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
import pyvista
from exported import frame_values, write_small_series
from scene_texts import COATED
from vtkmodules.vtkIOHDF import vtkHDFReader

import patchfem
from patchfem.disk import is_partial_name
from patchfem.elasticity import get_cells, lame, make_points
from patchfem.export.fields import bodies, vtkhdf
from patchfem.export.fields.series import Series
from patchfem.export.fields.vtkhdf import NAME, round_to_bits, round_to_step

KILLED = """\
import os, sys
from pathlib import Path
from patchfem.export.fields import vtkhdf
sys.path[:0] = {paths!r}
from exported import write_small_series
calls, inner, vtkhdf.MIN_FRAMEWISE_BYTES = [0], vtkhdf._rounding_function, 0
def counted(nearest):
    def one(values):
        calls[0] += 1
        if calls[0] > {calls}:
            os.kill(os.getpid(), 9)
        return nearest(values)
    return one
vtkhdf._rounding_function = lambda *of: counted(inner(*of))
{write}
"""


def run_until_killed(write: str, calls: int, folder) -> None:
    """Write a series in a process that is killed after a number of arrays."""
    paths = [path for path in sys.path if "tests" in path]
    done = subprocess.run(
        [sys.executable, "-c", KILLED.format(paths=paths, calls=calls, write=write)],
        cwd=folder,
        check=False,
    )
    assert done.returncode == -signal.SIGKILL


def read_frames_with_vtk(path):
    """Yield the grids of all blocks of each frame as VTK reads them."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for number in range(reader.GetNumberOfSteps()):
        reader.SetStep(number)
        reader.Update()
        yield pyvista.wrap(reader.GetOutputDataObject(0)).copy()


@pytest.fixture(scope="module")
def large_series(tmp_path_factory):
    """Return a sheared pair of 21 000 cells, its blocks, their file and the CPU seconds.

    The seconds are those of writing the fields and of compressing the stress with zlib alone, the
    minimum of three runs.
    """
    folder = tmp_path_factory.mktemp("rubbing")
    scene = folder / "scene.toml"
    scene.write_text(
        re.sub("element_size = .*", 'element_size = "40 um"', COATED)
        + '[contact.tilt]\nangle = "0.1 mrad"\n',
        "utf-8",
    )
    pressed = patchfem.run(scene)
    kept = {}
    write = vtkhdf.write_series
    fields = {name: np.repeat(values, 9, axis=0) for name, values in pressed.fields.items()}
    fields["time"] = np.arange(9) * 1e-3
    fields["shear_stress"] = (
        0.3 * np.cos(np.pi * fields["time"] / 8e-3)[:, None] * fields["normal_stress"]
    )
    with pytest.MonkeyPatch.context() as changed:
        changed.setattr(vtkhdf, "MIN_FRAMEWISE_BYTES", 0)
        changed.setattr(
            bodies,
            "write_series",
            lambda path, blocks, times, units, steps: (
                kept.update(blocks=blocks) or write(path, blocks, times, units, steps)
            ),
        )
        seconds = []
        for _ in range(3):
            begin = process_time()
            whole = SimpleNamespace(
                patch=pressed.patch,
                plan=pressed.plan,
                fields=fields,
                measures=pressed.measures,
                extra={},
            )
            bodies.write_fields(whole, folder / NAME)
            seconds.append([process_time() - begin])
            begin = process_time()
            for side in ("lower", "upper"):
                zlib.compress(kept["blocks"][side].cell_data["stress"].tobytes(), 1)
            seconds[-1].append(process_time() - begin)
    return pressed, kept["blocks"], folder / NAME, np.min(seconds, axis=0)


@pytest.mark.slow
def test_always_rounding_is_below_discretisation_error(large_series):
    """In energy norm, rounding changes the stress by at most a quarter of its estimated error, in every frame.

    All values agree with the unrounded ones within the stated rounding error.
    """
    result, blocks, path, _ = large_series
    piece = result.patch.pair.piece
    cells = get_cells(piece)
    area = np.concatenate([rule.weight.sum(axis=0) for rule in make_points(cells, "gauss")])
    lam, mu = np.array(
        [lame(*material, "strain") for material in (piece.layers.substrate, piece.layers.coating)]
    )[cells.is_coating.astype(int)].T
    with h5py.File(path) as file:
        rounding_errors = {
            (side, name): array.attrs["rounding_error"]
            for side in ("lower", "upper")
            for kind in ("PointData", "CellData")
            for name, array in file[f"VTKHDF/{side}/{kind}"].items()
            if "rounding_error" in array.attrs
        }
    assert {name for _, name in rounding_errors} == {"displacement", "stress", "von_mises"}

    def strain_energy(stress):
        """Return the strain energy of stresses given per cell, of shape (n, 6)."""
        xx = stress[:, 0]
        yy = stress[:, 1]
        xy = stress[:, 3]
        return (
            area * (xx**2 + yy**2 + 2 * xy**2 - lam / (2 * (lam + mu)) * (xx + yy) ** 2) / (2 * mu)
        ).sum()

    for number, grids in enumerate(read_frames_with_vtk(path)):
        total = 0.0
        for side in ("lower", "upper"):
            cell_data = blocks[side].cell_data
            whole = strain_energy(cell_data["stress"][number].astype(float))
            change = grids[side].cell_data["stress"].astype(float) - cell_data["stress"][number]
            # the error of a cell is relative to both pieces, whose energies agree within a few per
            # cent
            error = 2 * whole * (cell_data["stress_error"][number].astype(float) ** 2).sum()
            assert 0 < strain_energy(change) < 0.26**2 * error
            total += error
            for (side_name, name), max_error in rounding_errors.items():
                expected = (
                    blocks[side_name].point_data
                    if name == "displacement"
                    else blocks[side_name].cell_data
                )
                read = (
                    grids[side_name].point_data
                    if name == "displacement"
                    else grids[side_name].cell_data
                )
                assert abs(read[name].astype(float) - expected[name][number]).max() <= max_error
    assert number == 8 and total > 0


@pytest.fixture
def framewise_writing(monkeypatch):
    """Write every series frame by frame, as large ones."""
    monkeypatch.setattr(vtkhdf, "MIN_FRAMEWISE_BYTES", 0)


@pytest.mark.usefixtures("framewise_writing")
def test_exact_large_series_has_rounded_frames(tmp_path):
    """A series written frame by frame contains every frame, rounded to the stated number of bits."""
    small = write_small_series(tmp_path / "out", 5)
    for number, grids in enumerate(read_frames_with_vtk(tmp_path / "out" / NAME)):
        for name, block in small.blocks.items():
            for data, written in (
                (grids[name].point_data, block.point_data),
                (grids[name].cell_data, block.cell_data),
            ):
                for array, values in written.items():
                    expected = frame_values(values, number)
                    if expected.dtype == np.float32:
                        expected = round_to_bits(
                            expected, vtkhdf.BITS.get(array, vtkhdf.OTHER_BITS)
                        )
                    assert np.array_equal(data[array], expected), array
    assert number == 4
    with Series(tmp_path / "out") as series:
        assert np.array_equal(series.times, small.times) and len(series) == 5
        bits = series.root["upper/CellData/stress"].attrs["significant_bits"]
        assert np.array_equal(
            series.frame(3).blocks["upper"].cell_data["stress"],
            round_to_bits(small.blocks["upper"].cell_data["stress"][3], bits),
        )


def test_always_killed_writer_leaves_complete_frames(tmp_path):
    """A killed writer leaves a partial file with all complete frames, and no file of the final name."""
    run_until_killed("write_small_series(Path('out'), 6)", 47, tmp_path)
    [partial] = (tmp_path / "out").iterdir()
    assert is_partial_name(partial.name)
    assert partial.name.startswith(".fields.")
    assert partial.suffix == ".vtkhdf"
    with h5py.File(partial) as file:
        count = int(file["VTKHDF/Steps"].attrs["NSteps"])
        chunked = [
            array
            for block in ("lower", "upper", "interface")
            for kind in ("PointData", "CellData")
            for array in file[f"VTKHDF/{block}/{kind}"].values()
            if array.chunks
        ]
        # the file ends with the frame before the interrupted one
        assert count == 47 // len(chunked) - 1 > 0
    whole = write_small_series(tmp_path / "whole", 6)
    for number, grids in enumerate(read_frames_with_vtk(partial)):
        expected = round_to_bits(
            whole.blocks["upper"].cell_data["von_mises"][number], vtkhdf.OTHER_BITS
        )
        assert np.array_equal(grids["upper"].cell_data["von_mises"], expected)
    assert number == count - 1


@pytest.mark.parametrize("power", [-30, -3, 0, 12])
def test_exact_rounding_to_step_is_to_nearest_multiple(power):
    """Values are rounded to the nearest multiple of a power of two; zeros, infinities and NaN are unchanged."""
    step = 2.0**power
    values = (
        np.random.default_rng(power + 30).normal(size=6000)
        * step
        * 10.0 ** np.arange(-3, 9).repeat(500)
    )
    values = values.astype(np.float32)
    rounded = round_to_step(values, step)
    multiples = rounded.astype(float) / step
    assert rounded.dtype == np.float32 and np.array_equal(multiples, np.round(multiples))
    assert (abs(rounded.astype(float) - values) <= step / 2).all() and (rounded != values).any()
    special = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 3e38], np.float32)
    assert np.array_equal(round_to_step(special, step), special, equal_nan=True)
