"""parc_jax: whole sets of provably safe manoeuvres for robots that can be run but not written down."""
