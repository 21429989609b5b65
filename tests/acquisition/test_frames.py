"""Frames that do not keep their promise are refused alike by every decoder."""

from dataclasses import replace

import numpy as np
import pytest

from deskew.acquisition import SweepSettings, decode_gray, decode_sweep
from deskew.errors import InputError, StepError
from deskew.types import Capture, PatternKind

WHITE, BLACK = np.full((12, 16), 200, np.uint8), np.full((12, 16), 20, np.uint8)
N = 16
DECODERS = {
    "gray": (PatternKind.GRAY_CODE, 8, decode_gray),
    "temporal": (PatternKind.LINE_SWEEP, N, decode_sweep),
    "spatial": (PatternKind.LINE_SWEEP, N, lambda capture: decode_sweep(capture, SweepSettings(mode="spatial"))),
}


class Promised:
    """Announces `n` frames and yields whatever it was given; an error among them is raised."""

    def __init__(self, frames, n):
        self.frames, self.n = frames, n

    def __len__(self):
        return self.n

    def __iter__(self):
        for frame in self.frames:
            if isinstance(frame, Exception):
                raise frame
            yield frame


def decode(name, columns):
    pattern, n, decoder = DECODERS[name]
    good = Promised([BLACK] * n, n)
    capture = Capture(WHITE, BLACK, (N, N), pattern, good, good)
    return decoder(replace(capture, columns=Promised(columns(n), n)))


@pytest.mark.parametrize("name", list(DECODERS))
@pytest.mark.parametrize(
    ("columns", "error", "message"),
    [
        (lambda n: [BLACK] * (n - 2), InputError, r"`columns` must yield its \d+ frames, got \d+\.$"),
        (lambda n: [BLACK] * (n - 1), InputError, r"`columns` must yield its \d+ frames, got \d+\.$"),
        (lambda n: [], InputError, r"`columns` must yield its \d+ frames, got 0\.$"),
        (lambda n: [BLACK] * (n + 1), InputError, r"`columns` must yield its \d+ frames, got more\.$"),
        (lambda n: [BLACK] * (n + 40), InputError, r"`columns` must yield its \d+ frames, got more\.$"),
        (lambda n: [BLACK[1:]] * n, InputError, r"`columns\[0\]` must have white's shape \(12, 16\), got \(11, 16\)"),
        (lambda n: [BLACK.astype(float)] * n, InputError, r"`columns\[0\]` must have white's type uint8, got float64"),
        (lambda n: [BLACK, None] * n, InputError, r"`columns\[1\]` must be an array of grey levels, got NoneType"),
        (
            lambda n: [BLACK, BLACK, OSError(5, "Input/output\nerror")],
            StepError,
            r"^Reading `columns\[2\]` failed: OSError: \[Errno 5\] Input/output error\.$",
        ),
        (lambda n: [RuntimeError()], StepError, r"^Reading `columns\[0\]` failed: RuntimeError\.$"),
        (lambda n: [BLACK, InputError("`3.png` must be a file.")], InputError, r"^`3.png` must be a file\.$"),
    ],
)
def test_frames_that_break_their_promise_are_told_apart(name, columns, error, message):
    with pytest.raises(error, match=message):
        decode(name, columns)


def test_images_without_pixels_or_of_no_array_are_refused():
    empty, frames = np.zeros((0, 0), np.uint8), [BLACK] * 8
    with pytest.raises(InputError, match=r"`white` must be .* of at least 1 pixel"):
        Capture(empty, empty, (N, N), PatternKind.GRAY_CODE, frames, frames)
    with pytest.raises(InputError, match="`black` must be an array of grey levels, got list"):
        Capture(WHITE, BLACK.tolist(), (N, N), PatternKind.GRAY_CODE, frames, frames)
