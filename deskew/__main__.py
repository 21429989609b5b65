"""``python -m deskew``."""

import sys


def run() -> int:
    """Run the command line; an interrupt while it is still being imported is one line and code 130, as later on."""
    try:
        from deskew.cli import main

        return main()
    except KeyboardInterrupt:
        print("deskew: interrupted; nothing was written.", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(run())
