"""`parc-jax doctor`: is this installation fit to certify?"""

from importlib import metadata


def doctor() -> int:
    """Check versions and arithmetic of this installation. Example: parc-jax doctor"""
    from parc_jax.common.probes import Finding, probe_all, probe_hang

    for name in (
        "jax",
        "jaxlib",
        "flax",
        "optax",
        "mujoco",
        "mujoco-mjx",
        "brax",
        "scipy",
        "clarabel",
        "numpy",
    ):
        try:
            print(f"  {name:12} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            print(f"  {name:12} missing: pip install {name}")
    findings: list[Finding] = [*probe_all(), probe_hang()]
    for finding in findings:
        print(f"  {'ok  ' if finding.ok else 'FAIL'} {finding.name}: {finding.detail}")
    if all(finding.ok for finding in findings):
        print("Fit to certify.")
        return 0
    print("Not fit to certify: see the lines marked FAIL.")
    return 1
