"""Pictures for papers, films, and one interactive page. Colour-blind safe; every file is complete
or absent, every figure PNG and PDF.

`from parc_jax import figures` offers them all. Each figure's function
draws on `to`: None (a new figure is returned), a path (it is also saved there, .png and .pdf), or
matplotlib Axes.

samples  safe plans in the workspace, with their true runs
regions  the regions of K, those with safe plans apart; `safe_regions` tells which they are

`film.film` films a plan or an episode, `page.write_page` writes its page, `style.save` a figure.
"""
