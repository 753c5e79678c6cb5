"""The multiwhisker stimulator: commands that replay a texture's vibration, on 24 whiskers."""
