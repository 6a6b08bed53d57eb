"""Places of the numbers that `read_kernels` reads off the last cycles of a run; no compiled code.

Of the run: range of the output [m]; largest coordinate [m] and acceleration [m s-2]; integrals of the acceleration with
cosine and sine of the cycle and of its third harmonic [m s-1]; how many releases of the first interface, sums of cosine
and sine of twice their phases; of one mode behind one interface the largest acceleration that rings while it sticks
[m s-2] and the largest angle by which free motion turns in a stick [rad].

Of an interface: ranges of slide and slip [m]; largest force [N]; time stuck [s]; friction work by the ledger, off the
ends of the pieces, and what went to and fro [J]; integrals of slide and force with cosine and sine of the cycle; of
slide and force over the first and over the last cycle; slide at both ends [m]; mean range in a cycle [m] and mean
secant stiffness of the cycles that show it [N/m], NaN where none does.
"""

(
    OUT_LOW,
    OUT_HIGH,
    REACH,
    ACCELERATION,
    A_COS,
    A_SIN,
    A3_COS,
    A3_SIN,
    STARTS,
    START_COS,
    START_SIN,
    RING,
    SWING,
) = range(13)
OF_RUN = 13
(
    LOW,
    HIGH,
    SLIP_LOW,
    SLIP_HIGH,
    FORCE,
    STUCK,
    WORK,
    TURNED,
    PASSED,
    Q_COS,
    Q_SIN,
    F_COS,
    F_SIN,
    FIRST,
    LAST,
    F_FIRST,
    F_LAST,
    BEGIN,
    END,
    RANGE,
    SECANT,
) = range(21)
OF_FACE = 21
