"""Hydra's and OmegaConf's errors in this project's wording: the key, its range, what came, in one line."""

from __future__ import annotations

import re

from hydra.errors import MissingConfigException, OverrideParseException
from omegaconf.errors import ConfigAttributeError, ConfigKeyError, OmegaConfBaseException, ValidationError

from deskew.errors import DeskewError
from experiments.settings import allowed_text, known_keys
from experiments.studies import STUDIES


def one_line(error: BaseException) -> str:
    """Return what a user needs to know of an error, without line breaks."""
    if isinstance(error, DeskewError):
        text = str(error)
    elif isinstance(error, OverrideParseException):
        text = f"`{error.override}` must be KEY=VALUE in Hydra's grammar, got text that cannot be read."
    elif isinstance(error, MissingConfigException):
        text = _missing_option(error)
    else:
        text = _wrong_key_or_type(error)
    return " ".join(text.split())


def _missing_option(error: MissingConfigException) -> str:
    group, _, option = (error.missing_cfg_file or "").rpartition("/")
    options = sorted(STUDIES) if group == "experiment" else sorted(error.options or ())
    if not options:
        return str(error)
    return f"`{group}` must be one of {', '.join(options)}, got {option!r}."


def _wrong_key_or_type(error: BaseException) -> str:
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, OmegaConfBaseException):
        cause = cause.__cause__
    if not isinstance(cause, OmegaConfBaseException):
        return str(error)
    key = str(cause.full_key or cause.key or "")
    if isinstance(cause, ConfigKeyError | ConfigAttributeError):
        known = known_keys(key.rpartition(".")[0])
        return f"`{key}` must be a known key, one of {', '.join(known)}, got an unknown one."
    if isinstance(cause, ValidationError):
        got = re.search(r"Value '(.*?)' of type", str(cause))
        allowed = allowed_text(key) or "be of its type"
        return f"`{key}` must {allowed}, got {got.group(1)!r}." if got else f"`{key}` must {allowed}: {cause.msg}"
    return str(cause)
