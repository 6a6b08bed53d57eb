"""patchfem: from a scene file to the friction, the motion and the error of a rubbing contact patch.

Read the package in the order of the physics; each stage imports `core` and itself, nothing else of ours:

1. `core`        the nouns that travel between stages
2. `scene`       a TOML file becomes SI values, every mistake named at once (`quantities`: the unit table)
3. `effects`     which table of a scene needs which stage
4. `mesh`        two coated pieces as one tagged mesh
5. `surface`     measured or made height profiles as a share of the gap
6. `contact`     elasticity condensed to the interface, unilateral contact, partial slip
7. `friction`    local laws and the nonlocal quadrature over the path
8. `structure`   the modes of the rig
9. `dynamics`    drives, exact events, the march in time
10. `response`    measures of a run and their errors
11. `identify`   values of a scene from measurements, with intervals
12. `export`     summary, netCDF, VTK, report
13. `closed_forms` exact answers that tests, studies and users share
14. `simulate`   the page where the stages meet
"""

__version__ = "0.4.0"
