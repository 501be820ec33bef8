"""An answer in words, for terminals and notebooks."""

from toy_query import answer

from parc_jax.answer.findings import Findings
from parc_jax.answer.statement import as_html, one_line, statement
from parc_jax.sentences import NOTHING_FOUND


def found(**changes):
    """The findings behind the toy's answer, some of them changed."""
    whole = answer()
    fields = {
        "model": whole.model.replace(system="<b>toy</b> & co"),
        "scene": whole.scene,
        "cover": whole._cover,
        "samples": whole.samples,
        "sample_parts": whole.sample_parts,
        "proved": True,
        "refused": 0,
        "timings": {},
        "no_plan": None,
    }
    return Findings(**(fields | changes))


def nothing():
    """Findings without a plan, without a proof that none exists."""
    empty = answer()._cover._replace(corridors=[], polytopes=[])
    return found(cover=empty, samples=answer().samples[:0])


def test_names_of_others_are_text_in_a_notebook():
    page = as_html(found())
    assert "&lt;b&gt;toy&lt;/b&gt; &amp; co: exact-proved, 5 plans" in page and "<b>toy" not in page
    assert page.count("<li>") == len(statement(found()).split("\n"))


def test_what_is_proved_comes_first_then_the_tube_then_the_risk():
    lines = statement(found()).split("\n")
    assert [line.split(" ")[0] for line in lines] == ["(C)", "(E)", "Risk:"]
    assert "proved in exact arithmetic" in lines[0]
    assert "proved in exact" not in statement(found(proved=False)).split("\n")[0]


def test_where_nothing_was_found_nothing_is_promised():
    assert statement(nothing()) == NOTHING_FOUND
    assert one_line(nothing()) == "Answer for <b>toy</b> & co: not-found"
