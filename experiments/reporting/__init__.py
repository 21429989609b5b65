"""Rows to files: results, tables, figures and what produced them.

Only the layout is offered here, because each worker imports it with its study; what draws and writes is imported by
the driver from its own module.
"""

from experiments.reporting.layout import (
    Column,
    Curve,
    Diagram,
    FigurePage,
    Layout,
    Montage,
    Numbers,
    Panel,
    Plot,
    Section,
    Shares,
    Times,
)

__all__ = [
    "Column",
    "Curve",
    "Diagram",
    "FigurePage",
    "Layout",
    "Montage",
    "Numbers",
    "Panel",
    "Plot",
    "Section",
    "Shares",
    "Times",
]
