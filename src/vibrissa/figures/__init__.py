"""The paper's figures: ``compute`` does the science, ``draw`` only draws."""
