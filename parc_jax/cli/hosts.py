"""One run over several processes: which one this is, and where it puts its files."""

from pathlib import Path


def join(hosts: str | None) -> int:
    """Join the other processes, if there are any; the number of this one. Call before anything else uses JAX."""
    if hosts is None:
        return 0
    from parc_jax import distributed

    distributed.init(hosts)
    import jax

    return jax.process_index()


def folder_of(host: int, out: Path) -> Path:
    """The first host owns `out`; the others keep their finished chunks in a folder each, shared disk or not."""
    return out if host == 0 else out / "hosts" / str(host)
