"""The sources of methods that are not built in: rows depend on them as on this project's own."""

from __future__ import annotations

import importlib.util
from contextlib import suppress
from pathlib import Path
from typing import Any

from deskew.plugins import locate
from experiments.settings import Config
from experiments.trials import content_digest


def about_own(config: Config) -> dict[str, Any]:
    """Return the function and the SHA-256 of the sources behind each name from outside, for `run.json` and its hash.

    Sources are the Python files of the top-level package, or the one module; what else a method reads, such as the
    weights of a network, nobody can tell. Nothing is imported.
    """
    names = dict.fromkeys([*config.methods, *config.integrators.mapped])
    places = {name: locate(name) for name in names}
    own = {name: {"function": ":".join(at), "sha256": _digest(at[0])} for name, at in places.items() if at}
    return {"own_methods": own} if own else {}


def _digest(module: str) -> str:
    spec = None
    with suppress(ValueError):  # of a module that was not found but made
        # By its first part alone: to look further down would import that.
        spec = importlib.util.find_spec(module.partition(".")[0])
    if spec is None:
        return ""
    if spec.submodule_search_locations is None:
        path = Path(str(spec.origin))
        return content_digest([path], path.parent)
    root = Path(next(iter(spec.submodule_search_locations)))
    return content_digest(sorted(root.rglob("*.py")), root)
