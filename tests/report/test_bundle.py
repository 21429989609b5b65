"""The committed scripts are what their sources make, and carry the licence of what they hold."""

from __future__ import annotations

import re
import shutil
import subprocess
from hashlib import sha256
from pathlib import Path

import pytest

from experiments.page.document import FRONT

SOURCES = ["build.mjs", "package.json", "package-lock.json"]
BUNDLES = ["page.js", "sheet.js"]


def digest_of_sources(front: Path) -> str:
    names = [*SOURCES, *(f"src/{path.name}" for path in sorted((front / "src").iterdir()))]
    lines = (f"{sha256((front / name).read_bytes()).hexdigest()}  {name}\n" for name in names)
    return sha256("".join(lines).encode()).hexdigest()


def head_and_code(name: str) -> tuple[str, str]:
    head, _, code = (FRONT / "built" / name).read_text(encoding="utf-8").partition("\n*/\n")
    return head, code


@pytest.mark.parametrize("name", BUNDLES)
def test_bundle_was_built_from_these_sources_and_not_touched_since(name: str) -> None:
    head, code = head_and_code(name)
    built = re.search(r"^sources sha256: (\w+)$", head, re.MULTILINE)
    assert built is not None
    assert built[1] == digest_of_sources(FRONT), "run `npm ci && npm run build` in experiments/page/front"
    assert f"code sha256: {sha256(code.encode()).hexdigest()}" in head


def test_another_source_has_another_digest(tmp_path: Path) -> None:
    for name in SOURCES:
        shutil.copy(FRONT / name, tmp_path)
    shutil.copytree(FRONT / "src", tmp_path / "src")
    assert digest_of_sources(tmp_path) == digest_of_sources(FRONT)
    with (tmp_path / "src/colours.js").open("a") as file:
        file.write("// more\n")
    assert digest_of_sources(tmp_path) != digest_of_sources(FRONT)


def test_bundle_with_three_carries_its_licence_and_the_other_needs_none() -> None:
    head, _ = head_and_code("sheet.js")
    licence = (FRONT / "built/THREE-LICENSE.txt").read_text(encoding="utf-8")
    assert "The MIT License" in head
    assert "Permission is hereby granted" in head
    assert head.partition("The MIT License")[2].strip() == licence.partition("The MIT License")[2].strip()
    assert "three" not in "".join(head_and_code("page.js")).lower()


@pytest.mark.parametrize("name", BUNDLES)
def test_bundle_names_no_address_to_load_from(name: str) -> None:
    _, code = head_and_code(name)
    assert not re.search(r"(fetch|importScripts|EventSource|sendBeacon)\(\s*[\"'`]", code)
    assert "</script" not in code
    assert "resolved" not in (FRONT / "package-lock.json").read_text()


def test_built_again_it_is_the_same(tmp_path: Path) -> None:
    if shutil.which("node") is None or not (FRONT / "node_modules").is_dir():
        pytest.skip("there is no node, or `npm ci` was not run in experiments/page/front")
    for name in SOURCES:
        shutil.copy(FRONT / name, tmp_path)
    shutil.copytree(FRONT / "src", tmp_path / "src")
    (tmp_path / "node_modules").symlink_to(FRONT / "node_modules")
    subprocess.run(["node", "build.mjs"], cwd=tmp_path, check=True, capture_output=True)
    for name in [*BUNDLES, "THREE-LICENSE.txt"]:
        assert (tmp_path / "built" / name).read_bytes() == (FRONT / "built" / name).read_bytes()
