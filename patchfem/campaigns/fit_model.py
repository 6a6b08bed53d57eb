"""The bench along a measured motion as a function of some values of its scene."""

from itertools import product

import numpy as np

from ..core import Outcome, PatchfemError
from ..effects import has
from ..inputs.loops import Loop
from ..model.gap import shape_side
from ..model.model import Model, build
from ..model.source import placed
from ..runs.bench import bench as law_bench
from ..runs.bench.engine import smooth_sum_of
from ..runs.bench.ledger import Watch
from ..runs.many import meshes
from ..runs.patch import ladder
from ..scene.changed import Base
from ..scene.scene import Scene, SceneError
from .fit_path import lead_in, whole_cycles

MOST_MOVED = 3  # keys of [contact] whose ends the shared meshes are chosen by


class BenchModel:
    """The bench of a scene along the measured rows, as a function of the free values; a call gives the reading (k,).

    scene: with its [slide]; loop: the measured one; wanted: ranges of the free values; offsets: Offsets, whose values
    come after those; warm: whether the whole cycles of the record are driven once before it; say: function for a line
    of progress, or None.
    """

    def __init__(self, scene: Scene, loop: Loop, wanted: list, offsets=(), warm: bool = False, say=None):
        self.scene, self.loop, self.wanted, self.say = scene, loop, wanted, say
        self.base = Base(scene)  # its text is read once, not at every value
        self.offsets, self.warm = tuple(one.what for one in offsets), whole_cycles(loop) if warm else 0
        self.notes, self.sets, law = [], [], scene.friction
        self.time = self._paced()
        named = {one.key for one in wanted}
        if has(law.law, "bonds") and law.rest_growth is not None and law.rest_speed is None \
                and "friction.rest_speed" not in named:
            speed = 1e-3 * float(np.abs(np.diff(loop.displacement) / np.diff(self.time)).max())
            self.sets.append(f"friction.rest_speed={speed!r} m/s")
        self._note_amplitude()
        self.instant = has(law.law, "creeps") or (has(law.law, "set-valued") and not has(law.law, "averaged"))
        soft = scene.contact is not None and scene.contact.gives_way
        bonds = has(law.law, "bonds")
        steady = not bonds or (law.rest_growth is None and (law.reading == "report" or law.order == 1))
        self.exact = steady and not (soft and bonds) and not self._on_lower()
        steps, legs = scene.accuracy.steps_per_cycle, loop.reading.size - 1
        self.pinned = steps is not None
        self.pieces = max(1, -(-steps // legs)) if self.pinned and not self.exact else 1
        self.refused, self.made = None, 0
        self.patch, self.moving = None, any(key.startswith("contact.") for key in named)
        self.meshes = None  # those that all values of the ranges share, made when a patch is first asked for

    def __call__(self, values) -> np.ndarray:
        """Reading (k,) at the rows; PatchfemError where the values make no scene."""
        count = len(self.wanted)
        beside = dict(zip(self.offsets, values[count:]))
        model = self._model(self.scene_at(values[:count]))
        self.made += 1
        with placed(model.source):
            return self._reading(model, beside.get("displacement", 0.0)) + beside.get("force", 0.0)

    def _model(self, scene: Scene) -> Model:
        try:
            with placed(scene):
                return build(scene)
        except PatchfemError as error:  # a file of the scene is read here; no other value of the free keys mends it
            self.refused = self.refused or error
            raise

    def _reading(self, model: Model, offset: float) -> np.ndarray:
        patch = self._patch(model)
        time, slide, before = lead_in(self.time, self.loop.displacement, self.warm, offset)
        corner = np.arange(time.size) * self.pieces
        number = np.arange(corner[-1] + 1)
        path = np.interp(number, corner, time), np.interp(number, corner, slide), 0, 0.0
        run = law_bench.run(model, patch, 4, 0, path, Watch(smooth_sum_of(model, path[1]), self.say))
        if not run.load[0] > 0:
            raise PatchfemError("the normal load is 0 or less; give a load that presses the pieces together", "")
        out = run.force[corner]
        if self.instant:  # a row stands between two straight legs: the mean of both sides
            after = run.force[np.minimum(corner + 1, number[-1])]
            out = np.where(corner == 0, after, (out + after) / 2)
        out = out[before:]
        return out / run.load[0] if self.loop.quantity == "friction_ratio" else out

    def scene_at(self, values) -> Scene:
        """The scene with these free values."""
        sets = [*self.sets, *(one.assigned(value) for one, value in zip(self.wanted, values))]
        try:
            return self.base.changed(sets)
        except SceneError as error:
            self.refused = self.refused or error
            raise PatchfemError(error.mistakes[0]) from None

    def _patch(self, model: Model):
        if model.patch is None:
            return None
        if self.patch is None or self.moving:
            model = self._shared().given(model) if self.moving else model
            self.patch = ladder.solve_all(model.patch, model.accuracy.tolerance, False)[0]
            if self.patch.pressure.outcome is Outcome.NO_CONTACT:
                raise PatchfemError(self.patch.pressure.outcome.sentence, "")
        return self.patch

    def _shared(self):
        """The meshes of the ends and the middle of every range of a key of [contact], the others in their middle."""
        if self.meshes is None:
            middle = [(one.low + one.high) / 2 for one in self.wanted]
            moved = [k for k, one in enumerate(self.wanted) if one.key.startswith("contact.")]
            ends = product(*((self.wanted[k].low, middle[k], self.wanted[k].high) for k in moved[:MOST_MOVED]))
            models, refused = [], self.refused
            for values in ends:
                at = list(middle)
                for k, value in zip(moved, values):
                    at[k] = value
                try:
                    models.append(build(self.scene_at(at)))
                except PatchfemError:  # the descent will be told
                    continue
            self.meshes, self.refused = meshes.Shared(models, False), refused
        return self.meshes

    def _on_lower(self) -> bool:
        if self.scene.contact is None:
            return False

        return shape_side(self.scene.contact) == "lower"

    def _paced(self) -> np.ndarray:
        """Time of the rows: measured, or from the speed of the slide, or even where time does not matter."""
        loop, scene = self.loop, self.scene
        if loop.time is not None:
            return loop.time
        law, slide = scene.friction, scene.slide
        aged = not has(law.law, "timeless") and not (has(law.law, "bonds") and law.rest_growth is None)
        if not aged and not (scene.normal is not None and scene.normal.amplitude):
            self.notes.append(f"{loop.path} has no column of time: its rows are taken as evenly spaced in time, which "
                              f"does not affect the force of law '{law.law}'")
            return np.arange(float(loop.reading.size))
        move = np.abs(np.diff(loop.displacement))
        if slide.kind in ("constant", "triangle") and move.all():
            self.notes.append(f"{loop.path} has no column of time: the times of its rows are computed from slide.speed")
            return np.concatenate([[0.0], np.cumsum(move / slide.speed)])
        raise PatchfemError(f"{loop.path}:1: law '{law.law}' needs the times of the rows of this record; add a column "
                            "time [s] (the times can be computed from slide.speed only for a constant or triangle "
                            "slide without rests)")

    def _note_amplitude(self) -> None:
        slide, half = self.scene.slide, float(np.ptp(self.loop.displacement)) / 2
        if slide.kind in ("sine", "triangle") and abs(slide.amplitude - half) > 0.02 * half:
            self.notes.append(f"slide.amplitude is {slide.amplitude:.4g} m, but the amplitude of the measured "
                              f"displacement is {half:.4g} m; the model follows the measured displacement")
