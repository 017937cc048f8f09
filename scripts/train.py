"""The door to ``roller train`` in a checkout."""

from roller_env.cli.train import main

if __name__ == "__main__":
    main()
