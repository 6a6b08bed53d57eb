"""Places of numbers in the rows that the loops of this folder share; no compiled code."""

SQUARE, DAMPING, FACE, BASE, OUTPUT, MASS = range(6)  # of a rig: w^2, damping, shares of its mode, mass
Z0, V0, MOVING, TOLERANCE, HELD = range(5)  # of a start: motion, 1 where the base moves, slip up to which nothing slips
Z, V, BEGUN, STORED, EVER = range(5)  # of the ends of a run: motion, energies at first and last, all that was lost
LOST, FINE, STEADY, UNKNOWN = range(4)  # codes: run it alone; done; settles as told; looked for in vain
# of the state at the last border of a cycle: motion, elements that slip and their way, groups that stay; segment of the
# drive, -1 before there is a state; cycle up to which states lay far apart; 1 where the motion repeats to the last bit
LAST_Z, LAST_V, SLIPPING, WAY, DEPTH, SEGMENT, APART, REPEATS = range(8)
AMOUNT, RESIDUAL, LOWEST = range(3)  # of the motion it settles to: amplitude, residual, smallest depth of the memory
MOST = 8  # numbers of a point: motion and turning places
# of the last cycles: ranges of slide, slip and output; largest force and coordinate; time stuck; friction work by the
# ledger, off the ends of pieces, by quadrature, and what went to and fro; integrals with the cosine and sine of the
# drive; of the first and the last cycle; largest acceleration; releases; mean range and secant of a cycle; whether a
# single run interpolates; what rings, the largest angle [rad] by which free motion turns in a stick; whether the motion
# repeats to the last bit in all of them
(LOW, HIGH, SLIP_LOW, SLIP_HIGH, OUT_LOW, OUT_HIGH, FORCE, REACH, STUCK, WORK, TURNED, POWER, PASSED, Q_COS, Q_SIN,
 F_COS, F_SIN, A_COS, A_SIN, A3_COS, A3_SIN, FIRST, LAST, F_FIRST, F_LAST, ACCELERATION, STARTS, START_COS, START_SIN,
 RANGE, SECANT, EDGE, RING, SWING, ALIKE) = range(35)
NUMBERS = 35
