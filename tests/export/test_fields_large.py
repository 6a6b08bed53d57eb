"""A large series of fields: packed and rounded as it says, written frame after frame, whole up to a kill."""

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
from exported import UNITS, at, waves, write_small
from scene_texts import COATED
from vtkmodules.vtkIOHDF import vtkHDFReader

import patchfem
from patchfem.disk import is_partial_name
from patchfem.elasticity import get_cells, lame, make_points
from patchfem.export.fields import bodies, vtkhdf
from patchfem.export.fields.series import Series
from patchfem.export.fields.vtkhdf import NAME, round_to_bits, round_to_step
from patchfem.export.fields.vtu import export_fields

KILLED = """\
import os, sys
from pathlib import Path
from patchfem.export.fields import vtkhdf
sys.path[:0] = {paths!r}
from exported import write_small, write_waves
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


def killed(write: str, calls: int, folder) -> None:
    """Write a series in a process that is killed after so many arrays of frames."""
    paths = [path for path in sys.path if "tests" in path]
    done = subprocess.run(
        [sys.executable, "-c", KILLED.format(paths=paths, calls=calls, write=write)],
        cwd=folder,
        check=False,
    )
    assert done.returncode == -signal.SIGKILL


def by_vtk(path):
    """The grids of every block in every frame that VTK finds in a file."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for number in range(reader.GetNumberOfSteps()):
        reader.SetStep(number)
        reader.Update()
        yield pyvista.wrap(reader.GetOutputDataObject(0)).copy()


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory):
    """A tilted pair of some 21 000 cells under a shear that reverses: the run, the blocks of its fields, their packed
    file, and the seconds of a CPU that both took beside those of zlib alone with the stress as it came, least of
    three."""
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
            whole = SimpleNamespace(patch=pressed.patch, plan=pressed.plan, fields=fields, extra={})
            bodies.write_fields(whole, folder / NAME)
            seconds.append([process_time() - begin])
            begin = process_time()
            for side in ("lower", "upper"):
                zlib.compress(kept["blocks"][side].cell_data["stress"].tobytes(), 1)
            seconds[-1].append(process_time() - begin)
    return pressed, kept["blocks"], folder / NAME, np.min(seconds, axis=0)


@pytest.mark.slow
def test_always_packing_errs_as_little_as_it_says_and_less_than_the_elements(rubbing):
    """In energy norm rounding changes the stress by at most a quarter of its estimated error, in every frame."""
    result, blocks, path, _ = rubbing
    piece = result.patch.pair.piece
    cells = get_cells(piece)
    area = np.concatenate([rule.weight.sum(axis=0) for rule in make_points(cells, "gauss")])
    lam, mu = np.array(
        [lame(*one, "strain") for one in (piece.layers.substrate, piece.layers.coating)]
    )[cells.is_coating.astype(int)].T
    with h5py.File(path) as file:
        said = {
            (side, name): array.attrs["rounding_error"]
            for side in ("lower", "upper")
            for kind in ("PointData", "CellData")
            for name, array in file[f"VTKHDF/{side}/{kind}"].items()
            if "rounding_error" in array.attrs
        }
    assert {name for _, name in said} == {"displacement", "stress", "von_mises"}

    def energy(stress):
        xx = stress[:, 0]
        yy = stress[:, 1]
        xy = stress[:, 3]
        return (
            area * (xx**2 + yy**2 + 2 * xy**2 - lam / (2 * (lam + mu)) * (xx + yy) ** 2) / (2 * mu)
        ).sum()

    for number, grids in enumerate(by_vtk(path)):
        total = 0.0
        for side in ("lower", "upper"):
            given = blocks[side].cell_data
            whole = energy(given["stress"][number].astype(float))
            change = grids[side].cell_data["stress"].astype(float) - given["stress"][number]
            # the share of a cell is that of the error of both pieces, whose energies are alike to a few percent
            error = 2 * whole * (given["stress_error"][number].astype(float) ** 2).sum()
            assert 0 < energy(change) < 0.26**2 * error
            total += error
            for (where, name), most in said.items():
                theirs = (
                    blocks[where].point_data if name == "displacement" else blocks[where].cell_data
                )
                read = grids[where].point_data if name == "displacement" else grids[where].cell_data
                assert abs(read[name].astype(float) - theirs[name][number]).max() <= most
    assert number == 8 and total > 0


@pytest.fixture
def always_large(monkeypatch):
    """Every series is written as a large one."""
    monkeypatch.setattr(vtkhdf, "MIN_FRAMEWISE_BYTES", 0)


@pytest.mark.usefixtures("always_large")
def test_exact_a_large_series_holds_every_frame_rounded_as_it_says(tmp_path):
    given = write_small(tmp_path / "out", 5)
    for number, grids in enumerate(by_vtk(tmp_path / "out" / NAME)):
        for name, block in given.blocks.items():
            for data, theirs in (
                (grids[name].point_data, block.point_data),
                (grids[name].cell_data, block.cell_data),
            ):
                for array, values in theirs.items():
                    wanted = at(values, number)
                    if wanted.dtype == np.float32:
                        wanted = round_to_bits(wanted, vtkhdf.BITS.get(array, vtkhdf.MOST_BITS))
                    assert np.array_equal(data[array], wanted), array
    assert number == 4
    with Series(tmp_path / "out") as series:
        assert np.array_equal(series.times, given.times) and len(series) == 5
        bits = series.root["upper/CellData/stress"].attrs["significant_bits"]
        assert np.array_equal(
            series.frame(3).blocks["upper"].cell_data["stress"],
            round_to_bits(given.blocks["upper"].cell_data["stress"][3], bits),
        )


def test_always_a_killed_writer_leaves_its_whole_frames_and_no_file_of_the_name(tmp_path):
    killed("write_small(Path('out'), 6)", 47, tmp_path)
    [left] = (tmp_path / "out").iterdir()
    assert is_partial_name(left.name)
    assert left.name.startswith(".fields.")
    assert left.suffix == ".vtkhdf"
    with h5py.File(left) as file:
        count = int(file["VTKHDF/Steps"].attrs["NSteps"])
        packed = [
            one
            for block in ("lower", "upper", "interface")
            for kind in ("PointData", "CellData")
            for one in file[f"VTKHDF/{block}/{kind}"].values()
            if one.chunks
        ]
        # the frame before the one that was cut off stands behind them
        assert count == 47 // len(packed) - 1 > 0
    given = write_small(tmp_path / "whole", 6)
    for number, grids in enumerate(by_vtk(left)):
        wanted = round_to_bits(
            given.blocks["upper"].cell_data["von_mises"][number], vtkhdf.MOST_BITS
        )
        assert np.array_equal(grids["upper"].cell_data["von_mises"], wanted)
    assert number == count - 1


@pytest.mark.usefixtures("always_large")
def test_always_an_exported_series_is_about_as_small_as_the_fields(tmp_path):
    """zlib and a mesh in every frame made it 2.4 times as large; every number is that of the fields."""
    piece = waves(12, 90, 60)
    line = waves(12, 90, 1)
    piece.cell_data["material"] = np.zeros((1, 90 * 60), np.int8)
    line.point_data.update(
        dict.fromkeys(("gap", "normal_stress"), np.zeros((1, len(line.points)), np.float32))
    )
    blocks = {"lower": piece, "upper": piece, "interface": line}
    steps = {"stress": 4096.0, "von_mises": 5000.0, "displacement": 2e-10}
    vtkhdf.write_series(
        tmp_path / NAME, blocks, np.arange(12) * 1e-4, UNITS, dict.fromkeys(blocks, steps)
    )
    export_fields(tmp_path, tmp_path / "out.pvd")
    size = sum(one.stat().st_size for one in (tmp_path / "out_frames").iterdir())
    assert size < 1.15 * (tmp_path / NAME).stat().st_size, (size, (tmp_path / NAME).stat().st_size)
    with Series(tmp_path) as series:
        frame = series.frame(7)
    mesh = pyvista.read(tmp_path / "out_frames" / "frame_0007_lower.vtu")
    for name in ("stress", "von_mises"):
        assert np.array_equal(mesh.cell_data[name], frame.blocks["lower"].cell_data[name])
    assert np.array_equal(
        mesh.point_data["displacement"], frame.blocks["lower"].point_data["displacement"]
    )


@pytest.mark.parametrize("power", [-30, -3, 0, 12])
def test_exact_rounding_to_a_step_is_to_the_nearest_multiple(power):
    step = 2.0**power
    values = (
        np.random.default_rng(power + 30).normal(size=6000)
        * step
        * 10.0 ** np.arange(-3, 9).repeat(500)
    )
    values = values.astype(np.float32)
    found = round_to_step(values, step)
    whole = found.astype(float) / step
    assert found.dtype == np.float32 and np.array_equal(whole, np.round(whole))
    assert (abs(found.astype(float) - values) <= step / 2).all() and (found != values).any()
    odd = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 3e38], np.float32)
    assert np.array_equal(round_to_step(odd, step), odd, equal_nan=True)
