"""The shell: `parc-jax run | check | systems | doctor`.

Exit codes: 0 an answer, 1 no plan found or a certificate refused, 2 bad input. Nothing is left half-written.
"""

import os
import sys

OK, NO_ANSWER, BAD_INPUT, STOPPED = 0, 1, 2, 130


def main(arguments: list[str] | None = None) -> None:
    """Entry point of the console script."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments[:1] == ["check"] and not {"-h", "--help"} & set(arguments):
        from parc_jax import checker  # before anything heavy: the checker needs no JAX

        sys.exit(checker.main(arguments[1:]))
    sys.exit(_dispatch(arguments))


def _dispatch(arguments: list[str]) -> int:
    # the compilation cache reports CPU tuning hints at the level of errors, page after page
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    import tyro

    from parc_jax.cli.check import check
    from parc_jax.cli.doctor import doctor
    from parc_jax.cli.run import run
    from parc_jax.cli.systems import systems
    from parc_jax.errors import InputError, ParcError

    commands = {"run": run, "check": check, "systems": systems, "doctor": doctor}
    try:
        return tyro.extras.subcommand_cli_from_dict(commands, prog="parc-jax", description=__doc__, args=arguments)
    except InputError as error:
        print(f"parc-jax: {error}", file=sys.stderr)
        return BAD_INPUT
    except ParcError as error:
        print(f"parc-jax: {error}", file=sys.stderr)
        return NO_ANSWER
    except KeyboardInterrupt:
        print("parc-jax: stopped. Finished rollouts are kept; the same command continues from them.", file=sys.stderr)
        return STOPPED
