"""Frozen dataclasses that JAX passes through `jit` and `vmap`, as those of `flax.struct`, without
the time that loading flax takes, which only training needs.
"""

import dataclasses
from typing import dataclass_transform

import jax

from parc_jax.common.arrays import restored

STATIC = "pytree_node"  # metadata of a field: False for what is no array


def field(*, pytree_node: bool = True, **options):
    """A field; pytree_node=False: a program is compiled for each value of it."""
    return dataclasses.field(metadata={STATIC: pytree_node}, **options)


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def dataclass(kind):
    """The class as a frozen dataclass, a pytree, with `replace(**changes)` unless it has one."""
    kind = dataclasses.dataclass(frozen=True)(kind)
    arrays, static = [], []
    for each in dataclasses.fields(kind):
        (arrays if each.metadata.get(STATIC, True) else static).append(each.name)
    jax.tree_util.register_dataclass(kind, arrays, static)
    if "replace" not in vars(kind):
        kind.replace = dataclasses.replace
    kind.__setstate__ = restored
    return kind
