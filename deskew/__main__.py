"""``python -m deskew``."""

import sys

from deskew.cli import main

if __name__ == "__main__":
    sys.exit(main())
