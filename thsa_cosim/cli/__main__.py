"""``python -m thsa_cosim.cli``: the command line without its script."""

from thsa_cosim.cli.main import main

main()
