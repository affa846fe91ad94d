"""The one error that a person's input can cause.

Everything that a person hands in (a scenario, a part file, a recording) is refused with an
`InputError`: one message that names the file, the field, the value, the limit and the remedy.
The command line prints it and ends with exit code 2. Faults of the program itself are ordinary
exceptions and are not wrapped.
"""


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
        super().__init__(problem)

    def __str__(self) -> str:
        parts = []
        if self.file is not None:
            parts.append(f"{self.file}: ")
        if self.field is not None:
            parts.append(f"{self.field}: ")
        parts.append(self.problem)
        if self.value is not None:
            parts.append(f"; found {self.value!r}")
        if self.limit is not None:
            parts.append(f"; limit: {self.limit}")
        if self.remedy is not None:
            parts.append(f"; remedy: {self.remedy}")
        return "".join(parts)


def refuse_unless(good: bool, field: str, value: object, limit: str) -> None:
    """Refuse a value of a specification that cannot be.

    Raises
    ------
    InputError
        Naming field, value and limit.
    """
    if not good:
        raise InputError("is impossible", field=field, value=value, limit=limit)
