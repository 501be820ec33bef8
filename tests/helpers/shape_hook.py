"""What looks at annotated shapes while testing: at functions. The records of kernels are also made
by transformations, with what stands for arrays.
"""

import numpy as np
from beartype import BeartypeConf, FrozenDict, beartype

# whole numbers serve for floats, and NumPy's for Python's
NUMBERS = {
    bool: bool | np.bool_,
    int: int | np.integer,
    float: float | np.floating | int | np.integer,
}
checked = beartype(conf=BeartypeConf(hint_overrides=FrozenDict(NUMBERS)))


def functions(call):
    """`beartype` for functions, nothing for constructors."""
    return call if call.__name__ == "__init__" else checked(call)
