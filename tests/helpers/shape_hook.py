"""What looks at annotated shapes while testing: at functions. The records of kernels are also made
by transformations, with what stands for arrays.
"""

from beartype import beartype


def functions(call):
    """`beartype` for functions, nothing for constructors."""
    return call if call.__name__ == "__init__" else beartype(call)
