"""The polytope of a set of a file, in the rows that the checker tests one by one."""

from parc_jax.checker.exact import rejecting
from parc_jax.checker.plans import row_of


@rejecting()
def set_rows(context, polytope) -> list:
    """Rows (name, strict, a, c) in integers, a . (p0, k) + c >= 0, or > 0 if strict. [T29]"""
    rows, columns, scale = context.cell(polytope)
    columns, scale = context.outputs(columns, scale)
    asked = context.listed_conditions(polytope["sep"], [polytope["bin"]])
    return rows + [row_of(one, columns, scale) for one in asked]
