"""Running the cases: every one of them in a fresh copy of the samples, and what is judged of each."""

from __future__ import annotations

import json
import shutil
import stat
import subprocess
from pathlib import Path
from typing import Any

from tests.badinput.case import Case

MEGABYTES_MAX = 1024.0


Entry = tuple[int, ...]


def listing(folder: Path) -> dict[str, Entry]:
    """Every path under a folder with its kind; of what is no folder also size, place on the disk and last change."""
    found: dict[str, Entry] = {}
    for path in folder.rglob("*"):
        seen = path.lstat()
        # Something that came and went has changed its folder's own time.
        content = () if stat.S_ISDIR(seen.st_mode) else (seen.st_size, seen.st_ino, seen.st_mtime_ns)
        found[str(path.relative_to(folder))] = (seen.st_mode, *content)
    return found


class Bench:
    """A folder of samples in which a case breaks what it likes, mended before the next one.

    Parameters
    ----------
    samples : Path
        What stays whole.
    folder : Path
        New.
    """

    def __init__(self, samples: Path, folder: Path) -> None:
        shutil.copytree(samples, folder)
        self.samples, self.folder, self._whole = samples, folder, listing(folder)

    def mend(self) -> None:
        """Make every top-level entry that is not as it was anew."""
        changed = listing(self.folder).items() ^ self._whole.items()
        if not changed:
            return
        for name in {Path(path).parts[0] for path, _ in changed}:
            here, whole = self.folder / name, self.samples / name
            if here.is_dir() and not here.is_symlink():
                shutil.rmtree(here)
            else:
                here.unlink(missing_ok=True)
            if whole.is_dir():
                shutil.copytree(whole, here)
            elif whole.exists():
                shutil.copy(whole, here)
        self._whole = listing(self.folder)


def asked(server: subprocess.Popen[str], case: Case, folder: Path) -> dict[str, Any]:
    """Have the server of `forked` run a case in its folder."""
    request = {
        "program": case.program,
        "arguments": case.arguments,
        "folder": str(folder),
        "environment": dict(case.environment),
        "absent": case.absent,
        "file_bytes": case.file_bytes,
    }
    assert server.stdin is not None
    assert server.stdout is not None
    print(json.dumps(request), file=server.stdin, flush=True)
    answer: dict[str, Any] = json.loads(server.stdout.readline())
    return answer


def faults(case: Case, answer: dict[str, Any], before: dict[str, Entry], after: dict[str, Entry]) -> list[str]:
    """Name what is wrong with how a case ended; nothing if it ended as it has to."""
    lines = answer["err"].splitlines()
    wrong = {
        f"code {answer['code']}, not {case.code}": answer["code"] != case.code,
        f"{len(lines)} lines on stderr: {answer['err'][-2000:]}": len(lines) != 1 or not lines[0].strip(),
        f"figures on stdout: {answer['out'][:200]}": answer["out"] != "",
        f"files changed: {sorted(before.items() ^ after.items())}": before != after,
        f"{answer['peak_mb']:.0f} MB": answer["peak_mb"] >= MEGABYTES_MAX,
    }
    missing = [word for word in case.words if word not in answer["err"]]
    wrong[f"{missing} not in {answer['err']}"] = bool(missing) and len(lines) == 1
    return [what for what, holds in wrong.items() if holds]
