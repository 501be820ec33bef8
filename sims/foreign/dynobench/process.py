"""The process that has dynobench: started once by each process that asks it, ends with it."""

import atexit
import contextlib
import os
import pickle
import subprocess
from functools import cache
from pathlib import Path

from parc_jax.common.errors import InputError

SERVER = Path(__file__).with_name("serve.py")
VARIABLE = "DYNOBENCH_PYTHON"
NEXT_TO_US = Path(__file__).parents[3] / ".venv-dynobench" / "bin" / "python"


def interpreter() -> Path:
    """The Python that has dynobench: named by DYNOBENCH_PYTHON, or that of .venv-dynobench in the
    checkout. Raises InputError with the line that makes it.
    """
    path = Path(os.environ.get(VARIABLE) or NEXT_TO_US)
    if not path.exists():
        raise InputError(
            f"dynobench: expected a Python that has it, since it was compiled for NumPy 1; {path} "
            "is not there. Try: python3 -m venv .venv-dynobench && .venv-dynobench/bin/pip install "
            f"dynobench==0.0.4 'numpy<2', and name its python in {VARIABLE}."
        )
    return path


def ask(what: str, *arguments):
    """What `serve.py` answers. Raises InputError where it cannot, or has ended."""
    server = _server(interpreter())
    try:
        pickle.dump((what, arguments), server.stdin)
        server.stdin.flush()
        fine, answer = pickle.load(server.stdout)
    except (EOFError, OSError):
        fine, answer = False, f"its process ended; does {interpreter()} have dynobench?"
        _server.cache_clear()
        _end(server)
    if not fine:
        why = " ".join(answer.split())  # of several lines, with a stack
        raise InputError(f"dynobench: expected an answer to {what!r}; {why:.200}")
    return answer


@cache
def _server(python: Path) -> subprocess.Popen:
    clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    server = subprocess.Popen([python, SERVER], env=clean, **pipes)
    atexit.register(_end, server)
    return server


def _end(server: subprocess.Popen) -> None:
    with contextlib.suppress(OSError):  # what was not read by a process that has ended
        server.stdin.close()
    server.stdout.close()
    server.wait()
