"""Tracks of other programs: WHISK, WhiskiWrap, DeepLabCut, SLEAP and others.

`tracks` is the entry and chooses the reader by the file.
"""
