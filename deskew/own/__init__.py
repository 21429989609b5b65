"""Anybody's method in a process of its own: arrays in, arrays out, under limits, and out of reach of what called it.

`methods.own_method` makes such a method; `process` starts and ends the process and `confinement` holds it to its
limits; `exchange` turns what is passed into arrays; `child` is what runs in there. Nothing is imported here: the child
comes this way too, and ought to start fast.
"""
