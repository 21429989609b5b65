"""References by the names that docstrings use: `Capture`, `crumpled`, `deskew.types.captures.Capture`.

A docstring may name what its own module imports; the site documents it where users import it from. So a reference that
finds nothing is looked up by its last part among all documented objects. What has no page, since it lies inside a
stage, is set as code if it exists at all; words of a type that name no class (`(height, width) array`) are prose.
Whatever else is not found stays an error.
"""

from __future__ import annotations

import re
import sys
from importlib import import_module

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.domains.python import PythonDomain
from sphinx.environment import BuildEnvironment
from sphinx.util.nodes import make_refnode

PUBLIC = ("deskew.pipeline", "deskew.metrics", "data_synth")  # with all that these import
CLASS_NAME = re.compile(r"[A-Z][a-z]+(?:[A-Z][a-z]*)*")
ELSEWHERE = {"Path", "numpy.random.Generator"}  # whose inventories lie on the network


def find(app: Sphinx, env: BuildEnvironment, reference: pending_xref, content: nodes.TextElement) -> nodes.Node | None:
    """Resolve a reference of the Python domain by its last part."""
    if reference.get("refdomain") != "py":
        return None
    domain = env.domains["py"]
    assert isinstance(domain, PythonDomain)
    target = reference["reftarget"].lstrip(".")
    last = target.rpartition(".")[2]
    if reference["reftype"] == "class" and (not CLASS_NAME.fullmatch(last) or target in ELSEWHERE):
        return content
    found = {name: at for name, at in domain.objects.items() if name.rpartition(".")[2] == last and not at.aliased}
    if len(found) == 1:
        [(name, at)] = found.items()
        return make_refnode(app.builder, reference["refdoc"], at.docname, at.node_id, content, name)
    return content if is_inside(last) else None


def is_inside(name: str) -> bool:
    """Tell whether a module of the packages bears the name or holds it."""
    ours = {path: module for path, module in sys.modules.items() if path.split(".")[0] in ("deskew", "data_synth")}
    return any(path.endswith(f".{name}") or hasattr(module, name) for path, module in ours.items())


def load(app: Sphinx) -> None:
    """Import what the reference documents, also where a page is taken from the last build."""
    for name in PUBLIC:
        import_module(name)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect."""
    app.connect("builder-inited", load)
    app.connect("missing-reference", find)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
