"""What each key of a scene means, in one sentence, by the table of `tables` or `contact` that holds it.

The first word is not a capital unless it is a name; a default that follows from other keys stands in the sentence.
"""

from ...effects import LAW_KEYS, SHAPES, WAVEFORMS

MEANINGS = {
    "Tables": {"title": "a line of text that stands over the results"},
    "Material": {
        "name": "the name under which the material table lists it",
        "young": "Young's modulus",
        "poisson": "Poisson's ratio",
        "density": "mass per volume",
    },
    "Contact": {
        "length": "length of both pieces along the sliding direction x",
        "width": "width of the patch across the plane of the model",
        "height": "height of each piece from the interface to its held far face, coating included",
        "load": "total normal force on the interface, weight included; [contact.approach] may stand in its place",
        "pairs": "number of equal patches that share the load; forces and stiffnesses are reported for all of them",
        "plane": "plane strain or plane stress in the pieces",
        "element_size": "length of the elements along an even interface; without it the tolerance grades the mesh",
        "substrate": "what the pieces are made of: a name of the material table, or a table of young, poisson, density",
        "mesh": "a mesh file of both pieces, tagged as GUIDE.md says; made from the dimensions unless given",
    },
    "Coating": {
        "material": "what the layer is made of, written as a substrate is",
        "thickness": "thickness of the layer, part of the height of its piece",
    },
    "OnePiece": {
        "height": "height of this piece; contact.height unless given",
        "length": "length of this piece, its middle at x = 0; contact.length unless given; the interface is as long as "
                  "the shorter one",
        "substrate": "what this piece is made of; contact.substrate unless given",
        "coating": 'layer of this piece, {material = ..., thickness = ...}, or "none"; contact.coating unless given',
        "chamfer": "length along x, and depth, that is cut off both ends at 45 degrees; the interface stops there",
        "end_radius": "radius that rounds both ends off; the interface stops where the slope exceeds 0.097",
    },
    "LoadLine": {
        "offset": "distance of the line of the load from the middle of the patch; > 0 moves the pressure to +x",
        "moment": "moment about the middle of the patch in place of the offset",
    },
    "Approach": {"distance": "how far the holders close from first touch, in place of a load"},
    "Holder": {
        "rotational_stiffness": "stiffness against rotation between the far face and what holds it",
        "tangential_stiffness": "stiffness along x between the far face and what holds it; rigid unless given",
    },
    "ProfileFile": {
        "file": "one trace of heights along x: text with units in its header, or a file of an instrument",
        "heights": "gap: a larger height is an opening; surface: a stylus trace, whose peaks are material of the piece "
                   "that carries the shape",
        "on": "the piece that carries the shape",
    },
    "Asperities": {
        "law": "how the rough layer gives way: pressure linear or exponential in its closing, or of spherical peaks "
               "with Gaussian heights",
        "normal_stiffness": "pressure per closing; with the exponential law that at first touch",
        "decay_length": "closing over which the pressure of the exponential law grows by a factor e",
        "radius": "radius of the tips of the peaks",
        "density": "number of peaks per area",
        "height_deviation": "standard deviation of the heights of the peaks",
        "tangential_ratio": "tangential over normal stiffness of the layer; rigid along x unless given",
    },
    "Strips": {
        "count": "number of equal strips side by side over the width",
        "roll": "rotation of the holder about x, which shifts the pressure sideways",
        "offset": "lateral place of the load line; the upper piece is then free to roll",
    },
    "Grooves": {
        "wavelength": "distance of the grooves along x",
        "amplitude": "half the height of their flanks, peak to peak; 0 is the law of friction itself",
        "phase": "place of the bottom of a groove, 2 pi x/wavelength, from where the run begins",
        "lifted_mass": "mass that rises with the load as it climbs; its inertia counts, its weight is part of the load",
    },
    "Normal": {
        "load": "normal force on the point, its mean where it oscillates",
        "amplitude": "amplitude of an oscillating load, load + amplitude cos(2 pi frequency t + phase), never below 0",
        "frequency": "frequency of the oscillating load",
        "phase": "phase of the oscillating load at t = 0",
        "width": "width of the contact across the path, for friction.spread",
    },
    "Temperature": {
        "surface": "absolute temperature of the surfaces",
        "reference": "absolute temperature at which rest_growth and slip_growth hold",
        "rest_activation": "activation temperature of the growth at rest; 0 unless given",
        "slip_activation": "activation temperature of the growth in slip; 0 unless given",
    },
    "Friction": LAW_KEYS | {
        "law": "the law of friction",
        "static": "coefficient of static friction mu_s",
        "kinetic": "coefficient of kinetic friction mu_k, at most static; static unless given",
        "reference_speed": "speed v_0 over which the friction of the law tanh saturates",
        "bond_length": "length eps_0 over which a bond forms and breaks, at rest",
        "reading": "eq. 2.17 with the stretch of a bond kept apart from its damage, which never creates energy, or as "
                   "the report prints it",
        "order": "power p with which a bond grows stronger along its path; > -1, and >= 0 for the reading stretch",
        "rest_growth": "growth a_s of the bond length at rest (2.10); constant bond length without it and slip_growth",
        "slip_growth": "length l_k by which the bond length grows with slip (2.10)",
        "rest_speed": "speed v_h that floors |v| in a_s/|v|; 1e-3 of the peak speed unless given",
        "initial_bonds": "share m_0 of the bonds that stand when the run begins",
        "breakaway": "share of the bond length over which a bond stretches without damage",
        "spread": "width rho of the bonds across the path (2.15); not counted unless given",
    },
    "Slide": {
        "kind": "the motion: at constant speed, a sine, a triangle, a slide with a rest, or a table of places",
        "amplitude": "half peak-to-peak of the motion, which starts in its middle upwards",
        "frequency": "cycles per time of a sine",
        "speed": "speed of the slide",
        "distance": "way to slide, up to the rest of a dwell; of a triangle the way slid before its cycles, 0 unless "
                    "given",
        "hold": "time at rest",
        "distance_after": "way to slide on after the rest; 0 unless given",
        "cycles": "number of cycles, fractions allowed; 1 unless given",
        "file": "table with columns time and displacement, and lateral for a slide in two directions",
    },
    "Mode": {
        "name": "name of the mode, unique",
        "frequency": "natural frequency; 0 Hz for a rigid mode",
        "damping": "damping ratio",
        "slide": "motion of the patch along x per unit of the modal coordinate",
        "normal": "motion of the patch away from the contact per unit of the modal coordinate",
        "pitch": "rotation of the patch in the plane of the model per unit of the modal coordinate",
        "lateral": "motion of the patch across x per unit of the modal coordinate",
        "yaw": "rotation of the patch about its normal per unit of the modal coordinate; beside [contact.strips]",
        "base": "share of the base motion that drives the mode; slide for the first mode, 0 for the others unless "
                "given; the squares sum to at most 1",
        "output": "motion of the accelerometer and gauge per unit of the modal coordinate; slide for the first mode, 0 "
                  "for the others unless given",
        "accelerometer": "motion of the accelerometer per unit of the modal coordinate; output unless given",
        "gauge": "motion of the displacement gauge per unit of the modal coordinate; output unless given",
    },
    "Stiffening": {"cubic": "force k_3 x^3 on the block at its output"},
    "Bonded": {
        "stiffness": "stiffness of the spring beside the contact",
        "damping": "damping of that spring",
        "wavelength": "period of an interlocking spring, k wavelength/(2 pi) sin(2 pi x/wavelength); linear unless "
                      "given",
    },
    "Spring": {
        "between": "the two masses that it joins, counted from 1, 0 for the base",
        "stiffness": "stiffness of the spring",
    },
    "Damper": {
        "between": "the two masses that it joins, counted from 1, 0 for the base",
        "coefficient": "force per relative velocity",
    },
    "Interface": {
        "between": "the two masses that rub, counted from 1, 0 for the base; the slide is the first less the second",
        "load": "normal force on the interface",
    },
    "Start": {
        "displacement": "displacements at t = 0, one per mode or mass; 0 unless given",
        "velocity": "velocities at t = 0, one per mode or mass; 0 unless given",
    },
    "Structure": {
        "moving_mass": "modal mass of every mode",
        "travel": "stop of the flexure: a motion beyond it ends the run; none unless given",
        "masses": "masses of a rig of springs, in place of modes",
        "output_mass": "number of the mass that carries the accelerometer; 1 unless given",
        "file": "file of matrices, modes or measured responses (.npz, .mat, .uff), in place of modes",
        "slide_at": "place in the file that moves the patch along x, such as 12:+x",
        "output_at": "place in the file that carries the accelerometer",
        "base_at": "place in the file that is driven as the base",
        "force_at": "place in the file at which the force drives",
        "normal_at": "place in the file that moves the patch away from the contact",
        "pitch_at": "place in the file that rotates the patch",
    },
    "Drive": {
        "kind": "what drives: the accelerated base, a force, or nothing after a release",
        "waveform": "course of the drive in time",
        "frequency": "frequency of a sine or of levels",
        "from": "frequency at which a sweep begins",
        "to": "frequency at which a sweep ends",
        "rate": "change of frequency per time of a linear sweep",
        "log_rate": "octaves per time of a logarithmic sweep",
        "acceleration": "acceleration of the base, zero to peak",
        "displacement": "displacement of the base, zero to peak, in place of an acceleration; where a release starts",
        "levels": "accelerations of the base, or forces, one after the other, the state carried over",
        "onset": "what onset_level means: 'slip' the first irreversible motion (of what gives way elastically, beyond "
                 "a thousandth of the slide over which it does), 'distortion' a third harmonic of the acceleration "
                 "above 3 % of the first, 'gauge' half peak-to-peak at the output above onset_length",
        "onset_length": "half peak-to-peak at the output from which a gauge sees motion",
        "force": "force, zero to peak",
        "mass": "number of the mass on which the force acts; the output unless given",
        "cycles": "length of the run, of each level, in cycles of the drive or of the first mode that is not rigid",
        "duration": "length of the run, of each level, in place of cycles",
        "file": "record of the drive, a table with units or UFF",
    },
    "Wear": {
        "coefficient": "volume worn per load and slip path, of both pieces together; form 'energy': per friction work",
        "upper_share": "share of the worn depth that the upper piece bears",
        "cycles": "number of cycles over which material is removed, each like the converged last cycle",
        "jumps": "number of equal steps in which the cycles are taken; by the tolerance unless given",
        "form": "'archard': depth by pressure and slip path; 'energy': by friction work per area",
        "scheme": "'explicit' takes the pressure from the start of a step and is refused beyond its critical length",
    },
    "Accuracy": {
        "tolerance": "relative error that every measure is to keep to; every numerical choice follows from it",
        "method": "engine of the motion; chosen by what the scene names unless given",
        "steps_per_cycle": "time steps per cycle; by the tolerance unless given",
        "quadrature": "engine of the sum over bonds; the cheapest within the tolerance unless given",
        "tail": "share of the bonds that the truncated sum leaves out; by the tolerance unless given",
        "merge": "width, in bond lengths, within which bonds are merged; by the tolerance unless given",
        "harmonics": "number of harmonics of the balance; by the tolerance unless given",
        "shear_modes": "number of shear modes of the pieces; by the tolerance unless given",
        "convergence": "quantity whose change ends the iteration of the method duhamel",
        "convergence_tolerance": "relative change at which the iteration of the method duhamel ends",
        "stick_speed": "speed below which the method newmark takes the interface as stuck",
    },
    "Measured": {
        "file": "table of measured rows: frequency, input, acceleration, displacement, flag",
        "acceleration_gain": "factor by which the reading exceeds the true acceleration",
        "reading": "what the accelerometer shows: 'peak' the largest acceleration, 'fundamental' its part at the "
                   "drive's frequency, 'rms' its effective value, 'lowpass' the largest behind a low pass of second "
                   "order",
        "reading_cutoff": "cut-off frequency of that low pass",
    },
}

MEANINGS |= {name.capitalize(): {"on": "the piece that carries the shape"} | (shape.means or {})
             for name, shape in SHAPES.items()}
for one in WAVEFORMS.values():
    MEANINGS["Drive"] |= one.means or {}

# what makes a key necessary where neither its table alone nor a selector does
CONDITIONS = {
    "contact.load": "unless [contact.approach]",
    "contact.load_line.offset": "unless moment",
    "contact.holder.rotational_stiffness": "unless tangential_stiffness",
    "normal.amplitude": "beside frequency",
    "normal.frequency": "beside amplitude",
    "normal.width": "beside friction.spread",
    "friction.rest_growth": "beside slip_growth",
    "friction.slip_growth": "beside rest_growth",
    "structure.moving_mass": "beside modes",
    "drive.acceleration": "kind `base` unless displacement, levels or a file",
    "drive.displacement": "kind `free` unless [structure.start]",
    "drive.force": "kind `force` unless a file",
    "drive.onset_length": "onset `gauge`",
    "measured.reading_cutoff": "reading `lowpass`",
    "drive.rate": "waveform `sweep` unless log_rate",
    "drive.cycles": "unless duration, a sweep or a file",
}


def meaning(model: type, key: str) -> str:
    """What a key of a table means; KeyError where no sentence stands here."""
    for one in model.__mro__:
        if key in MEANINGS.get(one.__name__, {}):
            return MEANINGS[one.__name__][key]
    raise KeyError(f"no meaning of {model.__name__}.{key} in scene/keys/meanings.py")
