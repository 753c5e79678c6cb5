"""From a tracked movie back to posture, modal amplitudes, resonances and stiffness.

`stationary_posture` fits Eq. 1 to the mean profile, `decomposition` gives modal amplitudes,
`resonance` fits their spectra.
Other rooms use these and `length_and_stiffness`.
"""
