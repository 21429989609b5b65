"""The whole file: head, contents, sections, and a policy under which no browser lets it ask for anything."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from hashlib import sha256
from html import escape
from pathlib import Path

from experiments.page.markup import inline, slug
from experiments.page.reports import reports_html
from experiments.page.runs import Run
from experiments.page.sheet import sheet_html
from experiments.page.verdicts import JudgedClaim, claims_html, summary_html
from experiments.studies.falling_sheet import FallingSheet

FRONT = Path(__file__).parent / "front"

_LEAD = (
    "M. S. Brown and W. B. Seales flattened crumpled manuscripts by simulating paper under gravity: scan the page’s 3D "
    "shape, let it fall as a mesh of springs, texture what lies flat. This page holds what came of doing all of it "
    "again on a synthetic rig, where the truth is known."
)
_SHEET = (
    "A crumpled manuscript, photographed by the rig under five lights, scanned by striped light and flattened by the "
    "paper’s dynamics. Move the slider: these are states that the solver passed through. The page was rendered, "
    "scanned and measured when this file was made."
)
_CLAIMS = (
    "Each claim with the paper’s words, its test, the figures and the rule that judges them. Ours is by the paper’s "
    "own method where a claim is about a method; best is this project’s best method on the same trials."
)
_THEMES = (("auto", "Auto"), ("light", "Light"), ("dark", "Dark"))


def document(runs: Sequence[Run], claims: Sequence[JudgedClaim], sheet: FallingSheet) -> str:
    """Return the report as one HTML file.

    Parameters
    ----------
    runs : sequence of Run
        The reports.
    claims : sequence of JudgedClaim
        The paper's claims, judged by them.
    sheet : FallingSheet
        What the three-dimensional view shows.
    """
    style = (FRONT / "report.css").read_text(encoding="utf-8")
    scripts = [(FRONT / "built" / name).read_text(encoding="utf-8") for name in ("page.js", "sheet.js")]
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_policy(style, scripts)}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="referrer" content="no-referrer">\n'
        f"<title>deskew: the paper’s claims, measured</title>\n<style>{style}</style>\n"
        f"<script>{scripts[0]}</script>\n</head>\n<body>\n"
        f'<a class="skip" href="#summary">Skip to the summary</a>\n{_contents(runs)}\n'
        f"<main>{_sections(runs, claims, sheet)}</main>\n<script>{scripts[1]}</script>\n</body>\n</html>\n"
    )


def _policy(style: str, scripts: Sequence[str]) -> str:
    """Allow the page's own style and scripts by their digests, pictures within it, and nothing else."""
    allowed = " ".join(_digest(script) for script in scripts)
    return (
        f"default-src 'none'; script-src {allowed}; style-src {_digest(style)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _digest(text: str) -> str:
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"


def _contents(runs: Sequence[Run]) -> str:
    themes = "".join(
        f'<label class="choice"><input type="radio" name="theme" value="{value}"><span>{text}</span></label>'
        for value, text in _THEMES
    )
    first = [("summary", "Summary"), ("claims", "The paper’s claims"), ("sheet", "A page falls flat")]
    links = "".join(f'<li><a href="#{anchor}">{text}</a>' for anchor, text in first)
    reports = "".join(f'<li><a href="#{slug(run.name)}">{escape(_short(run))}</a>' for run in runs)
    return (
        '<nav class="contents" aria-label="Contents"><details open><summary>deskew: report</summary><div class="body">'
        f'<fieldset class="theme"><legend>Colours of the page</legend>{themes}</fieldset><ol>{links}</ol>'
        f'<p class="group">Experiments</p><ol>{reports}</ol></div></details></nav>'
    )


def _short(run: Run) -> str:
    return run.name.replace("_", " ").capitalize().replace("Ocr", "OCR")


def _sections(runs: Sequence[Run], claims: Sequence[JudgedClaim], sheet: FallingSheet) -> str:
    days = sorted(day for run in runs if (day := run.day) is not None)
    when = f", run from {days[0]:%d.%m.%Y} to {days[-1]:%d.%m.%Y}" if days else ""
    return (
        f"<header><h1>Document restoration using 3D shape, reproduced</h1><p class=lead>{_LEAD}</p>"
        f'<p class="soft small">From {len(runs)} experiments{when}. Every figure and every number below is made from '
        "the files of the run that stands beside it.</p></header>"
        f'<section id="summary"><h2>Summary</h2>{summary_html(claims)}</section>'
        f'<section id="claims"><h2>The paper’s claims</h2><p>{inline(_CLAIMS)}</p>{claims_html(claims)}</section>'
        f'<section id="sheet"><h2>A page falls flat</h2><p>{inline(_SHEET)}</p>{sheet_html(sheet)}</section>'
        f"{reports_html(runs)}"
    )
