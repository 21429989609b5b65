"""All claims of the paper that are tested, in its order, and what it also says."""

from __future__ import annotations

from experiments.reporting.claims import acquisition, results, settling

CLAIMS = (
    acquisition.DETECTOR,
    acquisition.CULLING,
    acquisition.TEXTURES,
    acquisition.ACCURACY,
    settling.RESTITUTION,
    settling.HALVING,
    settling.STIFF_EULER,
    settling.FASTEST,
    settling.INSTABILITY,
    settling.ENERGY,
    acquisition.HIGH_RESOLUTION,
    results.MINUTE,
    results.DISTANCE,
    results.READING,
    results.STIFFNESS,
    results.CONCLUSION,
)

UNTESTED = (
    "that the setup costs little and is easy for non-experts to use (sections 2.1 and 5)",
    "that pictures under several lights can be combined into new ones (2.4): they are, in the report on textures, but "
    "the paper says nothing that a figure could be held against",
    "that shading, which is left in, does not disturb the comparison of corners (3.5, 4.1)",
    "that the method serves documents deformed in ways that no model describes (3)",
)
"""What the paper also says, and no figure here is for."""
