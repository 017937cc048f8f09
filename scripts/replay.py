"""The door to ``roller replay`` in a checkout."""

import sys

from roller_env.cli.replay import main

if __name__ == "__main__":
    sys.exit(main())
