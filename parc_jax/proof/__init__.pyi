"""What the room offers: the one list, for type checkers and for `__init__.py`."""

from parc_jax.proof.regions import enumerate_regions as enumerate_regions
