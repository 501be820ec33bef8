"""Files in and out: whole or absent, and clear about what is wrong."""

import json
import re
from concurrent.futures import ThreadPoolExecutor

import jax
import numpy as np
import pytest
from synthetic_plants import noisy, plant

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.files import read_npz, save_rollouts, write_atomic, write_npz
from parc_jax.learning.runs.loaders import load_rollouts
from parc_jax.learning.system import time_grid
from parc_jax.learning.systems.content import whole_digest

GRID = time_grid(0.25, 1.0, 0.05)


@pytest.fixture(scope="module")
def batch():
    return collect(plant(noisy), jax.random.PRNGKey(1), 30, quiet=True)


def test_a_saved_batch_comes_back_equal(batch, tmp_path):
    back = load_rollouts(save_rollouts(tmp_path / "a.npz", batch))
    for field in ("rows", "k", "p", "q"):
        np.testing.assert_array_equal(getattr(back, field), getattr(batch, field))
    assert (back.law, back.time, back.seed, back.stage) == (
        batch.law,
        batch.time,
        batch.seed,
        batch.stage,
    )
    assert (back.hashes() == batch.hashes()).all()


def test_an_own_file_with_other_names_or_numbers_is_refused(batch, tmp_path):
    """Recordings under a name that nobody reads were as many runs."""
    np.savez(tmp_path / "log.npz", k=batch.k, p=batch.p, q=batch.q, groups=np.arange(30) // 3)
    log = load_rollouts(tmp_path / "log.npz", GRID, batch.domain)
    kept = read_npz(save_rollouts(tmp_path / "own.npz", log))

    def edited(**arrays):
        np.savez(tmp_path / "edited.npz", **arrays)
        return load_rollouts(tmp_path / "edited.npz")

    alone = {name: array for name, array in kept.items() if name != "groups"}
    assert edited(**kept).recordings == 10
    with pytest.raises(InputError, match="expected names of save_rollouts; got group too"):
        edited(**alone, group=kept["groups"])
    meta = json.loads(str(kept["meta"])) | {"weather": "rain"}
    with pytest.raises(InputError, match="got weather too"):
        edited(**kept | {"meta": np.array(json.dumps(meta))})
    on_the_way = kept["p"] + 9 * (np.arange(kept["p"].shape[1]) == 1)[:, None]
    others = {"k": kept["k"][::-1]}, {"groups": np.arange(30)}, {"p": on_the_way}
    for other in (alone, *(kept | one for one in others)):
        with pytest.raises(InputError, match="holds other rollouts than were made"):
            edited(**other)
    save_rollouts(tmp_path / "some.npz", log.select(slice(3, 9)))
    assert load_rollouts(tmp_path / "some.npz").recordings == 2


def test_what_is_saved_is_read_whatever_form_it_has(batch, tmp_path):
    """Halves without a lost run, and arrays of other kinds, were refused as edited."""
    lost = np.arange(30) == 0
    parts = [*batch.replace(lost=lost.astype(int)).split(0.5), batch.replace(lost=0 * batch.rows)]
    forms = {"q": np.float32, "rows": np.int32, "k": ">f8"}
    parts += [batch.replace(**{x: getattr(batch, x).astype(to)}) for x, to in forms.items()]
    parts += [batch.replace(p=jax.numpy.asarray(batch.p)), batch.select(slice(0))]
    for part in parts:
        back = load_rollouts(save_rollouts(tmp_path / "part.npz", part))
        assert (back.hashes() == part.hashes()).all() and (back.rows == part.rows).all()
        one = part.lost is not None and part.lost.any()
        assert back.lost is None if not one else (back.lost == part.lost).all()


def edits(meta):
    """A file's `meta` with one thing changed, by its name."""
    law = {"generator": "file:other", "k_law": "logged", "parameters": [["slip", "0"]]}
    yield from ((name, meta | {"law": meta["law"] | {name: x}}) for name, x in law.items())
    stated = {"time": dict(meta["time"], dt=0.5), "seed": [0, 7], "stage": 9, "given": [0]}
    stated |= {"labels": dict(meta["labels"], k=["w [rad/s]", "v [m/s]"]), "source": None}
    stated |= {"made_by": {"system": {}}, "rotation": None, "points": ["nose"]}
    yield from ((name, meta | {name: x}) for name, x in stated.items())


def test_whatever_was_edited_in_an_own_file_is_refused(batch, tmp_path):
    """Its time, law, seed or K were taken as they were found."""
    told = batch.replace(rotation=("turns",), points=("tail",))
    kept = read_npz(save_rollouts(tmp_path / "own.npz", told))
    older = [getattr(told, name) for name in ("rows", "k", "p", "q", "groups", "lost")]
    meta = json.loads(str(kept["meta"]))
    others = {name: {"meta": np.array(json.dumps(other))} for name, other in edits(meta)}
    assert len({str(other["meta"]) for other in others.values()} - {str(kept["meta"])}) == 12
    for name, other in (others | {x: {x: kept[x] - 9} for x in ("lo", "hi")}).items():
        np.savez(tmp_path / f"{name}.npz", **kept | other)
        with pytest.raises(InputError, match=r"other rollouts .* load it, and save the other"):
            load_rollouts(tmp_path / f"{name}.npz")
    np.savez(tmp_path / "again.npz", **dict(reversed(kept.items())))  # in any order
    del meta["digest"]  # as written before, with one of the runs alone, or with none
    for name, made_by in (("older", {"runs": whole_digest(older)}), ("oldest", None)):
        about = {"meta": np.array(json.dumps(meta | {"made_by": made_by}))}
        np.savez(tmp_path / f"{name}.npz", **kept | about)
        np.savez(tmp_path / f"{name} other.npz", **kept | about | {"q": kept["q"] + 1})
    with pytest.raises(InputError, match="holds other rollouts than were made"):
        load_rollouts(tmp_path / "older other.npz")
    for name in ("again", "older", "oldest"):
        assert (load_rollouts(tmp_path / f"{name}.npz").hashes() == batch.hashes()).all()


@pytest.mark.parametrize("compressed", [False, True])
def test_wherever_a_byte_is_wrong_the_file_is_whole_or_says_so(tmp_path, compressed):
    rng = np.random.default_rng(0)
    path = write_npz(tmp_path / "a.npz", {"a": rng.normal(size=50), "b": np.zeros(99)}, compressed)
    whole, arrays = path.read_bytes(), read_npz(path)
    for at in range(len(whole)):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x55]) + whole[at + 1 :])
        try:
            found = read_npz(path)
        except InputError as error:
            assert "truncated or damaged" in str(error)
        else:  # in a date, a comment, or a name: those have no checksum
            assert all(np.array_equal(found[name], arrays[name]) for name in found if name in "ab")


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = write_atomic(tmp_path / "a.txt", b"old")
    monkeypatch.setattr("os.fsync", lambda handle: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        write_atomic(path, b"new")
    assert path.read_bytes() == b"old"


def test_threads_that_write_one_file_leave_it_whole(tmp_path):
    def write(text: bytes):
        for _ in range(50):
            write_atomic(tmp_path / "a.txt", text)
            assert len(set((tmp_path / "a.txt").read_bytes())) == 1

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(write, [b"a" * 100_000, b"b" * 10, b"c" * 50_000, b"d"]))
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_commands_are_uniform_only_where_that_is_said(batch, tmp_path):
    np.savez(tmp_path / "log.npz", k=batch.k, p=batch.p, q=batch.q)
    said = load_rollouts(tmp_path / "log.npz", GRID, batch.domain, k_law="uniform")
    assert said.law.k_law == "uniform" and said.law.lo == batch.law.lo
    assert load_rollouts(tmp_path / "log.npz", GRID, batch.domain).law.k_law == "logged"
    for wrong in ({"k_law": "uniform"}, {"k_law": "even", "domain": batch.domain}):
        with pytest.raises(InputError, match="expected k_law"):
            load_rollouts(tmp_path / "log.npz", GRID, **wrong)
    with pytest.raises(InputError, match="knows its own"):
        load_rollouts(
            save_rollouts(tmp_path / "own.npz", batch), domain=batch.domain, k_law="uniform"
        )


def test_folder_of_csv_logs(batch, tmp_path):
    (tmp_path / "p").mkdir()
    np.savetxt(tmp_path / "k.csv", batch.k, delimiter=",", header="speed,angle", comments="")
    np.savetxt(tmp_path / "q.csv", batch.q, delimiter=",")
    for i, track in enumerate(batch.p):
        np.savetxt(
            tmp_path / "p" / f"run_{i:03d}.csv", track, delimiter=",", header="x,y", comments=""
        )
    back = load_rollouts(tmp_path, time=GRID, domain=batch.domain)
    np.testing.assert_array_equal(back.k, batch.k)
    np.testing.assert_array_equal(back.p, batch.p)
    assert back.labels == (("x", "y"), ("q0",), ("speed", "angle"))
    (tmp_path / "p" / "run_007.csv").write_text("1,2\n3\n")
    with pytest.raises(InputError, match=r"run_007.csv"):
        load_rollouts(tmp_path, time=GRID)
    (tmp_path / "p" / "run_007.csv").unlink()
    with pytest.raises(InputError, match="as many rows"):
        load_rollouts(tmp_path, time=GRID)


def test_files_are_paired_with_rows_in_one_order_only(batch, tmp_path):
    (tmp_path / "p").mkdir()
    np.savetxt(tmp_path / "k.csv", batch.k[:12], delimiter=",")
    for i, track in enumerate(batch.p[:12]):
        np.savetxt(tmp_path / "p" / f"run{i + 1}.csv", track, delimiter=",")
    with pytest.raises(InputError, match=r"run12\.csv comes before run2\.csv\. Write all numbers"):
        load_rollouts(tmp_path, time=GRID)
    for i in range(12):
        (tmp_path / "p" / f"run{i + 1}.csv").rename(tmp_path / "p" / f"run{i + 1:02}.csv")
    back = load_rollouts(tmp_path, time=GRID)
    np.testing.assert_array_equal(back.p[:, 1:], batch.p[:12, 1:])


def test_names_of_columns_are_those_of_the_header(batch, tmp_path):
    """As NumPy or a spreadsheet writes them; what is given goes before, in the same units."""
    (tmp_path / "p").mkdir()
    head = {"comments": "", "delimiter": ","}
    np.savetxt(tmp_path / "k.csv", batch.k, delimiter=",", header="speed [m/s],angle [rad]")
    np.savetxt(tmp_path / "q.csv", batch.q, header='"heading [rad]"', **head)
    for i, track in enumerate(batch.p):
        np.savetxt(tmp_path / "p" / f"{i:03d}.csv", track, header="east [m], north [m]", **head)
    names = (("east [m]", "north [m]"), ("heading [rad]",), ("speed [m/s]", "angle [rad]"))
    assert load_rollouts(tmp_path, GRID).labels == names
    assert load_rollouts(tmp_path, GRID).subject.labels.heading == 0
    given = load_rollouts(tmp_path, GRID, labels={"k": ("a [m/s]", "angle [rad]")}).labels
    assert given == (*names[:2], ("a [m/s]", "angle [rad]"))
    for k in (("speed [km/h]", "angle"), ("speed", "angle"), ("angle [m/s]", "speed [rad]")):
        said = re.escape(f"'speed [m/s]', in its unit and with no other's name; got '{k[0]}'")
        with pytest.raises(InputError, match=said):
            load_rollouts(tmp_path, GRID, labels={"k": k})
    np.savetxt(tmp_path / "q.csv", batch.q, header="heading", **head)
    given = {"q": "heading [rad]", "k": names[2]}  # the file says no unit, or the same
    assert load_rollouts(tmp_path, GRID, labels=given).labels == names
    with pytest.raises(InputError, match=r"the rank correlation of speed \[m/s\] and angle"):
        k = np.sort(batch.k, axis=0)
        np.savetxt(tmp_path / "k.csv", k, delimiter=",", header="speed [m/s],angle [rad]")
        load_rollouts(tmp_path, GRID, batch.domain, k_law="uniform")
    np.savetxt(tmp_path / "k.csv", batch.k, delimiter=",", header="speed")
    with pytest.raises(InputError, match=r"k\.csv: expected a first line .* 2 columns; got 1 name"):
        load_rollouts(tmp_path, GRID)


def test_columns_of_several_points_are_theirs_and_in_metres(batch, tmp_path):
    """Millimetres were read as metres, and the points of a robot taken for each other."""
    (tmp_path / "p").mkdir()
    np.savetxt(tmp_path / "k.csv", batch.k, delimiter=",")
    both, points = np.concatenate([batch.p, batch.p], axis=2), ("front", "front left")

    def load(header):
        for i, track in enumerate(both):
            name = tmp_path / "p" / f"{i:03d}.csv"
            np.savetxt(name, track, header=header, comments="", delimiter=",")
        return load_rollouts(tmp_path, GRID, points=points)

    runs = load("front x [m],front y [m],Front left x [m],Front left y [m]")
    assert runs.points == points and runs.subject.labels.p == ("x [m]", "y [m]")
    assert load("x,y,left_x,left_y").points == points
    for header, sentence in (
        ("front x [m],front y [m],front left x [mm],front left y [mm]", "front left x in .m."),
        ("front x (mm),front y (mm),front left x (mm),front left y (mm)", "front x in .m."),
        ("front_left_x,front_left_y,front_x,front_y", "got 'front_left_x' for x of front"),
        ("front x,front left x,front y,front left y", "got 'front left x' for y of front"),
        ("front y,front x,front left y,front left x", "got 'front y' for x of front"),
    ):
        with pytest.raises(InputError, match=sentence):
            load(header)


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("y,x", "got 'y' for x of reference"),
        ("north [m],east [m]", r"got 'north \[m\]' for x"),
        ("latitude,longitude", "got 'latitude'. Places are in m, axis by axis"),
        ("x,yaw", "got 'yaw'.* a heading, such as yaw, is q, with rotation"),
        ("timeStamp,x", "got 'timeStamp'.* times, speeds and goals are left out"),
        ("posX,posZ", "got 'posZ' for y"),
        ("along,aside", r"got 'along'.* told with their unit, as 'left foot x"),
        ("x_px,y_px", "expected x_px in .m."),
    ],
)
def test_a_column_of_places_is_that_axis_in_metres(batch, tmp_path, header, said):
    """Columns y, x were read as x, y: a map's walls stood in a mirror. A yaw became a place."""
    (tmp_path / "p").mkdir()
    np.savetxt(tmp_path / "k.csv", batch.k, delimiter=",")

    def load(header):
        for i, track in enumerate(batch.p):
            name = tmp_path / "p" / f"{i:03d}.csv"
            np.savetxt(name, track, header=header, comments="", delimiter=",")
        return load_rollouts(tmp_path, GRID).subject.labels.p

    with pytest.raises(InputError, match=said):
        load(header)
    for fits in ("x,y", "posX,posY", "ahead [m],left [m]", "Easting,Northing"):
        assert load(fits) == tuple(fits.split(","))


# pairs of columns as robots' logs have them: the other way round they are a mirror
PAIRS = (
    "px,py|xpos,ypos|posx,posy|p_x,p_y|x0,y0|x1,y1|x_0,y_0|tx,ty|x_t,y_t|E,N|pos_e,pos_n|"
    "px [m],py [m]|dx [m],dy [m]|xpos [m],ypos [m]|tx [m],ty [m]|E [m],N [m]|xPos [m],yPos [m]|"
    "x_m,y_m|robot_x,robot_y|x_east,y_north|pose.position.x,pose.position.y|xcoord,ycoord"
)


def one_file(folder, header, n, points=None):
    """The labels of runs whose coordinates stand in columns of these names."""
    (folder / "p").mkdir(exist_ok=True)
    rng = np.random.default_rng(0)
    np.savetxt(folder / "k.csv", rng.uniform(size=(3, 2)), delimiter=",")
    for i in range(3):
        track = rng.uniform(size=(GRID.n_record + 1, n))
        name = folder / "p" / f"{i}.csv"
        np.savetxt(name, track, header=header, comments="", delimiter=",")
    return load_rollouts(folder, GRID, points=points).subject.labels.p


@pytest.mark.parametrize("pair", PAIRS.split("|"))
def test_columns_by_their_common_names_are_taken_in_their_order_alone(tmp_path, pair):
    names = pair.split(",")
    assert one_file(tmp_path, ",".join(names), 2) == tuple(names)
    with pytest.raises(InputError, match="of each x, y, z, by these names"):
        one_file(tmp_path, ",".join(names[::-1]), 2)


def test_columns_of_other_places_are_taken_by_their_unit_alone(tmp_path):
    """A state vector; beside a path; of a point named E. Increments or speeds are no places."""
    for fits in ("x1 [m],x2 [m]", "z1 [m],z2 [m]", "s [m],e [m]"):
        assert one_file(tmp_path, fits, 2) == tuple(fits.split(","))
    one_file(tmp_path, "E ahead [m],E left [m],N ahead [m],N left [m]", 4, ("E", "N"))
    for wrong in ("dx,dy", "s,e", "x1,x2"):
        with pytest.raises(InputError, match=r"by these names or as 'ahead|with their unit, as"):
            one_file(tmp_path, wrong, 2)


def test_numbered_columns_are_those_of_their_point(tmp_path):
    both = ("front", "rear")
    for fits in ("x1,y1,x2,y2", "x,y,x_1,y_1", "rear_2_x,rear_2_y,front_1_x,front_1_y"):
        points = both[::-1] if fits.startswith("rear") else both
        one_file(tmp_path, fits, 4, points)
    left = ("front left", "rear left")  # by glued names, too
    one_file(tmp_path, "frontleft_x,frontleft_y,rearleft_x,rearleft_y", 4, left)
    with pytest.raises(InputError, match="in the order of points, rear left, front left"):
        one_file(tmp_path, "frontleft_x,frontleft_y,rearleft_x,rearleft_y", 4, left[::-1])
    for mixed, points in (("x2,y2,x1,y1", both), ("x1,y2,x2,y1", both), ("x1,y2", None)):
        with pytest.raises(InputError, match="in the order of points"):
            one_file(tmp_path, mixed, 2 if points is None else 4, points)


@pytest.mark.parametrize("head", ["y,x", ""])
def test_files_of_runs_name_the_same_columns_in_the_same_order(batch, tmp_path, head):
    (tmp_path / "p").mkdir()
    np.savetxt(tmp_path / "k.csv", batch.k[:3], delimiter=",")
    for i, named in enumerate(['"x", y', "x,y", head]):
        name = tmp_path / "p" / f"{i}.csv"
        np.savetxt(name, batch.p[i], delimiter=",", header=named, comments="")
    with pytest.raises(InputError, match=r"2\.csv: expected columns x, y, like 0\.csv; got "):
        load_rollouts(tmp_path, GRID)


def test_a_mark_at_the_beginning_of_a_table_is_no_part_of_a_name(batch, tmp_path):
    (tmp_path / "p").mkdir()
    np.savetxt(tmp_path / "k.csv", batch.k[:3], delimiter=",")
    for i, track in enumerate(batch.p[:3]):
        np.savetxt(tmp_path / "p" / f"{i}.csv", track, delimiter=",")
    names = "caf\u00e9\nCafe\u200b\u0301\nday2"
    (tmp_path / "groups.csv").write_text(names, encoding="utf-8-sig")
    first, second, third = load_rollouts(tmp_path, time=GRID).groups
    assert first == second != third
    (tmp_path / "groups.csv").write_text("müde\nwach\nda", encoding="latin-1")
    with pytest.raises(InputError, match=r"groups.csv: expected a table as text in UTF-8"):
        load_rollouts(tmp_path, time=GRID)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"time": 3}, "time: expected"),
        ({"domain": [0, 1]}, "domain: expected"),
        ({"labels": [1]}, "labels: expected names by part"),
    ],
)
def test_what_is_no_grid_domain_or_label_is_refused(batch, tmp_path, options, said):
    np.savez(tmp_path / "log.npz", k=batch.k, p=batch.p)
    with pytest.raises(InputError, match=said):
        load_rollouts(tmp_path / "log.npz", **({"time": GRID} | options))
    np.savez(tmp_path / "log.npz", k=batch.k, p=batch.p, labels=np.array(["a", "b"]))
    with pytest.raises(InputError, match="expected no array named labels; got one"):
        load_rollouts(tmp_path / "log.npz", time=GRID)


@pytest.mark.parametrize("meta", ["my data", "[]", '{"mine": 1}'])
def test_plain_npz(batch, tmp_path, meta):
    np.savez(tmp_path / "log.npz", k=batch.k, p=batch.p, meta=meta)
    back = load_rollouts(tmp_path / "log.npz", time=GRID)
    assert back.n_q == 0 and (back.domain.lo == batch.k.min(axis=0)).all()
    with pytest.raises(InputError, match=r"expected shape"):
        load_rollouts(tmp_path / "log.npz", time=time_grid(0.5, 1.0))


@pytest.mark.parametrize("name", ["group", "Groups", "recordings", "given", "t", "Q"])
def test_arrays_that_nobody_reads_are_refused(batch, tmp_path, name):
    """A misspelled groups would make every window of a recording a run of its own."""
    arrays = {"k": batch.k, "p": batch.p}
    np.savez(tmp_path / "log.npz", **arrays, **{name: np.arange(batch.n) // 4})
    with pytest.raises(InputError, match=f"q, groups, points; got '{name}'. Is it misspelled, or"):
        load_rollouts(tmp_path / "log.npz", GRID)


def test_arguments_that_contradict_the_file_are_refused(batch, tmp_path):
    path, p = tmp_path / "log.npz", np.stack([batch.p, batch.p + 0.1], axis=2)
    of = {"groups": np.arange(batch.n) // 4, "points": np.array(["tail", "nose"])}
    np.savez(path, k=batch.k, p=p, **of)
    same = load_rollouts(path, GRID, groups=list(of["groups"]), points=("tail", "nose"))
    assert same.recordings == -(-batch.n // 4) and same.points == ("tail", "nose")
    for name, other in {"groups": np.arange(batch.n), "points": ("nose", "tail")}.items():
        with pytest.raises(InputError, match=f"expected no {name}=, or those of the file"):
            load_rollouts(path, GRID, **{name: other})


def test_tables_and_columns_that_nobody_reads_are_refused(batch, tmp_path):
    (tmp_path / "p").mkdir()
    for i, track in enumerate(batch.p[:3]):
        np.savetxt(tmp_path / "p" / f"{i}.csv", track, delimiter=",")
    head = {"delimiter": ",", "comments": ""}
    np.savetxt(tmp_path / "k.csv", batch.k[:3], header="speed,angle", **head)
    for name in ("README.md", "notes.txt", "._k.csv", "k.png", "p/run1.png", "p/Thumbs.db"):
        (tmp_path / name).write_text("no table")
    assert load_rollouts(tmp_path, GRID).n == 3
    (tmp_path / "p" / "README.txt").write_text("no run")
    (tmp_path / "p" / "failed").mkdir()
    (tmp_path / ".git").mkdir()
    (tmp_path / ".git" / "k.csv").write_text("hidden")
    unread = "group.csv groups.txt q.txt q.CSV.gz p/failed/3.csv p/3.txt p/3.csv.bak more/k.csv"
    (tmp_path / "more").mkdir()
    for name in unread.split():
        (tmp_path / name).write_text("a\na\nb\n")
        with pytest.raises(InputError, match=rf"as p/\*\.csv; got {name}\. Is it misspelled"):
            load_rollouts(tmp_path, GRID)
        (tmp_path / name).unlink()
    (tmp_path / "Groups.CSV").write_text("a\na\nb\n")
    assert load_rollouts(tmp_path, GRID).recordings == 2
    np.savetxt(tmp_path / "p" / "3.CSV", batch.p[3], delimiter=",")
    with pytest.raises(InputError, match=r"as many rows in k\.csv as files in p/; got 3, 4"):
        load_rollouts(tmp_path, GRID)
    (tmp_path / "p" / "3.CSV").unlink()
    (tmp_path / "Groups.CSV").unlink()
    k = np.column_stack([batch.k[:3], [1, 1, 2]])
    np.savetxt(tmp_path / "k.csv", k, header="speed,angle,Recording", **head)
    with pytest.raises(InputError, match=r"got 'Recording', which tells a run's.*groups\.csv"):
        load_rollouts(tmp_path, GRID)


def folder_of(path, k, p, header, labels=None):
    (path / "p").mkdir(exist_ok=True)
    np.savetxt(path / "k.csv", k, delimiter=",", header=header, comments="")
    for i, track in enumerate(p):
        np.savetxt(path / "p" / f"{i:03d}.csv", track, delimiter=",")
    return load_rollouts(path, GRID, labels=labels)


@pytest.mark.parametrize(
    "name",
    "index|ID|run_id|timestamp|timestamp [s]|row (m)|t|T|Unnamed: 0|header.stamp.sec".split("|"),
)
def test_columns_that_tell_of_runs_their_row_or_time_are_no_parameters(batch, tmp_path, name):
    k = batch.k[::-1]  # neither goes on evenly
    said = re.escape(f"got {name!r}, which tells a run's row, recording or time")
    with pytest.raises(InputError, match=said):
        folder_of(tmp_path, k, batch.p, f"speed,{name}")
    np.savez(tmp_path / "log.npz", k=k, p=batch.p)
    with pytest.raises(InputError, match=said):
        load_rollouts(tmp_path / "log.npz", GRID, labels={"k": ("speed", name)})
    taken = "time banked [s]|t_brake|way|T [s]|T [N]|time [s]|t [s]|ms [kg]|time (s)"
    for fine in taken.split("|"):
        assert folder_of(tmp_path, k, batch.p, f"speed,{fine}").labels.k[1] == fine
        labels = {"k": ("speed", fine)}
        assert load_rollouts(tmp_path / "log.npz", GRID, labels=labels).labels.k[1] == fine


def test_a_label_renames_no_column_that_tells_of_runs(batch, tmp_path):
    """`run` was a speed. A label may tell the unit of a thrust T, by its name."""
    for column in ("run", "t", "header.stamp"):
        with pytest.raises(InputError, match=f"got {column!r}, which tells a run's row"):
            labels = {"k": ("speed [m/s]", "turn [deg]")}
            folder_of(tmp_path, batch.k, batch.p, f"{column},turn", labels)
    labels = {"k": ("T [N]", "turn [deg]")}
    assert folder_of(tmp_path, batch.k, batch.p, "T,angle", labels).labels.k == labels["k"]


def test_stamps_are_no_parameters_however_they_go_on(batch, tmp_path):
    """They were k0 from 1.7e9 on. A pressure has a unit."""
    uneven = 1.7e9 + np.cumsum(np.random.default_rng(0).uniform(5.0, 9.0, batch.n))
    for column in (1.7e9 + 0.5 * np.arange(batch.n), uneven, -uneven):
        k = np.c_[column, batch.k[:, 1]]
        np.savez(tmp_path / "log.npz", k=k, p=batch.p)
        for labels in (None, {"k": ("start [s]", "turn [rad]")}):
            with pytest.raises(InputError, match="which tells a run's row, recording or time"):
                load_rollouts(tmp_path / "log.npz", GRID, labels=labels)
        labels = {"k": ("pressure [Pa]", "turn [rad]")}
        assert load_rollouts(tmp_path / "log.npz", GRID, labels=labels).n == batch.n


@pytest.mark.parametrize(
    "column", [*np.arange(30) + np.c_[[0, 1]], 7 - np.arange(30), 1.7e9 + 3.0 * np.arange(30)]
)
def test_a_column_that_counts_the_rows_beside_others_is_no_parameter(batch, tmp_path, column):
    """A claim was over row numbers 1 to 399. Sweeps alone, with a unit, or in parts are fine."""
    k, p = batch.k.copy(), batch.p
    k[:, 1] = column
    for header in ("", "speed,turn", *["speed,turn [deg]"] * bool(column[0] in (0, 1))):
        with pytest.raises(InputError, match="which tells a run's row, recording or time"):
            folder_of(tmp_path, k, p, header)
    sweep = np.c_[batch.k[:, 0], 5.0 * np.arange(30)]
    assert folder_of(tmp_path, sweep, p, "speed,turn [deg]").n_k == 2
    k[:, 1] = column - 1.7e9 * (column[0] > 1e8)
    for fine in (k[:9], k[:, 1:], np.c_[np.ones(30), k[:, 1]], np.c_[batch.k[:, 0], k[:, 1] / 8.0]):
        np.savez(tmp_path / "log.npz", k=fine, p=p[: len(fine)])
        assert load_rollouts(tmp_path / "log.npz", GRID).n == len(fine)


@pytest.mark.parametrize("stamp", [0.0, 1.7e9, 1.7e18])
@pytest.mark.parametrize("at", [0, 2])
def test_a_time_without_a_name_is_no_place(batch, tmp_path, stamp, at):
    """t, x, y were a place in space. A name tells what rises so, as of a cart on a rail."""
    t = stamp + (1e9 if stamp > 1e12 else 1.0) * np.linspace(0.0, 1.0, GRID.n_record + 1)
    p = np.insert(batch.p, at, t, axis=2)
    p[3, 9:] = np.nan
    if stamp == 0.0:  # no run's clock is exact: jitter, and a rate that is off
        rng = np.random.default_rng(0)
        p[..., at] += rng.normal(0.0, 1e-3, p.shape[:2])
        p[..., at] *= 1.0 + 1e-3 * rng.normal(size=(batch.n, 1))
    with pytest.raises(InputError, match=f"column {at} of p rises alike in all runs, as a time"):
        folder_of(tmp_path, batch.k, p, "")
    np.savez(tmp_path / "log.npz", k=batch.k, p=p)
    with pytest.raises(InputError, match=f"column {at} of p rises alike in all runs, as a time"):
        load_rollouts(tmp_path / "log.npz", GRID)
    named = load_rollouts(tmp_path / "log.npz", GRID, labels={"p": ("x [m]", "y [m]", "z [m]")})
    assert named.subject.n_p == 3
    np.savez(tmp_path / "log.npz", k=batch.k, p=np.repeat(p[..., [at]], 2, axis=2))
    assert load_rollouts(tmp_path / "log.npz", GRID).n == batch.n  # all of them rise so
    np.savez(tmp_path / "log.npz", k=batch.k[:1], p=p[:1])
    assert load_rollouts(tmp_path / "log.npz", GRID).n == 1  # who knows, from one run
    p[..., at] = np.linspace(0.0, 1.0, GRID.n_record + 1) ** 2
    np.savez(tmp_path / "log.npz", k=batch.k, p=p)  # alike, but faster and faster
    assert load_rollouts(tmp_path / "log.npz", GRID).subject.n_p == 3


def test_headings_in_degrees_are_refused(batch, tmp_path):
    """A label says that they are in rad, of a robot that turns round and round."""
    q = np.linspace(-40.0, 25.0, batch.n)[:, None]
    np.savez(tmp_path / "log.npz", k=batch.k, p=batch.p, q=q)
    turns = {"time": GRID, "rotation": ("turns",)}
    with pytest.raises(
        InputError, match=r"headings in rad.*; got up to 40\. .* its q: 'q0 \[rad\]'"
    ):
        load_rollouts(tmp_path / "log.npz", **turns)
    far = load_rollouts(tmp_path / "log.npz", **turns, labels={"q": ("turn [rad]",)})
    assert np.array_equal(far.q, q) and load_rollouts(tmp_path / "log.npz", GRID).n_q == 1
    np.savez(tmp_path / "log.npz", k=batch.k, p=batch.p, q=q / 6.5)
    assert load_rollouts(tmp_path / "log.npz", **turns).rotation == ("turns",)


def test_times_are_no_numbers_and_nothing_is_no_path(batch, tmp_path):
    days = np.datetime64("2024-01-01") + np.arange(60).astype("timedelta64[D]")
    np.savez(tmp_path / "log.npz", k=days.reshape(30, 2), p=batch.p)
    with pytest.raises(InputError, match=r"expected k as one array of real numbers.*or times"):
        load_rollouts(tmp_path / "log.npz", GRID)
    with pytest.raises(InputError, match="load_rollouts: expected the path of a file or folder"):
        load_rollouts(None, GRID)
    with pytest.raises(InputError, match="times are none"):  # a unit would be lost
        box(np.array([1, 2], "timedelta64[ms]"), [5.0, 6.0])
