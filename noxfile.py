"""The checks in environments of their own: ``nox`` runs the tests on all three Pythons, and the static ones.

nox                     # tests on 3.11, 3.12 and 3.13, then lint, format, types and imports
nox -s tests-3.12       # one of them; what stands after -- goes to pytest
nox -s coverage         # branch coverage of the tests, printed
"""

import nox

nox.options.sessions = ["tests", "static"]
nox.options.reuse_existing_virtualenvs = True


@nox.session(python=["3.11", "3.12", "3.13"])
def tests(session: nox.Session) -> None:
    """The plain tests, as README has them."""
    session.install("-e", ".[test]")
    session.run("pytest", *session.posargs)


@nox.session
def static(session: nox.Session) -> None:
    """Lint, format, types and the direction of imports."""
    session.install("-e", ".[test]")
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("python", ".ci/static.py", *session.posargs)


@nox.session
def coverage(session: nox.Session) -> None:
    """Branch coverage of the plain tests, printed and never a gate.

    Lines of compiled kernels are run by numba and not seen.
    """
    session.install("-e", ".[test]")
    session.run("pytest", "--cov", *session.posargs)
