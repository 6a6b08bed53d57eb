"""Worn depth of two pieces that rub: where, how deep, after how many cycles.

In: a way to press the worn pieces, the slip path of every interface point in one cycle, a wear coefficient. Out: the
depth that wear adds to the gap. Archard's law dh = kappa p ds, or its energy form dh = alpha tau ds, both pieces
together. `depth` is one jump over many cycles, solved together with the contact; `jumps` chooses the jumps.
Read `depth` first.
"""
