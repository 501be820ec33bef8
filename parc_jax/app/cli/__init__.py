"""The shell: learn a robot, find its safe sets, prove them, draw them.

Exit codes: 0 an answer, 1 no plan found, or refused by `check`, 2 bad input, 3 a fault in a
program, or a part that `check --second` did not look at, 130 stopped. Files appear complete or not
at all, and a stopped `run` or `learn` continues where it was.
With --verbose every command logs its stages.
Completion scripts: parc-jax --tyro-print-completion bash (or zsh). Version: parc-jax --version.
"""

import atexit
import gc
import importlib
import os
import sys
import traceback
from collections.abc import Callable
from threading import Event

from parc_jax.app.cli.process import STOPPED, logging_of, stoppable
from parc_jax.common.errors import InputError, ParcError

OK, NO_ANSWER, BAD_INPUT, BROKEN = 0, 1, 2, 3
COMMANDS = {
    "run": "run",
    "learn": "learn",
    "solve": "solve",
    "check": "check",
    "explain": "check",
    "plot": "plot",
    "export": "plot",
    "live": "live",
    "systems": "systems",
    "doctor": "systems",
}  # and the file of each
# new objects between two searches for garbage: tracing makes millions that all stay
COLLECT_EVERY = 100_000


def main(arguments: list[str] | None = None) -> None:
    """Entry point of the console script. Always ends in SystemExit."""
    arguments = sys.argv[1:] if arguments is None else arguments
    gc.set_threshold(COLLECT_EVERY)
    atexit.register(gc.freeze)  # a search at the end takes a quarter of a second, for nothing
    try:
        with stoppable() as interrupts, logging_of(arguments) as words:
            code = _run(words, interrupts)
            sys.stdout.flush()
        code = STOPPED if interrupts.is_set() else code  # a library may swallow it on the way
    except KeyboardInterrupt:
        more = " Finished rollouts are kept; the same command continues from them."
        code = _say(f"stopped.{more if arguments[:1] in (['run'], ['learn']) else ''}", STOPPED)
    except InputError as error:
        code = _say(error, BAD_INPUT)
    except BrokenPipeError:  # the reader of the output has enough, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = STOPPED
    sys.exit(code)


def _run(arguments: list[str], interrupts: Event) -> int:
    if arguments[:1] == ["check"] and not {"-h", "--help"} & set(arguments):
        from parc_jax.app.cli.check import brief  # before anything heavy: it needs no package

        return brief(arguments[1:])
    if arguments[:1] == ["--version"]:
        from parc_jax import __version__

        print(f"parc-jax {__version__}")
        return OK
    names = [word.split("=", 1)[0] for word in arguments if word.startswith("--")]
    for name in names:  # the parser would drop one of them silently
        if names.count(name) > 1:
            raise InputError(
                f"{name}: expected every option once; it is there {names.count(name)} times. Name "
                f"all its values after one {name}."
            )
    return _dispatch(arguments, interrupts)


def command(name: str) -> Callable:
    """The function of a command."""
    return getattr(importlib.import_module(f"parc_jax.app.cli.{COMMANDS[name]}"), name)


def _dispatch(arguments: list[str], interrupts: Event) -> int:
    # the compilation cache reports CPU tuning hints at the level of errors, page after page
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    try:
        import tyro
    except ModuleNotFoundError:
        raise InputError(
            "expected the packages that parc_jax needs; without them there is `parc-jax check` "
            "alone. Try pip install parc_jax, without --no-deps."
        ) from None

    from parc_jax.app.cli.options import readable

    first = arguments[0] if arguments else ""
    commands = {
        name: readable(command(name), first == name or first.startswith("--tyro"))
        for name in COMMANDS
    }
    try:
        looks = {"prog": "parc-jax", "description": __doc__, "use_underscores": False}
        return tyro.extras.subcommand_cli_from_dict(commands, args=arguments, **looks)
    except ParcError as error:
        return _say(error, BAD_INPUT if isinstance(error, InputError) else NO_ANSWER)
    except BrokenPipeError:
        raise
    except OSError as error:
        reason = f"{error.filename}: {error.strerror}" if error.filename else str(error)
        return _say(
            f"expected to read and write the files named; {reason}. Name another file or folder, "
            "or make room and give the right to write.",
            BAD_INPUT,
        )
    except Exception:
        # a fault here, or in the program of a robot: it must never look like "no plan"
        if interrupts.is_set():  # a library turned it into an exception of its kind
            raise KeyboardInterrupt from None
        traceback.print_exc()
        return _say("this should not have happened; the lines above say where.", BROKEN)


def _say(message, code: int) -> int:
    print(f"parc-jax: {message}", file=sys.stderr, flush=True)
    return code
