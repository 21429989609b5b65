"""The draft: what is painted, kept in a file beside the map after every stroke, so that nothing is lost."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from deskew.editor.materials import Material, Painting
from deskew.errors import InputError, require
from deskew.io import read_arrays, read_stiffness, write_arrays
from deskew.types import Size


def draft_of(path: Path) -> Path:
    """Return the draft's place: `map.png` has `map.draft.npz`."""
    return path.with_suffix(".draft.npz")


def write_draft(painting: Painting, path: Path) -> None:
    """Write a draft, whole or not at all.

    Raises
    ------
    StepError
        If the file system refuses.
    """
    table = [[material.label, material.name, material.stiffness] for material in painting.materials]
    text = np.frombuffer(json.dumps(table).encode(), np.uint8)
    write_arrays({"labels": painting.labels, "materials": text}, path)


def read_draft(path: Path) -> Painting:
    """Read a draft, exactly what was written.

    Raises
    ------
    InputError
        If it is damaged; the message says what to do.
    """
    arrays = read_arrays(path)
    try:
        table = json.loads(bytes(arrays["materials"].astype(np.uint8)).decode())
        materials = tuple(Material(int(label), name, float(stiffness)) for label, name, stiffness in table)
        return Painting(arrays["labels"], materials)
    except (KeyError, ValueError, TypeError, RecursionError, OverflowError) as error:  # InputError is a ValueError
        raise InputError(
            f"`{path}` must be a draft of the editor, got damaged data; delete it to begin anew."
        ) from error


def opened(path: Path, size: Size) -> tuple[Painting, Path | None]:
    """Take up what is painted already: the map or its draft, whichever was written last, or a blank page.

    Parameters
    ----------
    path : Path
        The map, a PNG with its TOML table; it need not exist.
    size : (width, height)
        Of the photograph [px].

    Returns
    -------
    Painting, Path or None
        What is painted, and the file it came from.

    Raises
    ------
    InputError
        If the file is damaged, or of another size than the photograph.
    """
    draft = draft_of(path)
    files = [file for file in (path, draft) if file.exists()]
    if not files:
        return Painting.blank(size), None
    source = max(files, key=lambda file: (file.stat().st_mtime_ns, file == draft))
    if source == draft:
        painting = read_draft(draft)
    else:
        names = read_draft(draft).names if draft in files else {}
        painting = Painting.of(read_stiffness(path), names)
    found = painting.size
    wanted = f"be {size[0]}x{size[1]} px, the photograph's size, or be named otherwise by -o"
    require(found == size, str(source), wanted, f"{found[0]}x{found[1]} px")
    return painting, source
