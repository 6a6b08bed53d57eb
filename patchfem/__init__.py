"""patchfem: from a scene file to the friction, the motion and the error of a rubbing contact patch.

Read the package in the order of the physics; each stage imports `core` and itself, nothing else of ours:

1. `core`        the nouns that travel between stages
2. `scene`       a TOML file becomes SI values, every mistake named at once (`quantities`: the unit table)
3. `effects`     which table of a scene needs which stage
4. `mesh`        two coated pieces as one tagged mesh
5. `contact`     elasticity condensed to the interface, unilateral contact, partial slip
6. `friction`    local laws and the nonlocal quadrature over the path
7. `structure`   the modes of the rig
8. `dynamics`    exact events and the march in time
9. `response`    measures of a run and their errors
10. `export`     summary, netCDF, VTK, report
11. `closed_forms` exact answers that tests, studies and users share
12. `simulate`   the page where the stages meet
"""

__version__ = "0.1.0"
