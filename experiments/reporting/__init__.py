"""Rows to files: results, tables, figures and what produced them.

Only the layout is offered here, because each worker imports it with its study; what draws and writes is imported by
the driver from its own module.
"""

from experiments.reporting.figure_layout import (
    Curve,
    Diagram,
    FigurePage,
    Ladder,
    Montage,
    Numbers,
    Panel,
    Plot,
    Shares,
)
from experiments.reporting.layout import Changes, Column, Layout, Section, Tails, Times, Versus

__all__ = [
    "Changes",
    "Column",
    "Curve",
    "Diagram",
    "FigurePage",
    "Ladder",
    "Layout",
    "Montage",
    "Numbers",
    "Panel",
    "Plot",
    "Section",
    "Shares",
    "Tails",
    "Times",
    "Versus",
]
