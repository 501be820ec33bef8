"""The header against Python, plan by plan; compiled with the system's compiler."""

import ctypes
import ctypes.util
import platform
import re
import subprocess
from contextlib import contextmanager

import jax
import numpy as np
import pytest
import toy_query
from toy_bodies import points_model, points_problem
from toy_header import TUBES, toy_tables, write_toy
from toy_models import line_model, model_of, told

import parc_jax as pj
from benchmarks.compiled_header import COMPILER, Header
from parc_jax.app.cli import main
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.learning.labels import name_of
from parc_jax.learning.network.relu import relu_network

pytestmark = pytest.mark.soundness
needs_compiler = pytest.mark.needs("compiler")
N = 100_000


def near(rng, plans, n: int, spread: float):
    """n plans around some."""
    chosen = plans[rng.integers(0, len(plans), n)]
    return chosen + spread * rng.normal(size=chosen.shape)


def compared(answer, path, spread: float = 0.1):
    """What the header of an answer says of N plans, and what Python says: all over K, and close."""
    header = Header(pj.exchange.write_c(answer, path))
    rng = np.random.default_rng(0)
    n_p = answer.model.n_p
    domain = answer.model.domain
    plans = near(rng, answer.samples, N, spread)
    plans[::4, n_p:] = rng.uniform(domain.lo, domain.hi, (len(plans[::4]), answer.model.n_k))
    p0, k = plans[:, :n_p], plans[:, n_p:]
    k = np.where(rng.uniform(size=len(k))[:, None] < 0.9, np.clip(k, domain.lo, domain.hi), k)
    inside = ((domain.lo <= k) & (k <= domain.hi)).all(axis=1)
    known = np.zeros(N, bool)
    known[inside] = answer.contains(p0[inside], k[inside])
    return header.are_safe(p0, k), known


@needs_compiler
def test_a_header_says_what_python_says(tmp_path):
    said, known = compared(toy_query.answer(), tmp_path / "toy.h")
    assert 1000 < known.sum() < N - 1000
    np.testing.assert_array_equal(said, known)


@needs_compiler
def test_a_network_of_one_layer_compiles(tmp_path):
    """There was room for hidden layers alone, and the compiler would not have the outputs."""
    line = line_model(e=0.02)
    goal, block = pj.box([0.4, -0.3, -9.0], [0.9, 0.3, 9.0]), pj.box([0.3, 0.35], [0.6, 0.6])
    problem = pj.reach_avoid(goal, [block], 0.05, start=pj.box([-0.1, -0.1], [0.1, 0.1]))
    answer = pj.Planner(line).solve(problem, jax.random.key(0), pj.Settings(proof=False))
    said, known = compared(answer, tmp_path / "line.h")
    assert 1000 < known.sum() < N - 1000
    np.testing.assert_array_equal(said, known)


def test_a_header_says_whose_heading_its_plans_start_with(tmp_path):
    text = pj.exchange.write_c(toy_query.answer(), tmp_path / "toy.h").read_text()
    assert "All plans start with the heading of the model's runs." in text
    assert "is of a k that nearest_plan finds: it is picked" in text.replace("\n *", "")


def test_a_header_says_which_k_is_which_and_its_unit(tmp_path):
    """Also where a measured one is no parameter of its plans any more: K was without names."""
    named = line_model(e=0.02).with_labels({"k": ("speed [m/s]", "turn [rad/s]")})
    problem = pj.reach_avoid(pj.box([0.4, -0.3, -9.0], [0.9, 0.3, 9.0]), [], 0.05)
    known = pj.Uncertainty(given={"speed": 0.6})
    for asked, said in (
        (problem, "k[0] is speed [m/s], k[1] is turn [rad/s]."),
        (problem.replace(uncertainty=known), "k[0] is turn [rad/s]."),
    ):
        answer = pj.Planner(named).solve(asked, jax.random.key(0), pj.Settings(proof=False))
        text = pj.exchange.write_c(answer, tmp_path / "line.h").read_text().replace("\n *", "")
        for words in (answer.details(), text):
            assert f"p0 is x [m], y [m] of reference point 0 at the start; {said}" in words


@needs_compiler
@pytest.mark.night
@pytest.mark.parametrize(("n_p", "fitted"), [(2, False), (2, True), (3, False), (3, True)])
def test_bodies_and_fitted_tubes_too(n_p, fitted, tmp_path):
    rng = np.random.default_rng(5 + n_p)
    model = points_model(rng, n_p=n_p, m=3, fitted=fitted)
    problem = points_problem(rng, model)
    settings = pj.Settings(samples=20, target=0.5, budget_s=300)
    answer = pj.Planner(model).solve(problem, jax.random.PRNGKey(0), settings)
    assert len(answer.corridors)
    said, known = compared(answer, tmp_path / "body.h")
    assert 1000 < known.sum() < N - 1000
    np.testing.assert_array_equal(said, known)


@needs_compiler
@pytest.mark.parametrize(
    "flags",
    [
        [],
        ["-O3", "-ffp-contract=fast", "-fno-finite-math-only"],
        # what is left of -ffast-math when that which no margin pays for is taken back
        ["-Ofast", "-fno-finite-math-only", "-fno-associative-math"],
        # as where a compiler keeps to itself that it takes everything for a number
        ["-ffinite-math-only", "-U__FINITE_MATH_ONLY__", "-D__FINITE_MATH_ONLY__=0"],
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("tube", TUBES)
def test_what_is_not_a_number_is_not_safe(tube, flags, tmp_path):
    require_numbers(Header(write_toy(toy_tables(tube), tmp_path / "toy.h"), *flags))


@pytest.mark.needs("clang")
def test_clang_is_told_that_not_everything_is_a_number(tmp_path):
    path = write_toy(toy_tables(), tmp_path / "toy.h")
    for flags in (["-O3"], ["-fno-honor-nans"], ["-funsafe-math-optimizations"]):
        require_numbers(Header(path, *flags, compiler="clang"))
    with pytest.raises(AssertionError, match=r"error.*without -ffast-math"):
        Header(path, "-ffast-math", compiler="clang")


def require_numbers(header: Header) -> None:
    answer = toy_query.answer()
    plan = np.repeat(answer.samples[:1], 5, axis=0)
    assert header.are_safe(plan[:, :2], plan[:, 2:]).all()
    for bad in (np.nan, np.inf, -np.inf, 1e300):
        broken = plan[:4] + np.diag([bad] * 4)
        assert not header.are_safe(broken[:, :2], broken[:, 2:]).any()
    assert np.array(5e-324) / 1 > 0  # whatever was loaded, this process still has small numbers


@needs_compiler
@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["-ffast-math"], "without -ffast-math"),
        (["-ffinite-math-only"], "without -ffinite-math-only"),
        (["-ffast-math", "-fno-finite-math-only"], "without -fassociative-math"),
        # registers of 80 bits, as -mfpmath=387 has them
        (["-U__FLT_EVAL_METHOD__", "-D__FLT_EVAL_METHOD__=2"], "double is computed as double"),
        # a double as short as a float, as some small computers have it
        (["-U__DBL_MANT_DIG__", "-D__DBL_MANT_DIG__=24"], "IEEE's double of 64 bits"),
        (["-U__FLT_RADIX__", "-D__FLT_RADIX__=16"], "IEEE's double of 64 bits"),
        (["-std=gnu89"], "double is computed as double"),  # which says nothing of it
        # as another vendor's compiler says it
        (["-D_M_FP_FAST"], "without -ffast-math"),
    ],
)
def test_arithmetic_that_the_margins_do_not_pay_for_is_refused(flags, said, tmp_path):
    path = pj.exchange.write_c(toy_query.answer(), tmp_path / "toy.h")
    with pytest.raises(AssertionError, match=f"#error.*{said}"):
        Header(path, *flags)
    Header(path, "-O3", "-ffp-contract=fast", "-fno-finite-math-only")


@needs_compiler
def test_literals_that_are_short_are_refused(tmp_path):
    """Tables rounded to float32 let plans pass that touch, by micrometres."""
    path = pj.exchange.write_c(toy_query.answer(), tmp_path / "toy.h")
    with pytest.raises(AssertionError, match=r"toy_literals_are_double.*is negative"):
        Header(path, "-fsingle-precision-constant")


@needs_compiler
def test_two_headers_of_one_name_do_not_compile_together(tmp_path):
    """One of them would stand for both scenes; twice the same one is one."""
    path = pj.exchange.write_c(toy_query.answer(), tmp_path / "toy.h")
    (tmp_path / "here").mkdir()
    text = path.read_text()
    mark = re.search(r"#define TOY_H (0x[0-9a-f]{8})\n", text)[1]
    (tmp_path / "here" / "toy.h").write_text(text.replace(mark, "0x12345678"))
    Header(path, "-include", path)
    with pytest.raises(AssertionError, match="#error two headers are named toy"):
        Header(path, "-include", tmp_path / "here" / "toy.h")


@contextmanager
def rounding(mode: int):
    """The processor rounds in another way, as <fenv.h> numbers them on this kind of it."""
    maths = ctypes.CDLL(ctypes.util.find_library("m"))
    before = maths.fegetround()
    try:
        yield maths.fesetround(mode) == 0 and maths.fegetround() == mode
    finally:
        maths.fesetround(before)


@needs_compiler
@pytest.mark.skipif(platform.machine() != "x86_64", reason="numbers of rounding modes are x86's")
def test_under_another_rounding_mode_nothing_is_safe(tmp_path):
    answer = toy_query.answer()
    header = Header(pj.exchange.write_c(answer, tmp_path / "toy.h"))
    p0, k = (np.ascontiguousarray(x) for x in np.split(answer.samples, [2], axis=1))
    for mode, safe in ((0x400, False), (0x800, False), (0xC00, False), (0, True)):
        with rounding(mode) as so:
            said = header.are_safe(p0, k)
        assert so and (said == safe).all()


@needs_compiler
@pytest.mark.skipif(platform.machine() != "x86_64", reason="-ffast-math sets them so on x86")
def test_where_subnormal_numbers_are_zero_nothing_is_safe(tmp_path):
    """In a program that is linked so, a k that is outside by one was inside."""
    answer = toy_query.answer()
    path = pj.exchange.write_c(answer, tmp_path / "toy.h")
    plan = ", ".join(x.hex() for x in answer.samples[0].tolist())
    source = f"""#include "toy.h"
    int main(void) {{ const double x[] = {{{plan}}}; return toy_is_safe(x, x + toy_N_P); }}"""
    path.with_suffix(".c").write_text(source)
    built, run = str(path.with_suffix(".o")), str(tmp_path / "asked")
    for flags, said in (([], 1), (["-ffast-math"], 0)):
        subprocess.run([COMPILER, "-O2", "-c", path.with_suffix(".c"), "-o", built], check=True)
        subprocess.run([COMPILER, *flags, built, "-o", run], check=True)
        assert subprocess.run([run]).returncode == said


@needs_compiler
def test_borders_of_bins_and_starts_outside_are_not_safe(tmp_path):
    rng = np.random.default_rng(1)
    model = points_model(rng, m=1, bins=(2, 1))
    goal = pj.box([-3.0, -3.0, -9.0], [3.0, 3.0, 9.0])
    start = pj.box([-2.5, -2.5], [-1.5, -1.5])
    problem = pj.reach_avoid(goal, [], 0.1, start)
    answer = pj.Planner(model).solve(problem, jax.random.PRNGKey(0))
    header = Header(pj.exchange.write_c(answer, tmp_path / "bins.h"))
    k = np.array([[0.0, 0.1], [-0.001, 0.1], [0.001, 0.1], [1.0, 0.1], [-1.0, 1.0]])
    p0 = np.full((5, 2), -2.0)
    assert header.are_safe(p0, k).tolist() == [False, True, True, True, True]
    p0[1:3, 0] = [-1.4, np.nextafter(-2.5, -3)]  # outside of where it may start
    assert header.are_safe(p0, k).tolist() == [False, False, False, True, True]


@needs_compiler
@pytest.mark.slow
def test_a_start_so_far_out_that_sums_overflow_is_not_safe(tmp_path):
    """Each row of this goal is met in floats by starts of 1e307 m that one of them excludes: -10 x
    overflows, and what follows it is too small to bring the sum back.
    """
    net = relu_network([np.eye(1), np.zeros((6, 1))], [np.ones(1), np.linspace(0.1, 0.2, 6)])
    still = model_of(net, pj.box([0.0], [1.0]), np.full((1, 2, 3), 0.01), np.full((1, 3), 0.01))
    rows = np.array([[-10.0, 11, 11], [1, -2, 0], [1, 0, -2], [0, -1, -1]])
    problem = pj.reach_avoid(hpolytope(rows, np.full(4, 20.0)), [], 0.1)
    settings = pj.Settings(samples=5, target=0.1)
    answer = pj.Planner(still).solve(problem, jax.random.PRNGKey(0), settings)
    header = Header(pj.exchange.write_c(answer, tmp_path / "far.h"))
    k = np.full((2, 1), 0.5)
    p0 = np.array([answer.samples[0, :3], [1.8e307, 1.6e307, 1.6e307]])
    assert rows[0] @ (p0[1] / 1e307) > 0
    assert header.are_safe(p0, k).tolist() == [True, False]
    assert answer.contains(p0, k).tolist() == [True, False]


@needs_compiler
def test_the_nearest_plan_is_safe_and_near(tmp_path):
    answer = toy_query.answer()
    header = Header(pj.exchange.write_c(answer, tmp_path / "toy.h"))
    p0, safe = answer.samples[0, :2], answer.samples[0, 2:]
    np.testing.assert_array_equal(header.nearest(p0, safe), safe)  # it is safe already
    offered = header.nearest(p0, np.array([-1.0, 1.0]))
    assert answer.contains(p0[None], offered[None]).all()
    further = np.linalg.norm(answer.samples[:, 2:] - [-1.0, 1.0], axis=1)
    starts = np.repeat(p0[None], len(further), axis=0)
    reachable = answer.contains(starts, answer.samples[:, 2:])
    assert np.linalg.norm(offered - [-1.0, 1.0]) <= further[reachable].min()
    assert header.nearest(np.array([9.0, 9.0]), safe) is None


COPIED = [
    pytest.param(more, marks=pytest.mark.slow) for more in ({"k": [0.01, 0.0]}, {"heading": 0.01})
]


@needs_compiler
@pytest.mark.parametrize("more", [{}, *COPIED], ids=str)
def test_the_nearest_plan_leaves_what_is_measured_as_it_is(more, tmp_path):
    """A robot's speed is none that it may choose, also where the question copies the model."""
    line = told(line_model(e=0.02), given=(1,), rotation=("turns",))
    goal, block = pj.box([0.4, -0.3, -9.0], [0.9, 0.3, 9.0]), pj.box([0.3, 0.35], [0.6, 0.6])
    any_speed = pj.Uncertainty(given={name_of(line.labels.k[1]): "free"}, **more)
    start = pj.box([-0.1, -0.1], [0.1, 0.1])
    problem = pj.reach_avoid(goal, [block], 0.05, start=start, uncertainty=any_speed)
    answer = pj.Planner(line).solve(problem, jax.random.key(0), pj.Settings(proof=False))
    path = pj.exchange.write_c(answer, tmp_path / "line.h")
    assert f"Measured at the start, and not to be chosen: {name_of(line.labels.k[1])}." in " ".join(
        path.read_text().split("*/")[0].replace(" * ", "").split("\n")
    )
    header, p0, offered = Header(path), np.zeros(2), []
    for measured in np.linspace(line.domain.lo[1], line.domain.hi[1], 21):
        offered.append(header.nearest(p0, np.array([line.domain.lo[0], measured])))
        if offered[-1] is not None:
            assert offered[-1][1] == measured and answer.contains(p0[None], offered[-1][None])[0]
    known = [one is not None for one in offered]
    assert any(known) and not all(known)


def test_the_shell_writes_one(tmp_path, capsys):
    file = toy_query.answer().save(tmp_path / "answer.json")
    with pytest.raises(SystemExit) as done:
        main(["export", str(file), "--c", str(tmp_path / "safe_set.h")])
    assert done.value.code == 0 and "safe_set.h" in capsys.readouterr().out
    text = (tmp_path / "safe_set.h").read_text()
    assert "safe_set_is_safe" in text and "(C)" in text and "-ffast-math" in text


def test_a_model_with_a_part_from_elsewhere_gets_no_header(tmp_path, monkeypatch):
    """Even where its answer was taken apart."""
    answer = toy_query.answer()
    net = answer.model.net
    other = answer.model.replace(net=net.replace(biases=tuple(b + 1 for b in net.biases)))
    monkeypatch.setattr(type(answer), "model", other)
    with pytest.raises(InputError, match="network its claim was measured on"):
        pj.exchange.write_c(answer, tmp_path / "toy.h")
    assert not (tmp_path / "toy.h").exists()
