"""`python -m benchmarks.attacks NAME [options]`: each name is a module of this folder with
`main(arguments) -> exit code`.
"""

import importlib
import sys
from pathlib import Path


def names() -> list[str]:
    """The attacks: modules of this folder that have a `main`. Nothing is imported."""
    found = sorted(Path(__file__).parent.glob("[!_]*.py"))
    return [path.stem for path in found if "\ndef main(" in path.read_text()]


def main(arguments: list[str]) -> int:
    """Run one attack. Exit codes: 0 nothing broke, 1 something did, 2 bad input."""
    if not arguments or arguments[0] not in names():
        got = arguments[0] if arguments else "nothing"
        print(f"attacks: expected one of {', '.join(names())}; got {got}.", file=sys.stderr)
        return 2
    module = importlib.import_module(f"benchmarks.attacks.{arguments[0]}")
    return module.main(arguments[1:])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
