"""``python -m thsa_cosim`` is the command ``thsa-cosim``."""

from thsa_cosim.cli import main

if __name__ == "__main__":
    main()
