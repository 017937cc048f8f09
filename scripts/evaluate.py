"""The door to ``roller evaluate`` in a checkout."""

from roller_env.cli.evaluate import main

if __name__ == "__main__":
    main()
