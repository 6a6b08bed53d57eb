"""Free vibration (ringing) of a rig whose interfaces all stick.

In: the modes, the stiffness of each interface in stick, and samples of the motion. Out: the `VibratingMode`s, which are
eigenvectors of the rig with its interfaces as springs.
"""

from typing import NamedTuple

import numpy as np

# Smallest relative change between two samples from which the amplitude of a mode is computed.
MIN_RELATIVE_SAMPLE_CHANGE = 1e-6


class VibratingMode(NamedTuple):
    """Free vibration of a mode while all interfaces stick.

    - begin, end: start and end of the stick interval [s].
    - frequency: frequency of the damped motion [Hz].
    - damping: damping ratio [1].
    - displacement: amplitude at the output at the time `begin` [m].
    """

    begin: float
    end: float
    frequency: float
    damping: float
    displacement: float


def compute_stuck_vibration(modes, stiffness, motion) -> list[VibratingMode]:
    """Return the free vibration of each mode while all interfaces stick.

    The motion must not contain a response to a sinusoidal drive.

    Each stuck interface is a spring, and the modes are eigenvectors of the rig with these springs. In each
    mode, two states at a time distance h differ by c (exp(lambda h) - 1), independently of the equilibrium.
    This determines the amplitude c.

    Parameters
    ----------
    modes
        Modal basis of the rig.
    stiffness : (i,)
        Stiffness of each interface [N/m].
    motion : Response
        Samples of the stick interval.
    """
    n = modes.omega.size
    rows = modes.interfaces
    stiffness_matrix = np.diag(modes.omega**2) + rows.T * stiffness @ rows / modes.mass
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness_matrix, -modes.damping_matrix]])
    values, shapes = np.linalg.eig(matrix)
    state = np.concatenate([motion.modal[:2], motion.modal_rate[:2]], axis=1)
    growth = np.expm1(values * (motion.time[1] - motion.time[0]))
    known = (values.imag > 0) & (np.abs(growth) > MIN_RELATIVE_SAMPLE_CHANGE)
    sizes = np.linalg.solve(shapes, (state[1] - state[0]).astype(complex))[known] / growth[known]
    # a pair of conjugate eigenvalues corresponds to one real sinusoid
    amplitudes = 2 * np.abs(modes.output @ shapes[:n, known] * sizes)
    return [
        VibratingMode(
            float(motion.time[0]),
            float(motion.time[-1]),
            eigenvalue.imag / (2 * np.pi),
            -eigenvalue.real / abs(eigenvalue),
            float(amplitude),
        )
        for eigenvalue, amplitude in zip(values[known], amplitudes)
    ]


def select_strongest(modes: list[VibratingMode]) -> VibratingMode:
    """Return the mode with the largest time integral of the squared displacement in the stick interval."""

    def energy(mode: VibratingMode) -> float:
        """Return the time integral of the squared displacement, up to a factor that all modes have."""
        decay = 4 * np.pi * mode.damping * mode.frequency * (mode.end - mode.begin)
        return mode.displacement**2 * (-np.expm1(-decay) / decay if decay else 1.0)

    return max(modes, key=energy)
