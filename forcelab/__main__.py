"""``python -m forcelab``: the command line."""

import sys

from forcelab.cli import main

if __name__ == "__main__":
    sys.exit(main())
