"""No part of the project unpickles, evaluates or fetches what a file says; by its sources, so that none can slip in."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted(path for package in ("deskew", "data_synth", "experiments") for path in (ROOT / package).rglob("*.py"))
# Work for this program's own processes, which it has written itself in the very same run.
OWN_PICKLES = {"experiments/trials/engines/ray.py", "experiments/trials/engines/slurm.py"}

UNPICKLING = {
    *("pickle.load", "pickle.loads", "pickle.Unpickler", "cPickle.load", "dill.load", "joblib.load", "torch.load"),
    *("shelve.open", "marshal.load", "marshal.loads", "pandas.read_pickle", "pd.read_pickle"),
}
RUNNING = {
    *("eval", "exec", "compile", "os.system", "os.popen", "yaml.load", "yaml.unsafe_load", "yaml.full_load"),
    *("runpy.run_path", "subprocess.getoutput", "np.fromfile"),
}
FETCHING = {"trimesh.load_remote", "trimesh.load_path", "urllib.request.urlopen", "urlopen", "requests.get"}


def calls(source: str) -> Iterator[tuple[str, ast.Call]]:
    """Every call of a source, by the dotted name that it is written with."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node


def unsafe(source: str, own_pickles: bool = False) -> list[str]:
    """The calls of a source that run or fetch what a file says."""
    banned = RUNNING | FETCHING | (set() if own_pickles else UNPICKLING)
    found = []
    for name, call in calls(source):
        keywords = {keyword.arg: ast.unparse(keyword.value) for keyword in call.keywords}
        pickled = (
            name in ("np.load", "numpy.load", "np.lib.format.read_array") and keywords.get("allow_pickle") != "False"
        )
        # By a path trimesh would look for textures and materials beside it, and follow addresses.
        resolved = name == "trimesh.load" and ("file_type" not in keywords or "resolver" in keywords)
        shell = name.startswith("subprocess.") and keywords.get("shell") == "True"
        if name in banned or pickled or resolved or shell:
            found.append(f"line {call.lineno}: {ast.unparse(call)}")
    return found


def test_no_source_runs_what_a_file_says() -> None:
    assert len(SOURCES) > 200
    names = {path: str(path.relative_to(ROOT)) for path in SOURCES}
    found = {name: unsafe(path.read_text(), name in OWN_PICKLES) for path, name in names.items()}
    assert {name: lines for name, lines in found.items() if lines} == {}


@pytest.mark.parametrize(
    "source",
    [
        *("pickle.loads(data)", "eval(text)", "exec(text)", "yaml.load(text, Loader=yaml.Loader)", "os.system(name)"),
        *("np.load(path)", "np.load(path, allow_pickle=True)", "np.lib.format.read_array(stream)"),
        *("trimesh.load(path)", "trimesh.load(data, file_type='obj', resolver=here)", "pd.read_pickle(path)"),
        "subprocess.run(line, shell=True)",
    ],
)
def test_what_would_is_seen(source: str) -> None:
    assert unsafe(source)


def test_pickles_are_left_to_the_engines_that_write_them() -> None:
    imported = {
        str(path.relative_to(ROOT))
        for path in SOURCES
        if any(line.strip() in ("import pickle", "from pickle import loads") for line in path.read_text().splitlines())
    }
    assert imported == OWN_PICKLES
