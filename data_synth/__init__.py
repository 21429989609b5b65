"""The synthetic rig: sheets of known shape, pages of known print, and a bench that photographs them with the truth.

It shares no mathematics with the reconstruction, so that a common error cannot cancel.
"""

from data_synth.balls import BallPlate, ball_plate
from data_synth.boards import BOARD, BoardPose, board_poses, render_board
from data_synth.crumples import N_CRUMPLES, drawn_crumple, shipped_crumple
from data_synth.folds import View, crumpled
from data_synth.kontron import KONTRON_SIZE, PAL_SIZE, kontron_light, kontron_readout, manuscript_rig
from data_synth.leaf import Leaf
from data_synth.lettering import glyph, pseudo_words
from data_synth.lights import Format, Light, standard_lights
from data_synth.manuscript import Layer, Lettered, Manuscript, hidden_manuscript
from data_synth.materials import (
    N_SHIPPED,
    Case,
    TwoMaterials,
    draw_two_materials,
    read_two_materials,
    shipped_two_materials,
)
from data_synth.pages import Blank, Checkerboard, Page, board_page
from data_synth.patterns import default_fringes
from data_synth.refinement import refined
from data_synth.render import photograph, render
from data_synth.rig import Rig, RigConfig, default_rig
from data_synth.sheets import PAGE_SIZE_MM, TrueSheet, dome, flat_sheet, plane, posed, tent
from data_synth.texts import N_LETTERS, Text, page_words
from data_synth.truth import Truth, true_sheet_seen
from data_synth.vellum import VellumPage

__all__ = [
    "BOARD",
    "KONTRON_SIZE",
    "N_CRUMPLES",
    "N_LETTERS",
    "N_SHIPPED",
    "PAGE_SIZE_MM",
    "PAL_SIZE",
    "BallPlate",
    "Blank",
    "BoardPose",
    "Case",
    "Checkerboard",
    "Format",
    "Layer",
    "Leaf",
    "Lettered",
    "Light",
    "Manuscript",
    "Page",
    "Rig",
    "RigConfig",
    "Text",
    "TrueSheet",
    "Truth",
    "TwoMaterials",
    "VellumPage",
    "View",
    "ball_plate",
    "board_page",
    "board_poses",
    "crumpled",
    "default_fringes",
    "default_rig",
    "dome",
    "draw_two_materials",
    "drawn_crumple",
    "flat_sheet",
    "glyph",
    "hidden_manuscript",
    "kontron_light",
    "kontron_readout",
    "manuscript_rig",
    "page_words",
    "photograph",
    "plane",
    "posed",
    "pseudo_words",
    "read_two_materials",
    "refined",
    "render",
    "render_board",
    "shipped_crumple",
    "shipped_two_materials",
    "standard_lights",
    "tent",
    "true_sheet_seen",
]
