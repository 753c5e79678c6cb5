"""Tables of spikes, trials, stimuli and textures, and their CSV."""
