"""How the nouns show themselves: a few lines in a terminal, a small table in a notebook."""

from html import escape

from simrail.core.errors import joined

Facts = tuple[str, dict[str, str]]
"""What an object is called, and at most `MOST_FACTS` things about it, each with its words."""

MOST_FACTS = 5
"""With the name these are six lines: what one reads at a glance."""

WIDEST = 100
"""Characters of a fact; what is longer is cut."""


class Shown:
    """An object that says what it is, not all that it holds.

    A dataclass that inherits from it is made with ``repr=False``, and says its facts in `_facts`.
    """

    def _facts(self) -> Facts:
        raise NotImplementedError

    def __repr__(self) -> str:
        name, facts = self._cut()
        width = max((len(word) for word in facts), default=0)
        lines = [f"{type(self).__name__} {name}".rstrip()]
        return "\n".join([*lines, *(f"  {word:<{width}}  {text}" for word, text in facts.items())])

    def _repr_html_(self) -> str:
        name, facts = self._cut()
        head = f"<b>{type(self).__name__}</b> {escape(name)}"
        rows = "".join(
            f'<tr><th style="text-align:left">{escape(word)}</th>'
            f'<td style="text-align:left">{escape(text)}</td></tr>'
            for word, text in facts.items()
        )
        return f"<div>{head}<table>{rows}</table></div>"

    def _cut(self) -> Facts:
        name, facts = self._facts()
        few = list(facts.items())[:MOST_FACTS]
        return _shortened(name), {word: _shortened(text) for word, text in few}


def names(values: object, *, most: int = 6) -> str:
    """Names after one another, the rest as a number."""
    words = [str(value) for value in values] if hasattr(values, "__iter__") else [str(values)]
    rest = f" and {len(words) - most} more" if len(words) > most else ""
    return ", ".join(words[:most]) + rest if words else "none"


def _shortened(text: str) -> str:
    flat = joined(text)
    return flat if len(flat) <= WIDEST else flat[: WIDEST - 4].rstrip() + " ..."
