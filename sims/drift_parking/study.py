"""The main job's settings for drift parking; docs/drift_parking.md says how they were chosen."""

from parc_jax.study.settings import Study

STUDY = Study(
    hidden=(8, 8, 8, 8),
    others=((6, 6, 6, 6), (7, 7, 7, 7), (16, 16, 16, 16), ()),
    heading=0,
    names=("m x", "m y", "rad"),
    parameters=("v [m/s]", "sideslip at which braking starts [rad]"),
)
