"""Interfaces of a rig or a bench: laws, loads and patches, and the contact points that time steps follow.

In: a Model and its Patch. Out: `joints.Joint`s, one for each interface, and `contact_points.make_contact`, the points of all
of them with a law, a load and a port for every effect. `bond_lists` chooses how bonds are summed, `averaged_law` averages
the pressure along the motion, and `bands` divides a face that yaws.
"""
