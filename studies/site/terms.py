"""Terms of the glossary that are no measures: term -> its meaning in a sentence or two."""

TERMS = {
    "asperities": "The peaks of a rough surface. `[contact.asperities]` models them as a compliant layer between the "
    "pieces.",
    "backbone": "The curves of frequency and damping ratio of a mode against its amplitude. `patchfem backbone` "
    "computes these curves.",
    "bench": "A run whose slide is prescribed. The scene contains `[friction]`, `[slide]` and a load. A bench gives "
    "the friction loop.",
    "bond": "In the nonlocal law, a link between the two surfaces. Bonds form as a point of the surface slides. A "
    "bond stretches and then breaks within a few bond lengths.",
    "bond length": "In the nonlocal law, the slide over which a bond forms and breaks: the key `bond_length`, ε₀ in "
    "equations.",
    "bonded stiffness": "The stiffness of a spring in parallel with the contact, given in the table "
    "`[structure.bonded]`.",
    "breakaway": "The fraction of the bond length over which a bond stretches without damage, given by the key "
    "`breakaway`.",
    "condensed": "A condensed stiffness matrix is reduced to the nodes of the interface by static condensation. The "
    "interior nodes of a piece are eliminated without loss of accuracy.",
    "crown": "A rounded shape of a face. The gap grows with the square of the distance from the middle of the crown.",
    "drive": "What causes the motion of the rig: an accelerated base, a force, or a release.",
    "dwell": "A rest between two parts of a prescribed slide. Bonds age during the rest.",
    "effect": "A part of the model. An effect is included in a run if the scene contains the table or the value of "
    "this effect.",
    "error bars": "The estimated numerical errors of the measures, each given as a half-width. An error bar should be "
    "larger than the true numerical error in 19 of 20 scenes. An error bar does not include what the "
    "model neglects. See [how far to trust it](../trust.md).",
    "flutter": "Vibration that grows without a drive because a mode has a negative damping ratio.",
    "free and held rotation": "The rotation of a piece is held if the scene prescribes the rotation. The rotation is "
    "free if the piece rotates until the moment of the pressure balances the moment of the "
    "load.",
    "friction coefficient": "Limit of the friction force divided by the normal load: `static` before slip, `kinetic` "
    "during slip.",
    "friction law": "The equation that gives the shear stress from normal stress and slide: the key `friction.law`. "
    "[The guide](../../../patchfem/scene/GUIDE.md#the-friction) compares all laws; [my own "
    "law](../tasks/own_law.md) shows how to add a law.",
    "friction loop": "The curve of friction force against slide over one cycle. The area of the loop is the energy "
    "dissipated per cycle.",
    "gap": "The distance between the two faces before the pieces are loaded.",
    "groups": "Dimensionless numbers that `patchfem plan` prints. For example, the group D is the friction limit μN "
    "divided by the inertia force of the drive: D = μN/(moving mass · a), where a is the acceleration "
    "amplitude of the base.",
    "holder": "The rigid body to which the far face of a piece is bonded. `[contact.holder]` adds springs between the "
    "far face and the holder.",
    "how long will it take": "`patchfem plan SCENE` estimates the computing time before a run or sweep starts. [What "
    "does accuracy cost?](../../notebooks/accuracy_time.ipynb) shows how the computing time "
    "grows with accuracy; `patchfem cost` measures the computing time at several accuracies.",
    "import my modes": "`patchfem import` computes modes from the records of a test, or reads modes from files of "
    "other programs, and writes the table `[structure]` of a scene: see [laboratory "
    "records](../../../patchfem/scene/GUIDE.md#laboratory-records).",
    "interface": "The surface at which two pieces touch and slide, or the joint between two masses.",
    "jump of wear": "Many cycles of wear that are computed in one step (key `wear.jumps`). One cycle is computed; the "
    "wear of this cycle is multiplied by the number of cycles in the jump.",
    "ladder": "The order of the folders of the package: the code in a folder imports only from folders that come "
    "earlier in this order.",
    "load line": "The line along which the load acts. If the load line does not pass through the middle of the patch "
    "and the rotation of the piece is free, the load rotates the piece.",
    "macro-slip": "Slip of the whole interface at once, also called gross slip.",
    "march": "Time integration of the motion, step by step.",
    "micro-slip": "Slip of a part of the interface while the rest sticks, also called partial slip.",
    "outcome": "How a run ended, in one word: `steady`, `stuck`, `transient`, `grows`, `done` and others.",
    "own law": "A law of friction that you add, in three files: see [my own law of friction](../tasks/own_law.md).",
    "patch": "The area in which two pieces are pressed together.",
    "path": "The total length that a point of the interface has slid; sliding in either direction makes the path "
    "longer. In the nonlocal law, R is the part of the path since a bond formed.",
    "prescribed slide": "A relative motion of the two surfaces that the table `[slide]` gives.",
    "preload": "The load that presses the pieces together before they slide, such as the tension of a bolt: "
    "`contact.load`. See [questions](../questions.md#bolt-preload).",
    "reading of an instrument": "The value that an accelerometer or a gauge shows: the peak of a motion, the "
    "amplitude of its first harmonic or its root mean square.",
    "reading of the law": "One of two versions of equation 2.17: `stretch`, which never creates energy, or `report`, "
    "the equation as printed in the report.",
    "rig": "Contact, modes and drive together. The friction force acts on the modes, and the motion of the modes "
    "moves the surfaces of the contact.",
    "rms log error": "Root mean square of ln(computed value/measured value). An rms log error of 0.1 means a typical "
    "deviation of 10 %.",
    "scene": "The input file. Its TOML tables say what is computed.",
    "shear modes": "Shapes in which the pieces deform in shear; the shear deformation is a sum of these shapes. The "
    "number of shear modes follows from the tolerance.",
    "skin": "The compliant rough layer of `[contact.asperities]`.",
    "slide": "The displacement of the upper surface minus the displacement of the lower surface. `[slide]` prescribes "
    "it in a bench.",
    "slip": "The irreversible part of the slide. While an interface with elastic bonds sticks, its slide changes and "
    "its slip does not.",
    "stick": "The state without slip, of a whole contact or of a part of a contact.",
    "stick-slip": "A motion in which an interface sticks and slips in turns. See "
    "[questions](../questions.md#stick-slip).",
    "stiffness chain": "The springs that act in series between the holder and the interface. `patchfem plan` prints "
    "their stiffnesses.",
    "strip": "A part of the patch. `[contact.strips]` divides the width of the patch into strips that lie side by "
    "side.",
    "stuck and free frequency": "The stuck frequency is the frequency of a mode while the contact sticks. The free "
    "frequency is the frequency of the mode without contact. The frequencies measured on "
    "the joint lie between these two frequencies.",
    "sweep": "Many runs of one scene with different values of one or more keys. A *swept sine*, by contrast, is a "
    'drive whose frequency rises or falls: `waveform = "sweep"`.',
    "tilt": "The angle between the two faces before the pieces are loaded: the table `[contact.tilt]`. A tilt is also "
    "called misalignment.",
    "tolerance": "The relative error that no measure should exceed: `accuracy.tolerance`. The mesh, the time step and "
    "the number of modes follow from the tolerance.",
    "transient": "The part of a motion that dies away before the motion becomes steady; also the outcome of a run that "
    "ends in this part because its motion did not settle. See "
    "[questions](../questions.md#the-motion-did-not-settle).",
}
