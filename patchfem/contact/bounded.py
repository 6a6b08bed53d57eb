"""Quadratic program of contact with bounds: minimise t . C t/2 + g . t for lower <= t <= upper and prescribed resultants.

Normal contact has the bounds 0 and the hardness, partial slip has minus and plus the friction limit, and a linear system
on a set of cells has no bounds there and zeros elsewhere. The motions q of the holder are the multipliers of the
resultants: with the motions R as columns, C t + g - R q vanishes between the bounds, and R . t + K q has prescribed values,
where K are springs of the holder.

The method is that of Polonsky and Keer (Wear 231, 1999, 206): conjugate gradients on the cells between the bounds, cut at
the bounds, and gradient steps for cells that leave a bound. It is preconditioned by the stiffness of the waves on the
cells between the bounds. Its directions are conjugate by the formula of Polak and Ribiere as long as the cuts leave the
slopes orthogonal. The energy is monitored: where it does not fall for several steps, a projected gradient step follows,
which cannot fail.
"""

from typing import NamedTuple

import numpy as np

MAX_RESTORATIONS = 40  # Largest number of Newton steps that restore the resultants


class BoundedProblem(NamedTuple):
    """Quadratic program of n cells and r free motions of the holder; arrays over cells have any one shape.

    - gap (ny, nx): Linear term g [m].
    - lower, upper: Bounds [Pa] of the traction, (ny, nx) or numbers; -inf and inf for none.
    - motions (r, ny, nx): Closing of each cell per unit of each free motion; ones for the approach, x and y for tilts.
    - target (r,): Prescribed sums of motion times traction, [Pa] or [Pa m].
    - springs (r,): Decrease of these sums per unit of the motion, by springs of the holder.
    """

    gap: np.ndarray
    lower: np.ndarray | float
    upper: np.ndarray | float
    motions: np.ndarray = ()
    target: np.ndarray = ()
    springs: np.ndarray = ()


class BoundedSolution(NamedTuple):
    """Solution of a bounded problem.

    - traction (ny, nx): [Pa], within the bounds and with the prescribed resultants.
    - motion (r,): Free motions q of the holder.
    - slope (ny, nx): C t + g - R q [m]: 0 between the bounds, >= 0 at the lower and <= 0 at the upper one.
    - n_iterations: Number of steps.
    - residual: Largest wrong slope over the largest displacement.
    """

    traction: np.ndarray
    motion: np.ndarray
    slope: np.ndarray
    n_iterations: int
    residual: float


def solve_bounded(
    compliance,
    problem: BoundedProblem,
    start: np.ndarray | None = None,
    tolerance: float = 1e-8,
    max_iterations: int = 2000,
) -> BoundedSolution:
    """Solve a bounded problem by preconditioned conjugate gradients.

    Parameters
    ----------
    compliance : CellCompliance
        Operator C: `product`, `precondition` and `self_compliance`.
    problem : BoundedProblem
        Gap, bounds and free motions.
    start : (ny, nx) ndarray, optional
        Traction [Pa] to start from.
    tolerance : float
        Largest residual.
    max_iterations : int
        Number of steps after which the tractions are returned as they are.

    Returns
    -------
    BoundedSolution
    """
    holder = _Holder(problem, compliance.self_compliance)
    if start is None:
        start = np.full(problem.gap.shape, holder.uniform_traction)
    everywhere = np.ones(start.shape, bool)
    state = holder.load(compliance, holder.project(start, np.zeros(holder.n_motions), everywhere))
    best = state
    n_without_gain = 0

    directions = _Directions()
    n_iterations = 0
    while n_iterations < max_iterations:
        n_iterations += 1
        traction = state.traction
        raw_slope = state.displacement + problem.gap
        is_free = holder.find_free_cells(traction)
        motion = holder.fit_motion(raw_slope, state.motion, is_free)
        slope = raw_slope - holder.move(motion)
        is_leaving = holder.find_leaving_cells(traction, slope)
        is_moving = is_free | is_leaving
        moving_slope = np.where(is_moving, slope, 0.0)

        # Optimality: the slope vanishes between the bounds and has the right sign at them
        # Rounding error of a slope, relative to the largest gap of the cells between the bounds
        noise = 1e-15 * np.abs(problem.gap[is_free]).max(initial=0.0)
        scale = max(np.abs(state.displacement).max(), np.finfo(float).tiny)
        residual = max(np.abs(moving_slope).max() - noise, 0.0) / scale
        if residual <= tolerance:
            break

        # The energy may rise while the set of cells between the bounds changes, but not for long. A projected gradient step
        # of this length always lowers it where tractions displace all cells inwards.
        n_without_gain += 1
        if state.energy < best.energy:
            best = state
            n_without_gain = 0
        # Number of steps without a lower energy after which a projected gradient step follows. A
        # changed set of cells takes two or three steps to lower the energy.
        if n_without_gain > 8:
            largest_eigenvalue = compliance.product(np.ones(traction.shape)).max()
            gradient = best.displacement + problem.gap - holder.move(best.motion)
            moved = best.traction - gradient / largest_eigenvalue
            state = holder.load(compliance, holder.project(moved, best.motion, everywhere))
            best = state
            n_without_gain = 0
            directions = _Directions()
            continue

        # Conjugate direction on the cells that can move, without a change of the resultants
        steepest = holder.precondition(compliance, moving_slope, is_moving)
        direction, motion_direction = directions.find_next(steepest, moving_slope, is_moving)

        # Exact step, cut at the bounds
        direction_displacement = compliance.product(direction)
        curvature = float(np.vdot(direction, direction_displacement))
        curvature += float(holder.springs @ motion_direction**2)
        step = float(np.vdot(moving_slope, direction)) / curvature if curvature > 0 else 0.0
        moved = traction - step * direction
        motion = motion - step * motion_direction
        projected = holder.project(moved, motion, is_moving)
        state = holder.load(compliance, projected)
    return BoundedSolution(traction, motion / holder.scale, slope, n_iterations, residual)


class _Direction(NamedTuple):
    """Change of the tractions (ny, nx) [Pa] and of the motions (r,)."""

    traction: np.ndarray
    motion: np.ndarray


class _Directions:
    """Conjugate directions of successive steps."""

    def __init__(self):
        self.last = None
        self.last_slope = None
        self.last_square = 0.0

    def find_next(
        self, steepest: _Direction, slope: np.ndarray, is_moving: np.ndarray
    ) -> _Direction:
        """Return the next direction, conjugate to the last one by the formula of Polak and Ribiere.

        Parameters
        ----------
        steepest : _Direction
            Preconditioned slope.
        slope : (ny, nx) ndarray
            Slope of the cells that move, 0 elsewhere [m].
        is_moving : (ny, nx) bool ndarray
            Cells that move.
        """
        direction = steepest
        square = float(np.vdot(slope, steepest.traction))
        if self.last_square > 0:
            overlap = float(np.vdot(self.last_slope, steepest.traction))
            # Largest scalar product of two successive slopes, relative to the square of the last
            # one, at which the directions are conjugate; beyond it the last direction is forgotten
            # (Powell, Math. Program. 12, 1977, 241)
            if abs(overlap) <= 0.2 * square:
                factor = (square - overlap) / self.last_square
                direction = _Direction(
                    steepest.traction + factor * np.where(is_moving, self.last.traction, 0.0),
                    steepest.motion + factor * self.last.motion,
                )
        self.last = direction
        self.last_slope = slope
        self.last_square = square
        return direction


class _State(NamedTuple):
    """Admissible tractions [Pa] and motions, their displacement [m], and their energy per cell area [Pa m]."""

    traction: np.ndarray
    motion: np.ndarray
    displacement: np.ndarray | None = None
    energy: float = np.inf


class _Holder:
    """Bounds of the cells and motions of the holder, scaled to a largest closing of 1.

    Parameters
    ----------
    problem : BoundedProblem
        Bounds, motions, resultants and springs.
    self_compliance : float
        Displacement of a cell per traction on it [m/Pa].
    """

    def __init__(self, problem: BoundedProblem, self_compliance: float):
        shape = problem.gap.shape
        self.lower = np.broadcast_to(problem.lower, shape)
        self.upper = np.broadcast_to(problem.upper, shape)
        self.self_compliance = self_compliance
        self.n_motions = len(problem.motions)
        rigid = np.reshape(problem.motions, (self.n_motions, problem.gap.size)).astype(float)
        self.scale = np.abs(rigid).max(axis=1, initial=0.0)
        self.rigid = rigid / self.scale[:, None]
        self.target = np.asarray(problem.target, float) / self.scale
        self.springs = np.asarray(problem.springs, float) / self.scale**2
        self.gap = problem.gap

        # Tractions that displace the cells between the bounds by each motion, for the set of these cells
        self.known_set = None
        self.motion_tractions = np.empty_like(self.rigid)

    @property
    def uniform_traction(self) -> float:
        """Traction [Pa] of all cells that has the prescribed sum; 0 without free motions."""
        return self.target[0] / self.gap.size if self.n_motions else 0.0

    def find_free_cells(self, traction: np.ndarray) -> np.ndarray:
        """Return which cells lie between their bounds."""
        return (traction > self.lower) & (traction < self.upper)

    def find_leaving_cells(self, traction: np.ndarray, slope: np.ndarray) -> np.ndarray:
        """Return which cells at a bound lower the energy as they leave it."""
        is_leaving = ((traction <= self.lower) & (slope < 0)) | (
            (traction >= self.upper) & (slope > 0)
        )
        return is_leaving & (self.upper > self.lower)

    def move(self, motion: np.ndarray) -> np.ndarray:
        """Return the closing of the cells [m] by motions (r,)."""
        return (motion @ self.rigid).reshape(self.gap.shape)

    def fit_motion(self, slope, motion, is_free) -> np.ndarray:
        """Return motions (r,) whose part without springs is fitted to the slope of the cells between the bounds.

        Parameters
        ----------
        slope : (ny, nx) ndarray
            C t + g [m].
        motion : (r,) ndarray
            Motions; those against springs remain, because they follow from the resultants.
        is_free : (ny, nx) bool ndarray
            Cells between the bounds.
        """
        is_fitted = self.springs == 0
        if not is_fitted.any() or not is_free.any():
            return motion
        held = np.where(is_fitted, 0.0, motion)
        remainder = (slope - self.move(held))[is_free]
        rigid = self.rigid[is_fitted][:, is_free.ravel()]
        normal_matrix = rigid @ rigid.T
        fitted = np.zeros(len(rigid))

        # The second solution removes the rounding error of the first: where few cells touch, the gaps exceed the
        # displacements by many orders of magnitude.
        for _ in range(2):
            remainder_after_fit = rigid @ (remainder - fitted @ rigid)
            fitted = fitted + np.linalg.lstsq(normal_matrix, remainder_after_fit, rcond=1e-13)[0]
        held[is_fitted] = fitted
        return held

    def load(self, compliance, state: _State) -> _State:
        """Return a state with its displacement and energy."""
        traction, motion, *_ = state
        displacement = compliance.product(traction)
        energy = float(np.vdot(traction, displacement / 2 + self.gap))
        energy += float(self.springs @ motion**2) / 2
        return _State(traction, motion, displacement, energy)

    def precondition(self, compliance, slope, is_moving) -> _Direction:
        """Return about the tractions and motions that cause a slope.

        They change no resultant: the tractions of a fitted motion of the holder are subtracted.

        Parameters
        ----------
        compliance : CellCompliance
            Operator with `precondition`.
        slope : (ny, nx) ndarray
            Slope [m] of the cells that move, 0 elsewhere.
        is_moving : (ny, nx) bool ndarray
            Cells that move.
        """
        preconditioned = np.where(is_moving, compliance.precondition(slope), 0.0)
        if not self.n_motions:
            return _Direction(preconditioned, np.zeros(0))
        if self.known_set is None or not np.array_equal(is_moving, self.known_set):
            self.known_set = is_moving
            for k, rigid in enumerate(self.rigid):
                moved = np.where(is_moving, rigid.reshape(slope.shape), 0.0)
                held = np.where(is_moving, compliance.precondition(moved), 0.0)
                self.motion_tractions[k] = held.ravel()
        stiffness = self.motion_tractions @ self.rigid.T + np.diag(self.springs)
        motion = np.linalg.lstsq(stiffness, self.rigid @ preconditioned.ravel(), rcond=1e-13)[0]
        held = (motion @ self.motion_tractions).reshape(slope.shape)
        return _Direction(preconditioned - held, -motion)

    def project(self, traction, motion, is_movable) -> _State:
        """Cut tractions at their bounds and shift them until the resultants are the prescribed ones.

        The nearest such tractions are those of a shift by a motion of the holder before the cut. Newton's method finds
        this motion, with steps that are halved or doubled until the resultants come nearer.

        Parameters
        ----------
        traction : (ny, nx) ndarray
            Tractions [Pa], also beyond their bounds.
        motion : (r,) ndarray
            Motions of the holder, which its springs resist.
        is_movable : (ny, nx) bool ndarray
            Cells that may be shifted; the others stay. All may where these cannot carry the resultants.
        """
        if not self.n_motions:
            return _State(np.clip(traction, self.lower, self.upper), motion)
        shifted = self._shift(traction, motion, is_movable & (self.upper > self.lower))
        if shifted is None:
            shifted = self._shift(traction, motion, self.upper > self.lower)
        if shifted is None:
            return _State(np.clip(traction, self.lower, self.upper), motion)
        return shifted

    def _shift(self, traction, motion, is_movable) -> _State | None:
        """Return shifted tractions and motions (see `project`), or None if no shift gives the required resultants."""
        movable = np.flatnonzero(is_movable)
        rigid = self.rigid[:, movable]
        lower = self.lower.flat[movable]
        upper = self.upper.flat[movable]
        start = traction.flat[movable]
        fixed = np.where(is_movable, 0.0, np.clip(traction, self.lower, self.upper))
        target = self.target - self.rigid @ fixed.ravel()
        # Largest error of a resultant, relative to the largest prescribed one, at which the
        # tractions are not restored again
        tolerance = 1e-12 * np.abs(self.target).max()

        def find_error(shift):
            """Return the missing resultants (r,) after a shift (r,) by motions of the holder."""
            cut = np.clip(start + shift @ rigid / self.self_compliance, lower, upper)
            return target - rigid @ cut - self.springs * (motion + shift)

        shift = np.zeros(self.n_motions)
        error = find_error(shift)
        all_response = rigid @ rigid.T / self.self_compliance
        for _ in range(MAX_RESTORATIONS):
            # A small load may be the difference of large tractions; its rounding error cannot be restored
            added = shift @ rigid / self.self_compliance
            moved = start + added
            is_inside = (moved > lower) & (moved < upper)
            # Rounding errors of the resultants, in units of the last digit of the tractions that the shift adds
            round_off = 16 * np.finfo(float).eps * np.abs(added[is_inside]).sum()
            if np.abs(error).max() <= max(tolerance, round_off):
                out = np.clip(traction, self.lower, self.upper)
                out.flat[movable] = np.clip(moved, lower, upper)
                return _State(out, motion + shift)
            inside = rigid[:, is_inside]
            response = inside @ inside.T / self.self_compliance + np.diag(self.springs)
            # Share of the response of all cells in Newton's response; fewer cells between the
            # bounds than motions have none of their own
            response += 1e-9 * all_response
            direction = np.linalg.lstsq(response, error, rcond=1e-13)[0]

            # The derivative of the concave dual function along the direction falls from a positive value through 0; the
            # step ends where half of it is left
            slope = float(direction @ error)
            low = 0.0
            high = np.inf
            length = 1.0
            for _ in range(2 * MAX_RESTORATIONS):
                new_error = find_error(shift + length * direction)
                new_slope = float(direction @ new_error)
                if abs(new_slope) <= slope / 2:
                    break
                if new_slope > 0:
                    low = length
                else:
                    high = length
                length = 2 * length if high == np.inf else (low + high) / 2
            shift = shift + length * direction
            error = new_error
        return None
