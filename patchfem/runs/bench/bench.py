"""Run of a law bench: friction histories, energies and measures for a prescribed displacement.

In: a model with [slide] and its Patch with the static contact solution, or None for a single point.
Out: a `BenchRun`. The pieces may be rigid or deform in shear.
"""

from dataclasses import dataclass
from time import process_time

import numpy as np

from ...core import Response, max_abs
from ...measures.loops import (
    choose_reversal_force_rule,
    find_reversals,
    measure_sampled_loop,
    sample_loop,
)
from ...measures.measures import (
    compare_loop_work,
    compute_ledger_measures,
    compute_peak,
    compute_step_harmonic,
    interpolate_range,
)
from ...motion_measures import energy_balance
from ..results.patch_rows import Values
from .engine import Numerics, make_bench_numerics, sample_path
from .slides import SlideHistories, SlideTask, follow_path


@dataclass(frozen=True, eq=False, kw_only=True)
class BenchRun(SlideHistories):
    """Histories, fields and measures of an interface under a prescribed displacement, at k samples.

    - time, slide, rate (k,): time [s], relative displacement [m] and velocity [m/s].
    - frames (f,): indices of the samples at which fields are stored.
    - values: measures by name.
    - seconds: CPU time [s].
    - first: index of the sample at which the last cycle starts.
    - numerics: settings of the run.
    """

    time: np.ndarray
    slide: np.ndarray
    rate: np.ndarray
    frames: np.ndarray
    values: Values
    seconds: float
    first: int
    numerics: Numerics

    @property
    def last_cycle(self) -> Response:
        """Histories of the last cycle as those of a rig without modes, whose output is the upper holder.

        Further histories are the ledger and the normal load.
        """
        rows = slice(self.first, None)
        slide = self.slide[rows]
        rate = self.rate[rows]
        still = np.zeros(slide.size)
        return Response(
            time=self.time[rows],
            modal=np.zeros((slide.size, 0)),
            modal_rate=np.zeros((slide.size, 0)),
            slide=slide,
            slide_rate=rate,
            output=slide,
            output_rate=rate,
            acceleration=still,
            base_acceleration=still,
            force=self.force[rows],
            slip=self.slip[rows],
            extra={"ledger": self.ledger[:, rows], "normal_load": self.load[rows]},
        )


def run_bench(model, patch, steps: int, n_frames: int = 0, choice=None, **options) -> BenchRun:
    """Compute the friction response of a model to its prescribed displacement with a number of steps.

    Parameters
    ----------
    model : Model
        Model of a bench, with `slide`.
    patch : Patch or None
        None for a single point ([normal]).
    steps : int
        Steps per cycle.
    n_frames : int
        Number of output frames of the fields.
    choice : EngineChoice, optional
        Method of a sum over lists of bonds; default: by the tolerance.
    **options
        Path and callbacks of `follow_slide`.
    """
    numerics = make_bench_numerics(model, steps, options.get("path"))
    own = numerics.space.choice
    numerics = numerics.vary_space(choice=own and (choice or own))
    return follow_slide(model, numerics, patch, n_frames, **options)


def follow_slide(
    model, numerics: Numerics, patch, n_frames: int = 0, path=None, **callbacks
) -> BenchRun:
    """Compute the friction response of a model to a prescribed displacement.

    Parameters
    ----------
    model : Model
        Model of a bench.
    numerics : Numerics
        Steps per cycle, and methods of bond summation and of shear.
    patch : Patch or None
        None for a single point.
    n_frames : int
        Number of output frames of the fields; the initial state is not one of them.
    path : SlideSamples, optional
        Displacement path; default: the path of the model.
    **callbacks
        Fields `say` and `progress` of SlideTask.

    Raises
    ------
    NotConverged
        If the force of a step has too large an error.
    """
    begin = process_time()
    time, slide, first, omega = sample_path(model, numerics.steps, path)
    frames = np.linspace(0, slide.size - 1, n_frames + 1).round().astype(int)[1:]
    frames = np.unique(frames[frames > 0])
    histories = follow_path(SlideTask(model, patch, numerics, time, slide, frames, **callbacks))

    # The measures of a loop exist only for a cyclic motion.
    values = _compute_measures(model, histories, first)
    if omega:
        values |= _compute_loop_measures(model, time, slide, histories, first, omega)
    jumps = choose_reversal_force_rule(model) == "jumps"
    values["work_check"] = compare_loop_work(histories.ledger[0], [(slide, histories.force)], jumps)

    span = time[-1]  # Scaling by the time span avoids overflow for extremely slow motions.
    rate = np.zeros(time.size)
    if time.size > 2:
        rate = np.gradient(slide, time / span) / span
    return BenchRun(
        time=time,
        slide=slide,
        rate=rate,
        frames=frames,
        values=values,
        seconds=process_time() - begin,
        first=first,
        numerics=numerics,
        **vars(histories),
    )


def _compute_measures(model, histories: SlideHistories, cycle_start: int) -> Values:
    """Compute all measures of a bench run except those of the friction loop, by name.

    Parameters
    ----------
    model : Model
        Model of the bench.
    histories : SlideHistories
        Friction force, load, slip and energies at all samples.
    cycle_start : int
        Index of the first sample of the last cycle.
    """
    force = histories.force
    load = histories.load

    # The friction ratio refers to the applied load, because friction vanishes where the upper piece
    # leaves the pressed area.
    applied = load if model.load_varies else np.full_like(load, load[0])
    is_loaded = applied > 1e-3 * applied.max(initial=0.0)
    ratio = np.divide(force, applied, out=np.zeros_like(force), where=is_loaded)

    # A force that depends on the slide alone is largest at a reversal, which is a sample.
    is_sampled = model.grooves is None and choose_reversal_force_rule(model) == "slide"

    def find_peak(values) -> float:
        """Return the largest magnitude of a history (k,)."""
        return max_abs(values) if is_sampled else compute_peak(values)

    # Energy balance: work - change of stored energy - dissipated + created = 0.
    work, stored, dissipated, created = histories.ledger
    energies = {
        "work_in": work[-1],
        "stored": stored[-1] - stored[0],
        "friction": dissipated[-1] - created[-1],
        "viscous": 0.0,
        "power": np.abs(np.diff(work)).sum(),
        "peak_stored": np.abs(stored).max(),
    }
    # The slip is that of the last cycle. All other measures are those of the whole run.
    return {
        "normal_load": float(model.point.load if model.load_varies else load[0]),
        "friction_force_peak": find_peak(force),
        "friction_ratio_end": float(ratio[-1]),
        "friction_ratio_peak": find_peak(ratio),
        "slip_amplitude": interpolate_range(histories.slip[cycle_start:])[0] / 2,
        "energy_balance": float(energy_balance(energies)),
        **compute_ledger_measures(histories.ledger),
    }


def _compute_loop_measures(
    model, time, slide, histories: SlideHistories, cycle_start: int, omega: float
) -> Values:
    """Compute the measures of the friction loop in the last cycle.

    Parameters
    ----------
    model : Model
        Model of the bench.
    time, slide : (k,) array
        Times [s] and relative displacements [m] of all samples.
    histories : SlideHistories
        Friction force and energies at the samples.
    cycle_start : int
        Index of the sample at which the last cycle starts.
    omega : float
        Circular frequency of the cycle [rad/s].
    """
    time = time[cycle_start:]
    slide = slide[cycle_start:]
    force = histories.force[cycle_start:]
    work = histories.ledger[0, cycle_start:]

    # The work of a step defines its mean force, dW/du; a step at rest has the mean of its ends.
    moves = np.diff(slide)
    mean_force = (force[1:] + force[:-1]) / 2
    means = np.divide(np.diff(work), moves, out=mean_force, where=moves != 0)

    rule = choose_reversal_force_rule(model)
    still = np.zeros(time.size)
    reversals = find_reversals(time, slide, still, force, time[-1] - time[0], rule)

    # Without a mode there is no stiffness that damping could refer to, hence the 0.
    harmonic = compute_step_harmonic(time, means, omega)
    loop = sample_loop(time, slide, harmonic, omega, work[-1] - work[0])
    measures = measure_sampled_loop(reversals, loop, 0.0)
    return measures | {"drift_per_cycle": float(slide[-1] - slide[0])}
