"""What the symbols of the page mean, and what each control does, in a sentence each."""

from __future__ import annotations

SYMBOLS = {
    "A, B": "Two textures. All pictures but the last show A.",
    "L": "Length of the whole cone, from its (missing) point to the base [mm].",
    "α": "Cone angle: radius at the base over L [mrad]. The taper makes a whisker stiff at its base.",
    "ε": "Place of the contact along the shaft: 0 at the point of the cone, 1 at the base.",
    "H": "Distance from the whisker pad, which holds the base, to the surface [mm].",
    "θ_b": "Angle of the shaft at its base to the surface [rad].",
    "μ": "Coefficient of friction between whisker and surface.",
    "v": "Speed at which the surface passes the whisker [mm/s].",
    "ζ": "Damping ratio: 0 rings for ever, 1 does not ring.",
    "E, ρ": "Young's modulus and density of the whisker.",
    "d": "Excursion: how far the surface has carried the contact from its place of rest [µm].",
    "q": "Modal amplitude q₁, q₂, q₃: how strongly the mode of that number vibrates [µm]; q_i is any of them.",
    "Q(d)": "What the bending of the shaft by the excursion d adds to q, without any vibration [µm].",
    "κ": "Frequency of resonance without unit; the frequency in Hz is κ over 2π times the time scale of the whisker.",
    "dB": "Decibel: 10 dB is ten times the power.",
    "d′": "How well two textures are distinguished: difference of means over standard deviation; 1 is fair, 3 is sure.",
    "Contact": "Where the whisker touches the surface; of several places the one nearest to the base.",
    "Envelope, env.": "The slowly varying size of a fast vibration.",
    "Follicle": "The root of the whisker in the skin, where its nerve endings are.",
    "Free end": "What of the shaft lies beyond the contact, up to the tip.",
    "Gap": "A groove of the surface. To bridge it is to lie on both its sides.",
    "Jump": "The contact leaves one edge and is caught by the next.",
    "Mode": "One of the shapes in which a whisker vibrates, each at its own frequency; mode 1 is the slowest.",
    "Pinned cone": "The whisker as a straight cone, held at its base and kept from moving up and down at its contact.",
    "rms": "Root mean square: the typical size of heights about their mean.",
    "Rod": "The whole whisker, free end too, which touches the surface wherever it reaches it.",
    "Seed": "Number of a random draw.",
    "Threshold": "The envelope above which the simulated neuron fires faster than its baseline.",
    "Trial": "One of twelve repetitions of the same scan; a stroke is a spike.",
    "mm, µm": "Millimetre; micrometre, a thousandth of it.",
    "nN m, 1/m": "Nanonewton metre, of a bending moment; one over the radius of a curve, of its curvature.",
    "ms, Hz": "A thousandth of a second; vibrations, or spikes, in a second.",
    "rad, mrad": "An angle of 57 degrees; a thousandth of it.",
    "GPa, kg/m³": "A billion newtons per square metre, of a stiffness; kilograms in a cubic metre, of a density.",
}

ABOUT = {
    "whisker": "A measured rat whisker by its place on the face, or a cone of your own numbers.",
    "length": "Long whiskers ring at low frequencies.",
    "cone_angle": "A wider cone is stiffer and rings faster.",
    "tip": "How much of the cone is missing at its point; at ε nothing lies beyond the contact.",
    "youngs_modulus": "Stiffness of the material.",
    "density": "A heavier material rings slower.",
    "hold": "Fix either the height of the base, or the place of the contact on the shaft.",
    "height": "Closer to the surface the whisker bends more and touches nearer to the base.",
    "contact": "A contact nearer to the base raises every resonance.",
    "base_angle": "At a steep angle the shaft bends strongly.",
    "friction": "More friction drags the contact further before it jumps.",
    "speed": "A faster surface makes the contact jump more often.",
    "model": "One contact alone, or the whole whisker as a rod that touches the surface wherever it reaches it.",
    "damping": "With little damping the whisker rings long after each jump.",
    "threshold": "Below it the envelope does not raise the rate.",
    "slope": "How fast the rate rises above the threshold.",
    "baseline": "The rate without vibration.",
    "kind": "What the surface is made of.",
    "seed": "Number of the random draw: another seed is another surface of the same kind.",
    "period": "Mean distance from one gap to the next.",
    "duty": "Share of a period that is gap.",
    "depth": "Depth of the gaps.",
    "rms": "Typical height of the roughness.",
    "amplitude": "Height of the wave above its mean.",
    "file": "A table of gaps or heights, or a profilometer's file.",
    "a.length": "How long the surface is.",
    "b.length": "How long the surface is.",
}


def about(name: str) -> str:
    """What a control does.

    Parameters
    ----------
    name : str
        Of the control; of a texture's with its letter.

    Returns
    -------
    str
        One sentence.
    """
    return ABOUT.get(name) or ABOUT[name.rpartition(".")[2]]
