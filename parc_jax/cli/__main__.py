"""python -m parc_jax.cli: the console script without its installation."""

from parc_jax.cli import main

main()
