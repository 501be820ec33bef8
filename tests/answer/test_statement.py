"""An answer in words, for terminals and notebooks."""

from dataclasses import replace

import numpy as np
from toy_models import told, toy_case
from toy_query import answer

from parc_jax.answer.findings import Findings
from parc_jax.answer.statement import as_html, one_line, statement
from parc_jax.common.status import Ended
from parc_jax.learning.bound.claim import weaker
from parc_jax.learning.bound.tube import tube
from parc_jax.problem.robust.nominal import query
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.safe_set.verdict.scene import lowered
from parc_jax.statement import nothing_found


def found(**changes):
    """The findings behind the toy's answer, some of them changed."""
    whole = answer()
    fields = {
        "scene": whole.scene.under(told(whole.model, system="<b>toy</b> & co")),
        "cover": whole.cover,
        "samples": whole.samples,
        "spelled": whole.sample_parts,
        "proved": True,
        "refused": 0,
        "timings": {},
        "no_plan": None,
    }
    return Findings(**(fields | changes))


def nothing():
    """Findings without a plan, without a proof that none exists."""
    empty = answer().cover._replace(corridors=[], polytopes=[], ended=Ended.WORK)
    return found(cover=empty, samples=answer().samples[:0])


def test_names_of_others_are_text_in_a_notebook():
    page = as_html(found())
    assert "&lt;b&gt;toy&lt;/b&gt; &amp; co: exact-proved, 5 plans" in page and "<b>toy" not in page
    assert page.count("<li>") == len(statement(found()).split("\n"))


def test_what_is_proved_comes_first_then_the_tube_then_the_risk():
    lines = statement(found()).split("\n")
    assert [line.split(" ")[0] for line in lines] == ["(C)", "(E)", "Risk:", "Search:"]
    assert "proved in exact arithmetic" in lines[0]
    assert "proved in exact" not in statement(found(proved=False)).split("\n")[0]


def test_where_nothing_was_found_nothing_is_promised():
    assert statement(nothing()).split("\n") == [nothing_found(None), Ended.WORK.sentence]
    assert one_line(nothing()) == "Answer for <b>toy</b> & co: not-found"


def test_a_value_on_the_edge_of_a_bin_without_claim_is_told():
    """In both bins, so in one without a claim: no plan, and a word why."""
    model, problem = toy_case(0)
    half, final = (np.array([x[0], np.full_like(x[1], np.inf)]) for x in _widths_of(model))
    claim = weaker(model.claim, tube(model.tube.edges, half, final))
    for value, known_why in ((0.0, True), (np.nextafter(0, -1), False)):
        asked = problem.replace(uncertainty=Uncertainty(given={"k1": value}))
        known = query(asked, model.replace(claim=claim)).nominal()
        empty = nothing()
        empty = replace(empty, scene=lowered(known))
        said = statement(empty)
        assert (
            "that have a claim; a value on an edge is in the bins on both sides" in said
        ) == known_why
        assert f"safe for k1 = {value if value else 0}" in said


def _widths_of(model):
    return model.tube.interval, model.tube.final
