"""One door to every decoder: the capture's pattern chooses it (section 2.3)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from deskew.acquisition.graycode import GrayCodeSettings, decode_gray
from deskew.acquisition.phase import PhaseSettings, decode_phase
from deskew.acquisition.stripes import decode_sweep
from deskew.acquisition.sweep import SweepSettings
from deskew.errors import require
from deskew.types import Capture, Correspondence, PatternKind

DecoderSettings = SweepSettings | GrayCodeSettings | PhaseSettings


@dataclass(frozen=True, slots=True)
class Decoder:
    """How a pattern is decoded.

    Attributes
    ----------
    settings : type
        Of its settings.
    decode : callable
        From a capture and such settings, or None, to a correspondence.
    """

    settings: type[DecoderSettings]
    decode: Callable[[Capture, Any], Correspondence]


DECODERS: Mapping[PatternKind, Decoder] = {
    PatternKind.LINE_SWEEP: Decoder(SweepSettings, decode_sweep),
    PatternKind.GRAY_CODE: Decoder(GrayCodeSettings, decode_gray),
    PatternKind.GRAY_PHASE: Decoder(PhaseSettings, decode_phase),
    PatternKind.MULTI_PHASE: Decoder(PhaseSettings, decode_phase),
}


def decode(capture: Capture, settings: DecoderSettings | None = None) -> Correspondence:
    """Decode a capture, whichever pattern it holds.

    Parameters
    ----------
    capture : Capture
        Of any pattern.
    settings : SweepSettings, GrayCodeSettings or PhaseSettings, optional
        Those of the pattern's decoder; its own defaults if not given.

    Returns
    -------
    Correspondence
        Projector coordinates of each raw camera pixel, the reason where there are none, and what the frames say of the
        projector.

    Raises
    ------
    InputError
        If the settings are another decoder's, or a frame is wrong.
    StepError
        If reading a frame failed, or nothing could be decoded.
    """
    decoder = DECODERS[capture.pattern]
    fits = settings is None or isinstance(settings, decoder.settings)
    require(fits, "settings", f"be {decoder.settings.__name__} for a {capture.pattern}", type(settings).__name__)
    return decoder.decode(capture, settings)


def settings_for_ink(pattern: PatternKind) -> DecoderSettings | None:
    """Return settings that leave the edges of ink to a later correction; None where the defaults do."""
    return GrayCodeSettings(ink_slope_max=None) if pattern is PatternKind.GRAY_CODE else None
