"""The door to ``roller level schema`` in a checkout, which writes to where the schema is kept."""

import sys

from roller_env.cli.level import export_main

if __name__ == "__main__":
    sys.exit(export_main())
