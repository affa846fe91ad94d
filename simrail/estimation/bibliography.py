"""Where methods come from: one entry for each publication, in words and as BibTeX.

An estimator names its sources in ``cites``, by the keys here; what is no key stands as it is, without BibTeX.
Only what is known is told: a field that nobody could look up is left out, and `note` says what an entry rests
on where it is not the publication itself.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Source:
    """A publication.

    Attributes
    ----------
    key : str
        What `cites` and BibTeX call it.
    words : str
        As a sentence names it.
    kind : str
        Of the BibTeX entry: article, inproceedings, techreport, misc.
    fields : mapping of str to str
        Of the BibTeX entry, in its order.
    note : str
        What is not certain of it; empty if it was seen.
    """

    key: str
    words: str
    kind: str
    fields: Mapping[str, str] = field(default_factory=dict)
    note: str = ""

    @property
    def bibtex(self) -> str:
        """The entry, with what is not certain above it as a comment."""
        lines = [f"% {self.note}"] if self.note else []
        lines.append(f"@{self.kind}{{{self.key},")
        lines += [f"  {name} = {{{value}}}," for name, value in self.fields.items()]
        return "\n".join([*lines, "}"])


_FROM_MEMORY = "from memory, not seen for this table: compare with the publication before you print it"

_SOURCES = (
    Source(
        "briales_2021",
        "Briales, Urda and Escalona 2021",
        "article",
        {
            "author": "Briales, Eduardo and Urda, Pedro and Escalona, Jos{\\'e} L.",
            "title": "Track frame approach for heading and attitude estimation in operating railways using "
            "on-board {MEMS} sensor and encoder",
            "journal": "Measurement",
            "volume": "184",
            "pages": "109898",
            "year": "2021",
            "doi": "10.1016/j.measurement.2021.109898",
        },
    ),
    Source(
        "gonzalez_2023",
        "Gonzalez-Carbajal, Urda, Munoz and Escalona 2023",
        "article",
        {
            "author": "Gonz{\\'a}lez-Carbajal, J. and Urda, Pedro and Mu{\\~n}oz, Sergio and "
            "Escalona, Jos{\\'e} L.",
            "title": "Estimation of the trajectory and attitude of railway vehicles using inertial sensors "
            "with application to track geometry measurement",
            "journal": "Vehicle System Dynamics",
            "year": "2023",
            "doi": "10.1080/00423114.2023.2203865",
        },
    ),
    Source(
        "veillard_2016",
        "Veillard, Mailly and Fraisse 2016",
        "inproceedings",
        {
            "author": "Veillard, Damien and Mailly, Fr{\\'e}d{\\'e}rick and Fraisse, Philippe",
            "title": "{EKF}-based state estimation for train localization",
            "booktitle": "IEEE SENSORS",
            "address": "Orlando",
            "year": "2016",
            "doi": "10.1109/ICSENS.2016.7808726",
        },
    ),
    Source(
        "hidalgo",
        "Hidalgo, Ros, Escalona and Garcia-Vallejo",
        "misc",
        {
            "author": "Hidalgo, Andr{\\'e}s F. and Ros, Javier and Escalona, Jos{\\'e} Luis and "
            "Garc{\\'i}a-Vallejo, Daniel",
            "title": "A {Kalman} filter-based algorithm for {IMU} signals fusion applied to track geometry "
            "estimation",
        },
        "an abstract whose year and venue are not printed in it",
    ),
    Source(
        "escalona_2021",
        "Escalona, Urda and Munoz 2021",
        "article",
        {
            "author": "Escalona, Jos{\\'e} L. and Urda, Pedro and Mu{\\~n}oz, Sergio",
            "title": "A Track Geometry Measuring System Based on Multibody Kinematics, Inertial Sensors and "
            "Computer Vision",
            "journal": "Sensors",
            "volume": "21",
            "number": "3",
            "pages": "683",
            "year": "2021",
            "doi": "10.3390/s21030683",
        },
    ),
    Source(
        "laidig_2023",
        "Laidig and Seel 2023",
        "article",
        {
            "author": "Laidig, Daniel and Seel, Thomas",
            "title": "{VQF}: Highly Accurate {IMU} Orientation Estimation with Bias Estimation and Magnetic "
            "Disturbance Rejection",
            "journal": "Information Fusion",
            "volume": "91",
            "pages": "187--204",
            "year": "2023",
            "doi": "10.1016/j.inffus.2022.10.014",
        },
    ),
    Source(
        "madgwick_2010",
        "Madgwick 2010",
        "techreport",
        {
            "author": "Madgwick, Sebastian O. H.",
            "title": "An efficient orientation filter for inertial and inertial/magnetic sensor arrays",
            "year": "2010",
        },
        _FROM_MEMORY,
    ),
    Source(
        "madgwick_2020",
        "Madgwick, Wilson, Turk, Burridge, Kapatos and Vaidyanathan 2020",
        "article",
        {
            "author": "Madgwick, Sebastian O. H. and Wilson, Samuel and Turk, Ruth and Burridge, Jane and "
            "Kapatos, Christos and Vaidyanathan, Ravi",
            "title": "An Extended Complementary Filter for Full-Body {MARG} Orientation Estimation",
            "journal": "IEEE/ASME Transactions on Mechatronics",
            "year": "2020",
        },
        _FROM_MEMORY,
    ),
    Source(
        "hartikainen_2010",
        "Hartikainen and Sarkka 2010",
        "inproceedings",
        {
            "author": 'Hartikainen, Jouni and S{\\"a}rkk{\\"a}, Simo',
            "title": "{Kalman} filtering and smoothing solutions to temporal {Gaussian} process regression "
            "models",
            "booktitle": "IEEE International Workshop on Machine Learning for Signal Processing",
            "year": "2010",
        },
        _FROM_MEMORY,
    ),
    Source(
        "skog_2010",
        "Skog, Handel, Nilsson and Rantakokko 2010",
        "article",
        {
            "author": 'Skog, Isaac and H{\\"a}ndel, Peter and Nilsson, John-Olof and Rantakokko, Jouni',
            "title": "Zero-Velocity Detection---An Algorithm Evaluation",
            "journal": "IEEE Transactions on Biomedical Engineering",
            "volume": "57",
            "number": "11",
            "pages": "2657--2666",
            "year": "2010",
        },
        _FROM_MEMORY,
    ),
)

SOURCES: dict[str, Source] = {source.key: source for source in _SOURCES}
"""Every publication by its key."""

OWN = "simrail itself: no publication stands behind this method"
"""What is said of a method that cites nothing."""


@dataclass(frozen=True)
class Citation:
    """What one method rests on, or several that rest on the same.

    Attributes
    ----------
    method : str
        Its name, or theirs with commas between.
    words : str
        The sources in a line.
    bibtex : str
        Their entries; empty where there are none.
    """

    method: str
    words: str
    bibtex: str


def citations(methods: Iterable[tuple[str, tuple[str, ...]]]) -> list[Citation]:
    """What methods rest on; those of the same sources stand together, at the place of the first.

    Parameters
    ----------
    methods : iterable of (str, tuple of str)
        Name of each method, and its `cites`.
    """
    together: dict[tuple[str, ...], list[str]] = {}
    for name, cites in methods:
        together.setdefault(tuple(cites), []).append(name)
    found = []
    for cites, names in together.items():
        known = [SOURCES[key] for key in cites if key in SOURCES]
        words = "; ".join(SOURCES[key].words if key in SOURCES else key for key in cites)
        bibtex = "\n\n".join(source.bibtex for source in known)
        found.append(Citation(", ".join(names), words or OWN, bibtex))
    return found


def entries(citations_of: Iterable[tuple[str, ...]]) -> str:
    """BibTeX of all publications that are cited, each once, in the order of the table."""
    cited = {key for cites in citations_of for key in cites}
    return "\n\n".join(source.bibtex for key, source in SOURCES.items() if key in cited)
