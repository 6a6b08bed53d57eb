"""Terms of the glossary that are no measures: term -> its meaning in a sentence or two."""

TERMS = {
    "asperities": "The peaks of a rough surface. `[contact.asperities]` puts them as a compliant layer between the "
                  "pieces.",
    "backbone": "Frequency and damping ratio of a mode over its amplitude. `patchfem backbone` computes it.",
    "bench": "A run whose slide is prescribed: `[friction]` with `[slide]` and a load. The friction loop comes out.",
    "bond": "One small connection of the nonlocal law between both surfaces: it forms where a point slides, stretches "
            "and breaks within some bond lengths.",
    "bond length": "The slide over which a bond forms and breaks; the key `bond_length`, ε₀ in equations.",
    "bonded stiffness": "A spring beside the contact that carries load past it; the table `[structure.bonded]`.",
    "breakaway": "The share of a bond's length over which it stretches without damage.",
    "condensed": "Reduced to the nodes of the interface by static condensation: the inside of a piece is eliminated "
                 "without a loss of accuracy.",
    "crown": "A rounding of a face: the gap grows with the square of the distance from its middle.",
    "drive": "What sets the rig in motion: an accelerated base, a force, or a release.",
    "dwell": "A rest between two slides of a bench, during which bonds age.",
    "effect": "A part of the model that a scene turns on by naming its table or value.",
    "error bar": "The estimated numerical error of a measure, a half-width. It is meant to hold in 19 of 20 scenes. "
                 "It knows nothing of what the model leaves out.",
    "flutter": "Vibration that grows by itself because a mode has a negative damping ratio.",
    "free and held rotation": "A piece is held when its rotation is prescribed, free when it turns until the moment of "
                              "the pressure balances the load line.",
    "friction coefficient": "Largest friction force over normal load: `static` before slip, `kinetic` while slipping.",
    "friction loop": "Friction force against slide over a cycle. Its area is the energy that a cycle turns into heat.",
    "gap": "The distance between the two faces before they are loaded.",
    "groups": "Dimensionless numbers that `patchfem plan` prints. D is friction limit over the drive's inertia force, "
              "μN/(moving mass · a).",
    "holder": "What grips the far face of a piece. `[contact.holder]` gives it springs.",
    "interface": "The surface at which two pieces touch and rub, or the joint between two masses.",
    "ladder": "The order of the package's folders: each imports only those before it.",
    "load line": "The line along which the load acts; off the middle of the patch it turns a free piece.",
    "macro-slip": "Slip of the whole interface at once; also gross slip.",
    "march": "Time integration of the motion, step by step.",
    "micro-slip": "Slip of a part of the interface while the rest sticks; also partial slip.",
    "outcome": "How a run ended, in one word: `steady`, `stuck`, `transient`, `grows`, `done` and others.",
    "own law": "A law of friction that you add. It takes three files: [how to add one](../../../patchfem/ADDING.md).",
    "patch": "The area in which two pieces are pressed together.",
    "path": "The length of the relative slide of a point since a bond formed, counted without its sign.",
    "reading of an instrument": "What an accelerometer or a gauge shows of a motion: its peak, its first harmonic or "
                                "its effective value.",
    "reading of the law": "One of two ways to understand equation 2.17: `stretch`, which never creates energy, or "
                          "`report`, as printed.",
    "rig": "Contact, modes and drive together: the friction moves the modes, and the modes move the contact.",
    "rms log error": "Root mean square of ln(computed/measured). 0.1 is a typical deviation of 10 %.",
    "scene": "The input file: TOML tables that say what is computed.",
    "shear modes": "Shapes by which the pieces give way in shear; their number follows from the tolerance.",
    "skin": "The compliant rough layer of `[contact.asperities]`.",
    "stick": "The state of a contact, or of a part of it, that does not slip.",
    "stiffness chain": "The springs in series from the holder to the interface, as `patchfem plan` prints them.",
    "strip": "One of several slices of the patch side by side over its width, `[contact.strips]`.",
    "stuck and free frequency": "Frequencies of a mode with the contact sticking and without any contact. All measured "
                                "frequencies of the joint lie between them.",
    "sweep": "One scene run for many values of its keys. A *swept sine*, by contrast, is a drive whose frequency "
             "rises or falls: `waveform = \"sweep\"`.",
    "tilt": "The angle between both faces before they are loaded; `[contact.tilt]`, sometimes misalignment.",
    "tolerance": "The relative error that every measure is to keep to, `accuracy.tolerance`. Mesh, time step and modes "
                 "follow from it.",
}
