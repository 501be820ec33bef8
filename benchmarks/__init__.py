"""The benchmarks: `python -m benchmarks`, or `benchmarks.main([...])`. Method and results:
docs/benchmarks.md.
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the suite with command-line arguments; returns the exit code: 0 good, 1 failed, 2 bad
    input.
    """
    from benchmarks.command import run

    return run(arguments)
