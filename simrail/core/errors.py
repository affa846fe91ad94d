"""The one error that a person's input can cause.

Everything that a person hands in (a scenario, a part file, a recording) is refused with an
`InputError`: one message that names the file, the field, the value, the limit and the remedy.
The command line prints it and ends with exit code 2. Faults of the program itself are ordinary
exceptions and are not wrapped.
"""

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

MOST_TOLD = 6
"""Faults of one input that are told at once."""

MOST_SHOWN, MOST_SAID = 200, 1000
"""Characters of what was found that are shown, and of what would be accepted or is to be done."""


class InputError(ValueError):
    """Input that cannot be used, said so that its author can mend it.

    Parameters
    ----------
    problem : str
        What is wrong, in one clause, without the value.
    file, field : str, optional
        Where it stands: file name and dotted field, e.g. ``ride[0].speed_kmh``.
    value : object, optional
        What was found.
    limit : str, optional
        What would be accepted, e.g. ``"> 0 kg"``.
    remedy : str, optional
        What to do about it.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: object = None,
        field: str | None = None,
        value: object = None,
        limit: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.problem, self.file, self.field = problem, file, field
        self.value, self.limit, self.remedy = value, limit, remedy
        self.also: tuple[InputError, ...] = ()
        super().__init__(problem)

    @property
    def each(self) -> tuple["InputError", ...]:
        """The fault itself, and those that were found beside it."""
        return self, *self.also

    def __str__(self) -> str:
        lines = [one.line for one in self.each]
        # A file of another kind has nothing but faults: the first of them tell that.
        more = len(lines) - MOST_TOLD
        return "\n".join(lines if more <= 1 else [*lines[:MOST_TOLD], f"and {more} more faults"])

    @property
    def line(self) -> str:
        """The fault in one line, without those beside it: what it names is cut, what does not print shown."""
        value = None if self.value is None else one_line(repr(self.value), MOST_SHOWN)
        more = (("found", value), ("limit:", self.limit), ("remedy:", self.remedy or self._usual_remedy))
        places = (one_line(str(place), MOST_SHOWN) for place in (self.file, self.field) if place is not None)
        text = "".join(f"{place}: " for place in places) + one_line(self.problem, 2 * MOST_SHOWN)
        said = ((word, one_line(words, MOST_SAID)) for word, words in more if words is not None)
        return text + "".join(f"; {word} {words}" for word, words in said)

    @property
    def _usual_remedy(self) -> str | None:
        """What to do where nothing else is said than the limit."""
        if self.limit is None:
            return None
        return "choose one of them" if self.limit.startswith("one of ") else "keep to the limit"


def one_line(text: str, most: int) -> str:
    """A text in one line of at most so many characters; what does not print is shown by its code."""
    if len(text) > most:
        text = f"{text[: most - 30]} ... ({len(text)} characters)"
    return "".join(letter if letter.isprintable() else _code(letter) for letter in text)


def joined(words: object) -> str:
    """What is told, as one line: any white space between its words is one blank."""
    return " ".join(str(words).split())


def _code(letter: str) -> str:
    """A character that does not print, as Python writes it; spaces of other kinds are spaces."""
    return " " if letter in "\xa0\u202f\u2009" else repr(letter)[1:-1]


class Faults:
    """Gathers faults of one input, so that its author is told of all of them at once."""

    def __init__(self) -> None:
        self.found: list[InputError] = []

    @contextmanager
    def gathered(self) -> Iterator[None]:
        """Note an `InputError` of a block, and go on behind it."""
        try:
            yield
        except InputError as error:
            self.found += error.each

    def refuse(self) -> None:
        """Raise what was gathered, if it was anything, as one error of a line for each."""
        if self.found:
            first, *others = self.found
            first.also = tuple(others)
            raise first


def one_of(
    word: object,
    words: Iterable[str],
    problem: str,
    *,
    field: str | None = None,
    file: object = None,
    remedy: str | None = None,
) -> None:
    """Refuse a word that is none of the possible ones, which the message lists."""
    possible = tuple(words)
    if word not in possible:
        limit = "one of " + ", ".join(possible)
        remedy = did_you_mean(word, possible) or remedy
        raise InputError(problem, file=file, field=field, value=word, limit=limit, remedy=remedy)


def did_you_mean(word: object, words: Iterable[str], *, cutoff: float = 0.6) -> str | None:
    """A guess at what a misspelt word was to be, as a remedy; None if no word is near enough."""
    near = difflib.get_close_matches(str(word), words, n=1, cutoff=cutoff)
    return f"did you mean {near[0]}?" if near else None


def refuse_unless(good: bool, field: str, value: object, limit: str) -> None:
    """Refuse a value of a specification that cannot be.

    Raises
    ------
    InputError
        Naming field, value and limit.
    """
    if not good:
        raise InputError("is impossible", field=field, value=value, limit=limit, remedy="keep to the limit")
