"""The state at the end of a query."""

from enum import Enum


class Told(Enum):
    """A word of ours, its label, with a text that says it to people."""

    def __init__(self, label: str, text: str):
        self.label = label
        self.text = text

    def __str__(self) -> str:
        return self.label


class Status(Told):
    """The end of a query. The text says it to people, with advice."""

    PROVED = (
        "exact-proved",
        "safe plans in hand, those with certificates accepted by the independent checker in exact "
        "arithmetic",
    )
    BOUNDED = (
        "float-bounded",
        "safe plans in hand, shown in float64 with a margin for every rounding; "
        "for the last word ask with proof=True",
    )
    NO_PLAN = "no-plan", "proved: the model with its tube has no safe plan"
    NOT_FOUND = (
        "not-found",
        "no safe plan was found with this work, which proves nothing; "
        "try more work, a wider gap or a narrower tube",
    )

    @property
    def found(self) -> bool:
        """Safe plans are in hand."""
        return self in (Status.PROVED, Status.BOUNDED)


class Ended(Told):
    """The reason for the end of a search. The text says it to people, with advice."""

    TARGET = "target", "which is reached"
    WORK = "work", "done before what was asked is reached; more (work, --work) may reach it"
    SECONDS = (
        "seconds",
        "a limit that cut work off, so a less busy machine may give another answer; "
        "try a larger budget_s (--budget)",
    )

    @property
    def sentence(self) -> str:
        """For people."""
        return f"Search: ended by its {self}, {self.text}."
