"""Many captures, one after another: each gets a folder of its own, and only what is missing or changed is done."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import typer

from deskew.cli.metadata import write_metadata
from deskew.cli.printing import report, say
from deskew.cli.progress import watched
from deskew.errors import DeskewError, StepError, require

RECORD = "run.json"
LIST = "batch.json"

Job = Callable[[Path, Path], tuple[dict[str, Any], list[Path]]]
"""Takes a capture folder and the picture to write; returns the figures and the files that it wrote."""


@dataclass(frozen=True, slots=True)
class Batch:
    """What is done to every capture, and where the results go.

    Attributes
    ----------
    output : Path
        Folder; made if it is not there.
    picture : str
        Name of the picture in each capture's folder.
    options : mapping
        Everything asked for that changes a result.
    inputs : tuple of Path
        Files that every result depends on.
    quiet : bool
        One JSON object on stdout, and no bars.
    """

    output: Path
    picture: str
    options: Mapping[str, Any]
    inputs: tuple[Path, ...]
    quiet: bool

    def run(self, captures: Sequence[Path], job: Job) -> None:
        """Do every capture that is not done yet.

        Raises
        ------
        InputError
            If the output is no folder or two captures have one name.
        StepError
            At the end, if any capture failed.
        """
        names = [capture.resolve().name for capture in captures]
        twice = [name for name, n in Counter(names).items() if n > 1]
        require(not twice, "CAPTURE...", "be folders of different names", f"several called {', '.join(twice)}")
        free = self.output.is_dir() or (not self.output.exists() and self.output.parent.is_dir())
        require(free, str(self.output), "be a folder, for several captures, or new in an existing one", "neither")
        self.output.mkdir(exist_ok=True)
        shared = self._shared()
        done: list[dict[str, Any]] = []
        try:
            for capture, name in watched(list(zip(captures, names, strict=True)), "captures", "page", self.quiet):
                done.append({"capture": str(capture), **self._attempt(capture, name, shared, job)})
                write_metadata({"captures": done}, self.output / LIST)
        except KeyboardInterrupt:
            say(f"interrupted; {len(done)} of {len(captures)} captures are done, the same line goes on from there.")
            raise typer.Exit(130) from None
        self._report(done)

    def _report(self, done: list[dict[str, Any]]) -> None:
        count = Counter(row["state"] for row in done)
        figures: dict[str, Any] = {"batch": str(self.output), **{s: count[s] for s in ("restored", "kept", "failed")}}
        failed = [row for row in done if row["state"] == "failed"]
        listed = {"captures": done} if self.quiet else {row["capture"]: row["reason"] for row in failed}
        report(figures | listed, self.quiet, self.output)
        if failed:
            raise StepError(f"{len(failed)} of {len(done)} captures failed; {self.output / LIST} says why.")

    def _attempt(self, capture: Path, name: str, shared: str, job: Job) -> dict[str, Any]:
        """Do one capture, or see that it is done; what goes wrong is told and returned."""
        folder = self.output / name
        try:
            key = hashlib.sha256((shared + _digest(capture)).encode()).hexdigest()
            found = _record(folder)
            if found is not None and found["key"] == key:
                return {"state": "kept", **found["figures"]}
            mine = (folder / RECORD).is_file() or not folder.exists() or (folder.is_dir() and not any(folder.iterdir()))
            require(mine, str(folder), f"be new or hold the {RECORD} of an earlier batch", "something else")
            return {"state": "restored", **self._restored(capture, folder, key, job)}
        except (DeskewError, OSError, MemoryError) as error:
            reason = str(error) or "out of memory"
            say(f"{capture}: {reason}")
            return {"state": "failed", "reason": reason}

    def _restored(self, capture: Path, folder: Path, key: str, job: Job) -> dict[str, Any]:
        """Restore a capture into a folder that takes its name when all is in it."""
        # Names of their own, not random ones: what a killed batch left behind the next one clears away.
        unfinished, before = (folder.with_name(f".{folder.name}.{word}") for word in ("unfinished", "before"))
        for leftover in (unfinished, before):
            shutil.rmtree(leftover, ignore_errors=True)
        unfinished.mkdir()
        try:
            figures, paths = job(capture, unfinished / self.picture)
            figures["restored"] = [str(folder / path.name) for path in paths]
            pictures = [path.name for path in paths]
            write_metadata({"key": key, "pictures": pictures, "figures": figures}, unfinished / RECORD)
            if folder.exists():
                folder.replace(before)
            unfinished.replace(folder)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)
            shutil.rmtree(before, ignore_errors=True)
        return figures

    def _shared(self) -> str:
        """Name what every result depends on but its capture: options, further inputs and the program itself."""
        from deskew.io.files import read_bytes

        try:
            program = version("deskew3d")
        except PackageNotFoundError:
            program = "a checkout"
        digests = [hashlib.sha256(read_bytes(path)).hexdigest() for path in self.inputs]
        return json.dumps([program, self.picture, self.options, digests], sort_keys=True, default=str)


def _digest(capture: Path) -> str:
    """SHA-256 of a capture folder's files, names included; what desktops leave behind does not count."""
    from deskew.io.files import require_folder

    require_folder(capture)
    total = hashlib.sha256()
    for path in sorted(capture.rglob("*")):
        if path.is_file() and not path.name.startswith("."):
            with path.open("rb") as stream:
                total.update(f"{path.relative_to(capture)}\0".encode())
                total.update(hashlib.file_digest(stream, "sha256").digest())
    return total.hexdigest()


def _record(folder: Path) -> dict[str, Any] | None:
    """Read what an earlier batch left in a folder; None if it is not whole."""
    from deskew.io.files import read_json

    try:
        found = read_json(folder / RECORD)
        whole = all((folder / str(name)).is_file() for name in found["pictures"])
        return found if whole and isinstance(found["figures"], dict) and isinstance(found["key"], str) else None
    except (DeskewError, KeyError, TypeError):
        return None
