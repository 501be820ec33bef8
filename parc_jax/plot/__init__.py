"""Pictures for papers, and one interactive page. Colour-blind safe; every file as PNG and PDF, complete or absent.

`to` is None (a new figure is returned), a path (it is also saved there, .png and .pdf) or matplotlib Axes to draw on.

samples.samples(answer, replay=None, to=None, *, most=100, heading=None, outline=None)       safe plans in the workspace
regions.regions(table, verdict, seconds=None, to=None, *, names=None, axes=(0, 1), at=None, time_label=..., safe_k=None)
verdicts.region_verdicts(answer, table)                               (r,) safe, none found, goal proved out of reach
verdicts.region_seconds(answer, table)                                (r,) [s] to the first safe polytope, NaN for none
errors.errors([errors.Entry(name, assumed, claimed), ...], time, to=None)             tubes of several models over time
claim.claim(claimed, scores, time, to=None, *, names=None, axes=(0, 1))               its tube, scores, worst runs
gap.gap([gap.GapCurve(name, gaps, share, low, high), ...], to=None, *, published=None)         safe share over gap width
projections.projections(answer, pairs=None, to=None, *, names=None)                    safe polytopes from several sides
timeline.timeline(answer, chosen=(0,), replay=None, to=None, *, names=None)       clearance and directions of some plans
cover.cover([cover.CoverCurve(name, share, pieces, seconds), ...], to=None, *, target=0.01)      uncovered share
html.write_page(answer_json_path, html_path)                            the interactive page, one file without network
style.save(figure, path)                                                                   .png and .pdf, atomically
"""
