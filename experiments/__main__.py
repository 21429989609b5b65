"""``python -m experiments experiment=NAME [key=value ...]``."""

import sys

if __name__ == "__main__":
    # Worker processes import this module too, and need nothing of the program.
    from experiments.program import main

    sys.exit(main(sys.argv[1:]))
