"""The contact's way along a surface: where it sticks, glides and jumps.

`gap_events` takes gaps in a flat; `episodes` any height profile, upon `events`, `clearance` and `profile_tables`.
Other rooms use the first two.
"""
