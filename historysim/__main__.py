"""``python -m historysim`` is the command ``historysim``."""

from historysim.cli import main

if __name__ == "__main__":
    main()
