"""What the pages for reviewers say of sheets, rig and rules is what the code does."""

from __future__ import annotations

import re
from inspect import signature
from pathlib import Path

import numpy as np
import pytest

import data_synth
from data_synth import N_CRUMPLES, N_LETTERS, N_SHIPPED, PAGE_SIZE_MM, Checkerboard, RigConfig, materials
from data_synth.crumples import SHIPPED, crumple_path
from data_synth.pages import INK_ALBEDO, PAPER_ALBEDO
from data_synth.physical import Paper
from experiments.hidden_seeds import N_OPEN
from experiments.settings import SheetSettings

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("ARTIFACT.md", "DATASHEET.md", "REFORMS.md", "RULES.md")


def text_of(name: str) -> str:
    return " ".join((ROOT / name).read_text().split())


def test_the_datasheet_states_the_sheets_and_pages_as_they_are() -> None:
    board, folds = Checkerboard(), signature(data_synth.crumpled).parameters["n_folds"].default
    said = (
        f"{PAGE_SIZE_MM[0]:g} x {PAGE_SIZE_MM[1]:g} mm",
        f"{board.squares[0]} x {board.squares[1]} squares of {board.square_mm:g} mm",
        f"({board.corners.size // 2} inner corners)",
        f"{N_LETTERS} letters",
        f"{folds[0]} to {folds[1]} sharp mirror folds",
        f"{SheetSettings().slope_p90_deg:g} by default",
        f"Paper reflects {PAPER_ALBEDO} of the light, ink {INK_ALBEDO}",
        f"{N_CRUMPLES} shipped",
        f"{N_SHIPPED} shipped of each",
        f"{Paper().thickness_mm:g} mm thick",
    )
    assert [words for words in said if words not in text_of("DATASHEET.md")] == []


def test_the_datasheet_states_the_rig_as_it_is() -> None:
    rig = data_synth.default_rig()
    config: RigConfig = rig.config
    assert (config.exposures, config.late_share_max, config.repeated_share) == (1, 0, 0)
    said = (
        f"Gaussian blur of {config.camera_psf_sigma_px} px",
        f"{rig.camera.size[0]} x {rig.camera.size[1]} pixels at 800 mm",
        f"gamma {config.projector_gamma}",
    )
    assert [words for words in said if words not in text_of("DATASHEET.md")] == []
    assert -(rig.camera.R.T @ rig.camera.t)[2] == pytest.approx(800.0)


def test_the_datasheet_states_the_shipped_crumples_as_they_are() -> None:
    sheets = [np.load(crumple_path(i, SHIPPED), allow_pickle=False) for i in range(N_CRUMPLES)]
    found = {name: [float(sheet[name]) for sheet in sheets] for name in sheets[0].files if sheets[0][name].ndim == 0}
    mean, text = [100 * value for value in found["strain_mean"]], text_of("DATASHEET.md")
    assert f"by {min(mean):.3f} to {max(mean):.3f} % in the mean" in text
    assert f"up to {100 * max(found['strain_max']):.1f} %" in text
    assert 0.20 < 100 * max(found["strain_p99"]) < 0.21
    slopes, relief = found["slope_p90_deg"], found["relief_mm"]
    assert f"p90 slope {min(slopes):.0f} to {max(slopes):.0f} degrees" in text
    assert f"relief {min(relief):.0f} to {max(relief):.0f} mm" in text


def test_sheets_of_two_materials_changed_by_two_per_cent_in_the_mean() -> None:
    changes = [
        abs(float(np.load(path, allow_pickle=False)["change_percent"]))
        for path in sorted(SHIPPED.glob("two_materials_[AB]_*.npz"))
    ]
    assert len(changes) == 2 * N_SHIPPED == 2 * materials.N_SHIPPED
    assert np.mean(changes) == pytest.approx(2.0, abs=0.1)


def test_the_rules_name_the_open_seeds() -> None:
    assert f"0 to {N_OPEN - 1}" in text_of("RULES.md")
    assert f"from {N_OPEN} to 2^32 - 1" in text_of("RULES.md")


@pytest.mark.parametrize("name", PAGES)
def test_every_file_that_a_page_links_to_is_there(name: str) -> None:
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", (ROOT / name).read_text()) if "://" not in link]
    assert len(links) >= 2
    assert [link for link in links if not (ROOT / link).exists()] == []
