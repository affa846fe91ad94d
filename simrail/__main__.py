"""``python -m simrail``: the command line."""

from simrail.cli.main import main

if __name__ == "__main__":
    main()
