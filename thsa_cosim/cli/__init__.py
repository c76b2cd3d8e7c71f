"""The command line: arguments in, exit codes out.

``main``      the group of all commands, errors as one sentence, exit codes
``options``   what the study commands share: their options, where a study goes, how it ends
``export``, ``check``: models, and what can be trusted
``dry_run``   what a study command would run, and how long it would take
``identify``, ``tune``, ``diagnose``, ``simulate``, ``report``, ``init``, ``demo``, ``completion``: one a command

A command imports the heavy rooms itself, when it runs. To add a command: write it in a module of its own and
name it in ``main.COMMANDS``.
"""

from thsa_cosim.cli.main import cli, main, run_command

__all__ = ["cli", "main", "run_command"]
