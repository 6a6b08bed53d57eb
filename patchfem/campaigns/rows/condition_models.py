"""Free keys of a rig, and its models under the sines at which a table of responses was measured."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...core import PatchfemError
from ...effects import find_waveform
from ...model.model import Model, build
from ...scene.assignments import Range
from ...scene.scene import Scene, SceneError, add_sets
from ..free_keys import FreeKeys

# Scene keys of instrument gains, which scale the readings but do not change the motion.
GAIN_KEYS = ("measured.acceleration_gain", "measured.displacement_gain")
# Assignment of the method that computes steady motions, for scenes that set no method
STEADY_METHOD = "accuracy.method=harmonic"


class ConditionModels(FreeKeys):
    """Free keys of a rig, and its models under the sines of the base at which the responses were measured.

    The rows were measured in steady state. If the scene does not set a method, the steady-state method 'harmonic' is
    therefore used where it supports the scene, and `notes` reports this.

    Parameters
    ----------
    scene : Scene
        Scene of a rig under sinusoidal base motion.
    conditions : (c, 2) array
        Frequency [Hz] and input [m s-2].
    ranges : sequence of Range
        Bounds of the free keys.
    measured : Path
        File of the response table.

    Raises
    ------
    SceneError, PatchfemError
        If the scene or a key cannot be fitted.
    """

    def __init__(
        self, scene: Scene, conditions: np.ndarray, ranges: Sequence[Range], measured: Path
    ):
        _require_sines_of_base(scene, ranges, measured)

        # Keys that the scene leaves out: the file of the measurements, and a steady method where the scene allows it.
        sets = []
        notes = []
        if scene.measured is None and any(bound.key.startswith("measured.") for bound in ranges):
            sets.append(f"measured.file={measured.resolve().as_posix()}")
        if scene.accuracy.method in (None, "auto"):
            try:
                add_sets(scene, [*sets, STEADY_METHOD])
            except SceneError:
                pass  # this method does not support the scene
            else:
                sets.append(STEADY_METHOD)
                notes.append(
                    "the scene does not set accuracy.method, so the steady motions are computed with the method "
                    "'harmonic'"
                )
        super().__init__(scene, ranges, sets)
        self.notes = notes

        self.model_parameters = [k for k, bound in enumerate(ranges) if bound.key not in GAIN_KEYS]
        # The rig under the drive of each measured condition.
        self.rigs = []
        for frequency, level in conditions:
            drive = [
                f"drive.frequency={float(frequency)!r} Hz",
                f"drive.acceleration={float(level)!r} m/s^2",
            ]
            self.rigs.append(build(self.base.override(drive)).rig)

    def with_condition_drive(self, model: Model, condition: int) -> Model:
        """Return the model with the drive of a measured condition."""
        drive = self.rigs[condition].drive
        rig = model.rig.with_signal(drive.signal, frequency=drive.frequency, cycles=drive.cycles)
        return replace(model, rig=rig)


def _require_sines_of_base(scene: Scene, ranges: Sequence[Range], measured: Path) -> None:
    """Raise PatchfemError unless scene and free keys fit to responses to a sine of the base.

    `ranges` are those of the free keys, and `measured` is the file of the responses.
    """
    drive = scene.drive
    location = f"{scene.path}: fit --to {measured.name}: "
    if scene.kind not in ("rig", "linear"):
        raise PatchfemError(
            f"{location}to fit a file whose rows give frequency and input, the scene must be a rig, "
            f"but this is a {scene.kind} scene; to fit a loop with a column of displacement, use a "
            "scene with [slide]"
        )
    if drive.kind != "base" or not find_waveform(drive).is_sine or drive.displacement is not None:
        raise PatchfemError(
            f"{location}each row was measured under a sine of the base with this acceleration; set drive.kind = 'base', "
            "drive.waveform = 'sine' and drive.acceleration"
        )
    for bound in ranges:
        if bound.key.startswith("drive.") or bound.key == "measured.reading_cutoff":
            raise PatchfemError(
                f"--free {bound.key}: the rows of the file give the drive; choose a key of the rig"
            )
