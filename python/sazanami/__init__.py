"""sazanami: grains of sand under moving water.

>>> import sazanami
>>> case = sazanami.Case.template("raindrop")
>>> case.run.until = "5 ms"
>>> case.run.until
0.005
"""

from typing import List as _List

from . import _engine
from ._keys import Keys
from ._case import Case, Check, Limit, explain, quantity, templates
from ._errors import (
    CaseError,
    Finding,
    InputError,
    InternalError,
    RunFailed,
    RunInterrupted,
    SazanamiError,
    UndoneError,
    UnknownKeyError,
)

from ._functions import Bed, Mesh, analyse, evaluate, pack, read_bed, read_mesh, volume_fractions
from ._results import Results, States
from ._run import Run, StepInfo, resume
from ._state import Arrays, Grid, Particles, State
from ._tables import Table

__version__ = _engine.__version__

__all__ = [
    "Arrays",
    "Bed",
    "Grid",
    "Mesh",
    "Particles",
    "Results",
    "Run",
    "State",
    "States",
    "StepInfo",
    "Table",
    "analyse",
    "evaluate",
    "pack",
    "read_bed",
    "read_mesh",
    "resume",
    "volume_fractions",
    "Case",
    "CaseError",
    "Check",
    "Finding",
    "InputError",
    "InternalError",
    "Keys",
    "Limit",
    "RunFailed",
    "RunInterrupted",
    "SazanamiError",
    "UndoneError",
    "UnknownKeyError",
    "__version__",
    "explain",
    "quantity",
    "templates",
]

# What people use is called by the name of the package, in messages, help and pickles, and nothing else is listed.
for _name in __all__:
    if getattr(globals()[_name], "__module__", "").startswith(__name__ + "."):
        globals()[_name].__module__ = __name__
del _name


def __dir__() -> _List[str]:
    return sorted(__all__)
