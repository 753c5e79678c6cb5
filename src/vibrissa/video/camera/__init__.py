"""The virtual camera: scene, head and fur, transmission of light, noise, rendered frames."""
