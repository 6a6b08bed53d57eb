"""State of a march, and its integration over one or several drive cycles at a time."""

from collections import deque
from copy import copy
from dataclasses import replace
from enum import IntEnum

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...core import ModalBasis, Outcome, Response, SineDrive
from ...formatting import format_length
from ...friction.bonds.list_rows_kernels import STATUS
from ...friction.path_work import sampled_work
from ..checkpoint import MarchedCycle
from ..integrated import make_histories
from ..interfaces import arrays
from ..interfaces.arrays import ModalArrays
from ..ledger import N_SAMPLE_COLUMNS, Ledger, SampleColumn
from ..periodicity import (
    FIRST_CHECK,
    bound_remaining_change,
    cycles_to_next_check,
    is_check_cycle,
)
from ..propagator import make_propagator
from .capacity import copy_state, enlarge_list
from .element_arrays import (
    N_ELEMENT_COLUMNS,
    N_LOAD_COLUMNS,
    LoadColumn,
    MarchArrays,
)
from .faces import STEP_TOL, make_element_arrays
from .models import frictionless_model
from .recording import FIRST_SUM, N_SUMS, Mark, make_mark, read_output_extremes

# Displacement relative to the travel above which the motion has diverged within a step.
DIVERGENCE_RATIO = 10.0
# Largest number of steps that are integrated at once, which limits the memory for samples.
MAX_STEPS_AT_ONCE = 8000
MAX_CYCLES_AT_ONCE = 16  # largest number of cycles that are integrated at once
PERIODIC_TOL = 1e-12  # largest relative change of a periodic motion in all remaining cycles
# Ledger positions of the sums that increase from cycle to cycle.
SUM_POSITIONS = [
    Ledger.DRIVE_WORK,
    Ledger.VISCOUS_LOSS,
    Ledger.DRIVE_POWER,
    Ledger.FRICTION_LOSS,
    Ledger.N_ITERATIONS,
    Ledger.N_UNCONVERGED,
    Ledger.FRICTION_WORK,
]


class MarchStatus(IntEnum):
    """Status code of a march that its compiled loop returns.

    - FINISHED: all steps are done, or the motion ended otherwise
    - EXCEEDS_TRAVEL: the output exceeds the travel
    - MEMORY_FULL: a list of bonds is full
    - NOT_FINITE: the motion is not finite
    - NO_CONTACT_SET: no contact set fits the motion
    - LEAVES_GROOVES: the flanks lose contact
    """

    FINISHED = 0
    EXCEEDS_TRAVEL = 1
    MEMORY_FULL = 2
    NOT_FINITE = 3
    NO_CONTACT_SET = 4
    LEAVES_GROOVES = 5


def _make_response(rows, number, dt, modes, drive) -> Response:
    """Return the time histories of march samples.

    Parameters
    ----------
    rows : (k, w) array
        Sample rows of the march.
    number : (k,) array
        Step numbers of the samples.
    dt : float
        Length of the step [s].
    modes : ModalBasis
    drive
        Drive signal, which gives the acceleration of the base [m s-2] at any time.
    """
    n = modes.omega.size
    first_sum = 2 * n + FIRST_SUM
    # These columns hold friction work, stored, dissipated and created energy.
    ledger_columns = [first_sum, 2 * n + SampleColumn.ENERGY, first_sum + 1, first_sum + 2]
    return make_histories(
        modes,
        drive,
        number * dt,
        (rows[:, :n], rows[:, n : 2 * n]),
        rows[:, 2 * n : 2 * n + SampleColumn.MEAN_FORCE].T,
        {"ledger": rows[:, ledger_columns].T},
    )


def make_modal_arrays(modes: ModalBasis, prop) -> ModalArrays:
    """Return the modal arrays for the compiled loops (`ModalArrays`)."""
    damping = np.zeros((0, 0)) if modes.damping is None else modes.damping
    arrays_of_modes = (
        modes.omega,
        2 * modes.zeta * modes.omega,
        modes.slide,
        modes.base,
        modes.output,
        damping,
        prop.free,
        prop.force_response,
        prop.dense,
        prop.slide_response,
        prop.loss,
        prop.dense_loss,
    )
    return ModalArrays(
        *(np.array(array, float, order="C") for array in arrays_of_modes),
        dt=float(prop.dt),
        beta=float(prop.beta[0, 0]),
        mass=float(modes.mass),
        workspace=np.zeros((3, modes.omega.size)),
    )


class Run:
    """Time integration of a modal basis with a contact model.

    - `state` (2, n): modal coordinates and rates.
    - `contact`, `faces`, `load`: arrays of the contact, the elements and the load, in `interfaces.arrays`.
    - `ledger` (9,): energy balance of `loop_kernels.march`.
    - `totals` (3,): friction work, dissipated and created energy since the start [J].
    - `work_sums` (2,): friction work from the samples, and sum of the absolute friction works of the steps [J].
    - `done`: number of completed steps.
    - `outcome`, `message`: how the march ended; None and "" while it continues.
    """

    def __init__(self, modes, drive, model, steps_per_cycle, travel, loops, start=None):
        self.modes = modes
        self.drive = drive
        self.model = model
        self.travel = travel
        self.loops = loops
        self.prop = make_propagator(modes, drive, steps_per_cycle, getattr(model, "rows", None))
        self.contact = model.allocate_contact()
        self.state = np.zeros((2, modes.omega.size))
        if start is not None:
            self.state[:] = start.z, start.v
        self.ledger = np.zeros(len(Ledger))
        self.done = 0
        self.outcome = None
        self.message = ""
        self.totals = np.zeros(N_SUMS)
        # These are the friction work from the samples, and the sum of the absolute
        # friction works of the steps [J].
        self.work_sums = np.zeros(2)
        # The energy stored at the start counts as work input.
        self.ledger[Ledger.DRIVE_WORK] = self.find_modal_energy()
        self.modal_system = make_modal_arrays(modes, self.prop)
        self.faces = make_element_arrays(model, self.prop, self.modal_system, modes.mass)
        self.load = self._make_initial_load()
        self.width = 2 * modes.omega.size + N_SAMPLE_COLUMNS
        self.width += N_ELEMENT_COLUMNS * len(model.joints)
        if model.loading:
            self.width += N_LOAD_COLUMNS
        if model.joints or model.loading:
            self.ledger[Ledger.DRIVE_WORK] += self.find_interface_energy()
        self.periodic = (
            self.prop.tables(drive, 0, steps_per_cycle) if isinstance(drive, SineDrive) else None
        )
        # `is_periodic` compares the state with those at the last check and one cycle ago. The third
        # row holds their sizes, and `last_sums` holds the energy sums one cycle ago.
        self.checked_states = np.zeros((3, sum(map(len, self._carried_state()))))
        self.last_sums = np.zeros(14)
        self.change = np.inf

    def fork(self, drive):
        """Return an independent copy of the march that continues with another drive signal."""
        copied_run = copy(self)
        copied_run.drive = drive
        copied_run.periodic = None
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                setattr(copied_run, name, value.copy())
        copied_run.contact, copied_run.faces, copied_run.load = map(
            arrays.copy_arrays, (self.contact, self.faces, self.load)
        )
        return copied_run

    def _carried_state(self) -> list:
        """Return the state at the end of a step as rows, each with numbers of comparable magnitude.

        The first row has the coordinates and the rates divided by the drive frequency, the others the
        memories of the laws. The list is empty if the state cannot become periodic.
        """
        model = self.model
        element = getattr(model, "element", None) or frictionless_model().element
        memories = arrays.split_memory(self.contact, element)
        if self.periodic is None or memories is None or getattr(model, "load", None) is not None:
            return []
        rows = [np.append(self.state[0], self.state[1] / self.drive.omega), *memories]
        for k, joint in enumerate(model.joints):
            memory = self.faces.mem[k, : joint.element.memory.size]
            rows += arrays.split_element_memory(joint.element, memory)
        return rows

    def _collect_sums(self) -> np.ndarray:
        """Return all energy sums of the march, (14,): ledger, totals and `work_sums`."""
        return np.concatenate([self.ledger, self.totals, self.work_sums])

    def is_periodic(self, n_left: int) -> bool:
        """Return whether the motion has become periodic and the remaining cycles may be skipped.

        n_left: number of remaining cycles. Call this at the end of every cycle, or at the cycles given by
        `dynamics.periodicity.cycles_to_next_check`.
        """
        n_cycles = self.done // self.prop.steps
        size = self.checked_states.shape[1]
        if (
            not size
            or self.periodic is None
            or not (is_check_cycle(n_cycles) or is_check_cycle(n_cycles + 1))
        ):
            return False
        rows = self._carried_state()
        state = np.concatenate(rows)
        if not is_check_cycle(n_cycles):
            self.checked_states[1] = state
            self.last_sums = self._collect_sums()
            return False
        sizes = np.repeat([np.abs(row).max(initial=0.0) for row in rows], [*map(len, rows)])
        self.checked_states[2] = np.maximum(self.checked_states[2], sizes)
        scale = np.where(self.checked_states[2] > 0, self.checked_states[2], 1.0)
        change = float(np.max(np.abs(state - self.checked_states[0]) / scale))
        last_change = float(np.max(np.abs(state - self.checked_states[1]) / scale))
        previous_change = self.change
        self.change = change
        self.checked_states[0] = state
        # The changes over two intervals between checks must be known.
        has_two_intervals = n_left > 0 and n_cycles >= 4 * FIRST_CHECK
        return (
            has_two_intervals
            and max(change, last_change) <= PERIODIC_TOL
            and bound_remaining_change(change, previous_change, n_left, n_cycles) <= PERIODIC_TOL
        )

    def skip_cycles(self, count: int) -> None:
        """Skip cycles that equal the last one; to be called directly after `is_periodic`."""
        increase = count * (self._collect_sums() - self.last_sums)
        self.ledger[SUM_POSITIONS] += increase[SUM_POSITIONS]
        self.totals += increase[9:12]
        self.work_sums += increase[12:]
        self.done += count * self.prop.steps

    def move_to(self, position, rate) -> None:
        """Set the modal coordinates and rates (n,) of the march at the start of a cycle.

        The contact slides to the new position slowly.
        """
        path = np.array([self.modes.slide @ self.state[0], self.modes.slide @ position])
        if path[0] != path[1]:
            self._slide_contact(path)
        self.state[:] = (position, rate)
        self.done = 0

    def _slide_contact(self, path) -> None:
        """Update the contact memory for a motion along a displacement path (2,) [m] within one second."""
        self.loops.follow_path(
            path,
            1.0,
            self.model.kind,
            self.contact,
            STEP_TOL * self.model.limit,
            np.zeros((2, 2)),
            np.zeros((2, 3)),
        )

    def reset_balance(self) -> None:
        """Restart the energy balance from the present energies at the start of a cycle."""
        self.ledger[:] = 0.0
        self.totals[:] = 0.0
        self.work_sums[:] = 0.0
        self.done = 0
        self.ledger[Ledger.DRIVE_WORK] = self.find_modal_energy() + self.find_interface_energy()

    def march_to_mark(self, cycles: int, window: int) -> Mark:
        """March over further cycles; return a `Mark` with the last `window` of them."""
        marched_cycles = deque(maxlen=window)
        for _ in range(cycles):
            marched_cycles.append(self.march_cycle(self.prop.steps, 0, []))
            if self.outcome is not None:
                break
        return make_mark(self, list(marched_cycles), read_output_extremes(marched_cycles, self))

    def get_step_table(self, count: int) -> tuple:
        """Return the drive table for the next steps, and the index of its row for the first step."""
        if self.periodic is not None:
            return self.periodic, self.done % len(self.periodic)
        return self.prop.tables(self.drive, self.done, max(count, 1)), 0

    def make_response(self, rows, number) -> Response:
        """Return the time histories for samples with given step numbers (k,)."""
        response = _make_response(rows, number, self.prop.dt, self.modes, self.drive)
        return self._add_elements(response, rows) if hasattr(self.model, "patch") else response

    def _add_elements(self, response, rows) -> Response:
        """Add the relative displacements, forces and slips of the elements to the time histories.

        `extra` gets slides, slide_rates, forces and slips (k, i) of the interfaces, and spring_forces (k, s).
        """
        modes = self.modes
        faces = self.faces
        columns = self._element_columns(rows)
        ports, is_friction = faces.links
        is_interface = is_friction == 1
        forces = columns[:, :, SampleColumn.FORCE]
        element_acceleration = -np.einsum("ke,en->kn", forces, faces.rows[ports]) / modes.mass
        if self.model.patch is None:
            # The histories already include the force of the first element.
            element_acceleration += np.outer(response.force, modes.slide) / modes.mass
        extra = response.extra | {"spring_forces": forces[:, ~is_interface]}
        names = ("slides", "slide_rates", "forces", "slips")
        if is_interface.any():
            extra |= {name: columns[:, is_interface, k] for k, name in enumerate(names)}
        return replace(
            response,
            acceleration=response.acceleration + element_acceleration @ modes.output,
            extra=extra,
        )

    def _element_columns(self, rows) -> np.ndarray:
        """Return the sample columns that belong to the elements, (k, e, 5)."""
        count = len(self.model.joints)
        first_column = 2 * self.modes.omega.size + N_SAMPLE_COLUMNS + rows.shape[1] - self.width
        columns = rows[:, first_column : first_column + N_ELEMENT_COLUMNS * count]
        return columns.reshape(len(rows), count, N_ELEMENT_COLUMNS)

    def march_without_samples(self, steps: int, after_piece=None) -> bool:
        """March to a given step, but keep no samples.

        Returns whether the march reached the step. after_piece: callback after each part of the march.
        """
        size = self.prop.steps
        while self.done < steps and self.outcome is None:
            next_check = self.done // size + cycles_to_next_check(self.done // size)
            n_steps_to_check = next_check * size - self.done
            count = min(
                steps - self.done, MAX_STEPS_AT_ONCE, MAX_CYCLES_AT_ONCE * size, n_steps_to_check
            )
            rows = self._march_rows(count, 0, [])
            self.totals += self._step_energies(rows).sum(axis=1)
            n_left = (steps - self.done) // size
            if self.done % size == 0 and self.outcome is None and self.is_periodic(n_left):
                self.skip_cycles(n_left)
            if after_piece is not None:
                after_piece()
        return self.outcome is None

    def march_cycles(self, size: int, last_step: int, frames: int, snapshots: list) -> list:
        """March one cycle, or several complete cycles at once.

        No cycle goes beyond the step `last_step` or the next check of `is_periodic`. With frames the last cycle is
        marched separately, in as many parts, with a snapshot after each.

        Parameters
        ----------
        size : int
            Number of steps.
        last_step : int
            Number of the step at which to stop.
        frames : int
            Number of snapshots.
        snapshots : list
            Snapshots, which are appended.

        Returns
        -------
        list of list of MarchedCycle
            Complete cycles, followed by the incomplete cycle if the march ended in it.
        """
        first = self.done
        cycle_steps = self.prop.steps
        n_cycles = min(
            MAX_CYCLES_AT_ONCE,
            MAX_STEPS_AT_ONCE // cycle_steps,
            (last_step - first) // cycle_steps,
            cycles_to_next_check(-(-first // cycle_steps)),
        )
        if frames and first + n_cycles * cycle_steps == last_step:
            n_cycles -= 1
        count = max(1, n_cycles) if size == cycle_steps else 1
        rows = self._march_rows(count * size, frames if first + size == last_step else 0, snapshots)
        works = self._step_works(rows)
        first_sum = 2 * self.modes.omega.size + FIRST_SUM
        sums = self._accumulate_energies(rows).T
        samples = np.concatenate([rows[:, :first_sum], sums, rows[:, first_sum:]], axis=1)
        n_complete = (len(rows) - 1) // size if size else 0
        end = n_complete * size
        cycle_lists = []
        if n_complete:
            cycle_rows = sliding_window_view(samples, size + 1, axis=0)[::size].swapaxes(1, 2)
            cycle_works = works[:end].reshape(n_complete, size).sum(axis=1)
            first_steps = range(first, first + end, size)
            cycle_lists.append([*map(MarchedCycle, first_steps, cycle_rows, cycle_works)])
        if end < len(rows) - 1 or not n_complete:
            cycle_lists.append(
                [
                    MarchedCycle(
                        first + end,
                        samples[end:],
                        works[None, end:].sum(axis=1)[0],
                    )
                ]
            )
        return cycle_lists

    def march_cycle(self, size: int, frames: int, snapshots: list) -> MarchedCycle:
        """March over a number of steps and return them as one cycle.

        Parameters
        ----------
        size : int
            Number of steps.
        frames : int
            Number of snapshots.
        snapshots : list
            Snapshots, which are appended.

        Returns
        -------
        MarchedCycle
        """
        ((cycle,),) = self.march_cycles(size, self.done + size, frames, snapshots)
        return cycle

    def _march_rows(self, size: int, frames: int, snapshots: list) -> np.ndarray:
        """March over a number of steps and return their sample rows (steps + 1, width).

        The arguments are those of `march_cycles`.

        Parameters
        ----------
        size : int
            Number of steps.
        frames : int
            Number of snapshots.
        snapshots : list
            Snapshots, which are appended.
        """
        parts = []
        part_ends = np.linspace(0, size, max(min(frames, size), 1) + 1).round().astype(int)
        for part_steps in np.diff(part_ends) if size else [0]:
            rows = np.empty((part_steps + 1, self.width))
            rows[-1] = 0.0  # the step after the last sample is not known yet
            saved_state = copy_state(self.contact, *self._changing_arrays())
            saved_arrays = self._copy_for_softening_springs()
            n_steps, status = self._march_steps(int(part_steps), rows)
            while status == MarchStatus.MEMORY_FULL:
                location = f"at step {self.done + n_steps}"
                self.contact = enlarge_list(
                    self.contact, saved_state, location, *self._changing_arrays()
                )
                n_steps, status = self._march_steps(int(part_steps), rows)
            if saved_arrays and self._has_diverged(rows[: n_steps + 1]):
                for array, saved_array in zip(
                    (*self.contact, *self._changing_arrays()), saved_arrays
                ):
                    array[...] = saved_array
                n_steps, _ = self._march_steps(n_steps - 1, rows)
                status = MarchStatus.EXCEEDS_TRAVEL
                distance = format_length(self._find_output_distance(rows[n_steps]), 3)
                self.message = (
                    f"beyond a displacement of {distance} the motion grows without limit, because the "
                    "force of the softening spring no longer pulls the block back; the run ended there"
                )
            self.done += n_steps
            parts.append(rows[: n_steps + 1])
            self.set_outcome(status)
            if frames:
                snapshots.append(self._make_snapshot(rows[n_steps]))
            if self.outcome is not None:
                break
        rows = parts[0]
        if len(parts) > 1:
            rows = np.concatenate([part[:-1] for part in parts[:-1]] + parts[-1:])
        self.work_sums += self._sampled_works(rows).sum(), np.abs(self._step_works(rows)).sum()
        return rows

    def _copy_for_softening_springs(self) -> tuple:
        """Copy all arrays that steps change if any spring is nonlinear; otherwise return ()."""
        if all(joint.potential is None for joint in self.model.joints):
            return ()
        return tuple(array.copy() for array in (*self.contact, *self._changing_arrays()))

    def _has_diverged(self, rows) -> bool:
        """Return whether the last sample is far beyond the travel or is not finite."""
        return len(rows) > 1 and not (
            self._find_output_distance(rows[-1]) <= DIVERGENCE_RATIO * self.travel
            and np.isfinite(rows[-1]).all()
        )

    def _find_output_distance(self, row) -> float:
        """Return the absolute displacement of the output [m] in a sample row."""
        with np.errstate(invalid="ignore", over="ignore"):
            return abs(float(self.modes.output @ row[: self.modes.omega.size]))

    def _march_steps(self, count: int, rows) -> tuple:
        """Integrate `count` steps with the compiled loop; store the samples in rows (count + 1, width).

        Returns the number of completed steps and the status.

        """
        table, row = self.get_step_table(count)
        return self.loops.march(self.model, row, count, self._make_march_arrays(table, count), rows)

    def _make_march_arrays(self, table, count: int) -> MarchArrays:
        """Return the arguments of the compiled loop for the next steps."""
        return MarchArrays(
            motion=self.state,
            modal_system=self.modal_system,
            table=table,
            interface=self.contact,
            elements=self.faces,
            press=self._make_step_load(count),
            ledger=self.ledger,
            travel=float(self.travel),
        )

    def _make_initial_load(self):
        """Return the arrays of the load at the start: a constant load."""
        return arrays.ConstantLoad(np.zeros(0))

    def _make_step_load(self, count: int):
        """Return the arrays of the load for the next steps."""
        return self.load

    def _accumulate_energies(self, rows) -> np.ndarray:
        """Return the energies (3, steps + 1) [J] accumulated from the start up to each sample.

        They are friction work, dissipated and created energy; `march_cycles` inserts them into the rows as columns.
        """
        step_energies = self._step_energies(rows)
        sums = np.empty((3, step_energies.shape[1] + 1))
        sums[:, 0] = self.totals
        np.cumsum(step_energies, axis=1, out=sums[:, 1:])
        sums[:, 1:] += self.totals[:, None]
        self.totals = sums[:, -1].copy()
        return sums

    def _step_energies(self, rows) -> np.ndarray:
        """Return the friction work, dissipated energy and created energy in each step, (3, steps) [J].

        The dissipated energy is the work minus the increase of the stored energy of the interface.
        """
        n = 2 * self.modes.omega.size
        energies = np.zeros((3, len(rows) - 1))
        energies[0] = self._step_works(rows)
        dissipated = energies[0] - np.diff(rows[:, n + SampleColumn.ENERGY])
        if dissipated.min(initial=0.0) == 0.0:
            energies[1] = dissipated
            return energies
        # This is the error of the work due to the tolerance of the step solution
        # and to round-off of the slide.
        noise = self.model.limit * (
            1e-12 * np.abs(np.diff(rows[:, n])) + 1e-15 * np.abs(rows[:-1, n])
        )
        np.copyto(energies[1], dissipated, where=dissipated > -noise)
        np.copyto(energies[2], -dissipated, where=dissipated < -noise)
        return energies

    def _step_works(self, rows) -> np.ndarray:
        """Return the friction work [J] in each step between samples."""
        return rows[:-1, 2 * self.modes.omega.size + SampleColumn.STEP_WORK]

    def _sampled_works(self, rows) -> np.ndarray:
        """Return the friction work [J] in each step, from sampled displacements and forces alone.

        Impulses at the end of a step, when a slide stops, have no slide from which their work could be computed;
        their work is added if all friction is set-valued.
        """
        n = 2 * self.modes.omega.size
        model = self.model
        has_smooth_friction = not model.joints or getattr(model, "patch", None) is not None
        works = np.zeros(len(rows) - 1)
        if has_smooth_friction:
            works = sampled_work(rows[:, n], rows[:, n + SampleColumn.FORCE])
        impulse_works = rows[:-1, n + SampleColumn.STEP_WORK].copy()
        for joint, columns in zip(model.joints, self._element_columns(rows).transpose(1, 2, 0)):
            if joint.potential is not None:
                continue
            slide = columns[SampleColumn.SLIDE]
            mean_force = columns[SampleColumn.MEAN_FORCE, :-1]
            is_smooth = bool(joint.element.kernels)
            works += sampled_work(
                slide, columns[SampleColumn.FORCE], None if is_smooth else mean_force
            )
            impulse_works -= mean_force * np.diff(slide)
            has_smooth_friction |= is_smooth
        return works if has_smooth_friction else works + impulse_works

    def _changing_arrays(self) -> list:
        """Return the arrays that a step changes, except for those of the contact."""
        arrays_of_elements = [*self.faces[:-1]]
        if self.model.joints:
            arrays_of_elements += self.faces.stops
        return [self.state, self.ledger, *arrays_of_elements]

    def set_outcome(self, status: int) -> None:
        """Set the outcome and message of the march, given the status from the compiled loop."""
        if status == MarchStatus.EXCEEDS_TRAVEL:
            self.outcome = Outcome.EXCEEDS_TRAVEL
        if status == MarchStatus.NOT_FINITE:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"at step {self.done} the computed motion is not a finite number; raise "
                "accuracy.steps_per_cycle"
            )
        if status == MarchStatus.NO_CONTACT_SET:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"at step {self.done} the method could not determine which points are in contact; raise "
                "accuracy.steps_per_cycle"
            )

    def _make_snapshot(self, row) -> dict:
        n = 2 * self.modes.omega.size
        return {
            "time": self.done * self.prop.dt,
            "slide": row[n + SampleColumn.SLIDE],
            "rate": row[n + SampleColumn.SPEED],
            "force": row[n + SampleColumn.FORCE],
            "slip": row[n + SampleColumn.SLIP],
        } | self.model.get_plot_fields(self.contact)

    def check_steps(self) -> None:
        """Set the outcome to not_converged if any step has not met its tolerance."""
        if self.ledger[Ledger.N_UNCONVERGED]:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"{int(self.ledger[Ledger.N_UNCONVERGED])} of {self.done} time steps have an error of the friction force "
                f"above the permitted {STEP_TOL:.0e} of the friction limit; raise accuracy.steps_per_cycle"
            )

    def read_rates_and_slips(self, rows) -> tuple:
        """Return the sliding rates (k, i) [m/s] and the slips (k, i) [m] of the interfaces in samples.

        rows: sample rows of `march_cycles`.

        """
        n = 2 * self.modes.omega.size
        columns = self._element_columns(rows)
        rates = [rows[:, n + SampleColumn.SPEED], columns[:, :, SampleColumn.SPEED]]
        slips = [rows[:, n + SampleColumn.SLIP], columns[:, :, SampleColumn.SLIP]]
        return np.column_stack(rates), np.column_stack(slips)

    def find_modal_energy(self) -> float:
        """Return the sum of the kinetic and elastic energies of the modes [J]."""
        return (
            0.5
            * self.modes.mass
            * float(np.sum(self.state[1] ** 2 + (self.modes.omega * self.state[0]) ** 2))
        )

    def find_interface_energy(self) -> float:
        """Return the energy [J] stored in the interfaces, the springs and the normal contact."""
        n = 2 * self.modes.omega.size
        rows = np.zeros((1, self.width))
        table = np.zeros((1, 4 * n + 3))
        system = self._make_march_arrays(table, 0)._replace(
            travel=np.inf, ledger=np.zeros(len(Ledger))
        )
        self.loops.march(self.model, 0, 0, system, rows)
        energy = rows[0, n + SampleColumn.ENERGY]
        if self.model.loading:
            energy += rows[0, LoadColumn.ENERGY - N_LOAD_COLUMNS]
        for joint, columns in zip(self.model.joints, self._element_columns(rows)[0]):
            if joint.potential is not None:
                energy += joint.potential(columns[0])
        return float(energy)

    def energy_balance(self) -> dict:
        """Return the energies [J] and iteration counters of the march as a dictionary by name."""
        names = (
            "work_in",
            "viscous",
            "power",
            "friction",
            "peak_stored",
            "iterations",
            "worst_iterations",
        )
        balance = dict(zip(names, map(float, self.ledger))) | {
            "stored": self.find_modal_energy() + self.find_interface_energy()
        }
        balance |= {
            "booked": float(self.ledger[Ledger.FRICTION_WORK]),
            "sampled": float(self.work_sums[0]),
            "passed": float(self.work_sums[1]),
        }
        if hasattr(self.contact, "status"):
            status = getattr(self.contact, "statuses", self.contact.status[None])
            totals = status.sum(axis=0)
            balance |= {
                "created": float(totals[STATUS.created]),
                "dissipated": float(totals[STATUS.dissipated]),
                "substeps": float(totals[STATUS.n_extra]),
                "strips": float(status[:, STATUS.max_strips].max()),
            }
        return balance
