"""What a loop of `loop_kernels` holds, by flags: here one contact under a load that stays. `instances` writes others.

Numba leaves out the branches behind what is False, so nothing is compiled that a rig does not have.
"""

MANY = False  # elements beside the contact, or in place of it
STOPS = False  # elements that are set-valued
SMOOTH = False  # elements that have a slope
THERE = True  # the contact; it is not where elements take its place
SEVERAL = False  # of elements and contact more than one
PLANE = False  # elements that slide in a plane, two directions each
PRESSED = False  # a load that changes
POINTED = False  # points that bear their own share of it
LISTED = False  # points that are lists of bonds
