"""The door to ``roller level mjcf`` in a checkout."""

import sys

from roller_env.cli.level import mjcf_main

if __name__ == "__main__":
    sys.exit(mjcf_main())
