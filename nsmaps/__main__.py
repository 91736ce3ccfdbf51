"""`python -m nsmaps`: the command line."""

from nsmaps.cli.cli import main

if __name__ == "__main__":
    main()
