"""The reference of the command line, from the commands themselves."""

import inspect

import click

from thsa_cosim.cli.main import cli

HEAD = """\
<!-- Written by docs/generate.py from thsa_cosim/cli: change the help there. -->

# The command line

Every command has `--help`. Bad input ends with one sentence on stderr and exit code 2; a study that ran, but has no
usable result, with 3; one that was interrupted with 130, and with the command that continues it. A study folder that
exists is continued, never overwritten. `THSA_COSIM_DEBUG=1` shows the traceback behind a sentence.

Progress goes to stderr: a bar on a terminal, a plain line now and then elsewhere. Results go to stdout, with `--json`
as JSON and with `--quiet` not at all. Colours are for terminals only, and not where `NO_COLOR` is set.
"""


def cli_page() -> str:
    """Return the page's Markdown."""
    parts = [HEAD]
    context = click.Context(cli, info_name="thsa-cosim")
    for name in cli.list_commands(context):
        command = cli.get_command(context, name)
        assert command is not None
        own = click.Context(command, info_name=name, parent=context)
        usage = " ".join(command.collect_usage_pieces(own))
        parts.append(f"## {name}\n\n```text\nthsa-cosim {name} {usage}\n```\n")
        parts.append(inspect.cleandoc(command.help or "") + "\n")
        rows = [
            _row(p, own)
            for p in command.get_params(own)
            if isinstance(p, click.Option) and "--help" not in p.opts
        ]
        if rows:
            parts.append("| option | meaning |\n|---|---|\n" + "\n".join(rows) + "\n")
    return "\n".join(parts)


def _row(option: click.Option, context: click.Context) -> str:
    record = option.get_help_record(context)
    assert record is not None
    names, meaning = (" ".join(text.split()).replace("|", r"\|") for text in record)
    return f"| `{names}` | {meaning} |"
