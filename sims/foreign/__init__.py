"""Black boxes that nobody here wrote. Everything in this folder adapts somebody else's simulator,
or reads somebody else's recorded runs, through the public doors of parc_jax; nothing else does.

| folder | the black box | extra |
|---|---|---|
| slot | crazyflow: a drone through a slot it does not fit through | parc_jax[drone] |
| towers | jsbsim: an aeroplane in turbulence between two towers | parc_jax[flight] |
| kerb | commonroad-vehicle-models: a car of 29 states pulls in | parc_jax[cars] |
| husky | recorded runs of a real robot | none |
| dynobench | dynobench: unicycles, a car with a trailer, in its own scenes | a Python of its own |
"""
