"""``python -m experiments.gate --baseline reports/baseline/NAME.csv``."""

import sys

if __name__ == "__main__":
    # Worker processes import this module too, and need nothing of the program.
    from experiments.gate.command import main

    sys.exit(main(sys.argv[1:]))
