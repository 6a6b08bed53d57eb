"""Rig models at the measured conditions, for given values of the free parameters."""

from dataclasses import replace

from ...core import PatchfemError, SineDrive
from ...effects import find_waveform
from ...model.model import Model, build
from ...scene.overrides import BaseScene
from ...scene.scene import Scene, SceneError, add_sets, loads
from ..fits.problem import build_changed_model

# Scene keys of instrument gains, which scale the readings but do not change the motion.
GAIN_KEYS = ("measured.acceleration_gain", "measured.displacement_gain")


class FitRequest:
    """Request for a fit of a rig: scene, ranges of its free parameters, and measured data file."""

    def __init__(self, scene: Scene, ranges, measured):
        self.scene = scene
        self.ranges = ranges
        self.measured = measured

    def make_condition_models(self, conditions, *sets: str) -> "ConditionModels":
        """Return the rig models at conditions (c, 2), with additional --set strings."""
        scene = self.scene
        if sets:
            scene = add_sets(scene, sets)
        return ConditionModels(scene, conditions, self.ranges, self.measured)


class ConditionModels:
    """Rig models under sinusoidal base motion at the measured conditions.

    The rows were measured in steady state. If the scene does not set a method, the steady-state
    method 'harmonic' is therefore used where it supports the scene, and `notes` reports this.

    Parameters
    ----------
    scene : Scene
    conditions : (c, 2) array
        Frequency [Hz] and input [m s-2].
    ranges : list of Range
        Bounds of the free parameters.
    measured : Path
        File of the response table.

    Raises
    ------
    SceneError, PatchfemError
        If the scene or a parameter cannot be fitted.
    """

    def __init__(self, scene: Scene, conditions, ranges, measured):
        self.scene = scene
        self.ranges = ranges
        self.notes = []
        self.sets = []
        self._check_scene_and_ranges(measured)
        if scene.measured is None and any(bound.key.startswith("measured.") for bound in ranges):
            self.sets.append(f"measured.file={measured.resolve().as_posix()}")
        if scene.accuracy.method in (None, "auto"):
            self._choose_steady_state_method()
        start = add_sets(scene, self.sets)
        self.base = BaseScene(start)
        self.instrument = start.measured
        self.model_parameters = [k for k, bound in enumerate(ranges) if bound.key not in GAIN_KEYS]
        self.rigs = []
        for condition in conditions:
            self.rigs.append(
                build(self.base.override(format_condition_assignments(*condition))).rig
            )

    def _check_scene_and_ranges(self, measured) -> None:
        """Raise PatchfemError if the scene or a free parameter cannot be fitted to a response table."""
        scene = self.scene
        drive = scene.drive
        location = f"{scene.path}: fit --to {measured.name}: "
        if scene.kind not in ("rig", "linear"):
            raise PatchfemError(
                f"{location}to fit a file whose rows give frequency and input, the scene must be a rig, "
                f"but this is a {scene.kind} scene; to fit a loop with a column of displacement, use a "
                "scene with [slide]"
            )
        if drive.kind != "base" or not find_waveform(drive).is_sine:
            raise PatchfemError(
                f"{location}each row was measured under a sine of the base; set drive.kind = 'base' and "
                "drive.waveform = 'sine'"
            )
        if drive.displacement is not None:
            raise PatchfemError(
                f"{location}the rows give the input as an acceleration; replace drive.displacement by "
                "drive.acceleration"
            )
        if scene.wear is not None:
            raise PatchfemError(f"{location}[wear] cannot be fitted; leave [wear] out")
        for bound in self.ranges:
            if bound.key.startswith("drive.") or bound.key == "measured.reading_cutoff":
                raise PatchfemError(
                    f"--free {bound.key}: the rows of the file give the drive; choose a key of the rig"
                )

    def _choose_steady_state_method(self) -> None:
        """Select the method 'harmonic' if it supports the scene."""
        steady = "accuracy.method=harmonic"
        try:
            loads(self.scene.text, self.scene.path, [*self.scene.sets, *self.sets, steady])
        except SceneError:
            return
        self.sets.append(steady)
        self.notes.append(
            "the scene does not set accuracy.method, so the steady motions are computed with the method "
            "'harmonic'"
        )

    def build_model(self, values) -> Model:
        """Build the rig model for values (n,) of the free parameters, with the drive of the scene."""
        sets = [self.ranges[k].format_assignment(values[k]) for k in self.model_parameters]
        return build_changed_model(self.base, sets)

    def with_condition_drive(self, model: Model, condition: int) -> Model:
        """Return the model with the drive of a measured condition."""
        drive = self.rigs[condition].drive
        rig = model.rig.with_signal(drive.signal, frequency=drive.frequency, cycles=drive.cycles)
        return replace(model, rig=rig)

    def sine_drive(self, condition: int) -> SineDrive:
        """Return the sinusoidal drive of a measured condition."""
        return self.rigs[condition].drive.signal

    @property
    def changes_contact(self) -> bool:
        """Whether a free parameter changes the static contact solution."""
        return any(bound.key.startswith("contact.") for bound in self.ranges)


def format_condition_assignments(frequency: float, level: float) -> list:
    """Return the --set strings of a condition with a frequency [Hz] and a base acceleration [m s-2].

    frequency [Hz], level: input [m s-2].
    """
    return [
        f"drive.frequency={float(frequency)!r} Hz",
        f"drive.acceleration={float(level)!r} m/s^2",
    ]
