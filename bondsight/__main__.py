"""``python -m bondsight``: the command line."""

import sys

from bondsight.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
