"""The group of all commands, and how each one ends.

Exit codes: 0 done, 2 bad input (one sentence on stderr), 3 the study ran but has no usable result,
130 interrupted. Set THSA_COSIM_DEBUG=1 to see the traceback of an error.
"""

import errno
import gc
import os
import sys
import traceback

import click

from thsa_cosim import __version__, threads
from thsa_cosim.cli.check import check
from thsa_cosim.cli.completion import completion
from thsa_cosim.cli.demo import demo
from thsa_cosim.cli.diagnose import diagnose
from thsa_cosim.cli.example import example
from thsa_cosim.cli.export import export
from thsa_cosim.cli.identify import identify
from thsa_cosim.cli.init import init
from thsa_cosim.cli.options import Interrupted
from thsa_cosim.cli.report import report
from thsa_cosim.cli.simulate import simulate
from thsa_cosim.cli.studies import compare, list_command
from thsa_cosim.cli.tune import tune
from thsa_cosim.errors import ThsaCosimError, did_you_mean

#: In the order in which a newcomer meets them; help lists them so.
COMMANDS: tuple[click.Command, ...] = (
    export,
    check,
    init,
    simulate,
    identify,
    tune,
    diagnose,
    report,
    list_command,
    compare,
    demo,
    example,
    completion,
)


#: What helps against an error of the operating system, and the exit code.
_REMEDIES = {
    errno.ENOSPC: ("; make room, and give the same command again", 3),
    errno.EACCES: ("; allow it, or choose another place", 2),
    errno.EROFS: ("; choose another place", 2),
}


class _Cli(click.Group):
    """A group whose errors are single sentences and whose commands keep their order."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            known = self.list_commands(ctx)
            hint = did_you_mean(args[0], known) or f" Known commands: {', '.join(known)}."
            raise click.UsageError(f"There is no command {args[0]!r}.{hint}", ctx) from error


@click.group(
    cls=_Cli,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, prog_name="thsa-cosim")
@click.pass_context
def cli(context: click.Context) -> None:
    """Identify, tune and diagnose electromechanical actuators with FMUs and bench recordings."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


for _command in COMMANDS:
    cli.add_command(_command)


def main() -> None:
    """Entry point: run a command and leave with its exit code."""
    # A full collection walks all imported modules for 0.1 s and frees next to nothing; few objects form cycles.
    gc.set_threshold(10_000, gc.get_threshold()[1], 100)
    code = run_command(sys.argv[1:])
    # The interpreter's last collections would walk all that is left for 0.3 s; it ends with the process anyway.
    gc.disable()
    gc.freeze()
    sys.exit(code)


def run_command(arguments: list[str]) -> int:
    """Run one command line; return its exit code. Errors become one sentence on stderr."""
    # Whoever sets them keeps them.
    for name in threads.BLAS:
        os.environ.setdefault(name, "1")
    try:
        code = cli.main(args=arguments, prog_name="thsa-cosim", standalone_mode=False)
        return code if isinstance(code, int) else 0
    except click.exceptions.Exit as exit_:
        return exit_.exit_code
    except click.MissingParameter as error:
        usage = "" if error.ctx is None else f" Usage: {error.ctx.get_usage().removeprefix('Usage: ')}."
        return _fail(f"{error.format_message()}{usage}", 2)
    except click.ClickException as error:
        return _fail(error.format_message(), 2)
    except ThsaCosimError as error:
        return _fail(str(error), error.exit_code)
    except Interrupted as interruption:
        return _fail(str(interruption), 130, label=False)
    except (KeyboardInterrupt, click.Abort):
        return _fail("interrupted; the same command starts again, or continues its study.", 130, label=False)
    except BrokenPipeError:
        # Whoever read our output has left; nothing may be written on the way out either.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f" ({error.filename})" if error.filename else ""
        remedy, code = _REMEDIES.get(error.errno or 0, ("", 2))
        return _fail(f"{error.strerror or error}{where}{remedy}.", code)
    except MemoryError:
        return _fail("there is not enough memory: use shorter recordings, longer steps or fewer workers.", 3)
    except Exception as error:
        detail = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        return _fail(f"internal fault, please report it: {detail} (THSA_COSIM_DEBUG=1 shows where).", 3)


def _fail(sentence: str, code: int, *, label: bool = True) -> int:
    if os.environ.get("THSA_COSIM_DEBUG"):
        traceback.print_exc()
    text = " ".join(sentence.split())
    click.echo(f"error: {text}" if label else text, err=True)
    return code
