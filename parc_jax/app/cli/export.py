"""`parc-jax export`: an answer for a robot's own computer, or for those who look at it."""

from pathlib import Path
from typing import Annotated

from parc_jax.app.cli.offer import Offer
from parc_jax.app.cli.shell import Shell


def export(
    answer: Path,
    /,
    *,
    c: Path | None = None,
    name: str | None = None,
    mcap: Path | None = None,
    sample: int = 0,
    map: Path | None = None,
    frame_id: str = "map",
    shell: Annotated[Shell, Offer("app.cli.shell.Shell", only=("quiet",))],
) -> int:
    """Write an answer as a C99 header without dependencies, with is_safe(p0, k) and
    nearest_plan. Example: parc-jax export answer.json --c safe_set.h

    For Foxglove, as messages of ROS 2: parc-jax export answer.json --mcap answer.mcap, or an
    episode: parc-jax export drive.json --mcap drive.mcap --map hall.yaml

    Args:
        answer: An answer file of `solve` or `run`; it is checked anew. With --mcap also the file of
            an episode.
        c: The header to write.
        name: What its functions begin with. Default: the name of the header.
        mcap: The MCAP file to write: path, tf, body, tube, obstacles, goal, statement.
        sample: Number of the sample that is driven there, from 0.
        map: A map_server YAML file, which is written there too.
        frame_id: The frame that the world is told in there.
    """
    from parc_jax.app.cli.places import require_place
    from parc_jax.app.files.answer_file import load_answer
    from parc_jax.common.errors import InputError
    from parc_jax.drive.onboard.header import write_c

    if c is None and mcap is None:
        raise InputError("export: expected --c or --mcap, what is to be written; got neither.")
    for place in (c, mcap):
        require_place(place)
    written = []
    if mcap is not None:
        from parc_jax.problem.world.grid_map import load_map
        from parc_jax.ros.bags.write import write_mcap

        grid = None if map is None else load_map(map)
        written.append(write_mcap(mcap, answer, plan=sample, grid=grid, frame=frame_id))
    if c is not None:
        written.append(write_c(load_answer(answer), c, name))
    if not shell.quiet:
        for path in written:
            print(f"{path}: {len(path.read_bytes()):,} bytes")
    return 0
