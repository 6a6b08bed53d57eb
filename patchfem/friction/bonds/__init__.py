"""Friction law as a sum over bonds: the moments of the bonds, and the list of their strips.

In: bond parameters, relative displacement and pressure. Out: traction and energies. In this folder "eq. n" is equation n
of Srinivasan, Cassenti and Cutts, Study of Characteristics of Dry Friction Damping (1985). The two readings of eq. 2.17
(`Bonds.reading`):

- "report": eqs. 2.14 to 2.17 as printed. A bond carries (R/eps)^p exp(-R/eps) along u/|u|, with u its stretch and R the path
  since it formed, and its length eps grows from zero (eq. 2.10). The path element is |v| dt in place of the signed dX1.
- "stretch": a bond carries (|u|/eps)^p exp(-D) along u/|u|, with D the damage, the integral of dR/eps along the path. The
  bond length in the power is that at which the bond formed. On a path without reversal this is "report". It never
  creates energy for p >= 0.

A bond stores the energy that it gives back when its stretch goes to zero without further damage: f u/(p + 1) for
"stretch", and f u for "report", whose force f does not depend on the stretch. A step dissipates its work less the gain
in stored energy. For "report" this may be negative: energy is created.

Read `parameters`, then `point_kernels`: the moments of the bonds, exact for reading="stretch" with p = 1, the default.
Every other law is a list of strips (`strip_rows_kernels`), with one cut-off and one merge (`strip_kernels`). `engines`
chooses cut-off and merge width by error and cost. A strip is here a piece of the path along which the bonds of a point
formed, not a strip of the patch.

Numerical errors: `EngineChoice.error` bounds what dropped and joined strips change, and every run adds this bound to
its errors. The sum over the nodes of a patch that slips part by part has the error of its mesh.
"""
