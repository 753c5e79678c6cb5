"""Tables of text: one strict reader, one table of the units in names of columns, one writer.

`reader` reads a `table` by its header, `units` knows the ends of names (``_mm``, ``_ms``), `writer` writes,
`text` gives lines and numbers; `stated` gives numbers of objects in SI, `kinds` says whose they are.

Internal: the public names are those of ``vibrissa`` itself.
"""
