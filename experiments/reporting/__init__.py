"""Rows to files: results, tables, figures and what produced them.

Only the layout is offered here, because each worker imports it with its study; what draws and writes is imported by
the driver from its own module.
"""

from experiments.reporting.layout import Column, Curve, FigurePage, Layout, Montage, Numbers, Plot, Section, Times

__all__ = ["Column", "Curve", "FigurePage", "Layout", "Montage", "Numbers", "Plot", "Section", "Times"]
