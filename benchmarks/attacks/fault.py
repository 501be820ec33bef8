"""A fault on purpose: one place of the code, made wrong, and the tests that must notice."""

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Fault:
    """In `file`, the text `old`, which must stand there exactly once, becomes `new`.

    tests: pytest node ids. Each names a test, or all cases of a parametrised one; each must have a
    case that fails.
    """

    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]

    def missing(self, root: Path = ROOT) -> str | None:
        """Why the fault does not fit the code, in one phrase; None when it does."""
        path = root / self.file
        if not path.exists():
            return f"{self.file} does not exist"
        found = path.read_text().count(self.old)
        if found != 1:
            return f"{self.file} holds its text {found} times, expected once"
        absent = [test for test in self.tests if not _defined(root, test)]
        return f"no test {absent[0]}" if absent else None

    def plant(self, root: Path) -> str:
        """Make the fault in a copy of the code; returns the text to restore."""
        path = root / self.file
        good = path.read_text()
        path.write_text(good.replace(self.old, self.new))
        return good


def _defined(root: Path, test: str) -> bool:
    file, _, name = test.partition("::")
    path = root / file
    return path.exists() and f"def {name.split('::')[-1].split('[')[0]}(" in path.read_text()
