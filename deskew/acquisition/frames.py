"""Frames read one at a time from wherever they come, each checked against the still scene."""

from __future__ import annotations

from collections.abc import Iterator

from deskew.acquisition.grey import grey_levels
from deskew.errors import DeskewError, InputError, StepError, in_one_line, require
from deskew.types import Array, Frames


def read_frames(frames: Frames, like: Array, name: str) -> Iterator[Array]:
    """Yield each frame once, in order, as grey levels.

    Parameters
    ----------
    frames : Frames
        What they promise is checked: a file may vanish and a generator end early while they are read.
    like : (height, width) array
        Grey levels of the white image; every frame must have its shape and type.
    name : str
        What an error calls them.

    Raises
    ------
    InputError
        If a frame is unlike the white image, or more or fewer come than promised.
    StepError
        If reading one fails.
    """
    n = len(frames)
    count = 0
    reader = _reading(frames, name)
    for frame in reader:
        require(count < n, name, f"yield its {n} frames", "more")
        grey = grey_levels(frame, f"{name}[{count}]")
        require(grey.shape == like.shape, f"{name}[{count}]", f"have white's shape {like.shape}", grey.shape)
        require(grey.dtype == like.dtype, f"{name}[{count}]", f"have white's type {like.dtype}", grey.dtype)
        count += 1
        yield grey
    # Raised and not returned: who waits for a next frame must not meet the end of an iterator instead.
    if count < n:
        raise InputError(f"`{name}` must yield its {n} frames, got {count}.")


def _reading(frames: Frames, name: str) -> Iterator[Array]:
    """Pass frames on; what goes wrong in their own code becomes a StepError that names the frame."""
    count = 0
    try:
        for frame in frames:
            yield frame
            count += 1
    except DeskewError:
        raise
    except Exception as error:
        raise StepError(f"Reading `{name}[{count}]` failed: {in_one_line(error)}.") from error
