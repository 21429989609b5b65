"""Links lead somewhere, functions that pages name exist, and messages that the guide explains are said."""

from __future__ import annotations

import ast
import inspect
import re
import tomllib
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from tests.docs.blocks import ROOT, prose

LINKED = (*sorted(ROOT.glob("*.md")), *sorted(ROOT.glob("docs/**/*.md")), *sorted(ROOT.glob("reports/*.md")))

_LINK = re.compile(r"\[(?:[^\[\]]|\[[^\[\]]*\])*\]\(([^()\s]+)\)")
_HEADING = re.compile(r"^#{1,6} (.+)$", re.MULTILINE)
_FUNCTION = re.compile(r"`((?:deskew|data_synth|experiments)[\w.]*):(\w+)`")
_MODULE_RUN = re.compile(r"python -m ((?:data_synth|experiments|deskew)[\w.]*)")


def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    headings = (re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text) for text in _HEADING.findall(prose(page)))
    return {re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-") for text in headings}


def broken(page: Path) -> Iterator[str]:
    for link in _LINK.findall(prose(page)):
        if "://" in link or link.startswith("mailto:"):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path) if path else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            yield link


@pytest.mark.parametrize("page", LINKED, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_to_a_file_and_a_heading(page: Path) -> None:
    assert list(broken(page)) == []


def test_a_broken_link_would_be_seen(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# A head\n[a](#a-head) [b [mm]](page.md) [c](#gone) [d](none.md)\n```sh\n[e](not/a/link)\n```\n")
    assert list(broken(page)) == ["#gone", "none.md"]


def test_every_page_of_the_folder_is_in_its_index() -> None:
    index = (ROOT / "docs/README.md").read_text()
    pages = [path for path in ROOT.glob("docs/*.md") if path.name != "README.md"]
    pages += ROOT.glob("docs/api/*.md")
    assert [str(page) for page in pages if f"({page.relative_to(ROOT / 'docs')})" not in index] == []


def named_functions() -> list[tuple[str, str]]:
    text = (ROOT / "docs/how-it-works.md").read_text()
    return sorted(set(_FUNCTION.findall(text)))


def test_the_reference_has_a_page_for_every_public_module_whose_names_all_say_what_they_are() -> None:
    pages = {page.stem: page.read_text() for page in ROOT.glob("docs/api/*.md")}
    modules = [import_module(found) for text in pages.values() for found in re.findall(r"automodule:: (\S+)", text)]
    stages = {"acquisition", "flattening", "restoration", "metrics", "io", "types", "errors", "plugins", "pipeline"}
    assert {"deskew", "data_synth", *stages} <= set(pages)
    for module in modules:
        public = getattr(module, "__all__", [name for name in vars(module) if not name.startswith("_")])
        things = [getattr(module, name) for name in public]
        ours = [thing for thing in things if getattr(thing, "__module__", "").startswith(("deskew", "data_synth"))]
        assert [thing for thing in ours if not inspect.getdoc(thing)] == [], module.__name__


def test_every_function_that_a_page_names_exists() -> None:
    found = named_functions()
    assert len(found) > 60
    assert [f"{module}:{name}" for module, name in found if not hasattr(import_module(module), name)] == []


def test_every_section_and_equation_of_the_paper_leads_to_a_function() -> None:
    """A reader finds any of them in the table: sections 2.2 to 4.3 without those that describe no computation."""
    table = (
        (ROOT / "docs/how-it-works.md").read_text().partition("## From the paper to the code")[2].partition("\n## ")[0]
    )
    rows = [line.split("|") for line in table.splitlines() if line.startswith("| ") and ":" in line.rpartition("`")[0]]
    first = " ".join(row[1] for row in rows)
    wanted = ["2.2", "2.3", "2.4", "2.5", "3.1", "3.2.1", "3.2.2", "3.3.1", "3.3.2", "3.4", "3.5", "4.1", "4.2", "4.3"]
    assert [section for section in wanted if section not in first] == []
    assert all(mark in first for mark in ("eqs. 1, 2", "eqs. 3, 4", "eq. 5"))
    assert all(_FUNCTION.search(row[4]) for row in rows)


def messages() -> list[str]:
    """Every text in the sources, what is filled in later shown as `...`."""
    found = []
    for path in (ROOT / "deskew").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.JoinedStr):
                parts = [part.value if isinstance(part, ast.Constant) else "..." for part in node.values]
                found.append("".join(map(str, parts)))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return found


def test_every_message_that_the_guide_explains_is_said_somewhere() -> None:
    table = (ROOT / "docs/capture-guide.md").read_text().partition("| it says |")[2].partition("\n\n")[0]
    said = [line.split("|")[1].strip() for line in table.splitlines()[2:]]
    assert len(said) >= 15
    texts = messages()
    for message in said:
        # What is allowed stands by itself in the sources, without the name before and what came behind.
        core = re.sub(r"^`[^`]+` must |, got .*$", "", message).replace(
            "calibration.projector.size", "calibration....size"
        )
        fragments = [part.strip() for part in re.split(r"\.\.\.|\d+", core)]
        assert any(all(part in text for part in fragments) for text in texts), message


def test_every_module_that_a_page_runs_can_be_run() -> None:
    found = {module for page in LINKED for module in _MODULE_RUN.findall(page.read_text())}
    assert len(found) > 6
    for module in found:
        path = ROOT / module.replace(".", "/")
        source = path / "__main__.py" if path.is_dir() else path.with_suffix(".py")
        assert "__main__" in source.read_text(), module


def test_the_citation_says_what_the_package_says() -> None:
    citation = (ROOT / "CITATION.cff").read_text()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert f"version: {project['version']}" in citation
    assert f"license: {project['license']}" in citation
