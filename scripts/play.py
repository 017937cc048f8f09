"""The door to ``roller play`` in a checkout."""

import sys

from roller_env.cli.play import main

if __name__ == "__main__":
    sys.exit(main())
