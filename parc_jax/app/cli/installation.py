"""`parc-jax doctor`: is this installation fit to certify?"""

from importlib import metadata

PACKAGES = "jax jaxlib flax optax mujoco mujoco-mjx brax scipy clarabel numpy"


def doctor() -> int:
    """Check versions and arithmetic of this installation. Example: parc-jax doctor"""
    from parc_jax.common.backend import backend
    from parc_jax.common.probes import probe_all, probe_hang, probe_options
    from parc_jax.safe_set.corridors.first import COMPILER

    for name in PACKAGES.split():
        try:
            print(f"  {name:12} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            print(f"  {name:12} missing: pip install {name}")
    options = probe_options(dict(backend().compiler) | (COMPILER or {}))
    findings = [*probe_all(), options, probe_hang()]
    for finding in findings:
        print(f"  {'ok  ' if finding.ok else 'FAIL'} {finding.name}: {finding.detail}")
    fit = all(finding.ok for finding in findings)
    print("Fit to certify." if fit else "Not fit to certify: see the lines marked FAIL.")
    return 0 if fit else 1
