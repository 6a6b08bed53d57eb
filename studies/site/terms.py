"""Terms of the glossary that are no measures: term -> its meaning in a sentence or two."""

TERMS = {
    "asperities": "The peaks of a rough surface. `[contact.asperities]` models them as a compliant layer between the "
                  "pieces.",
    "backbone": "Frequency and damping ratio of a mode against its amplitude. `patchfem backbone` computes these "
                "curves.",
    "bench": "A run whose slide is prescribed: `[friction]` with `[slide]` and a load. A bench gives the friction "
             "loop.",
    "bond": "In the nonlocal law, a link between the two surfaces. A bond forms when a point slides. It stretches "
            "and breaks within a few bond lengths.",
    "bond length": "The slide over which a bond forms and breaks: the key `bond_length`, ε₀ in equations.",
    "bonded stiffness": "The stiffness of a spring in parallel with the contact: the table `[structure.bonded]`.",
    "breakaway": "The fraction of the bond length over which a bond stretches without damage: the key `breakaway`.",
    "condensed": "Reduced to the nodes of the interface by static condensation. The interior of a piece is eliminated "
                 "without loss of accuracy.",
    "crown": "A rounding of a face. The gap grows with the square of the distance from the middle of the crown.",
    "drive": "What causes the motion of the rig: an accelerated base, a force, or a release.",
    "dwell": "A rest between two parts of a prescribed slide. Bonds age during the rest.",
    "effect": "A part of the model that is used if the scene contains its table or value.",
    "error bars": "The estimated numerical error of each measure, given as a half-width. An error bar should be "
                  "larger than the true numerical error in 19 of 20 scenes. An error bar does not include what the "
                  "model neglects. See [how far to trust it](../trust.md).",
    "flutter": "Vibration that grows without a drive because a mode has a negative damping ratio.",
    "free and held rotation": "The rotation of a piece is held if the scene prescribes it. The rotation is free if "
                              "the piece turns until the moment of the pressure balances that of the load.",
    "friction coefficient": "Largest friction force divided by the normal load: `static` before slip, `kinetic` while "
                            "slipping.",
    "friction law": "The equation that gives the shear stress from normal stress and slide: `friction.law`. [The "
                    "guide](../../../patchfem/scene/GUIDE.md#the-friction) compares all laws; [my own "
                    "law](../tasks/own_law.md) adds one.",
    "friction loop": "Friction force against slide over a cycle. The area of the loop is the energy dissipated per "
                     "cycle.",
    "gap": "The distance between the two faces before they are loaded.",
    "groups": "Dimensionless numbers that `patchfem plan` prints. For example, D is the friction limit divided by the "
              "inertia force of the drive, μN/(moving mass · a).",
    "holder": "The rigid body to which the far face of a piece is bonded. `[contact.holder]` adds springs between the "
              "far face and the holder.",
    "how long will it take": "`patchfem plan SCENE` estimates the seconds before a run or sweep starts. [What does "
                             "accuracy cost?](../../notebooks/accuracy_time.ipynb) shows how time grows with accuracy; "
                             "`patchfem cost` measures it.",
    "import my modes": "`patchfem import` finds modes in records of a test or in files of other programs and writes "
                       "`[structure]` for a scene: see [laboratory "
                       "records](../../../patchfem/scene/GUIDE.md#laboratory-records).",
    "interface": "The surface at which two pieces touch and rub, or the joint between two masses.",
    "jump of wear": "Many cycles of wear taken in one step: `wear.jumps`. One cycle is computed; its wear is "
                    "counted for all cycles of the jump.",
    "ladder": "The order of the folders of the package: each folder imports only the folders before it.",
    "load line": "The line along which the load acts. A load line away from the middle of the patch rotates a piece "
                 "whose rotation is free.",
    "macro-slip": "Slip of the whole interface at once, also called gross slip.",
    "march": "Time integration of the motion, step by step.",
    "micro-slip": "Slip of a part of the interface while the rest sticks, also called partial slip.",
    "outcome": "How a run ended, in one word: `steady`, `stuck`, `transient`, `grows`, `done` and others.",
    "own law": "A law of friction that you add, in three files: see [my own law of friction](../tasks/own_law.md).",
    "patch": "The area in which two pieces are pressed together.",
    "path": "The length that a point has slid since a bond formed, counted positive in both directions.",
    "prescribed slide": "The relative motion of the two surfaces as given by `[slide]`.",
    "reading of an instrument": "What an accelerometer or a gauge shows: the peak of a motion, its first harmonic or "
                                "its root mean square.",
    "reading of the law": "One of two interpretations of equation 2.17: `stretch`, which never creates energy, or "
                          "`report`, the equation as printed in the report.",
    "rig": "Contact, modes and drive together. The friction acts on the modes, and the modes move the contact.",
    "rms log error": "Root mean square of ln(computed/measured). A value of 0.1 means a typical deviation of 10 %.",
    "scene": "The input file. Its TOML tables say what is computed.",
    "shear modes": "Shapes in which the pieces deform in shear. The number of shear modes follows from the tolerance.",
    "skin": "The compliant rough layer of `[contact.asperities]`.",
    "stick": "The state of a contact, or of a part of it, without slip.",
    "stiffness chain": "The springs in series from the holder to the interface, as `patchfem plan` prints them.",
    "strip": "One of several slices of the patch that lie side by side across its width: `[contact.strips]`.",
    "stuck and free frequency": "Frequency of a mode with the contact sticking, and without contact. The measured "
                                "frequencies of the joint lie between them.",
    "sweep": "One scene run for many values of its keys. A *swept sine*, by contrast, is a drive whose frequency "
             "rises or falls: `waveform = \"sweep\"`.",
    "tilt": "The angle between the two faces before they are loaded: `[contact.tilt]`. A tilt is also called "
            "misalignment.",
    "tolerance": "The relative error that every measure should meet: `accuracy.tolerance`. Mesh, time step and number "
                 "of modes follow from the tolerance.",
}
