"""Motion of modes with friction interfaces by steps of order 8 that end where a law changes its regime.

Equation. With modal coordinates z, the drive a(t) and the friction forces F of the interfaces,

    z'' + D z' + omega^2 z = -base a(t) - slides^T F/m.

Method. Within a regime (each interface sticks, slips, or is on a branch of its law) force and rates are smooth, and a
Runge-Kutta method of order 8 with dense output integrates them. A law tells by margins how far its regime reaches; a
step is cut at the first zero of a margin, and the law changes its regime there. Rigid friction at rest is a
constraint on the modes. Work, slip and loss are integrals by the weights of the method, and no stage depends on them;
extremes, times of stick and harmonics are those of the dense output. Nothing is derived from samples.

In: `core.ModalBasis`, a drive, laws, loads (`cases`). Out: `runs.Motion`. A bench is the same engine with a
prescribed slide. Errors follow from a second run with larger steps.

A module imports its own entry of this list and the entries before it:

1. `records`          arrays of the engine and the meaning of their columns
2. `laws`             friction laws, one file each
3. `table_kernels`    functions of all laws as one
4. `motion_kernels`   rates of modes, drive, friction, work
5. `step_kernels`     step of order 8 with dense output
6. `event_kernels`    roots within a step, its first event, change of regime
7. `window_kernels`   measures of cycles and windows, samples
8. `engine_kernels`   loop over steps and cycles
9. `drives`           pieces and tones of a drive
10. `cases`           arrays of a case from the records of a rig or bench
11. `measures`        measures of the window, energies
12. `stored_energy`   energy of stretched springs, bonds and a lifted load
13. `runs`            runs with errors and histories
14. `balance_kernels` balance of odd harmonics by Newton's method
15. `harmonic_balance` balance of the odd harmonics of a driven rig
16. `periodic`        periodic motions by shooting
17. `periodic_curves` periodic motions under further conditions, and their curves through folds
18. `quasi_static`    quasi-static motions of a mode
19. `free_motions`    motions without a drive: backbones and limit cycles

Limits. The method is explicit: a law or mode that is 1e4 times faster than the drive takes as many more steps, and a
run ends with a message after `cases.MAX_STEPS`. Margins are evaluated at three points of a step and at nearly
vanishing minima between them, with at least twelve steps per shortest period: on 400 random rigs under three tones no
event was missed.

Cost: 2 us per step with one mode and one interface; a cycle takes about 15 steps.
"""

# Names that other folders use, by module.
PUBLIC = {}
