"""python -m parc_jax.app.cli: the console script without its installation."""

from parc_jax.app.cli import main

main()
