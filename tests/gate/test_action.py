"""The GitHub action and the workflow that shows its use: what can be said of them without GitHub."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
ACTION, WORKFLOW = ROOT / ".github/actions/gate/action.yml", ROOT / "docs/examples/gate-workflow.yml"
CI = ROOT / ".github/workflows/ci.yml"


def read(path: Path) -> dict[Any, Any]:
    found: dict[Any, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    return found


@pytest.mark.parametrize(
    ("schema", "path"),
    [("vendor.github-actions", ACTION), ("vendor.github-workflows", WORKFLOW), ("vendor.github-workflows", CI)],
    ids=["action", "workflow", "ci"],
)
def test_a_linter_finds_nothing(schema: str, path: Path) -> None:
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", schema, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_every_input_is_declared_used_and_never_pasted_into_a_script() -> None:
    action, text = read(ACTION), ACTION.read_text(encoding="utf-8")
    assert set(re.findall(r"inputs\.([\w-]+)", text)) == set(action["inputs"])
    scripts = [step["run"] for step in action["runs"]["steps"] if "run" in step]
    # An input in a script's text would be run as a command.
    assert not any("${{" in script for script in scripts)
    for script in scripts:
        subprocess.run(["bash", "-n", "-c", script], check=True)


def test_the_example_gives_inputs_that_the_action_has() -> None:
    (gate,) = [step for step in read(WORKFLOW)["jobs"]["gate"]["steps"] if "gate" in step["uses"]]
    assert set(gate["with"]) <= set(read(ACTION)["inputs"])
    path = re.sub(r"^OWNER/deskew/(.*)@main$", r"\1", gate["uses"])
    assert (ROOT / path / "action.yml") == ACTION


def test_the_action_runs_the_gate_of_its_own_checkout() -> None:
    checkout = read(ACTION)["runs"]["steps"][0]["run"]
    environment = {"GITHUB_ACTION_PATH": str(ACTION.parent), "GITHUB_OUTPUT": "/dev/stdout", "PATH": "/usr/bin:/bin"}
    done = subprocess.run(["bash", "-c", checkout], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == f"deskew={ROOT}\n"
