"""The body of the report: each run with what produced it, its figures and its tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from experiments.page.markup import blocks_html, element, inline, slug
from experiments.page.pictures import Picture, figure_picture
from experiments.page.runs import Run
from experiments.reporting import Layout
from experiments.reporting.blocks import Heading
from experiments.reporting.commands import command

# A page of pictures, or panels side by side, wants the whole width, and scrolls on a narrow screen.
_BROAD_PX = 1000


def reports_html(runs: Sequence[Run]) -> str:
    """Return a section a run."""
    return "".join(_report(run) for run in runs)


def made(run: Run) -> str:
    """Say when and from what a run was made."""
    day = run.day
    when = f"{day.day} {day:%B %Y}, " if day is not None else ""
    changed = ", with changes since" if run.about.get("changed_since_commit") else ""
    return f"{when}commit {run.commit}{changed}"


def _report(run: Run) -> str:
    heading, *blocks = run.blocks()
    assert isinstance(heading, Heading)
    name = slug(run.name)
    head = element("h2", f'{inline(heading.text)} <span class="soft small">{escape(run.name)}</span>')
    failed = len({(f.trial, f.condition, f.method) for f in run.failures})
    seed = run.about["config"]["seed"]
    facts = f"{made(run)}; seed {seed}, {_many(run.n_trials, 'trial')}, {_many(failed, 'failed row')}"
    again = command(run.about, run.n_trials, f"out/{run.name}")
    about = f'<p class="soft small">{escape(facts)}. Made by {element("code", escape(again))}</p>'
    note, *tables = blocks
    parts = blocks_html([note], run.name) + _figures(run) + blocks_html(tables, run.name)
    return f'<section id="{name}">{head}{about}{parts}</section>'


def _many(n: int, what: str) -> str:
    return f"{n or 'no'} {what}{'' if n == 1 else 's'}"


def _figures(run: Run) -> str:
    captions = _captions(run.layout)
    pictures = [(path, figure_picture(path)) for path in run.figures]
    # Broad ones first: the others then stand two in a row without gaps.
    pictures.sort(key=lambda item: item[1].width <= _BROAD_PX)
    figures = "".join(_figure(run, captions, *item) for item in pictures)
    return element("div", figures, class_="gallery") if figures else ""


def _figure(run: Run, captions: Mapping[str, str], path: Path, picture: Picture) -> str:
    text = captions.get(path.stem, path.stem.replace("_", " "))
    text = text[:1].upper() + text[1:]
    broad = picture.width > _BROAD_PX
    image = (
        f'<img src="{picture.source}" width="{picture.width}" height="{picture.height}" '
        f'alt="{escape(text)}" loading="lazy" decoding="async">'
    )
    # What scrolls has to be reached by keyboard.
    scrolled = {"tabindex": "0", "role": "group", "aria_label": f"Figure: {text}"} if broad else {}
    box = element("div", image, class_="picture wide" if broad else "picture", **scrolled)
    caption = f"{inline(text)}. From {escape(run.name)}/figures/{escape(path.name)}: {escape(made(run))}."
    return element("figure", box + element("figcaption", caption), class_="broad" if broad else "plain")


def _captions(layout: Layout) -> dict[str, str]:
    """Return what each figure of a layout shows, by its name."""
    return {
        **{plot.name: f"{plot.label}: a dot a trial, a bar their median" for plot in layout.plots},
        **{curve.name: f"{curve.y_label} against {curve.x_label}" for curve in layout.curves},
        **{diagram.name: diagram.title for diagram in layout.diagrams},
        **{shares.name: f"{shares.title}, by {shares.label}" for shares in layout.shares},
        **{ladder.name: ladder.title for ladder in layout.ladders},
        **{page.name: page.title for page in layout.pages},
        **{wall.name: wall.caption or _pictures_on(wall.lines) for wall in layout.montages},
    }


def _pictures_on(lines: Sequence[tuple[str, str]]) -> str:
    return f"From top to bottom: {', '.join(heading for heading, _ in lines)}; a column a page"
