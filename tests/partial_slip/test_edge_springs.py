"""Springs at the edges of a contact that give it a prescribed stiffness in full stick."""

import numpy as np
import pytest

from patchfem.partial_slip import add_edge_springs, make_jenkins_set

COUNT = 41


def make_patch():
    """Return compliance (m, m) [m/N] and nodal limits (m,) [N] of a crowned contact of the nodes 4 to 36."""
    x = np.linspace(-1.0, 1.0, COUNT)
    compliance = np.exp(-3.0 * np.abs(x[:, None] - x)) + 0.2 * np.eye(COUNT)
    loaded = (np.arange(COUNT) >= 4) & (np.arange(COUNT) <= 36)
    limit = np.where(loaded, np.sqrt(np.maximum(1.0 - (x / 0.85) ** 2, 0.01)), 0.0)
    return compliance, limit


def stick_stiffness(compliance, loaded) -> float:
    """Return the stiffness in full stick [N/m]."""
    points = np.flatnonzero(loaded)
    return float(np.linalg.inv(compliance[np.ix_(points, points)]).sum())


@pytest.mark.parametrize("ratio", [2.0, 1.002, 1.0, 0.99, 0.5])
def test_exact_stiffness_is_that_prescribed(ratio):
    """The matrix stays positive definite and has the prescribed stiffness; a large change scales all of it."""
    compliance, limit = make_patch()
    target = ratio * stick_stiffness(compliance, limit > 0)
    changed = add_edge_springs(compliance, limit > 0, target)
    assert stick_stiffness(changed, limit > 0) == pytest.approx(target, rel=1e-9)
    assert np.linalg.eigvalsh(changed).min() > 0
    if 0.9 < ratio < 1.1:
        assert set(np.flatnonzero(np.diag(changed - compliance))) <= {4, 36}
    else:
        assert changed == pytest.approx(compliance / ratio, rel=1e-12)


def test_exact_force_is_unchanged_once_the_edges_slip():
    """After the nodes at the edges have slipped, the friction force is that without the springs."""
    compliance, limit = make_patch()
    target = 0.99 * stick_stiffness(compliance, limit > 0)
    changed = add_edge_springs(compliance, limit > 0, target)
    before, after = (make_jenkins_set(matrix, limit) for matrix in (compliance, changed))

    def force(elements, displacement):
        return (elements.stiffness * np.minimum(elements.yield_displacement, displacement)).sum()

    first = max(before.yield_displacement[0], after.yield_displacement[0])
    for displacement in np.linspace(first, before.yield_displacement[-1], 7):
        assert force(after, displacement) == pytest.approx(force(before, displacement), rel=1e-9)


def test_two_contacts_have_edges_of_their_own():
    """Each of two separate contacts gets springs at both of its edges."""
    compliance, limit = make_patch()
    limit[18:22] = 0.0
    changed = add_edge_springs(compliance, limit > 0, 0.99 * stick_stiffness(compliance, limit > 0))
    assert np.flatnonzero(np.diag(changed) - np.diag(compliance)).tolist() == [4, 17, 22, 36]


def test_exact_scaled_compliance_of_a_contact_without_edges():
    """A contact that ends only at the ends of the interface has a scaled compliance."""
    compliance, _ = make_patch()
    loaded = np.ones(COUNT, bool)
    changed = add_edge_springs(compliance, loaded, 0.99 * stick_stiffness(compliance, loaded))
    assert changed == pytest.approx(compliance / 0.99, rel=1e-12)
