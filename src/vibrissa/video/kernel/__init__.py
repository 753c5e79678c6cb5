"""The tracking kernel: sub-pixel centrelines in a block of frames, in compiled code.

`estimators` are the sub-pixel estimators, `centreline` a line in one frame, `tracking_kernel` a block of frames.
"""
