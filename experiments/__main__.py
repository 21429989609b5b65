"""``python -m experiments experiment=NAME [key=value ...]``."""

import sys

if __name__ == "__main__":
    try:
        # Worker processes import this module too, and need nothing of the program.
        from experiments.program import main

        code = main(sys.argv[1:])
    except KeyboardInterrupt:
        # The imports alone take seconds.
        print("Interrupted before anything was done.", file=sys.stderr)
        code = 130
    sys.exit(code)
