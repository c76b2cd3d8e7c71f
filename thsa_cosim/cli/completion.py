"""The command ``completion``: what a shell needs to complete commands and options."""

import click
from click.shell_completion import get_completion_class


@click.command(short_help="Print the completion script of a shell.")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print the completion script for SHELL.

    bash: thsa-cosim completion bash > ~/.local/share/bash-completion/completions/thsa-cosim
    """
    group = context.find_root().command
    made = get_completion_class(shell)
    assert made is not None
    click.echo(made(group, {}, "thsa-cosim", "_THSA_COSIM_COMPLETE").source())
