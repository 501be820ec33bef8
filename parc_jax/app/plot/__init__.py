"""Pictures for papers, films, and one interactive page. Colour-blind safe; every file is complete
or absent, every figure PNG and PDF.

`from parc_jax import figures` offers them all. Each figure's function has the name of its file and
draws on `to`: None (a new figure is returned), a path (it is also saved there, .png and .pdf), or
matplotlib Axes.

samples      safe plans in the workspace, with their true runs
spread       many runs of each plan, and their errors inside the tube
timeline     clearance and separating directions of some plans over time
projections  the safe polytopes from several sides
regions      the regions of K by verdict and by time; `verdicts` says what is known of each
claim        one tube, the scores behind it, and the worst runs
errors       the tubes of several models over time
gap          safe share over the width of the gap
cover        what is left uncovered, by number of polytopes and by time

`film.film` films a plan from above, `html.write_page` writes the page, `style.save` a figure.
"""
