"""Modal basis with one mode, and the compiled march along a prescribed path."""

import numpy as np
from modal_bases import make_modal_basis

from patchfem.dynamics import STEP_TOL, JointsModel, element_model, load_instances
from patchfem.friction import TanhLaw

OMEGA = 2 * np.pi * 143
# Laws of the compiled loop of joints that most tests share.
ALL = (
    *(f"friction.laws.{law}_kernels" for law in ("coulomb", "elastic_plastic", "stretch", "tanh")),
    "dynamics.interfaces.spring_kernels",
)


def share_one_loop(monkeypatch) -> None:
    """Make joints of all laws march in the compiled loop that contains the laws of ALL."""
    own_laws = JointsModel.laws.fget
    monkeypatch.setattr(
        JointsModel, "laws", property(lambda model: tuple(sorted({*ALL, *own_laws(model)})))
    )


def make_tanh_model(limit: float, speed: float):
    """Return the ContactModel of friction limit tanh(v/speed), limit [N], speed [m/s]."""
    return element_model(TanhLaw(limit, speed).element(1.0))


def make_one_mode(omega, zeta, mass):
    """Return a modal basis with one mode."""
    return make_modal_basis(omega, zeta, mass=mass)


def follow_path(model, path, dt=0.3):
    """March a model along a prescribed path with loops.follow_path.

    Returns (force at the samples, step means, slip), (dissipated, stored), unconverged steps,
    contact.
    """
    loops = load_instances()
    contact = model.allocate_contact()
    energies = np.zeros((path.size, 2))
    forces = np.zeros((path.size, 3))
    n_unconverged = loops.follow_path(
        np.ascontiguousarray(path, float),
        dt,
        model.kind,
        contact,
        STEP_TOL * model.limit,
        energies,
        forces,
    )
    return forces, energies, n_unconverged, contact
