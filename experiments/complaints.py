"""Hydra's and OmegaConf's errors in this project's wording: the key, its range, what came, in one line."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Glob, Override
from hydra.errors import MissingConfigException, OverrideParseException
from omegaconf.errors import ConfigAttributeError, ConfigKeyError, OmegaConfBaseException, ValidationError

from deskew.errors import DeskewError, InputError, require
from experiments.settings import allowed_text, known_keys
from experiments.studies import STUDIES

# A line longer than this is cut in its middle, whatever somebody put on the command line.
_MAX_LENGTH = 400


def refuse_arguments(arguments: argparse.Namespace, conf: Path) -> None:
    """Raise an InputError for what Hydra would accept, or end with a traceback on.

    Parameters
    ----------
    arguments : Namespace
        As Hydra's own parser reads the command line.
    conf : Path
        Folder of the configuration; each folder in it is a group of which one option is chosen.
    """
    rerun = arguments.experimental_rerun
    require(rerun is None, "--experimental-rerun", "be left out, since it would unpickle a file", rerun)
    for override in _parsed(arguments.overrides):
        name = override.key_or_group
        options, got = _options(name, conf), str(override.input_line).partition("=")[2]
        if override.is_sweep_override():
            _refuse_empty_sweep(override, options, got)
        elif options and not override.is_delete():
            require(isinstance(override.value(), str), name, f"be one of {', '.join(options)}", got)


def _parsed(overrides: list[str]) -> list[Override]:
    try:
        return OverridesParser.create().parse_overrides(overrides)
    except RecursionError as error:
        raise InputError("The arguments must be nested less deeply, got more brackets than can be read.") from error


def _options(group: str, conf: Path) -> list[str]:
    """Return the options of a configuration group, sorted; empty for a name that is none."""
    return sorted(STUDIES) if group == "experiment" else sorted(path.stem for path in conf.glob(f"{group}/*.yaml"))


def _refuse_empty_sweep(override: Override, options: list[str], got: str) -> None:
    glob = override.value()
    try:
        # A range may be long: its first value is enough.
        values = iter(glob.filter(options)) if isinstance(glob, Glob) else override.sweep_iterator()
        some = any(True for _ in values)
    except ValueError as error:
        raise InputError(f"`{override.key_or_group}` must have values to sweep over, got {got}: {error}.") from error
    allowed = f"match one of {', '.join(options)}" if options else "have values to sweep over"
    require(some, override.key_or_group, allowed, got)


def one_line(error: BaseException, arguments: Sequence[str] = ()) -> str:
    """Return what a user needs to know of an error, without line breaks and not endless.

    Parameters
    ----------
    error : exception
        This project's, Hydra's, OmegaConf's, or what Hydra lets through of Python's.
    arguments : sequence of str
        The command line, which shows what was given where the error does not say it.
    """
    if isinstance(error, DeskewError):
        text = str(error)
    elif isinstance(error, OverrideParseException):
        text = f"`{error.override}` must be KEY=VALUE in Hydra's grammar, got text that cannot be read."
    elif isinstance(error, MissingConfigException):
        text = _missing_option(error)
    elif isinstance(error, OSError):
        text = f"`{error.filename}` must be a path that can be used, got: {error.strerror}."
    elif isinstance(error, ValueError | KeyError) and not isinstance(error, OmegaConfBaseException):
        text = f"The arguments must suit each other and Hydra (see --hydra-help), got: {error}."
    else:
        text = _wrong_key_or_type(error, arguments)
    text = " ".join(text.split())
    return text if len(text) <= _MAX_LENGTH else f"{text[: _MAX_LENGTH - 100]} ... {text[-100:]}"


def _missing_option(error: MissingConfigException) -> str:
    group, _, option = (error.missing_cfg_file or "").rpartition("/")
    options = sorted(STUDIES) if group == "experiment" else sorted(error.options or ())
    if not options:
        return str(error)
    return f"`{group}` must be one of {', '.join(options)}, got {option!r}."


def _wrong_key_or_type(error: BaseException, arguments: Sequence[str]) -> str:
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, OmegaConfBaseException):
        cause = cause.__cause__
    if not isinstance(cause, OmegaConfBaseException):
        return str(error)
    key = str(cause.full_key or cause.key or "") or _key_of_a_reference(arguments)
    if isinstance(cause, ConfigKeyError | ConfigAttributeError):
        known = known_keys(key.rpartition(".")[0])
        return f"`{key}` must be a known key{', one of ' * bool(known)}{', '.join(known)}, got an unknown one."
    if not key:
        return str(cause)
    quoted = re.search(r"Value '(.*?)' of type", str(cause)) if isinstance(cause, ValidationError) else None
    got = repr(quoted.group(1)) if quoted else _given(key, arguments)
    keys = known_keys(key)
    allowed = allowed_text(key) or (f"hold the keys {', '.join(keys)}" if keys else "be of its type")
    return f"`{key}` must {allowed}, got {got}."


def _key_of_a_reference(arguments: Sequence[str]) -> str:
    """Return the last key that was given as a reference to another, "" for none: OmegaConf does not always say it."""
    return next((text.partition("=")[0] for text in reversed(arguments) if "=${" in text), "")


def _given(key: str, arguments: Sequence[str]) -> str:
    """Return what the command line gives for a dotted key or for the nearest group that holds it."""
    name = key.partition("[")[0]
    while name:
        for text in reversed(arguments):
            if text.startswith(f"{name}="):
                return text.partition("=")[2] or "nothing"
        name = name.rpartition(".")[0]
    return "something else"
