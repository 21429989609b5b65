"""The configuration that the program would run with, for whoever runs a study or names a command without it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hydra import compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from omegaconf import OmegaConf

from experiments.settings import Config

CONF = Path(__file__).resolve().parents[1] / "conf"


def composed(arguments: Sequence[str]) -> Config:
    """Return the checked configuration of `python -m experiments ARGUMENTS`.

    Parameters
    ----------
    arguments : sequence of str
        `key=value`, as on the command line; no sweeps.
    """
    ConfigStore.instance().store("schema", Config)
    with initialize_config_dir(str(CONF), version_base="1.3"):
        config = OmegaConf.to_object(compose("config", list(arguments)))
    assert isinstance(config, Config)
    return config
