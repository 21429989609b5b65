"""The program with the fake study in it, to be started and killed: `python -m tests.experiments.fake_program`."""

from __future__ import annotations

import signal
import sys

if __name__ == "__main__":
    # Workers import this module too, and need nothing of the program.
    from experiments.program import main
    from experiments.trials import plan
    from tests.experiments import conftest

    # Started in the background, as some CI is, the tests hand down that ctrl-C is ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    conftest.register_fake()
    plan.SOURCES = conftest.SOURCES
    sys.exit(main(["experiment=fake", *sys.argv[1:]]))
