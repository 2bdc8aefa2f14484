"""sazanami: grains of sand under moving water.

>>> import sazanami
>>> case = sazanami.Case.template("raindrop")
>>> case.run.until = "5 ms"
>>> case.run.until
0.005
"""

from . import _engine
from ._keys import Keys
from .case import Case, Check, Limit, explain, quantity, templates
from .errors import (
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

from .functions import Bed, Mesh, analyse, evaluate, pack, read_bed, read_mesh, volume_fractions
from .results import Results, States
from .run import Run, StepInfo, resume
from .state import Arrays, Grid, Particles, State
from .tables import Table

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
